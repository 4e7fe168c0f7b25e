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

from osimlite.mechanics.kernels.cable_records import OBSTACLE_WORK
from osimlite.mechanics.kernels.cable_surfaces import (
    END_NUMBERS,
    GEODESIC,
    SURFACE,
    SURFACE_TYPE,
    surface_value,
)
from osimlite.mechanics.kernels.geodesic_chain import (
    MIN_TURN_RAD,
    SEARCH_STAGE,
    SURFACE_POSE,
    chain_length,
    find_slot,
    insert_slot,
    lay_chain,
    remove_slot,
)
from osimlite.mechanics.kernels.geodesic_search import (
    SLOT,
    line_end,
    line_start,
    search_size,
    smooth_chain,
)
from osimlite.mechanics.kernels.geodesic_starts import BENDING, WRAP_NUMBERS, start_on_surface
from osimlite.mechanics.kernels.layout import ITEM, OUTCOME, Record
from osimlite.mechanics.kernels.path_wraps import point_in_surface
from osimlite.mechanics.kernels.paths import (
    NODE,
    NODE_NUMBERS,
    NODE_WORK,
    PATH,
    PATH_WORK,
    measure_points,
    place_points,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import place_frame
from osimlite.mechanics.kernels.segment_depths import count_directions, squared_depth
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


class GEODESIC_WRAP(metaclass=Record):
    """Integers of a wrap; wraps follow the nodes."""

    NUMBERS = 0
    """Offset of its numbers, see `geodesic_starts`."""
    FIRST = 1
    """Point at which its segment begins."""
    LAST = 2
    """Last point at which its segment may end."""
    RANGE = 3
    """First point of the range of its PathWrap."""
    SIZE = 4
    """Number of integers of a wrap; wraps follow the nodes."""


class GEODESIC_PATH(metaclass=Record):
    """Integers after the wraps."""

    CHAIN = 0
    """Offset in the record of the slots."""
    BEST = 1
    """Offset of the slots of the shortest path."""
    SEARCH = 2
    """Offset of the workspace of a search."""
    POSES = 3
    """Offset of the poses of the surfaces."""


ACTIVE_SIDE_PRIORITY = 10.0
"""Added to the angle of surfaces with an active side, so that they come first (rad)."""
INSIDE = 1e-14
"""Value of a surface's function above which a point counts as inside, relative to `SURFACE.SQUARE`."""
MAX_COMBINATIONS = 16
"""Largest number of combinations of directions past open surfaces."""
MAX_LENGTH_RATIO = 0.97
"""A path is dropped if this part of its length exceeds that of the shortest one."""


MAX_CHANGES = 16
"""Largest number of changes of the list of surfaces in a search."""


def layout_slots(slot_count: int, wraps: int, work: int) -> tuple[list[int], int]:
    """Return the integers after the wraps, and the length of the record.

    Args:
        slot_count: largest number of surfaces that bend one segment.
        wraps: number of wraps.
        work: length of the record without slots.

    Returns:
        The integers CHAIN, BEST, SEARCH and POSES of `GEODESIC_PATH`, and the length of the record.
    """
    best = work + SLOT.SIZE * (slot_count + 2)
    search = best + SLOT.SIZE * (slot_count + 2)
    poses = search + search_size(slot_count)
    return [work, best, search, poses], poses + SURFACE_POSE.SIZE * wraps


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
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    points = i[PATH.POINTS]
    size = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + size)
    slots = at(i, PATH.NODES_AT + NODE.SIZE * size + GEODESIC_WRAP.SIZE * i[PATH.WRAPS])
    place_surfaces(model, data, i, p)
    for k in range(1, int(result[PATH_WORK.COUNT])):
        mark_near_wraps(i, p, result, slots, int(order[k - 1]), int(order[k]))
    # Backwards, so that the nodes inserted for one segment do not move the segments still to come.
    for k in range(int(result[PATH_WORK.COUNT]) - 2, -1, -1):
        count = bend_segment(i, p, result, int(order[k]), int(order[k + 1]))
        if count > 0:
            for position in range(int(result[PATH_WORK.COUNT]) - 1, k, -1):
                order[position + 2 * count] = order[position]
            result[PATH_WORK.COUNT] += 2.0 * count
        for number in range(count):
            slot = at(result, slots[GEODESIC_PATH.BEST] + SLOT.SIZE * (number + 1))
            node = points + 2 * int(slot[SLOT.OWNER])
            first_node = at(work, NODE_WORK.SIZE * node)
            second_node = at(work, NODE_WORK.SIZE * (node + 1))
            store_vector(
                first_node,
                NODE_WORK.POSITION,
                vector(slot, OBSTACLE_WORK.GROUND_START + END_NUMBERS.POINT),
            )
            store_vector(
                second_node,
                NODE_WORK.POSITION,
                vector(slot, OBSTACLE_WORK.GROUND_END + END_NUMBERS.POINT),
            )
            # The second tangent point carries the length on the surface before it.
            first_node[NODE_WORK.SURFACE], second_node[NODE_WORK.SURFACE] = (
                0.0,
                slot[OBSTACLE_WORK.CURVE + GEODESIC.ARC],
            )
            first_node[NODE_WORK.IS_CACHED] = second_node[NODE_WORK.IS_CACHED] = 0.0
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
    size = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    poses = at(
        data,
        i[ITEM.RECORD]
        + i[
            PATH.NODES_AT
            + NODE.SIZE * size
            + GEODESIC_WRAP.SIZE * i[PATH.WRAPS]
            + GEODESIC_PATH.POSES
        ],
    )
    for number in range(i[PATH.WRAPS]):
        node = at(i, PATH.NODES_AT + NODE.SIZE * (i[PATH.POINTS] + 2 * number))
        pose = at(poses, SURFACE_POSE.SIZE * number)
        n = at(p, node[NODE.AT])
        place_frame(
            model,
            data,
            node[NODE.LINK],
            at(n, NODE_NUMBERS.TURN),
            vector(n, NODE_NUMBERS.STATION),
            pose,
        )
        pose[SURFACE_POSE.HOW] = BENDING.NOT


def bend_segment(i: Ints, p: Floats, record: Floats, first_node: int, second_node: int) -> int:
    """Bend the segment between two points around its surfaces, in the shortest of all combinations.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path.
        first_node: first point.
        second_node: second point.

    Returns:
        The number of surfaces, which are in the slots of the shortest path.
    """
    size = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    near_count = 0
    wraps = at(i, PATH.NODES_AT + NODE.SIZE * size)
    work = at(record, PATH_WORK.ORDER + size)
    slots = at(wraps, GEODESIC_WRAP.SIZE * i[PATH.WRAPS])
    chain = at(record, slots[GEODESIC_PATH.CHAIN])
    best = at(record, slots[GEODESIC_PATH.BEST])
    poses = at(record, slots[GEODESIC_PATH.POSES])
    for number in range(i[PATH.WRAPS]):
        if (
            wraps[GEODESIC_WRAP.SIZE * number + GEODESIC_WRAP.FIRST] == first_node
            and poses[SURFACE_POSE.SIZE * number + SURFACE_POSE.HOW] != BENDING.NOT
        ):
            near_count += 1
    store_vector(chain, 0, vector(work, NODE_WORK.SIZE * first_node + NODE_WORK.POSITION))
    # `combination` counts combinations of directions past open surfaces, as digits of a mixed radix.
    best_count, shortest_length, combination, stage = 0, inf, 0, SEARCH_STAGE.ACTIVE_SIDE
    while combination < MAX_COMBINATIONS and near_count > 0:
        store_vector(
            chain, SLOT.SIZE, vector(work, NODE_WORK.SIZE * second_node + NODE_WORK.POSITION)
        )
        count, step = fill_slots(
            i, p, record, first_node, second_node, near_count, combination, stage, shortest_length
        )
        length = chain_length(chain, count) if count >= 0 else inf
        if length < shortest_length:
            best_count, shortest_length = count, length
            for k in range(SLOT.SIZE * (count + 1)):
                best[k] = chain[k]
        combination += step
        # On an ellipsoid there may be no geodesic near the start, but a shortest one exists; where
        # surfaces intersect, no smooth path may exist, and one surface alone must do.
        if (
            combination == MAX_COMBINATIONS
            and shortest_length == inf
            and stage < SEARCH_STAGE.ALONE
        ):
            combination = 0
            stage += 1
    return best_count


def fill_slots(
    i: Ints,
    p: Floats,
    record: Floats,
    first_node: int,
    second_node: int,
    near_count: int,
    combination: int,
    stage: int,
    shortest_length: float,
) -> tuple[int, int]:
    """Fill the slots with the surfaces that bend the segment between two points.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path.
        first_node: first point.
        second_node: second point.
        near_count: number of surfaces that may bend the segment.
        combination: number of the combination of directions.
        stage: ACTIVE_SIDE, STRING or ALONE of `SEARCH_STAGE`.
        shortest_length: length of the shortest path so far (m).

    Returns:
        The number of surfaces, -1 if there is no such path that is shorter; and the increment to the
        number of the next combination with another direction past a surface that was touched.
    """
    size = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    count = 0
    step = MAX_COMBINATIONS
    work = at(record, PATH_WORK.ORDER + size)
    wraps = at(i, PATH.NODES_AT + NODE.SIZE * size)
    slots = at(wraps, GEODESIC_WRAP.SIZE * i[PATH.WRAPS])
    chain = at(record, slots[GEODESIC_PATH.CHAIN])
    search_work = at(record, slots[GEODESIC_PATH.SEARCH])
    poses = at(record, slots[GEODESIC_PATH.POSES])
    for number in range(i[PATH.WRAPS]):
        store_vector(poses, SURFACE_POSE.SIZE * number + SURFACE_POSE.ABOUT, (0.0, 0.0, 0.0))
    # A surface that is passed in another direction needs the others in place before the chain is
    # smoothed.
    needs_others = False
    for _ in range(MAX_CHANGES):
        previous_count = count
        # A geodesic that has shrunk to nothing does not touch.
        for k in range(count, 0, -1):
            if not chain[SLOT.SIZE * k + OBSTACLE_WORK.CURVE + GEODESIC.ARC] > 0.0:
                remove_slot(chain, count, k)
                count -= 1
        # A surface that was removed may be inserted again once the rest is smooth.
        if count == previous_count:
            number, slot_index, axis = find_largest_turn(
                i, p, wraps, poses, first_node, chain, count, search_work
            )
            if (slot_index == 0 and not needs_others) or (
                count > 0 and stage == SEARCH_STAGE.ALONE
            ):
                return count, step
            needs_others = False
            if slot_index > 0:
                numbers = at(p, wraps[GEODESIC_WRAP.SIZE * number + GEODESIC_WRAP.NUMBERS])
                pose = at(poses, SURFACE_POSE.SIZE * number)
                is_open = (
                    numbers[WRAP_NUMBERS.SIDE] == 0.0
                    and numbers[WRAP_NUMBERS.SURFACE + SURFACE.KIND] != SURFACE_TYPE.TORUS
                    and step > 1
                )
                if is_open and norm(vector(pose, SURFACE_POSE.ABOUT)) == 0.0:
                    # The direction past an open surface is chosen when it is first touched, and
                    # kept from then on.
                    a = node_in_surface(pose, work, first_node)
                    b = node_in_surface(pose, work, second_node)
                    direction_count = min(
                        count_directions(at(numbers, WRAP_NUMBERS.SURFACE), a, b, near_count == 1),
                        step,
                    )
                    if direction_count > 1:
                        step //= direction_count
                        which = combination // step % direction_count
                        # Directions 2 and 3 are perpendicular to 0 and 1; odd ones are opposite to
                        # even ones.
                        if which > 1:
                            axis = cross(axis, unit(minus(b, a)))
                        store_vector(
                            pose, SURFACE_POSE.ABOUT, times(-1.0 if which % 2 == 1 else 1.0, axis)
                        )
                        # In other directions than the first, wait for further surfaces: alone, the
                        # segment might slide back.
                        needs_others = which > 0 and stage < SEARCH_STAGE.ALONE
                insert_slot(numbers, pose, chain, count, slot_index, number)
                if not lay_chain(numbers, pose, chain, count + 1, slot_index, stage, search_work):
                    remove_slot(chain, count + 1, slot_index)
                    continue
                count += 1
                if needs_others:
                    continue
        elif count == 0:
            break
        # A chain that is clearly longer than the best one need not be smoothed.
        if MAX_LENGTH_RATIO * chain_length(chain, count) > shortest_length or not smooth_chain(
            chain, count, search_work
        ):
            break
    return -1, step


def mark_near_wraps(
    i: Ints, p: Floats, record: Floats, slots: Ints, first_node: int, second_node: int
) -> None:
    """Mark the wraps that may bend the segment between two points outside of them, and how.

    Args:
        i: integers of the path.
        p: numbers of the path.
        record: record of the path with the poses of the surfaces; HOW is filled.
        slots: integers after the wraps.
        first_node: first point.
        second_node: second point.
    """
    size = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    wraps = at(i, PATH.NODES_AT + NODE.SIZE * size)
    work = at(record, PATH_WORK.ORDER + size)
    for number in range(i[PATH.WRAPS]):
        wrap_ints = at(wraps, GEODESIC_WRAP.SIZE * number)
        pose = at(record, slots[GEODESIC_PATH.POSES] + SURFACE_POSE.SIZE * number)
        if wrap_ints[GEODESIC_WRAP.FIRST] == first_node:
            numbers = at(p, wrap_ints[GEODESIC_WRAP.NUMBERS])
            surface = at(numbers, WRAP_NUMBERS.SURFACE)
            # An end inside the surface makes OpenSim ignore it.
            largest_value = INSIDE * surface[SURFACE.SQUARE]
            a = node_in_surface(pose, work, first_node)
            b = node_in_surface(pose, work, second_node)
            is_near = (
                second_node <= wrap_ints[GEODESIC_WRAP.LAST]
                and surface_value(surface, a) <= largest_value
                and surface_value(surface, b) <= largest_value
            )
            pose[SURFACE_POSE.HOW] = BENDING.ACTIVE_SIDE if is_near else BENDING.NOT
            # Of several segments around one cylinder or torus, only the deepest must obey its side.
            if (
                is_near
                and wrap_ints[GEODESIC_WRAP.LAST] - wrap_ints[GEODESIC_WRAP.RANGE] > 1
                and (
                    numbers[WRAP_NUMBERS.SIDE] != 0.0 or surface[SURFACE.KIND] == SURFACE_TYPE.TORUS
                )
            ):
                deepest = squared_depth(surface, a, b)
                for k in range(1, int(record[PATH_WORK.COUNT])):
                    previous_node = int(record[PATH_WORK.ORDER + k - 1])
                    next_node = int(record[PATH_WORK.ORDER + k])
                    is_other_segment = (
                        wrap_ints[GEODESIC_WRAP.RANGE] <= previous_node != first_node
                        and next_node <= wrap_ints[GEODESIC_WRAP.LAST]
                    )
                    if (
                        is_other_segment
                        and squared_depth(
                            surface,
                            node_in_surface(pose, work, previous_node),
                            node_in_surface(pose, work, next_node),
                        )
                        < deepest
                    ):
                        pose[SURFACE_POSE.HOW] = BENDING.ANY_SIDE


def node_in_surface(pose: Floats, work: Floats, node: int) -> Vector:
    """Return the position of a node in the frame of a surface (m).

    Args:
        pose: pose of the surface in ground.
        work: results of the nodes.
        node: number of the node.
    """
    return point_in_surface(pose, vector(work, NODE_WORK.SIZE * node + NODE_WORK.POSITION))


def find_largest_turn(
    i: Ints,
    p: Floats,
    wraps: Ints,
    poses: Floats,
    first_node: int,
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
        first_node: first point of the segment.
        chain: slots.
        count: number of slots in use.
        work: workspace of a search.

    Returns:
        The wrap, the slot after the line (0 if no wrap turns a line), and the axis of the turn.
    """
    result = 0
    slot_index = 0
    largest_turn_angle = 0.0
    axis = (0.0, 0.0, 0.0)
    for number in range(i[PATH.WRAPS]):
        wrap_ints = at(wraps, GEODESIC_WRAP.SIZE * number)
        pose = at(poses, SURFACE_POSE.SIZE * number)
        if (
            wrap_ints[GEODESIC_WRAP.FIRST] == first_node
            and pose[SURFACE_POSE.HOW] != BENDING.NOT
            and find_slot(chain, count, number) == 0
        ):
            numbers = at(p, wrap_ints[GEODESIC_WRAP.NUMBERS])
            about = vector(pose, SURFACE_POSE.ABOUT)
            surface = at(numbers, WRAP_NUMBERS.SURFACE)
            priority = ACTIVE_SIDE_PRIORITY if numbers[WRAP_NUMBERS.SIDE] != 0.0 else 0.0
            largest_value = INSIDE * surface[SURFACE.SQUARE]
            for k in range(count + 1):
                a = point_in_surface(pose, line_start(chain, k + 1))
                b = point_in_surface(pose, line_end(chain, k, count))
                if (
                    surface_value(surface, a) <= largest_value
                    and surface_value(surface, b) <= largest_value
                ):
                    turn, point, start_direction, _ = start_on_surface(
                        numbers, a, b, pose[SURFACE_POSE.HOW], (0.0, 0.0, 0.0), work
                    )
                    # The shorter way decides which line meets the surface, even if there is no
                    # other way.
                    if turn > MIN_TURN_RAD and norm(about) > 0.0:
                        turn_about, point_about, direction_about, _ = start_on_surface(
                            numbers, a, b, pose[SURFACE_POSE.HOW], about, work
                        )
                        if turn_about > MIN_TURN_RAD:
                            turn, point, start_direction = turn_about, point_about, direction_about
                    if turn > MIN_TURN_RAD and turn + priority > largest_turn_angle:
                        result = number
                        slot_index = k + 1
                        largest_turn_angle = turn + priority
                        axis = cross(point, start_direction)
    return result, slot_index, axis
