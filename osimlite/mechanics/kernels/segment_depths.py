"""Depth of a segment of a path in a wrap surface, and the ways out of it.

A segment that passes near the middle of a surface can be bent out of it in several directions; the
shortest path is the best of them. All points are in the frame of the surface, in m.
"""

from __future__ import annotations

from math import cos, inf, pi, sin, sqrt

from osimlite.mechanics.kernels.cable_surfaces import SURFACE, SURFACE_TYPE
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    multiply_elementwise,
    replace_component,
    times,
    unit,
    vector,
)

MIN_DENOMINATOR = 1e-100
"""Smallest denominator, so that nothing is divided by zero."""
SAMPLES = 16
"""Number of intervals in the search for the point of a segment nearest to a ring."""
NEWTON_STEPS = 6
"""Number of Newton steps that refine this point."""
NEAR_MIDDLE = 0.3
"""Depth (see `squared_depth`) below which a line passes near the middle of a sphere."""
DIRECTIONS = 16
"""Number of directions across a line that are tried on an ellipsoid."""
MAX_DEPTH_RATIO = 1.5
"""Largest ratio of depths with which the second best direction is tried."""


def count_directions(p: Floats, first: Vector, second: Vector, is_alone: bool) -> int:
    """Return the number of directions in which a line through an open surface is bent in turn.

    Around a single surface there is a second one only on an ellipsoid. Among others, each is passed on
    either side; a sphere, on which any direction may be the shortest, also perpendicular to these if
    the line passes near its middle.

    Args:
        p: numbers of the surface.
        first: start of the line.
        second: end of the line.
        is_alone: whether no other surface may bend the segment.
    """
    if not is_alone:
        return (
            4
            if p[SURFACE.KIND] == SURFACE_TYPE.SPHERE
            and squared_depth(p, first, second) < NEAR_MIDDLE
            else 2
        )
    if p[SURFACE.KIND] != SURFACE_TYPE.ELLIPSOID:
        return 1
    chord, weights = minus(second, first), vector(p, SURFACE.WEIGHTS)
    fraction = -dot(multiply_elementwise(weights, first), chord) / max(
        dot(multiply_elementwise(weights, chord), chord), MIN_DENOMINATOR
    )
    x, y, z = weights
    second_direction = outward_direction(
        (sqrt(1.0 / x), sqrt(1.0 / y), sqrt(1.0 / z)),
        add_scaled(first, fraction, chord),
        chord,
        MAX_DEPTH_RATIO,
    )
    return 2 if dot(second_direction, second_direction) > 0.0 else 1


def squared_depth(p: Floats, first: Vector, second: Vector) -> float:
    """Return the squared distance of a segment from the middle of a surface.

    It is the distance from the axis of a cylinder or the ring of a torus (m²), or from the centre of a
    sphere or an ellipsoid in units of the radii.

    Args:
        p: numbers of the surface.
        first: start of the segment.
        second: end of the segment.
    """
    if p[SURFACE.KIND] == SURFACE_TYPE.TORUS:
        return distance_from_ring(
            nearest_to_ring(p[SURFACE.RADIUS], first, second), p[SURFACE.RADIUS]
        )
    chord, weights = minus(second, first), vector(p, SURFACE.WEIGHTS)
    square = dot(multiply_elementwise(weights, chord), chord)
    # In scaled coordinates the surface is a unit sphere, and the nearest point is a projection.
    fraction = min(
        max(-dot(multiply_elementwise(weights, first), chord) / max(square, MIN_DENOMINATOR), 0.0),
        1.0,
    )
    middle = add_scaled(first, fraction, chord)
    return dot(multiply_elementwise(weights, middle), middle) / (
        p[SURFACE.SQUARE] if p[SURFACE.KIND] != SURFACE_TYPE.CYLINDER else 1.0
    )


def outward_direction(radii: Vector, middle: Vector, chord: Vector, deeper: float) -> Vector:
    """Return the direction across a line in which it is least deep in an ellipsoid, a unit vector.

    Args:
        radii: half axes.
        middle: point of the line.
        chord: direction of the line.
        deeper: 0 or less for the global minimum; a positive number for the second best local
            minimum, or zeros if the line is more than this many times deeper there or no second
            minimum exists.
    """
    x, y, z = chord
    # Any axis that is not along the line gives two directions across it.
    axis = 0 if abs(x) <= min(abs(y), abs(z)) else (1 if abs(y) <= abs(z) else 2)
    a = unit(cross(chord, replace_component((0.0, 0.0, 0.0), axis, 1.0)))
    b = cross(unit(chord), a)
    ra, rb = multiply_elementwise(radii, a), multiply_elementwise(radii, b)
    aa, ab, bb = dot(ra, ra), dot(ra, rb), dot(rb, rb)
    ma, mb = dot(middle, a), dot(middle, b)
    # Sample the depth all around, and refine each minimum by the parabola through three samples.
    best = second = (inf, 0.0)
    previous_depth = line_depth(aa, ab, bb, ma, mb, -2)
    this_depth = line_depth(aa, ab, bb, ma, mb, -1)
    for k in range(DIRECTIONS):
        next_depth = line_depth(aa, ab, bb, ma, mb, k)
        if this_depth < previous_depth and this_depth <= next_depth:
            result = (
                this_depth,
                2.0
                * pi
                / DIRECTIONS
                * (
                    k
                    - 1
                    + 0.5
                    * (previous_depth - next_depth)
                    / (previous_depth - 2.0 * this_depth + next_depth)
                ),
            )
            if this_depth < best[0]:
                best, second = result, best
            elif this_depth < second[0]:
                second = result
        previous_depth, this_depth = this_depth, next_depth
    depth, angle = second if deeper > 0.0 else best
    if depth == inf or depth > max(deeper, 1.0) * best[0]:
        return 0.0, 0.0, 0.0
    return add_scaled(times(cos(angle), a), sin(angle), b)


def line_depth(aa: float, ab: float, bb: float, ma: float, mb: float, k: int) -> float:
    """Return the depth of a line in an ellipsoid in a direction across it.

    With the unit directions a and b across the line, a point m of it and the half axes r, the depth
    along e = c a + s b is |r * e| - m . e (* is the elementwise product).

    Args:
        aa: scalar product of r * a with itself.
        ab: scalar product of r * a and r * b.
        bb: scalar product of r * b with itself.
        ma: scalar product of m and a.
        mb: scalar product of m and b.
        k: number of the direction.
    """
    c, s = cos(2.0 * pi / DIRECTIONS * k), sin(2.0 * pi / DIRECTIONS * k)
    return sqrt(aa * c * c + 2.0 * ab * c * s + bb * s * s) - ma * c - mb * s


def nearest_to_ring(ring: float, first: Vector, second: Vector) -> Vector:
    """Return the point of a segment that is nearest to a ring about z.

    Args:
        ring: radius of the ring (m).
        first: start of the segment.
        second: end of the segment.
    """
    wx, wy, wz = chord = minus(second, first)
    best, least = 0.0, inf
    # The distance has up to two minima along a line: sample it before Newton's method.
    for k in range(SAMPLES + 1):
        distance = distance_from_ring(add_scaled(first, k / SAMPLES, chord), ring)
        if distance < least:
            best = k / SAMPLES
            least = distance
    for _ in range(NEWTON_STEPS):
        x, y, z = add_scaled(first, best, chord)
        square = max(x * x + y * y, MIN_DENOMINATOR)
        outer = sqrt(square)
        flat = x * wx + y * wy
        slope = flat * (1.0 - ring / outer) + z * wz
        bends = (
            (wx * wx + wy * wy) * (1.0 - ring / outer)
            + ring * flat * flat / (square * outer)
            + wz * wz
        )
        # Near a maximum Newton's method would leave the minimum.
        if not bends > 0.0:
            break
        best = min(max(best - slope / bends, 0.0), 1.0)
    return add_scaled(first, best, chord)


def distance_from_ring(point: Vector, ring: float) -> float:
    """Return the squared distance of a point from a ring about z (m²).

    Args:
        point: point (m).
        ring: radius of the ring (m).
    """
    x, y, z = point
    across = sqrt(x * x + y * y) - ring
    return across * across + z * z
