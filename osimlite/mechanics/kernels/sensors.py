"""What is felt of a walker once its forces are computed: a row of numbers that measures go by, and sources of reflexes.

The plan of a row are integers: a head, `SENSES`; of each muscle where w has what `OF_MUSCLES`
names; of each force that limits a coordinate the number of that and where w has the force; the link
of each body; of each leg the numbers of the bodies that it hangs on and ends with, and the first
and the end of the contacts of its foot. The numbers that belong to it are a head, `SENSED`; optimal
fiber lengths (m), strengths (N); of each control the least and the largest; mass centres in the
links (m), masses (kg).
"""

from __future__ import annotations

from math import atan2, sqrt

from osimlite.mechanics.kernels.layout import CONTACT_WORK, MODEL, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy
from osimlite.mechanics.kernels.points import angular_velocity, direction, station, velocity
from osimlite.mechanics.laws.vectors import ZERO, Vector, along, dot, norm, over, plus, put, vector

OF_MUSCLES = "fiber_length", "fiber_velocity", "tension", "activation", "active_fiber_force"
OF_MUSCLE = 5
"""How many these are."""
OF_LEG = 4
"""How many integers a leg has."""


class SENSES(metaclass=Record):
    """Counts, of controls and of the numbers too, and where a row has what is felt: lengths of
    fibers over the optimal ones, velocities (of these lengths per s), forces of tendons over the
    strengths, activations, active forces of fibers (N); values of coordinates and their speeds,
    forces that limit them (N, N m); forces of the ground on each leg over the weight; mass centres
    of bodies and the common one (m), how fast that rises (m/s).
    """

    MUSCLES, COORDINATES, LEGS, LIMITS, BODIES, CONTROLS, KNOWN = range(7)
    LENGTHS, VELOCITIES, FORCES, ACTIVATIONS, ACTIVE, VALUES, SPEEDS, MOMENTS = range(7, 15)
    LOADS, PLACES, CENTRE, RISE, SIZE, HEAD = range(15, 21)


class SENSED(metaclass=Record):
    """Weight (N), mass (kg), for how long controls are held (s), 1 if steps begin with the derivative before them."""

    WEIGHT, MASS, STEP, LAGS, HEAD = range(5)


IN_ROW, SPINDLE, POSITION, VELOCITY, ANGLE, TURN = range(6)
"""Kinds of sources: a number of a row; the rate of a muscle's spindles, whose length and velocity
are two numbers of a row (A. Prochazka, Prog. Brain Res. 123, 1999, p. 135, with a velocity over the
optimal length as in SCONE). Of a link: where a point is, and how fast, along a direction of ground
(m, m/s); angles that rotations about y, z and x make one after the other, and the angular velocity
about an axis of the link (rad, rad/s).
"""
SPINDLE_GAIN = 65.0 / 200.0


class SOURCE(metaclass=Record):
    """Kind; place in a row, or link; a second place in a row, or where numbers of a link are: of a
    point its place in the link and the direction; of angles the axes of a frame in the link, and
    how each angle counts; of an angular velocity the axis.
    """

    KIND, PLACE, MORE, SIZE = range(4)


def felt(model: Ints, data: Floats, source: Ints, p: Floats, row: Floats) -> float:
    """What a source is, after a row is filled; p are the numbers that it has its own among."""
    kind, place = source[SOURCE.KIND], source[SOURCE.PLACE]
    if kind == IN_ROW:
        return row[place]
    if kind == SPINDLE:
        speed = row[source[SOURCE.MORE]]
        return max(row[place] + SPINDLE_GAIN * (sqrt(speed) if speed > 0.0 else -sqrt(-speed)), 0.0)
    own = at(p, source[SOURCE.MORE])
    if kind == ANGLE:
        xx, yx, zx = direction(model, data, place, vector(own, 0))
        _, yy, _ = direction(model, data, place, vector(own, 3))
        _, yz, _ = direction(model, data, place, vector(own, 6))
        return dot(
            vector(own, 9), (atan2(-yz, yy), atan2(-zx, xx), atan2(yx, sqrt(xx * xx + zx * zx)))
        )
    if kind == TURN:
        return dot(
            direction(model, data, place, vector(own, 0)), angular_velocity(model, data, place)
        )
    point = station(model, data, place, vector(own, 0))
    return dot(vector(own, 3), point if kind == POSITION else velocity(model, data, place, point))


def feel(model: Ints, data: Floats, y: Floats, i: Ints, p: Floats, row: Floats) -> None:
    """Fill a row, after an evaluation of the state y."""
    muscles, freedoms, bodies = i[SENSES.MUSCLES], i[SENSES.COORDINATES], i[SENSES.BODIES]
    own, optimal = at(i, SENSES.HEAD), at(p, SENSED.HEAD)
    strengths = at(optimal, muscles)
    for k in range(muscles):
        places = at(own, OF_MUSCLE * k)
        row[i[SENSES.LENGTHS] + k] = data[places[0]] / optimal[k]
        row[i[SENSES.VELOCITIES] + k] = data[places[1]] / optimal[k]
        row[i[SENSES.FORCES] + k] = data[places[2]] / strengths[k]
        row[i[SENSES.ACTIVATIONS] + k] = data[places[3]]
        row[i[SENSES.ACTIVE] + k] = data[places[4]]
    copy(2 * freedoms, y, at(row, i[SENSES.VALUES]))
    limits, moments = at(own, OF_MUSCLE * muscles), at(row, i[SENSES.MOMENTS])
    for k in range(freedoms):
        moments[k] = 0.0
    for k in range(i[SENSES.LIMITS]):
        moments[limits[2 * k]] = data[limits[2 * k + 1]]
    links, total, rise = at(limits, 2 * i[SENSES.LIMITS]), ZERO, 0.0
    centres = at(strengths, muscles + 2 * i[SENSES.CONTROLS])
    for k in range(bodies):
        place = station(model, data, links[k], vector(centres, 3 * k))
        put(row, i[SENSES.PLACES] + 3 * k, place)
        total = along(total, centres[3 * bodies + k], place)
        rise += centres[3 * bodies + k] * velocity(model, data, links[k], place)[1]
    put(row, i[SENSES.CENTRE], over(total, p[SENSED.MASS]))
    row[i[SENSES.RISE]] = rise / p[SENSED.MASS]
    for k in range(i[SENSES.LEGS]):
        leg, push = at(links, bodies + OF_LEG * k), ZERO
        for pair in range(leg[2], leg[3]):
            push = plus(push, contact_force(model, data, pair))
        row[i[SENSES.LOADS] + k] = norm(push) / p[SENSED.WEIGHT]


def contact_force(model: Ints, data: Floats, pair: int) -> Vector:
    """Force of a contact, N."""
    return vector(data, model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair + CONTACT_WORK.FORCE)


def foot(i: Ints, row: Floats, leg: int) -> float:
    """How far the foot of a leg is along x, m."""
    return row[i[SENSES.PLACES] + 3 * leg_ints(i, leg)[1]]


def ahead(i: Ints, row: Floats, leg: int) -> float:
    """How far the foot of a leg is before what the leg hangs on, m."""
    return foot(i, row, leg) - row[i[SENSES.PLACES] + 3 * leg_ints(i, leg)[0]]


def leg_ints(i: Ints, leg: int) -> Ints:
    """The integers of a leg."""
    before = SENSES.HEAD + OF_MUSCLE * i[SENSES.MUSCLES] + 2 * i[SENSES.LIMITS] + i[SENSES.BODIES]
    return at(i, before + OF_LEG * leg)
