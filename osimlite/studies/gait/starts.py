"""Initial states of walkers on the ground."""

from __future__ import annotations

import numpy as np

from osimlite.base.records import dataclass
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.studies.gait.foot_contacts import FootContacts
from osimlite.studies.gait.steps import measure_along_slope

PROBE_STEP = 0.1
"""Change of a coordinate (rad or m) that tests what it moves."""

PROBE_TIME_S = 1e-6
"""Time step (s) of the central difference that gives the velocities of the feet."""


@dataclass(frozen=True, eq=False)
class Carriers:
    """Coordinates that translate the complete walker.

    Attributes:
        places: offsets in the state of the coordinates that move all contacts by the same vector
            (m,).
        lift: offset of the one among them that lifts the walker off the ground, or None.
    """

    places: tuple[int, ...]
    lift: int | None


def find_carriers(engine: BatchEngine, footing: FootContacts) -> Carriers:
    """Find the coordinates that translate the complete walker, by moving each one in random poses.

    Args:
        engine: engine of the model.
        footing: contacts of the walker.
    """
    n = len(engine.order)
    contacts = _list_contacts(engine, footing)
    rng = np.random.default_rng(0)
    poses = np.hstack((rng.uniform(-0.2, 0.2, (3, n)), np.zeros((3, n))))
    here = _compute_contact_centres(engine, poses)[:, contacts]
    depths = measure_along_slope(engine, poses)[1][:, contacts]
    places, lift = [], None
    for index in range(n):
        moved = poses.copy()
        moved[:, index] += PROBE_STEP
        way = ((_compute_contact_centres(engine, moved)[:, contacts] - here) / PROBE_STEP).reshape(
            -1, 3
        )
        # A carrier moves all contacts equally, in all poses, and by a noticeable amount.
        if np.ptp(way, axis=0).max() > 1e-9 or np.linalg.norm(way[0]) < 1e-3:
            continue
        places.append(index)
        if (
            lift is None
            and (
                measure_along_slope(engine, moved)[1][:, contacts] - depths < -0.1 * PROBE_STEP
            ).all()
        ):
            lift = index
    return Carriers(tuple(places), lift)


def lift_to_depth(
    engine: BatchEngine,
    footing: FootContacts,
    states: Floats,
    depth: float = 0.0,
    foot: int = 0,
    *,
    numbers: Floats | None = None,
) -> Floats:
    """Lift or lower walkers until one foot has a given penetration.

    Args:
        engine: engine of the model.
        footing: contacts of the feet.
        states: states (W, y); they are returned as they are if no coordinate lifts the walker.
        depth: penetration of the deepest contact of the foot (m).
        foot: index of the foot; -1 for the deeper one.
        numbers: numbers of models of the same structure, one row per state; by default those of the
            engine.

    Returns:
        States (W, y).
    """
    lift = find_carriers(engine, footing).lift
    if lift is None:
        return states
    rows = np.arange(len(states)) if numbers is not None else None
    feet = footing.feet if foot < 0 else footing.feet[foot : foot + 1]
    contacts = [engine.contacts.index(name) for names in feet for name in names]
    one = states.copy()
    one[:, lift] += PROBE_STEP
    # The depth is linear in the lifting coordinate, so that two poses determine it.
    now, then = (
        measure_along_slope(engine, moved, numbers, rows)[1][:, contacts] for moved in (states, one)
    )
    deepest = np.arange(len(states)), now.argmax(axis=1)
    placed = states.copy()
    placed[:, lift] += (depth - now[deepest]) * PROBE_STEP / (then[deepest] - now[deepest])
    return placed


def plant_feet(
    engine: BatchEngine, footing: FootContacts, states: Floats, *, numbers: Floats | None = None
) -> Floats:
    """Put walkers on the ground with the deeper foot, which is at rest there.

    The walker is lifted or lowered until this foot just touches. The speeds of the coordinates that
    translate the walker are then set so that the centre of the deepest contact of this foot does
    not move.

    Args:
        engine: engine of the model.
        footing: contacts of the feet.
        states: states (W, y) with values and speeds of all other coordinates.
        numbers: numbers of models of the same structure, one row per state; by default those of the
            engine.

    Returns:
        States (W, y).
    """
    n, count = len(engine.order), np.arange(len(states))
    result = find_carriers(engine, footing)
    free = states.copy()
    # The result must not depend on the carriers' previous values, not even by rounding.
    free[:, [n + place for place in result.places]] = 0.0
    if result.lift is not None:
        free[:, result.lift] = 0.0
    placed = lift_to_depth(engine, footing, free, foot=-1, numbers=numbers)
    if not result.places:
        return placed
    rows = None if numbers is None else count
    feet = np.array([engine.contacts.index(name) for names in footing.feet for name in names])
    deepest = feet[measure_along_slope(engine, placed, numbers, rows)[1][:, feet].argmax(axis=1)]
    ahead, back = placed.copy(), placed.copy()
    # Speeds are rates of coordinates here, so that a small step in time moves the values by them.
    ahead[:, :n] += PROBE_TIME_S * placed[:, n:]
    back[:, :n] -= PROBE_TIME_S * placed[:, n:]
    motions = _compute_contact_centres(engine, ahead, numbers, rows) - _compute_contact_centres(
        engine, back, numbers, rows
    )
    speeds = motions[count, deepest] / (2.0 * PROBE_TIME_S)
    carried = []
    here = _compute_contact_centres(engine, placed, numbers, rows)
    for place in result.places:
        moved = placed.copy()
        moved[:, place] += PROBE_STEP
        carried.append(
            (_compute_contact_centres(engine, moved, numbers, rows) - here)[count, deepest]
            / PROBE_STEP
        )
    # The least-squares solution for the speeds of the carriers that cancel the velocity of the
    # contact.
    needed = np.einsum("wi,wij->wj", speeds, np.linalg.pinv(np.stack(carried, axis=1)))
    placed[:, [n + place for place in result.places]] -= needed
    return placed


def move_along_neutral_directions(states: Floats, neutral: Floats) -> Floats:
    """Move states along neutral directions until the first entries that these can change are zero.

    A walker that may be anywhere, and whose trunk may have any orientation, is then at the origin
    and with the trunk as built.

    Args:
        states: states (..., y).
        neutral: neutral directions (y, m).

    Returns:
        States (..., y).
    """
    # Rows of the neutral directions that are linearly independent.
    selected: list[int] = []
    for index in range(len(neutral)):
        if np.linalg.matrix_rank(neutral[[*selected, index]], tol=1e-6) > len(selected):
            selected.append(index)
    return states - np.linalg.solve(neutral[selected], states[..., selected].T).T @ neutral.T


def _compute_contact_centres(
    engine: BatchEngine, states: Floats, numbers: Floats | None = None, rows: Ints | None = None
) -> Floats:
    """Return the centres of the spheres of contacts (k, P, 3) in ground (m)."""
    return engine.locate_contacts(states, numbers, rows)[..., 6:]


def _list_contacts(engine: BatchEngine, footing: FootContacts) -> Ints:
    """Return the indices of the contacts of feet and falls in the engine."""
    names = [name for foot in footing.feet for name in foot] + list(footing.falls)
    return np.array([engine.contacts.index(name) for name in names])
