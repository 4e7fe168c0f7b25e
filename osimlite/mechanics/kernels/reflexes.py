"""Reflexes: sums of terms ``gain * (sensor - offset)`` with a delay, each on while a leg is in some states.

The integers are a head, `REFLEXES`; of each term `TERM`; of each gate the sensors of a coordinate
and of its speed; of each sensor what it feels, `sensors.SOURCE`. The numbers of a candidate are a
head, `LIMITS`, in which each leg has its own; of each term delay, gain and offset; of each gate
delay, least and largest value; those of sources. Where legs have states the first two sensors feel
their loads. Delays are in control steps. A term without a sensor is ``gain * (t - delay)**power``
from its delay on, with the time t in control steps.

Noise is drawn anew at each control step, from a seed, the number of the step and that of what is
noisy alone.
"""

from __future__ import annotations

from math import cos, floor, log, pi, sqrt

from osimlite.mechanics.kernels.layout import Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at
from osimlite.mechanics.kernels.sensors import SOURCE, ahead, felt

EARLY_STANCE, LATE_STANCE, LIFTOFF, SWING, LANDING = range(5)
"""States of a leg."""
UNKNOWN = -1
FREE, OF_SENSOR, OF_RESULT = 0, 1, 2
"""What of a term may not be negative: nothing, how far its sensor is above its offset, or what comes of that."""
OF_GATE = 2
"""Integers of a gate."""
OF_EACH = 3
"""Numbers of a term, and of a gate."""
NEAR = 1e-9
"""A delay of whole control steps is one, whatever it was divided to."""

OF_CONTROLS, OF_SENSORS = 0, 1
"""Noise that is apart."""
WORD = 0xFFFFFFFF


class REFLEXES(metaclass=Record):
    """Counts of terms and gates, how many control steps and sensors are remembered, whether legs
    have states, whether these go from stance to swing at once; how many numbers, and how much room,
    each candidate has; number of the first control step that is recorded, and of rows of the
    record; whether there is noise.
    """

    (
        TERMS,
        GATES,
        KEPT,
        SENSORS,
        HAS_STATES,
        SWINGS_FROM_STANCE,
        NUMBERS,
        ROOM,
        FIRST,
        ROWS,
        IS_NOISY,
        HEAD,
    ) = range(12)


class TERM(metaclass=Record):
    """Muscle, sensor (-1 for none), what may not be negative (without a sensor the power of time),
    the leg whose states decide, these as bits, and the number of what may suppress it or -1.
    """

    TARGET, SENSOR, KIND, LEG, STATES, GATE, SIZE = range(7)


class LIMITS(metaclass=Record):
    """Delay of the loads; of each leg the loads with which it stands and swings, and how far the
    foot is ahead in late stance, at liftoff and at landing, m; a seed, and standard deviations of
    the noise of controls and of sensors: at least, and as part of what is noisy.
    """

    DELAY, STANDS, SWINGS, LATE, LEAVES, LANDS, OF_LEG = 0, 0, 1, 2, 3, 4, 5
    SEED = 1 + 2 * OF_LEG
    CONTROL_NOISE, CONTROL_PART, SENSOR_NOISE, SENSOR_PART, HEAD = range(SEED + 1, SEED + 6)


def note_senses(
    model: Ints, data: Floats, i: Ints, p: Floats, frames: int, row: Floats, history: Floats
) -> None:
    """Remember what is felt after so many rows."""
    sensors = i[REFLEXES.SENSORS]
    kept = at(history, sensors * (frames % i[REFLEXES.KEPT]))
    sources = at(i, REFLEXES.HEAD + TERM.SIZE * i[REFLEXES.TERMS] + OF_GATE * i[REFLEXES.GATES])
    for k in range(sensors):
        kept[k] = felt(model, data, at(sources, SOURCE.SIZE * k), p, row)
    if i[REFLEXES.IS_NOISY] > 0:
        for k in range(sensors):
            width = p[LIMITS.SENSOR_NOISE] + p[LIMITS.SENSOR_PART] * abs(kept[k])
            if width > 0.0:
                kept[k] += width * normal(int(p[LIMITS.SEED]), OF_SENSORS, frames, k)


def add_noise(i: Ints, p: Floats, step: int, count: int, controls: Floats) -> None:
    """Add noise to controls at a control step, as SCONE's NoiseController does."""
    if i[REFLEXES.IS_NOISY] > 0:
        for k in range(count):
            width = p[LIMITS.CONTROL_NOISE] + p[LIMITS.CONTROL_PART] * controls[k]
            if width > 0.0:
                controls[k] += width * normal(int(p[LIMITS.SEED]), OF_CONTROLS, step, k)


def felt_before(i: Ints, frames: int, history: Floats, sensor: int, delay: float) -> float:
    """A sensor as it was; before the beginning all was as at the beginning."""
    back, latest = min(delay, frames - 1.0), frames - 1
    whole = floor(back + NEAR)
    part = min(max(back - whole, 0.0), 1.0)
    near = int(latest - whole)
    size, width = i[REFLEXES.KEPT], i[REFLEXES.SENSORS]
    value = history[width * (near % size) + sensor]
    other = history[width * (max(near - 1, 0) % size) + sensor]
    return value + part * (other - value)


def go_on(
    senses: Ints, i: Ints, p: Floats, frames: int, row: Floats, history: Floats, legs: Floats
) -> None:
    """The states of two legs after a control step."""
    one, two = felt_before(i, frames, history, 0, p[0]), felt_before(i, frames, history, 1, p[0])
    first, second = ahead(senses, row, 0), ahead(senses, row, 1)
    of_one, of_two, is_direct = (
        at(p, 1),
        at(p, 1 + LIMITS.OF_LEG),
        i[REFLEXES.SWINGS_FROM_STANCE] > 0,
    )
    states = int(legs[0]), int(legs[1])
    legs[0] = after(states[0], of_one, one, two > of_two[LIMITS.STANDS], first, second, is_direct)
    legs[1] = after(states[1], of_two, two, one > of_one[LIMITS.STANDS], second, first, is_direct)


def after(
    state: int,
    limits: Floats,
    load: float,
    other_stands: bool,
    here: float,
    other: float,
    is_direct: bool,
) -> int:
    """The state of a leg that follows.

    Args:
        state: that it was in.
        limits: of the leg.
        load: on it, over the weight.
        other_stands: whether the other one stands.
        here: how far its foot is ahead, m.
        other: how far that of the other is.
        is_direct: whether it may go from stance to swing.
    """
    stands, swings = load > limits[LIMITS.STANDS], load <= limits[LIMITS.SWINGS]
    late, lands = here < limits[LIMITS.LATE], here > limits[LIMITS.LANDS]
    follows = other_stands and here < other
    if state == UNKNOWN and not stands:
        return LANDING if lands else SWING
    if is_direct and swings and EARLY_STANCE <= state <= LATE_STANCE:
        return SWING
    if state <= EARLY_STANCE:
        return LIFTOFF if follows else LATE_STANCE if late else EARLY_STANCE
    if state == LATE_STANCE:
        return LIFTOFF if follows or here < limits[LIMITS.LEAVES] else LATE_STANCE
    if state == LIFTOFF:
        return SWING if swings else LIFTOFF
    if state == SWING:
        if stands:
            return EARLY_STANCE if here > other else SWING
        return LANDING if lands else SWING
    return EARLY_STANCE if stands else LANDING


def add_reflexes(
    i: Ints, p: Floats, frames: int, history: Floats, legs: Floats, result: Floats
) -> None:
    """Add what all terms that are on excite muscles by."""
    terms, count = at(i, REFLEXES.HEAD), i[REFLEXES.TERMS]
    gates, numbers = at(terms, TERM.SIZE * count), at(p, LIMITS.HEAD)
    for k in range(count):
        term, own = at(terms, TERM.SIZE * k), at(numbers, OF_EACH * k)
        if term[TERM.STATES] >> int(legs[term[TERM.LEG]]) & 1 == 0:
            continue
        value = own[1]
        if term[TERM.SENSOR] >= 0:
            gate = term[TERM.GATE]
            if gate >= 0 and is_closed(
                i, at(gates, OF_GATE * gate), at(numbers, OF_EACH * (count + gate)), frames, history
            ):
                continue
            value = felt_before(i, frames, history, term[TERM.SENSOR], own[0]) - own[2]
            if term[TERM.KIND] == OF_SENSOR:
                value = max(value, 0.0)
            value *= own[1]
            if term[TERM.KIND] == OF_RESULT:
                value = max(value, 0.0)
        else:
            since = frames - 1.0 - own[0]
            if since < -NEAR:
                continue
            for _ in range(term[TERM.KIND]):
                value *= since
        result[term[TERM.TARGET]] += value


def is_closed(i: Ints, gate: Ints, own: Floats, frames: int, history: Floats) -> bool:
    """Whether a coordinate is beyond a range and moves further."""
    value = felt_before(i, frames, history, gate[0], own[0])
    speed = felt_before(i, frames, history, gate[1], own[0])
    return (value < own[1] and speed < 0.0) or (value > own[2] and speed >= 0.0)


def normal(seed: int, what: int, step: int, number: int) -> float:
    """A number of a normal distribution of mean 0 and deviation 1, by the method of Box and Muller."""
    one, two = philox(int(step) & WORD, int(number), what, 0, seed & WORD, (seed >> 32) & WORD)
    return sqrt(-2.0 * log((one + 1.0) / (WORD + 1.0))) * cos(2.0 * pi * two / (WORD + 1.0))


def philox(a: int, b: int, c: int, d: int, key: int, other: int) -> tuple[int, int]:
    """The first two words of Philox4x32-10 (J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC 2011).

    Args:
        a, b, c, d: words of the counter.
        key, other: of the key.
    """
    for _ in range(10):
        one, two = 0xD2511F53 * a, 0xCD9E8D57 * c
        a, b = ((two >> 32) & WORD) ^ b ^ key, two & WORD
        c, d = ((one >> 32) & WORD) ^ d ^ other, one & WORD
        key, other = (key + 0x9E3779B9) & WORD, (other + 0xBB67AE85) & WORD
    return a, b
