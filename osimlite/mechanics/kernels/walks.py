"""Motions whose controls are held for a step, and whole walks in one call.

A walk are control steps of reflexes, the motion between, what is felt, and how it is judged. Any
other run can go by
reflexes, too: what they know of what was is a room of its own, from which a run goes on.
"""

from __future__ import annotations

from typing import NamedTuple

from osimlite.mechanics.kernels.criteria import begin_criteria, judged
from osimlite.mechanics.kernels.error_control import HAS_DERIVATIVE, LAST_TIME, MEMORY
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy, is_finite
from osimlite.mechanics.kernels.record import (
    COUNTED,
    DONE,
    EVALUATIONS,
    FAILED,
    METHOD_AT,
    Motion,
    evaluated,
)
from osimlite.mechanics.kernels.reflexes import (
    EARLY_STANCE,
    REFLEXES,
    UNKNOWN,
    add_noise,
    add_reflexes,
    go_on,
    note_senses,
)
from osimlite.mechanics.kernels.runs import run, run_of
from osimlite.mechanics.kernels.sensors import SENSED, SENSES, feel

FEEL, BEGIN, START = -1, -2, -3
"""Orders besides a number of control steps: to feel what is; then to begin reflexes and excite
muscles by them, or to begin criteria.
"""
STEPS, FRAMES, GOING, FORCES, COUNTS = range(5)
"""What is counted of a walk: control steps, rows that were felt, 1 while it goes on, evaluations of the forces."""
LEGS = 2
"""The room of a walk begins with the states of two legs; the history of the sensors follows, and that of criteria."""


class Walk(NamedTuple):
    """What a walk goes by and leaves behind."""

    m: Motion
    senses: Ints  # see `senses`
    known: Floats
    driven: Ints  # where the numbers of the model have each control (c,)
    plan: Ints  # see `reflexes`
    numbers: Floats
    criteria: Ints  # see `criteria`
    bounds: Floats
    room: Floats  # see LEGS
    row: Floats  # what is felt
    excitations: Floats  # that are held (c,)
    # of each control step the state at its start, excitations, loads; of other runs see `decide`
    record: Floats
    progress: Ints  # see STEPS


def hold_several(
    model: Ints,
    reals: Floats,
    data: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    peaks: Floats,
    places: Ints,
    controls: Floats,
    held_by: int,
    going: Ints,
    first: int,
    last: int,
) -> int:
    """A control step of the copies `first` to `last` - 1.

    Args: as of `runs.run_several`; where the numbers have the controls, these of each copy, how
    many it has; which come to the end of the step.
    """
    for k in range(first, last):
        for number in range(held_by):
            reals[places[number]] = controls[held_by * k + number]
        m = motion_of(model, reals, data, sizes, clocks, counts, peaks, places, k)
        going[k] = 1 if held(m, at(states, model[MODEL.STATE_SIZE] * k), False) else 0
    return OUTCOME.OK


def motion_of(
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
    """Of one of several, which has no reports, log, events and watches."""
    peak = at(peaks, 2 * k * model[MODEL.CONTACTS])
    clock, count = at(clocks, 2 * k), at(counts, COUNTED * k)
    return Motion(
        model, reals, data, sizes, clock, count, peak, peak, peak, peak, peak, peak, unused, peak
    )


def held(m: Motion, y: Floats, is_going: bool) -> bool:
    """Whether a state has gone on to the end of a control step. Each is a run of its own: no method knows what was."""
    m.clock[0] = 0.0
    for k in range(COUNTED):
        m.counts[k] = 0
    return run(m, y, is_going) == DONE and is_finite(m.model[MODEL.STATE_SIZE], y)


def walk_several(
    model: Ints,
    reals: Floats,
    data: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    peaks: Floats,
    senses: Ints,
    known: Floats,
    driven: Ints,
    plan: Ints,
    numbers: Floats,
    criteria: Ints,
    bounds: Floats,
    room: Floats,
    rows: Floats,
    excitations: Floats,
    record: Floats,
    progress: Ints,
    order: int,
    first: int,
    last: int,
) -> int:
    """The walks `first` to `last` - 1 by an order, see FEEL, each on its own rows; the first of all is recorded.

    Args: as of `runs.run_several`, which has reports, logs and watches besides, and of `Walk`.

    Returns:
        What an evaluation says where something is only felt.
    """
    size, status = model[MODEL.STATE_SIZE], OUTCOME.OK
    for k in range(first, last):
        m = motion_of(model, reals, data, sizes, clocks, counts, peaks, senses, k)
        walk = Walk(
            m,
            senses,
            known,
            driven,
            plan,
            at(numbers, plan[REFLEXES.NUMBERS] * k),
            criteria,
            bounds,
            at(room, plan[REFLEXES.ROOM] * k),
            at(rows, senses[SENSES.SIZE] * k),
            at(excitations, senses[SENSES.CONTROLS] * k),
            record,
            at(progress, COUNTS * k),
        )
        y = at(states, size * k)
        if order < 0:
            status = max(status, begun(walk, y, order))
        else:
            go(walk, y, order, k == 0)
    return status


def begun(a: Walk, y: Floats, order: int) -> int:
    """Feel what is at a state, and begin what is to begin."""
    m = a.m
    for k in range(a.senses[SENSES.CONTROLS]):
        m.reals[a.driven[k]] = 0.0
    status = evaluated(m, 0.0, y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
    if status != OUTCOME.OK:
        return status
    feel(m.model, m.data, y, a.senses, a.known, a.row)
    if order == BEGIN:
        for k in range(LEGS):
            a.room[k] = UNKNOWN if a.plan[REFLEXES.HAS_STATES] > 0 else EARLY_STANCE
        a.progress[STEPS], a.progress[FRAMES], a.progress[GOING], a.progress[FORCES] = 0, 1, 1, 0
        note_senses(m.model, m.data, a.plan, a.numbers, 0, a.row, at(a.room, LEGS))
        excite(a)
    elif order == START:
        begin_criteria(a.senses, a.criteria, a.row, judged_room(a))
    return status


def go(a: Walk, y: Floats, steps: int, is_recorded: bool) -> None:
    """So many control steps at most.

    As in SCONE each can begin with the derivative that the one before has ended with, which knows
    its excitations only.
    """
    m, progress, lags = a.m, a.progress, a.known[SENSED.LAGS] > 0.0
    size, controls = m.model[MODEL.STATE_SIZE], a.senses[SENSES.CONTROLS]
    if lags:
        hold(a)
        before = at(m.data, m.model[MODEL.WORK_STATE])
        copy(size, y, before)
        evaluated(m, a.known[SENSED.STEP], before, at(before, size), STAGE.ACCELERATION)
    for number in range(steps):
        if progress[GOING] == 0:
            return
        excite(a)
        if is_recorded:
            record = at(a.record, (size + controls + a.senses[SENSES.LEGS]) * number)
            copy(size, y, record)
            copy(controls, a.excitations, at(record, size))
            copy(
                a.senses[SENSES.LEGS],
                at(a.row, a.senses[SENSES.LOADS]),
                at(record, size + controls),
            )
        hold(a)
        goes_on = held(m, y, lags)
        progress[STEPS] += 1
        progress[FORCES] += m.counts[EVALUATIONS]
        if not goes_on:
            progress[GOING] = 0
            return
        if m.model[MODEL.CONTACTS] == 0 and m.data[m.sizes[METHOD_AT] + HAS_DERIVATIVE] > 0.0:
            # The method has not looked at the forces at the end.
            evaluated(m, m.clock[0], y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
        feel(m.model, m.data, y, a.senses, a.known, a.row)
        note_senses(m.model, m.data, a.plan, a.numbers, progress[FRAMES], a.row, at(a.room, LEGS))
        progress[FRAMES] += 1
        t = progress[STEPS] * a.known[SENSED.STEP]
        if judged(a.senses, a.known, a.criteria, a.bounds, t, a.row, a.excitations, judged_room(a)):
            progress[GOING] = 0


def hold(a: Walk) -> None:
    """Give the actuators their controls."""
    for k in range(a.senses[SENSES.CONTROLS]):
        a.m.reals[a.driven[k]] = a.excitations[k]


def judged_room(a: Walk) -> Floats:
    """The room of the criteria."""
    return at(a.room, LEGS + a.plan[REFLEXES.KEPT] * a.plan[REFLEXES.SENSORS])


def excite(a: Walk) -> None:
    """What reflexes drive the actuators by, within bounds; the states of the legs go on."""
    history, frames, count = at(a.room, LEGS), a.progress[FRAMES], a.senses[SENSES.CONTROLS]
    if a.plan[REFLEXES.HAS_STATES] > 0:
        go_on(a.senses, a.plan, a.numbers, frames, a.row, history, a.room)
    for k in range(count):
        a.excitations[k] = 0.0
    add_reflexes(a.plan, a.numbers, frames, history, a.room, a.excitations)
    add_noise(a.plan, a.numbers, a.progress[STEPS], count, a.excitations)
    least = at(a.known, SENSED.HEAD + 2 * a.senses[SENSES.MUSCLES])
    most = at(least, count)
    for k in range(count):
        a.excitations[k] = min(max(a.excitations[k], least[k]), most[k])


def run_by_reflexes(
    model: Ints,
    reals: Floats,
    data: Floats,
    each: int,
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
    senses: Ints,
    known: Floats,
    driven: Ints,
    plan: Ints,
    numbers: Floats,
    room: Floats,
    rows: Floats,
    excitations: Floats,
    record: Floats,
    progress: Ints,
    first: int,
    last: int,
) -> int:
    """The runs `first` to `last` - 1, as `run_several` computes them, each by reflexes of its own.

    Args: as of `run_several`, and of `Walk`: one row for each run.
    """
    for k in range(first, last):
        m = run_of(
            model,
            reals,
            data,
            each,
            sizes,
            clocks,
            counts,
            states,
            times,
            reports,
            log,
            forces,
            events,
            peaks,
            watches,
            levels,
            k,
        )
        walk = Walk(
            m,
            senses,
            at(known, senses[SENSES.KNOWN] * k),
            driven,
            plan,
            at(numbers, plan[REFLEXES.NUMBERS] * k),
            plan,
            numbers,
            at(room, plan[REFLEXES.ROOM] * k),
            at(rows, senses[SENSES.SIZE] * k),
            at(excitations, senses[SENSES.CONTROLS] * k),
            at(record, plan[REFLEXES.ROWS] * k * decided_size(senses, plan)),
            at(progress, COUNTS * k),
        )
        endings[k] = run_on(walk, at(states, k * model[MODEL.STATE_SIZE]))
    return OUTCOME.OK


def decided_size(senses: Ints, plan: Ints) -> int:
    """How many numbers are recorded of a control step."""
    return int(plan[REFLEXES.SENSORS] + LEGS + senses[SENSES.CONTROLS] + 1)


def run_on(a: Walk, y: Floats) -> int:
    """Go on from the state y, as `run` does, with controls that are new at each control step, also at the very end."""
    m, progress = a.m, a.progress
    h = at(m.data, m.sizes[METHOD_AT])
    end, ending = h[LAST_TIME], DONE
    while ending == DONE:
        if m.clock[0] >= progress[STEPS] * a.known[SENSED.STEP] and not decide(a, y):
            ending = FAILED
        elif m.clock[0] >= end:
            break
        else:
            hold(a)
            h[LAST_TIME] = min(progress[STEPS] * a.known[SENSED.STEP], end)
            ending = run(m, y, False)
    h[LAST_TIME] = end
    return ending


def decide(a: Walk, y: Floats) -> bool:
    """Begin a control step, and record it: what sensors were remembered, states of the legs,
    controls, and the step that the method would try next; whether the forces could be computed.
    """
    m, progress, sensors = a.m, a.progress, a.plan[REFLEXES.SENSORS]
    # No method knows what was, as the motion has a kink here.
    at(m.data, m.sizes[METHOD_AT])[MEMORY] = 0.0
    hold(a)
    m.counts[EVALUATIONS] += 1
    if (
        evaluated(m, m.clock[0], y, at(m.data, m.model[MODEL.WORK_STATE]), STAGE.FORCE)
        != OUTCOME.OK
    ):
        return False
    feel(m.model, m.data, y, a.senses, a.known, a.row)
    note_senses(m.model, m.data, a.plan, a.numbers, progress[FRAMES], a.row, at(a.room, LEGS))
    progress[FRAMES] += 1
    excite(a)
    row = progress[STEPS] - a.plan[REFLEXES.FIRST]
    if row < a.plan[REFLEXES.ROWS]:
        record = at(a.record, row * decided_size(a.senses, a.plan))
        kept = sensors * ((progress[FRAMES] - 1) % a.plan[REFLEXES.KEPT])
        copy(sensors, at(a.room, LEGS + kept), record)
        copy(LEGS, a.room, at(record, sensors))
        copy(a.senses[SENSES.CONTROLS], a.excitations, at(record, sensors + LEGS))
        record[decided_size(a.senses, a.plan) - 1] = m.clock[1]
    progress[STEPS] += 1
    return True
