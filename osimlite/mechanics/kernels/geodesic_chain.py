"""Chain of the surfaces that bend a segment of a path, in the order in which the path touches them.

Each surface has a slot, see `geodesic_search`. Slots are inserted, laid around their surface
between their neighbours, and removed, until the chain bends the segment around everything.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.cable_records import OBSTACLE_WORK
from osimlite.mechanics.kernels.cable_surfaces import (
    GEODESIC,
    SURFACE,
    shoot_geodesic,
)
from osimlite.mechanics.kernels.geodesic_search import (
    SLOT,
    ends_to_ground,
    line_end,
    line_start,
)
from osimlite.mechanics.kernels.geodesic_starts import BENDING, WRAP_NUMBERS, start_on_surface
from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.path_wraps import point_in_surface
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.vectors import (
    cross,
    minus,
    norm,
    store_vector,
    vector,
)


class SURFACE_POSE(metaclass=Record):
    """Pose of a surface: rotation by rows and position in ground come first."""

    HOW = 12
    """Way in which the surface may bend the segment, see `BENDING`."""
    ABOUT = 13
    """Axis about which it turns the segment."""
    SIZE = 16
    """Length of a pose: rotation by rows, position in ground, `HOW` and `ABOUT`."""


MIN_TURN_RAD = 1e-10
"""Smallest angle by which a segment turns around a surface that is inserted (rad)."""


class SEARCH_STAGE(metaclass=Record):
    """Stages of a search."""

    ACTIVE_SIDE = 0
    """Each surface is passed on its active side."""
    STRING = 1
    """Starts on ellipsoids come from a tightened string."""
    ALONE = 2
    """The segment is bent around one surface only."""


def chain_length(chain: Floats, count: int) -> float:
    """Return the length of a segment that is bent around surfaces (m).

    Args:
        chain: slots.
        count: number of slots in use.
    """
    length = norm(minus(line_end(chain, 0, count), line_start(chain, 1)))
    for k in range(1, count + 1):
        line = minus(line_end(chain, k, count), line_start(chain, k + 1))
        length += chain[SLOT.SIZE * k + OBSTACLE_WORK.CURVE + GEODESIC.ARC] + norm(line)
    return length


def find_slot(chain: Floats, count: int, number: int) -> int:
    """Return the slot of a wrap, 0 if it has no slot.

    Args:
        chain: slots.
        count: number of slots in use.
        number: number of the wrap.
    """
    for k in range(1, count + 1):
        if chain[SLOT.SIZE * k + SLOT.OWNER] == number:
            return k
    return 0


def remove_slot(chain: Floats, count: int, slot_index: int) -> None:
    """Remove a slot from the chain, and move those after it.

    Args:
        chain: slots; changed.
        count: number of slots in use.
        slot_index: slot to remove.
    """
    for k in range(SLOT.SIZE * slot_index, SLOT.SIZE * (count + 1)):
        chain[k] = chain[k + SLOT.SIZE]


def insert_slot(
    p: Floats, pose: Floats, chain: Floats, count: int, slot_index: int, number: int
) -> None:
    """Insert a surface into a slot of the chain.

    Args:
        p: numbers of the wrap.
        pose: pose of the surface in ground.
        chain: slots; changed.
        count: number of slots in use.
        slot_index: slot of the surface; those from there on move by one.
        number: number of the wrap.
    """
    for k in range(SLOT.SIZE * (count + 3) - 1, SLOT.SIZE * (slot_index + 1) - 1, -1):
        chain[k] = chain[k - SLOT.SIZE]
    slot = at(chain, SLOT.SIZE * slot_index)
    # GEODESIC.STEP 0 selects the exact integration of geodesics.
    slot[SLOT.OWNER], slot[OBSTACLE_WORK.CURVE + GEODESIC.STEP] = number, 0.0
    for k in range(SURFACE_POSE.HOW):
        slot[OBSTACLE_WORK.IN_GROUND + k] = pose[k]
    for k in range(SURFACE.SIZE):
        slot[OBSTACLE_WORK.SIZE + k] = p[WRAP_NUMBERS.SURFACE + k]


def lay_chain(
    p: Floats, pose: Floats, chain: Floats, count: int, k: int, stage: int, work: Floats
) -> bool:
    """Lay the chain around the surface in a slot, between its neighbours.

    Args:
        p: numbers of the wrap.
        pose: pose of the surface in ground; its axis of the turn is updated.
        chain: slots; the geodesic of slot `k` is filled.
        count: number of slots in use.
        k: slot of the surface.
        stage: ACTIVE_SIDE, STRING or ALONE of `SEARCH_STAGE`.
        work: workspace of a search.

    Returns:
        Whether the chain touches the surface.
    """
    first = point_in_surface(pose, line_start(chain, k))
    second = point_in_surface(pose, line_end(chain, k, count))
    about = vector(pose, SURFACE_POSE.ABOUT)
    slot = at(chain, SLOT.SIZE * k)
    turn, point, start_direction, arc = start_on_surface(
        p,
        first,
        second,
        BENDING.STRING if stage == SEARCH_STAGE.STRING else pose[SURFACE_POSE.HOW],
        about,
        work,
    )
    if not (
        turn > MIN_TURN_RAD
        and shoot_geodesic(
            at(slot, OBSTACLE_WORK.SIZE),
            point,
            start_direction,
            arc,
            at(slot, OBSTACLE_WORK.CURVE),
            work,
        )
    ):
        return False
    # The axis follows the geodesic, so that later calls keep to this side of the surface.
    if norm(about) > 0.0:
        store_vector(pose, SURFACE_POSE.ABOUT, cross(point, start_direction))
    ends_to_ground(slot)
    return True
