"""How a path finds its way around its surfaces, in rounds, as in OpenSim.

A round goes through the PathWraps in their order: the tangent points of each are taken out, and
each straight piece of the path between the points of its range is bent around its surface. The
first piece that must wrap does; else the one that gets longer by the least. What a round leaves is
where the next one starts, until the length stays as it is. Nothing is left for the next evaluation.

OpenSim keeps where a point is in ground from its first use on, though later rounds move the tangent
points: straight distances and the directions of forces go by the place that is kept, while the
surfaces, velocities and points of application go by the newest one. So do they here.
"""

from __future__ import annotations

from math import inf, nan

from osimlite.mechanics.kernels.layout import ITEM, OUTCOME
from osimlite.mechanics.kernels.paths import (
    AT,
    COUNT,
    IS_KEPT,
    KIND,
    LENGTH,
    LINK,
    NODE_INTS,
    NODE_WORK,
    NODES_AT,
    OF,
    ORDER,
    PLACE,
    POINTS,
    SPEED,
    STATION,
    SURFACE,
    TANGENT,
    TURN,
    WRAPS,
    measure_points,
    place_points,
    spot,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import place_frame
from osimlite.mechanics.kernels.wrapping import (
    ENDS,
    FIRST_END,
    FIRST_TANGENT,
    INSIDE,
    MANDATORY,
    NONE,
    ROOM,
    SECOND_END,
    SECOND_TANGENT,
    SURFACE_LENGTH,
    WRAPPED,
)
from osimlite.mechanics.laws.vectors import (
    Vector,
    minus,
    norm,
    plus,
    put,
    turned,
    turned_back,
    vector,
)

WRAP_INTS = 3
BACK, FIRST, LAST = 0, 1, 2
"""Of a wrap, after the nodes: how far before the path's item that of the surface stands, 0 if it is
not active; the first and the last point between which the path may wrap.
"""

ROUNDS, STILL = 8, 0.0005
"""At most so many rounds; a change of length (m) below which there is no other."""

NOWHERE = -2
"""What becomes of a wrap if the path runs through no point of its range; OpenSim then leaves the path as it is."""

BEYOND = -3
"""What becomes of one whose range ends beyond the path; OpenSim then fails."""

POSE, BEST = ENDS, ENDS + 12
"""The record of a surface: after the piece that is tried, its rotation by rows and its origin in
ground; what its law has found, from FIRST_TANGENT on, for the piece that is bent.
"""
SURFACE_WORK = BEST + ROOM - FIRST_TANGENT


def wrapped_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a path with wraps."""
    place_points(model, reals, data, y, item)
    place_surfaces(model, reals, data, item)
    wraps, length, exchanged = model[item + WRAPS], inf, False
    for turn in range(ROUNDS if wraps > 1 else 1):
        first = second = NONE
        for k in range(wraps):
            result = wrap(model, reals, data, y, f, item, 1 - k if exchanged and k < 2 else k)
            if result == NOWHERE:
                measure_points(model, data, y, item)
                return OUTCOME.OK
            if result == BEYOND:
                record = at(data, model[item + ITEM.RECORD])
                record[LENGTH] = record[SPEED] = nan
                return OUTCOME.UNSOLVED
            if k == 0:
                first = result
            elif k == 1:
                second = result
        before, length = length, measure_points(model, data, y, item)
        if abs(length - before) < STILL:
            break
        if turn == 0 and wraps > 1 and first == NONE and second == INSIDE:
            exchanged = True
            take_out(model, data, item, 0)
    return OUTCOME.OK


def place_surfaces(model: Ints, reals: Floats, data: Floats, item: int) -> None:
    """Where the surfaces are; no tangent point is known."""
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    nodes, work = (
        i[POINTS] + 2 * i[WRAPS],
        at(data, i[ITEM.RECORD] + ORDER + i[POINTS] + 2 * i[WRAPS]),
    )
    for k in range(i[WRAPS]):
        number = i[POINTS] + 2 * k
        at(work, NODE_WORK * number)[IS_KEPT] = at(work, NODE_WORK * (number + 1))[IS_KEPT] = 0.0
        back = i[NODES_AT + NODE_INTS * nodes + WRAP_INTS * k + BACK]
        if back > 0:
            node, pose = (
                at(i, NODES_AT + NODE_INTS * number),
                at(data, model[item - back + ITEM.RECORD] + POSE),
            )
            n = at(p, node[AT])
            place_frame(model, data, node[LINK], at(n, TURN), vector(n, STATION), pose)


def take_out(model: Ints, data: Floats, item: int, number: int) -> None:
    """Take the tangent points of a wrap out of the path, if they are in it."""
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    order, count, first = at(result, ORDER), int(result[COUNT]), i[POINTS] + 2 * number
    kept = 0
    for k in range(count):
        if not first <= order[k] <= first + 1:
            order[kept] = order[k]
            kept += 1
    result[COUNT] = kept


def wrap(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int, number: int
) -> int:
    """Find the way around one surface; returns what became of the last piece that was tried."""
    take_out(model, data, item, number)
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    points, count = i[POINTS], int(result[COUNT])
    size = points + 2 * i[WRAPS]
    nodes, order, work = at(i, NODES_AT), at(result, ORDER), at(result, ORDER + size)
    own, tangent = at(nodes, NODE_INTS * size + WRAP_INTS * number), points + 2 * number
    if own[BACK] == 0:
        return NONE
    if own[FIRST] <= own[LAST] and own[LAST] >= points:
        return BEYOND
    surface = item - own[BACK]
    e = at(data, model[surface + ITEM.RECORD])
    begin = end = -1
    for k in range(count):
        if own[FIRST] <= order[k] <= own[LAST] and order[k] < points:
            begin, end = k if begin < 0 else begin, k
    if begin < 0:
        return NOWHERE
    says, best, least = NONE, -1, inf
    one, two = at(work, NODE_WORK * tangent), at(work, NODE_WORK * (tangent + 1))
    for k in range(begin, end):
        m, n = at(nodes, NODE_INTS * int(order[k])), at(nodes, NODE_INTS * int(order[k + 1]))
        a, b = at(work, NODE_WORK * int(order[k])), at(work, NODE_WORK * int(order[k + 1]))
        if m[KIND] == TANGENT and n[KIND] == TANGENT and m[OF] == n[OF]:
            continue
        put(e, FIRST_END, in_surface(at(e, POSE), vector(a, PLACE)))
        put(e, SECOND_END, in_surface(at(e, POSE), vector(b, PLACE)))
        says = call(model[surface + ITEM.LAW], model, reals, data, y, f, surface)
        if says < WRAPPED:
            continue
        r1 = in_ground(at(e, POSE), vector(e, FIRST_TANGENT))
        r2 = in_ground(at(e, POSE), vector(e, SECOND_TANGENT))
        longer = -inf
        if says == WRAPPED:
            p1, p2 = spot(m, a), spot(n, b)
            longer = (
                norm(minus(p1, r1)) + e[SURFACE_LENGTH] + norm(minus(p2, r2)) - norm(minus(p1, p2))
            )
        if longer < least:
            best, least = k, longer
            put(one, PLACE, r1)
            put(two, PLACE, r2)
            one[SURFACE], two[SURFACE] = 0.0, e[SURFACE_LENGTH]
            for j in range(ROOM - FIRST_TANGENT):
                e[BEST + j] = e[FIRST_TANGENT + j]
        if says == MANDATORY:
            break
    # A law has no points for a piece of which OpenSim has none.
    if best >= 0 and one[PLACE] == one[PLACE]:
        for k in range(count - 1, best, -1):
            order[k + 2] = order[k]
        order[best + 1], order[best + 2] = tangent, tangent + 1
        result[COUNT] = count + 2
    return says


def in_surface(pose: Floats, a: Vector) -> Vector:
    """A point of ground in the frame of a surface."""
    return turned_back(pose, minus(a, vector(pose, 9)))


def in_ground(pose: Floats, a: Vector) -> Vector:
    """A point of a surface in ground."""
    return plus(vector(pose, 9), turned(pose, a))
