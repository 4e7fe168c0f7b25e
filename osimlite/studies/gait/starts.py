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
        offsets: offsets in the state of the coordinates that move all contacts by the same vector
            (m,).
        lift_offset: offset of the coordinate that lifts the walker off the ground, which is one of
            `offsets`; None if there is none.
    """

    offsets: tuple[int, ...]
    lift_offset: int | None


def find_carriers(engine: BatchEngine, foot_contacts: FootContacts) -> Carriers:
    """Return the coordinates that translate the complete walker.

    They are found by moving each coordinate in random poses.

    Args:
        engine: engine of the model.
        foot_contacts: contacts of the walker.
    """
    dof_count = len(engine.order)
    contacts = _list_contacts(engine, foot_contacts)
    rng = np.random.default_rng(0)
    poses = np.hstack((rng.uniform(-0.2, 0.2, (3, dof_count)), np.zeros((3, dof_count))))
    centres = _compute_contact_centres(engine, poses)[:, contacts]
    depths = measure_along_slope(engine, poses)[1][:, contacts]
    carrier_offsets: list[int] = []
    lift_offset: int | None = None
    for index in range(dof_count):
        displaced_poses = poses.copy()
        displaced_poses[:, index] += PROBE_STEP
        directions = (
            (_compute_contact_centres(engine, displaced_poses)[:, contacts] - centres) / PROBE_STEP
        ).reshape(-1, 3)
        # A carrier moves all contacts equally, in all poses, and by a noticeable amount.
        if np.ptp(directions, axis=0).max() > 1e-9 or np.linalg.norm(directions[0]) < 1e-3:
            continue
        carrier_offsets.append(index)
        # The lifting coordinate is the first one that reduces the penetration of all contacts.
        if (
            lift_offset is None
            and (
                measure_along_slope(engine, displaced_poses)[1][:, contacts] - depths
                < -0.1 * PROBE_STEP
            ).all()
        ):
            lift_offset = index
    return Carriers(tuple(carrier_offsets), lift_offset)


def lift_to_depth(
    engine: BatchEngine,
    foot_contacts: FootContacts,
    states: Floats,
    depth: float = 0.0,
    foot: int = 0,
    *,
    numbers: Floats | None = None,
) -> Floats:
    """Lift or lower walkers until the deepest contact of a foot has a given penetration.

    Args:
        engine: engine of the model.
        foot_contacts: contacts of the feet.
        states: states (W, y); they are returned as they are if no coordinate lifts the walker.
        depth: penetration of the deepest contact of the foot (m).
        foot: index of the foot; -1 for the deeper one.
        numbers: parameters of a packed model of the same structure for each state (W, m); by
            default all states are of the model of the engine.

    Returns:
        States (W, y).
    """
    lift_offset = find_carriers(engine, foot_contacts).lift_offset
    if lift_offset is None:
        return states
    # Row of `numbers` that belongs to each state.
    rows = np.arange(len(states)) if numbers is not None else None
    feet = foot_contacts.feet if foot < 0 else foot_contacts.feet[foot : foot + 1]
    contacts = [engine.contacts.index(name) for names in feet for name in names]
    lifted = states.copy()
    lifted[:, lift_offset] += PROBE_STEP
    # The depth is linear in the lifting coordinate, so that two poses determine it.
    depths, lifted_depths = (
        measure_along_slope(engine, poses, numbers, rows)[1][:, contacts]
        for poses in (states, lifted)
    )
    deepest = np.arange(len(states)), depths.argmax(axis=1)
    result = states.copy()
    result[:, lift_offset] += (
        (depth - depths[deepest]) * PROBE_STEP / (lifted_depths[deepest] - depths[deepest])
    )
    return result


def plant_feet(
    engine: BatchEngine,
    foot_contacts: FootContacts,
    states: Floats,
    *,
    numbers: Floats | None = None,
) -> Floats:
    """Put walkers on the ground with the deeper foot, which is at rest there.

    The walker is lifted or lowered until this foot just touches. The speeds of the coordinates that
    translate the walker are then set so that the centre of the deepest contact of this foot does
    not move.

    Args:
        engine: engine of the model.
        foot_contacts: contacts of the feet.
        states: states (W, y) with values and speeds of all other coordinates.
        numbers: parameters of a packed model of the same structure for each state (W, m); by
            default all states are of the model of the engine.

    Returns:
        States (W, y).
    """
    dof_count = len(engine.order)
    state_indices = np.arange(len(states))
    carriers = find_carriers(engine, foot_contacts)
    unplaced = states.copy()
    # The result must not depend on the carriers' previous values, not even by rounding.
    unplaced[:, [dof_count + index for index in carriers.offsets]] = 0.0
    if carriers.lift_offset is not None:
        unplaced[:, carriers.lift_offset] = 0.0
    planted = lift_to_depth(engine, foot_contacts, unplaced, foot=-1, numbers=numbers)
    if not carriers.offsets:
        return planted
    rows = None if numbers is None else state_indices
    contacts = np.array(
        [engine.contacts.index(name) for names in foot_contacts.feet for name in names]
    )
    depths = measure_along_slope(engine, planted, numbers, rows)[1][:, contacts]
    deepest = contacts[depths.argmax(axis=1)]
    poses_ahead, poses_behind = planted.copy(), planted.copy()
    # Speeds are rates of coordinates here, so that a small step in time moves the values by them.
    poses_ahead[:, :dof_count] += PROBE_TIME_S * planted[:, dof_count:]
    poses_behind[:, :dof_count] -= PROBE_TIME_S * planted[:, dof_count:]
    motions = _compute_contact_centres(
        engine, poses_ahead, numbers, rows
    ) - _compute_contact_centres(engine, poses_behind, numbers, rows)
    speeds = motions[state_indices, deepest] / (2.0 * PROBE_TIME_S)
    carrier_directions = []
    centres = _compute_contact_centres(engine, planted, numbers, rows)
    for index in carriers.offsets:
        displaced_poses = planted.copy()
        displaced_poses[:, index] += PROBE_STEP
        carrier_directions.append(
            (_compute_contact_centres(engine, displaced_poses, numbers, rows) - centres)[
                state_indices, deepest
            ]
            / PROBE_STEP
        )
    # The least-squares solution for the speeds of the carriers that cancel the velocity of the
    # contact.
    carrier_speeds = np.einsum(
        "wi,wij->wj", speeds, np.linalg.pinv(np.stack(carrier_directions, axis=1))
    )
    planted[:, [dof_count + index for index in carriers.offsets]] -= carrier_speeds
    return planted


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
    engine: BatchEngine,
    states: Floats,
    numbers: Floats | None = None,
    rows: Ints | None = None,
) -> Floats:
    """Return the centres of the spheres of contacts (W, P, 3) in ground (m).

    Args:
        engine: engine of the model.
        states: states (W, y).
        numbers: parameters of packed models of the same structure, one row per model; by
            default those of the engine.
        rows: row of `numbers` for each state; None for the first row.
    """
    # Centre and normal of the surface below come first, then the centre of the sphere.
    return engine.locate_contacts(states, numbers, rows)[..., 6:]


def _list_contacts(engine: BatchEngine, foot_contacts: FootContacts) -> Ints:
    """Return the indices in the engine of the contacts of feet, and of those that mean a fall."""
    names = [name for foot in foot_contacts.feet for name in foot] + list(
        foot_contacts.fall_contacts
    )
    return np.array([engine.contacts.index(name) for name in names])
