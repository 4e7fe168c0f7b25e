"""Two half steps of semi-explicit Euler, as Simbody's SemiExplicitEuler2Integrator takes its steps.

Speeds and auxiliary states go on by their rates, and then values by the rates that the new speeds give them where they
were. What two half steps differ from one whole is the error; the end of the half steps is kept as it is.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.kernels.error_control import error_norm, judge, projected, step_end
from osimlite.kernels.layout import LINK, MODEL, MOTION, OPERATION, OUTCOME, STAGE, WORK
from osimlite.kernels.method import ACCEPTED, ERRORS, EVALUATED, HAS_DERIVATIVE, MEMORY, REACHED
from osimlite.kernels.parts import link_ints, operation_ints
from osimlite.kernels.pointers import Floats, Ints, at, call

HEAD, STATES, IS_IMPLICIT = MEMORY + 1, 3, False
ORDER = 2.0
"""Of the error."""


def euler2(s: Ints, x: Floats, w: Floats, y0: Floats, y1: Floats, place: int) -> int:
    """Try one step from y0, behind which its derivative stands, to y1."""
    h = at(w, place)
    size = s[MODEL.STATE_SIZE]
    errors, whole = at(w, s[MODEL.WORK_STATE] + ERRORS * size), at(h, HEAD)
    t0, t1, tolerance = h[REACHED], step_end(h), h[ACCEPTED] / 10.0
    h[EVALUATED], h[HAS_DERIVATIVE] = 1.0, 0.0
    error = inf
    if halved(s, x, w, t0, t1, y0, y1, whole, at(whole, size)) == OUTCOME.OK:
        for k in range(size):
            errors[k] = y1[k] - whole[k]
        # As in Simbody, whatever the error is, and the error is left as it is.
        if s[MODEL.CONSTRAINED] == 0 or projected(
            s, x, w, t1, y1, errors, 0, tolerance, max(2.0 * tolerance, sqrt(tolerance))
        ):
            error = error_norm(s, y0, errors, h, 0)
    judge(h, t1, error, ORDER)
    return OUTCOME.OK


def halved(
    s: Ints, x: Floats, w: Floats, t0: float, t1: float, y0: Floats, y1: Floats, whole: Floats, middle: Floats
) -> int:
    """Compute the end `whole` of one step, and y1 of two half ones; `middle` has room for two states."""
    size = s[MODEL.STATE_SIZE]
    f, half = at(middle, size), 0.5 * (t1 - t0)
    f0 = at(y0, size)
    status = advanced(s, x, w, t1, t1 - t0, y0, f0, whole, f)
    if status == OUTCOME.OK:
        status = advanced(s, x, w, t0 + half, half, y0, f0, middle, f)
    if status == OUTCOME.OK:
        w[WORK.TIME] = t0 + half
        status = call(s[MODEL.LAWS], s, x, w, middle, f, STAGE.ACCELERATION)
    if status == OUTCOME.OK:
        status = advanced(s, x, w, t1, half, middle, f, y1, at(y1, size))
    return status


def advanced(
    s: Ints, x: Floats, w: Floats, t: float, h: float, y: Floats, f: Floats, new: Floats, rates: Floats
) -> int:
    """The state `new` after a step h from y with the derivative f, at whose end it is t; `rates` is room."""
    n, size = s[MODEL.DOFS], s[MODEL.STATE_SIZE]
    for k in range(n, size):
        new[k] = y[k] + h * f[k]
    for k in range(n):
        new[k] = y[k]
    if has_balls(s):
        # Their rates depend on where they stand.
        w[WORK.TIME] = t
        status = call(s[MODEL.LAWS], s, x, w, new, rates, STAGE.VELOCITY)
        if status != OUTCOME.OK:
            return status
        for k in range(n):
            new[k] = y[k] + h * rates[k]
    else:
        for k in range(n):
            new[k] = y[k] + h * new[n + k]
    return OUTCOME.OK


def has_balls(s: Ints) -> bool:
    """Whether rates of some values are not their speeds."""
    for link in range(s[MODEL.LINKS]):
        i = link_ints(s, link)
        for operation in range(i[LINK.FIRST_OPERATION], i[LINK.END_OPERATION]):
            if operation_ints(s, operation)[OPERATION.MOTION] >= MOTION.BALL:
                return True
    return False
