"""Wrapping of a path around its surfaces in rounds, as in OpenSim.

A round processes the PathWraps in order: the tangent points of each are removed, and each straight
segment of the path within its range is bent around its surface. The first segment that must wrap is
used; else the one that becomes longer by the least. The next round starts from the result, until
the length does not change. Nothing is kept for the next evaluation.

OpenSim caches the position of a tangent point in ground at its first use, although later rounds
move the tangent points: straight distances and directions of forces use the cached position,
while surfaces, velocities and points of application use the newest one. So does this module.
"""

from __future__ import annotations

from math import inf, nan

from osimlite.mechanics.kernels.layout import ITEM, OUTCOME, Record
from osimlite.mechanics.kernels.paths import (
    NODE,
    NODE_NUMBERS,
    NODE_TYPE,
    NODE_WORK,
    PATH,
    PATH_WORK,
    line_end,
    measure_points,
    place_points,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import place_frame
from osimlite.mechanics.kernels.wrapping import WRAP_WORK, WRAPPING
from osimlite.mechanics.laws.vectors import (
    Vector,
    minus,
    norm,
    plus,
    rotate,
    rotate_back,
    store_vector,
    vector,
)


class PATH_WRAP(metaclass=Record):
    """Integers of a wrap; wraps follow the nodes."""

    BACK = 0
    """Distance back to the item of its surface, 0 if it is not active."""
    FIRST = 1
    """First point of its range."""
    LAST = 2
    """Last point of its range."""
    SIZE = 3
    """Number of integers of a wrap; wraps follow the nodes."""


MAX_ROUNDS = 8
"""Largest number of rounds."""
LENGTH_TOLERANCE_M = 0.0005
"""Change of the length (m) below which no further round follows."""


class SURFACE_WORK(metaclass=Record):
    """Record of a surface behind that of its law, see `WRAP_WORK`."""

    POSE = WRAP_WORK.END
    """Pose in ground: rotation by rows, then origin."""
    BEST = WRAP_WORK.END + 12
    """Results of its law for the segment that is bent, from WRAP_WORK.FIRST_TANGENT on."""
    SIZE = BEST + WRAP_WORK.WORKSPACE - WRAP_WORK.FIRST_TANGENT
    """Length of the record of a surface."""


def wrapped_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute length and speed of a path with wraps.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the path is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`, or UNSOLVED where OpenSim fails.
    """
    place_points(model, reals, data, y, item)
    place_surfaces(model, reals, data, item)
    wraps = model[item + PATH.WRAPS]
    length = inf
    exchanged = False
    # A single surface does not depend on others, so that one round is enough.
    for turn in range(MAX_ROUNDS if wraps > 1 else 1):
        first = second = WRAPPING.NONE
        for k in range(wraps):
            result = wrap_surface(
                model, reals, data, y, f, item, 1 - k if exchanged and k < 2 else k
            )
            if result == WRAPPING.NO_POINTS:
                measure_points(model, data, y, item)
                return OUTCOME.OK
            if result == WRAPPING.BEYOND:
                record = at(data, model[item + ITEM.RECORD])
                record[PATH_WORK.LENGTH] = record[PATH_WORK.SPEED] = nan
                return OUTCOME.UNSOLVED
            if k == 0:
                first = result
            elif k == 1:
                second = result
        previous_length = length
        length = measure_points(model, data, y, item)
        if abs(length - previous_length) < LENGTH_TOLERANCE_M:
            break
        # OpenSim exchanges the first two wraps if the first does not wrap and the second fails in
        # the first round.
        if turn == 0 and wraps > 1 and first == WRAPPING.NONE and second == WRAPPING.INSIDE:
            exchanged = True
            remove_tangents(model, data, item, 0)
    return OUTCOME.OK


def place_surfaces(model: Ints, reals: Floats, data: Floats, item: int) -> None:
    """Compute the poses of the surfaces, and mark all tangent points as unused.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the poses of the links; those of the surfaces are filled.
        item: offset of the item in the model.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    nodes = i[PATH.POINTS] + 2 * i[PATH.WRAPS]
    work = at(data, i[ITEM.RECORD] + PATH_WORK.ORDER + i[PATH.POINTS] + 2 * i[PATH.WRAPS])
    for k in range(i[PATH.WRAPS]):
        number = i[PATH.POINTS] + 2 * k
        at(work, NODE_WORK.SIZE * number)[NODE_WORK.IS_CACHED] = at(
            work, NODE_WORK.SIZE * (number + 1)
        )[NODE_WORK.IS_CACHED] = 0.0
        back = i[PATH.NODES_AT + NODE.SIZE * nodes + PATH_WRAP.SIZE * k + PATH_WRAP.BACK]
        if back > 0:
            node = at(i, PATH.NODES_AT + NODE.SIZE * number)
            pose = at(data, model[item - back + ITEM.RECORD] + SURFACE_WORK.POSE)
            n = at(p, node[NODE.AT])
            place_frame(
                model,
                data,
                node[NODE.LINK],
                at(n, NODE_NUMBERS.TURN),
                vector(n, NODE_NUMBERS.STATION),
                pose,
            )


def remove_tangents(model: Ints, data: Floats, item: int, number: int) -> None:
    """Remove the tangent points of a wrap from the path, if they are in it.

    Args:
        model: integers of the model.
        data: results with the record of the path.
        item: offset of the item in the model.
        number: number of the wrap.
    """
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    order = at(result, PATH_WORK.ORDER)
    count = int(result[PATH_WORK.COUNT])
    first = i[PATH.POINTS] + 2 * number
    # Tangent points have the numbers behind those of the points.
    remaining_count = 0
    for k in range(count):
        if not first <= order[k] <= first + 1:
            order[remaining_count] = order[k]
            remaining_count += 1
    result[PATH_WORK.COUNT] = remaining_count


def wrap_surface(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int, number: int
) -> int:
    """Wrap one segment of a path over one surface: the one that adds the least length.

    Every segment in the range of the PathWrap is tried. The two tangent points of the best one are
    inserted into the path. This is OpenSim's order of decisions (`GeometryPath::applyWrapObjects`).

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path; changed.
        y: state.
        f: rates of the coordinates.
        item: offset of the path in the model.
        number: index of the PathWrap in the path.

    Returns:
        Result of the last segment that was tried; NO_POINTS if no point is in the range, BEYOND if
        the range ends after the last point (`WRAPPING`).
    """
    # The tangent points of an earlier iteration would split the segments.
    remove_tangents(model, data, item, number)
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    points = i[PATH.POINTS]
    count = int(result[PATH_WORK.COUNT])
    size = points + 2 * i[PATH.WRAPS]
    nodes = at(i, PATH.NODES_AT)
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + size)
    wrap_ints = at(nodes, NODE.SIZE * size + PATH_WRAP.SIZE * number)
    tangent = points + 2 * number
    if wrap_ints[PATH_WRAP.BACK] == 0:
        return WRAPPING.NONE
    # The range of the PathWrap names a point that the path does not have.
    if (
        wrap_ints[PATH_WRAP.FIRST] <= wrap_ints[PATH_WRAP.LAST]
        and wrap_ints[PATH_WRAP.LAST] >= points
    ):
        return WRAPPING.BEYOND
    surface = item - wrap_ints[PATH_WRAP.BACK]
    e = at(data, model[surface + ITEM.RECORD])
    begin = end = -1
    for k in range(count):
        if (
            wrap_ints[PATH_WRAP.FIRST] <= order[k] <= wrap_ints[PATH_WRAP.LAST]
            and order[k] < points
        ):
            begin = k if begin < 0 else begin
            end = k
    if begin < 0:
        return WRAPPING.NO_POINTS
    code, best_segment, least_increase = WRAPPING.NONE, -1, inf
    first_tangent = at(work, NODE_WORK.SIZE * tangent)
    second_tangent = at(work, NODE_WORK.SIZE * (tangent + 1))
    for k in range(begin, end):
        m = at(nodes, NODE.SIZE * int(order[k]))
        n = at(nodes, NODE.SIZE * int(order[k + 1]))
        a = at(work, NODE_WORK.SIZE * int(order[k]))
        b = at(work, NODE_WORK.SIZE * int(order[k + 1]))
        # The segment between both tangent points of another surface lies on that surface.
        if (
            m[NODE.KIND] == NODE_TYPE.TANGENT
            and n[NODE.KIND] == NODE_TYPE.TANGENT
            and m[NODE.OF] == n[NODE.OF]
        ):
            continue
        store_vector(
            e,
            WRAP_WORK.FIRST_END,
            point_in_surface(at(e, SURFACE_WORK.POSE), vector(a, NODE_WORK.POSITION)),
        )
        store_vector(
            e,
            WRAP_WORK.SECOND_END,
            point_in_surface(at(e, SURFACE_WORK.POSE), vector(b, NODE_WORK.POSITION)),
        )
        code = call(model[surface + ITEM.LAW], model, reals, data, y, f, surface)
        if code < WRAPPING.WRAPPED:
            continue
        first_tangent_point = point_in_ground(
            at(e, SURFACE_WORK.POSE), vector(e, WRAP_WORK.FIRST_TANGENT)
        )
        second_tangent_point = point_in_ground(
            at(e, SURFACE_WORK.POSE), vector(e, WRAP_WORK.SECOND_TANGENT)
        )
        # A segment that must wrap wins over all others; of those that may, the one that adds least
        # length.
        length_increase = -inf
        if code == WRAPPING.WRAPPED:
            p1, p2 = line_end(m, a), line_end(n, b)
            length_increase = (
                norm(minus(p1, first_tangent_point))
                + e[WRAP_WORK.SURFACE_LENGTH]
                + norm(minus(p2, second_tangent_point))
                - norm(minus(p1, p2))
            )
        if length_increase < least_increase:
            best_segment, least_increase = k, length_increase
            store_vector(first_tangent, NODE_WORK.POSITION, first_tangent_point)
            store_vector(second_tangent, NODE_WORK.POSITION, second_tangent_point)
            first_tangent[NODE_WORK.SURFACE], second_tangent[NODE_WORK.SURFACE] = (
                0.0,
                e[WRAP_WORK.SURFACE_LENGTH],
            )
            # Keep the results of the chosen segment, which the next trial overwrites.
            for j in range(WRAP_WORK.WORKSPACE - WRAP_WORK.FIRST_TANGENT):
                e[SURFACE_WORK.BEST + j] = e[WRAP_WORK.FIRST_TANGENT + j]
        if code == WRAPPING.MANDATORY:
            break
    # The tangent points are NaN where OpenSim finds none.
    if best_segment >= 0 and first_tangent[NODE_WORK.POSITION] == first_tangent[NODE_WORK.POSITION]:
        for k in range(count - 1, best_segment, -1):
            order[k + 2] = order[k]
        order[best_segment + 1], order[best_segment + 2] = tangent, tangent + 1
        result[PATH_WORK.COUNT] = count + 2
    return code


def point_in_surface(pose: Floats, a: Vector) -> Vector:
    """Return a point of ground in the frame of a surface.

    Args:
        pose: pose of the surface in ground: rotation by rows, then origin.
        a: position in ground (m).
    """
    return rotate_back(pose, minus(a, vector(pose, 9)))


def point_in_ground(pose: Floats, a: Vector) -> Vector:
    """Return a point of a surface in ground.

    Args:
        pose: pose of the surface in ground: rotation by rows, then origin.
        a: position in the frame of the surface (m).
    """
    return plus(vector(pose, 9), rotate(pose, a))
