"""Criteria that score a walk: SCONE's measures, updated after each control step.

The integers are the number of criteria, and per criterion a `CRITERION`. The numbers of a criterion
are the times between which it is active (s), and those of its kind. The workspace of a criterion is
laid out by `SAMPLE_WORK`, that of a gait by `GAIT_WORK`, and that of a jump by `JUMP_WORK`. Behind the
workspace of a gait follow its steps, each with its time (s) and length (m).
"""

from __future__ import annotations

from math import cos, pi, sin

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.sensors import SENSOR_NUMBERS, SENSOR_PLAN, foot_position


class CRITERION_TYPE(metaclass=Record):
    """Types of criteria."""

    GAIT = 0
    """Steps of a gait."""
    JUMP = 1
    """A jump."""
    NUMBER = 2
    """Excess of a number of the sensor row beyond a range."""
    LARGEST_LOAD = 3
    """Excess of the larger load of two legs beyond a range."""
    TOTAL_LOAD = 4
    """Excess of the total load of two legs beyond a range."""
    POWERS = 5
    """Sum of powers of activations; the kinds from here on are efforts."""
    TENSIONS = 6
    """1 plus the sum of tensions (N)."""
    WANG = 7
    """Metabolic power of Wang et al. (W)."""


RIGHT_ANGLE = 0.5 * pi
"""A right angle (rad)."""


class JUMP_PHASE(metaclass=Record):
    """Phases of a jump."""

    PREPARES = 0
    """Before the mass centre rises."""
    TAKES_OFF = 1
    """On the ground, after the start of the rise."""
    FLIES = 2
    """Without ground contact."""
    COMES_DOWN = 3
    """After its peak."""


BASAL_POWER = 1.51
"""Power of a body at rest, W/kg (J. M. Wang et al., ACM Trans. Graph. 31, 2012)."""


class CRITERION(metaclass=Record):
    """Integers of a criterion.

    Attributes:
        KIND: type of the criterion, such as `CRITERION_TYPE.GAIT`.
        INDEX: index in the sensor row, or a power.
        NUMBERS, WORKSPACE: offsets of the numbers and of the workspace of the criterion.
    """

    KIND, INDEX, NUMBERS, WORKSPACE, SIZE = range(5)


class CRITERION_NUMBERS(metaclass=Record):
    """Numbers of a criterion.

    Attributes:
        START, STOP: times between which it is active (s).
        FACTOR, LOW, HIGH: of a range, factor of the number, smallest and largest value.
        LINEAR, SQUARED: of a range, penalties of the excess and of its square.
        HEIGHT: of a gait or jump, smallest height of the mass centre, as a multiple of its height
            at the start.
        LOAD, SHORTEST: of a gait, load of a foot in contact, and shortest duration of a step (s).
        PREPARE, AT_PEAK: of a jump, time to prepare (s), and whether it ends at the peak.
        SLOW, MASSES: of Wang's effort, part of slow fibers, and the masses of the muscles (kg).
    """

    START, STOP, FACTOR, LOW, HIGH, LINEAR, SQUARED = range(7)
    HEIGHT, LOAD, SHORTEST = 2, 3, 4
    PREPARE, AT_PEAK = 3, 4
    SLOW, MASSES = 2, 3


class SAMPLE_WORK(metaclass=Record):
    """Workspace of a criterion that samples a value.

    Attributes:
        BEGUN, TIME, VALUE: whether there is a sample, its time (s) and its value.
        TOTAL, SPAN: integral over time, and duration (s).
        HIGHEST, LOWEST: extremes of the value.
        START, HERE: position of the mass centre along x at the start, and now (m).
    """

    BEGUN, TIME, VALUE, TOTAL, SPAN, HIGHEST, LOWEST, START, HERE, SIZE = range(10)


class GAIT_WORK(metaclass=Record):
    """Workspace of a gait.

    Attributes:
        BEFORE, HERE: distance of the walker at the last step, and now (m).
        HEIGHT: height of the mass centre at the start (m).
        FALLEN, COUNT: whether the walker has fallen, and the number of steps.
        TOUCHES: contact of each foot (2,): 1 if it touches the ground, 0 if not, -1 if unknown.
        STEPS: offset of the steps.
    """

    BEFORE, HERE, HEIGHT, FALLEN, COUNT, TOUCHES, STEPS = 0, 1, 2, 3, 4, 5, 7


class JUMP_WORK(metaclass=Record):
    """Workspace of a jump.

    Attributes:
        START, HERE, PEAK, PREPARED: height of the mass centre at the start, now, at the highest point,
            and at the start of take-off (m).
        ENDED: whether the jumper has sunk or come down.
        PHASE: phase of the jump, such as `JUMP_PHASE.PREPARES`.
    """

    START, HERE, PEAK, PREPARED, ENDED, PHASE = range(6)


def begin_criteria(sensor_plan: Ints, i: Ints, row: Floats, work: Floats) -> None:
    """Start all criteria with a sensor row.

    Args:
        sensor_plan: plan of the sensor row.
        i: integers of the criteria.
        row: sensor row.
        work: workspace of the criteria; filled.
    """
    for number in range(i[0]):
        criterion = at(i, 1 + CRITERION.SIZE * number)
        criterion_work = at(work, criterion[CRITERION.WORKSPACE])
        centre = sensor_plan[SENSOR_PLAN.CENTRE]
        if criterion[CRITERION.KIND] == CRITERION_TYPE.GAIT:
            criterion_work[GAIT_WORK.BEFORE] = criterion_work[GAIT_WORK.HERE] = (
                compute_walked_distance(sensor_plan, row)
            )
            criterion_work[GAIT_WORK.HEIGHT] = row[centre + 1]
            criterion_work[GAIT_WORK.FALLEN] = criterion_work[GAIT_WORK.COUNT] = 0.0
            # Unknown contact, so that a foot that stands from the start does not count as one that
            # lands.
            criterion_work[GAIT_WORK.TOUCHES] = criterion_work[GAIT_WORK.TOUCHES + 1] = -1.0
        elif criterion[CRITERION.KIND] == CRITERION_TYPE.JUMP:
            for k in range(JUMP_WORK.ENDED):
                criterion_work[k] = row[centre + 1]
            criterion_work[JUMP_WORK.ENDED], criterion_work[JUMP_WORK.PHASE] = (
                0.0,
                JUMP_PHASE.PREPARES,
            )
        else:
            for k in range(SAMPLE_WORK.SIZE):
                criterion_work[k] = 0.0
            criterion_work[SAMPLE_WORK.START] = criterion_work[SAMPLE_WORK.HERE] = row[centre]


def update_criteria(
    sensor_plan: Ints,
    sensor_numbers: Floats,
    i: Ints,
    p: Floats,
    t: float,
    row: Floats,
    u: Floats,
    work: Floats,
) -> bool:
    """Update all criteria after a control step.

    Args:
        sensor_plan: plan of the sensor row.
        sensor_numbers: numbers of the sensor row.
        i: integers of the criteria.
        p: numbers of the criteria.
        t: time (s).
        row: sensor row.
        u: excitations during the control step.
        work: workspace of the criteria.

    Returns:
        Whether the walker has fallen, or its jump has ended.
    """
    has_fallen = False
    for number in range(i[0]):
        criterion = at(i, 1 + CRITERION.SIZE * number)
        numbers = at(p, criterion[CRITERION.NUMBERS])
        criterion_work = at(work, criterion[CRITERION.WORKSPACE])
        # SCONE's measures see only what happens within their times.
        if not numbers[CRITERION_NUMBERS.START] <= t < numbers[CRITERION_NUMBERS.STOP]:
            continue
        if criterion[CRITERION.KIND] == CRITERION_TYPE.GAIT:
            note_gait(sensor_plan, numbers, t, row, criterion_work)
            has_fallen = has_fallen or criterion_work[GAIT_WORK.FALLEN] > 0.0
            continue
        if criterion[CRITERION.KIND] == CRITERION_TYPE.JUMP:
            note_jump(sensor_plan, numbers, t, row, criterion_work)
            has_fallen = has_fallen or criterion_work[JUMP_WORK.ENDED] > 0.0
            continue
        if criterion[CRITERION.KIND] == CRITERION_TYPE.WANG:
            value = metabolic_power(sensor_plan, sensor_numbers, numbers, row, u)
        elif criterion[CRITERION.KIND] >= CRITERION_TYPE.POWERS:
            value = muscle_effort(
                sensor_plan,
                sensor_numbers,
                criterion[CRITERION.KIND],
                criterion[CRITERION.INDEX],
                row,
            )
        else:
            value = range_penalty(
                sensor_plan, criterion[CRITERION.KIND], criterion[CRITERION.INDEX], numbers, row
            )
        criterion_work[SAMPLE_WORK.HERE] = row[sensor_plan[SENSOR_PLAN.CENTRE]]
        add_sample(criterion_work, t, value)
    return has_fallen


def add_sample(criterion_work: Floats, t: float, value: float) -> None:
    """Add a sample of a value to its integral by the trapezoidal rule, and to its extremes.

    Args:
        criterion_work: workspace of the criterion, see `SAMPLE_WORK`.
        t: time (s).
        value: value.
    """
    if criterion_work[SAMPLE_WORK.BEGUN] > 0.0:
        dt = t - criterion_work[SAMPLE_WORK.TIME]
        criterion_work[SAMPLE_WORK.TOTAL] += 0.5 * dt * (criterion_work[SAMPLE_WORK.VALUE] + value)
        criterion_work[SAMPLE_WORK.SPAN] += dt
        # The first sample sets the extremes: its value may be negative.
        criterion_work[SAMPLE_WORK.HIGHEST] = max(criterion_work[SAMPLE_WORK.HIGHEST], value)
        criterion_work[SAMPLE_WORK.LOWEST] = min(criterion_work[SAMPLE_WORK.LOWEST], value)
    else:
        criterion_work[SAMPLE_WORK.HIGHEST] = criterion_work[SAMPLE_WORK.LOWEST] = value
    (
        criterion_work[SAMPLE_WORK.BEGUN],
        criterion_work[SAMPLE_WORK.TIME],
        criterion_work[SAMPLE_WORK.VALUE],
    ) = 1.0, t, value


def compute_walked_distance(sensor_plan: Ints, row: Floats) -> float:
    """Return the distance of a walker along x (m).

    It is the mean of the two smallest positions of both feet and the mass centre.

    Args:
        sensor_plan: plan of the sensor row.
        row: sensor row.
    """
    centre = row[sensor_plan[SENSOR_PLAN.CENTRE]]
    first_foot = foot_position(sensor_plan, row, 0)
    second_foot = foot_position(sensor_plan, row, 1)
    # SCONE takes the two smallest of three, so that a trunk that falls forwards adds little.
    if centre >= first_foot and centre >= second_foot:
        return 0.5 * (first_foot + second_foot)
    return 0.5 * (centre + min(first_foot, second_foot))


def note_gait(
    sensor_plan: Ints, numbers: Floats, t: float, row: Floats, criterion_work: Floats
) -> None:
    """Update a gait: detect a fall and steps.

    A fall is a mass centre below a part of its height at the start. A step is a foot that lands,
    after a shortest duration since the last one.

    Args:
        sensor_plan: plan of the sensor row.
        numbers: numbers of the criterion.
        t: time (s).
        row: sensor row.
        criterion_work: workspace of the criterion, see `GAIT_WORK`.
    """
    criterion_work[GAIT_WORK.HERE] = compute_walked_distance(sensor_plan, row)
    if (
        row[sensor_plan[SENSOR_PLAN.CENTRE] + 1]
        < numbers[CRITERION_NUMBERS.HEIGHT] * criterion_work[GAIT_WORK.HEIGHT]
    ):
        criterion_work[GAIT_WORK.FALLEN] = 1.0
    has_touched = False
    for leg in range(2):
        touches = (
            1.0
            if row[sensor_plan[SENSOR_PLAN.LOADS] + leg] >= numbers[CRITERION_NUMBERS.LOAD]
            else 0.0
        )
        has_touched = has_touched or (
            touches > 0.0 and criterion_work[GAIT_WORK.TOUCHES + leg] == 0.0
        )
        criterion_work[GAIT_WORK.TOUCHES + leg] = touches
    count = int(criterion_work[GAIT_WORK.COUNT])
    # A step takes two numbers, its time and its length; the first one starts at time 0.
    last_step_time = criterion_work[GAIT_WORK.STEPS + 2 * (count - 1)] if count > 0 else 0.0
    if (
        has_touched
        and criterion_work[GAIT_WORK.FALLEN] == 0.0
        and t - last_step_time > numbers[CRITERION_NUMBERS.SHORTEST]
    ):
        step = at(criterion_work, GAIT_WORK.STEPS + 2 * count)
        step[0], step[1] = t, criterion_work[GAIT_WORK.HERE] - criterion_work[GAIT_WORK.BEFORE]
        criterion_work[GAIT_WORK.BEFORE] = criterion_work[GAIT_WORK.HERE]
        criterion_work[GAIT_WORK.COUNT] += 1.0


def note_jump(
    sensor_plan: Ints, numbers: Floats, t: float, row: Floats, criterion_work: Floats
) -> None:
    """Update a jump: follow the height of the mass centre and the phase.

    The jumper takes off once it rises after its time to prepare, and comes down when it sinks, or when
    it is on the ground after a flight.

    Args:
        sensor_plan: plan of the sensor row.
        numbers: numbers of the criterion.
        t: time (s).
        row: sensor row.
        criterion_work: workspace of the criterion, see `JUMP_WORK`.
    """
    height = row[sensor_plan[SENSOR_PLAN.CENTRE] + 1]
    rise = row[sensor_plan[SENSOR_PLAN.RISE]]
    phase = criterion_work[JUMP_WORK.PHASE]
    has_load = row[sensor_plan[SENSOR_PLAN.LOADS]] + row[sensor_plan[SENSOR_PLAN.LOADS] + 1] > 0.0
    criterion_work[JUMP_WORK.HERE], criterion_work[JUMP_WORK.PEAK] = (
        height,
        max(criterion_work[JUMP_WORK.PEAK], height),
    )
    if height < numbers[CRITERION_NUMBERS.HEIGHT] * criterion_work[JUMP_WORK.START]:
        criterion_work[JUMP_WORK.ENDED] = 1.0
    elif phase == JUMP_PHASE.PREPARES:
        if t >= numbers[CRITERION_NUMBERS.PREPARE] and (rise > 0.0 or not has_load):
            criterion_work[JUMP_WORK.PHASE], criterion_work[JUMP_WORK.PREPARED] = (
                JUMP_PHASE.TAKES_OFF,
                height,
            )
    elif phase == JUMP_PHASE.TAKES_OFF and not has_load:
        criterion_work[JUMP_WORK.PHASE] = JUMP_PHASE.FLIES
    elif phase < JUMP_PHASE.COMES_DOWN and (rise < 0.0 or (phase == JUMP_PHASE.FLIES and has_load)):
        criterion_work[JUMP_WORK.PHASE], criterion_work[JUMP_WORK.ENDED] = (
            JUMP_PHASE.COMES_DOWN,
            numbers[CRITERION_NUMBERS.AT_PEAK],
        )


def range_penalty(
    sensor_plan: Ints, criterion_type: int, offset: int, numbers: Floats, row: Floats
) -> float:
    """Return the penalty of a number beyond its range.

    It is linear off + squared off^2, where off is the distance from the range.

    Args:
        sensor_plan: plan of the sensor row.
        criterion_type: NUMBER, LARGEST_LOAD or TOTAL_LOAD of `CRITERION_TYPE`.
        offset: index of the number in the row.
        numbers: numbers of the criterion.
        row: sensor row.
    """
    first_value = row[offset]
    second_value = 0.0
    if criterion_type != CRITERION_TYPE.NUMBER:
        first_value = row[sensor_plan[SENSOR_PLAN.LOADS]]
        second_value = row[sensor_plan[SENSOR_PLAN.LOADS] + 1]
        first_value, second_value = (
            (max(first_value, second_value), 0.0)
            if criterion_type == CRITERION_TYPE.LARGEST_LOAD
            else (first_value, second_value)
        )
    value = numbers[CRITERION_NUMBERS.FACTOR] * (first_value + second_value)
    violation = max(numbers[CRITERION_NUMBERS.LOW] - value, 0.0) + max(
        value - numbers[CRITERION_NUMBERS.HIGH], 0.0
    )
    return numbers[CRITERION_NUMBERS.LINEAR] * violation + numbers[CRITERION_NUMBERS.SQUARED] * (
        violation * violation
    )


def muscle_effort(
    sensor_plan: Ints, sensor_numbers: Floats, criterion_type: int, power: int, row: Floats
) -> float:
    """Return the sum of the activations to a power, or 1 plus the sum of the tensions (N).

    Args:
        sensor_plan: plan of the sensor row.
        sensor_numbers: numbers of the sensor row.
        criterion_type: POWERS or TENSIONS of `CRITERION_TYPE`.
        power: exponent of the activations.
        row: sensor row.
    """
    count = sensor_plan[SENSOR_PLAN.MUSCLES]
    total = 1.0 if criterion_type == CRITERION_TYPE.TENSIONS else 0.0
    strengths = at(sensor_numbers, SENSOR_NUMBERS.HEAD + count)
    for k in range(count):
        contribution = 1.0
        if criterion_type == CRITERION_TYPE.TENSIONS:
            contribution = row[sensor_plan[SENSOR_PLAN.FORCES] + k] * strengths[k]
        else:
            # The exponent is an integer.
            for _ in range(power):
                contribution *= row[sensor_plan[SENSOR_PLAN.ACTIVATIONS] + k]
        total += contribution
    return total


def metabolic_power(
    sensor_plan: Ints, sensor_numbers: Floats, numbers: Floats, row: Floats, excitations: Floats
) -> float:
    """Return the metabolic power of all muscles (W).

    Source: J. M. Wang et al., ACM Trans. Graph. 31, 2012, after F. C. Anderson's thesis of 1999.

    Per muscle the heat of activation is m (40 s sin(pi u / 2) + 133 (1 - s)(1 - cos(pi u / 2))),
    that of maintenance m l (74 s sin(pi a / 2) + 111 (1 - s)(1 - cos(pi a / 2))), with the mass m,
    the part s of slow fibers, excitation u, activation a and a factor l of the fiber length; heat
    of shortening and work are added.

    Args:
        sensor_plan: plan of the sensor row.
        sensor_numbers: numbers of the sensor row.
        numbers: numbers of the criterion.
        row: sensor row.
        excitations: excitations of the muscles.
    """
    count = sensor_plan[SENSOR_PLAN.MUSCLES]
    slow = numbers[CRITERION_NUMBERS.SLOW]
    total = 0.0
    optimal = at(sensor_numbers, SENSOR_NUMBERS.HEAD)
    strengths = at(sensor_numbers, SENSOR_NUMBERS.HEAD + count)
    for k in range(count):
        u = RIGHT_ANGLE * excitations[k]
        a = RIGHT_ANGLE * row[sensor_plan[SENSOR_PLAN.ACTIVATIONS] + k]
        n = row[sensor_plan[SENSOR_PLAN.LENGTHS] + k]
        of_activation = 40.0 * slow * sin(u) + 133.0 * (1.0 - slow) * (1.0 - cos(u))
        of_maintenance = 74.0 * slow * sin(a) + 111.0 * (1.0 - slow) * (1.0 - cos(a))
        # Factor of the fiber length: 1/2 for short fibers, largest at the optimal length, 0 beyond
        # 1.5.
        shape = 0.5 if n < 0.5 else n if n < 1.0 else 3.0 - 2.0 * n if n < 1.5 else 0.0
        shortens = -row[sensor_plan[SENSOR_PLAN.VELOCITIES] + k] * optimal[k]
        # Lengthening fibers take up no heat here, and their negative work is not recovered.
        # Forces of the row are parts of the strength; active forces are in N.
        heat = max(0.0, 0.25 * row[sensor_plan[SENSOR_PLAN.FORCES] + k] * strengths[k] * shortens)
        work = max(0.0, row[sensor_plan[SENSOR_PLAN.ACTIVE] + k] * shortens)
        total += (
            numbers[CRITERION_NUMBERS.MASSES + k] * (of_activation + shape * of_maintenance)
            + heat
            + work
        )
    return BASAL_POWER * sensor_numbers[SENSOR_NUMBERS.MASS] + total
