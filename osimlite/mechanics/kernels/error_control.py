"""How large the error of a step is, and where constraints hold: what all integrators judge a step by."""

from __future__ import annotations

from math import inf, isfinite, sqrt

from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, OUTCOME, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, call

LAST_TIME, ACCEPTED, COUNTED_Q, COUNTED_U, SHORTEST, LONGEST = 0, 1, 2, 3, 4, 5
"""What does not change: time that may be reached at most (s); what the error of a step may be, and
what the sums of the squared errors of values and of speeds are divided by, see `error_norm`; bounds
of Merson's steps (s), of which the shortest is taken whatever its error.
"""
REACHED, NEXT_STEP = 6, 7
"""Time (s) at the start of the step, and at its end if it was taken; step to try, and to try next."""
EVALUATED, HAS_DERIVATIVE = 8, 9
"""How many evaluations it took; whether the derivative at the end was put behind y1."""
IS_EVALUATED = 10
"""Whether the last evaluation was that of the start of the step."""
MEMORY = 11
"""From here on a method keeps what it likes from step to step; it begins anew where the first of that is 0."""

ERRORS = 4
"""Place of the errors, in states after WORK_STATE."""


PATIENCE = 10_000
"""Steps that may be tried before a motion that gets nowhere is given up."""


def shortest_step(t: float, tried: float) -> float:
    """The shortest step to take at a time t (s) after so many that were tried.

    As in Simbody, the first steps from 0 may be of any length. OpenSim goes on with such steps for
    ever; here they end.
    """
    return max(2.0**-52 * abs(t), 1e-300) if tried < PATIENCE else 4.0 * 2.0**-52 * max(1.0, abs(t))


def weight(value: float) -> float:
    """What the error of a speed or an auxiliary state counts that has this value at the start of the step."""
    return 1.0 / abs(value) if abs(value) > 1.0 else 1.0


def next_step_size(h: float, error: float, accuracy: float, cut: bool, order: float) -> float:
    """Step to try after one of size h, as Simbody chooses it; less than h if and only if error > accuracy.

    The estimated error goes with a power of h, so 0.9 h (accuracy / error)^(1/order) should just
    do. That is taken if it is at least a fifth more or, after a failure, a tenth less; never more
    than five times or less than a tenth of h.

    Args:
        h: step just tried, s.
        error: norm of its estimated error; infinite or not a number after a failed evaluation.
        accuracy: what the error may be.
        cut: whether the step was cut short by a limit, so that it is no ground for a larger one.
        order: of the error.
    """
    if not isfinite(error):
        return 0.1 * h
    if error > accuracy:
        wanted: float = 0.9 * h * (accuracy / error) ** (1.0 / order)
        return max(min(wanted, 0.9 * h), 0.1 * h)
    wanted = 0.9 * h * (accuracy / error) ** (1.0 / order) if error > 0.0 else inf
    return h if cut or wanted < 1.2 * h else min(wanted, 5.0 * h)


def step_end(h: Floats) -> float:
    """Where a step leads to. One that all but reaches the limit goes there."""
    t0, limit, step = h[REACHED], h[LAST_TIME], h[NEXT_STEP]
    return limit if limit <= t0 + 1.001 * step else t0 + step


def judge(h: Floats, t1: float, error: float, order: float) -> None:
    """Take or leave a step to t1 by its error of an order, and choose the next one."""
    limit, step, accuracy = h[LAST_TIME], h[NEXT_STEP], h[ACCEPTED]
    # A step cut much shorter tells nothing about the next.
    cut = limit < h[REACHED] + 0.95 * step
    h[NEXT_STEP] = min(
        max(next_step_size(step, error, accuracy, cut, order), h[SHORTEST]), h[LONGEST]
    )
    # The shortest step that is allowed is taken whatever its error, as in Simbody.
    if error <= accuracy or (step <= h[SHORTEST] and error < inf):
        h[REACHED] = t1


def projected(
    model: Ints,
    reals: Floats,
    data: Floats,
    t: float,
    y: Floats,
    off: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> bool:
    """Move a state to where the constraints hold, and tell whether they do; see `projection.project`."""
    data[WORK.TIME], data[WORK.SCRATCH], data[WORK.SCRATCH + 1] = t, tolerance, limit
    return (
        call(
            model[MODEL.LAWS + model[model[MODEL.CONSTRAINED] + CONSTRAINED.PROJECT]],
            model,
            reals,
            data,
            y,
            off,
            has_errors,
        )
        == OUTCOME.OK
    )


def step_error(
    model: Ints,
    reals: Floats,
    data: Floats,
    t1: float,
    y0: Floats,
    y1: Floats,
    errors: Floats,
    h: Floats,
    is_strict: int,
) -> float:
    """The norm of the errors of a step, once its end was moved to where the constraints hold; see `error_norm`."""
    error = error_norm(model, y0, errors, h, is_strict)
    # As in Simbody: what half a step would not mend, neither does the projection.
    if model[MODEL.CONSTRAINED] == 0 or not error <= 16.0 * h[ACCEPTED]:
        return error
    tolerance = h[ACCEPTED] / 10.0
    for k in range(model[MODEL.STATE_SIZE]):
        errors[k] = abs(errors[k])
    if not projected(
        model, reals, data, t1, y1, errors, 1, tolerance, max(2.0 * tolerance, sqrt(tolerance))
    ):
        return inf
    return error_norm(model, y0, errors, h, is_strict)


def error_norm(model: Ints, y0: Floats, errors: Floats, h: Floats, is_strict: int) -> float:
    """Largest of three root mean squares: errors of q as they are, of u and z relative to y0 where |y0| > 1.

    That is Simbody's norm. A fiber among those of many muscles can err much in it. An explicit
    method brings such a one back, since it has to take short steps; implicit ones may not, and are
    strict: of z, the largest error counts.

    Args:
        model: the mechanism.
        y0: state at the start of the step.
        errors: of its end.
        h: place of the method.
        is_strict: whether the largest error of z counts.
    """
    n, size = model[MODEL.DOFS], model[MODEL.STATE_SIZE]
    of_q = of_u = of_z = 0.0
    for k in range(n):
        of_q += errors[k] * errors[k]
    for k in range(n, 2 * n):
        weighted = weight(y0[k]) * errors[k]
        of_u += weighted * weighted
    for k in range(2 * n, size):
        weighted = weight(y0[k]) * errors[k]
        square = weighted * weighted
        of_z = max(of_z, square) if is_strict else of_z + square
    of_q /= max(h[COUNTED_Q], 1.0)
    of_u /= max(h[COUNTED_U], 1.0)
    if not is_strict:
        of_z /= max(size - 2 * n, 1)
    return sqrt(max(of_q, of_u, of_z)) if isfinite(of_q + of_u + of_z) else inf
