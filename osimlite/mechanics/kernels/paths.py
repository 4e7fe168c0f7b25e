"""Paths: what the law of any path leaves in its record, and the laws of those that run from point to point.

A path is an item that other items call: its law finds length and speed, and the law of the item
that stands PULL places before it applies the tension that was put into the record. Paths through
points keep the points in the record, in the order in which the path runs through them, so that
nothing is computed twice.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.dynamics import clear_wrenches, generalized_forces
from osimlite.mechanics.kernels.functions import value_at
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import apply_force, direction, station, velocity
from osimlite.mechanics.laws.vectors import (
    Vector,
    along,
    dot,
    minus,
    norm,
    plus,
    put,
    times,
    turned,
    vector,
)

PULL = ITEM.OWN
"""The first integer of the item of any path."""

LENGTH, SPEED, TENSION = 0, 1, 2
"""The record of any path begins with length (m), lengthening speed (m/s) and tension (N)."""

POINTS, WRAPS, NODES_AT = ITEM.OWN + 1, ITEM.OWN + 2, ITEM.OWN + 3
"""Integers of a path through points: how many points and wraps it has, and the records of its
nodes: of the points, and then of two tangent points for each wrap.
"""

NODE_INTS = 8
LINK, BODY, KIND, OF, AT, TABLES = 0, 1, 2, 3, 4, 5
"""Of a node: its link and body (there is no line that pulls between two nodes of one body); the
degree of freedom of its coordinate (-1 if that is locked), or the number of the surface that a
tangent point is on; place of its numbers, and of the tables of its three functions.
"""

FIXED, CONDITIONAL, MOVING, CLAMPED, TANGENT = 0, 1, 2, 3, 4
"""Kinds of nodes; a clamped one is a moving one that stands still outside its range, as its place does."""

STATION, VALUE, LOW, HIGH, TURN = 0, 3, 4, 5, 6
"""Numbers of a node: a point of the link (m); value of a locked coordinate, and the range of any;
rotation in the link of the frame in which the functions give the place, by rows, which then is
about that point.
"""

COUNT, ORDER = 3, 4
"""The rest of the record: how many nodes the path runs through, which these are, and what is known of each node."""

NODE_WORK = 12
PLACE, KEPT, ALONG, GRADIENT, SURFACE, IS_KEPT = 0, 3, 6, 9, 9, 10
"""Of a node: where it is in ground, and where a tangent point counts as for straight lines, once
that is known; unit vector to the next node; derivative of the place by the coordinate, in ground;
length on the surface before it.
"""

COINCIDENT, SIGNIFICANT = 2.0**-52, 2.0 ** (-52.0 * 7.0 / 8.0)
"""Distances (m) below which two points have no line in OpenSim, for speeds and for forces; these
then are NaN there, and nothing here.
"""


def path_length(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, path: int
) -> tuple[float, float]:
    """Length and lengthening speed of the path of an item."""
    call(model[path + ITEM.LAW], model, reals, data, y, f, path)
    return known_length(model, data, path)


def known_length(model: Ints, data: Floats, path: int) -> tuple[float, float]:
    """The same as they were found last."""
    result = at(data, model[path + ITEM.RECORD])
    return result[LENGTH], result[SPEED]


def pull_path(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, path: int, tension: float
) -> None:
    """Apply a tension along the path of an item, after its length was found."""
    data[model[path + ITEM.RECORD] + TENSION] = tension
    call(model[path - model[path + PULL] + ITEM.LAW], model, reals, data, y, f, path)


def straight_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Length and speed of a path without wraps."""
    place_points(model, reals, data, y, item)
    measure_points(model, data, y, item)
    return OUTCOME.OK


def place_points(model: Ints, reals: Floats, data: Floats, y: Floats, item: int) -> None:
    """Where the points are, and which of them the path runs through."""
    i, p = at(model, item), at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    order, work = at(result, ORDER), at(result, ORDER + i[POINTS] + 2 * i[WRAPS])
    count = 0
    for number in range(i[POINTS]):
        node, here = at(i, NODES_AT + NODE_INTS * number), at(work, NODE_WORK * number)
        n = at(p, node[AT])
        point = vector(n, STATION)
        if node[KIND] != FIXED:
            value = y[node[OF]] if node[OF] >= 0 else n[VALUE]
            if node[KIND] == CONDITIONAL:
                if not n[LOW] <= value <= n[HIGH]:
                    continue
            else:
                # As in OpenSim, the place is that of the clamped coordinate, its derivative that of
                # the coordinate; of a clamped point that is zero.
                clamped, t = min(max(value, n[LOW]), n[HIGH]), at(n, TURN)
                qx, dx, _ = value_at(at(p, node[TABLES]), clamped)
                qy, dy, _ = value_at(at(p, node[TABLES + 1]), clamped)
                qz, dz, _ = value_at(at(p, node[TABLES + 2]), clamped)
                if clamped != value and node[KIND] == CLAMPED:
                    dx = dy = dz = 0.0
                elif clamped != value:
                    _, dx, _ = value_at(at(p, node[TABLES]), value)
                    _, dy, _ = value_at(at(p, node[TABLES + 1]), value)
                    _, dz, _ = value_at(at(p, node[TABLES + 2]), value)
                point = plus(point, turned(t, (qx, qy, qz)))
                put(here, GRADIENT, direction(model, data, node[LINK], turned(t, (dx, dy, dz))))
        put(here, PLACE, station(model, data, node[LINK], point))
        order[count] = number
        count += 1
    result[COUNT] = count


def measure_points(model: Ints, data: Floats, y: Floats, item: int) -> float:
    """Length, speed and directions, from the places of the nodes that the path runs through; returns the length."""
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    nodes, order, work = (
        at(i, NODES_AT),
        at(result, ORDER),
        at(result, ORDER + i[POINTS] + 2 * i[WRAPS]),
    )
    length = speed = 0.0
    for k in range(1, int(result[COUNT])):
        one, two = int(order[k - 1]), int(order[k])
        m, n = at(nodes, NODE_INTS * one), at(nodes, NODE_INTS * two)
        a, b = at(work, NODE_WORK * one), at(work, NODE_WORK * two)
        way = minus(spot(n, b), spot(m, a))
        distance = norm(way)
        if m[KIND] == TANGENT and n[KIND] == TANGENT and m[OF] == n[OF]:
            length += b[SURFACE]
        else:
            length += distance
        if m[LINK] != n[LINK] or m[KIND] >= MOVING or n[KIND] >= MOVING:
            moves = minus(node_velocity(model, data, y, n, b), node_velocity(model, data, y, m, a))
            speed += norm(moves) if distance < COINCIDENT else dot(moves, way) / distance
        put(a, ALONG, times(0.0 if distance < SIGNIFICANT else 1.0 / distance, way))
    result[LENGTH], result[SPEED] = length, speed
    return length


def spot(node: Ints, here: Floats) -> Vector:
    """Where a node counts as for straight lines: a tangent point where it is when that is first asked for."""
    if node[KIND] != TANGENT:
        return vector(here, PLACE)
    if here[IS_KEPT] == 0.0:
        put(here, KEPT, vector(here, PLACE))
        here[IS_KEPT] = 1.0
    return vector(here, KEPT)


def node_velocity(model: Ints, data: Floats, y: Floats, node: Ints, here: Floats) -> Vector:
    """Velocity of a node; tangent points move with the body of their surface."""
    v = velocity(model, data, node[LINK], vector(here, PLACE))
    if MOVING <= node[KIND] <= CLAMPED and node[OF] >= 0:
        return along(v, y[model[MODEL.DOFS] + node[OF]], vector(here, GRADIENT))
    return v


def pull_points(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Pull at the nodes of a path, along every line between two bodies.

    A moving point works on its coordinate too.
    """
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    nodes, order, work = (
        at(i, NODES_AT),
        at(result, ORDER),
        at(result, ORDER + i[POINTS] + 2 * i[WRAPS]),
    )
    tension, last = result[TENSION], int(result[COUNT]) - 1
    pull = 0.0, 0.0, 0.0
    for k in range(last + 1):
        number = int(order[k])
        node, here = at(nodes, NODE_INTS * number), at(work, NODE_WORK * number)
        back, pull = pull, (0.0, 0.0, 0.0)
        if k < last and nodes[NODE_INTS * int(order[k + 1]) + BODY] != node[BODY]:
            pull = times(tension, vector(here, ALONG))
        force = minus(pull, back)
        apply_force(model, data, node[LINK], vector(here, PLACE), force)
        if MOVING <= node[KIND] <= CLAMPED and node[OF] >= 0:
            f[model[MODEL.DOFS] + node[OF]] += dot(force, vector(here, GRADIENT))
    return OUTCOME.OK


def pull_each(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    f: Floats,
    count: int,
    states: Floats,
    forces: Floats,
) -> int:
    """The generalized forces of 1 N along each item, all of which are paths, in a row each, state by state."""
    size, items = model[MODEL.DOFS], model[MODEL.ITEMS]
    applied = at(f, size)
    for row in range(count):
        for k in range(model[MODEL.STATE_SIZE]):
            y[k] = states[model[MODEL.STATE_SIZE] * row + k]
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.FORCE)
        if status != OUTCOME.OK:
            return status
        for number in range(items):
            clear_wrenches(model, data)
            for k in range(size):
                applied[k] = 0.0
            pull_path(model, reals, data, y, f, model[model[MODEL.ITEM_AT] + number], 1.0)
            generalized_forces(model, data, applied)
            for k in range(size):
                forces[size * (items * row + number) + k] = applied[k]
    return OUTCOME.OK
