"""Reflex controllers, sums of delayed terms ``gain * (sensor - offset)`` gated by states of legs.

The integers are a head, `REFLEXES`; per term a `TERM`; per gate the sensors of a coordinate and of
its speed; per sensor its source, `sensors.SOURCE`. The numbers of a candidate are a head, `LIMITS`,
with a part for each leg; per term delay, gain and offset; per gate delay, smallest and largest
value; then those of the sources. Where legs have states, the first two sensors are their loads.
Delays are in control steps. A term without a sensor is ``gain * (t - delay)**power`` from its delay
on, where the time t is in control steps.

The noise of a control step depends on the seed, the number of the step and the number of the noisy
control or sensor only.
"""

from __future__ import annotations

from math import cos, floor, log, pi, sqrt

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.sensors import SOURCE, foot_lead, read_source


class LEG_STATE(metaclass=Record):
    """States of a leg."""

    EARLY_STANCE = 0
    """Leg that carries load with the foot ahead."""
    LATE_STANCE = 1
    """Leg that carries load with the foot behind."""
    LIFTOFF = 2
    """Leg that is being unloaded."""
    SWING = 3
    """Leg without load."""
    LANDING = 4
    """Leg in swing whose foot is far ahead."""
    UNKNOWN = -1
    """Leg before the first control step."""


class TERM_TYPE(metaclass=Record):
    """Types of terms."""

    FREE = 0
    """Term that may have any sign."""
    OF_SENSOR = 1
    """Term with max(sensor - offset, 0)."""
    OF_RESULT = 2
    """Term with max(gain * (sensor - offset), 0)."""


OF_GATE = 2
"""Number of integers of a gate."""
OF_EACH = 3
"""Number of numbers of a term, and of a gate."""
STEP_TOLERANCE = 1e-9
"""A delay this near to whole control steps counts as whole, as it was divided by the step."""


class NOISE(metaclass=Record):
    """Streams of random numbers."""

    CONTROLS = 0
    """Random numbers for controls."""
    SENSORS = 1
    """Random numbers for sensors."""


MASK_32 = 0xFFFFFFFF
"""Mask of 32 bits."""


class REFLEXES(metaclass=Record):
    """Head of the integers of reflexes.

    Attributes:
        TERMS, GATES: numbers of terms and of gates.
        HISTORY_LENGTH, SENSORS: number of control steps that are remembered, and of sensors.
        HAS_STATES: whether legs have states.
        SWINGS_FROM_STANCE: whether a leg may go from stance to swing directly.
        NUMBERS, MEMORY_SIZE: lengths of the numbers and of the memory of a candidate.
        FIRST, ROWS: number of the first control step that is recorded, and of rows of the record.
        IS_NOISY: whether there is noise.
    """

    (
        TERMS,
        GATES,
        HISTORY_LENGTH,
        SENSORS,
        HAS_STATES,
        SWINGS_FROM_STANCE,
        NUMBERS,
        MEMORY_SIZE,
        FIRST,
        ROWS,
        IS_NOISY,
        HEAD,
    ) = range(12)


class TERM(metaclass=Record):
    """Integers of a term.

    Attributes:
        TARGET: control that the term is added to.
        SENSOR: index of the sensor of the term, -1 for none.
        KIND: FREE, OF_SENSOR or OF_RESULT of `TERM_TYPE`; without a sensor the power of time.
        LEG, STATES: leg whose states decide, and these states as bits.
        GATE: number of the gate that may suppress the term, or -1.
    """

    TARGET, SENSOR, KIND, LEG, STATES, GATE, SIZE = range(7)


class LIMITS(metaclass=Record):
    """Head of the numbers of reflexes.

    Attributes:
        DELAY: delay of the loads (control steps); before the parts of the legs.
        STANDS, SWINGS: in the part of a leg the loads over the weight with which it stands and swings.
        LATE, LEAVES, LANDS: how far the foot is ahead in late stance, at liftoff and at landing (m).
        SEED: seed of the noise.
        CONTROL_NOISE, CONTROL_PART: standard deviation of the noise of a control, and per unit of it.
        SENSOR_NOISE, SENSOR_PART: standard deviation of the noise of a sensor, and per unit of it.
    """

    DELAY, STANDS, SWINGS, LATE, LEAVES, LANDS, OF_LEG = 0, 0, 1, 2, 3, 4, 5
    SEED = 1 + 2 * OF_LEG
    CONTROL_NOISE, CONTROL_PART, SENSOR_NOISE, SENSOR_PART, HEAD = range(SEED + 1, SEED + 6)


def record_sensors(
    model: Ints, data: Floats, i: Ints, p: Floats, frames: int, row: Floats, history: Floats
) -> None:
    """Add the current sensors, with noise, to the history.

    Args:
        model: integers of the model.
        data: results of an evaluation.
        i: integers of the reflexes.
        p: numbers of the reflexes.
        frames: number of earlier sensor rows.
        row: sensor row.
        history: ring buffer of sensors; changed.
    """
    sensors = i[REFLEXES.SENSORS]
    newest = at(history, sensors * (frames % i[REFLEXES.HISTORY_LENGTH]))
    sources = at(i, REFLEXES.HEAD + TERM.SIZE * i[REFLEXES.TERMS] + OF_GATE * i[REFLEXES.GATES])
    for k in range(sensors):
        newest[k] = read_source(model, data, at(sources, SOURCE.SIZE * k), p, row)
    if i[REFLEXES.IS_NOISY] > 0:
        for k in range(sensors):
            width = p[LIMITS.SENSOR_NOISE] + p[LIMITS.SENSOR_PART] * abs(newest[k])
            if width > 0.0:
                newest[k] += width * draw_normal(int(p[LIMITS.SEED]), NOISE.SENSORS, frames, k)


def add_noise(i: Ints, p: Floats, step: int, count: int, controls: Floats) -> None:
    """Add noise to the controls of a control step, as SCONE's NoiseController does.

    Args:
        i: integers of the reflexes.
        p: numbers of the reflexes.
        step: number of the control step.
        count: number of controls.
        controls: controls (count,); changed.
    """
    if i[REFLEXES.IS_NOISY] > 0:
        for k in range(count):
            width = p[LIMITS.CONTROL_NOISE] + p[LIMITS.CONTROL_PART] * controls[k]
            if width > 0.0:
                controls[k] += width * draw_normal(int(p[LIMITS.SEED]), NOISE.CONTROLS, step, k)


def interpolate_sensor(i: Ints, frames: int, history: Floats, sensor: int, delay: float) -> float:
    """Return a delayed sensor by linear interpolation; before the start it has its first value.

    Args:
        i: integers of the reflexes.
        frames: number of sensor rows.
        history: ring buffer of sensors.
        sensor: number of the sensor.
        delay: delay (control steps).
    """
    # Before the start a delayed sensor has its first value.
    delay_frames = min(delay, frames - 1.0)
    latest = frames - 1
    full_frames = floor(delay_frames + STEP_TOLERANCE)
    fraction = min(max(delay_frames - full_frames, 0.0), 1.0)
    frame = int(latest - full_frames)
    size, width = i[REFLEXES.HISTORY_LENGTH], i[REFLEXES.SENSORS]
    value = history[width * (frame % size) + sensor]
    # The ring buffer holds HISTORY_LENGTH rows, the newest one at frames - 1.
    earlier_value = history[width * (max(frame - 1, 0) % size) + sensor]
    return value + fraction * (earlier_value - value)


def update_leg_states(
    sensor_plan: Ints, i: Ints, p: Floats, frames: int, row: Floats, history: Floats, legs: Floats
) -> None:
    """Advance the states of two legs by one control step.

    Args:
        sensor_plan: plan of the sensor row.
        i: integers of the reflexes.
        p: numbers of the reflexes.
        frames: number of sensor rows.
        row: sensor row.
        history: ring buffer of sensors.
        legs: states of the legs (2,); changed.
    """
    # Loads are the first two sensors, and are delayed like all others.
    first_load = interpolate_sensor(i, frames, history, 0, p[0])
    second_load = interpolate_sensor(i, frames, history, 1, p[0])
    first_lead, second_lead = foot_lead(sensor_plan, row, 0), foot_lead(sensor_plan, row, 1)
    first_limits = at(p, 1)
    second_limits = at(p, 1 + LIMITS.OF_LEG)
    is_direct = i[REFLEXES.SWINGS_FROM_STANCE] > 0
    states = int(legs[0]), int(legs[1])
    legs[0] = next_leg_state(
        states[0],
        first_limits,
        first_load,
        second_load > second_limits[LIMITS.STANDS],
        first_lead,
        second_lead,
        is_direct,
    )
    legs[1] = next_leg_state(
        states[1],
        second_limits,
        second_load,
        first_load > first_limits[LIMITS.STANDS],
        second_lead,
        first_lead,
        is_direct,
    )


def next_leg_state(
    state: int,
    limits: Floats,
    load: float,
    other_stands: bool,
    foot_offset: float,
    other_foot_offset: float,
    is_direct: bool,
) -> int:
    """Return the next state of a leg.

    Args:
        state: present state of the leg, see `LEG_STATE`.
        limits: numbers of the leg, see `LIMITS`.
        load: ratio of the load on the leg to the body weight.
        other_stands: whether the other leg stands.
        foot_offset: distance of the foot of this leg ahead of the pelvis (m).
        other_foot_offset: distance of the foot of the other leg ahead of the pelvis (m).
        is_direct: whether the leg may go from stance to swing directly.
    """
    stands = load > limits[LIMITS.STANDS]
    swings = load <= limits[LIMITS.SWINGS]
    late = foot_offset < limits[LIMITS.LATE]
    lands = foot_offset > limits[LIMITS.LANDS]
    # Liftoff begins as soon as the other leg stands with its foot ahead.
    follows = other_stands and foot_offset < other_foot_offset
    # The first control step decides by the load alone.
    if state == LEG_STATE.UNKNOWN and not stands:
        return LEG_STATE.LANDING if lands else LEG_STATE.SWING
    if is_direct and swings and LEG_STATE.EARLY_STANCE <= state <= LEG_STATE.LATE_STANCE:
        return LEG_STATE.SWING
    if state <= LEG_STATE.EARLY_STANCE:
        return (
            LEG_STATE.LIFTOFF
            if follows
            else LEG_STATE.LATE_STANCE
            if late
            else LEG_STATE.EARLY_STANCE
        )
    if state == LEG_STATE.LATE_STANCE:
        return (
            LEG_STATE.LIFTOFF
            if follows or foot_offset < limits[LIMITS.LEAVES]
            else LEG_STATE.LATE_STANCE
        )
    if state == LEG_STATE.LIFTOFF:
        return LEG_STATE.SWING if swings else LEG_STATE.LIFTOFF
    if state == LEG_STATE.SWING:
        if stands:
            # A foot that touches behind the other one has stumbled, and stays in swing.
            return LEG_STATE.EARLY_STANCE if foot_offset > other_foot_offset else LEG_STATE.SWING
        return LEG_STATE.LANDING if lands else LEG_STATE.SWING
    return LEG_STATE.EARLY_STANCE if stands else LEG_STATE.LANDING


def add_reflexes(
    i: Ints, p: Floats, frames: int, history: Floats, legs: Floats, result: Floats
) -> None:
    """Add all active terms to the controls.

    Args:
        i: integers of the reflexes.
        p: numbers of the reflexes.
        frames: number of sensor rows.
        history: ring buffer of sensors.
        legs: states of the legs (2,).
        result: controls; changed.
    """
    terms = at(i, REFLEXES.HEAD)
    count = i[REFLEXES.TERMS]
    gates = at(terms, TERM.SIZE * count)
    numbers = at(p, LIMITS.HEAD)
    for k in range(count):
        term, term_numbers = at(terms, TERM.SIZE * k), at(numbers, OF_EACH * k)
        # The states in which a term is active are bits of an integer.
        if term[TERM.STATES] >> int(legs[term[TERM.LEG]]) & 1 == 0:
            continue
        value = term_numbers[1]
        if term[TERM.SENSOR] >= 0:
            gate = term[TERM.GATE]
            # A suppressed term is skipped, without changing the other terms.
            if gate >= 0 and is_suppressed(
                i, at(gates, OF_GATE * gate), at(numbers, OF_EACH * (count + gate)), frames, history
            ):
                continue
            value = (
                interpolate_sensor(i, frames, history, term[TERM.SENSOR], term_numbers[0])
                - term_numbers[2]
            )
            if term[TERM.KIND] == TERM_TYPE.OF_SENSOR:
                value = max(value, 0.0)
            value *= term_numbers[1]
            if term[TERM.KIND] == TERM_TYPE.OF_RESULT:
                value = max(value, 0.0)
        else:
            since = frames - 1.0 - term_numbers[0]
            # The term begins at its delay, up to rounding.
            if since < -STEP_TOLERANCE:
                continue
            for _ in range(term[TERM.KIND]):
                value *= since
        result[term[TERM.TARGET]] += value


def is_suppressed(i: Ints, gate: Ints, gate_numbers: Floats, frames: int, history: Floats) -> bool:
    """Return whether a gate suppresses a term.

    It does if its coordinate is beyond the range and moves further away.

    Args:
        i: integers of the reflexes.
        gate: integers of the gate.
        gate_numbers: numbers of the gate: delay, smallest and largest value.
        frames: number of sensor rows.
        history: ring buffer of sensors.
    """
    value = interpolate_sensor(i, frames, history, gate[0], gate_numbers[0])
    speed = interpolate_sensor(i, frames, history, gate[1], gate_numbers[0])
    return (value < gate_numbers[1] and speed < 0.0) or (value > gate_numbers[2] and speed >= 0.0)


def draw_normal(seed: int, purpose: int, step: int, number: int) -> float:
    """Return a normally distributed number of mean 0 and deviation 1, by the method of Box and Muller.

    Args:
        seed: seed of 64 bits.
        purpose: stream, CONTROLS or SENSORS of `NOISE`.
        step: number of the control step.
        number: number of the control or sensor.
    """
    # A counter-based generator: noise depends on step and number only, not on the order of calls.
    first_word, second_word = philox(
        int(step) & MASK_32, int(number), purpose, 0, seed & MASK_32, (seed >> 32) & MASK_32
    )
    # Add 1 to the first word, since the logarithm of 0 is infinite.
    return sqrt(-2.0 * log((first_word + 1.0) / (MASK_32 + 1.0))) * cos(
        2.0 * pi * second_word / (MASK_32 + 1.0)
    )


def philox(a: int, b: int, c: int, d: int, first_key: int, second_key: int) -> tuple[int, int]:
    """Return the first two words of Philox4x32-10.

    Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011.

    Args:
        a: first word of the counter.
        b: second word.
        c: third word.
        d: fourth word.
        first_key: first word of the key.
        second_key: second word of the key.

    Returns:
        Two words of 32 bits.
    """
    for _ in range(10):
        first_product, second_product = 0xD2511F53 * a, 0xCD9E8D57 * c
        a = ((second_product >> 32) & MASK_32) ^ b ^ first_key
        b = second_product & MASK_32
        c = ((first_product >> 32) & MASK_32) ^ d ^ second_key
        d = first_product & MASK_32
        first_key, second_key = (
            (first_key + 0x9E3779B9) & MASK_32,
            (second_key + 0xBB67AE85) & MASK_32,
        )
    return a, b
