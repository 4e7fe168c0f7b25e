"""Wrapping of a path around an ellipsoid, in a plane through both ends and a point of the surface.

The plane is not that of the shortest path. Its point is found beside the middle of the chord, or
where the chord crosses a plane of symmetry, or by a fan of the shortest ways out of the ellipsoid
from points of the chord. The tangent points in the plane are found by damped least squares that
stop at 1e-4, so that the path has small bends there, as in OpenSim. All lengths are in units of the
mean radius.

Source: OpenSim 4.6's WrapEllipsoid.
"""

from __future__ import annotations

from math import acos, cos, isnan, nan, pi, sin, sqrt

from osimlite.mechanics.kernels.closest_on_ellipsoid import (
    closest_in_plane,
    closest_point,
    mean_outward_direction,
)
from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.wrapping import (
    ELLIPSOID_METHOD,
    WRAP_SURFACE,
    WRAP_WORK,
    WRAPPING,
    clear_tangents,
    is_on_side,
)
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    component,
    cross,
    dot,
    minus,
    multiply_elementwise,
    norm,
    plus,
    replace_component,
    store_vector,
    times,
    unit,
    vector,
)

SURFACE_TOLERANCE = 1e-4
"""Height at which an end counts as on the surface; also 1 - cosine of ends in one direction."""
ALL_FAN = 0.7073
"""Cosine of the angle between chord and axis up to which only the fan is used."""
NO_FAN = 0.9
"""Cosine from which on the fan is not used."""
FAN_PHASE_IN = 0.3
"""Part of the chord at either end in which the fan is phased in."""
SEGMENT_LENGTH_M = 0.001
"""Length of the straight segments of the path on the surface in OpenSim (m)."""
MAX_SEGMENTS = 499
"""Largest number of these segments."""
TANGENT_TOLERANCE = 1e-8
"""Sum of squares at which the search for a tangent point ends."""
MAX_ROUNDS = 50
"""Largest number of rounds of this search."""
MAX_TRIALS = 1000
"""Largest number of trials in a round."""
STEP_DIVISOR = 16.0
"""Divisor of a step of this search."""


def wrap_ellipsoid(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int
) -> int:
    """Bend a segment around a WrapEllipsoid, see :mod:`osimlite.mechanics.kernels.wrapping`.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the surface holds the ends of the segment and is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the surface in the model.

    Returns:
        INSIDE, NONE or MANDATORY of `WRAPPING`.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    a, b, c = vector(p, WRAP_SURFACE.SIZES)
    # OpenSim scales the surface to a mean radius of 1, so that its tolerances are relative.
    factor = 3.0 / (a + b + c)
    axis = int(p[WRAP_SURFACE.AXIS])
    side = p[WRAP_SURFACE.SIDE]
    radii = times(factor, (a, b, c))
    first = times(factor, vector(e, WRAP_WORK.FIRST_END))
    second = times(factor, vector(e, WRAP_WORK.SECOND_END))
    first_height, second_height = ellipsoid_height(radii, first), ellipsoid_height(radii, second)
    if first_height < -SURFACE_TOLERANCE or second_height < -SURFACE_TOLERANCE:
        return WRAPPING.INSIDE
    chord = minus(first, second)
    enters, leaves = find_crossings(radii, second, chord)
    first_tangent = add_scaled(second, enters, chord)
    second_tangent = add_scaled(second, leaves, chord)
    # Ends in the same direction have no plane; a chord outside of the segment does not cross.
    if abs(dot(unit(first), unit(second)) - 1.0) < SURFACE_TOLERANCE or not (
        enters < 1.0 and leaves > 0.0
    ):
        return WRAPPING.NONE
    support, by_fan, starts = support_point(
        p[WRAP_SURFACE.METHOD],
        radii,
        first_tangent,
        minus(second_tangent, first_tangent),
        chord,
        at(e, WRAP_WORK.WORKSPACE),
    )
    if starts:
        first_tangent = second_tangent = support
    if side != 0.0 and not is_on_side(support, axis, side):
        # On the wrong side OpenSim mirrors the point across the plane of symmetry.
        outwards = -component(support, axis)
        first_tangent = second_tangent = support = replace_component(support, axis, outwards)
        if by_fan > 0.0:
            support = closest_point(
                radii, replace_component(support, axis, outwards - by_fan * outwards)
            )
    normal = unit(cross(chord, minus(first, support)))
    offset = dot(normal, support)
    # An end on the surface is its own tangent point.
    first_tangent = (
        tangent_point(radii, first_tangent, first, normal, offset)
        if abs(first_height) >= SURFACE_TOLERANCE
        else first
    )
    second_tangent = (
        tangent_point(radii, second_tangent, second, normal, offset)
        if abs(second_height) >= SURFACE_TOLERANCE
        else second
    )

    length = norm(minus(first_tangent, second_tangent)) / factor
    # OpenSim's search may fail; it then wraps without points.
    if isnan(length):
        return clear_tangents(e, WRAPPING.MANDATORY)
    store_vector(e, WRAP_WORK.CURVE, normal)
    e[WRAP_WORK.CURVE + 3], e[WRAP_WORK.CURVE + 4] = offset, 0.0
    # A short path is measured by its chord, a long one by a polyline as OpenSim draws it.
    if length >= SEGMENT_LENGTH_M:
        pieces = int(min(length / SEGMENT_LENGTH_M, 1.0 * MAX_SEGMENTS))
        length, after_first, before_second = measure_polyline(
            radii, first_tangent, second_tangent, normal, offset, pieces, False
        )
        # A path that starts backwards takes the longer way around the section.
        if (
            side != 0.0
            and pieces > 1
            and (
                bends_back(first, first_tangent, after_first)
                or bends_back(second, second_tangent, before_second)
            )
        ):
            length, _, _ = measure_polyline(
                radii, first_tangent, second_tangent, normal, offset, pieces, True
            )
            e[WRAP_WORK.CURVE + 4] = 1.0
        length /= factor
    store_vector(e, WRAP_WORK.FIRST_TANGENT, times(1.0 / factor, first_tangent))
    store_vector(e, WRAP_WORK.SECOND_TANGENT, times(1.0 / factor, second_tangent))
    e[WRAP_WORK.SURFACE_LENGTH] = length
    return WRAPPING.MANDATORY


def ellipsoid_height(radii: Vector, point: Vector) -> float:
    """Return (x/a)^2 + (y/b)^2 + (z/c)^2 - 1, negative inside.

    Args:
        radii: half axes of the ellipsoid.
        point: point in the frame of the ellipsoid.
    """
    x, y, z = point
    a, b, c = radii
    return (x / a) * (x / a) + (y / b) * (y / b) + (z / c) * (z / c) - 1.0


def invert_components(a: Vector) -> Vector:
    """Return the reciprocal of each component."""
    x, y, z = a
    return 1.0 / x, 1.0 / y, 1.0 / z


def find_crossings(radii: Vector, point: Vector, ray: Vector) -> tuple[float, float]:
    """Return the multiples of the direction, the larger first, at which a line intersects the surface.

    Args:
        radii: half axes.
        point: point of the line.
        ray: direction of the line.

    Returns:
        Two multiples; NaN if the line misses the surface.
    """
    ray = multiply_elementwise(invert_components(radii), ray)
    point = multiply_elementwise(invert_components(radii), point)
    # Scaled by the half axes, the surface is a unit sphere and the equation is quadratic.
    a = dot(ray, ray)
    b = 2.0 * dot(ray, point)
    c = dot(point, point) - 1.0
    square = b * b - 4.0 * a * c
    if not (square >= 0.0 and a > 0.0):
        return nan, nan
    return (sqrt(square) - b) / (2.0 * a), (-sqrt(square) - b) / (2.0 * a)


def support_point(
    method: float, radii: Vector, start: Vector, chord: Vector, ray: Vector, work: Floats
) -> tuple[Vector, float, bool]:
    """Return the point of the surface that determines the plane.

    Args:
        method: HYBRID, MIDPOINT or AXIAL of `ELLIPSOID_METHOD`.
        radii: half axes.
        start: point where the chord enters the ellipsoid.
        chord: vector from `start` to the point where the chord leaves the ellipsoid.
        ray: vector between the ends of the segment.
        work: workspace of the fan.

    Returns:
        The point, the weight of the fan, and whether the search for tangent points starts there.
    """
    middle = add_scaled(start, 0.5, chord)
    if method == ELLIPSOID_METHOD.MIDPOINT:
        return closest_point(radii, middle), 0.0, True
    # OpenSim's axial method uses the plane of symmetry across the largest component of the segment.
    axis = longest_axis(ray)
    crossing = -component(start, axis) / component(chord, axis)
    axial = closest_in_plane(radii, add_scaled(start, crossing, chord), axis)
    if method == ELLIPSOID_METHOD.AXIAL:
        return axial, 0.0, 0.0 < crossing < 1.0
    cosine = abs(component(unit(ray), axis))
    # Where the chord crosses this plane near one of its ends, the fan is phased in.
    fade = max(0.0, min(crossing, 1.0 - crossing) / FAN_PHASE_IN)
    if cosine > ALL_FAN and fade < 1.0:
        cosine = ALL_FAN + fade * (cosine - ALL_FAN)
    if cosine >= NO_FAN:
        return axial, 0.0, True
    fan_point = closest_point(
        radii, plus(middle, mean_outward_direction(radii, start, chord, work))
    )
    if cosine <= ALL_FAN:
        return fan_point, 1.0, True
    # Between both limits OpenSim blends the axial and the fanned point.
    axial_weight = (cosine - ALL_FAN) / (NO_FAN - ALL_FAN)
    return (
        closest_point(radii, add_scaled(times(axial_weight, axial), 1.0 - axial_weight, fan_point)),
        1.0 - axial_weight,
        True,
    )


def longest_axis(a: Vector) -> int:
    """Return the axis of the component with the largest absolute value."""
    x, y, z = a
    if abs(z) > max(abs(x), abs(y)):
        return 2
    return 1 if abs(y) > abs(x) else 0


def tangent_point(
    radii: Vector, start: Vector, end: Vector, normal: Vector, offset: float
) -> Vector:
    """Return the point of the surface in a plane whose tangent plane contains an end.

    Four equations determine the point r and a number d: r is in the plane and on the surface, and the
    end and r are in the tangent plane n . x + d = 0 of r, n = (2 x / a a, 2 y / b b, 2 z / c c).
    OpenSim solves them by the Levenberg-Marquardt method in small steps, and repeats each one at
    double length as long as that helps; the result depends on the start.

    Args:
        radii: half axes.
        start: start of the search.
        end: end of the segment.
        normal: unit normal of the plane.
        offset: offset of the plane along its normal.
    """
    weights = invert_components(multiply_elementwise(radii, radii))
    by_end = times(2.0, multiply_elementwise(weights, end))
    r = start
    step = (0.0, 0.0, 0.0)
    d_step = 0.0
    # Start with the tangent plane through r itself, where the third residual vanishes.
    d = -2.0 * dot(multiply_elementwise(weights, r), r)
    e0, e1, e2, e3 = tangent_residuals(weights, by_end, normal, offset, r, d)
    error = previous_error = e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3
    damping = 0.01
    for _ in range(MAX_ROUNDS):
        if not error > TANGENT_TOLERANCE:
            break
        n = times(2.0, multiply_elementwise(weights, r))
        downhill = minus(times(-e0, normal), add_scaled(times(e1 + 2.0 * e2, n), e3, by_end))
        # The gradient is that of the start of the round, however many trials follow.
        d_downhill = -e2 - e3
        cosine = dot(unit(minus(end, r)), unit(end))
        # OpenSim takes small steps where the end is seen under a large angle.
        size = (1.0 - cosine**100 if cosine > 0.1 else 1.0) / STEP_DIVISOR
        # Increase the damping until the error decreases.
        for _ in range(MAX_TRIALS):
            if not error >= previous_error:
                break
            step, d_step = solve_damped_step(normal, n, by_end, downhill, d_downhill, damping)
            step = times(size, step)
            d_step = size * d_step
            r = plus(r, step)
            d += d_step
            e0, e1, e2, e3 = tangent_residuals(weights, by_end, normal, offset, r, d)
            previous_error = error
            error = e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3
            damping *= 4.0
        damping /= 8.0
        # Then repeat the step at double length as long as that helps, and take the last one back.
        longer = 0.5
        for _ in range(MAX_TRIALS):
            if not error <= previous_error:
                break
            longer *= 2.0
            r = add_scaled(r, longer, step)
            d += longer * d_step
            e0, e1, e2, e3 = tangent_residuals(weights, by_end, normal, offset, r, d)
            previous_error = error
            error = e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3
        r = add_scaled(r, -longer, step)
        d -= longer * d_step
        e0, e1, e2, e3 = tangent_residuals(weights, by_end, normal, offset, r, d)
        previous_error = error = e0 * e0 + e1 * e1 + e2 * e2 + e3 * e3
    return r


def tangent_residuals(
    weights: Vector, by_end: Vector, normal: Vector, offset: float, r: Vector, d: float
) -> tuple[float, float, float, float]:
    """Return the residuals of the four equations of `tangent_point`.

    Args:
        weights: reciprocal squares of the half axes.
        by_end: gradient of the fourth equation.
        normal: unit normal of the plane.
        offset: offset of the plane along its normal.
        r: point of the surface.
        d: offset of the tangent plane.

    Returns:
        Residuals of the four equations.
    """
    square = dot(multiply_elementwise(weights, r), r)
    return dot(normal, r) - offset, square - 1.0, 2.0 * square + d, dot(by_end, r) + d


def solve_damped_step(
    normal: Vector, n: Vector, by_end: Vector, downhill: Vector, d_downhill: float, damping: float
) -> tuple[Vector, float]:
    """Solve (J' J + damping D) step = downhill, where D is the diagonal of J' J.

    J is the Jacobian of the four equations.

    The gradients of the four equations by r are the normal, n, 2 n and `by_end`; those by d are 0, 0,
    1, 1.

    Args:
        normal: unit normal of the plane.
        n: normal of the surface.
        by_end: gradient of the fourth equation.
        downhill: negative gradient by r.
        d_downhill: negative gradient by d.
        damping: damping factor.

    Returns:
        The steps of r and d.
    """
    px, py, pz = normal
    nx, ny, nz = n
    qx, qy, qz = by_end
    damped_factor = 1.0 + damping
    x = add_scaled(add_scaled(times(px, normal), 5.0 * nx, n), qx, by_end)
    y = add_scaled(add_scaled(times(py, normal), 5.0 * ny, n), qy, by_end)
    z = add_scaled(add_scaled(times(pz, normal), 5.0 * nz, n), qz, by_end)
    # Marquardt's damping scales the diagonal, so that the step does not depend on the units.
    x = replace_component(x, 0, damped_factor * component(x, 0))
    y = replace_component(y, 1, damped_factor * component(y, 1))
    z = replace_component(z, 2, damped_factor * component(z, 2))
    # Eliminate d, then use Cramer's rule.
    mixed = add_scaled(by_end, 2.0, n)
    bx, by, bz = times(-0.5 / damped_factor, mixed)
    x, y, z = add_scaled(x, bx, mixed), add_scaled(y, by, mixed), add_scaled(z, bz, mixed)
    reduced_rhs = add_scaled(downhill, -0.5 / damped_factor * d_downhill, mixed)
    yz, zx, xy = cross(y, z), cross(z, x), cross(x, y)
    step = times(
        1.0 / dot(x, yz), (dot(reduced_rhs, yz), dot(reduced_rhs, zx), dot(reduced_rhs, xy))
    )
    return step, 0.5 / damped_factor * (d_downhill - dot(mixed, step))


def measure_polyline(
    radii: Vector,
    first_tangent: Vector,
    second_tangent: Vector,
    normal: Vector,
    offset: float,
    pieces: int,
    is_long: bool,
) -> tuple[float, Vector, Vector]:
    """Compute the length of a polyline on the surface in a plane.

    Its corners are at equal angles about the point where the plane meets the axis that is closest to
    its normal.

    Args:
        radii: half axes.
        first_tangent: first point of the polyline.
        second_tangent: last point of the polyline.
        normal: unit normal n of the plane n . x = offset.
        offset: offset of the plane.
        pieces: number of segments of the polyline.
        is_long: whether the polyline takes the longer way.

    Returns:
        The length, and the corners next to the first and the last point.
    """
    centre, a, b, angle = polar_coordinates(first_tangent, second_tangent, normal, offset)
    to_first, to_second = minus(first_tangent, centre), minus(second_tangent, centre)
    # A corner is at centre + m (c a + s b), where c and s are cosine and sine of its angle: in the
    # plane at m (c, s).
    scale = invert_components(radii)
    u = multiply_elementwise(scale, a)
    v = multiply_elementwise(scale, b)
    w = multiply_elementwise(scale, centre)
    uu = dot(u, u)
    uv = dot(u, v)
    vv = dot(v, v)
    uw = dot(u, w)
    vw = dot(v, w)
    ww = dot(w, w) - 1.0
    piece = (angle - 2.0 * pi if is_long else angle) / pieces
    c_piece, s_piece = cos(piece), sin(piece)
    c = 1.0
    s = 0.0
    m = 0.0
    x = norm(to_first)
    y = 0.0
    length = 0.0
    after_first = first_tangent
    for k in range(1, pieces):
        c, s = c * c_piece - s * s_piece, s * c_piece + c * s_piece
        # Intersection of the ray with the surface: a quadratic equation for m, where `inner` is its
        # discriminant.
        square = (uu * c + 2.0 * uv * s) * c + vv * s * s
        half = uw * c + vw * s
        inner = half * half - square * ww
        # A ray from outside may miss the surface; OpenSim's points are then undefined.
        m = (sqrt(inner) - half) / square if inner >= 0.0 else nan
        length += sqrt((m * c - x) * (m * c - x) + (m * s - y) * (m * s - y))
        x, y = m * c, m * s
        if k == 1:
            after_first = add_scaled(add_scaled(centre, x, a), y, b)
    before_second = add_scaled(add_scaled(centre, x, a), y, b)
    dx, dy = dot(to_second, a) - x, dot(to_second, b) - y
    return length + sqrt(dx * dx + dy * dy), after_first, before_second


def polar_coordinates(
    first_point: Vector, second_point: Vector, normal: Vector, offset: float
) -> tuple[Vector, Vector, Vector, float]:
    """Return polar coordinates of two points of a plane, about its intersection with an axis.

    The axis is the one closest to the normal of the plane.

    Args:
        first_point: first point.
        second_point: second point.
        normal: unit normal of the plane.
        offset: offset of the plane.

    Returns:
        The intersection, unit vectors to the first point and, perpendicular to that, towards the
        second, and the angle between the points.
    """
    axis = longest_axis(normal)
    across = component(normal, axis)
    centre = replace_component((0.0, 0.0, 0.0), axis, offset / across if across != 0.0 else nan)
    a, b = unit(minus(first_point, centre)), unit(minus(second_point, centre))
    # Rounding may give a cosine beyond 1, for which acos is undefined in OpenSim.
    cosine = dot(a, b)
    return centre, a, cross(unit(cross(a, b)), a), acos(cosine) if abs(cosine) <= 1.0 else nan


def bends_back(end: Vector, tangent: Vector, next_point: Vector) -> bool:
    """Return whether a path on the surface starts towards the end that it comes from.

    Args:
        end: end of the segment.
        tangent: tangent point next to the end.
        next_point: next corner of the path on the surface.
    """
    return dot(minus(end, tangent), minus(next_point, tangent)) > 0.0
