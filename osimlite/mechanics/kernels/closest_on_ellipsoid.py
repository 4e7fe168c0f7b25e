"""The points of an ellipsoid that are closest to given ones.

Source: J. C. Hart, Distance to an ellipsoid, in P. Heckbert (ed.), Graphics Gems IV, 1994, as
    OpenSim 4.6 has it in
WrapEllipsoid: Newton's method stops where the polynomial is small, so the points are those of its
    very steps.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.laws.dual_numbers import settled
from osimlite.mechanics.laws.vectors import Vector, along, component, minus, norm, plus, unit

FLAT = 2e-13
"""Distance from a plane of symmetry up to which OpenSim takes a point for one of the plane."""
SMALL, STEPS = 1e-9, 64
"""Newton's method ends where the polynomial is less than this, or after so many steps."""
SAMPLES = 300
"""The blades of a fan stand at all multiples of so small a part of the chord, but the last one before its end."""
LANES = 16
"""So many blades are found side by side: compilers make instructions for several numbers of such loops."""
PART, X, Y, Z, MULTIPLIER = 0, LANES, 2 * LANES, 3 * LANES, 4 * LANES
"""What is kept of each: its place on the chord; (a a u u, b b v v, c c w w), then its direction; t."""


def closest_point(radii: Vector, point: Vector) -> Vector:
    """The closest point; of a point in a plane of symmetry that of the ellipse there, as OpenSim's formula needs.

    In two such planes it is that of the one across the longer axis.
    """
    axis = -1
    for k in range(3):
        if abs(component(point, k)) <= FLAT and (
            axis < 0 or component(radii, k) > component(radii, axis)
        ):
            axis = k
    if axis >= 0:
        return closest_in_plane(radii, point, axis)
    a, b, c = radii
    u, v, w = point
    aa, bb, cc = a * a, b * b, c * c
    aauu, bbvv, ccww = aa * (u * u), bb * (v * v), cc * (w * w)
    inside = (u / a) * (u / a) + (v / b) * (v / b) + (w / c) * (w / c) < 1.0
    t = 0.0 if inside else max(a, b, c) * norm(point)
    for _ in range(STEPS):
        value, slope = polynomial(t + aa, t + bb, t + cc, aauu, bbvv, ccww)
        if abs(value) < SMALL:
            t = settled(t, value, slope)
            break
        t -= value / slope
    return aa * u / (t + aa), bb * v / (t + bb), cc * w / (t + cc)


def polynomial(
    P: float, Q: float, R: float, aauu: float, bbvv: float, ccww: float
) -> tuple[float, float]:
    """What is zero if (a a u / P, b b v / Q, c c w / R) is the point closest to (u, v, w), and its derivative by t.

    Args:
        P: t + a a; Q and R likewise.
        aauu: a a u u, where a is a radius; bbvv and ccww likewise.
    """
    PQ, PR, QR = P * Q, P * R, Q * R
    PQR, u, v, w = P * QR, aauu * QR, bbvv * PR, ccww * PQ
    value = PQR * PQR - u * QR - v * PR - w * PQ
    return value, 2.0 * (PQR * (QR + PR + PQ) - u * (Q + R) - v * (P + R) - w * (P + Q))


def closest_in_plane(radii: Vector, point: Vector, axis: int) -> Vector:
    """The closest point of the ellipse in the plane of symmetry across an axis; what the point has along it stays."""
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
    """The point of an ellipse that is closest to (u, v)."""
    aa, bb = a * a, b * b
    if abs(u) <= FLAT and abs(v) <= FLAT:
        return (-a if u < 0.0 else a, v) if a < b else (u, -b if v < 0.0 else b)
    if abs(u) <= FLAT:
        if a >= b or abs(v) >= b - aa / b:
            return u, b if v >= 0.0 else -b
        y = bb * v / (bb - aa)
        return a * sqrt(abs(1.0 - (y / b) * (y / b))), y
    if abs(v) <= FLAT:
        if b >= a or abs(u) >= a - bb / a:
            return a if u >= 0.0 else -a, v
        x = aa * u / (aa - bb)
        return x, b * sqrt(abs(1.0 - (x / a) * (x / a)))
    aauu, bbvv = aa * (u * u), bb * (v * v)
    t = 0.0 if (u / a) * (u / a) + (v / b) * (v / b) < 1.0 else max(a, b) * sqrt(u * u + v * v)
    for _ in range(STEPS):
        P, Q = t + aa, t + bb
        value = P * P * (Q * Q) - aauu * (Q * Q) - bbvv * (P * P)
        slope = 2.0 * (P * Q * (P + Q) - aauu * Q - bbvv * P)
        if abs(value) < SMALL:
            t = settled(t, value, slope)
            break
        t -= value / slope
    return aa * u / (t + aa), bb * v / (t + bb)


def fan(radii: Vector, start: Vector, chord: Vector, room: Floats) -> Vector:
    """The mean direction of the shortest ways out of an ellipsoid, from points of a chord.

    Args:
        radii: of the ellipsoid.
        start: where the chord begins.
        chord: the way from there to its other end.
        room: for 5 * LANES numbers.
    """
    a, b, c = radii
    sx, sy, sz = start
    dx, dy, dz = chord
    aa, bb, cc = a * a, b * b, c * c
    total = 0.0, 0.0, 0.0
    for first in range(1, SAMPLES - 1, LANES):
        for k in range(LANES):
            part = min(first + k, SAMPLES - 2) / SAMPLES
            u, v, w = sx + part * dx, sy + part * dy, sz + part * dz
            aauu, bbvv, ccww = aa * (u * u), bb * (v * v), cc * (w * w)
            value, slope = polynomial(aa, bb, cc, aauu, bbvv, ccww)
            room[PART + k], room[MULTIPLIER + k] = (
                part,
                -value / slope if abs(value) >= SMALL else 0.0,
            )
            room[X + k], room[Y + k], room[Z + k] = aauu, bbvv, ccww
        for _ in range(STEPS):
            going = 0
            for k in range(LANES):
                t = room[MULTIPLIER + k]
                value, slope = polynomial(
                    t + aa, t + bb, t + cc, room[X + k], room[Y + k], room[Z + k]
                )
                if abs(value) >= SMALL:
                    t -= value / slope
                    going += 1
                room[MULTIPLIER + k] = t
            if going == 0:
                break
        for k in range(LANES):
            part, t = room[PART + k], room[MULTIPLIER + k]
            u, v, w = sx + part * dx, sy + part * dy, sz + part * dz
            P, Q, R = t + aa, t + bb, t + cc
            x, y, z = -t * u * (Q * R), -t * v * (P * R), -t * w * (P * Q)
            size = sqrt(x * x + y * y + z * z)
            inverse = 1.0 / size if size > 0.0 else 0.0
            room[X + k], room[Y + k], room[Z + k] = inverse * x, inverse * y, inverse * z
        for k in range(min(LANES, SAMPLES - 1 - first)):
            point = along(start, room[PART + k], chord)
            blade = room[X + k], room[Y + k], room[Z + k]
            u, v, w = point
            if min(abs(u), abs(v), abs(w)) <= FLAT:
                blade = unit(minus(closest_point(radii, point), point))
            total = plus(total, blade)
    return unit(total)
