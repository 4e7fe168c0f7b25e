"""Motions of copies whose controls are held for a step, and whole walks in one call.

A walk are control steps of reflexes, the motion between, what is felt, and how it is judged.
"""

from __future__ import annotations

from typing import NamedTuple

from osimlite.kernels.criteria import begin_criteria, judged
from osimlite.kernels.layout import MODEL, OUTCOME, STAGE
from osimlite.kernels.method import HAS_DERIVATIVE
from osimlite.kernels.pointers import Floats, Ints, at
from osimlite.kernels.record import COUNTED, DONE, EVALUATIONS, METHOD_AT, Motion, evaluated
from osimlite.kernels.reflexes import EARLY_STANCE, REFLEXES, UNKNOWN, add_reflexes, go_on, note_senses
from osimlite.kernels.runs import run
from osimlite.kernels.senses import SENSED, SENSES, feel
from osimlite.kernels.states import copy, is_finite

FEEL, BEGIN, START = -1, -2, -3
"""Orders besides a number of control steps: to feel what is; then to begin reflexes and excite muscles by them, or to
begin criteria."""
STEPS, FRAMES, GOING, FORCES, COUNTS = range(5)
"""What is counted of a walk: control steps, rows that were felt, 1 while it goes on, evaluations of the forces."""
LEGS = 2
"""The room of a walk begins with the states of two legs; the history of the sensors follows, and that of criteria."""


class Walk(NamedTuple):
    """What a walk goes by and leaves behind."""

    m: Motion
    senses: Ints  # see `senses`
    known: Floats
    muscles: Ints  # where the numbers of the model have each control; where a state has each activation (2, m)
    plan: Ints  # see `reflexes`
    numbers: Floats
    criteria: Ints  # see `criteria`
    bounds: Floats
    room: Floats  # see LEGS
    row: Floats  # what is felt
    excitations: Floats  # that are held (m,)
    record: Floats  # of each control step the state at its start, excitations, loads
    progress: Ints  # see STEPS


def hold_several(
    s: Ints,
    x: Floats,
    w: Floats,
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

    Args: as of `runs.run_several`; where the numbers have the controls, these of each copy, how many it has; which come
    to the end of the step.
    """
    for k in range(first, last):
        for number in range(held_by):
            x[places[number]] = controls[held_by * k + number]
        m = motion_of(s, x, w, sizes, clocks, counts, peaks, places, k)
        going[k] = 1 if held(m, at(states, s[MODEL.STATE_SIZE] * k), False) else 0
    return OUTCOME.OK


def motion_of(
    s: Ints, x: Floats, w: Floats, sizes: Ints, clocks: Floats, counts: Ints, peaks: Floats, unused: Ints, k: int
) -> Motion:
    """Of one of several, which has no reports, log, events and watches."""
    peak = at(peaks, 2 * k * s[MODEL.CONTACTS])
    clock, count = at(clocks, 2 * k), at(counts, COUNTED * k)
    return Motion(s, x, w, sizes, clock, count, peak, peak, peak, peak, peak, peak, unused, peak)


def held(m: Motion, y: Floats, is_going: bool) -> bool:
    """Whether a state has gone on to the end of a control step. Each is a run of its own: no method knows what was."""
    m.clock[0] = 0.0
    for k in range(COUNTED):
        m.counts[k] = 0
    return run(m, y, is_going) == DONE and is_finite(m.s[MODEL.STATE_SIZE], y)


def walk_several(
    s: Ints,
    x: Floats,
    w: Floats,
    sizes: Ints,
    clocks: Floats,
    counts: Ints,
    states: Floats,
    peaks: Floats,
    senses: Ints,
    known: Floats,
    muscles: Ints,
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
    size, status = s[MODEL.STATE_SIZE], OUTCOME.OK
    for k in range(first, last):
        m = motion_of(s, x, w, sizes, clocks, counts, peaks, senses, k)
        walk = Walk(
            m,
            senses,
            known,
            muscles,
            plan,
            at(numbers, plan[REFLEXES.NUMBERS] * k),
            criteria,
            bounds,
            at(room, plan[REFLEXES.ROOM] * k),
            at(rows, senses[SENSES.SIZE] * k),
            at(excitations, senses[SENSES.MUSCLES] * k),
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
    for k in range(a.senses[SENSES.MUSCLES]):
        m.x[a.muscles[k]] = 0.0
    status = evaluated(m, 0.0, y, at(m.w, m.s[MODEL.WORK_STATE]), STAGE.FORCE)
    if status != OUTCOME.OK:
        return status
    feel(m.s, m.w, y, a.senses, a.known, a.row)
    if order == BEGIN:
        for k in range(LEGS):
            a.room[k] = UNKNOWN if a.plan[REFLEXES.HAS_STATES] > 0 else EARLY_STANCE
        a.progress[STEPS], a.progress[FRAMES], a.progress[GOING], a.progress[FORCES] = 0, 1, 1, 0
        note_senses(a.plan, 0, a.row, at(a.room, LEGS))
        excite(a)
    elif order == START:
        begin_criteria(a.senses, a.criteria, a.row, judged_room(a))
    return status


def go(a: Walk, y: Floats, steps: int, is_recorded: bool) -> None:
    """So many control steps at most.

    As in SCONE each can begin with the derivative that the one before has ended with, which knows its excitations only.
    """
    m, progress, lags = a.m, a.progress, a.known[SENSED.LAGS] > 0.0
    size, muscles = m.s[MODEL.STATE_SIZE], a.senses[SENSES.MUSCLES]
    if lags:
        hold(a)
        before = at(m.w, m.s[MODEL.WORK_STATE])
        copy(size, y, before)
        evaluated(m, a.known[SENSED.STEP], before, at(before, size), STAGE.ACCELERATION)
    for number in range(steps):
        if progress[GOING] == 0:
            return
        excite(a)
        if is_recorded:
            record = at(a.record, (size + muscles + a.senses[SENSES.LEGS]) * number)
            copy(size, y, record)
            copy(muscles, a.excitations, at(record, size))
            copy(a.senses[SENSES.LEGS], at(a.row, a.senses[SENSES.LOADS]), at(record, size + muscles))
        hold(a)
        goes_on = held(m, y, lags)
        progress[STEPS] += 1
        progress[FORCES] += m.counts[EVALUATIONS]
        if not goes_on:
            progress[GOING] = 0
            return
        if m.s[MODEL.CONTACTS] == 0 and m.w[m.sizes[METHOD_AT] + HAS_DERIVATIVE] > 0.0:
            # The method has not looked at the forces at the end.
            evaluated(m, m.clock[0], y, at(m.w, m.s[MODEL.WORK_STATE]), STAGE.FORCE)
        feel(m.s, m.w, y, a.senses, a.known, a.row)
        note_senses(a.plan, progress[FRAMES], a.row, at(a.room, LEGS))
        progress[FRAMES] += 1
        t = progress[STEPS] * a.known[SENSED.STEP]
        active = at(a.muscles, muscles)
        if judged(
            a.senses, a.known, a.criteria, a.bounds, t, a.row, active, y, a.excitations, judged_room(a)
        ):  # fmt: skip
            progress[GOING] = 0


def hold(a: Walk) -> None:
    """Give the muscles the excitations."""
    for k in range(a.senses[SENSES.MUSCLES]):
        a.m.x[a.muscles[k]] = a.excitations[k]


def judged_room(a: Walk) -> Floats:
    """The room of the criteria."""
    return at(a.room, LEGS + a.plan[REFLEXES.KEPT] * a.plan[REFLEXES.SENSORS])


def excite(a: Walk) -> None:
    """What reflexes excite the muscles by, within bounds; the states of the legs go on."""
    history, frames, count = at(a.room, LEGS), a.progress[FRAMES], a.senses[SENSES.MUSCLES]
    if a.plan[REFLEXES.HAS_STATES] > 0:
        go_on(a.senses, a.plan, a.numbers, frames, a.row, history, a.room)
    for k in range(count):
        a.excitations[k] = 0.0
    add_reflexes(a.plan, a.numbers, frames, history, a.room, a.excitations)
    least = at(a.known, SENSED.HEAD + 2 * count)
    for k in range(count):
        a.excitations[k] = min(max(a.excitations[k], least[k]), 1.0)
