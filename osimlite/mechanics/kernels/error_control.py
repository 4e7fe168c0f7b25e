"""How large the error of a step is, and where constraints hold: what all integrators judge a step by."""

from __future__ import annotations

from math import inf, isfinite, sqrt

from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, OUTCOME, WORK
from osimlite.mechanics.kernels.method import (
    ACCEPTED,
    COUNTED_Q,
    COUNTED_U,
    LAST_TIME,
    LONGEST,
    NEXT_STEP,
    REACHED,
    SHORTEST,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, call
from osimlite.mechanics.kernels.step_sizes import next_step_size, weight


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
