"""A whole motion in one call: Runge-Kutta-Merson with Simbody's error control, reports, events.

The steps are those of :class:`osimlite.simulation.integrators.RungeKuttaMerson`, rounding for rounding.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np

from osimlite.simulation.integrators import next_step_size
from osimlite.simulation.kernels.arrays import Floats, Ints, Numbers, Structure, Work, numbers_of, work_for
from osimlite.simulation.kernels.dynamics import contacts_at, evaluate, station
from osimlite.simulation.kernels.motion import FINE, SINGULAR_MASS, place

DONE, FAILED, FULL, STOPPED, TOO_MANY = 0, 1, 2, 3, 4
"""How a run ends: at its limit, at a state beyond which there is no step, with a full log, at an event that stops it,
after as many tried steps as were allowed."""

TIME_OF_EVENT = 1e-9
"""How exactly the time of an event is found on the interpolated motion, s."""

TAKEN, ATTEMPTED, EVALUATIONS, REPORTED, LOGGED, EVENTS = 0, 1, 2, 3, 4, 5
"""Places of the counts."""

COORDINATE, HEIGHT, TOUCH = 0, 1, 2
"""Kinds of watches: on the value of a coordinate, on how far a point lies along a direction, on a contact."""


class Control(NamedTuple):
    """How to run.

    Attributes:
        limit: last time, s.
        accuracy: as of `RungeKuttaMerson`, like the next four.
        most_tries: steps that may be tried.
    """

    limit: float
    accuracy: float
    maximum_step: float
    minimum_step: float
    count_q: int
    count_u: int
    most_tries: int


class Records(NamedTuple):
    """What a run writes down; any of these may have no rows.

    Attributes:
        times: of the reports, s (r,).
        states: at these times (r, 2n).
        log: of each step the time, y, f (k, 1 + 4n).
        forces: of each step the force on surface 2 of each pair (k, P, 3).
        events: time, number (of a contact, or P and the number of a watch), 1 if it begins or rises, else 0, and if
            there is room the state (e, 3 or 3 + 2n).
        peaks: largest force of each pair at the end of a step, and its time (P, 2).
        watches: kind, degree of freedom or link or contact, and -1 or 1 if falling or rising through the level ends the
            run, 0 if neither (w, 3).
        levels: of each watch the station in the link, the direction in ground, and the level (w, 7).
    """

    times: Floats
    states: Floats
    log: Floats
    forces: Floats
    events: Floats
    peaks: Floats
    watches: Ints
    levels: Floats


def run(
    s: Structure, vector: Floats, clock: Floats, counts: Ints, y: Floats, control: Control, records: Records
) -> int:
    """Go on from the state y until something ends the run.

    Args:
        s: the mechanism.
        vector: its numbers.
        clock: time and next step to try, s; changed.
        counts: steps taken, tried, evaluations, reports made, steps logged, events; changed. Events beyond the room
            for them are counted only.
        y: the state (2n,); changed.
        control: how.
        records: what to write down.
    """
    x, w, n = numbers_of(s, vector), work_for(s), len(s.above)
    size = 2 * n
    y0, f0, y1, f1 = y.copy(), np.zeros(size), np.zeros(size), np.zeros(size)
    stages = np.zeros((5, size))
    pairs, watching = len(s.pair_kind), len(records.watches)
    before, after = np.zeros(pairs + watching), np.zeros(pairs + watching)
    status = evaluate(s, x, w, y0, f0)
    if counts[TAKEN] == 0 and counts[EVALUATIONS] == 0:
        counts[EVALUATIONS] = 1
    if status != FINE or not is_finite(f0):
        return FAILED
    levels_at(s, x, w, y0, records, before)
    note_peaks(w, records, clock[0])
    while counts[REPORTED] < len(records.times) and records.times[counts[REPORTED]] <= clock[0]:
        records.states[counts[REPORTED]] = y0
        counts[REPORTED] += 1
    while clock[0] < control.limit:
        if 0 < len(records.log) == counts[LOGGED]:
            return FULL
        t0 = clock[0]
        t1 = step(s, x, w, t0, y0, f0, y1, stages, clock, counts, control)
        if t1 <= t0:
            return FAILED if t1 < t0 else TOO_MANY
        counts[EVALUATIONS] += 1
        if evaluate(s, x, w, y1, f1) != FINE or not is_finite(f1):
            return FAILED
        counts[TAKEN] += 1
        clock[0] = t1
        note_peaks(w, records, t1)
        if len(records.log) > 0:
            note_step(w, records, counts[LOGGED], t1, y1, f1)
            counts[LOGGED] += 1
        end, stopped = t1, False
        if len(records.events) > 0 or watching > 0:
            levels_at(s, x, w, y1, records, after)
            end = note_events(s, x, w, t0, y0, f0, t1, y1, f1, before, after, stages, counts, records)
            stopped = end <= t1
            end = min(end, t1)
            before[:] = after
        while counts[REPORTED] < len(records.times) and records.times[counts[REPORTED]] <= end:
            report = counts[REPORTED]
            if records.times[report] == t1:
                records.states[report] = y1
            else:
                cubic(t0, y0, f0, t1, y1, f1, records.times[report], records.states[report])
            counts[REPORTED] += 1
        if stopped:
            if end < t1:
                cubic(t0, y0, f0, t1, y1, f1, end, y)
            else:
                y[:] = y1
            clock[0] = end
            return STOPPED
        y0, y1 = y1, y0
        f0, f1 = f1, f0
        y[:] = y0
    return DONE


def step(
    s: Structure,
    x: Numbers,
    w: Work,
    t0: float,
    y0: Floats,
    f0: Floats,
    y1: Floats,
    stages: Floats,
    clock: Floats,
    counts: Ints,
    control: Control,
) -> float:
    """Find a step whose error is small enough: y1 and the time of its end; t0 - 1 if there is none, t0 if too many."""
    n = len(s.above)
    smallest = max(control.minimum_step, 4.0 * 2.0**-52 * max(1.0, abs(t0)))
    while True:
        if counts[ATTEMPTED] >= control.most_tries:
            return t0
        h = clock[1]
        # A step that all but reaches the limit goes there. One cut much shorter tells nothing about the next.
        t1 = control.limit if control.limit <= t0 + 1.001 * h else t0 + h
        cut = control.limit < t0 + 0.95 * h
        counts[ATTEMPTED] += 1
        counts[EVALUATIONS] += 4
        status = merson(s, x, w, t1 - t0, y0, f0, y1, stages)
        if status == SINGULAR_MASS:
            return t0 - 1.0
        error = norm(n, y0, y1, stages[4], control) if status == FINE else inf
        clock[1] = min(next_step_size(h, error, control.accuracy, cut), control.maximum_step)
        if error <= control.accuracy:
            return t1
        if h <= smallest:
            return t0 - 1.0
        clock[1] = max(clock[1], smallest)


def merson(s: Structure, x: Numbers, w: Work, h: float, y0: Floats, f0: Floats, y1: Floats, stages: Floats) -> int:
    """One step of Merson's method; the companion of y1 is the last stage."""
    ya, fa, fb, fc, companion = stages[0], stages[1], stages[2], stages[3], stages[4]
    size = len(y0)
    c = h / 3.0
    for k in range(size):
        ya[k] = y0[k] + c * f0[k]
    status = attempt(s, x, w, ya, fa)
    if status != FINE:
        return status
    c = h / 6.0
    for k in range(size):
        ya[k] = y0[k] + c * (f0[k] + fa[k])
    status = attempt(s, x, w, ya, fb)
    if status != FINE:
        return status
    c = h / 8.0
    for k in range(size):
        ya[k] = y0[k] + c * (f0[k] + 3.0 * fb[k])
    status = attempt(s, x, w, ya, fc)
    if status != FINE:
        return status
    c = h / 2.0
    for k in range(size):
        companion[k] = y0[k] + c * (f0[k] - 3.0 * fb[k] + 4.0 * fc[k])
    status = attempt(s, x, w, companion, fa)
    c = h / 6.0
    for k in range(size):
        y1[k] = y0[k] + c * (f0[k] + 4.0 * fc[k] + fa[k])
    return status


def attempt(s: Structure, x: Numbers, w: Work, y: Floats, f: Floats) -> int:
    """Evaluate within a step, where a state that is not finite only makes the step smaller."""
    status = evaluate(s, x, w, y, f)
    return -1 if status == SINGULAR_MASS and not is_finite(y) else status


def norm(n: int, y0: Floats, y1: Floats, companion: Floats, control: Control) -> float:
    """Larger of two root mean squares: errors of q as they are, of u relative to u at the start where |u| > 1."""
    of_q = of_u = 0.0
    for k in range(n):
        e = 0.2 * (y1[k] - companion[k])
        of_q += e * e
    for k in range(n, 2 * n):
        size = abs(y0[k])
        weighted = (1.0 / size if size > 1.0 else 1.0) * (0.2 * (y1[k] - companion[k]))
        of_u += weighted * weighted
    of_q /= max(control.count_q, 1)
    of_u /= max(control.count_u, 1)
    return sqrt(max(of_q, of_u)) if isfinite(of_q + of_u) else inf


def is_finite(values: Floats) -> bool:
    """Whether all are."""
    total = 0.0
    for value in values:
        total += value
    return total - total == 0.0


def cubic(t0: float, y0: Floats, f0: Floats, t1: float, y1: Floats, f1: Floats, t: float, y: Floats) -> None:
    """State y at a time within a step, on the cubic Hermite polynomial through its ends."""
    h = t1 - t0
    z = (t - t0) / h
    b1 = z * z * (3.0 - 2.0 * z)
    b0 = 1.0 - b1
    c = h * z * (z - 1.0)
    c1 = c * z
    c0 = c1 - c
    for k in range(len(y)):
        y[k] = b0 * y0[k] + b1 * y1[k] + c0 * f0[k] + c1 * f1[k]


def note_peaks(w: Work, records: Records, t: float) -> None:
    """Keep the largest forces."""
    for pair in range(len(records.peaks)):
        c = w.contacts[pair]
        size = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if size > records.peaks[pair, 0]:
            records.peaks[pair, 0], records.peaks[pair, 1] = size, t


def note_step(w: Work, records: Records, row: int, t: float, y: Floats, f: Floats) -> None:
    """Write a step into the log."""
    size = len(y)
    log = records.log[row]
    log[0] = t
    for k in range(size):
        log[1 + k], log[1 + size + k] = y[k], f[k]
    for pair in range(len(w.contacts)):
        for k in range(3):
            records.forces[row, pair, k] = w.contacts[pair, k]


def levels_at(s: Structure, x: Numbers, w: Work, y: Floats, records: Records, levels: Floats) -> None:
    """Fill levels: of each contact 1 if it pushes, else -1; of each watch how far it is above its level."""
    pairs = len(w.contacts)
    for pair in range(pairs):
        c = w.contacts[pair]
        levels[pair] = 1.0 if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0 else -1.0
    for number in range(len(records.watches)):
        kind, index, a = records.watches[number, 0], records.watches[number, 1], records.levels[number]
        if kind == COORDINATE:
            levels[pairs + number] = y[index] - a[6]
        elif kind == TOUCH:
            levels[pairs + number] = levels[index]
        else:
            px, py, pz = station(w, index, a[0], a[1], a[2])
            levels[pairs + number] = px * a[3] + py * a[4] + pz * a[5] - a[6]


def note_events(
    s: Structure,
    x: Numbers,
    w: Work,
    t0: float,
    y0: Floats,
    f0: Floats,
    t1: float,
    y1: Floats,
    f1: Floats,
    before: Floats,
    after: Floats,
    stages: Floats,
    counts: Ints,
    records: Records,
) -> float:
    """Write down what began and ended within a step; returns the time at which the run is to stop, or infinity."""
    stop, first, pairs = inf, counts[EVENTS], len(w.contacts)
    found = np.zeros(len(before))
    for number in range(len(before)):
        rises = after[number] > 0.0
        if rises == (before[number] > 0.0):
            continue
        low, high = t0, t1
        while high - low > TIME_OF_EVENT:
            middle = 0.5 * (low + high)
            cubic(t0, y0, f0, t1, y1, f1, middle, stages[0])
            if number < pairs or records.watches[number - pairs, 0] == TOUCH:
                contacts_at(s, x, w, stages[0], stages[1])
            else:
                place(s, x, w, stages[0][: len(s.above)])
            levels_at(s, x, w, stages[0], records, found)
            if (found[number] > 0.0) == rises:
                high = middle
            else:
                low = middle
        t = 0.5 * (low + high)
        if number >= pairs and records.watches[number - pairs, 2] == (1 if rises else -1):
            t = high
            stop = min(stop, t)
        row = insert(records.events, first, counts, t, number, rises)
        if row < len(records.events) and records.events.shape[1] > 3:
            cubic(t0, y0, f0, t1, y1, f1, t, records.events[row, 3:])
    # What lies behind the end of the run has not happened.
    while counts[EVENTS] > first and counts[EVENTS] <= len(records.events):
        if records.events[counts[EVENTS] - 1, 0] <= stop:
            break
        counts[EVENTS] -= 1
    return stop


def insert(events: Floats, first: int, counts: Ints, t: float, number: int, rises: bool) -> int:
    """Put an event among those of its step, by time; returns its row, which may lie beyond the room."""
    row = int(counts[EVENTS])
    counts[EVENTS] += 1
    if row >= len(events):
        return row
    while row > first and events[row - 1, 0] > t:
        events[row] = events[row - 1]
        row -= 1
    events[row, 0], events[row, 1], events[row, 2] = t, number, 1.0 if rises else 0.0
    return row


def run_several(
    s: Structure,
    vectors: Floats,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    control: Control,
    times: Floats,
    reports: Floats,
    events: Floats,
    peaks: Floats,
    watches: Ints,
    levels: Floats,
    logs: Floats,
    forces: Floats,
    endings: Ints,
    first: int,
    last: int,
) -> None:
    """The runs `first` to `last` - 1, each on its own rows; a single row of numbers or of a log serves them all.

    Args: as of `run`, one row for each run.
    """
    for k in range(first, last):
        log = k if len(logs) > 1 else 0
        records = Records(times, reports[k], logs[log], forces[log], events[k], peaks[k], watches, levels)
        vector = vectors[k] if len(vectors) > 1 else vectors[0]
        endings[k] = run(s, vector, clocks[k], counts[k], states[k], control, records)
