"""Runge-Kutta-Merson of order 4, with the steps of Simbody's RungeKuttaMersonIntegrator.

The arithmetic follows Simbody's bit by bit, so that step sizes are the same. With stages at 0, 1/3,
1/3, 1/2 and 1 of a step h and derivatives f0, fa, fb, fc, fd, the result is y0 + h / 6 (f0 + 4 fc +
fd). Source: R. H. Merson, An operational method for the study of integration processes, 1957.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.error_control import (
    ERRORS,
    METHOD_WORK,
    judge_step,
    project_and_measure,
    step_end,
)
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call

HEAD = METHOD_WORK.MEMORY + 1
"""Length of the head of the method's record, see `error_control`."""
STATES = 3
"""Number of states of workspace after it."""
IS_IMPLICIT = False
"""Whether the method needs derivatives of the forces."""
ORDER = 4.0
"""Order of the error."""


def merson(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int) -> int:
    """Try one step from y0, which is followed by its derivative, to y1.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y0: state at the start, then its derivative.
        y1: filled with the state at the end.
        offset: offset of the method's record in data.

    Returns:
        `OUTCOME.OK`; the record says whether the step was accepted.
    """
    h = at(data, offset)
    errors = at(data, model[MODEL.WORK_STATE] + ERRORS * model[MODEL.STATE_SIZE])
    stages = at(h, HEAD)
    t0 = h[METHOD_WORK.REACHED]
    t1 = step_end(h)
    h[METHOD_WORK.EVALUATED], h[METHOD_WORK.HAS_DERIVATIVE] = 4.0, 0.0
    error = inf
    if compute_stages(model, reals, data, t0, t1, y0, y1, errors, stages) == OUTCOME.OK:
        error = project_and_measure(model, reals, data, t1, y0, y1, errors, h, 0)
    judge_step(h, t1, error, ORDER)
    return OUTCOME.OK


def compute_stages(
    model: Ints,
    reals: Floats,
    data: Floats,
    t0: float,
    t1: float,
    y0: Floats,
    y1: Floats,
    ya: Floats,
    stages: Floats,
) -> int:
    """Compute the stages, the state at the end and its errors.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t0: time at the start (s).
        t1: time at the end (s).
        y0: state at the start, then its derivative.
        y1: filled with the state at the end.
        ya: filled with the errors of y1.
        stages: workspace of three states.

    Returns:
        `OUTCOME.OK`, or the outcome of an evaluation that failed.
    """
    size = model[MODEL.STATE_SIZE]
    h = t1 - t0
    f0 = at(y0, size)
    fa = stages
    fb = at(stages, size)
    fc = at(stages, 2 * size)
    for stage in range(4):
        # Choose the argument and the time of the next evaluation.
        f, t = fa, t1
        if stage == 0:
            c = h / 3.0
            t = t0 + c
            for k in range(size):
                ya[k] = y0[k] + c * f0[k]
        elif stage == 1:
            c = h / 6.0
            f = fb
            t = t0 + h / 3.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] + fa[k])
        elif stage == 2:
            c = h / 8.0
            f = fc
            t = t0 + h / 2.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] + 3.0 * fb[k])
        else:
            # This embedded result has an error of one order less than y1.
            c = h / 2.0
            for k in range(size):
                ya[k] = y0[k] + c * (f0[k] - 3.0 * fb[k] + 4.0 * fc[k])
        data[WORK.TIME] = t
        status = call(model[MODEL.LAWS], model, reals, data, ya, f, STAGE.ACCELERATION)
        if status != OUTCOME.OK:
            return status
    c = h / 6.0
    for k in range(size):
        y1[k] = y0[k] + c * (f0[k] + 4.0 * fc[k] + fa[k])
        # Divide each entry by five, not the norm, so that all roundings and steps are Simbody's.
        ya[k] = 0.2 * (y1[k] - ya[k])
    return OUTCOME.OK
