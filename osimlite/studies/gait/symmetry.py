"""Symmetries of a walker: the exchange of its legs, and neutral directions of its state."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.simulation.elements.contact import HuntCrossley
from osimlite.studies.gait.foot_contacts import FootContacts

RELATIVE_TOLERANCE = 1e-6
"""Relative difference up to which two derivatives count as equal."""

DIFFERENCE_STEP = 1e-6
"""Change of a state in central differences (rad, m, rad/s, m/s)."""

MAX_UNEVENNESS = 10.0
"""States whose derivative is this many times less even than the median are left out: a contact
begins there.
"""


def find_leg_exchange(engine: BatchEngine, footing: FootContacts, states: ArrayLike) -> Ints | None:
    """Find the permutation of the state that exchanges the legs.

    The equations of motion decide whether it is a symmetry.

    The coordinates of one leg, from where the legs part to the foot, are exchanged with those of
    the other, and auxiliary states with those that have the same effect there.

    Args:
        engine: engine of the model.
        footing: contacts of two feet.
        states: states at which the derivatives are compared (k, y).

    Returns:
        Index of the entry that replaces each entry of the state (y,), or None if the legs are not
        alike.
    """
    mechanism = engine.mechanism
    body_of = {
        element.pair_name(index): element.surfaces[pair.second].body
        for element in engine.forces.elements
        if isinstance(element, HuntCrossley)
        for index, pair in enumerate(element.pairs)
    }
    legs = []
    for foot in footing.feet:
        chain = [body_of[foot[-1]]]
        while mechanism.bodies[chain[-1]].parent != GROUND:
            chain.append(mechanism.bodies[chain[-1]].parent)
        legs.append(chain[::-1])
    # Feet on one body are not two legs.
    if len(legs) != 2 or legs[0][-1] == legs[1][-1]:
        return None
    # Bodies that both legs share, such as the pelvis, are not exchanged.
    separate_bodies = [
        [body for body in leg if body not in other_leg] for leg, other_leg in (legs, legs[::-1])
    ]
    coordinates = list(engine.order)
    freedoms = [
        [
            engine.order.index(c)
            for body in leg
            for c in mechanism.bodies[body].mobilizer.coordinates
            if c in engine.order
        ]
        for leg in separate_bodies
    ]
    if len(freedoms[0]) != len(freedoms[1]):
        return None
    dof_count = len(coordinates)
    source = np.arange(engine.state.size)
    for first_dof, second_dof in zip(*freedoms, strict=True):
        source[[first_dof, second_dof, dof_count + first_dof, dof_count + second_dof]] = (
            second_dof,
            first_dof,
            dof_count + second_dof,
            dof_count + first_dof,
        )
    match_auxiliary_states(engine, source, np.asarray(states, dtype=float))
    for state in np.asarray(states, dtype=float):
        derivative, exchanged_derivative = (
            np.array(engine.compute_derivative(0.0, y.tolist())) for y in (state, state[source])
        )
        if not np.allclose(
            derivative[source],
            exchanged_derivative,
            rtol=RELATIVE_TOLERANCE,
            atol=RELATIVE_TOLERANCE * np.abs(derivative).max(),
        ):
            return None
    return source


def match_auxiliary_states(engine: BatchEngine, source: Ints, states: Floats) -> None:
    """Complete the left-right permutation of a state for auxiliary states, such as muscle activations.

    Two states match if each has after the exchange the effect on all rates that the other one had
    before. Effects are compared, not names, because models name their sides in many ways.

    Args:
        engine: engine of the model.
        source: permutation (y,), known for values and speeds; changed where an auxiliary state has
            the effect of another one after the exchange.
        states: states at which the effects are compared (k, y).
    """
    first_auxiliary = 2 * len(engine.order)
    if first_auxiliary == engine.state.size:
        return
    # At their start values, auxiliary states that belong together are equal, so that effects differ
    # by the legs only.
    states = engine.state.restart_auxiliary(states)
    columns = [*source[:first_auxiliary], first_auxiliary, first_auxiliary + 1]
    effects_before = np.stack(
        [_compute_effects(engine, state)[:, columns] for state in states], axis=1
    )
    effects_after = np.stack([_compute_effects(engine, state[source]) for state in states], axis=1)
    tolerances = RELATIVE_TOLERANCE * np.abs(effects_before).max(axis=(0, 1))
    for index, effects in enumerate(effects_after):
        equal_states = np.flatnonzero(
            (np.abs(effects_before - effects) <= tolerances).all(axis=(1, 2))
        )
        # A state that keeps its effect under the exchange is not exchanged.
        if len(equal_states) and index not in equal_states:
            source[first_auxiliary + index] = first_auxiliary + equal_states[0]


def _compute_effects(engine: BatchEngine, state: Floats) -> Floats:
    """Return the effect of each auxiliary state (z, 2n + 2).

    It consists of the derivatives of all rates of coordinates and speeds, and of its own rate, by
    the auxiliary state, and of its own rate.
    """
    first_auxiliary = 2 * len(engine.order)
    derivative = np.array(engine.compute_derivative(0.0, state.tolist()))
    rows = []
    for index in range(first_auxiliary, len(state)):
        shifted = state.copy()
        shifted[index] += DIFFERENCE_STEP
        slope = (
            np.array(engine.compute_derivative(0.0, shifted.tolist())) - derivative
        ) / DIFFERENCE_STEP
        rows.append([*slope[:first_auxiliary], slope[index], derivative[index]])
    return np.array(rows)


def find_neutral_directions(engine: BatchEngine, states: ArrayLike) -> Floats:
    """Find the directions of the state that do not change the motion.

    The motion along these directions themselves may change.

    A walker may be anywhere along an even slope, and a body that hangs in its mass centre may turn
    at any rate. The derivative of the state does not change in these directions, or changes along
    them only, at all of the given states.

    Args:
        engine: engine of the model.
        states: states of the walk (k, y).

    Returns:
        Orthonormal directions (y, m).
    """
    candidate_slopes = [
        compute_derivative_matrix(engine, state) for state in np.asarray(states, dtype=float)
    ]
    usual = float(np.median([uneven for _, uneven in candidate_slopes]))
    slopes = [slope for slope, uneven in candidate_slopes if uneven <= MAX_UNEVENNESS * usual]
    size = slopes[0].shape[0]
    result = np.zeros((size, 0))
    # Start from directions that change no rate, then add those that change rates along known neutral
    # directions only, until there are no more.
    while True:
        complement = np.eye(size) - result @ result.T
        rows = np.concatenate([complement @ slope for slope in slopes])
        sizes = np.linalg.norm(rows, axis=1)
        # Rows of different units are scaled to length 1 before singular values are compared.
        rows = rows[sizes > RELATIVE_TOLERANCE] / sizes[sizes > RELATIVE_TOLERANCE, None]
        # The factor R of a QR decomposition has the same singular values and right singular vectors,
        # and is much smaller.
        _, values, vectors = np.linalg.svd(np.linalg.qr(rows, mode="r"))
        values = np.concatenate((values, np.zeros(size - len(values))))
        larger = vectors[values < RELATIVE_TOLERANCE * values[0]].T
        if larger.shape[1] <= result.shape[1]:
            return result
        result = larger


def compute_derivative_matrix(engine: BatchEngine, state: Floats) -> tuple[Floats, float]:
    """Differentiate the rates of the state by the state, with central differences.

    Args:
        engine: engine of the model.
        state: state (y,).

    Returns:
        Matrix (y, y), and its unevenness: the relative difference between both one-sided
        differences. It is large where a contact just touches.
    """
    columns, uneven = [], []
    derivative = np.array(engine.compute_derivative(0.0, state.tolist()))
    for index in range(len(state)):
        state_ahead, state_behind = state.copy(), state.copy()
        state_ahead[index] += DIFFERENCE_STEP
        state_behind[index] -= DIFFERENCE_STEP
        rates = [
            np.array(engine.compute_derivative(0.0, y.tolist()))
            for y in (state_ahead, state_behind)
        ]
        columns.append((rates[0] - rates[1]) / (2.0 * DIFFERENCE_STEP))
        uneven.append((rates[0] - 2.0 * derivative + rates[1]) / DIFFERENCE_STEP)
    slope = np.array(columns).T
    return slope, float(np.linalg.norm(uneven) / np.linalg.norm(slope))
