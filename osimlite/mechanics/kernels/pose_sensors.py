"""Cost of orientation sensors: squared angles of rotation from the measured orientation.

A sensor is a torsion spring. Let phi be the rotation vector, in ground, from the measured
orientation to that of the sensor. The derivative of half the squared angle by the rotation of the
link is phi, and the derivative of phi is the inverse of the left Jacobian of the rotations (G.
Chirikjian, Stochastic Models, Information Theory, and Lie Groups, volume 2, 2012, chapter 10.7): 1
- [phi]/2 + c [phi]², where c is (1 - angle/2 cot(angle/2)) / angle². Its symmetric part is added to
the inertia, its antisymmetric part to the sums of forces times arms.
"""

from __future__ import annotations

from math import acos, pi, sqrt

from osimlite.mechanics.kernels.layout import LINK_WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.points import direction, link_work
from osimlite.mechanics.kernels.pose_record import FIT, MARKER_NUMBERS, SENSOR_NUMBERS, Fit
from osimlite.mechanics.laws.rotations import sine_cosine
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    component,
    cross,
    dot,
    minus,
    multiply_elementwise,
    plus,
    replace_component,
    store_vector,
    times,
    vector,
)

SMALL_ANGLE_RAD = 1e-3
"""Angle (rad) below which c = 1/12 is as accurate as its formula."""
NEARLY_BACK = -0.99
"""Cosine below which the axis of a rotation follows from its symmetric part, as the other vanishes."""


def add_sensors(m: Fit) -> float:
    """Add the torsion springs of the sensors to the links.

    Args:
        m: the fit; inertias and wrenches of links are changed.

    Returns:
        Cost of the sensors.
    """
    model, data, p, v, value = m.model, m.data, m.p, m.v, 0.0
    for k in range(p[FIT.SENSORS]):
        weight = v[p[FIT.WEIGHTS] + p[FIT.MARKERS] + k]
        link = p[p[FIT.SENSOR_AT] + k]
        if not weight > 0.0:
            continue
        deviation = sensor_rotation(m, k)
        square = dot(deviation, deviation)
        value += 0.5 * weight * square
        if link < 0:
            continue
        link_record = link_work(model, data, link)
        i = at(link_record, LINK_WORK.INERTIA)
        load = at(link_record, LINK_WORK.WRENCH)
        moments = at(v, p[FIT.MOMENTS] + 9 * link)
        # Symmetric part of the derivative of the spring's torque: weight (1 + c [phi]^2).
        x, y, z = times(weight * squared_factor(sqrt(square)), deviation)
        a, b, c = deviation
        i[4] += weight - (y * b + z * c)
        i[5] += weight - (x * a + z * c)
        i[6] += weight - (x * a + y * b)
        i[7] += x * b
        i[8] += x * c
        i[9] += y * c
        store_vector(load, 0, add_scaled(vector(load, 0), weight, deviation))
        # Antisymmetric part, weight [phi] / 2, which belongs to the sums of forces times arms.
        a, b, c = times(0.5 * weight, deviation)
        store_vector(moments, 0, plus(vector(moments, 0), (0.0, -c, b)))
        store_vector(moments, 3, plus(vector(moments, 3), (c, 0.0, -a)))
        store_vector(moments, 6, plus(vector(moments, 6), (-b, a, 0.0)))
    return value


def squared_factor(angle: float) -> float:
    """Return the factor c of the squared rotation in the inverse left Jacobian.

    It is (1 - a/2 cot(a/2)) / a^2, and 1/12 in the limit.

    Args:
        angle: angle a of the rotation (rad).
    """
    if angle < SMALL_ANGLE_RAD:
        return 1.0 / 12.0
    sine, cosine = sine_cosine(0.5 * angle)
    return (1.0 - 0.5 * angle * cosine / sine) / (angle * angle)


def sensor_rotation(m: Fit, sensor: int) -> Vector:
    """Return the rotation vector from the measured orientation of a sensor to its present one.

    Args:
        m: inputs and workspace of the fit.
        sensor: number of the sensor.

    Returns:
        Rotation vector in ground (rad).
    """
    rows = at(m.c, MARKER_NUMBERS * m.p[FIT.MARKERS] + SENSOR_NUMBERS * sensor)
    target = at(m.v, m.p[FIT.MEASURED] + 3 * m.p[FIT.MARKERS] + 9 * sensor)
    return rotation_between(m.model, m.data, m.p[m.p[FIT.SENSOR_AT] + sensor], rows, target)


def rotation_between(model: Ints, data: Floats, link: int, rows: Floats, target: Floats) -> Vector:
    """Return the rotation vector from a target orientation to that of a frame of a link.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link.
        rows: rotation of the frame in the link, by rows.
        target: target orientation in ground, by rows.

    Returns:
        Rotation vector in ground (rad).
    """
    # Twice the sine times the axis, and the diagonal of the rotation, from both sets of axes.
    twist, diagonal = ZERO, ZERO
    for k in range(3):
        is_axis = direction(model, data, link, (rows[k], rows[3 + k], rows[6 + k]))
        axis = target[k], target[3 + k], target[6 + k]
        twist = plus(twist, cross(axis, is_axis))
        diagonal = plus(diagonal, multiply_elementwise(axis, is_axis))
    cosine = 0.5 * (dot(diagonal, (1.0, 1.0, 1.0)) - 1.0)
    sine = 0.5 * sqrt(dot(twist, twist))
    if cosine < NEARLY_BACK:
        return rotation_near_half_turn(model, data, link, rows, target, twist, diagonal)
    if not sine > 1e-12:
        return times(0.5, twist)
    # Near zero the cosine loses digits of the angle, near a right angle the sine does.
    angle = acos(cosine) if cosine < 0.7 else sine_angle(sine)
    return times(0.5 * angle / sine, twist)


def rotation_near_half_turn(
    model: Ints,
    data: Floats,
    link: int,
    rows: Floats,
    target: Floats,
    twist: Vector,
    diagonal: Vector,
) -> Vector:
    """Return the rotation vector for nearly half a turn, from the symmetric part of the rotation.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        link: number of the link.
        rows: rotation of the frame in the link, by rows.
        target: target orientation in ground, by rows.
        twist: twice the antisymmetric part of the rotation.
        diagonal: diagonal of the rotation.
    """
    x, y, z = diagonal
    # The largest diagonal entry gives the longest, and so most exact, row.
    axis = 0 if x >= y and x >= z else (1 if y >= z else 2)
    row = ZERO
    for k in range(3):
        is_axis = direction(model, data, link, (rows[k], rows[3 + k], rows[6 + k]))
        measured = target[k], target[3 + k], target[6 + k]
        row = add_scaled(
            add_scaled(row, component(is_axis, axis), measured), component(measured, axis), is_axis
        )
    cosine = 0.5 * (x + y + z - 1.0)
    sine = 0.5 * sqrt(dot(twist, twist))
    row = minus(times(0.5, row), replace_component(ZERO, axis, cosine))
    length = sqrt(dot(row, row))
    angle = pi - sine_angle(sine)
    # The antisymmetric part, although tiny, decides the sense of the rotation.
    return times((angle if dot(row, twist) >= 0.0 else -angle) / length, row)


def sine_angle(sine: float) -> float:
    """Return the acute angle of a sine (rad)."""
    return 0.5 * pi - acos(min(1.0, sine))
