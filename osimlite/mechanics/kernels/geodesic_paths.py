"""Shortest or stationary paths around wrap surfaces, for the option `wrapping="geodesic"`.

Between two neighbouring points each PathWrap whose range contains both bends the path where it
touches, independently of other segments. A surface is therefore listed once for each point at which
a bent segment may begin. Of the surfaces that a segment passes through, the one that turns it most
is inserted first; then all geodesics of the segment are corrected together until the length is
stationary; then it may touch, or leave, another surface. Where open surfaces can be passed in
several directions all are tried and the shortest path is chosen, so that lengths do not jump as
another one becomes the shortest. The result depends on the pose alone.

A surface that contains an end of the segment is ignored, as in OpenSim. A segment for which no
geodesics are found stays straight; the only known cases are points on a surface.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.cable_paths import (
    GEODESIC,
    GROUND_END,
    GROUND_START,
    IN_GROUND,
    OBSTACLE_WORK,
)
from osimlite.mechanics.kernels.cable_surfaces import (
    ARC,
    KIND,
    POINT,
    SQUARE,
    STEP,
    SURFACE_NUMBERS,
    TORUS,
    shoot_geodesic,
    surface_value,
)
from osimlite.mechanics.kernels.geodesic_search import (
    OWNER,
    SLOT,
    ends_to_ground,
    line_end,
    line_start,
    search_size,
    smooth_chain,
)
from osimlite.mechanics.kernels.geodesic_starts import (
    ANY_SIDE,
    AS_MEANT,
    PULLED,
    SIDE,
    SURFACE,
    count_ways,
    squared_depth,
    start_on_surface,
)
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME
from osimlite.mechanics.kernels.path_wraps import point_in_surface
from osimlite.mechanics.kernels.paths import (
    AT,
    COUNT,
    IS_KEPT,
    LINK,
    NODE_INTS,
    NODE_WORK,
    NODES_AT,
    ORDER,
    PLACE,
    POINTS,
    STATION,
    TURN,
    WRAPS,
    measure_points,
    place_points,
)
from osimlite.mechanics.kernels.paths import SURFACE as SURFACE_LENGTH
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import place_frame
from osimlite.mechanics.laws.vectors import (
    Vector,
    cross,
    minus,
    norm,
    store_vector,
    times,
    unit,
    vector,
)

WRAP_INTS = 4
"""Number of integers of a wrap; wraps follow the nodes."""
PLACES = 0
"""Index in a wrap of the offset of its numbers, see `geodesic_starts`."""
FIRST = 1
"""Index of the point at which its segment begins."""
LAST = 2
"""Index of the last point at which its segment may end."""
RANGE = 3
"""Index of the first point of the range of its PathWrap."""
CHAIN = 0
"""Index after the wraps of the offset in the record of the slots."""
BEST = 1
"""Index of the offset of the slots of the shortest path."""
SEARCH = 2
"""Index of the offset of the workspace of a search."""
POSES = 3
"""Index of the offset of the poses of the surfaces."""
HOW = 12
"""Index in a pose of how the surface may bend the segment, NOT or see `start_on_surface`."""
ABOUT = 13
"""Offset of the axis about which it turns the segment."""
POSE_NUMBERS = 16
"""Length of a pose: rotation by rows, position in ground, HOW and ABOUT."""
NOT = 0.0
"""Value of HOW of a surface that does not bend the segment."""

TOUCH = 1e-10
"""Smallest angle by which a segment turns around a surface that is inserted (rad)."""
WHOLE = 10.0
"""Added to the angle of surfaces with an active side, so that they come first (rad)."""
INSIDE = 1e-14
"""Value of the function of a surface above which a point counts as inside, relative to SQUARE."""
WAYS = 16
"""Largest number of combinations of directions past open surfaces."""
NEARLY = 0.97
"""A path is dropped if this part of its length exceeds that of the shortest one."""
MEANT = 0
"""Stage of a search in which each surface is passed on its active side."""
STRING = 1
"""Stage in which starts on ellipsoids come from a tightened string."""
ALONE = 2
"""Stage in which the segment is bent around one surface only."""
TURNS = 16
"""Largest number of changes of the list of surfaces in a search."""


def layout_slots(most: int, wraps: int, work: int) -> tuple[list[int], int]:
    """Return the integers after the wraps, and the length of the record.

    Args:
        most: largest number of surfaces that bend one segment.
        wraps: number of wraps.
        work: length of the record without slots.

    Returns:
        The integers CHAIN, BEST, SEARCH and POSES, and the length of the record.
    """
    best = work + SLOT * (most + 2)
    search = best + SLOT * (most + 2)
    poses = search + search_size(most)
    return [work, best, search, poses], poses + POSE_NUMBERS * wraps


def geodesic_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute length and speed of a path with wraps.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the path is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    place_points(model, reals, data, y, item)
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    result, points, size = at(data, i[ITEM.RECORD]), i[POINTS], i[POINTS] + 2 * i[WRAPS]
    order, work = at(result, ORDER), at(result, ORDER + size)
    slots = at(i, NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS])
    place_surfaces(model, data, i, p)
    for k in range(1, int(result[COUNT])):
        mark_near_wraps(i, p, result, slots, int(order[k - 1]), int(order[k]))
    # Backwards, so that the nodes inserted for one segment do not move the segments still to come.
    for k in range(int(result[COUNT]) - 2, -1, -1):
        count = bend_segment(i, p, result, int(order[k]), int(order[k + 1]))
        if count > 0:
            for other in range(int(result[COUNT]) - 1, k, -1):
                order[other + 2 * count] = order[other]
            result[COUNT] += 2.0 * count
        for number in range(count):
            slot = at(result, slots[BEST] + SLOT * (number + 1))
            node = points + 2 * int(slot[OWNER])
            one, two = at(work, NODE_WORK * node), at(work, NODE_WORK * (node + 1))
            store_vector(one, PLACE, vector(slot, GROUND_START + POINT))
            store_vector(two, PLACE, vector(slot, GROUND_END + POINT))
            # The second tangent point carries the length on the surface before it.
            one[SURFACE_LENGTH], two[SURFACE_LENGTH] = 0.0, slot[GEODESIC + ARC]
            one[IS_KEPT] = two[IS_KEPT] = 0.0
            order[k + 2 * number + 1], order[k + 2 * number + 2] = node, node + 1
    measure_points(model, data, y, item)
    return OUTCOME.OK


def place_surfaces(model: Ints, data: Floats, i: Ints, p: Floats) -> None:
    """Compute the poses of the surfaces in ground.

    Args:
        model: integers of the model.
        data: results with the poses of the links; the poses of the surfaces are filled.
        i: integers of the path.
        p: numbers of the path.
    """
    size = i[POINTS] + 2 * i[WRAPS]
    poses = at(data, i[ITEM.RECORD] + i[NODES_AT + NODE_INTS * size + WRAP_INTS * i[WRAPS] + POSES])
    for number in range(i[WRAPS]):
        node, pose = (
            at(i, NODES_AT + NODE_INTS * (i[POINTS] + 2 * number)),
            at(poses, POSE_NUMBERS * number),
        )
        n = at(p, node[AT])
        place_frame(model, data, node[LINK], at(n, TURN), vector(n, STATION), pose)
        pose[HOW] = NOT


def bend_segment(i: Ints, p: Floats, record: Floats, one: int, two: int) -> int:
    """Bend the segment between two points around its surfaces, in the shortest of all combinations.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path.
        one: first point.
        two: second point.

    Returns:
        The number of surfaces, which are in the slots of the shortest path.
    """
    size, near = i[POINTS] + 2 * i[WRAPS], 0
    wraps, work = at(i, NODES_AT + NODE_INTS * size), at(record, ORDER + size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, best, poses = at(record, slots[CHAIN]), at(record, slots[BEST]), at(record, slots[POSES])
    for number in range(i[WRAPS]):
        if wraps[WRAP_INTS * number + FIRST] == one and poses[POSE_NUMBERS * number + HOW] != NOT:
            near += 1
    store_vector(chain, 0, vector(work, NODE_WORK * one + PLACE))
    # `way` counts combinations of directions past open surfaces, as digits of a mixed radix.
    most, least, way, stage = 0, inf, 0, MEANT
    while way < WAYS and near > 0:
        store_vector(chain, SLOT, vector(work, NODE_WORK * two + PLACE))
        count, step = fill_slots(i, p, record, one, two, near, way, stage, least)
        length = chain_length(chain, count) if count >= 0 else inf
        if length < least:
            most, least = count, length
            for k in range(SLOT * (count + 1)):
                best[k] = chain[k]
        way += step
        # On an ellipsoid there may be no geodesic near the start, but a shortest one exists; where
        # surfaces intersect, no smooth path may exist, and one surface alone must do.
        if way == WAYS and least == inf and stage < ALONE:
            way, stage = 0, stage + 1
    return most


def chain_length(chain: Floats, count: int) -> float:
    """Return the length of a segment that is bent around surfaces (m).

    Args:
        chain: slots.
        count: number of slots in use.
    """
    length = norm(minus(line_end(chain, 0, count), line_start(chain, 1)))
    for k in range(1, count + 1):
        line = minus(line_end(chain, k, count), line_start(chain, k + 1))
        length += chain[SLOT * k + GEODESIC + ARC] + norm(line)
    return length


def fill_slots(
    i: Ints,
    p: Floats,
    record: Floats,
    one: int,
    two: int,
    near: int,
    way: int,
    stage: int,
    least: float,
) -> tuple[int, int]:
    """Fill the slots with the surfaces that bend the segment between two points.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path.
        one: first point.
        two: second point.
        near: number of surfaces that may bend the segment.
        way: number of the combination of directions.
        stage: MEANT, STRING or ALONE.
        least: length of the shortest path so far (m).

    Returns:
        The number of surfaces, -1 if there is no such path that is shorter; and the increment to the
        number of the next combination with another direction past a surface that was touched.
    """
    size, count, step = i[POINTS] + 2 * i[WRAPS], 0, WAYS
    work, wraps = at(record, ORDER + size), at(i, NODES_AT + NODE_INTS * size)
    slots = at(wraps, WRAP_INTS * i[WRAPS])
    chain, room, poses = (
        at(record, slots[CHAIN]),
        at(record, slots[SEARCH]),
        at(record, slots[POSES]),
    )
    for number in range(i[WRAPS]):
        store_vector(poses, POSE_NUMBERS * number + ABOUT, (0.0, 0.0, 0.0))
    # A surface that is passed in another direction needs the others in place before the chain is
    # smoothed.
    waits = False
    for _ in range(TURNS):
        before = count
        # A geodesic that has shrunk to nothing does not touch.
        for k in range(count, 0, -1):
            if not chain[SLOT * k + GEODESIC + ARC] > 0.0:
                remove_slot(chain, count, k)
                count -= 1
        # A surface that was removed may be inserted again once the rest is smooth.
        if count == before:
            number, place, axis = find_largest_turn(i, p, wraps, poses, one, chain, count, room)
            if (place == 0 and not waits) or (count > 0 and stage == ALONE):
                return count, step
            waits = False
            if place > 0:
                numbers, pose = (
                    at(p, wraps[WRAP_INTS * number + PLACES]),
                    at(poses, POSE_NUMBERS * number),
                )
                is_open = numbers[SIDE] == 0.0 and numbers[SURFACE + KIND] != TORUS and step > 1
                if is_open and norm(vector(pose, ABOUT)) == 0.0:
                    # The direction past an open surface is chosen when it is first touched, and
                    # kept from then on.
                    a, b = node_in_surface(pose, work, one), node_in_surface(pose, work, two)
                    ways = min(count_ways(at(numbers, SURFACE), a, b, near == 1), step)
                    if ways > 1:
                        step //= ways
                        which = way // step % ways
                        # Directions 2 and 3 are perpendicular to 0 and 1; odd ones are opposite to
                        # even ones.
                        if which > 1:
                            axis = cross(axis, unit(minus(b, a)))
                        store_vector(pose, ABOUT, times(-1.0 if which % 2 == 1 else 1.0, axis))
                        # In other directions than the first, wait for further surfaces: alone, the
                        # segment might slide back.
                        waits = which > 0 and stage < ALONE
                insert_slot(numbers, pose, chain, count, place, number)
                if not lay_chain(numbers, pose, chain, count + 1, place, stage, room):
                    remove_slot(chain, count + 1, place)
                    continue
                count += 1
                if waits:
                    continue
        elif count == 0:
            break
        # A chain that is clearly longer than the best one need not be smoothed.
        if NEARLY * chain_length(chain, count) > least or not smooth_chain(chain, count, room):
            break
    return -1, step


def mark_near_wraps(i: Ints, p: Floats, record: Floats, slots: Ints, one: int, two: int) -> None:
    """Mark the wraps that may bend the segment between two points outside of them, and how.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path with the poses of the surfaces; HOW is filled.
        slots: integers after the wraps.
        one: first point.
        two: second point.
    """
    size = i[POINTS] + 2 * i[WRAPS]
    wraps, work = at(i, NODES_AT + NODE_INTS * size), at(record, ORDER + size)
    for number in range(i[WRAPS]):
        wrap_ints, pose = (
            at(wraps, WRAP_INTS * number),
            at(record, slots[POSES] + POSE_NUMBERS * number),
        )
        if wrap_ints[FIRST] == one:
            numbers = at(p, wrap_ints[PLACES])
            surface = at(numbers, SURFACE)
            # An end inside the surface makes OpenSim ignore it.
            inside, a, b = (
                INSIDE * surface[SQUARE],
                node_in_surface(pose, work, one),
                node_in_surface(pose, work, two),
            )
            is_near = (
                two <= wrap_ints[LAST]
                and surface_value(surface, a) <= inside
                and surface_value(surface, b) <= inside
            )
            pose[HOW] = AS_MEANT if is_near else NOT
            # Of several segments around one cylinder or torus, only the deepest must obey its side.
            if (
                is_near
                and wrap_ints[LAST] - wrap_ints[RANGE] > 1
                and (numbers[SIDE] != 0.0 or surface[KIND] == TORUS)
            ):
                deepest = squared_depth(surface, a, b)
                for k in range(1, int(record[COUNT])):
                    before, after = int(record[ORDER + k - 1]), int(record[ORDER + k])
                    others = wrap_ints[RANGE] <= before != one and after <= wrap_ints[LAST]
                    if (
                        others
                        and squared_depth(
                            surface,
                            node_in_surface(pose, work, before),
                            node_in_surface(pose, work, after),
                        )
                        < deepest
                    ):
                        pose[HOW] = ANY_SIDE


def node_in_surface(pose: Floats, work: Floats, node: int) -> Vector:
    """Return the position of a node in the frame of a surface (m).

    Args:
        pose: pose of the surface in ground.
        work: results of the nodes.
        node: number of the node.
    """
    return point_in_surface(pose, vector(work, NODE_WORK * node + PLACE))


def find_slot(chain: Floats, count: int, number: int) -> int:
    """Return the slot of a wrap, 0 if it has no slot.

    Args:
        chain: slots.
        count: number of slots in use.
        number: number of the wrap.
    """
    for k in range(1, count + 1):
        if chain[SLOT * k + OWNER] == number:
            return k
    return 0


def remove_slot(chain: Floats, count: int, place: int) -> None:
    """Remove a slot from the chain, and move those after it.

    Args:
        chain: slots; changed.
        count: number of slots in use.
        place: slot to remove.
    """
    for k in range(SLOT * place, SLOT * (count + 1)):
        chain[k] = chain[k + SLOT]


def find_largest_turn(
    i: Ints,
    p: Floats,
    wraps: Ints,
    poses: Floats,
    one: int,
    chain: Floats,
    count: int,
    work: Floats,
) -> tuple[int, int, Vector]:
    """Find the wrap that turns a line of the chain most.

    Those with an active side come first, since sides refer to the points of the path.

    Args:
        i: integers of the path.
        p: numbers of the path.
        wraps: integers of the wraps.
        poses: poses of the surfaces.
        one: first point of the segment.
        chain: slots.
        count: number of slots in use.
        work: workspace of a search.

    Returns:
        The wrap, the slot after the line (0 if no wrap turns a line), and the axis of the turn.
    """
    result, place, most, axis = 0, 0, 0.0, (0.0, 0.0, 0.0)
    for number in range(i[WRAPS]):
        wrap_ints, pose = at(wraps, WRAP_INTS * number), at(poses, POSE_NUMBERS * number)
        if wrap_ints[FIRST] == one and pose[HOW] != NOT and find_slot(chain, count, number) == 0:
            numbers, about = at(p, wrap_ints[PLACES]), vector(pose, ABOUT)
            surface, before = at(numbers, SURFACE), WHOLE if numbers[SIDE] != 0.0 else 0.0
            inside = INSIDE * surface[SQUARE]
            for k in range(count + 1):
                a, b = (
                    point_in_surface(pose, line_start(chain, k + 1)),
                    point_in_surface(pose, line_end(chain, k, count)),
                )
                if surface_value(surface, a) <= inside and surface_value(surface, b) <= inside:
                    turn, point, way, _ = start_on_surface(
                        numbers, a, b, pose[HOW], (0.0, 0.0, 0.0), work
                    )
                    # The shorter way decides which line meets the surface, even if there is no
                    # other way.
                    if turn > TOUCH and norm(about) > 0.0:
                        other, there, onwards, _ = start_on_surface(
                            numbers, a, b, pose[HOW], about, work
                        )
                        if other > TOUCH:
                            turn, point, way = other, there, onwards
                    if turn > TOUCH and turn + before > most:
                        result, place, most, axis = number, k + 1, turn + before, cross(point, way)
    return result, place, axis


def insert_slot(
    p: Floats, pose: Floats, chain: Floats, count: int, place: int, number: int
) -> None:
    """Insert a surface into a slot of the chain.

    Args:
        p: numbers of the wrap.
        pose: pose of the surface in ground.
        chain: slots; changed.
        count: number of slots in use.
        place: slot of the surface; those from there on move by one.
        number: number of the wrap.
    """
    for k in range(SLOT * (count + 3) - 1, SLOT * (place + 1) - 1, -1):
        chain[k] = chain[k - SLOT]
    slot = at(chain, SLOT * place)
    # STEP 0 selects the exact integration of geodesics.
    slot[OWNER], slot[GEODESIC + STEP] = number, 0.0
    for k in range(HOW):
        slot[IN_GROUND + k] = pose[k]
    for k in range(SURFACE_NUMBERS):
        slot[OBSTACLE_WORK + k] = p[SURFACE + k]


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
        stage: MEANT, STRING or ALONE.
        work: workspace of a search.

    Returns:
        Whether it touches.
    """
    first, second = (
        point_in_surface(pose, line_start(chain, k)),
        point_in_surface(pose, line_end(chain, k, count)),
    )
    about, slot = vector(pose, ABOUT), at(chain, SLOT * k)
    turn, point, way, arc = start_on_surface(
        p, first, second, PULLED if stage == STRING else pose[HOW], about, work
    )
    if not (
        turn > TOUCH
        and shoot_geodesic(at(slot, OBSTACLE_WORK), point, way, arc, at(slot, GEODESIC), work)
    ):
        return False
    # The axis follows the geodesic, so that later calls keep to this side of the surface.
    if norm(about) > 0.0:
        store_vector(pose, ABOUT, cross(point, way))
    ends_to_ground(slot)
    return True
