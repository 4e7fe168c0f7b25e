"""Where walkers start: how to put one on its feet."""

from __future__ import annotations

import numpy as np

from osimlite.base.records import dataclass
from osimlite.simulation.batches import BatchEngine, Floats, Ints
from osimlite.studies.gait.foot_contacts import FootContacts
from osimlite.studies.gait.steps import measure_along_slope

APART = 0.1
"""How far a coordinate is moved to see what it carries, rad or m."""

NUDGE = 1e-6
"""Over so short a time (s) states are moved on to find out how fast their feet are."""


@dataclass(frozen=True, eq=False)
class Carriers:
    """The coordinates that carry a walker as a whole."""

    places: tuple[int, ...]  # of those that move every contact by the same way, in the state (m,)
    lift: int | None  # place of the one among them that lifts it off the ground, or None


def find_carriers(engine: BatchEngine, footing: FootContacts) -> Carriers:
    """Find the coordinates that carry a walker as a whole, by moving each at some poses."""
    n = len(engine.order)
    contacts = _list_contacts(engine, footing)
    rng = np.random.default_rng(0)
    poses = np.hstack((rng.uniform(-0.2, 0.2, (3, n)), np.zeros((3, n))))
    here, depths = (
        _compute_contact_centres(engine, poses)[:, contacts],
        measure_along_slope(engine, poses)[1][:, contacts],
    )
    places, lift = [], None
    for index in range(n):
        moved = poses.copy()
        moved[:, index] += APART
        way = ((_compute_contact_centres(engine, moved)[:, contacts] - here) / APART).reshape(-1, 3)
        if np.ptp(way, axis=0).max() > 1e-9 or np.linalg.norm(way[0]) < 1e-3:
            continue
        places.append(index)
        if (
            lift is None
            and (measure_along_slope(engine, moved)[1][:, contacts] - depths < -0.1 * APART).all()
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
    """States (W, y) lifted or lowered until one foot is so deep (m) in the ground.

    Args:
        engine: of the model.
        footing: its feet.
        states: what to lift; as they are if no coordinate lifts the walker.
        depth: of the deepest contact of the foot.
        foot: which one; -1 for the deeper.
        numbers: of models of the same structure, one row for each state; by default the engine's
            own.
    """
    lift = find_carriers(engine, footing).lift
    if lift is None:
        return states
    rows = np.arange(len(states)) if numbers is not None else None
    feet = footing.feet if foot < 0 else footing.feet[foot : foot + 1]
    contacts = [engine.contacts.index(name) for names in feet for name in names]
    one = states.copy()
    one[:, lift] += APART
    now, then = (
        measure_along_slope(engine, moved, numbers, rows)[1][:, contacts] for moved in (states, one)
    )
    chosen = np.arange(len(states)), now.argmax(axis=1)
    placed = states.copy()
    placed[:, lift] += (depth - now[chosen]) * APART / (then[chosen] - now[chosen])
    return placed


def plant_feet(
    engine: BatchEngine, footing: FootContacts, states: Floats, *, numbers: Floats | None = None
) -> Floats:
    """States (W, y) put on the ground with the deeper foot, which is at rest there.

    The walker is lifted or lowered until that foot only just touches; then the speeds of the
    coordinates that carry it as a whole are those with which the centre of this foot's deepest
    contact does not move.

    Args:
        engine: of the model.
        footing: its feet.
        states: values and speeds of all other coordinates.
        numbers: as in `lift_to_depth`.
    """
    n, count = len(engine.order), np.arange(len(states))
    result = find_carriers(engine, footing)
    free = states.copy()
    # What comes out must not depend, by a rounding, on what was there.
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
    ahead[:, :n] += NUDGE * placed[:, n:]
    back[:, :n] -= NUDGE * placed[:, n:]
    ways = _compute_contact_centres(engine, ahead, numbers, rows) - _compute_contact_centres(
        engine, back, numbers, rows
    )
    speeds = ways[count, deepest] / (2.0 * NUDGE)
    carried = []
    here = _compute_contact_centres(engine, placed, numbers, rows)
    for place in result.places:
        moved = placed.copy()
        moved[:, place] += APART
        carried.append(
            (_compute_contact_centres(engine, moved, numbers, rows) - here)[count, deepest] / APART
        )
    needed = np.einsum("wi,wij->wj", speeds, np.linalg.pinv(np.stack(carried, axis=1)))
    placed[:, [n + place for place in result.places]] -= needed
    return placed


def move_along_neutral_directions(states: Floats, neutral: Floats) -> Floats:
    """States (..., y) moved along the neutral directions (y, m) until the first entries that can be are zero.

    A walker that may be anywhere, and whose trunk may be turned in any way, is then at the origin
    and not turned.
    """
    chosen: list[int] = []
    for index in range(len(neutral)):
        if np.linalg.matrix_rank(neutral[[*chosen, index]], tol=1e-6) > len(chosen):
            chosen.append(index)
    return states - np.linalg.solve(neutral[chosen], states[..., chosen].T).T @ neutral.T


def _compute_contact_centres(
    engine: BatchEngine, states: Floats, numbers: Floats | None = None, rows: Ints | None = None
) -> Floats:
    """Centres of the contacts' second surfaces (k, P, 3), in ground."""
    return engine.locate_contacts(states, numbers, rows)[..., 6:]


def _list_contacts(engine: BatchEngine, footing: FootContacts) -> Ints:
    names = [name for foot in footing.feet for name in foot] + list(footing.falls)
    return np.array([engine.contacts.index(name) for name in names])
