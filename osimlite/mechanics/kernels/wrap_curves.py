"""Polylines of paths and of their segments on wrap surfaces, for drawing.

For each law of a surface there is a law here that is named after it. It writes points in ground
between the two tangent points to f and returns their number.
"""

from __future__ import annotations

from math import cos, isnan, nan, pi, sin, sqrt

from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.path_wraps import BACK, BEST, POSE, WRAP_INTS, point_in_ground
from osimlite.mechanics.kernels.paths import (
    COUNT,
    NODE_INTS,
    NODE_WORK,
    NODES_AT,
    ORDER,
    PLACE,
    POINTS,
    WRAPS,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.wrap_ellipsoid import invert_components, polar_coordinates
from osimlite.mechanics.kernels.wrap_torus import point_from_cylinder, point_in_cylinder
from osimlite.mechanics.kernels.wrapping import CURVE, FIRST_TANGENT, SECOND_TANGENT, SIZES
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    cross,
    dot,
    multiply_elementwise,
    store_vector,
    times,
    unit,
    vector,
)

ANGLE = 0.15
"""Largest angle between neighbouring points (rad); the polyline is within 0.3 % of the radius."""
MOST = 60.0
"""Largest number of segments on a surface."""
FIRST = BEST
"""Offset in the record of a surface of the first tangent point."""
SECOND = BEST + SECOND_TANGENT - FIRST_TANGENT
"""Offset of the second tangent point."""
SHAPE = BEST + CURVE - FIRST_TANGENT
"""Offset of the numbers that trace the curve."""


def trace_path(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Write all corners of a path to f, after its length was computed.

    After the wraps among the integers of the path follow the laws that trace it on each surface, or
    0.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the path.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the item in the model.

    Returns:
        Number of corners.
    """
    i, result = at(model, item), at(data, model[item + ITEM.RECORD])
    points, wraps = i[POINTS], i[WRAPS]
    size = points + 2 * wraps
    order, work = at(result, ORDER), at(result, ORDER + size)
    own = at(i, NODES_AT + NODE_INTS * size)
    count = 0
    for k in range(int(result[COUNT])):
        number = int(order[k])
        store_vector(f, 3 * count, vector(work, NODE_WORK * number + PLACE))
        count += 1
        wrap = (number - points) // 2
        # Of the two nodes of a wrap, points follow the first one.
        if number >= points and number == points + 2 * wrap and own[WRAP_INTS * wraps + wrap] != 0:
            surface = item - own[WRAP_INTS * wrap + BACK]
            count += call(
                own[WRAP_INTS * wraps + wrap], model, reals, data, y, at(f, 3 * count), surface
            )
    return count


def count_segments(angle: float) -> int:
    """Return the number of segments with which an angle (rad) is drawn."""
    # An undefined angle is drawn as one line.
    return int(min(1.0 + abs(angle) / ANGLE, MOST)) if not isnan(angle) else 1


def trace_cylinder(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Write the points of a helix about z to f.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the surface.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the surface in the model.

    Returns:
        Number of points.
    """
    e = at(data, model[item + ITEM.RECORD])
    one, two, turn = vector(e, FIRST), vector(e, SECOND), e[SHAPE]
    count = count_segments(turn)
    for k in range(1, count):
        store_vector(
            f, 3 * (k - 1), point_in_ground(at(e, POSE), helix_point(one, two, turn, k / count))
        )
    return count - 1


def trace_torus(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Write the points of a helix on the cylinder that replaces the torus to f.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the surface.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the surface in the model.

    Returns:
        Number of points.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    ring, outwards = p[SIZES + 1], (e[SHAPE + 1], e[SHAPE + 2], 0.0)
    one, two = (
        point_in_cylinder(vector(e, FIRST), outwards, ring),
        point_in_cylinder(vector(e, SECOND), outwards, ring),
    )
    count = count_segments(e[SHAPE])
    for k in range(1, count):
        point = point_from_cylinder(helix_point(one, two, e[SHAPE], k / count), outwards, ring)
        store_vector(f, 3 * (k - 1), point_in_ground(at(e, POSE), point))
    return count - 1


def helix_point(one: Vector, two: Vector, turn: float, part: float) -> Vector:
    """Return the point of a helix about z at a fraction of its length.

    Args:
        one: first point of the helix (m).
        two: last point; only its height is used (m).
        turn: angle of the helix (rad).
        part: fraction of its length.
    """
    x, y, z = one
    _, _, end = two
    c, s = cos(part * turn), sin(part * turn)
    return c * x - s * y, s * x + c * y, z + part * (end - z)


def trace_sphere(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Write the points of a great circle to f.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the surface.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the surface in the model.

    Returns:
        Number of points.
    """
    e = at(data, model[item + ITEM.RECORD])
    one, turn = vector(e, FIRST), e[SHAPE]
    across = cross(unit(cross(one, vector(e, SECOND))), one)
    count = count_segments(turn)
    for k in range(1, count):
        angle = turn * k / count
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(at(e, POSE), add_scaled(times(cos(angle), one), sin(angle), across)),
        )
    return count - 1


def trace_ellipsoid(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Write the points of the section of an ellipsoid with the plane of the path to f.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the record of the surface.
        y: state.
        f: filled with positions in ground (m).
        item: offset of the surface in the model.

    Returns:
        Number of points, 0 where OpenSim's points are not numbers.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    a, b, c = vector(p, SIZES)
    factor = 3.0 / (a + b + c)
    one, two = times(factor, vector(e, FIRST)), times(factor, vector(e, SECOND))
    centre, to_one, across, turn = polar_coordinates(one, two, vector(e, SHAPE), e[SHAPE + 3])
    # OpenSim may take the longer way around the section.
    turn -= 2.0 * pi * e[SHAPE + 4]
    scale = times(1.0 / factor, invert_components((a, b, c)))
    count = count_segments(turn)
    for k in range(1, count):
        angle = turn * k / count
        # Rays from the centre of the section, at equal angles as in `measure_polyline`, meet the
        # surface.
        way = add_scaled(times(cos(angle), to_one), sin(angle), across)
        size = distance_to_sphere(
            multiply_elementwise(scale, centre), multiply_elementwise(scale, way)
        )
        if isnan(size):
            return 0
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(at(e, POSE), times(1.0 / factor, add_scaled(centre, size, way))),
        )
    return count - 1


def distance_to_sphere(start: Vector, way: Vector) -> float:
    """Return the multiple of a direction that leads from a point to the unit sphere.

    Args:
        start: point.
        way: direction.

    Returns:
        The multiple, NaN if the line misses the sphere.
    """
    square, half = dot(way, way), dot(start, way)
    inner = half * half - square * (dot(start, start) - 1.0)
    return (sqrt(inner) - half) / square if inner >= 0.0 else nan
