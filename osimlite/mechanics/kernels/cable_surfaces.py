"""Surfaces that a cable runs over, and geodesics on them, as in Simbody's CableSpan.

A surface is where a function of the place is 0, which is positive inside. A geodesic on a sphere or
a cylinder is known; on other surfaces it is integrated, in Simbody's very steps, since these tell
to which digits the path is found. By how much its end moves sideways as its start is shifted
sideways by 1, or turned, are A and R of its Jacobi fields.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.vectors import (
    EPSILON,
    Vector,
    along,
    cross,
    dot,
    elementwise,
    minus,
    norm,
    put,
    times,
    unit,
    vector,
)

SPHERE, CYLINDER, ELLIPSOID, TORUS = 0.0, 1.0, 2.0, 3.0
KIND, RADIUS, SQUARE, WEIGHTS, TUBE = 0, 1, 2, 3, 2
"""Numbers of a surface: what it is; its radius, or that of the ring of a torus; then the radius of
the tube of a torus, or a square and weights: the surface is where the square is the weighted sum of
the squares of the coordinates.
"""
SURFACE_NUMBERS = 6

POINT, ALONG, NORMAL, ACROSS, ALONG_BENDS, ACROSS_BENDS, TORSION = 0, 3, 6, 9, 12, 13, 14
"""Numbers of an end of a geodesic: where it is; its direction along the geodesic, out of the
surface, and across both; the curvatures along and across, and the torsion.
"""
END_NUMBERS = 15

START, END, A, R, A_RATE, R_RATE, ARC, STEP = 0, 15, 30, 31, 32, 33, 34, 35
"""Numbers of a geodesic: its ends; the Jacobi fields at the end, and their derivatives; its length,
m; the step of the integration to begin with, m; 0 to integrate by extrapolation, as exactly as may
be.
"""
GEODESIC_NUMBERS = 36

SIZE = 10
"""Length of the state that is integrated along a geodesic: position, R, A, and their derivatives."""
COLUMNS = 7
GEODESIC_ROOM = (3 + COLUMNS) * SIZE
"""Of room for an integration: columns of the extrapolation, or what a step of Merson's takes."""
ACCURACY, CONSTRAINT, SMALLEST = 1e-10, 1e-9, 2.0**-45.5
"""Of a step, of what the surface demands, and the smallest step, m."""
EXACT, ROUNDED = 1e-12, 1e-15
"""By this the last column of an extrapolation may move the end, m; it is better than that by far.
So near to 0 the function of the surface is then; moment arms need that.
"""
MOST_STEPS, MOST_CORRECTIONS = 10_000, 10
LEAST, MOST, SAFETY, STRETCH, LESS, MORE = 0.1, 5.0, 0.9, 0.1, 0.9, 1.2
"""How step sizes change, as in Simbody's GeodesicIntegrator."""


def value(p: Floats, a: Vector) -> float:
    """The function whose zeros are the surface."""
    x, y, z = a
    result = p[SQUARE] - dot(elementwise(vector(p, WEIGHTS), a), a)
    if p[KIND] == TORUS:
        across = p[RADIUS] - sqrt(x * x + y * y)
        result = 1.0 - (across * across + z * z) / (p[TUBE] * p[TUBE])
    return float(result)


def gradient(p: Floats, a: Vector) -> Vector:
    """Its gradient."""
    if p[KIND] == TORUS:
        x, y, z = a
        scale, distance = -2.0 / (p[TUBE] * p[TUBE]), sqrt(x * x + y * y)
        inwards = 1.0 - p[RADIUS] / distance
        return scale * inwards * x, scale * inwards * y, scale * z
    return times(-2.0, elementwise(vector(p, WEIGHTS), a))


def hessian(p: Floats, a: Vector) -> tuple[float, float, float, float]:
    """Its second derivatives xx, yy, zz, xy; the others are 0."""
    if p[KIND] == TORUS:
        x, y, _ = a
        scale, square = -2.0 / (p[TUBE] * p[TUBE]), x * x + y * y
        ring = p[RADIUS] / (square * sqrt(square))
        return (
            scale * (1.0 - ring * y * y),
            scale * (1.0 - ring * x * x),
            scale,
            scale * ring * x * y,
        )
    xx, yy, zz = times(-2.0, vector(p, WEIGHTS))
    return xx, yy, zz, 0.0


def hessian_times(p: Floats, a: Vector, b: Vector) -> Vector:
    """The second derivatives times a vector."""
    xx, yy, zz, xy = hessian(p, a)
    x, y, z = b
    return xx * x + xy * y, xy * x + yy * y, zz * z


def nearest_on_line(p: Floats, a: Vector, b: Vector, start: Vector) -> tuple[bool, Vector]:
    """Whether a line between two points goes below the surface, and where; else its point nearest to the surface.

    As Simbody finds it from the point nearest to a start; it is the start if the search did not
    come to an end.
    """
    way = minus(b, a)
    square = dot(way, way)
    if square < EPSILON:
        return value(p, a) > 0.0, a
    part = min(max(-dot(way, minus(a, start)) / square, 0.0), 1.0)
    for _ in range(50):
        point = along(a, part, way)
        if -value(p, point) < EPSILON:
            return True, point
        curvature = abs(dot(way, hessian_times(p, point, way)))
        step = -dot(gradient(p, point), way) / (curvature + 0.5)
        before = part
        part = min(max(part - min(max(step, -0.2), 0.2), 0.0), 1.0)
        if abs(part - before) < CONSTRAINT:
            return False, along(a, part, way)
    return False, start


def shoot(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, room: Floats
) -> bool:
    """Find a geodesic from near a point in about a direction; whether there is one."""
    geodesic[ARC] = length
    if p[KIND] == SPHERE:
        radius = p[RADIUS]
        normal = unit(point)
        tangent = cross(normal, unit(cross(direction, normal)))
        c, s = cos(length / radius), sin(length / radius)
        end, end_tangent = along(times(c, normal), s, tangent), along(times(c, tangent), -s, normal)
        set_end(p, times(radius, normal), tangent, at(geodesic, START))
        set_end(p, times(radius, end), end_tangent, at(geodesic, END))
        geodesic[A], geodesic[A_RATE], geodesic[R], geodesic[R_RATE] = c, -s / radius, s * radius, c
        return True
    if p[KIND] == CYLINDER:
        radius = p[RADIUS]
        x, y, height = point
        nx, ny, _ = normal = unit((x, y, 0.0))
        tx, ty, tz = tangent = cross(normal, unit(cross(direction, normal)))
        _, _, turn = cross(normal, tangent)
        c, s = cos(length / radius * turn), sin(length / radius * turn)
        set_end(p, (radius * nx, radius * ny, height), tangent, at(geodesic, START))
        end = radius * (c * nx - s * ny), radius * (s * nx + c * ny), height + length * tz
        set_end(p, end, (c * tx - s * ty, s * tx + c * ty, tz), at(geodesic, END))
        geodesic[A], geodesic[A_RATE], geodesic[R], geodesic[R_RATE] = 1.0, 0.0, length, 1.0
        return True
    if geodesic[STEP] == 0.0:
        return extrapolate(p, point, direction, length, geodesic, room)
    return integrate(p, point, direction, length, geodesic, room)


def set_end(p: Floats, point: Vector, direction: Vector, end: Floats) -> None:
    """Note an end of a geodesic."""
    g = gradient(p, point)
    normal = times(-1.0, unit(g))
    across = unit(cross(direction, normal))
    tangent = cross(normal, across)
    put(end, POINT, point)
    put(end, ALONG, tangent)
    put(end, NORMAL, normal)
    put(end, ACROSS, across)
    bent = hessian_times(p, point, tangent)
    end[ALONG_BENDS] = dot(tangent, bent) / norm(g)
    end[ACROSS_BENDS] = dot(across, hessian_times(p, point, across)) / norm(g)
    end[TORSION] = -dot(bent, cross(g, tangent)) / dot(g, g)


def integrate(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, room: Floats
) -> bool:
    """Integrate a geodesic by the method of Merson, with steps as Simbody's GeodesicIntegrator takes them."""
    y, rates, trial = room, at(room, SIZE), at(room, 2 * SIZE)
    put(y, 0, point)
    put(y, 5, unit(direction))
    y[3], y[4], y[8], y[9] = 0.0, 1.0, 1.0, 0.0
    if not project(p, y, 0.1 * CONSTRAINT):
        return False
    slope(p, y, rates)
    set_end(p, vector(y, 0), vector(y, 5), at(geodesic, START))
    t, step, first, second, taken = 0.0, geodesic[STEP], 0.0, 0.0, 0
    while t != length:
        next_t = t + step
        if next_t + STRETCH * step > length:
            next_t = length
        while True:
            h = next_t - t
            error = merson(p, h, room)
            if error <= ACCURACY and project(p, trial, 0.1 * CONSTRAINT):
                break
            if not h > SMALLEST:
                return False
            if error > ACCURACY:
                h = min(max(SAFETY * h * sqrt(sqrt(ACCURACY / error)), LEAST * h), LESS * h)
            else:
                h *= LEAST
            next_t = t + h
        taken += 1
        if taken == 1:
            first = h
        elif taken == 2:
            second = h
        if taken >= MOST_STEPS or error != error:
            return False
        for k in range(SIZE):
            y[k] = trial[k]
        slope(p, y, rates)
        if next_t < length:
            longer = MOST * h if error == 0.0 else SAFETY * h * sqrt(sqrt(ACCURACY / error))
            step = min(longer if longer >= MORE * h else h, MOST * h)
        t = next_t
    set_end(p, vector(y, 0), vector(y, 5), at(geodesic, END))
    geodesic[R], geodesic[A], geodesic[R_RATE], geodesic[A_RATE] = y[3], y[4], y[8], y[9]
    if taken >= 2:
        geodesic[STEP] = first if first < geodesic[STEP] else max(geodesic[STEP], second)
    return True


def extrapolate(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, room: Floats
) -> bool:
    """Integrate a geodesic by the method of Gragg, Bulirsch and Stoer, in steps as long as that may take."""
    y = room
    put(y, 0, point)
    put(y, 5, unit(direction))
    y[3], y[4], y[8], y[9] = 0.0, 1.0, 1.0, 0.0
    if not project(p, y, ROUNDED):
        return False
    set_end(p, vector(y, 0), vector(y, 5), at(geodesic, START))
    left = step = length
    while left > 0.0:
        step = min(step, left)
        while not leap(p, step, room):
            step *= 0.5
            if not step > SMALLEST:
                return False
        left -= step
        if not project(p, y, ROUNDED):
            return False
    set_end(p, vector(y, 0), vector(y, 5), at(geodesic, END))
    geodesic[R], geodesic[A], geodesic[R_RATE], geodesic[A_RATE] = y[3], y[4], y[8], y[9]
    return True


def leap(p: Floats, step: float, room: Floats) -> bool:
    """A step by midpoint rules of 2, 4, 6 ... parts, extrapolated; whether it is as exact as may be."""
    y, f, old, columns = room, at(room, SIZE), at(room, 2 * SIZE), at(room, 3 * SIZE)
    for column in range(COLUMNS):
        new, parts = at(columns, column * SIZE), 2 * column + 2
        h = step / parts
        slope(p, y, f)
        for k in range(SIZE):
            old[k], new[k] = y[k], y[k] + h * f[k]
        for _ in range(1, parts):
            slope(p, new, f)
            for k in range(SIZE):
                old[k], new[k] = new[k], old[k] + 2.0 * h * f[k]
        # Neville's scheme towards h = 0: each row takes the place of the one before, from its end
        # on.
        error = 0.0
        for other in range(column - 1, -1, -1):
            row, last, ratio = (
                at(columns, other * SIZE),
                at(columns, (other + 1) * SIZE),
                (column + 1.0) / (other + 1.0),
            )
            error = 0.0
            for k in range(SIZE):
                row[k] = last[k] + (last[k] - row[k]) / (ratio * ratio - 1.0)
                if k < 3:
                    error = max(error, abs(row[k] - last[k]))
        if column > 1 and error <= EXACT:
            for k in range(SIZE):
                y[k] = columns[k]
            return True
    return False


def slope(p: Floats, y: Floats, f: Floats) -> None:
    """The derivative of the state of a geodesic.

    Its acceleration is normal to the surface, and the Jacobi fields change with the Gaussian
    curvature.
    """
    point, velocity = vector(y, 0), vector(y, 5)
    g = gradient(p, point)
    xx, yy, zz, xy = hessian(p, point)
    gx, gy, gz = g
    square = dot(g, g)
    adjoint = (gx * gx * yy + gy * gy * xx - 2.0 * gx * gy * xy) * zz + gz * gz * (
        xx * yy - xy * xy
    )
    gaussian = adjoint / (square * square)
    put(f, 0, velocity)
    put(f, 5, times(-dot(velocity, hessian_times(p, point, velocity)) / square, g))
    f[3], f[4], f[8], f[9] = y[8], y[9], -gaussian * y[3], -gaussian * y[4]


def project(p: Floats, y: Floats, exactness: float) -> bool:
    """Bring the state of a geodesic back to the surface; whether that came to an end."""
    point = vector(y, 0)
    error = value(p, point)
    for _ in range(MOST_CORRECTIONS):
        if abs(error) <= exactness:
            break
        g = gradient(p, point)
        point = along(point, -error / dot(g, g), g)
        error = value(p, point)
    g, velocity = gradient(p, point), vector(y, 5)
    velocity = along(velocity, -dot(g, velocity) / dot(g, g), g)
    put(y, 0, point)
    put(y, 5, times(1.0 / norm(velocity), velocity))
    return abs(error) <= CONSTRAINT


def merson(p: Floats, h: float, room: Floats) -> float:
    """A step: fills the state at its end, and returns its error."""
    y, f0, y1, rough = room, at(room, SIZE), at(room, 2 * SIZE), at(room, 3 * SIZE)
    f1, f2, f3, f4 = at(room, 4 * SIZE), at(room, 5 * SIZE), at(room, 6 * SIZE), at(room, 7 * SIZE)
    for k in range(SIZE):
        y1[k] = y[k] + h / 3.0 * f0[k]
    slope(p, y1, f1)
    for k in range(SIZE):
        y1[k] = y[k] + h / 6.0 * (f0[k] + f1[k])
    slope(p, y1, f2)
    for k in range(SIZE):
        y1[k] = y[k] + h / 8.0 * (f0[k] + 3.0 * f2[k])
    slope(p, y1, f3)
    for k in range(SIZE):
        rough[k] = y[k] + h / 2.0 * (f0[k] - 3.0 * f2[k] + 4.0 * f3[k])
    slope(p, rough, f4)
    error = 0.0
    for k in range(SIZE):
        y1[k] = y[k] + h / 6.0 * (f0[k] + 4.0 * f3[k] + f4[k])
        error = max(error, abs(y1[k] - rough[k]) / 5.0)
    return error
