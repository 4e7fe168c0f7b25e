"""Surfaces that a cable runs over, and geodesics on them, as in Simbody's CableSpan.

A surface is the zero set of a function that is positive inside. Geodesics on spheres and cylinders
are known; on other surfaces they are integrated with Simbody's steps, which determine the digits to
which the path is found. The Jacobi fields A and R are the lateral displacements of the end per unit
of lateral displacement, and of rotation, of the start.

Source: A. Scholz, M. Sherman, I. Stavness, S. Delp, A. Kecskemethy, A fast multi-obstacle muscle
wrapping method using natural geodesic variations, Multibody System Dynamics 36, 2016.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.laws.vectors import (
    EPSILON,
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    multiply_elementwise,
    norm,
    store_vector,
    times,
    unit,
    vector,
)


class SURFACE_TYPE(metaclass=Record):
    """Types of surfaces."""

    SPHERE = 0.0
    """A sphere."""
    CYLINDER = 1.0
    """A cylinder about z."""
    ELLIPSOID = 2.0
    """An ellipsoid."""
    TORUS = 3.0
    """A torus about z."""
    PLANE = 4.0
    """The boundary x = 0 of a half-space that is solid where x is positive."""


class SURFACE(metaclass=Record):
    """Numbers of a surface."""

    KIND = 0
    """Kind."""
    RADIUS = 1
    """Radius, or radius of the ring of a torus (m)."""
    SQUARE = 2
    """Square s of a quadric: the surface is where s equals the weighted sum of squares."""
    WEIGHTS = 3
    """Weights of the squared coordinates."""
    TUBE = 2
    """Radius of the tube of a torus (m)."""
    SIZE = 6
    """Length of the numbers of a surface."""


class END_NUMBERS(metaclass=Record):
    """Numbers of an end of a geodesic."""

    POINT = 0
    """Position (m)."""
    ALONG = 3
    """Unit tangent of the geodesic."""
    NORMAL = 6
    """Outward unit normal of the surface."""
    ACROSS = 9
    """Unit binormal."""
    ALONG_BENDS = 12
    """Normal curvature along the geodesic (1/m)."""
    ACROSS_BENDS = 13
    """Normal curvature across it (1/m)."""
    TORSION = 14
    """Geodesic torsion (1/m)."""
    SIZE = 15
    """Length of an end of a geodesic."""


class GEODESIC(metaclass=Record):
    """Numbers of a geodesic."""

    START = 0
    """First end."""
    END = 15
    """Last end."""
    A = 30
    """Jacobi field of lateral displacement at the last end."""
    R = 31
    """Jacobi field of rotation at the last end (m)."""
    A_RATE = 32
    """Derivative of A by the arc length (1/m)."""
    R_RATE = 33
    """Derivative of R by the arc length."""
    ARC = 34
    """Length of the geodesic (m)."""
    STEP = 35
    """First step of the integration (m); 0 to integrate by extrapolation to rounding."""
    SIZE = 36
    """Length of a geodesic."""


SIZE = 10
"""Length of the state that is integrated along a geodesic: position, R, A, and their derivatives."""
COLUMNS = 7
"""Largest number of columns of an extrapolation."""
GEODESIC_WORK_SIZE = (3 + COLUMNS) * SIZE
"""Length of the workspace of an integration: the extrapolation, or a step of Merson's method."""
ACCURACY = 1e-10
"""Accuracy of a step of Merson's method."""
CONSTRAINT = 1e-9
"""Largest value of the function of the surface after a step."""
MIN_STEP_M = 2.0**-45.5
"""Smallest step (m)."""
EXTRAPOLATION_TOLERANCE_M = 1e-12
"""Change of the end by the last column of an extrapolation (m); the error is far smaller."""
EXTRAPOLATION_RESIDUAL = 1e-15
"""Largest value of the function of the surface after an extrapolation, which moment arms need."""
MOST_STEPS = 10_000
"""Largest number of steps along a geodesic."""
MOST_CORRECTIONS = 10
"""Largest number of Newton steps back to the surface."""
MIN_STEP_FACTOR = 0.1
"""Smallest factor of a change of the step, as in Simbody's GeodesicIntegrator; so are the next five."""
MAX_STEP_FACTOR = 5.0
"""Largest factor of a change of the step."""
SAFETY = 0.9
"""Ratio of the chosen step to the one that would just meet the accuracy."""
LAST_STEP_STRETCH = 0.1
"""Part of a step by which the last step may be stretched."""
MAX_FACTOR_AFTER_REJECTION = 0.9
"""Largest factor of a step after a rejection."""
MIN_GROWTH = 1.2
"""Smallest factor with which a step is made longer."""


def surface_value(p: Floats, a: Vector) -> float:
    """Return the function of a surface, which is zero on the surface and positive inside.

    It is s - x' W x for a quadric, and 1 - ((R - sqrt(x^2 + y^2))^2 + z^2) / r^2 for a torus with
    the radius R of the ring and r of the tube.

    Args:
        p: numbers of the surface.
        a: point in the frame of the surface (m).
    """
    x, y, z = a
    result = p[SURFACE.SQUARE] - dot(multiply_elementwise(vector(p, SURFACE.WEIGHTS), a), a)
    if p[SURFACE.KIND] == SURFACE_TYPE.TORUS:
        across = p[SURFACE.RADIUS] - sqrt(x * x + y * y)
        result = 1.0 - (across * across + z * z) / (p[SURFACE.TUBE] * p[SURFACE.TUBE])
    if p[SURFACE.KIND] == SURFACE_TYPE.PLANE:
        result = x
    return float(result)


def surface_gradient(p: Floats, a: Vector) -> Vector:
    """Return the gradient of the function of a surface.

    Args:
        p: numbers of the surface.
        a: point in the frame of the surface (m), not on the axis of a torus.
    """
    if p[SURFACE.KIND] == SURFACE_TYPE.TORUS:
        x, y, z = a
        scale = -2.0 / (p[SURFACE.TUBE] * p[SURFACE.TUBE])
        distance = sqrt(x * x + y * y)
        inwards = 1.0 - p[SURFACE.RADIUS] / distance
        return scale * inwards * x, scale * inwards * y, scale * z
    if p[SURFACE.KIND] == SURFACE_TYPE.PLANE:
        return 1.0, 0.0, 0.0
    return times(-2.0, multiply_elementwise(vector(p, SURFACE.WEIGHTS), a))


def surface_hessian(p: Floats, a: Vector) -> tuple[float, float, float, float]:
    """Return the second derivatives xx, yy, zz, xy of the function of a surface; xz and yz vanish.

    Args:
        p: numbers of the surface.
        a: point in the frame of the surface (m).

    Returns:
        Four entries.
    """
    if p[SURFACE.KIND] == SURFACE_TYPE.TORUS:
        x, y, _ = a
        scale = -2.0 / (p[SURFACE.TUBE] * p[SURFACE.TUBE])
        square = x * x + y * y
        ring = p[SURFACE.RADIUS] / (square * sqrt(square))
        return (
            scale * (1.0 - ring * y * y),
            scale * (1.0 - ring * x * x),
            scale,
            scale * ring * x * y,
        )
    xx, yy, zz = times(-2.0, vector(p, SURFACE.WEIGHTS))
    return xx, yy, zz, 0.0


def hessian_times(p: Floats, a: Vector, b: Vector) -> Vector:
    """Return the product of the second derivatives of the function of a surface and a vector.

    Args:
        p: numbers of the surface.
        a: point at which the derivatives are taken (m).
        b: vector.
    """
    xx, yy, zz, xy = surface_hessian(p, a)
    x, y, z = b
    return xx * x + xy * y, xy * x + yy * y, zz * z


def nearest_on_line(p: Floats, a: Vector, b: Vector, start: Vector) -> tuple[bool, Vector]:
    """Find a point of a line segment below the surface, or its point nearest to the surface.

    It follows Simbody's search from the point nearest to `start`, which is the result if the search
    does not converge.

    Args:
        p: numbers of the surface.
        a: first end of the segment.
        b: second end.
        start: start of the search.

    Returns:
        Whether the segment passes below the surface, and the point.
    """
    chord = minus(b, a)
    square = dot(chord, chord)
    if square < EPSILON:
        return surface_value(p, a) > 0.0, a
    # Start from the point of the segment nearest to the last result.
    fraction = min(max(-dot(chord, minus(a, start)) / square, 0.0), 1.0)
    for _ in range(50):
        point = add_scaled(a, fraction, chord)
        if -surface_value(p, point) < EPSILON:
            return True, point
        curvature = abs(dot(chord, hessian_times(p, point, chord)))
        # Newton's step with Simbody's safeguards: 1/2 added to the curvature, and at most a fifth
        # of the segment.
        step = -dot(surface_gradient(p, point), chord) / (curvature + 0.5)
        previous_fraction = fraction
        fraction = min(max(fraction - min(max(step, -0.2), 0.2), 0.0), 1.0)
        if abs(fraction - previous_fraction) < CONSTRAINT:
            return False, add_scaled(a, fraction, chord)
    return False, start


def shoot_geodesic(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, work: Floats
) -> bool:
    """Compute a geodesic from near a point in about a direction.

    Args:
        p: numbers of the surface.
        point: start; projected onto the surface.
        direction: direction; projected onto the tangent plane.
        length: length of the geodesic (m).
        geodesic: filled with the geodesic, see `GEODESIC`.
        work: workspace of GEODESIC_WORK_SIZE numbers.

    Returns:
        Whether the geodesic exists.
    """
    geodesic[GEODESIC.ARC] = length
    # On a sphere geodesics are great circles, with A = cos(s / r) and R = r sin(s / r).
    if p[SURFACE.KIND] == SURFACE_TYPE.SPHERE:
        radius = p[SURFACE.RADIUS]
        normal = unit(point)
        tangent = cross(normal, unit(cross(direction, normal)))
        c, s = cos(length / radius), sin(length / radius)
        end = add_scaled(times(c, normal), s, tangent)
        end_tangent = add_scaled(times(c, tangent), -s, normal)
        store_end(p, times(radius, normal), tangent, at(geodesic, GEODESIC.START))
        store_end(p, times(radius, end), end_tangent, at(geodesic, GEODESIC.END))
        (
            geodesic[GEODESIC.A],
            geodesic[GEODESIC.A_RATE],
            geodesic[GEODESIC.R],
            geodesic[GEODESIC.R_RATE],
        ) = c, -s / radius, s * radius, c
        return True
    # On a cylinder geodesics are helices; the surface is flat, so that A = 1 and R = s.
    if p[SURFACE.KIND] == SURFACE_TYPE.CYLINDER:
        radius = p[SURFACE.RADIUS]
        x, y, height = point
        nx, ny, _ = normal = unit((x, y, 0.0))
        tx, ty, tz = tangent = cross(normal, unit(cross(direction, normal)))
        _, _, turn = cross(normal, tangent)
        c, s = cos(length / radius * turn), sin(length / radius * turn)
        store_end(p, (radius * nx, radius * ny, height), tangent, at(geodesic, GEODESIC.START))
        end = radius * (c * nx - s * ny), radius * (s * nx + c * ny), height + length * tz
        store_end(p, end, (c * tx - s * ty, s * tx + c * ty, tz), at(geodesic, GEODESIC.END))
        (
            geodesic[GEODESIC.A],
            geodesic[GEODESIC.A_RATE],
            geodesic[GEODESIC.R],
            geodesic[GEODESIC.R_RATE],
        ) = 1.0, 0.0, length, 1.0
        return True
    # The step is 0 for wrap objects, whose moment arms need exact lengths; Simbody's steps serve
    # cables.
    if geodesic[GEODESIC.STEP] == 0.0:
        return integrate_by_extrapolation(p, point, direction, length, geodesic, work)
    return integrate_by_merson(p, point, direction, length, geodesic, work)


def store_end(p: Floats, point: Vector, direction: Vector, end: Floats) -> None:
    """Store an end of a geodesic: position, frame, curvatures and torsion.

    Args:
        p: numbers of the surface.
        point: point of the surface (m).
        direction: direction of the geodesic; projected onto the tangent plane.
        end: filled with the end, see `END_NUMBERS`.
    """
    g = surface_gradient(p, point)
    # The function of the surface is positive inside, so that its gradient points inwards.
    normal = times(-1.0, unit(g))
    across = unit(cross(direction, normal))
    tangent = cross(normal, across)
    store_vector(end, END_NUMBERS.POINT, point)
    store_vector(end, END_NUMBERS.ALONG, tangent)
    store_vector(end, END_NUMBERS.NORMAL, normal)
    store_vector(end, END_NUMBERS.ACROSS, across)
    bent = hessian_times(p, point, tangent)
    end[END_NUMBERS.ALONG_BENDS] = dot(tangent, bent) / norm(g)
    end[END_NUMBERS.ACROSS_BENDS] = dot(across, hessian_times(p, point, across)) / norm(g)
    end[END_NUMBERS.TORSION] = -dot(bent, cross(g, tangent)) / dot(g, g)


def integrate_by_merson(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, work: Floats
) -> bool:
    """Integrate a geodesic by Merson's method, with the steps of Simbody's GeodesicIntegrator.

    Args:
        p: numbers of the surface.
        point: start; projected onto the surface.
        direction: direction; projected onto the tangent plane.
        length: length of the geodesic (m).
        geodesic: filled with the geodesic, see `GEODESIC`; its first step is adapted for the next
            call.
        work: workspace of GEODESIC_WORK_SIZE numbers.

    Returns:
        Whether the geodesic exists.
    """
    y = work
    rates = at(work, SIZE)
    trial = at(work, 2 * SIZE)
    store_vector(y, 0, point)
    store_vector(y, 5, unit(direction))
    y[3], y[4], y[8], y[9] = 0.0, 1.0, 1.0, 0.0
    if not project_to_surface(p, y, 0.1 * CONSTRAINT):
        return False
    geodesic_derivative(p, y, rates)
    store_end(p, vector(y, 0), vector(y, 5), at(geodesic, GEODESIC.START))
    t = 0.0
    step = geodesic[GEODESIC.STEP]
    first = 0.0
    second = 0.0
    step_count = 0
    while t != length:
        next_t = t + step
        # Stretch the last step rather than add a tiny one.
        if next_t + LAST_STEP_STRETCH * step > length:
            next_t = length
        while True:
            h = next_t - t
            error = merson_step(p, h, work)
            if error <= ACCURACY and project_to_surface(p, trial, 0.1 * CONSTRAINT):
                break
            if not h > MIN_STEP_M:
                return False
            # A rejected step is shortened by the error, or by a tenth where it left the surface too
            # far.
            if error > ACCURACY:
                h = min(
                    max(SAFETY * h * sqrt(sqrt(ACCURACY / error)), MIN_STEP_FACTOR * h),
                    MAX_FACTOR_AFTER_REJECTION * h,
                )
            else:
                h *= MIN_STEP_FACTOR
            next_t = t + h
        step_count += 1
        if step_count == 1:
            first = h
        elif step_count == 2:
            second = h
        if step_count >= MOST_STEPS or error != error:
            return False
        for k in range(SIZE):
            y[k] = trial[k]
        geodesic_derivative(p, y, rates)
        if next_t < length:
            # The method is of fourth order, hence the fourth root of the error.
            longer = (
                MAX_STEP_FACTOR * h if error == 0.0 else SAFETY * h * sqrt(sqrt(ACCURACY / error))
            )
            step = min(longer if longer >= MIN_GROWTH * h else h, MAX_STEP_FACTOR * h)
        t = next_t
    store_end(p, vector(y, 0), vector(y, 5), at(geodesic, GEODESIC.END))
    (
        geodesic[GEODESIC.R],
        geodesic[GEODESIC.A],
        geodesic[GEODESIC.R_RATE],
        geodesic[GEODESIC.A_RATE],
    ) = y[3], y[4], y[8], y[9]
    # As in Simbody, the next geodesic begins with the size of the first or second step of this one.
    if step_count >= 2:
        geodesic[GEODESIC.STEP] = (
            first if first < geodesic[GEODESIC.STEP] else max(geodesic[GEODESIC.STEP], second)
        )
    return True


def integrate_by_extrapolation(
    p: Floats, point: Vector, direction: Vector, length: float, geodesic: Floats, work: Floats
) -> bool:
    """Integrate a geodesic by the method of Gragg, Bulirsch and Stoer, in long steps.

    Args:
        p: numbers of the surface.
        point: start; projected onto the surface.
        direction: direction; projected onto the tangent plane.
        length: length of the geodesic (m).
        geodesic: filled with the geodesic, see `GEODESIC`.
        work: workspace of GEODESIC_WORK_SIZE numbers.

    Returns:
        Whether the geodesic exists.
    """
    y = work
    store_vector(y, 0, point)
    store_vector(y, 5, unit(direction))
    y[3], y[4], y[8], y[9] = 0.0, 1.0, 1.0, 0.0
    if not project_to_surface(p, y, EXTRAPOLATION_RESIDUAL):
        return False
    store_end(p, vector(y, 0), vector(y, 5), at(geodesic, GEODESIC.START))
    remaining_length = step = length
    while remaining_length > 0.0:
        step = min(step, remaining_length)
        while not extrapolate_step(p, step, work):
            # Most geodesics succeed in one step over their complete length.
            step *= 0.5
            if not step > MIN_STEP_M:
                return False
        remaining_length -= step
        if not project_to_surface(p, y, EXTRAPOLATION_RESIDUAL):
            return False
    store_end(p, vector(y, 0), vector(y, 5), at(geodesic, GEODESIC.END))
    (
        geodesic[GEODESIC.R],
        geodesic[GEODESIC.A],
        geodesic[GEODESIC.R_RATE],
        geodesic[GEODESIC.A_RATE],
    ) = y[3], y[4], y[8], y[9]
    return True


def extrapolate_step(p: Floats, step: float, work: Floats) -> bool:
    """Take a step by midpoint rules of 2, 4, 6 ... parts, extrapolated.

    Args:
        p: numbers of the surface.
        step: length of the step (m).
        work: state y at the start of the step, changed if the step is exact; then workspace.

    Returns:
        Whether the step is exact enough.
    """
    y = work
    f = at(work, SIZE)
    old = at(work, 2 * SIZE)
    columns = at(work, 3 * SIZE)
    for column in range(COLUMNS):
        new = at(columns, column * SIZE)
        substeps = 2 * column + 2
        h = step / substeps
        geodesic_derivative(p, y, f)
        for k in range(SIZE):
            old[k], new[k] = y[k], y[k] + h * f[k]
        for _ in range(1, substeps):
            geodesic_derivative(p, new, f)
            for k in range(SIZE):
                old[k], new[k] = new[k], old[k] + 2.0 * h * f[k]
        # Neville's scheme towards h = 0: each row overwrites the previous one, from its end on.
        error = 0.0
        for lower in range(column - 1, -1, -1):
            row = at(columns, lower * SIZE)
            finer_row = at(columns, (lower + 1) * SIZE)
            ratio = (column + 1.0) / (lower + 1.0)
            error = 0.0
            for k in range(SIZE):
                # The error of Gragg's midpoint rule contains even powers of h only, hence squared
                # ratios.
                row[k] = finer_row[k] + (finer_row[k] - row[k]) / (ratio * ratio - 1.0)
                if k < 3:
                    error = max(error, abs(row[k] - finer_row[k]))
        # Three columns are the least from which the error can be judged.
        if column > 1 and error <= EXTRAPOLATION_TOLERANCE_M:
            for k in range(SIZE):
                y[k] = columns[k]
            return True
    return False


def geodesic_derivative(p: Floats, y: Floats, f: Floats) -> None:
    """Compute the derivative of the state of a geodesic by the arc length.

    The acceleration is normal to the surface, and the Jacobi fields satisfy A'' = -K A and R'' = -K R
    with the Gaussian curvature K.

    Args:
        p: numbers of the surface.
        y: position, R, A, velocity and the derivatives of R and A.
        f: filled with the derivative of y.
    """
    point, velocity = vector(y, 0), vector(y, 5)
    g = surface_gradient(p, point)
    xx, yy, zz, xy = surface_hessian(p, point)
    gx, gy, gz = g
    square = dot(g, g)
    # Gaussian curvature K of an implicit surface: g' adj(H) g / |g|^4, where the entries xz and yz
    # of the Hessian H vanish.
    adjoint = (gx * gx * yy + gy * gy * xx - 2.0 * gx * gy * xy) * zz + gz * gz * (
        xx * yy - xy * xy
    )
    gaussian = adjoint / (square * square)
    store_vector(f, 0, velocity)
    # The acceleration of a unit-speed geodesic is -(v' H v / |g|^2) g.
    store_vector(f, 5, times(-dot(velocity, hessian_times(p, point, velocity)) / square, g))
    f[3], f[4], f[8], f[9] = y[8], y[9], -gaussian * y[3], -gaussian * y[4]


def project_to_surface(p: Floats, y: Floats, exactness: float) -> bool:
    """Project the state of a geodesic onto the surface.

    Args:
        p: numbers of the surface.
        y: state; position and velocity are changed.
        exactness: value of the function at which the projection ends.

    Returns:
        Whether the value is at most CONSTRAINT afterwards.
    """
    point = vector(y, 0)
    error = surface_value(p, point)
    for _ in range(MOST_CORRECTIONS):
        if abs(error) <= exactness:
            break
        g = surface_gradient(p, point)
        point = add_scaled(point, -error / dot(g, g), g)
        error = surface_value(p, point)
    g, velocity = surface_gradient(p, point), vector(y, 5)
    velocity = add_scaled(velocity, -dot(g, velocity) / dot(g, g), g)
    store_vector(y, 0, point)
    store_vector(y, 5, times(1.0 / norm(velocity), velocity))
    return abs(error) <= CONSTRAINT


def merson_step(p: Floats, h: float, work: Floats) -> float:
    """Take a step of Merson's method (five evaluations, fourth order).

    Args:
        p: numbers of the surface.
        h: length of the step (m).
        work: state and derivative at the start; filled with the state at the end after these.

    Returns:
        Largest estimated error of an entry of the state.
    """
    y = work
    f0 = at(work, SIZE)
    y1 = at(work, 2 * SIZE)
    rough = at(work, 3 * SIZE)
    f1, f2, f3, f4 = at(work, 4 * SIZE), at(work, 5 * SIZE), at(work, 6 * SIZE), at(work, 7 * SIZE)
    for k in range(SIZE):
        y1[k] = y[k] + h / 3.0 * f0[k]
    geodesic_derivative(p, y1, f1)
    for k in range(SIZE):
        y1[k] = y[k] + h / 6.0 * (f0[k] + f1[k])
    geodesic_derivative(p, y1, f2)
    for k in range(SIZE):
        y1[k] = y[k] + h / 8.0 * (f0[k] + 3.0 * f2[k])
    geodesic_derivative(p, y1, f3)
    for k in range(SIZE):
        rough[k] = y[k] + h / 2.0 * (f0[k] - 3.0 * f2[k] + 4.0 * f3[k])
    geodesic_derivative(p, rough, f4)
    error = 0.0
    for k in range(SIZE):
        y1[k] = y[k] + h / 6.0 * (f0[k] + 4.0 * f3[k] + f4[k])
        error = max(error, abs(y1[k] - rough[k]) / 5.0)
    return error
