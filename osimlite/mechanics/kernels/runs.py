"""Complete motions in one call: steps of an integration method, reports and events.

The rules are those of Simbody's AbstractIntegratorRep, rounding for rounding.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.error_control import METHOD_WORK, project_by_law, shortest_step
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, copy_numbers, is_finite
from osimlite.mechanics.kernels.record import (
    COUNTS,
    ENDING,
    RUN_SIZES,
    STATES,
    Motion,
    compute_levels,
    evaluate_state,
    interpolate_state,
    note_events,
    note_peaks,
    note_step,
)


def run_several(
    model: Ints,
    reals: Floats,
    data: Floats,
    number_count: int,
    sizes: Ints,
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
    stop: int,
) -> int:
    """Integrate the runs `first` to `stop` - 1, each on its own rows.

    Args:
        model: integers of the model.
        reals: numbers of the runs, in rows of `number_count`.
        data: workspace of an evaluation and of the method, shared.
        number_count: length of a row of numbers, 0 if all runs share one.
        sizes: sizes and settings, see `RUN_SIZES`.
        clocks: time and next step to try of each run (s) (runs, 2); changed.
        counts: counts of each run (runs, `COUNTS.SIZE`), see `COUNTS`; changed.
        states: state of each run (runs, y); changed.
        times: times of the reports (s).
        reports: filled with the states of each run at these times (runs, r, y).
        log: log of the steps, shared.
        forces: forces of contacts at the steps of the log, shared.
        events: filled with the events of each run, see `record.insert_event`.
        peaks: filled with the largest force of each contact (N) and its time (s), for each run
            (runs, P, 2).
        watches: integers of the watches, see `record.Motion`.
        levels: numbers of the watches, see `record.Motion`.
        endings: filled with the ending of each run, see `ENDING`.
        first: number of the first run.
        stop: number after that of the last run.

    Returns:
        `OUTCOME.OK`; `endings` has the ending of each run.
    """
    runs = Motion(
        model,
        reals,
        data,
        sizes,
        clocks,
        counts,
        times,
        reports,
        log,
        forces,
        events,
        peaks,
        watches,
        levels,
    )
    for k in range(first, stop):
        m = select_run(runs, number_count, k)
        endings[k] = integrate_run(m, at(states, k * model[MODEL.STATE_SIZE]), False)
    return OUTCOME.OK


def select_run(runs: Motion, number_count: int, k: int) -> Motion:
    """Return one of several runs.

    Args:
        runs: vectors of all runs; each run has a row of `reals`, `clock`, `counts`, `reports`,
            `events` and `peaks`; the others are shared.
        number_count: length of a row of `reals`, 0 if all runs share one.
        k: number of the run.
    """
    size = runs.model[MODEL.STATE_SIZE]
    pairs = runs.model[MODEL.CONTACTS]
    sizes = runs.sizes
    return Motion(
        runs.model,
        at(runs.reals, number_count * k),
        runs.data,
        sizes,
        at(runs.clock, 2 * k),
        at(runs.counts, COUNTS.SIZE * k),
        runs.times,
        at(runs.reports, k * sizes[RUN_SIZES.TIMES] * size),
        runs.log,
        runs.forces,
        at(runs.events, sizes[RUN_SIZES.EVENT] * k * sizes[RUN_SIZES.MOST_EVENTS]),
        at(runs.peaks, 2 * k * pairs),
        runs.watches,
        runs.levels,
    )


def integrate_run(m: Motion, y: Floats, is_going: bool) -> int:
    """Integrate from the state y, which is changed, until a condition ends the run.

    Args:
        m: inputs and records of the run.
        y: state at the start, then at the end.
        is_going: whether the derivative at the end of the previous run is that at the start.

    Returns:
        The ending, see `ENDING`.
    """
    model, counts, clock, sizes = m.model, m.counts, m.clock, m.sizes
    size = model[MODEL.STATE_SIZE]
    work, h = at(m.data, model[MODEL.WORK_STATE]), at(m.data, sizes[RUN_SIZES.METHOD_AT])
    y0 = work
    f0 = at(work, size)
    y1 = at(work, 2 * size)
    f1 = at(work, 3 * size)
    previous_levels = at(work, STATES * size)
    next_levels = at(previous_levels, model[MODEL.CONTACTS] + sizes[RUN_SIZES.WATCHES])
    # The caller says whether the initial state fulfils the constraints; else project it.
    holds_constraints = model[MODEL.CONSTRAINED] == 0 or sizes[RUN_SIZES.START_HOLDS] > 0
    if not holds_constraints and not project_by_law(
        model, m.reals, m.data, clock[0], y, f0, 0, h[METHOD_WORK.ACCEPTED] / 10.0, inf
    ):
        return ENDING.FAILED
    copy_numbers(size, y, y0)
    status = OUTCOME.OK if is_going else evaluate_state(m, clock[0], y0, f0, STAGE.ACCELERATION)
    # A run that continues keeps the memory of its method.
    if counts[COUNTS.ACCEPTED] == 0 and counts[COUNTS.EVALUATIONS] == 0:
        counts[COUNTS.EVALUATIONS], h[METHOD_WORK.MEMORY] = 0 if is_going else 1, 0.0
    if status != OUTCOME.OK or not is_finite(size, f0):
        return ENDING.FAILED
    h[METHOD_WORK.IS_EVALUATED] = 0.0 if is_going else 1.0
    compute_levels(m, y0, previous_levels)
    note_peaks(m, clock[0])
    # Reports at or before the start get the initial state.
    while (
        counts[COUNTS.REPORTED] < sizes[RUN_SIZES.TIMES]
        and m.times[counts[COUNTS.REPORTED]] <= clock[0]
    ):
        copy_numbers(size, y0, at(m.reports, size * counts[COUNTS.REPORTED]))
        counts[COUNTS.REPORTED] += 1
    while clock[0] < h[METHOD_WORK.LAST_TIME]:
        # A full log interrupts the run; the caller empties it and continues.
        if (
            sizes[RUN_SIZES.MOST_LOGGED] > 0
            and sizes[RUN_SIZES.MOST_LOGGED] == counts[COUNTS.LOGGED]
        ):
            return ENDING.FULL
        t0 = clock[0]
        t1 = take_step(m, t0, y0, y1)
        if t1 <= t0:
            return ENDING.FAILED if t1 < t0 else ENDING.TOO_MANY
        # A step whose end has no derivative is repeated with a shorter one.
        if not is_evaluated(m, t1, y1, f1):
            # Simbody ends here; smaller steps come nearer to the point where the motion ends.
            if t1 - t0 <= shortest_step(t0, counts[COUNTS.ATTEMPTED]):
                return ENDING.FAILED
            clock[1] = max(0.1 * (t1 - t0), shortest_step(t0, counts[COUNTS.ATTEMPTED]))
            h[METHOD_WORK.MEMORY] = 0.0
            continue
        counts[COUNTS.ACCEPTED] += 1
        clock[0] = t1
        note_peaks(m, t1)
        if sizes[RUN_SIZES.MOST_LOGGED] > 0:
            note_step(m, t1, y1, f1)
        end, stopped = t1, False
        # Contacts and constraints change the results after the method's last evaluation.
        h[METHOD_WORK.IS_EVALUATED] = (
            1.0 if h[METHOD_WORK.HAS_DERIVATIVE] == 0.0 and model[MODEL.CONSTRAINED] == 0 else 0.0
        )
        # Locate events within the step; one of them may end the run.
        if sizes[RUN_SIZES.MOST_EVENTS] > 0 or sizes[RUN_SIZES.WATCHES] > 0:
            h[METHOD_WORK.IS_EVALUATED] = 0.0
            compute_levels(m, y1, next_levels)
            end = note_events(m, t0, y0, f0, t1, y1, f1, previous_levels, next_levels)
            stopped = end <= t1
            end = min(end, t1)
            # Levels at the end are those at the start of the next step.
            copy_numbers(
                model[MODEL.CONTACTS] + sizes[RUN_SIZES.WATCHES], next_levels, previous_levels
            )
        while (
            counts[COUNTS.REPORTED] < sizes[RUN_SIZES.TIMES]
            and m.times[counts[COUNTS.REPORTED]] <= end
        ):
            t = m.times[counts[COUNTS.REPORTED]]
            report = at(m.reports, size * counts[COUNTS.REPORTED])
            # A report at the end of a step is the state itself, not an interpolated one.
            if t == t1:
                copy_numbers(size, y1, report)
            else:
                interpolate_state(m, t0, y0, f0, t1, y1, f1, t, report)
            counts[COUNTS.REPORTED] += 1
        if stopped:
            if end < t1:
                interpolate_state(m, t0, y0, f0, t1, y1, f1, end, y)
            else:
                copy_numbers(size, y1, y)
            clock[0] = end
            return ENDING.STOPPED
        # The end of this step is the start of the next one.
        y0, y1 = y1, y0
        f0, f1 = f1, f0
        copy_numbers(size, y0, y)
    # The caller finds the derivative in the same place, whatever the number of steps.
    copy_numbers(size, f0, at(work, size))
    return ENDING.DONE


def is_evaluated(m: Motion, t1: float, y1: Floats, f1: Floats) -> bool:
    """Evaluate the end of a step unless the method has done so.

    The derivative of the method is not used where contacts or watches need the results of an
    evaluation.

    Args:
        m: inputs and records of the run.
        t1: time at the end of the step (s).
        y1: state at the end.
        f1: filled with the rates of y1.

    Returns:
        Whether the derivative is finite.
    """
    if (
        m.data[m.sizes[RUN_SIZES.METHOD_AT] + METHOD_WORK.HAS_DERIVATIVE] > 0.0
        and m.model[MODEL.CONTACTS] + m.sizes[RUN_SIZES.WATCHES] == 0
    ):
        return is_finite(m.model[MODEL.STATE_SIZE], f1)
    m.counts[COUNTS.EVALUATIONS] += 1
    return evaluate_state(m, t1, y1, f1, STAGE.ACCELERATION) == OUTCOME.OK and is_finite(
        m.model[MODEL.STATE_SIZE], f1
    )


def take_step(m: Motion, t0: float, y0: Floats, y1: Floats) -> float:
    """Find a step whose error is accepted.

    Args:
        m: inputs and records of the run.
        t0: time at the start (s).
        y0: state at the start, then its derivative.
        y1: filled with the state at the end.

    Returns:
        The time at the end of the step (s); t0 - 1 without an accepted step, t0 after too many tried steps.
    """
    counts, clock, sizes = m.counts, m.clock, m.sizes
    h = at(m.data, sizes[RUN_SIZES.METHOD_AT])
    # A step at the resolution of time that is rejected ends the run.
    smallest = max(shortest_step(t0, counts[COUNTS.ATTEMPTED]), h[METHOD_WORK.SHORTEST])
    h[METHOD_WORK.REACHED], h[METHOD_WORK.NEXT_STEP] = t0, clock[1]
    while counts[COUNTS.ATTEMPTED] < sizes[RUN_SIZES.MOST_TRIES]:
        tried = h[METHOD_WORK.NEXT_STEP]
        counts[COUNTS.ATTEMPTED] += 1
        call(sizes[RUN_SIZES.METHOD], m.model, m.reals, m.data, y0, y1, sizes[RUN_SIZES.METHOD_AT])
        counts[COUNTS.EVALUATIONS] += int(h[METHOD_WORK.EVALUATED])
        clock[1] = h[METHOD_WORK.NEXT_STEP]
        if h[METHOD_WORK.REACHED] > t0:
            return float(h[METHOD_WORK.REACHED])
        if tried <= smallest:
            return t0 - 1.0
        h[METHOD_WORK.NEXT_STEP] = clock[1] = max(h[METHOD_WORK.NEXT_STEP], smallest)
    return t0
