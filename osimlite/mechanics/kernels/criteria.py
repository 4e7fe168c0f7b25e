"""What a walk is judged by: SCONE's measures, noted after each control step.

The integers are the count of the criteria, and of each `CRITERION`. Its numbers are the times
between which it counts (s), and those of its kind; its room begins as `NOTED` says, that of a gait
as `GAIT_NOTED`, behind which there are the
steps: the time (s) of each, and how far it led (m).
"""

from __future__ import annotations

from math import cos, pi, sin

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.sensors import SENSED, SENSES, foot

GAIT, JUMP, NUMBER, LARGEST_LOAD, WHOLE_LOAD, POWERS, TENSIONS, WANG = range(8)
"""Kinds: steps; a jump; how far a number of a row, the load of a leg or that of both are beyond a
range; what muscles take.
"""
QUARTER = 0.5 * pi
PREPARES, TAKES_OFF, FLIES, COMES_DOWN = range(4)
"""What a jumper does."""
AT_REST = 1.51
"""Power of a body at rest, W/kg (J. M. Wang et al., ACM Trans. Graph. 31, 2012)."""


class CRITERION(metaclass=Record):
    """Its kind, a place in a row or a power, where its numbers and its room are."""

    KIND, PLACE, NUMBERS, ROOM, SIZE = range(5)


class CRITERION_NUMBERS(metaclass=Record):
    """Of all; of a range what follows: a factor of the number, least and largest, penalties of what
    is beyond and of its square; of a gait: least height of the mass centre over that at the start,
    load of a foot that touches, shortest time of a step; of a jump: least height likewise, time to
    prepare (s), whether it ends at the peak; of Wang's
    effort: part of slow fibers, and of each muscle the mass (kg).
    """

    START, STOP, FACTOR, LOW, HIGH, LINEAR, SQUARED = range(7)
    HEIGHT, LOAD, SHORTEST = 2, 3, 4
    PREPARE, AT_PEAK = 3, 4
    SLOW, MASSES = 2, 3


class NOTED(metaclass=Record):
    """Whether there is a sample, its time and value; integral over time, time of that, largest and
    smallest value; how far the mass centre was along x at the start, and is.
    """

    BEGUN, TIME, VALUE, TOTAL, SPAN, HIGHEST, LOWEST, START, HERE, SIZE = range(10)


class GAIT_NOTED(metaclass=Record):
    """How far the walker was at the last step, and is; height of the mass centre at the start;
    whether it has fallen; count of steps; whether each foot touches, -1 if that is not known.
    """

    BEFORE, HERE, HEIGHT, FALLEN, COUNT, TOUCHES, STEPS = 0, 1, 2, 3, 4, 5, 7


class JUMP_NOTED(metaclass=Record):
    """Height of the mass centre at the start, now, at the highest and when the jumper began to take
    off (m); whether it has sunk or come down, see PREPARES.
    """

    START, HERE, PEAK, PREPARED, ENDED, DOES = range(6)


def begin_criteria(senses: Ints, i: Ints, row: Floats, room: Floats) -> None:
    """Begin anew with a row."""
    for number in range(i[0]):
        own = at(i, 1 + CRITERION.SIZE * number)
        noted, centre = at(room, own[CRITERION.ROOM]), senses[SENSES.CENTRE]
        if own[CRITERION.KIND] == GAIT:
            noted[GAIT_NOTED.BEFORE] = noted[GAIT_NOTED.HERE] = distance(senses, row)
            noted[GAIT_NOTED.HEIGHT] = row[centre + 1]
            noted[GAIT_NOTED.FALLEN] = noted[GAIT_NOTED.COUNT] = 0.0
            noted[GAIT_NOTED.TOUCHES] = noted[GAIT_NOTED.TOUCHES + 1] = -1.0
        elif own[CRITERION.KIND] == JUMP:
            for k in range(JUMP_NOTED.ENDED):
                noted[k] = row[centre + 1]
            noted[JUMP_NOTED.ENDED], noted[JUMP_NOTED.DOES] = 0.0, PREPARES
        else:
            for k in range(NOTED.SIZE):
                noted[k] = 0.0
            noted[NOTED.START] = noted[NOTED.HERE] = row[centre]


def judged(
    senses: Ints, known: Floats, i: Ints, p: Floats, t: float, row: Floats, u: Floats, room: Floats
) -> bool:
    """Note a row, and tell whether the walker has fallen, or its jump has ended.

    Args:
        senses: plan of the row.
        known: its numbers.
        i: the criteria.
        p: their numbers.
        t: time, s.
        row: what is felt.
        u: the excitations that were held.
        room: of the criteria.
    """
    has_fallen = False
    for number in range(i[0]):
        own = at(i, 1 + CRITERION.SIZE * number)
        numbers, noted = at(p, own[CRITERION.NUMBERS]), at(room, own[CRITERION.ROOM])
        if not numbers[CRITERION_NUMBERS.START] <= t < numbers[CRITERION_NUMBERS.STOP]:
            continue
        if own[CRITERION.KIND] == GAIT:
            note_gait(senses, numbers, t, row, noted)
            has_fallen = has_fallen or noted[GAIT_NOTED.FALLEN] > 0.0
            continue
        if own[CRITERION.KIND] == JUMP:
            note_jump(senses, numbers, t, row, noted)
            has_fallen = has_fallen or noted[JUMP_NOTED.ENDED] > 0.0
            continue
        if own[CRITERION.KIND] == WANG:
            value = wang(senses, known, numbers, row, u)
        elif own[CRITERION.KIND] >= POWERS:
            value = effort(senses, known, own[CRITERION.KIND], own[CRITERION.PLACE], row)
        else:
            value = penalty(senses, own[CRITERION.KIND], own[CRITERION.PLACE], numbers, row)
        noted[NOTED.HERE] = row[senses[SENSES.CENTRE]]
        add(noted, t, value)
    return has_fallen


def add(noted: Floats, t: float, value: float) -> None:
    """A sample: integrals are over lines between samples."""
    if noted[NOTED.BEGUN] > 0.0:
        dt = t - noted[NOTED.TIME]
        noted[NOTED.TOTAL] += 0.5 * dt * (noted[NOTED.VALUE] + value)
        noted[NOTED.SPAN] += dt
        noted[NOTED.HIGHEST] = max(noted[NOTED.HIGHEST], value)
        noted[NOTED.LOWEST] = min(noted[NOTED.LOWEST], value)
    else:
        noted[NOTED.HIGHEST] = noted[NOTED.LOWEST] = value
    noted[NOTED.BEGUN], noted[NOTED.TIME], noted[NOTED.VALUE] = 1.0, t, value


def distance(senses: Ints, row: Floats) -> float:
    """How far a walker is, m: the mean of the two that are furthest behind, of its feet and its mass centre."""
    centre, one, two = row[senses[SENSES.CENTRE]], foot(senses, row, 0), foot(senses, row, 1)
    if centre >= one and centre >= two:
        return 0.5 * (one + two)
    return 0.5 * (centre + min(one, two))


def note_gait(senses: Ints, numbers: Floats, t: float, row: Floats, noted: Floats) -> None:
    """Whether the mass centre has sunk, and a step if a foot has touched the ground."""
    noted[GAIT_NOTED.HERE] = distance(senses, row)
    if (
        row[senses[SENSES.CENTRE] + 1]
        < numbers[CRITERION_NUMBERS.HEIGHT] * noted[GAIT_NOTED.HEIGHT]
    ):
        noted[GAIT_NOTED.FALLEN] = 1.0
    has_touched = False
    for leg in range(2):
        touches = 1.0 if row[senses[SENSES.LOADS] + leg] >= numbers[CRITERION_NUMBERS.LOAD] else 0.0
        has_touched = has_touched or (touches > 0.0 and noted[GAIT_NOTED.TOUCHES + leg] == 0.0)
        noted[GAIT_NOTED.TOUCHES + leg] = touches
    count = int(noted[GAIT_NOTED.COUNT])
    last = noted[GAIT_NOTED.STEPS + 2 * (count - 1)] if count > 0 else 0.0
    if (
        has_touched
        and noted[GAIT_NOTED.FALLEN] == 0.0
        and t - last > numbers[CRITERION_NUMBERS.SHORTEST]
    ):
        step = at(noted, GAIT_NOTED.STEPS + 2 * count)
        step[0], step[1] = t, noted[GAIT_NOTED.HERE] - noted[GAIT_NOTED.BEFORE]
        noted[GAIT_NOTED.BEFORE] = noted[GAIT_NOTED.HERE]
        noted[GAIT_NOTED.COUNT] += 1.0


def note_jump(senses: Ints, numbers: Floats, t: float, row: Floats, noted: Floats) -> None:
    """Follow the height of the mass centre, and what the jumper does: it takes off once it rises
    after its time to prepare, and comes down when it sinks, or is on the ground after a flight.
    """
    height, rise, does = (
        row[senses[SENSES.CENTRE] + 1],
        row[senses[SENSES.RISE]],
        noted[JUMP_NOTED.DOES],
    )
    has_load = row[senses[SENSES.LOADS]] + row[senses[SENSES.LOADS] + 1] > 0.0
    noted[JUMP_NOTED.HERE], noted[JUMP_NOTED.PEAK] = height, max(noted[JUMP_NOTED.PEAK], height)
    if height < numbers[CRITERION_NUMBERS.HEIGHT] * noted[JUMP_NOTED.START]:
        noted[JUMP_NOTED.ENDED] = 1.0
    elif does == PREPARES:
        if t >= numbers[CRITERION_NUMBERS.PREPARE] and (rise > 0.0 or not has_load):
            noted[JUMP_NOTED.DOES], noted[JUMP_NOTED.PREPARED] = TAKES_OFF, height
    elif does == TAKES_OFF and not has_load:
        noted[JUMP_NOTED.DOES] = FLIES
    elif does < COMES_DOWN and (rise < 0.0 or (does == FLIES and has_load)):
        noted[JUMP_NOTED.DOES], noted[JUMP_NOTED.ENDED] = (
            COMES_DOWN,
            numbers[CRITERION_NUMBERS.AT_PEAK],
        )


def penalty(senses: Ints, kind: int, place: int, numbers: Floats, row: Floats) -> float:
    """Of a number beyond a range."""
    one, two = row[place], 0.0
    if kind != NUMBER:
        one, two = row[senses[SENSES.LOADS]], row[senses[SENSES.LOADS] + 1]
        one, two = (max(one, two), 0.0) if kind == LARGEST_LOAD else (one, two)
    value = numbers[CRITERION_NUMBERS.FACTOR] * (one + two)
    off = max(numbers[CRITERION_NUMBERS.LOW] - value, 0.0) + max(
        value - numbers[CRITERION_NUMBERS.HIGH], 0.0
    )
    return numbers[CRITERION_NUMBERS.LINEAR] * off + numbers[CRITERION_NUMBERS.SQUARED] * (
        off * off
    )


def effort(senses: Ints, known: Floats, kind: int, power: int, row: Floats) -> float:
    """The sum of the activations to a power, or 1 more than that of the tensions (N)."""
    count, total = senses[SENSES.MUSCLES], 1.0 if kind == TENSIONS else 0.0
    strengths = at(known, SENSED.HEAD + count)
    for k in range(count):
        each = 1.0
        if kind == TENSIONS:
            each = row[senses[SENSES.FORCES] + k] * strengths[k]
        else:
            for _ in range(power):
                each *= row[senses[SENSES.ACTIVATIONS] + k]
        total += each
    return total


def wang(senses: Ints, known: Floats, numbers: Floats, row: Floats, excitations: Floats) -> float:
    """Power, W (J. M. Wang et al., ACM Trans. Graph. 31, 2012, after F. C. Anderson's thesis of 1999)."""
    count, slow, total = senses[SENSES.MUSCLES], numbers[CRITERION_NUMBERS.SLOW], 0.0
    optimal, strengths = at(known, SENSED.HEAD), at(known, SENSED.HEAD + count)
    for k in range(count):
        u, a = QUARTER * excitations[k], QUARTER * row[senses[SENSES.ACTIVATIONS] + k]
        n = row[senses[SENSES.LENGTHS] + k]
        of_activation = 40.0 * slow * sin(u) + 133.0 * (1.0 - slow) * (1.0 - cos(u))
        of_maintenance = 74.0 * slow * sin(a) + 111.0 * (1.0 - slow) * (1.0 - cos(a))
        shape = 0.5 if n < 0.5 else n if n < 1.0 else 3.0 - 2.0 * n if n < 1.5 else 0.0
        shortens = -row[senses[SENSES.VELOCITIES] + k] * optimal[k]
        heat = max(0.0, 0.25 * row[senses[SENSES.FORCES] + k] * strengths[k] * shortens)
        work = max(0.0, row[senses[SENSES.ACTIVE] + k] * shortens)
        total += (
            numbers[CRITERION_NUMBERS.MASSES + k] * (of_activation + shape * of_maintenance)
            + heat
            + work
        )
    return AT_REST * known[SENSED.MASS] + total
