"""Wrapping of a path through the hole of a torus.

The path wraps as around a cylinder at the nearest part of the ring.

Source: OpenSim 4.6's WrapTorus. Its objective is not exactly the distance from the ring, and it stops
early. The position is therefore found with the same steps, those of MINPACK's lmdif (J. J. More,
The Levenberg-Marquardt algorithm: implementation and theory, 1978) in one unknown.
"""

from __future__ import annotations

from math import nan, sqrt

from osimlite.mechanics.kernels.layout import ITEM
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.wrap_cylinder import bend_around_cylinder
from osimlite.mechanics.kernels.wrapping import (
    WRAP_SURFACE,
    WRAP_WORK,
    WRAPPING,
    clear_tangents,
    is_on_side,
)
from osimlite.mechanics.laws.vectors import (
    Vector,
    add_scaled,
    cross,
    dot,
    minus,
    norm,
    store_vector,
    times,
    vector,
)

CYLINDER_LENGTH_M = 10_000.0
"""Length of the cylinder that replaces the torus where the path touches it (m)."""
TOLERANCE = 1e-4
"""Tolerance that OpenSim passes to MINPACK's lmdif."""
FIRST_RADIUS = 0.2
"""Factor of the first trust region that OpenSim passes to lmdif."""
MAX_EVALUATIONS = 500
"""Largest number of evaluations that OpenSim passes to lmdif."""
MIN_DECREASE_RATIO = 1e-4
"""Part of the predicted decrease that an accepted step must achieve."""
DIFFERENCE_STEP_M = 1e-5
"""Step of the forward differences in the Jacobian, m."""
CYLINDER_Y = (0.0, 0.0, -1.0)
"""Direction of the y axis of the cylinder."""


def wrap_torus(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, item: int) -> int:
    """Bend a segment around a WrapTorus about z; a segment never must wrap.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; the record of the surface holds the ends of the segment and is filled.
        y: state.
        f: rates of the coordinates.
        item: offset of the surface in the model.

    Returns:
        NONE or WRAPPED of `WRAPPING`.
    """
    p, e = at(reals, model[item + ITEM.NUMBERS]), at(data, model[item + ITEM.RECORD])
    first = vector(e, WRAP_WORK.FIRST_END)
    second = vector(e, WRAP_WORK.SECOND_END)
    ring = p[WRAP_SURFACE.SIZES + 1]
    # The search stops early, so that its result depends on the end from which it starts; OpenSim
    # tries both.
    first_near_ring = near_ring(first, second, ring)
    second_near_ring = near_ring(second, first, ring)
    closer = distance_from_ring(first_near_ring, ring) < distance_from_ring(second_near_ring, ring)
    if p[WRAP_SURFACE.SIDE] != 0.0:
        first_active = is_on_side(first_near_ring, int(p[WRAP_SURFACE.AXIS]), p[WRAP_SURFACE.SIDE])
        second_active = is_on_side(
            second_near_ring, int(p[WRAP_SURFACE.AXIS]), p[WRAP_SURFACE.SIDE]
        )
        if not (first_active or second_active):
            return WRAPPING.NONE
        closer = first_active and (closer or not second_active)
    rx, ry, _ = first_near_ring if closer else second_near_ring
    distance = sqrt(rx * rx + ry * ry)
    # On the axis no part of the ring is nearest.
    if not distance > 0.0:
        return clear_tangents(e, WRAPPING.WRAPPED)
    outwards = (rx / distance, ry / distance, 0.0)
    a, b = point_in_cylinder(first, outwards, ring), point_in_cylinder(second, outwards, ring)
    # The side x > 0 of the cylinder is the inside of the ring, which the path must touch.
    if (
        bend_around_cylinder(
            a, b, p[WRAP_SURFACE.SIZES], CYLINDER_LENGTH_M, 0, 1.0, p[WRAP_SURFACE.ALONE] == 1.0, e
        )
        <= WRAPPING.NONE
    ):
        return clear_tangents(e, WRAPPING.WRAPPED)
    for tangent_offset in (WRAP_WORK.FIRST_TANGENT, WRAP_WORK.SECOND_TANGENT):
        store_vector(
            e, tangent_offset, point_from_cylinder(vector(e, tangent_offset), outwards, ring)
        )
    e[WRAP_WORK.CURVE + 1], e[WRAP_WORK.CURVE + 2], _ = outwards
    return WRAPPING.WRAPPED


def point_in_cylinder(point: Vector, outwards: Vector, ring: float) -> Vector:
    """Return a point in the frame of the cylinder at the ring in a direction.

    Its x axis points to the middle of the torus, its y axis down, its z axis along the ring.

    Args:
        point: point in the frame of the torus (m).
        outwards: unit vector from the middle to the nearest part of the ring.
        ring: radius of the ring (m).
    """
    away = add_scaled(point, -ring, outwards)
    inwards = times(-1.0, outwards)
    return dot(inwards, away), dot(CYLINDER_Y, away), dot(cross(inwards, CYLINDER_Y), away)


def point_from_cylinder(point: Vector, outwards: Vector, ring: float) -> Vector:
    """Return a point of the frame of the cylinder in the frame of the torus.

    Args:
        point: point in the frame of the cylinder (m).
        outwards: unit vector from the middle to the nearest part of the ring.
        ring: radius of the ring (m).
    """
    x, y, z = point
    inwards = times(-1.0, outwards)
    return add_scaled(
        add_scaled(add_scaled(times(ring, outwards), x, inwards), y, CYLINDER_Y),
        z,
        cross(inwards, CYLINDER_Y),
    )


def distance_from_ring(point: Vector, ring: float) -> float:
    """Return the squared distance of a point from the ring (m²).

    Args:
        point: point in the frame of the torus (m).
        ring: radius of the ring (m).
    """
    x, y, _ = point
    return dot(point, point) + ring * ring - 2.0 * ring * sqrt(x * x + y * y)


def near_ring(first: Vector, second: Vector, ring: float) -> Vector:
    """Return a point of a line near the ring, as found from the first end.

    Args:
        first: end from which the search starts (m).
        second: second end of the line (m).
        ring: radius of the ring (m).
    """
    dx, dy, dz = minus(second, first)
    distance = norm((dx, dy, dz))
    if not distance > 0.0:
        return nan, nan, nan
    x, y, _ = first
    dx, dy, _ = line_direction = dx / distance, dy / distance, dz / distance
    start = dot(first, line_direction)
    flat_start = x * dx + y * dy
    flat = dx * dx + dy * dy
    square = x * x + y * y
    return add_scaled(
        first, minimize_residual(start, flat_start, flat, square, ring), line_direction
    )


def compute_residual(
    u: float, start: float, flat_start: float, flat: float, square: float, ring: float
) -> float:
    """Return the slope of OpenSim's objective at a distance u from the first end, which is to vanish.

    The second term is twice as large as in the slope of the squared distance from the ring.

    Args:
        u: distance along the line from the first end (m).
        start: scalar product of first end and direction (m).
        flat_start: the same in the plane of the ring (m).
        flat: squared component of the direction in the plane of the ring.
        square: squared distance of the first end from the axis (m²).
        ring: radius of the ring (m).
    """
    squared_distance = u * u * flat + 2.0 * flat_start * u + square
    if not squared_distance > 0.0:
        return nan
    return 2.0 * start + 2.0 * u - 4.0 * ring * (flat * u + flat_start) / sqrt(squared_distance)


def minimize_residual(
    start: float, flat_start: float, flat: float, square: float, ring: float
) -> float:
    """Return the distance u that minimizes the squared residual, with lmdif's steps from 0.

    Args:
        start: scalar product of first end and direction (m).
        flat_start: the same in the plane of the ring (m).
        flat: squared component of the direction in the plane of the ring.
        square: squared distance of the first end from the axis (m²).
        ring: radius of the ring (m).
    """
    u = damping = scale = 0.0
    value = compute_residual(u, start, flat_start, flat, square, ring)
    radius = FIRST_RADIUS
    has_moved = False
    evaluations = 1
    while True:
        slope = (
            compute_residual(u + DIFFERENCE_STEP_M, start, flat_start, flat, square, ring) - value
        ) / DIFFERENCE_STEP_M
        if not abs(slope * value) > 0.0:
            return u
        # lmdif scales the unknown by the largest slope so far.
        scale = max(scale, abs(slope))
        while True:
            step, damping = solve_damped_step(slope, value, scale, radius, damping)
            size = scale * abs(step)
            # The first trust region is not longer than the first step.
            if not has_moved:
                radius = min(radius, size)
            next_value = compute_residual(u + step, start, flat_start, flat, square, ring)
            evaluations += 1
            # A residual that grows tenfold does not count as a decrease, as in lmdif.
            falls = 0.1 * abs(next_value) < abs(value)
            actual = 1.0 - (next_value / value) ** 2 if falls else -1.0
            linear = (slope * step / value) ** 2
            damped = damping * (size / value) ** 2
            predicted = linear + 2.0 * damped
            ratio = actual / predicted if predicted != 0.0 else 0.0
            # Shrink the trust region if the prediction was poor, and enlarge it if it was good.
            if ratio <= 0.25:
                radius_factor = (
                    0.5
                    if actual >= 0.0
                    else 0.5 * (linear + damped) / (linear + damped - 0.5 * actual)
                )
                radius_factor = radius_factor if falls and radius_factor >= 0.1 else 0.1
                radius = radius_factor * min(radius, 10.0 * size)
                damping = damping / radius_factor
            elif damping == 0.0 or ratio >= 0.75:
                radius, damping = 2.0 * size, 0.5 * damping
            accepted = ratio >= MIN_DECREASE_RATIO
            if accepted:
                u += step
                value = next_value
                has_moved = True
            small = abs(actual) <= TOLERANCE and predicted <= TOLERANCE and ratio <= 2.0
            if small or radius <= TOLERANCE * scale * abs(u) or evaluations >= MAX_EVALUATIONS:
                return u
            if accepted:
                break


def solve_damped_step(
    slope: float, value: float, scale: float, radius: float, damping: float
) -> tuple[float, float]:
    """Return a step that is hardly longer than the trust region, as MINPACK's lmpar does.

    Args:
        slope: derivative of the residual, not zero.
        value: residual, not zero.
        scale: scale of the step.
        radius: radius of the trust region in units of 1 / scale.
        damping: previous damping.

    Returns:
        The step and its damping.
    """
    step = -value / slope
    excess = abs(scale * step) - radius
    if excess <= 0.1 * radius:
        return step, 0.0
    least = excess / radius * (slope / scale) ** 2
    # Bounds of the damping, as MINPACK's lmpar computes them for one unknown.
    damping = min(max(damping, least), abs(slope * value) / scale / radius)
    for trial in range(10):
        square = slope * slope + damping * scale * scale
        step = -slope * value / square
        excess = abs(scale * step) - radius
        if abs(excess) <= 0.1 * radius or trial == 9:
            break
        if excess > 0.0:
            least = max(least, damping)
        damping = max(least, damping + excess / radius * square / (scale * scale))
    return step, damping
