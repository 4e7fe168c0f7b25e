"""Points of an ellipsoid that are closest to given points.

Source: J. C. Hart, Distance to an ellipsoid, in P. Heckbert (ed.), Graphics Gems IV, 1994, as in
OpenSim 4.6's WrapEllipsoid. Newton's method stops where the polynomial is small, so that the points
depend on its steps, which are reproduced here.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.dual_numbers import differentiate_root
from osimlite.mechanics.laws.vectors import Vector, add_scaled, component, minus, norm, plus, unit

PLANE_TOLERANCE_M = 2e-13
"""Distance from a plane of symmetry (m) up to which OpenSim counts a point as in the plane."""
RESIDUAL_TOLERANCE = 1e-9
"""Absolute value of the polynomial at which Newton's method ends."""
MAX_NEWTON_STEPS = 64
"""Largest number of Newton steps."""
SAMPLES = 300
"""Number of intervals of the chord; the fan has a blade at each inner point but the last."""
LANES = 16
"""Number of blades that are computed together, so that compilers use vector instructions."""


class BLADES(metaclass=Record):
    """Workspace of the fan: LANES numbers of each kind."""

    PART = 0
    """Positions of the blades on the chord."""
    X = LANES
    """Numbers a a u u, then the x component of the direction."""
    Y = 2 * LANES
    """Numbers b b v v, then the y component of the direction."""
    Z = 3 * LANES
    """Numbers c c w w, then the z component of the direction."""
    MULTIPLIER = 4 * LANES
    """Multipliers t."""


def closest_point(radii: Vector, point: Vector) -> Vector:
    """Return the closest point of an ellipsoid.

    For a point in a plane of symmetry it is that of the ellipse there, as OpenSim's formula needs; for
    one in two such planes that of the plane across the longer axis.

    Args:
        radii: half axes (m).
        point: point (m).
    """
    # Find the longest axis along which the point has no component.
    axis = -1
    for k in range(3):
        if abs(component(point, k)) <= PLANE_TOLERANCE_M and (
            axis < 0 or component(radii, k) > component(radii, axis)
        ):
            axis = k
    if axis >= 0:
        return closest_in_plane(radii, point, axis)
    a, b, c = radii
    u, v, w = point
    aa, bb, cc = a * a, b * b, c * c
    aauu, bbvv, ccww = aa * (u * u), bb * (v * v), cc * (w * w)
    is_inside = (u / a) * (u / a) + (v / b) * (v / b) + (w / c) * (w / c) < 1.0
    # Outside, this start is beyond the largest root, from which Newton's method converges
    # monotonically.
    t = 0.0 if is_inside else max(a, b, c) * norm(point)
    for _ in range(MAX_NEWTON_STEPS):
        value, slope = evaluate_polynomial(t + aa, t + bb, t + cc, aauu, bbvv, ccww)
        if abs(value) < RESIDUAL_TOLERANCE:
            # The root carries derivatives by the implicit function theorem, although OpenSim's
            # steps end early.
            t = differentiate_root(t, value, slope)
            break
        t -= value / slope
    return aa * u / (t + aa), bb * v / (t + bb), cc * w / (t + cc)


def evaluate_polynomial(
    P: float, Q: float, R: float, aauu: float, bbvv: float, ccww: float
) -> tuple[float, float]:
    """Evaluate the polynomial whose root t gives the closest point (a a u / P, b b v / Q, c c w / R).

    Args:
        P: t + a a, where a is the first half axis.
        Q: t + b b.
        R: t + c c.
        aauu: a a u u, where u is the first coordinate of the point.
        bbvv: b b v v.
        ccww: c c w w.

    Returns:
        Value and derivative by t.
    """
    PQ, PR, QR = P * Q, P * R, Q * R
    # The equation times (P Q R)^2, as in OpenSim, whose search ends at a value of this polynomial.
    PQR, u, v, w = P * QR, aauu * QR, bbvv * PR, ccww * PQ
    value = PQR * PQR - u * QR - v * PR - w * PQ
    return value, 2.0 * (PQR * (QR + PR + PQ) - u * (Q + R) - v * (P + R) - w * (P + Q))


def closest_in_plane(radii: Vector, point: Vector, axis: int) -> Vector:
    """Return the closest point of the ellipse in the plane of symmetry across an axis.

    Args:
        radii: half axes (m).
        point: point (m); its component along the axis is returned unchanged.
        axis: axis across the plane, 0, 1 or 2.
    """
    a, b, c = radii
    u, v, w = point
    if axis == 0:
        v, w = closest_on_ellipse(b, c, v, w)
    elif axis == 1:
        w, u = closest_on_ellipse(c, a, w, u)
    else:
        u, v = closest_on_ellipse(a, b, u, v)
    return u, v, w


def closest_on_ellipse(a: float, b: float, u: float, v: float) -> tuple[float, float]:
    """Return the point of an ellipse that is closest to (u, v).

    Args:
        a: half axis along the first coordinate (m).
        b: half axis along the second coordinate (m).
        u: coordinate of the point along the half axis a (m).
        v: coordinate of the point along the half axis b (m).

    Returns:
        Coordinates of the closest point along a and b (m).
    """
    aa, bb = a * a, b * b
    # At the centre the nearest points are the ends of the shorter axis; the sign decides between
    # them.
    if abs(u) <= PLANE_TOLERANCE_M and abs(v) <= PLANE_TOLERANCE_M:
        return (-a if u < 0.0 else a, v) if a < b else (u, -b if v < 0.0 else b)
    if abs(u) <= PLANE_TOLERANCE_M:
        # On an axis: within the evolute two points are nearest, and OpenSim takes that with a
        # positive coordinate.
        if a >= b or abs(v) >= b - aa / b:
            return u, b if v >= 0.0 else -b
        y = bb * v / (bb - aa)
        return a * sqrt(abs(1.0 - (y / b) * (y / b))), y
    if abs(v) <= PLANE_TOLERANCE_M:
        if b >= a or abs(u) >= a - bb / a:
            return a if u >= 0.0 else -a, v
        x = aa * u / (aa - bb)
        return x, b * sqrt(abs(1.0 - (x / a) * (x / a)))
    aauu, bbvv = aa * (u * u), bb * (v * v)
    t = 0.0 if (u / a) * (u / a) + (v / b) * (v / b) < 1.0 else max(a, b) * sqrt(u * u + v * v)
    for _ in range(MAX_NEWTON_STEPS):
        P, Q = t + aa, t + bb
        value = P * P * (Q * Q) - aauu * (Q * Q) - bbvv * (P * P)
        slope = 2.0 * (P * Q * (P + Q) - aauu * Q - bbvv * P)
        if abs(value) < RESIDUAL_TOLERANCE:
            t = differentiate_root(t, value, slope)
            break
        t -= value / slope
    return aa * u / (t + aa), bb * v / (t + bb)


def mean_outward_direction(radii: Vector, start: Vector, chord: Vector, work: Floats) -> Vector:
    """Return the mean direction of the shortest ways out of an ellipsoid, from points of a chord.

    Args:
        radii: half axes.
        start: start of the chord.
        chord: vector from `start` to the end of the chord.
        work: workspace of 5 * LANES numbers.
    """
    a, b, c = radii
    sx, sy, sz = start
    dx, dy, dz = chord
    aa, bb, cc = a * a, b * b, c * c
    total = 0.0, 0.0, 0.0
    for first in range(1, SAMPLES - 1, LANES):
        for k in range(LANES):
            fraction = min(first + k, SAMPLES - 2) / SAMPLES
            # Each blade solves the equation of `closest_point`; all lanes take the same steps.
            u, v, w = sx + fraction * dx, sy + fraction * dy, sz + fraction * dz
            aauu, bbvv, ccww = aa * (u * u), bb * (v * v), cc * (w * w)
            # The first step is that from t = 0, since the points of the chord are inside.
            value, slope = evaluate_polynomial(aa, bb, cc, aauu, bbvv, ccww)
            work[BLADES.PART + k], work[BLADES.MULTIPLIER + k] = (
                fraction,
                -value / slope if abs(value) >= RESIDUAL_TOLERANCE else 0.0,
            )
            work[BLADES.X + k], work[BLADES.Y + k], work[BLADES.Z + k] = aauu, bbvv, ccww
        for _ in range(MAX_NEWTON_STEPS):
            active_lanes = 0
            for k in range(LANES):
                t = work[BLADES.MULTIPLIER + k]
                value, slope = evaluate_polynomial(
                    t + aa,
                    t + bb,
                    t + cc,
                    work[BLADES.X + k],
                    work[BLADES.Y + k],
                    work[BLADES.Z + k],
                )
                if abs(value) >= RESIDUAL_TOLERANCE:
                    t -= value / slope
                    active_lanes += 1
                work[BLADES.MULTIPLIER + k] = t
            if active_lanes == 0:
                break
        for k in range(LANES):
            fraction, t = work[BLADES.PART + k], work[BLADES.MULTIPLIER + k]
            u, v, w = sx + fraction * dx, sy + fraction * dy, sz + fraction * dz
            P, Q, R = t + aa, t + bb, t + cc
            # Direction from the point to the closest one, times (t + aa)(t + bb)(t + cc): -t u / (t
            # + aa) and so on.
            x, y, z = -t * u * (Q * R), -t * v * (P * R), -t * w * (P * Q)
            size = sqrt(x * x + y * y + z * z)
            inverse = 1.0 / size if size > 0.0 else 0.0
            work[BLADES.X + k], work[BLADES.Y + k], work[BLADES.Z + k] = (
                inverse * x,
                inverse * y,
                inverse * z,
            )
        for k in range(min(LANES, SAMPLES - 1 - first)):
            point = add_scaled(start, work[BLADES.PART + k], chord)
            blade = work[BLADES.X + k], work[BLADES.Y + k], work[BLADES.Z + k]
            u, v, w = point
            # In a plane of symmetry the formula degenerates.
            if min(abs(u), abs(v), abs(w)) <= PLANE_TOLERANCE_M:
                blade = unit(minus(closest_point(radii, point), point))
            total = plus(total, blade)
    return unit(total)
