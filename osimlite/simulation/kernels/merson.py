"""A whole motion in one call: Runge-Kutta-Merson with Simbody's error control, reports, events.

The rules are those of Simbody's RungeKuttaMersonIntegrator and AbstractIntegratorRep, rounding for rounding.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from osimlite.simulation.integrators import next_step_size, shortest_step
from osimlite.simulation.kernels.error_control import error_norm, projected, projected_error
from osimlite.simulation.kernels.implicit import (
    ACCEPTED,
    COUNTED_Q,
    COUNTED_U,
    EVALUATED,
    HAS_DERIVATIVE,
    LAST_TIME,
    MEMORY,
    NEXT_STEP,
    REACHED,
)
from osimlite.simulation.kernels.layout import (
    ACCELERATION_STAGE,
    CONSTRAINED,
    CONTACT_WORK,
    CONTACTS,
    FORCE_STAGE,
    LAWS,
    OK,
    POSITION_STAGE,
    STATE_SIZE,
    TIME,
    WORK_CONTACT,
    WORK_STATE,
)
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call
from osimlite.simulation.kernels.points import station
from osimlite.simulation.kernels.states import copy, cubic, is_finite

DONE, FAILED, FULL, STOPPED, TOO_MANY = 0, 1, 2, 3, 4
"""How a run ends: at its limit, at a state beyond which there is no step, with a full log, at an event that stops it,
after as many tried steps as were allowed."""

TIME_OF_EVENT = 1e-9
"""How exactly the time of an event is found on the interpolated motion, s."""

TAKEN, ATTEMPTED, EVALUATIONS, REPORTED, LOGGED, EVENTS = 0, 1, 2, 3, 4, 5
"""Places of the counts."""

COORDINATE, HEIGHT, TOUCH = 0, 1, 2
"""Kinds of watches: on the value of a coordinate, on how far a point lies along a direction, on a contact."""

STATES, ERRORS = 8, 4
"""Room for so many states that a run needs at WORK_STATE, and two numbers for each contact and watch after them."""

LIMIT, ACCURACY = 0, 1
"""Places of the settings: last time (s), and what the norm of the error of a step may be."""

COUNT_Q, COUNT_U, MOST_TRIES, TIMES, MOST_EVENTS, EVENT, WATCHES, MOST_LOGGED = 0, 1, 2, 3, 4, 5, 6, 7
"""Places of the sizes: what the sums of the squared errors of values and of speeds are divided by, steps that may be
tried, how many rows there are and how long the row of an event is."""
START_HOLDS, METHOD, METHOD_AT, SIZES = 8, 9, 10, 11
"""Places of whether the constraints hold at the start, of the address of an implicit method (0 for Merson's) and its
place in the work vector; the count of the sizes."""


class Motion(NamedTuple):
    """What a run works on and writes down; any of the records may have no rows.

    A state has y numbers, see STATE_SIZE.

    Attributes:
        s: the mechanism.
        x: its numbers.
        w: room.
        sizes: see COUNT_Q.
        settings: see LIMIT.
        clock: time and next step to try, s; changed.
        counts: steps taken, tried, evaluations, reports made, steps logged, events; changed. Events beyond the room
            for them are counted only.
        times: of the reports, s (r,).
        reports: states at these times (r, y).
        log: of each step the time, y, f (k, 1 + 2y).
        forces: of each step the force on surface 2 of each pair (k, P, 3).
        events: time, number (of a contact, or P and the number of a watch), 1 if it begins or rises, else 0, and if
            there is room the state (e, 3 or 3 + y).
        peaks: largest force of each pair at the end of a step, and its time (P, 2).
        watches: kind, degree of freedom or link or contact, and -1 or 1 if falling or rising through the level ends the
            run, 0 if neither (w, 3).
        levels: of each watch the station in the link, the direction in ground, and the level (w, 7).
    """

    s: Ints
    x: Floats
    w: Floats
    sizes: Ints
    settings: Floats
    clock: Floats
    counts: Ints
    times: Floats
    reports: Floats
    log: Floats
    forces: Floats
    events: Floats
    peaks: Floats
    watches: Ints
    levels: Floats


def run_several(
    s: Ints,
    x: Floats,
    w: Floats,
    each: int,
    sizes: Ints,
    settings: Floats,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    times: Floats,
    reports: Floats,
    log: Floats,
    forces: Floats,
    events: Floats,
    peaks: Floats,
    watches: Ints,
    levels: Floats,
    endings: Ints,
    first: int,
    last: int,
) -> int:
    """The runs `first` to `last` - 1, each on its own rows.

    Args: as of `Motion`, one row for each run; a log, `w` and what tells how to run serve them all. `each` is the
    length of a row of numbers, 0 if one serves them all.
    """
    size, pairs = s[STATE_SIZE], s[CONTACTS]
    for k in range(first, last):
        m = Motion(
            s,
            at(x, each * k),
            w,
            sizes,
            settings,
            at(clocks, 2 * k),
            at(counts, 6 * k),
            times,
            at(reports, k * sizes[TIMES] * size),
            log,
            forces,
            at(events, sizes[EVENT] * k * sizes[MOST_EVENTS]),
            at(peaks, 2 * k * pairs),
            watches,
            levels,
        )
        endings[k] = run(m, at(states, k * size))
    return OK


def evaluated(m: Motion, t: float, y: Floats, f: Floats, stage: int) -> int:
    """Evaluate at a time."""
    m.w[TIME] = t
    return call(m.s[LAWS], m.s, m.x, m.w, y, f, stage)


def run(m: Motion, y: Floats) -> int:
    """Go on from the state y, which is changed, until something ends the run."""
    s, counts, clock, sizes = m.s, m.counts, m.clock, m.sizes
    size = s[STATE_SIZE]
    room = at(m.w, s[WORK_STATE])
    y0, f0, y1, f1 = room, at(room, size), at(room, 2 * size), at(room, 3 * size)
    before = at(room, STATES * size)
    after = at(before, s[CONTACTS] + sizes[WATCHES])
    limit = m.settings[LIMIT]
    tolerance = m.settings[ACCURACY] / 10.0
    is_kept = s[CONSTRAINED] == 0 or sizes[START_HOLDS] > 0
    if not is_kept and not projected(s, m.x, m.w, clock[0], y, f0, 0, tolerance, inf):
        return FAILED
    copy(size, y, y0)
    status = evaluated(m, clock[0], y0, f0, ACCELERATION_STAGE)
    if counts[TAKEN] == 0 and counts[EVALUATIONS] == 0:
        counts[EVALUATIONS] = 1
        if sizes[METHOD] > 0:
            m.w[sizes[METHOD_AT] + MEMORY] = 0.0
    if status != OK or not is_finite(size, f0):
        return FAILED
    levels_at(m, y0, before)
    note_peaks(m, clock[0])
    while counts[REPORTED] < sizes[TIMES] and m.times[counts[REPORTED]] <= clock[0]:
        copy(size, y0, at(m.reports, size * counts[REPORTED]))
        counts[REPORTED] += 1
    while clock[0] < limit:
        if sizes[MOST_LOGGED] > 0 and sizes[MOST_LOGGED] == counts[LOGGED]:
            return FULL
        t0 = clock[0]
        t1 = step(m, t0, y0, f0, y1) if sizes[METHOD] == 0 else implicit_step(m, t0, y0, y1)
        if t1 <= t0:
            return FAILED if t1 < t0 else TOO_MANY
        if not is_evaluated(m, t1, y1, f1):
            # Simbody ends here; smaller steps lead nearer to where the motion ends.
            if t1 - t0 <= shortest_step(t0, counts[ATTEMPTED]):
                return FAILED
            clock[1] = max(0.1 * (t1 - t0), shortest_step(t0, counts[ATTEMPTED]))
            if sizes[METHOD] > 0:
                m.w[sizes[METHOD_AT] + MEMORY] = 0.0
            continue
        counts[TAKEN] += 1
        clock[0] = t1
        note_peaks(m, t1)
        if sizes[MOST_LOGGED] > 0:
            note_step(m, t1, y1, f1)
        end, stopped = t1, False
        if sizes[MOST_EVENTS] > 0 or sizes[WATCHES] > 0:
            levels_at(m, y1, after)
            end = note_events(m, t0, y0, f0, t1, y1, f1, before, after)
            stopped = end <= t1
            end = min(end, t1)
            copy(s[CONTACTS] + sizes[WATCHES], after, before)
        while counts[REPORTED] < sizes[TIMES] and m.times[counts[REPORTED]] <= end:
            t, report = m.times[counts[REPORTED]], at(m.reports, size * counts[REPORTED])
            if t == t1:
                copy(size, y1, report)
            else:
                inside(m, t0, y0, f0, t1, y1, f1, t, report)
            counts[REPORTED] += 1
        if stopped:
            if end < t1:
                inside(m, t0, y0, f0, t1, y1, f1, end, y)
            else:
                copy(size, y1, y)
            clock[0] = end
            return STOPPED
        y0, y1 = y1, y0
        f0, f1 = f1, f0
        copy(size, y0, y)
    return DONE


def is_evaluated(m: Motion, t1: float, y1: Floats, f1: Floats) -> bool:
    """Whether the end of a step has a derivative, which an implicit method has found where no forces are looked at."""
    is_looked_at = m.sizes[METHOD] == 0 or m.s[CONTACTS] + m.sizes[WATCHES] > 0
    if not is_looked_at and m.w[m.sizes[METHOD_AT] + HAS_DERIVATIVE] > 0.0:
        return is_finite(m.s[STATE_SIZE], f1)
    m.counts[EVALUATIONS] += 1
    return evaluated(m, t1, y1, f1, ACCELERATION_STAGE) == OK and is_finite(m.s[STATE_SIZE], f1)


def implicit_step(m: Motion, t0: float, y0: Floats, y1: Floats) -> float:
    """The same as `step` with a method that chooses its steps by itself, see :mod:`.implicit`."""
    counts, clock, settings, sizes = m.counts, m.clock, m.settings, m.sizes
    h, smallest = at(m.w, sizes[METHOD_AT]), shortest_step(t0, counts[ATTEMPTED])
    h[REACHED], h[LAST_TIME], h[NEXT_STEP], h[ACCEPTED] = t0, settings[LIMIT], clock[1], settings[ACCURACY]
    h[COUNTED_Q], h[COUNTED_U] = sizes[COUNT_Q], sizes[COUNT_U]
    while counts[ATTEMPTED] < sizes[MOST_TRIES]:
        counts[ATTEMPTED] += 1
        call(sizes[METHOD], m.s, m.x, m.w, y0, y1, sizes[METHOD_AT])
        counts[EVALUATIONS] += int(h[EVALUATED])
        clock[1] = h[NEXT_STEP]
        if h[REACHED] > t0:
            return float(h[REACHED])
        if h[NEXT_STEP] <= smallest or not t0 + h[NEXT_STEP] > t0:
            return t0 - 1.0
    return t0


def step(m: Motion, t0: float, y0: Floats, f0: Floats, y1: Floats) -> float:
    """Find a step whose error is small enough: y1 and the time of its end; t0 - 1 if there is none, t0 if too many."""
    counts, clock, settings, sizes, size = m.counts, m.clock, m.settings, m.sizes, m.s[STATE_SIZE]
    errors = at(m.w, m.s[WORK_STATE] + ERRORS * size)
    limit, accuracy, smallest = settings[LIMIT], settings[ACCURACY], shortest_step(t0, counts[ATTEMPTED])
    while True:
        if counts[ATTEMPTED] >= sizes[MOST_TRIES]:
            return t0
        h = float(clock[1])
        # A step that all but reaches the limit goes there. One cut much shorter tells nothing about the next.
        t1 = limit if limit <= t0 + 1.001 * h else t0 + h
        cut = limit < t0 + 0.95 * h
        counts[ATTEMPTED] += 1
        counts[EVALUATIONS] += 4
        error, count_q, count_u = inf, sizes[COUNT_Q], sizes[COUNT_U]
        if merson(m, t0, t1, y0, f0, y1, errors) == OK:
            error = error_norm(m.s, y0, errors, count_q, count_u, 0)
        # As in Simbody: what half a step would not mend, neither does the projection.
        if m.s[CONSTRAINED] > 0 and error <= 16.0 * accuracy:
            error = projected_error(m.s, m.x, m.w, t1, y0, y1, errors, accuracy, count_q, count_u, 0)
        clock[1] = next_step_size(h, error, accuracy, cut)
        if error <= accuracy:
            return t1
        if h <= smallest:
            return t0 - 1.0
        clock[1] = max(clock[1], smallest)


def merson(m: Motion, t0: float, t1: float, y0: Floats, f0: Floats, y1: Floats, ya: Floats) -> int:
    """One step of Merson's method to y1; `ya`, which has room for the stages after it, holds its errors then."""
    size = m.s[STATE_SIZE]
    fa, fb, fc = at(ya, size), at(ya, 2 * size), at(ya, 3 * size)
    h = t1 - t0
    for stage in range(4):
        # Where the next evaluation is to be.
        f, t = fa, t1
        if stage == 0:
            c = h / 3.0
            t = t0 + c
            for k in range(size):
                ya[k] = y0[k] + c * f0[k]
        elif stage == 1:
            c, f, t = h / 6.0, fb, t0 + h / 3.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] + fa[k])
        elif stage == 2:
            c, f, t = h / 8.0, fc, t0 + h / 2.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] + 3.0 * fb[k])
        else:
            # Its error is of one order less than that of y1.
            c = h / 2.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] - 3.0 * fb[k] + 4.0 * fc[k])
        status = evaluated(m, t, ya, f, ACCELERATION_STAGE)
        if status != OK:
            return status
    c = h / 6.0
    for k in range(size):
        y1[k] = y0[k] + c * (f0[k] + 4.0 * fc[k] + fa[k])
        # The fifth is taken of each entry, not of the norm: so every rounding is Simbody's, and its steps too.
        ya[k] = 0.2 * (y1[k] - ya[k])
    return OK


def inside(
    m: Motion, t0: float, y0: Floats, f0: Floats, t1: float, y1: Floats, f1: Floats, t: float, y: Floats
) -> None:
    """State y at a time within a step, where the constraints hold if it can be moved there."""
    cubic(m.s[STATE_SIZE], t0, y0, f0, t1, y1, f1, t, y)
    if m.s[CONSTRAINED] > 0:
        projected(m.s, m.x, m.w, t, y, y, 0, m.settings[ACCURACY] / 10.0, inf)


def note_peaks(m: Motion, t: float) -> None:
    """Keep the largest forces."""
    for pair in range(m.s[CONTACTS]):
        c, peak = at(m.w, m.s[WORK_CONTACT] + CONTACT_WORK * pair), at(m.peaks, 2 * pair)
        size = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if size > peak[0]:
            peak[0], peak[1] = size, t


def note_step(m: Motion, t: float, y: Floats, f: Floats) -> None:
    """Write a step into the log."""
    size, row = m.s[STATE_SIZE], m.counts[LOGGED]
    log = at(m.log, (1 + 2 * size) * row)
    log[0] = t
    copy(size, y, at(log, 1))
    copy(size, f, at(log, 1 + size))
    for pair in range(m.s[CONTACTS]):
        copy(3, at(m.w, m.s[WORK_CONTACT] + CONTACT_WORK * pair), at(m.forces, 3 * (m.s[CONTACTS] * row + pair)))
    m.counts[LOGGED] += 1


def levels_at(m: Motion, y: Floats, levels: Floats) -> None:
    """Fill levels: of each contact 1 if it pushes, else -1; of each watch how far it is above its level."""
    pairs = m.s[CONTACTS]
    for pair in range(pairs):
        c = at(m.w, m.s[WORK_CONTACT] + CONTACT_WORK * pair)
        levels[pair] = 1.0 if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0 else -1.0
    for number in range(m.sizes[WATCHES]):
        watch, a = at(m.watches, 3 * number), at(m.levels, 7 * number)
        if watch[0] == COORDINATE:
            levels[pairs + number] = y[watch[1]] - a[6]
        elif watch[0] == TOUCH:
            levels[pairs + number] = levels[watch[1]]
        else:
            px, py, pz = station(m.s, m.w, watch[1], a[0], a[1], a[2])
            levels[pairs + number] = px * a[3] + py * a[4] + pz * a[5] - a[6]


def note_events(
    m: Motion,
    t0: float,
    y0: Floats,
    f0: Floats,
    t1: float,
    y1: Floats,
    f1: Floats,
    before: Floats,
    after: Floats,
) -> float:
    """Write down what began and ended within a step; returns the time at which the run is to stop, or infinity."""
    counts, events = m.counts, m.events
    size, pairs = m.s[STATE_SIZE], m.s[CONTACTS]
    stop, first, total, event = inf, counts[EVENTS], pairs + m.sizes[WATCHES], m.sizes[EVENT]
    ya = at(m.w, m.s[WORK_STATE] + 4 * size)
    fa, found = at(ya, size), at(after, total)
    for number in range(total):
        rises = after[number] > 0.0
        if rises == (before[number] > 0.0):
            continue
        low, high = t0, t1
        while high - low > TIME_OF_EVENT:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            inside(m, t0, y0, f0, t1, y1, f1, middle, ya)
            touch = number < pairs or m.watches[3 * (number - pairs)] == TOUCH
            evaluated(m, middle, ya, fa, FORCE_STAGE if touch else POSITION_STAGE)
            levels_at(m, ya, found)
            if (found[number] > 0.0) == rises:
                high = middle
            else:
                low = middle
        t = 0.5 * (low + high)
        if number >= pairs and m.watches[3 * (number - pairs) + 2] == (1 if rises else -1):
            t = high
            stop = min(stop, t)
        row = insert(m, first, t, number, rises)
        if row < m.sizes[MOST_EVENTS] and event > 3:
            inside(m, t0, y0, f0, t1, y1, f1, t, at(events, event * row + 3))
    # What lies behind the end of the run has not happened.
    while counts[EVENTS] > first and counts[EVENTS] <= m.sizes[MOST_EVENTS]:
        if events[event * (counts[EVENTS] - 1)] <= stop:
            break
        counts[EVENTS] -= 1
    return stop


def insert(m: Motion, first: int, t: float, number: int, rises: bool) -> int:
    """Put an event among those of its step, by time; returns its row, which may lie beyond the room."""
    row, events, length = int(m.counts[EVENTS]), m.events, m.sizes[EVENT]
    m.counts[EVENTS] += 1
    if row >= m.sizes[MOST_EVENTS]:
        return row
    while row > first and events[length * (row - 1)] > t:
        copy(length, at(events, length * (row - 1)), at(events, length * row))
        row -= 1
    event = at(events, length * row)
    event[0], event[1], event[2] = t, number, 1.0 if rises else 0.0
    return row
