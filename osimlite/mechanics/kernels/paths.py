"""Common record of all paths, and the laws of paths through points.

A path is an item that other items call: its law computes length and speed, and the law of the item
`PATH.PULL` records before it applies the tension that is written to the record. Paths through points
keep the points in the record, in the order in which the path passes them, so that nothing is
computed twice.
"""

from __future__ import annotations

from osimlite.mechanics.kernels.dynamics import add_generalized_forces, clear_wrenches
from osimlite.mechanics.kernels.functions import evaluate_function
from osimlite.mechanics.kernels.layout import ITEM, MODEL, OUTCOME, STAGE, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import apply_force, direction, station, velocity
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    dot,
    minus,
    norm,
    plus,
    rotate,
    store_vector,
    times,
    vector,
)


class PATH(metaclass=Record):
    """Integers of a path through points."""

    PULL = ITEM.DETAILS
    """Distance back to the item that applies its tension."""
    POINTS = ITEM.DETAILS + 1
    """Number of points."""
    WRAPS = ITEM.DETAILS + 2
    """Number of wraps."""
    NODES_AT = ITEM.DETAILS + 3
    """Nodes: the points, then two tangent points for each wrap."""


class PATH_WORK(metaclass=Record):
    """Record of a path."""

    LENGTH = 0
    """Length (m)."""
    SPEED = 1
    """Lengthening speed (m/s)."""
    TENSION = 2
    """Tension (N)."""
    COUNT = 3
    """Number of active nodes."""
    ORDER = 4
    """Numbers of the active nodes in order, then the results of all nodes."""


class NODE(metaclass=Record):
    """Integers of a node."""

    LINK = 0
    """Link."""
    BODY = 1
    """Body; no force acts between two nodes of one body."""
    KIND = 2
    """Kind, such as NODE_TYPE.FIXED."""
    OF = 3
    """Degree of freedom, -1 if that is locked; for a tangent point its surface."""
    AT = 4
    """Offset of its numbers."""
    TABLES = 5
    """Offsets of the tables of its three functions."""
    SIZE = 8
    """Number of integers of a node."""


class NODE_TYPE(metaclass=Record):
    """Types of nodes."""

    FIXED = 0
    """Node that is fixed in its link."""
    CONDITIONAL = 1
    """Node that is active within a range of a coordinate."""
    MOVING = 2
    """Node whose position is a function of a coordinate."""
    CLAMPED = 3
    """Moving node that stands still outside its range, as its position does."""
    TANGENT = 4
    """Tangent point on a wrap surface."""


class NODE_NUMBERS(metaclass=Record):
    """Numbers of a node."""

    STATION = 0
    """Point in the link (m)."""
    VALUE = 3
    """Value of a locked coordinate."""
    LOW = 4
    """Smallest value of the coordinate."""
    HIGH = 5
    """Largest value of the coordinate."""
    TURN = 6
    """Rotation in the link of the functions' frame, by rows; its origin is the point."""


class NODE_WORK(metaclass=Record):
    """Results of a node, in ground."""

    POSITION = 0
    """Position in ground (m)."""
    CACHED_POSITION = 3
    """Position of a tangent point for straight lines, once it is used, see `path_wraps`."""
    ALONG = 6
    """Unit vector to the next node."""
    GRADIENT = 9
    """Derivative of a moving point's position by the coordinate, in ground."""
    SURFACE = 9
    """Length on the surface before a tangent point (m)."""
    IS_CACHED = 10
    """1.0 if the position of a tangent point is cached, else 0.0."""
    SIZE = 12
    """Length of the results of a node."""


MIN_SPEED_DISTANCE_M = 2.0**-52
"""Distance of two points (m) below which OpenSim has no direction for their relative speed.

The speed is NaN in OpenSim; here it is the norm of the relative velocity.
"""
MIN_FORCE_DISTANCE_M = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Distance of two points (m) below which OpenSim has no direction for forces; here they vanish."""


def path_length(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, path: int
) -> tuple[float, float]:
    """Compute length and lengthening speed of the path of an item.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the path is filled.
        y: state.
        f: rates of the coordinates.
        path: offset of the path in the model.

    Returns:
        Length (m) and speed (m/s).
    """
    call(model[path + ITEM.LAW], model, reals, data, y, f, path)
    return last_length(model, data, path)


def last_length(model: Ints, data: Floats, path: int) -> tuple[float, float]:
    """Return length and lengthening speed of a path as they were computed last.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        path: offset of the path in the model.

    Returns:
        Length (m) and speed (m/s).
    """
    result = at(data, model[path + ITEM.RECORD])
    return result[PATH_WORK.LENGTH], result[PATH_WORK.SPEED]


def pull_path(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, path: int, tension: float
) -> None:
    """Apply a tension along a path, after its length has been computed.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path; wrenches are changed.
        y: state.
        f: rates of the coordinates, then generalized forces; changed.
        path: offset of the path in the model.
        tension: tension, positive where the path pulls (N).
    """
    data[model[path + ITEM.RECORD] + PATH_WORK.TENSION] = tension
    # Different kinds of paths pull in different ways; the record says by which kernel.
    call(model[path - model[path + PATH.PULL] + ITEM.LAW], model, reals, data, y, f, path)


def straight_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Compute length and speed of a path without wraps.

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
    measure_points(model, data, y, item)
    return OUTCOME.OK


def place_points(model: Ints, reals: Floats, data: Floats, y: Floats, item: int) -> None:
    """Compute the positions of the points and list the active ones.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the poses of the links; the record of the path is filled.
        y: state.
        item: offset of the item in the model.
    """
    i = at(model, item)
    p = at(reals, model[item + ITEM.NUMBERS])
    result = at(data, i[ITEM.RECORD])
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + i[PATH.POINTS] + 2 * i[PATH.WRAPS])
    count = 0
    for number in range(i[PATH.POINTS]):
        node = at(i, PATH.NODES_AT + NODE.SIZE * number)
        node_record = at(work, NODE_WORK.SIZE * number)
        n = at(p, node[NODE.AT])
        point = vector(n, NODE_NUMBERS.STATION)
        if node[NODE.KIND] != NODE_TYPE.FIXED:
            value = y[node[NODE.OF]] if node[NODE.OF] >= 0 else n[NODE_NUMBERS.VALUE]
            # A conditional point belongs to the path only while its coordinate is in its range.
            if node[NODE.KIND] == NODE_TYPE.CONDITIONAL:
                if not n[NODE_NUMBERS.LOW] <= value <= n[NODE_NUMBERS.HIGH]:
                    continue
            else:
                # As in OpenSim, the position uses the clamped coordinate, and its derivative the
                # unclamped one; for a clamped node the derivative is zero outside the range.
                clamped = min(max(value, n[NODE_NUMBERS.LOW]), n[NODE_NUMBERS.HIGH])
                t = at(n, NODE_NUMBERS.TURN)
                qx, dx, _ = evaluate_function(at(p, node[NODE.TABLES]), clamped)
                qy, dy, _ = evaluate_function(at(p, node[NODE.TABLES + 1]), clamped)
                qz, dz, _ = evaluate_function(at(p, node[NODE.TABLES + 2]), clamped)
                if clamped != value and node[NODE.KIND] == NODE_TYPE.CLAMPED:
                    dx = dy = dz = 0.0
                elif clamped != value:
                    _, dx, _ = evaluate_function(at(p, node[NODE.TABLES]), value)
                    _, dy, _ = evaluate_function(at(p, node[NODE.TABLES + 1]), value)
                    _, dz, _ = evaluate_function(at(p, node[NODE.TABLES + 2]), value)
                point = plus(point, rotate(t, (qx, qy, qz)))
                store_vector(
                    node_record,
                    NODE_WORK.GRADIENT,
                    direction(model, data, node[NODE.LINK], rotate(t, (dx, dy, dz))),
                )
        store_vector(node_record, NODE_WORK.POSITION, station(model, data, node[NODE.LINK], point))
        order[count] = number
        count += 1
    result[PATH_WORK.COUNT] = count


def measure_points(model: Ints, data: Floats, y: Floats, item: int) -> float:
    """Compute length, speed and directions from the positions of the active nodes.

    Args:
        model: integers of the model.
        data: results with velocities; the record of the path is filled.
        y: state.
        item: offset of the item in the model.

    Returns:
        Length of the path (m).
    """
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    nodes = at(i, PATH.NODES_AT)
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + i[PATH.POINTS] + 2 * i[PATH.WRAPS])
    length = speed = 0.0
    for k in range(1, int(result[PATH_WORK.COUNT])):
        first_node = int(order[k - 1])
        second_node = int(order[k])
        m, n = at(nodes, NODE.SIZE * first_node), at(nodes, NODE.SIZE * second_node)
        a, b = at(work, NODE_WORK.SIZE * first_node), at(work, NODE_WORK.SIZE * second_node)
        line = minus(line_end(n, b), line_end(m, a))
        distance = norm(line)
        # Between both tangent points of one surface the path is not straight.
        if (
            m[NODE.KIND] == NODE_TYPE.TANGENT
            and n[NODE.KIND] == NODE_TYPE.TANGENT
            and m[NODE.OF] == n[NODE.OF]
        ):
            length += b[NODE_WORK.SURFACE]
        else:
            length += distance
        # Points of one link keep their distance, unless they move in it.
        if (
            m[NODE.LINK] != n[NODE.LINK]
            or m[NODE.KIND] >= NODE_TYPE.MOVING
            or n[NODE.KIND] >= NODE_TYPE.MOVING
        ):
            relative_velocity = minus(
                node_velocity(model, data, y, n, b), node_velocity(model, data, y, m, a)
            )
            speed += (
                norm(relative_velocity)
                if distance < MIN_SPEED_DISTANCE_M
                else dot(relative_velocity, line) / distance
            )
        # Forces along a segment without direction vanish, where OpenSim has NaN.
        store_vector(
            a,
            NODE_WORK.ALONG,
            times(0.0 if distance < MIN_FORCE_DISTANCE_M else 1.0 / distance, line),
        )
    result[PATH_WORK.LENGTH], result[PATH_WORK.SPEED] = length, speed
    return length


def line_end(node: Ints, node_record: Floats) -> Vector:
    """Return the position of a node that straight lines begin and end at (m).

    OpenSim caches the position of a tangent point at its first use, see `path_wraps`.

    Args:
        node: integers of the node.
        node_record: results of the node; a tangent point is cached.
    """
    if node[NODE.KIND] != NODE_TYPE.TANGENT:
        return vector(node_record, NODE_WORK.POSITION)
    if node_record[NODE_WORK.IS_CACHED] == 0.0:
        store_vector(
            node_record, NODE_WORK.CACHED_POSITION, vector(node_record, NODE_WORK.POSITION)
        )
        node_record[NODE_WORK.IS_CACHED] = 1.0
    return vector(node_record, NODE_WORK.CACHED_POSITION)


def node_velocity(model: Ints, data: Floats, y: Floats, node: Ints, node_record: Floats) -> Vector:
    """Return the velocity of a node in ground (m/s).

    Tangent points move with the body of their surface.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        y: state.
        node: integers of the node.
        node_record: results of the node.
    """
    v = velocity(model, data, node[NODE.LINK], vector(node_record, NODE_WORK.POSITION))
    if NODE_TYPE.MOVING <= node[NODE.KIND] <= NODE_TYPE.CLAMPED and node[NODE.OF] >= 0:
        return add_scaled(
            v, y[model[MODEL.DOFS] + node[NODE.OF]], vector(node_record, NODE_WORK.GRADIENT)
        )
    return v


def pull_points(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Apply the tension at the nodes of a path, along each line between two bodies.

    At a moving point the tension also acts on its coordinate.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path; wrenches are changed.
        y: state.
        f: rates of the coordinates, then generalized forces; changed.
        item: offset of the item in the model.

    Returns:
        `OUTCOME.OK`.
    """
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    nodes = at(i, PATH.NODES_AT)
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + i[PATH.POINTS] + 2 * i[PATH.WRAPS])
    tension = result[PATH_WORK.TENSION]
    last_node = int(result[PATH_WORK.COUNT]) - 1
    pull = 0.0, 0.0, 0.0
    for k in range(last_node + 1):
        number = int(order[k])
        node, node_record = at(nodes, NODE.SIZE * number), at(work, NODE_WORK.SIZE * number)
        # The force at a node is the pull towards the next one less the pull of the one before.
        back = pull
        pull = (0.0, 0.0, 0.0)
        if k < last_node and nodes[NODE.SIZE * int(order[k + 1]) + NODE.BODY] != node[NODE.BODY]:
            pull = times(tension, vector(node_record, NODE_WORK.ALONG))
        force = minus(pull, back)
        apply_force(model, data, node[NODE.LINK], vector(node_record, NODE_WORK.POSITION), force)
        # A moving point does work along its coordinate, even within its link.
        if NODE_TYPE.MOVING <= node[NODE.KIND] <= NODE_TYPE.CLAMPED and node[NODE.OF] >= 0:
            f[model[MODEL.DOFS] + node[NODE.OF]] += dot(
                force, vector(node_record, NODE_WORK.GRADIENT)
            )
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
    """Compute the generalized forces of 1 N along each path, at several states.

    All items of the model must be paths. With OpenSim's sign these are the moment arms.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: workspace of a state.
        f: workspace for the rates of a state.
        count: number of states.
        states: states (count, y).
        forces: filled with the moment arms (count, items, n).

    Returns:
        `OUTCOME.OK`, or the outcome of the evaluation that failed.
    """
    size, item_count = model[MODEL.DOFS], model[MODEL.ITEMS]
    applied = at(f, size)
    for row in range(count):
        for k in range(model[MODEL.STATE_SIZE]):
            y[k] = states[model[MODEL.STATE_SIZE] * row + k]
        # The stage FORCE computes the lengths of all paths, which pulling needs.
        status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.FORCE)
        if status != OUTCOME.OK:
            return status
        for number in range(item_count):
            clear_wrenches(model, data)
            for k in range(size):
                applied[k] = 0.0
            pull_path(model, reals, data, y, f, model[model[MODEL.ITEM_AT] + number], 1.0)
            add_generalized_forces(model, data, applied)
            for k in range(size):
                forces[size * (item_count * row + number) + k] = applied[k]
    return OUTCOME.OK
