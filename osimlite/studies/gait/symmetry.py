"""What leaves the motion of a walker as it is: exchanging the legs, and directions that nothing acts along."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from osimlite.mechanics.multibody.mechanism import GROUND
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.simulation.elements.contact import HuntCrossley
from osimlite.studies.gait.foot_contacts import FootContacts

SAME = 1e-6
"""Two derivatives are the same if they differ by less than this part."""

NUDGE = 1e-6
"""By how much a state is moved to differentiate, rad, m and per second."""

UNEVEN = 10.0
"""A state at which the derivative is so many times less even than at most others is left out."""


def leg_exchange(engine: BatchEngine, footing: FootContacts, states: ArrayLike) -> Ints | None:
    """The places (y,) from which the state is taken when the legs change parts, or None if they are not alike.

    The coordinates of one leg, from where the legs part to the foot, change places with those of
    the other, and auxiliary states with those that do the same there. Whether that makes no
    difference to the motion is tried out.

    Args:
        engine: of the model.
        footing: with two feet.
        states: at which to try (k, y).
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
    if len(legs) != 2 or legs[0][-1] == legs[1][-1]:
        return None
    own = [[body for body in leg if body not in other] for leg, other in (legs, legs[::-1])]
    places = list(engine.order)
    freedoms = [
        [
            engine.order.index(c)
            for body in leg
            for c in mechanism.bodies[body].mobilizer.coordinates
            if c in engine.order
        ]
        for leg in own
    ]
    if len(freedoms[0]) != len(freedoms[1]):
        return None
    n = len(places)
    source = np.arange(engine.state.size)
    for one, two in zip(*freedoms, strict=True):
        source[[one, two, n + one, n + two]] = two, one, n + two, n + one
    exchange_auxiliary(engine, source, np.asarray(states, dtype=float))
    for state in np.asarray(states, dtype=float):
        here, there = (
            np.array(engine.compute_derivative(0.0, y.tolist())) for y in (state, state[source])
        )
        if not np.allclose(here[source], there, rtol=SAME, atol=SAME * np.abs(here).max()):
            return None
    return source


def exchange_auxiliary(engine: BatchEngine, source: Ints, states: Floats) -> None:
    """Complete the places (y,) that the legs exchange, which are known for values and speeds.

    Args:
        engine: of the model.
        source: changed where an auxiliary state does what another does when the legs have changed
            parts.
        states: at which to try (k, y).
    """
    first = 2 * len(engine.order)
    if first == engine.state.size:
        return
    # Those that belong together have equal values where all have just started.
    states = engine.state.restart_auxiliary(states)
    columns = [*source[:first], first, first + 1]
    before = np.stack([_compute_effects(engine, state)[:, columns] for state in states], axis=1)
    after = np.stack([_compute_effects(engine, state[source]) for state in states], axis=1)
    tolerances = SAME * np.abs(before).max(axis=(0, 1))
    for index, effects in enumerate(after):
        alike = np.flatnonzero((np.abs(before - effects) <= tolerances).all(axis=(1, 2)))
        if len(alike) and index not in alike:
            source[first + index] = first + alike[0]


def _compute_effects(engine: BatchEngine, state: Floats) -> Floats:
    """What each auxiliary state (z) does: by how much it changes the other rates (2n) and its own, and that rate."""
    first, here = 2 * len(engine.order), np.array(engine.compute_derivative(0.0, state.tolist()))
    rows = []
    for index in range(first, len(state)):
        moved = state.copy()
        moved[index] += NUDGE
        slope = (np.array(engine.compute_derivative(0.0, moved.tolist())) - here) / NUDGE
        rows.append([*slope[:first], slope[index], here[index]])
    return np.array(rows)


def neutral_directions(engine: BatchEngine, states: ArrayLike) -> Floats:
    """Directions (y, m) of the state in which the motion goes on unchanged, but for going that way; orthonormal.

    A walker may be anywhere along an even slope; a body that hangs in its mass centre turns as fast
    as it pleases. The derivative does not change in these directions or changes along one of them,
    at all of the states.

    Args:
        engine: of the model.
        states: some that the walk goes through (k, y).
    """
    found_slopes = [derivative_matrix(engine, state) for state in np.asarray(states, dtype=float)]
    usual = float(np.median([uneven for _, uneven in found_slopes]))
    slopes = [slope for slope, uneven in found_slopes if uneven <= UNEVEN * usual]
    size = slopes[0].shape[0]
    result = np.zeros((size, 0))
    while True:
        rest = np.eye(size) - result @ result.T
        rows = np.concatenate([rest @ slope for slope in slopes])
        sizes = np.linalg.norm(rows, axis=1)
        rows = rows[sizes > SAME] / sizes[sizes > SAME, None]
        # The triangle has the same singular values and right vectors, and is much smaller.
        _, values, vectors = np.linalg.svd(np.linalg.qr(rows, mode="r"))
        values = np.concatenate((values, np.zeros(size - len(values))))
        larger = vectors[values < SAME * values[0]].T
        if larger.shape[1] <= result.shape[1]:
            return result
        result = larger


def derivative_matrix(engine: BatchEngine, state: Floats) -> tuple[Floats, float]:
    """Derivative (y, y) of the rate of change of the state by the state, and how even that is.

    Evenness: the part by which the differences to either side are unlike; much where a contact only
        just touches.
    """
    columns, uneven = [], []
    here = np.array(engine.compute_derivative(0.0, state.tolist()))
    for k in range(len(state)):
        ahead, back = state.copy(), state.copy()
        ahead[k] += NUDGE
        back[k] -= NUDGE
        rates = [np.array(engine.compute_derivative(0.0, y.tolist())) for y in (ahead, back)]
        columns.append((rates[0] - rates[1]) / (2.0 * NUDGE))
        uneven.append((rates[0] - 2.0 * here + rates[1]) / NUDGE)
    slope = np.array(columns).T
    return slope, float(np.linalg.norm(uneven) / np.linalg.norm(slope))
