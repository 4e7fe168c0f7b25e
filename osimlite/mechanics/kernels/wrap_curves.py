"""Polylines of paths and of their segments on wrap surfaces, for drawing.

For each law of a surface there is a law here that is named after it. It writes points in ground
between the two tangent points to f and returns their number.
"""

from __future__ import annotations

from math import cos, isnan, nan, pi, sin, sqrt

from osimlite.mechanics.kernels.layout import ITEM, Record
from osimlite.mechanics.kernels.path_wraps import PATH_WRAP, SURFACE_WORK, point_in_ground
from osimlite.mechanics.kernels.paths import NODE, NODE_WORK, PATH, PATH_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.wrap_ellipsoid import invert_components, polar_coordinates
from osimlite.mechanics.kernels.wrap_torus import point_from_cylinder, point_in_cylinder
from osimlite.mechanics.kernels.wrapping import WRAP_SURFACE, WRAP_WORK
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

MAX_ANGLE_RAD = 0.15
"""Largest angle between neighbouring points (rad); the polyline is within 0.3 % of the radius."""
MAX_SEGMENTS = 60.0
"""Largest number of segments on a surface."""


class TANGENTS(metaclass=Record):
    """Results of the law of a surface in its record, see `SURFACE_WORK`."""

    FIRST = SURFACE_WORK.BEST
    """First tangent point."""
    SECOND = SURFACE_WORK.BEST + WRAP_WORK.SECOND_TANGENT - WRAP_WORK.FIRST_TANGENT
    """Second tangent point."""
    SHAPE = SURFACE_WORK.BEST + WRAP_WORK.CURVE - WRAP_WORK.FIRST_TANGENT
    """Numbers that trace the curve."""


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
    i = at(model, item)
    result = at(data, model[item + ITEM.RECORD])
    points, wraps = i[PATH.POINTS], i[PATH.WRAPS]
    size = points + 2 * wraps
    order = at(result, PATH_WORK.ORDER)
    work = at(result, PATH_WORK.ORDER + size)
    wrap_ints = at(i, PATH.NODES_AT + NODE.SIZE * size)
    count = 0
    for k in range(int(result[PATH_WORK.COUNT])):
        number = int(order[k])
        store_vector(f, 3 * count, vector(work, NODE_WORK.SIZE * number + NODE_WORK.POSITION))
        count += 1
        wrap = (number - points) // 2
        # Of the two nodes of a wrap, points follow the first one.
        if (
            number >= points
            and number == points + 2 * wrap
            and wrap_ints[PATH_WRAP.SIZE * wraps + wrap] != 0
        ):
            surface = item - wrap_ints[PATH_WRAP.SIZE * wrap + PATH_WRAP.BACK]
            count += call(
                wrap_ints[PATH_WRAP.SIZE * wraps + wrap],
                model,
                reals,
                data,
                y,
                at(f, 3 * count),
                surface,
            )
    return count


def count_segments(angle: float) -> int:
    """Return the number of segments with which an angle (rad) is drawn."""
    # An undefined angle is drawn as one line.
    return int(min(1.0 + abs(angle) / MAX_ANGLE_RAD, MAX_SEGMENTS)) if not isnan(angle) else 1


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
    start_point = vector(e, TANGENTS.FIRST)
    end_point = vector(e, TANGENTS.SECOND)
    turn = e[TANGENTS.SHAPE]
    count = count_segments(turn)
    for k in range(1, count):
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(
                at(e, SURFACE_WORK.POSE), helix_point(start_point, end_point, turn, k / count)
            ),
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
    ring = p[WRAP_SURFACE.SIZES + 1]
    outwards = (e[TANGENTS.SHAPE + 1], e[TANGENTS.SHAPE + 2], 0.0)
    start_point = point_in_cylinder(vector(e, TANGENTS.FIRST), outwards, ring)
    end_point = point_in_cylinder(vector(e, TANGENTS.SECOND), outwards, ring)
    count = count_segments(e[TANGENTS.SHAPE])
    for k in range(1, count):
        point = point_from_cylinder(
            helix_point(start_point, end_point, e[TANGENTS.SHAPE], k / count), outwards, ring
        )
        store_vector(f, 3 * (k - 1), point_in_ground(at(e, SURFACE_WORK.POSE), point))
    return count - 1


def helix_point(start_point: Vector, end_point: Vector, turn: float, fraction: float) -> Vector:
    """Return the point of a helix about z at a fraction of its length.

    Args:
        start_point: first point of the helix (m).
        end_point: last point; only its height is used (m).
        turn: angle of the helix (rad).
        fraction: fraction of its length.
    """
    x, y, z = start_point
    _, _, end = end_point
    c, s = cos(fraction * turn), sin(fraction * turn)
    return c * x - s * y, s * x + c * y, z + fraction * (end - z)


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
    start_point = vector(e, TANGENTS.FIRST)
    turn = e[TANGENTS.SHAPE]
    across = cross(unit(cross(start_point, vector(e, TANGENTS.SECOND))), start_point)
    count = count_segments(turn)
    for k in range(1, count):
        angle = turn * k / count
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(
                at(e, SURFACE_WORK.POSE),
                add_scaled(times(cos(angle), start_point), sin(angle), across),
            ),
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
    a, b, c = vector(p, WRAP_SURFACE.SIZES)
    factor = 3.0 / (a + b + c)
    start_point = times(factor, vector(e, TANGENTS.FIRST))
    end_point = times(factor, vector(e, TANGENTS.SECOND))
    centre, start_direction, across, turn = polar_coordinates(
        start_point, end_point, vector(e, TANGENTS.SHAPE), e[TANGENTS.SHAPE + 3]
    )
    # OpenSim may take the longer way around the section.
    turn -= 2.0 * pi * e[TANGENTS.SHAPE + 4]
    scale = times(1.0 / factor, invert_components((a, b, c)))
    count = count_segments(turn)
    for k in range(1, count):
        angle = turn * k / count
        # Rays from the centre of the section, at equal angles as in `measure_polyline`, meet the
        # surface.
        point_direction = add_scaled(times(cos(angle), start_direction), sin(angle), across)
        size = distance_to_sphere(
            multiply_elementwise(scale, centre), multiply_elementwise(scale, point_direction)
        )
        if isnan(size):
            return 0
        store_vector(
            f,
            3 * (k - 1),
            point_in_ground(
                at(e, SURFACE_WORK.POSE),
                times(1.0 / factor, add_scaled(centre, size, point_direction)),
            ),
        )
    return count - 1


def distance_to_sphere(start: Vector, ray: Vector) -> float:
    """Return the multiple of a direction that leads from a point to the unit sphere.

    Args:
        start: point from which the ray begins.
        ray: direction, of any length.

    Returns:
        Multiple of `ray`; NaN if the line misses the sphere.
    """
    square, half = dot(ray, ray), dot(start, ray)
    inner = half * half - square * (dot(start, start) - 1.0)
    return (sqrt(inner) - half) / square if inner >= 0.0 else nan
