"""Records of a run: reports, a log of its steps, events and peak forces."""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

from osimlite.mechanics.kernels.error_control import METHOD_WORK, project_by_law
from osimlite.mechanics.kernels.layout import CONTACT_WORK, MODEL, STAGE, WORK, Record
from osimlite.mechanics.kernels.pointers import (
    Floats,
    Ints,
    at,
    call,
    copy_numbers,
    interpolate_cubic,
)
from osimlite.mechanics.kernels.points import station
from osimlite.mechanics.laws.vectors import dot, vector


class ENDING(metaclass=Record):
    """Reasons why a run ended."""

    DONE = 0
    """Run that reached its last time."""
    FAILED = 1
    """Run that reached a state beyond which there is no step."""
    FULL = 2
    """Run whose log is full."""
    STOPPED = 3
    """Run that an event stopped."""
    TOO_MANY = 4
    """Run that tried as many steps as were allowed."""


TIME_OF_EVENT = 1e-9
"""Accuracy of the time of an event on the interpolated motion (s)."""


class COUNTS(metaclass=Record):
    """Counts of a run."""

    ACCEPTED = 0
    """Number of accepted steps."""
    ATTEMPTED = 1
    """Number of tried steps."""
    EVALUATIONS = 2
    """Number of evaluations."""
    REPORTED = 3
    """Number of reports."""
    LOGGED = 4
    """Number of steps in the log."""
    EVENTS = 5
    """Number of events; those beyond the workspace are only counted."""
    SIZE = 6
    """Number of counts."""


class WATCH(metaclass=Record):
    """Types of watches."""

    COORDINATE = 0
    """The value of a coordinate."""
    HEIGHT = 1
    """The position of a point along a direction."""
    TOUCH = 2
    """A contact."""


STATES = 6
"""Number of states of workspace that a run needs at WORK_STATE.

Two numbers for each contact and watch follow.
"""


class RUN_SIZES(metaclass=Record):
    """Sizes and settings of a run."""

    MOST_TRIES = 0
    """Largest number of tried steps."""
    TIMES = 1
    """Number of reports."""
    MOST_EVENTS = 2
    """Number of rows for events."""
    EVENT = 3
    """Length of a row of an event: 3, or more if it holds the state."""
    WATCHES = 4
    """Number of watches."""
    MOST_LOGGED = 5
    """Number of rows of the log, 0 for no log."""
    START_HOLDS = 6
    """1 if the constraints hold at the start, else 0."""
    METHOD = 7
    """Address of the integration method."""
    METHOD_AT = 8
    """Offset in `data` of the method's record."""


class Motion(NamedTuple):
    """Inputs and records of a run; any of the records may have no rows.

    A state has y numbers, see `MODEL.STATE_SIZE`. P is the number of pairs of contact surfaces.

    Each watch has three integers: its type; a degree of freedom, a link or a contact; and -1 or 1
    if falling or rising through the level ends the run, 0 if neither does.
    """

    model: Ints  # integers of the mechanism
    reals: Floats  # numbers of the mechanism
    # results and workspace; the record of the integration method at RUN_SIZES.METHOD_AT
    data: Floats
    sizes: Ints  # sizes and settings, see `RUN_SIZES`
    clock: Floats  # time and next step to try, s; changed
    counts: Ints  # counts of the run, see `COUNTS`; changed
    times: Floats  # times of the reports, s (r,)
    reports: Floats  # states at these times (r, y)
    log: Floats  # time, y and f at each step (k, 1 + 2y)
    forces: Floats  # force on surface 2 of each pair at each step, N (k, P, 3)
    events: Floats  # events, see `insert_event` (e, 3 or 3 + y)
    peaks: Floats  # largest force of each pair at the end of a step (N), and its time (s) (P, 2)
    watches: Ints  # integers of the watches (w, 3)
    levels: Floats  # station in the link, direction in ground, and level of each watch (w, 7)


def evaluate_state(m: Motion, t: float, y: Floats, f: Floats, stage: int) -> int:
    """Evaluate a state at a time.

    Args:
        m: inputs and records of the run.
        t: time (s).
        y: state.
        f: filled with the rates.
        stage: last stage to evaluate, see `STAGE`.

    Returns:
        Outcome of the evaluation, see `OUTCOME`.
    """
    m.data[WORK.TIME] = t
    return call(m.model[MODEL.LAWS], m.model, m.reals, m.data, y, f, stage)


def interpolate_state(
    m: Motion,
    t0: float,
    y0: Floats,
    f0: Floats,
    t1: float,
    y1: Floats,
    f1: Floats,
    t: float,
    y: Floats,
) -> None:
    """Compute the state at a time within a step, projected onto the constraints where possible.

    Args:
        m: inputs and records of the run.
        t0: time at the start of the step (s).
        y0: state at the start.
        f0: rates of the state at the start.
        t1: time at the end of the step (s).
        y1: state at the end.
        f1: rates of the state at the end.
        t: time within the step (s).
        y: filled with the state.
    """
    interpolate_cubic(m.model[MODEL.STATE_SIZE], t0, y0, f0, t1, y1, f1, t, y)
    # The cubic polynomial leaves the constraints by its interpolation error. A tenth of the
    # accuracy is as exact as an integrator's own projection, and without a limit every state is
    # projected.
    if m.model[MODEL.CONSTRAINED] > 0:
        project_by_law(
            m.model,
            m.reals,
            m.data,
            t,
            y,
            y,
            0,
            m.data[m.sizes[RUN_SIZES.METHOD_AT] + METHOD_WORK.ACCEPTED] / 10.0,
            inf,
        )


def note_peaks(m: Motion, t: float) -> None:
    """Update the largest forces of the contacts, and their times.

    Args:
        m: the run, whose last evaluation was at time t.
        t: time (s).
    """
    for pair in range(m.model[MODEL.CONTACTS]):
        c = at(m.data, m.model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair)
        peak = at(m.peaks, 2 * pair)
        size = sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
        if size > peak[0]:
            peak[0], peak[1] = size, t


def note_step(m: Motion, t: float, y: Floats, f: Floats) -> None:
    """Append a step to the log.

    Args:
        m: inputs and records of the run, whose last evaluation was at time t.
        t: time at the end of the step (s).
        y: state at the end of the step.
        f: rates of the state y.
    """
    size, row = m.model[MODEL.STATE_SIZE], m.counts[COUNTS.LOGGED]
    log = at(m.log, (1 + 2 * size) * row)
    log[0] = t
    copy_numbers(size, y, at(log, 1))
    copy_numbers(size, f, at(log, 1 + size))
    for pair in range(m.model[MODEL.CONTACTS]):
        copy_numbers(
            3,
            at(m.data, m.model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair),
            at(m.forces, 3 * (m.model[MODEL.CONTACTS] * row + pair)),
        )
    m.counts[COUNTS.LOGGED] += 1


def compute_levels(m: Motion, y: Floats, levels: Floats) -> None:
    """Compute the levels of contacts and watches, whose changes of sign are events.

    Args:
        m: inputs and records of the run.
        y: state that was evaluated.
        levels: filled with 1 for each contact that transmits a force, else -1, then with the value
            above its level for each watch.
    """
    pairs = m.model[MODEL.CONTACTS]
    for pair in range(pairs):
        c = at(m.data, m.model[MODEL.WORK_CONTACT] + CONTACT_WORK.SIZE * pair)
        # A contact transmits a force or does not: between -1 and 1 the level always changes its
        # sign.
        levels[pair] = 1.0 if c[0] != 0.0 or c[1] != 0.0 or c[2] != 0.0 else -1.0
    for number in range(m.sizes[RUN_SIZES.WATCHES]):
        watch, a = at(m.watches, 3 * number), at(m.levels, 7 * number)
        if watch[0] == WATCH.COORDINATE:
            levels[pairs + number] = y[watch[1]] - a[6]
        elif watch[0] == WATCH.TOUCH:
            levels[pairs + number] = levels[watch[1]]
        else:
            levels[pairs + number] = (
                dot(station(m.model, m.data, watch[1], vector(a, 0)), vector(a, 3)) - a[6]
            )


def note_events(
    m: Motion,
    t0: float,
    y0: Floats,
    f0: Floats,
    t1: float,
    y1: Floats,
    f1: Floats,
    previous_levels: Floats,
    next_levels: Floats,
) -> float:
    """Record the contacts and watches that began or ended within a step.

    Args:
        m: inputs and records of the run.
        t0: time at the start of the step (s).
        y0: state at the start.
        f0: rates of the state at the start.
        t1: time at the end of the step (s).
        y1: state at the end.
        f1: rates of the state at the end.
        previous_levels: levels at the start.
        next_levels: levels at the end, then workspace for levels.

    Returns:
        The time at which an event stops the run (s), or infinity.
    """
    counts, events = m.counts, m.events
    size, pairs = m.model[MODEL.STATE_SIZE], m.model[MODEL.CONTACTS]
    stop = inf
    first = counts[COUNTS.EVENTS]
    total = pairs + m.sizes[RUN_SIZES.WATCHES]
    event = m.sizes[RUN_SIZES.EVENT]
    # The workspace at WORK_STATE has STATES states, and `integrate_run` uses the first four.
    ya = at(m.data, m.model[MODEL.WORK_STATE] + 4 * size)
    fa, result = at(ya, size), at(next_levels, total)
    for number in range(total):
        rises = next_levels[number] > 0.0
        if rises == (previous_levels[number] > 0.0):
            continue
        low, high = t0, t1
        # Bisect the interpolated motion for the change of sign.
        while high - low > TIME_OF_EVENT:
            # Stop also where floats between both ends run out, at times above 1e6 s.
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
            interpolate_state(m, t0, y0, f0, t1, y1, f1, middle, ya)
            # Contacts need forces, all other watches only poses.
            touch = number < pairs or m.watches[3 * (number - pairs)] == WATCH.TOUCH
            evaluate_state(m, middle, ya, fa, STAGE.FORCE if touch else STAGE.POSITION)
            compute_levels(m, ya, result)
            if (result[number] > 0.0) == rises:
                high = middle
            else:
                low = middle
        t = 0.5 * (low + high)
        # A run that ends at an event must end on the far side of it, hence `high`.
        if number >= pairs and m.watches[3 * (number - pairs) + 2] == (1 if rises else -1):
            t = high
            stop = min(stop, t)
        row = insert_event(m, first, t, number, rises)
        if row < m.sizes[RUN_SIZES.MOST_EVENTS] and event > 3:
            interpolate_state(m, t0, y0, f0, t1, y1, f1, t, at(events, event * row + 3))
    # Drop events after the end of the run.
    # Events are sorted by time, so those after the end are the last ones.
    while counts[COUNTS.EVENTS] > first and counts[COUNTS.EVENTS] <= m.sizes[RUN_SIZES.MOST_EVENTS]:
        if events[event * (counts[COUNTS.EVENTS] - 1)] <= stop:
            break
        counts[COUNTS.EVENTS] -= 1
    return stop


def insert_event(m: Motion, first: int, t: float, number: int, rises: bool) -> int:
    """Insert an event among those of its step, sorted by time.

    A row holds the time, the number, 1 if the level rises or 0 if it falls, and the state if the
    row is long enough.

    Args:
        m: inputs and records of the run.
        first: first event of the step.
        t: time of the event (s).
        number: number of the contact, or number of contacts plus that of the watch.
        rises: whether the level rises.

    Returns:
        Index of the row, which does not exist if the records are full; the event is counted then.
    """
    row = int(m.counts[COUNTS.EVENTS])
    events = m.events
    length = m.sizes[RUN_SIZES.EVENT]
    m.counts[COUNTS.EVENTS] += 1
    if row >= m.sizes[RUN_SIZES.MOST_EVENTS]:
        return row
    # Insertion sort: few events happen within one step.
    while row > first and events[length * (row - 1)] > t:
        copy_numbers(length, at(events, length * (row - 1)), at(events, length * row))
        row -= 1
    event = at(events, length * row)
    event[0], event[1], event[2] = t, number, 1.0 if rises else 0.0
    return row
