"""What is felt of a walker once its forces are computed: the row of numbers that reflexes and measures go by.

The plan of a row are integers: a head, `SENSES`; of each muscle where w has what `OF_MUSCLES` names; of each force that
limits a coordinate the number of that and where w has the force; the link of each body; of each leg the numbers of the
bodies that it hangs on and ends with, and the first and the end of the contacts of its foot. The numbers that belong to
it are a head, `SENSED`; optimal fiber lengths (m), strengths (N); of each control the least and the largest; mass
centres in the links (m), masses (kg).
"""

from __future__ import annotations

from osimlite.forces.vectors import ZERO, Vector, along, norm, over, plus, put, vector
from osimlite.kernels.layout import CONTACT_WORK, MODEL, Record
from osimlite.kernels.pointers import Floats, Ints, at
from osimlite.kernels.points import station, velocity
from osimlite.kernels.states import copy

OF_MUSCLES = "fiber_length", "fiber_velocity", "tension", "active_fiber_force"
OF_LEG = 4
"""How many integers a leg has."""


class SENSES(metaclass=Record):
    """Counts, of controls and of the numbers too, and where a row has what is felt: lengths of fibers over the optimal
    ones, velocities (of these lengths per s), forces of tendons over the strengths, values of coordinates and their
    speeds, forces of the ground on each leg over the weight; active forces of fibers (N), forces that limit coordinates
    (N, N m), mass centres of bodies and the common one (m), how fast that rises (m/s)."""

    MUSCLES, COORDINATES, LEGS, LIMITS, BODIES, CONTROLS, KNOWN = range(7)
    LENGTHS, VELOCITIES, FORCES, VALUES, SPEEDS, LOADS, ACTIVE, MOMENTS, PLACES, CENTRE, RISE, SIZE, HEAD = range(7, 20)


class SENSED(metaclass=Record):
    """Weight (N), mass (kg), for how long controls are held (s), 1 if steps begin with the derivative before them."""

    WEIGHT, MASS, STEP, LAGS, HEAD = range(5)


def feel(s: Ints, w: Floats, y: Floats, i: Ints, p: Floats, row: Floats) -> None:
    """Fill a row, after an evaluation of the state y."""
    muscles, freedoms, bodies = i[SENSES.MUSCLES], i[SENSES.COORDINATES], i[SENSES.BODIES]
    own, optimal = at(i, SENSES.HEAD), at(p, SENSED.HEAD)
    strengths = at(optimal, muscles)
    for k in range(muscles):
        row[i[SENSES.LENGTHS] + k] = w[own[4 * k]] / optimal[k]
        row[i[SENSES.VELOCITIES] + k] = w[own[4 * k + 1]] / optimal[k]
        row[i[SENSES.FORCES] + k] = w[own[4 * k + 2]] / strengths[k]
        row[i[SENSES.ACTIVE] + k] = w[own[4 * k + 3]]
    copy(2 * freedoms, y, at(row, i[SENSES.VALUES]))
    limits, moments = at(own, 4 * muscles), at(row, i[SENSES.MOMENTS])
    for k in range(freedoms):
        moments[k] = 0.0
    for k in range(i[SENSES.LIMITS]):
        moments[limits[2 * k]] = w[limits[2 * k + 1]]
    links, total, rise = at(limits, 2 * i[SENSES.LIMITS]), ZERO, 0.0
    centres = at(strengths, muscles + 2 * i[SENSES.CONTROLS])
    for k in range(bodies):
        place = station(s, w, links[k], vector(centres, 3 * k))
        put(row, i[SENSES.PLACES] + 3 * k, place)
        total = along(total, centres[3 * bodies + k], place)
        rise += centres[3 * bodies + k] * velocity(s, w, links[k], place)[1]
    put(row, i[SENSES.CENTRE], over(total, p[SENSED.MASS]))
    row[i[SENSES.RISE]] = rise / p[SENSED.MASS]
    for k in range(i[SENSES.LEGS]):
        leg, push = at(links, bodies + OF_LEG * k), ZERO
        for pair in range(leg[2], leg[3]):
            push = plus(push, contact_force(s, w, pair))
        row[i[SENSES.LOADS] + k] = norm(push) / p[SENSED.WEIGHT]


def contact_force(s: Ints, w: Floats, pair: int) -> Vector:
    """Force of a contact, N."""
    return vector(w, s[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair + CONTACT_WORK.FORCE)


def foot(i: Ints, row: Floats, leg: int) -> float:
    """How far the foot of a leg is along x, m."""
    return row[i[SENSES.PLACES] + 3 * leg_ints(i, leg)[1]]


def ahead(i: Ints, row: Floats, leg: int) -> float:
    """How far the foot of a leg is before what the leg hangs on, m."""
    return foot(i, row, leg) - row[i[SENSES.PLACES] + 3 * leg_ints(i, leg)[0]]


def leg_ints(i: Ints, leg: int) -> Ints:
    """The integers of a leg."""
    before = SENSES.HEAD + 4 * i[SENSES.MUSCLES] + 2 * i[SENSES.LIMITS] + i[SENSES.BODIES]
    return at(i, before + OF_LEG * leg)
