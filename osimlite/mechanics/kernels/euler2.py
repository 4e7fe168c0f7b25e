"""Two half steps of semi-explicit Euler, as Simbody's SemiExplicitEuler2Integrator takes its steps.

Speeds and auxiliary states go on by their rates, and then values by the rates that the new speeds
give them where they were. What two half steps differ from one whole is the error; the end of the
half steps is kept as it is.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.mechanics.kernels.error_control import (
    ACCEPTED,
    ERRORS,
    EVALUATED,
    HAS_DERIVATIVE,
    MEMORY,
    REACHED,
    error_norm,
    judge,
    projected,
    step_end,
)
from osimlite.mechanics.kernels.layout import LINK, MODEL, MOTION, OPERATION, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.kernels.points import link_ints, operation_ints

HEAD, STATES, IS_IMPLICIT = MEMORY + 1, 3, False
ORDER = 2.0
"""Of the error."""


def euler2(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, place: int) -> int:
    """Try one step from y0, behind which its derivative stands, to y1."""
    h = at(data, place)
    size = model[MODEL.STATE_SIZE]
    errors, whole = at(data, model[MODEL.WORK_STATE] + ERRORS * size), at(h, HEAD)
    t0, t1, tolerance = h[REACHED], step_end(h), h[ACCEPTED] / 10.0
    h[EVALUATED], h[HAS_DERIVATIVE] = 1.0, 0.0
    error = inf
    if halved(model, reals, data, t0, t1, y0, y1, whole, at(whole, size)) == OUTCOME.OK:
        for k in range(size):
            errors[k] = y1[k] - whole[k]
        # As in Simbody, whatever the error is, and the error is left as it is.
        if model[MODEL.CONSTRAINED] == 0 or projected(
            model, reals, data, t1, y1, errors, 0, tolerance, max(2.0 * tolerance, sqrt(tolerance))
        ):
            error = error_norm(model, y0, errors, h, 0)
    judge(h, t1, error, ORDER)
    return OUTCOME.OK


def halved(
    model: Ints,
    reals: Floats,
    data: Floats,
    t0: float,
    t1: float,
    y0: Floats,
    y1: Floats,
    whole: Floats,
    middle: Floats,
) -> int:
    """Compute the end `whole` of one step, and y1 of two half ones; `middle` has room for two states."""
    size = model[MODEL.STATE_SIZE]
    f, half = at(middle, size), 0.5 * (t1 - t0)
    f0 = at(y0, size)
    status = advanced(model, reals, data, t1, t1 - t0, y0, f0, whole, f)
    if status == OUTCOME.OK:
        status = advanced(model, reals, data, t0 + half, half, y0, f0, middle, f)
    if status == OUTCOME.OK:
        data[WORK.TIME] = t0 + half
        status = call(model[MODEL.LAWS], model, reals, data, middle, f, STAGE.ACCELERATION)
    if status == OUTCOME.OK:
        status = advanced(model, reals, data, t1, half, middle, f, y1, at(y1, size))
    return status


def advanced(
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
    """The state `new` after a step h from y with the derivative f, at whose end it is t; `rates` is room."""
    n, size = model[MODEL.DOFS], model[MODEL.STATE_SIZE]
    for k in range(n, size):
        new[k] = y[k] + h * f[k]
    for k in range(n):
        new[k] = y[k]
    if has_balls(model):
        # Their rates depend on where they stand.
        data[WORK.TIME] = t
        status = call(model[MODEL.LAWS], model, reals, data, new, rates, STAGE.VELOCITY)
        if status != OUTCOME.OK:
            return status
        for k in range(n):
            new[k] = y[k] + h * rates[k]
    else:
        for k in range(n):
            new[k] = y[k] + h * new[n + k]
    return OUTCOME.OK


def has_balls(model: Ints) -> bool:
    """Whether rates of some values are not their speeds."""
    for link in range(model[MODEL.LINKS]):
        i = link_ints(model, link)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            if operation_ints(model, operation)[OPERATION.MOTION] >= MOTION.BALL:
                return True
    return False
