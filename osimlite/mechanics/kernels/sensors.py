"""Sensors of a walker: a row of measurements after each evaluation, and sources of reflexes.

The plan of a row consists of integers: a head, `SENSOR_PLAN`; per muscle the indices in `data` of
`OF_MUSCLES`; per coordinate limit force the coordinate and the index of the force in `data`; the
link of each body; per leg its hip-side body (pelvis) and its foot, and the range of the contacts of
the foot. The numbers of a row are a head, `SENSOR_NUMBERS`; optimal fiber lengths (m) and strengths
(N); smallest and largest controls; mass centres in the links (m) and masses (kg).
"""

from __future__ import annotations

from math import atan2, sqrt

from osimlite.mechanics.kernels.layout import CONTACT_WORK, MODEL, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers
from osimlite.mechanics.kernels.points import angular_velocity, direction, station, velocity
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    divide,
    dot,
    norm,
    plus,
    store_vector,
    vector,
)

OF_MUSCLES = "fiber_length", "fiber_velocity", "tension", "activation", "active_fiber_force"
"""Results of a muscle that a row uses."""
OF_MUSCLE = 5
"""Number of integers of a muscle."""
OF_LEG = 4
"""Number of integers of a leg."""


class SENSOR_PLAN(metaclass=Record):
    """Head of the plan of a sensor row.

    Attributes:
        MUSCLES, COORDINATES, LEGS, LIMITS, BODIES, CONTROLS: numbers of muscles, coordinates, legs,
            coordinate limit forces, bodies and controls.
        NUMBERS: count of the numbers of the row, see `SENSOR_NUMBERS`.
        LENGTHS, VELOCITIES: offsets of fiber lengths and velocities over the optimal lengths (1, 1/s).
        FORCES, ACTIVATIONS, ACTIVE: offsets of tendon forces over the strengths, activations, and
            active fiber forces (N).
        VALUES, SPEEDS, MOMENTS: offsets of coordinates, speeds, and limit forces (N, N m).
        LOADS: offset of the ground reaction force of each leg over the weight.
        POSITIONS, CENTRE, RISE: offsets of the mass centres of bodies and of all (m), and of the
            vertical velocity of the latter (m/s).
    """

    MUSCLES, COORDINATES, LEGS, LIMITS, BODIES, CONTROLS, NUMBERS = range(7)
    LENGTHS, VELOCITIES, FORCES, ACTIVATIONS, ACTIVE, VALUES, SPEEDS, MOMENTS = range(7, 15)
    LOADS, POSITIONS, CENTRE, RISE, SIZE, HEAD = range(15, 21)


class SENSOR_NUMBERS(metaclass=Record):
    """Head of the numbers of a sensor row.

    Attributes:
        WEIGHT, MASS: weight (N) and mass (kg) of the walker.
        STEP: duration of a control step (s).
        LAGS: 1 if a step begins with the derivative at the end of the previous one.
    """

    WEIGHT, MASS, STEP, LAGS, HEAD = range(5)


class SOURCE_TYPE(metaclass=Record):
    """Types of sources."""

    IN_ROW = 0
    """A number of the row."""
    SPINDLE = 1
    """Firing rate of muscle spindles, from a length and a velocity of the row.

    Source: A. Prochazka, Prog. Brain Res. 123, 1999, p. 135, with a velocity over the optimal fiber
    length as in SCONE.
"""
    POSITION = 2
    """Position of a point of a link along a direction of ground (m)."""
    VELOCITY = 3
    """Velocity of a point of a link along a direction of ground (m/s)."""
    ANGLE = 4
    """Sum of the angles of successive rotations about y, z and x of a link (rad)."""
    TURN = 5
    """Angular velocity about an axis of a link (rad/s)."""


SPINDLE_GAIN = 65.0 / 200.0
"""Ratio of the coefficients of velocity and length in Prochazka's formula."""


class SOURCE(metaclass=Record):
    """Integers of a source.

    Attributes:
        KIND: type of the source, such as `SOURCE_TYPE.IN_ROW`.
        INDEX: index in the row, or number of a link.
        MORE: second index in the row, or offset of the numbers: point and direction; axes of a frame
            and factors of the angles; or an axis.
    """

    KIND, INDEX, MORE, SIZE = range(4)


def read_source(model: Ints, data: Floats, source: Ints, p: Floats, row: Floats) -> float:
    """Return the value of a source after the row has been filled.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        source: integers of the source.
        p: numbers that contain those of the source.
        row: sensor row.
    """
    source_type, index = source[SOURCE.KIND], source[SOURCE.INDEX]
    if source_type == SOURCE_TYPE.IN_ROW:
        return row[index]
    if source_type == SOURCE_TYPE.SPINDLE:
        speed = row[source[SOURCE.MORE]]
        # Prochazka's formula contains the square root of the velocity, odd in its sign. Rates are
        # not negative.
        return max(row[index] + SPINDLE_GAIN * (sqrt(speed) if speed > 0.0 else -sqrt(-speed)), 0.0)
    numbers = at(p, source[SOURCE.MORE])
    if source_type == SOURCE_TYPE.ANGLE:
        # Angles of successive rotations, by the entries of the rotation matrix of the link.
        xx, yx, zx = direction(model, data, index, vector(numbers, 0))
        _, yy, _ = direction(model, data, index, vector(numbers, 3))
        _, yz, _ = direction(model, data, index, vector(numbers, 6))
        return dot(
            vector(numbers, 9), (atan2(-yz, yy), atan2(-zx, xx), atan2(yx, sqrt(xx * xx + zx * zx)))
        )
    if source_type == SOURCE_TYPE.TURN:
        return dot(
            direction(model, data, index, vector(numbers, 0)), angular_velocity(model, data, index)
        )
    point = station(model, data, index, vector(numbers, 0))
    return dot(
        vector(numbers, 3),
        point if source_type == SOURCE_TYPE.POSITION else velocity(model, data, index, point),
    )


def fill_sensor_row(model: Ints, data: Floats, y: Floats, i: Ints, p: Floats, row: Floats) -> None:
    """Fill a sensor row after an evaluation of the state y.

    Args:
        model: integers of the model.
        data: results of the evaluation.
        y: state.
        i: plan of the row.
        p: numbers of the row.
        row: filled with the measurements.
    """
    muscles, freedoms, bodies = (
        i[SENSOR_PLAN.MUSCLES],
        i[SENSOR_PLAN.COORDINATES],
        i[SENSOR_PLAN.BODIES],
    )
    muscle_ints, optimal = at(i, SENSOR_PLAN.HEAD), at(p, SENSOR_NUMBERS.HEAD)
    strengths = at(optimal, muscles)
    for k in range(muscles):
        offsets = at(muscle_ints, OF_MUSCLE * k)
        row[i[SENSOR_PLAN.LENGTHS] + k] = data[offsets[0]] / optimal[k]
        row[i[SENSOR_PLAN.VELOCITIES] + k] = data[offsets[1]] / optimal[k]
        row[i[SENSOR_PLAN.FORCES] + k] = data[offsets[2]] / strengths[k]
        row[i[SENSOR_PLAN.ACTIVATIONS] + k] = data[offsets[3]]
        row[i[SENSOR_PLAN.ACTIVE] + k] = data[offsets[4]]
    copy_numbers(2 * freedoms, y, at(row, i[SENSOR_PLAN.VALUES]))
    # A coordinate without a limit force has none.
    limits = at(muscle_ints, OF_MUSCLE * muscles)
    moments = at(row, i[SENSOR_PLAN.MOMENTS])
    for k in range(freedoms):
        moments[k] = 0.0
    for k in range(i[SENSOR_PLAN.LIMITS]):
        moments[limits[2 * k]] = data[limits[2 * k + 1]]
    links = at(limits, 2 * i[SENSOR_PLAN.LIMITS])
    total = ZERO
    rise = 0.0
    centres = at(strengths, muscles + 2 * i[SENSOR_PLAN.CONTROLS])
    for k in range(bodies):
        position = station(model, data, links[k], vector(centres, 3 * k))
        store_vector(row, i[SENSOR_PLAN.POSITIONS] + 3 * k, position)
        total = add_scaled(total, centres[3 * bodies + k], position)
        rise += centres[3 * bodies + k] * velocity(model, data, links[k], position)[1]
    # The mass centre is the mean of those of the bodies, weighted by mass.
    store_vector(row, i[SENSOR_PLAN.CENTRE], divide(total, p[SENSOR_NUMBERS.MASS]))
    row[i[SENSOR_PLAN.RISE]] = rise / p[SENSOR_NUMBERS.MASS]
    for k in range(i[SENSOR_PLAN.LEGS]):
        leg = at(links, bodies + OF_LEG * k)
        load = ZERO
        # All contacts of a foot together carry its leg.
        for pair in range(leg[2], leg[3]):
            load = plus(load, contact_force(model, data, pair))
        row[i[SENSOR_PLAN.LOADS] + k] = norm(load) / p[SENSOR_NUMBERS.WEIGHT]


def contact_force(model: Ints, data: Floats, pair: int) -> Vector:
    """Return the force of a contact on its surface 2 in ground (N).

    Args:
        model: integers of the model.
        data: results of an evaluation.
        pair: number of the contact.
    """
    return vector(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair + CONTACT_WORK.FORCE)


def foot_position(i: Ints, row: Floats, leg: int) -> float:
    """Return the position of the foot of a leg along x of ground (m).

    Args:
        i: plan of the sensor row.
        row: sensor row.
        leg: number of the leg.
    """
    return row[i[SENSOR_PLAN.POSITIONS] + 3 * leg_ints(i, leg)[1]]


def foot_lead(i: Ints, row: Floats, leg: int) -> float:
    """Return the distance of the foot of a leg ahead of the pelvis along x of ground (m).

    Args:
        i: plan of the sensor row.
        row: sensor row.
        leg: number of the leg.
    """
    return foot_position(i, row, leg) - row[i[SENSOR_PLAN.POSITIONS] + 3 * leg_ints(i, leg)[0]]


def leg_ints(i: Ints, leg: int) -> Ints:
    """Return the integers of a leg.

    Args:
        i: plan of the sensor row.
        leg: number of the leg.
    """
    offset = (
        SENSOR_PLAN.HEAD
        + OF_MUSCLE * i[SENSOR_PLAN.MUSCLES]
        + 2 * i[SENSOR_PLAN.LIMITS]
        + i[SENSOR_PLAN.BODIES]
    )
    return at(i, offset + OF_LEG * leg)
