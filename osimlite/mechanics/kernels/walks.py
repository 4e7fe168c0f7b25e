"""Motions with controls that are held per control step, and complete walks in one call.

A walk alternates control steps (sensors, reflexes, excitations) with integration, and is scored by
criteria. Any other run can be controlled by reflexes too; the memory of its reflexes is a workspace
of its own, from which a later run continues.
"""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.kernels.criteria import begin_criteria, update_criteria
from osimlite.mechanics.kernels.error_control import METHOD_WORK
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers, is_finite
from osimlite.mechanics.kernels.record import COUNTS, ENDING, RUN_SIZES, Motion, evaluate_state
from osimlite.mechanics.kernels.reflexes import (
    LEG_STATE,
    REFLEXES,
    add_noise,
    add_reflexes,
    record_sensors,
    update_leg_states,
)
from osimlite.mechanics.kernels.runs import integrate_run, select_run
from osimlite.mechanics.kernels.sensors import SENSOR_NUMBERS, SENSOR_PLAN, fill_sensor_row


class ORDER(metaclass=Record):
    """Orders for `walk_several` other than a number of control steps."""

    FEEL = -1
    """Order to fill the sensor rows only."""
    BEGIN = -2
    """Order to fill the sensor rows, and to start reflexes and excitations."""
    START = -3
    """Order to fill the sensor rows, and to start the criteria."""


class PROGRESS(metaclass=Record):
    """Progress of a walk."""

    STEPS = 0
    """Number of control steps."""
    FRAMES = 1
    """Number of sensor rows."""
    GOING = 2
    """1 while the walk continues, then 0."""
    FORCES = 3
    """Number of evaluations."""
    SIZE = 4
    """Length of the progress."""


LEGS = 2
"""Number of states of legs at the start of the memory of a walk.

The history of the sensors follows, then the workspace of the criteria.
"""


class Walk(NamedTuple):
    """Inputs and records of a walk.

    The record of a walk has the state at the start, excitations and leg loads of each control step;
    for that of other runs see `begin_control_step`.
    """

    m: Motion  # run of the walk
    sensor_plan: Ints  # plan of the sensor row, see `sensors`
    sensor_numbers: Floats  # numbers of the sensor row
    control_offsets: Ints  # offset of each control in the numbers of the model (c,)
    plan: Ints  # integers of the reflexes, see `reflexes`
    numbers: Floats  # numbers of the reflexes
    criteria: Ints  # integers of the criteria, see `criteria`
    bounds: Floats  # numbers of the criteria
    memory: Floats  # memory of reflexes and criteria, see LEGS
    row: Floats  # sensor row
    excitations: Floats  # excitations during the control step (c,)
    record: Floats  # record of control steps
    progress: Ints  # progress of the walk, see `PROGRESS`


def hold_several(
    model: Ints,
    reals: Floats,
    data: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    peaks: Floats,
    control_offsets: Ints,
    controls: Floats,
    control_count: int,
    running: Ints,
    first: int,
    stop: int,
) -> int:
    """Integrate one control step of the copies `first` to `stop` - 1.

    Args:
        model: integers of the model.
        reals: numbers of the model, shared by all copies; the controls are written to them.
        data: workspace of an evaluation and of the method, shared.
        sizes: sizes and settings, see `record.RUN_SIZES`.
        clocks: time and next step to try of each copy (s) (copies, 2); changed.
        counts: counts of each copy (copies, `COUNTS.SIZE`), see `record.COUNTS`; changed.
        states: state of each copy (copies, y); changed.
        peaks: largest force of each contact (N) and its time (s), for each copy (copies, P, 2);
            changed.
        control_offsets: offsets in reals of the controls.
        controls: controls of each copy (copies, control_count).
        control_count: number of controls.
        running: filled with 1 for a copy that reaches the end of the step, else 0.
        first: number of the first copy.
        stop: number after that of the last copy.

    Returns:
        `OUTCOME.OK`.
    """
    for k in range(first, stop):
        # All copies share the numbers of the model, so controls are written before each copy runs.
        for number in range(control_count):
            reals[control_offsets[number]] = controls[control_count * k + number]
        m = select_motion(model, reals, data, sizes, clocks, counts, peaks, control_offsets, k)
        running[k] = (
            1 if integrate_control_step(m, at(states, model[MODEL.STATE_SIZE] * k), False) else 0
        )
    return OUTCOME.OK


def select_motion(
    model: Ints,
    reals: Floats,
    data: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    peaks: Floats,
    unused: Ints,
    k: int,
) -> Motion:
    """Return the run of one of several copies, without reports, log, events and watches.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: workspace of an evaluation and of the method.
        sizes: sizes and settings, see `record.RUN_SIZES`.
        clocks: time and next step to try of each copy (s) (copies, 2).
        counts: counts of each copy (copies, `COUNTS.SIZE`), see `record.COUNTS`.
        peaks: largest force of each contact (N) and its time (s), for each copy (copies, P, 2).
        unused: any vector, in place of watches.
        k: number of the copy.
    """
    peak = at(peaks, 2 * k * model[MODEL.CONTACTS])
    clock, count = at(clocks, 2 * k), at(counts, COUNTS.SIZE * k)
    # Vectors of records without rows are never read or written; any vector serves.
    return Motion(
        model, reals, data, sizes, clock, count, peak, peak, peak, peak, peak, peak, unused, peak
    )


def integrate_control_step(m: Motion, y: Floats, has_derivative: bool) -> bool:
    """Integrate a state over one control step, as a run of its own.

    Args:
        m: inputs and records of the run.
        y: state; changed.
        has_derivative: whether the derivative at the end of the previous step is that at the start.

    Returns:
        Whether the state reaches the end of the control step.
    """
    # Every control step starts at time 0, so that times have the same digits in all steps.
    m.clock[0] = 0.0
    for k in range(COUNTS.SIZE):
        m.counts[k] = 0
    return integrate_run(m, y, has_derivative) == ENDING.DONE and is_finite(
        m.model[MODEL.STATE_SIZE], y
    )


def walk_several(
    model: Ints,
    reals: Floats,
    data: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    peaks: Floats,
    sensor_plan: Ints,
    sensor_numbers: Floats,
    control_offsets: Ints,
    plan: Ints,
    numbers: Floats,
    criteria: Ints,
    bounds: Floats,
    work: Floats,
    rows: Floats,
    excitations: Floats,
    record: Floats,
    progress: Ints,
    order: int,
    first: int,
    stop: int,
) -> int:
    """Carry out an order, or a number of control steps, for the walks `first` to `stop` - 1.

    Control steps of the walk 0 are recorded.

    Args:
        model: integers of the model.
        reals: numbers of the model, shared by all walks; the excitations are written to them.
        data: workspace of an evaluation and of the method, shared.
        sizes: sizes and settings, see `record.RUN_SIZES`.
        clocks: time and next step to try of each walk (s) (walks, 2); changed.
        counts: counts of each walk (walks, `COUNTS.SIZE`), see `record.COUNTS`; changed.
        states: state of each walk (walks, y); changed.
        peaks: largest force of each contact (N) and its time (s), for each walk (walks, P, 2);
            changed.
        sensor_plan: plan of the sensor rows, see `sensors.SENSOR_PLAN`.
        sensor_numbers: numbers of the sensor rows, see `sensors.SENSOR_NUMBERS`.
        control_offsets: offsets in reals of the excitations.
        plan: integers of the reflexes, see `reflexes.REFLEXES`.
        numbers: numbers of the reflexes of each walk (walks, `REFLEXES.NUMBERS`), see
            `reflexes.LIMITS`.
        criteria: integers of the criteria, see `criteria.CRITERION`.
        bounds: numbers of the criteria.
        work: memory of the reflexes and workspace of the criteria of each walk (walks,
            `REFLEXES.MEMORY_SIZE`), see LEGS; changed.
        rows: sensor row of each walk (walks, `SENSOR_PLAN.SIZE`); changed.
        excitations: excitations of each walk (walks, c); changed.
        record: filled with state, excitations, and ratios of leg loads to the body weight, of each
            control step of the walk 0.
        progress: progress of each walk (walks, `PROGRESS.SIZE`), see `PROGRESS`; changed.
        order: FEEL, BEGIN or START of `ORDER`, or largest number of control steps.
        first: number of the first walk.
        stop: number after that of the last walk.

    Returns:
        Worst outcome of the evaluations of FEEL, BEGIN and START of `ORDER`; `OUTCOME.OK` for
        control steps.
    """
    size = model[MODEL.STATE_SIZE]
    status = OUTCOME.OK
    for k in range(first, stop):
        m = select_motion(model, reals, data, sizes, clocks, counts, peaks, sensor_plan, k)
        walk = Walk(
            m,
            sensor_plan,
            sensor_numbers,
            control_offsets,
            plan,
            at(numbers, plan[REFLEXES.NUMBERS] * k),
            criteria,
            bounds,
            at(work, plan[REFLEXES.MEMORY_SIZE] * k),
            at(rows, sensor_plan[SENSOR_PLAN.SIZE] * k),
            at(excitations, sensor_plan[SENSOR_PLAN.CONTROLS] * k),
            record,
            at(progress, PROGRESS.SIZE * k),
        )
        y = at(states, size * k)
        if order < 0:
            status = max(status, begin_walk(walk, y, order))
        else:
            take_control_steps(walk, y, order, k == 0)
    return status


def begin_walk(a: Walk, y: Floats, order: int) -> int:
    """Fill the sensor row of a state, and start reflexes or criteria.

    Args:
        a: inputs and records of the walk.
        y: state.
        order: FEEL, BEGIN or START of `ORDER`.

    Returns:
        Outcome of the evaluation.
    """
    m = a.m
    # Sensors before the first control step are those without excitations.
    for k in range(a.sensor_plan[SENSOR_PLAN.CONTROLS]):
        m.reals[a.control_offsets[k]] = 0.0
    status = evaluate_state(m, 0.0, y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
    if status != OUTCOME.OK:
        return status
    fill_sensor_row(m.model, m.data, y, a.sensor_plan, a.sensor_numbers, a.row)
    if order == ORDER.BEGIN:
        for k in range(LEGS):
            a.memory[k] = (
                LEG_STATE.UNKNOWN if a.plan[REFLEXES.HAS_STATES] > 0 else LEG_STATE.EARLY_STANCE
            )
        (
            a.progress[PROGRESS.STEPS],
            a.progress[PROGRESS.FRAMES],
            a.progress[PROGRESS.GOING],
            a.progress[PROGRESS.FORCES],
        ) = 0, 1, 1, 0
        record_sensors(m.model, m.data, a.plan, a.numbers, 0, a.row, at(a.memory, LEGS))
        update_excitations(a)
    elif order == ORDER.START:
        begin_criteria(a.sensor_plan, a.criteria, a.row, criteria_work(a))
    return status


def take_control_steps(a: Walk, y: Floats, steps: int, is_recorded: bool) -> None:
    """Simulate at most `steps` control steps.

    As in SCONE, a step may begin with the derivative at the end of the previous one, which belongs to
    the previous excitations.

    Args:
        a: inputs and records of the walk.
        y: state; changed.
        steps: largest number of control steps.
        is_recorded: whether each step is recorded.
    """
    m = a.m
    progress = a.progress
    lags = a.sensor_numbers[SENSOR_NUMBERS.LAGS] > 0.0
    size, controls = m.model[MODEL.STATE_SIZE], a.sensor_plan[SENSOR_PLAN.CONTROLS]
    # Evaluate the end of the step before with its excitations, which a lagging step begins with.
    if lags:
        apply_excitations(a)
        previous = at(m.data, m.model[MODEL.WORK_STATE])
        copy_numbers(size, y, previous)
        evaluate_state(
            m,
            a.sensor_numbers[SENSOR_NUMBERS.STEP],
            previous,
            at(previous, size),
            STAGE.ACCELERATION,
        )
    for number in range(steps):
        if progress[PROGRESS.GOING] == 0:
            return
        update_excitations(a)
        if is_recorded:
            record = at(a.record, (size + controls + a.sensor_plan[SENSOR_PLAN.LEGS]) * number)
            copy_numbers(size, y, record)
            copy_numbers(controls, a.excitations, at(record, size))
            copy_numbers(
                a.sensor_plan[SENSOR_PLAN.LEGS],
                at(a.row, a.sensor_plan[SENSOR_PLAN.LOADS]),
                at(record, size + controls),
            )
        apply_excitations(a)
        has_reached_end = integrate_control_step(m, y, lags)
        progress[PROGRESS.STEPS] += 1
        progress[PROGRESS.FORCES] += m.counts[COUNTS.EVALUATIONS]
        # A motion that fails ends the walk, as a fall does.
        if not has_reached_end:
            progress[PROGRESS.GOING] = 0
            return
        if (
            m.model[MODEL.CONTACTS] == 0
            and m.data[m.sizes[RUN_SIZES.METHOD_AT] + METHOD_WORK.HAS_DERIVATIVE] > 0.0
        ):
            # The method has not evaluated the forces at the end.
            evaluate_state(m, m.clock[0], y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
        fill_sensor_row(m.model, m.data, y, a.sensor_plan, a.sensor_numbers, a.row)
        record_sensors(
            m.model, m.data, a.plan, a.numbers, progress[PROGRESS.FRAMES], a.row, at(a.memory, LEGS)
        )
        progress[PROGRESS.FRAMES] += 1
        # Time in control steps, which has no accumulated rounding.
        t = progress[PROGRESS.STEPS] * a.sensor_numbers[SENSOR_NUMBERS.STEP]
        if update_criteria(
            a.sensor_plan,
            a.sensor_numbers,
            a.criteria,
            a.bounds,
            t,
            a.row,
            a.excitations,
            criteria_work(a),
        ):
            progress[PROGRESS.GOING] = 0


def apply_excitations(a: Walk) -> None:
    """Write the excitations to the actuators."""
    for k in range(a.sensor_plan[SENSOR_PLAN.CONTROLS]):
        a.m.reals[a.control_offsets[k]] = a.excitations[k]


def criteria_work(a: Walk) -> Floats:
    """Return the workspace of the criteria."""
    return at(a.memory, LEGS + a.plan[REFLEXES.HISTORY_LENGTH] * a.plan[REFLEXES.SENSORS])


def update_excitations(a: Walk) -> None:
    """Advance the states of the legs, and compute the excitations by reflexes, within their bounds."""
    history = at(a.memory, LEGS)
    frames = a.progress[PROGRESS.FRAMES]
    count = a.sensor_plan[SENSOR_PLAN.CONTROLS]
    if a.plan[REFLEXES.HAS_STATES] > 0:
        update_leg_states(a.sensor_plan, a.plan, a.numbers, frames, a.row, history, a.memory)
    for k in range(count):
        a.excitations[k] = 0.0
    add_reflexes(a.plan, a.numbers, frames, history, a.memory, a.excitations)
    # Noise is added before bounds apply, as in SCONE.
    add_noise(a.plan, a.numbers, a.progress[PROGRESS.STEPS], count, a.excitations)
    lower_bounds = at(
        a.sensor_numbers, SENSOR_NUMBERS.HEAD + 2 * a.sensor_plan[SENSOR_PLAN.MUSCLES]
    )
    upper_bounds = at(lower_bounds, count)
    for k in range(count):
        a.excitations[k] = min(max(a.excitations[k], lower_bounds[k]), upper_bounds[k])


def run_by_reflexes(
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
    sensor_plan: Ints,
    sensor_numbers: Floats,
    control_offsets: Ints,
    plan: Ints,
    numbers: Floats,
    work: Floats,
    rows: Floats,
    excitations: Floats,
    record: Floats,
    progress: Ints,
    first: int,
    stop: int,
) -> int:
    """Integrate the runs `first` to `stop` - 1 as `run_several` does, each controlled by reflexes.

    Args:
        model: integers of the model.
        reals: numbers of the runs, in rows of `number_count`.
        data: workspace of an evaluation and of the method, shared.
        number_count: length of a row of numbers.
        sizes: sizes and settings, see `record.RUN_SIZES`.
        clocks: time and next step to try of each run (s) (runs, 2); changed.
        counts: counts of each run (runs, `COUNTS.SIZE`), see `record.COUNTS`; changed.
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
        endings: filled with the ending of each run, see `record.ENDING`.
        sensor_plan: plan of the sensor rows, see `sensors.SENSOR_PLAN`.
        sensor_numbers: numbers of the sensor row of each run (runs, `SENSOR_PLAN.NUMBERS`), see
            `sensors.SENSOR_NUMBERS`.
        control_offsets: offsets in reals of the excitations.
        plan: integers of the reflexes, see `reflexes.REFLEXES`.
        numbers: numbers of the reflexes of each run (runs, `REFLEXES.NUMBERS`), see
            `reflexes.LIMITS`.
        work: memory of the reflexes of each run (runs, `REFLEXES.MEMORY_SIZE`); changed.
        rows: sensor row of each run (runs, `SENSOR_PLAN.SIZE`); changed.
        excitations: excitations of each run (runs, c); changed.
        record: filled with the control steps of each run (runs, `REFLEXES.ROWS`,
            `control_record_size`), see `begin_control_step`.
        progress: progress of each run (runs, `PROGRESS.SIZE`), see `PROGRESS`; changed.
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
        walk = Walk(
            m,
            sensor_plan,
            at(sensor_numbers, sensor_plan[SENSOR_PLAN.NUMBERS] * k),
            control_offsets,
            plan,
            at(numbers, plan[REFLEXES.NUMBERS] * k),
            plan,
            numbers,
            at(work, plan[REFLEXES.MEMORY_SIZE] * k),
            at(rows, sensor_plan[SENSOR_PLAN.SIZE] * k),
            at(excitations, sensor_plan[SENSOR_PLAN.CONTROLS] * k),
            at(record, plan[REFLEXES.ROWS] * k * control_record_size(sensor_plan, plan)),
            at(progress, PROGRESS.SIZE * k),
        )
        endings[k] = integrate_with_reflexes(walk, at(states, k * model[MODEL.STATE_SIZE]))
    return OUTCOME.OK


def control_record_size(sensor_plan: Ints, plan: Ints) -> int:
    """Return the length of the record of a control step.

    It contains sensors, states of legs, excitations, and the next step to try.

    Args:
        sensor_plan: plan of the sensor row.
        plan: integers of the reflexes.
    """
    return int(plan[REFLEXES.SENSORS] + LEGS + sensor_plan[SENSOR_PLAN.CONTROLS] + 1)


def integrate_with_reflexes(a: Walk, y: Floats) -> int:
    """Integrate from the state y as `integrate_run` does, with new controls at each control step.

    A control step also begins at the very end of the run.

    Args:
        a: inputs and records of the walk; criteria are not used.
        y: state; changed.

    Returns:
        Ending of the run, see `record.ENDING`.
    """
    m, progress = a.m, a.progress
    h = at(m.data, m.sizes[RUN_SIZES.METHOD_AT])
    end = h[METHOD_WORK.LAST_TIME]
    ending = ENDING.DONE
    while ending == ENDING.DONE:
        if m.clock[0] >= progress[PROGRESS.STEPS] * a.sensor_numbers[
            SENSOR_NUMBERS.STEP
        ] and not begin_control_step(a, y):
            ending = ENDING.FAILED
        elif m.clock[0] >= end:
            break
        else:
            apply_excitations(a)
            # Integrate to the end of the control step or of the run, the earlier of both.
            h[METHOD_WORK.LAST_TIME] = min(
                progress[PROGRESS.STEPS] * a.sensor_numbers[SENSOR_NUMBERS.STEP], end
            )
            ending = integrate_run(m, y, False)
    h[METHOD_WORK.LAST_TIME] = end
    return ending


def begin_control_step(a: Walk, y: Floats) -> bool:
    """Begin a control step and record it.

    The record holds the remembered sensors, the states of the legs, the excitations, and the step that
    the method would try next.

    Args:
        a: inputs and records of the walk.
        y: state.

    Returns:
        Whether the evaluation succeeded.
    """
    m = a.m
    progress = a.progress
    sensors = a.plan[REFLEXES.SENSORS]
    # The motion has a kink here: the method must forget its history.
    at(m.data, m.sizes[RUN_SIZES.METHOD_AT])[METHOD_WORK.MEMORY] = 0.0
    apply_excitations(a)
    m.counts[COUNTS.EVALUATIONS] += 1
    if (
        evaluate_state(m, m.clock[0], y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
        != OUTCOME.OK
    ):
        return False
    fill_sensor_row(m.model, m.data, y, a.sensor_plan, a.sensor_numbers, a.row)
    record_sensors(
        m.model, m.data, a.plan, a.numbers, progress[PROGRESS.FRAMES], a.row, at(a.memory, LEGS)
    )
    progress[PROGRESS.FRAMES] += 1
    update_excitations(a)
    row = progress[PROGRESS.STEPS] - a.plan[REFLEXES.FIRST]
    if row < a.plan[REFLEXES.ROWS]:
        record = at(a.record, row * control_record_size(a.sensor_plan, a.plan))
        history_offset = sensors * (
            (progress[PROGRESS.FRAMES] - 1) % a.plan[REFLEXES.HISTORY_LENGTH]
        )
        copy_numbers(sensors, at(a.memory, LEGS + history_offset), record)
        copy_numbers(LEGS, a.memory, at(record, sensors))
        copy_numbers(a.sensor_plan[SENSOR_PLAN.CONTROLS], a.excitations, at(record, sensors + LEGS))
        record[control_record_size(a.sensor_plan, a.plan) - 1] = m.clock[1]
    progress[PROGRESS.STEPS] += 1
    return True
