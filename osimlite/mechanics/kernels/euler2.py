"""Semi-explicit Euler steps with step doubling, as in Simbody's SemiExplicitEuler2Integrator.

Speeds and auxiliary states advance by their rates at the start; then coordinates advance by the
rates that the new speeds give at the old coordinates. The error is the difference of two half steps
from one full step; the result is that of the half steps.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.mechanics.kernels.error_control import (
    ERRORS,
    METHOD_WORK,
    error_norm,
    judge_step,
    project_by_law,
    step_end,
)
from osimlite.mechanics.kernels.layout import LINK, MODEL, MOTION, OPERATION, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_ints, operation_ints

HEAD = METHOD_WORK.MEMORY + 1
"""Length of the head of the method's record, see `error_control`."""
STATES = 3
"""Number of states of workspace after it."""
IS_IMPLICIT = False
"""Whether the method needs derivatives of the forces."""
ORDER = 2.0
"""Order of the error."""


def euler2(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int) -> int:
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
    size = model[MODEL.STATE_SIZE]
    errors = at(data, model[MODEL.WORK_STATE] + ERRORS * size)
    full_step_end = at(h, HEAD)
    # Constraints hold to a tenth of the accuracy, as in Simbody.
    t0 = h[METHOD_WORK.REACHED]
    t1 = step_end(h)
    tolerance = h[METHOD_WORK.ACCEPTED] / 10.0
    h[METHOD_WORK.EVALUATED], h[METHOD_WORK.HAS_DERIVATIVE] = 1.0, 0.0
    error = inf
    if (
        take_half_steps(model, reals, data, t0, t1, y0, y1, full_step_end, at(full_step_end, size))
        == OUTCOME.OK
    ):
        for k in range(size):
            errors[k] = y1[k] - full_step_end[k]
        # As in Simbody, project whatever the error is, and keep the error unchanged.
        if model[MODEL.CONSTRAINED] == 0 or project_by_law(
            model, reals, data, t1, y1, errors, 0, tolerance, max(2.0 * tolerance, sqrt(tolerance))
        ):
            error = error_norm(model, y0, errors, h, 0)
    judge_step(h, t1, error, ORDER)
    return OUTCOME.OK


def take_half_steps(
    model: Ints,
    reals: Floats,
    data: Floats,
    t0: float,
    t1: float,
    y0: Floats,
    y1: Floats,
    full_step_end: Floats,
    middle: Floats,
) -> int:
    """Compute the end of one full step and of two half steps.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t0: time at the start (s).
        t1: time at the end (s).
        y0: state at the start, then its derivative.
        y1: filled with the end of the two half steps.
        full_step_end: filled with the end of the full step.
        middle: workspace of two states.

    Returns:
        `OUTCOME.OK`, or the outcome of an evaluation that failed.
    """
    size = model[MODEL.STATE_SIZE]
    f = at(middle, size)
    half = 0.5 * (t1 - t0)
    f0 = at(y0, size)
    # Both first evaluations share the derivative at the start, so that a step costs one evaluation.
    status = advance_state(model, reals, data, t1, t1 - t0, y0, f0, full_step_end, f)
    if status == OUTCOME.OK:
        status = advance_state(model, reals, data, t0 + half, half, y0, f0, middle, f)
    if status == OUTCOME.OK:
        data[WORK.TIME] = t0 + half
        status = call(model[MODEL.LAWS], model, reals, data, middle, f, STAGE.ACCELERATION)
    if status == OUTCOME.OK:
        status = advance_state(model, reals, data, t1, half, middle, f, y1, at(y1, size))
    return status


def advance_state(
    model: Ints,
    reals: Floats,
    data: Floats,
    t: float,
    h: float,
    y: Floats,
    f: Floats,
    new: Floats,
    rates: Floats,
) -> int:
    """Compute the state after a step of semi-explicit Euler.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t: time at the end of the step (s).
        h: step (s).
        y: state at the start.
        f: rates of the state y.
        new: filled with the state at the end.
        rates: workspace of a state.

    Returns:
        `OUTCOME.OK`, or the outcome of an evaluation that failed.
    """
    n, size = model[MODEL.DOFS], model[MODEL.STATE_SIZE]
    # Speeds and auxiliary states by the derivative at the start.
    for k in range(n, size):
        new[k] = y[k] + h * f[k]
    for k in range(n):
        new[k] = y[k]
    if has_balls(model):
        # Rates of ball joints depend on their angles.
        data[WORK.TIME] = t
        status = call(model[MODEL.LAWS], model, reals, data, new, rates, STAGE.VELOCITY)
        if status != OUTCOME.OK:
            return status
        for k in range(n):
            new[k] = y[k] + h * rates[k]
    else:
        # Coordinates by the new speeds, which makes the method symplectic for conservative forces.
        for k in range(n):
            new[k] = y[k] + h * new[n + k]
    return OUTCOME.OK


def has_balls(model: Ints) -> bool:
    """Return whether the rates of some coordinates differ from their speeds."""
    for link in range(model[MODEL.LINKS]):
        i = link_ints(model, link)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            if operation_ints(model, operation)[OPERATION.MOTION] >= MOTION.BALL:
                return True
    return False
