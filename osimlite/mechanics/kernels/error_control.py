"""Record of an integration method, and control of the size of its steps by Simbody's rules.

A method is a law that tries one step, from a state y0, which is followed by its derivative, to y1.
It is called with the offset of its record in `data` as its last argument, and writes the errors of
the step at ERRORS. Its module states how many numbers and states it needs there (HEAD, STATES), and
whether it needs derivatives of the forces too (IS_IMPLICIT), which follow in the record.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt

from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, OUTCOME, WORK, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, call


class METHOD_WORK(metaclass=Record):
    """Head of the record of an integration method in data."""

    LAST_TIME = 0
    """Latest time that a step may reach (s)."""
    ACCEPTED = 1
    """Accuracy: the largest accepted error norm of a step."""
    COUNTED_Q = 2
    """Divisor of the sum of squared errors of the coordinates, see `error_norm`."""
    COUNTED_U = 3
    """Divisor of the sum of squared errors of the speeds, see `error_norm`."""
    SHORTEST = 4
    """Shortest step (s), which is accepted whatever its error."""
    LONGEST = 5
    """Longest step (s)."""
    REACHED = 6
    """Time at the start of the step (s); if the step is accepted, the time at its end."""
    NEXT_STEP = 7
    """Step to try (s), then the next step to try."""
    EVALUATED = 8
    """Number of evaluations that the step took."""
    HAS_DERIVATIVE = 9
    """1.0 if the method wrote the derivative at the end after y1, else 0.0."""
    IS_EVALUATED = 10
    """1.0 if the last evaluation was at the start of the step, else 0.0."""
    MEMORY = 11
    """Numbers that a method keeps between steps; it restarts where the first of them is 0."""


ERRORS = 4
"""Offset of the errors of a step after WORK_STATE, in states."""


MAX_STALLED_STEPS = 10_000
"""Number of tried steps after which a motion that makes no progress is abandoned."""


def shortest_step(t: float, tried: float) -> float:
    """Return the shortest step at a time t (s) after `tried` tried steps.

    As in Simbody, the first steps from t = 0 may have any length. OpenSim continues with such steps
    forever; here they end after MAX_STALLED_STEPS steps.

    Args:
        t: time (s).
        tried: number of tried steps of the run.
    """
    return (
        max(2.0**-52 * abs(t), 1e-300)
        if tried < MAX_STALLED_STEPS
        else 4.0 * 2.0**-52 * max(1.0, abs(t))
    )


def error_weight(value: float) -> float:
    """Return the weight of the error of a speed or auxiliary state.

    Simbody takes errors relative to the value at the start of the step where that is above 1.

    Args:
        value: value at the start of the step.
    """
    return 1.0 / abs(value) if abs(value) > 1.0 else 1.0


def next_step_size(
    h: float, error: float, accuracy: float, is_shortened: bool, order: float
) -> float:
    """Return the step to try after a step of size h, as Simbody chooses it.

    It is less than h if error > accuracy.

    The estimated error is proportional to a power of h, so that 0.9 h (accuracy / error)^(1/order)
    should just meet the accuracy. That is used if it is at least a fifth longer or, after a failure, a
    tenth shorter; the factor is limited to the range 0.1 to 5.

    Args:
        h: step just tried (s).
        error: norm of the estimated error of this step; infinite or not a number after a failed
            evaluation.
        accuracy: accepted error norm.
        is_shortened: whether the step was shortened by a limit, so that it cannot justify a longer one.
        order: order of the error.
    """
    # A step that failed says nothing about the error: reduce it tenfold.
    if not isfinite(error):
        return 0.1 * h
    if error > accuracy:
        proposed_step: float = 0.9 * h * (accuracy / error) ** (1.0 / order)
        return max(min(proposed_step, 0.9 * h), 0.1 * h)
    proposed_step = 0.9 * h * (accuracy / error) ** (1.0 / order) if error > 0.0 else inf
    # Keep the step unless it may grow by a fifth, as changes cost implicit methods a factorization.
    return h if is_shortened or proposed_step < 1.2 * h else min(proposed_step, 5.0 * h)


def step_end(h: Floats) -> float:
    """Return the time at which a step ends (s).

    A step that almost reaches the limit is extended to it.
    """
    # The extension avoids a tiny last step.
    t0, limit, step = h[METHOD_WORK.REACHED], h[METHOD_WORK.LAST_TIME], h[METHOD_WORK.NEXT_STEP]
    return limit if limit <= t0 + 1.001 * step else t0 + step


def judge_step(h: Floats, t1: float, error: float, order: float) -> None:
    """Accept or reject a step by its error, and choose the next one.

    Args:
        h: record of the method.
        t1: time at the end of the step (s).
        error: norm of the error of the step.
        order: order of the error.
    """
    limit = h[METHOD_WORK.LAST_TIME]
    step = h[METHOD_WORK.NEXT_STEP]
    accuracy = h[METHOD_WORK.ACCEPTED]
    # A step that was cut much shorter is no basis for the size of the next one.
    is_shortened = limit < h[METHOD_WORK.REACHED] + 0.95 * step
    h[METHOD_WORK.NEXT_STEP] = min(
        max(next_step_size(step, error, accuracy, is_shortened, order), h[METHOD_WORK.SHORTEST]),
        h[METHOD_WORK.LONGEST],
    )
    # As in Simbody, the shortest allowed step is accepted whatever its error.
    if error <= accuracy or (step <= h[METHOD_WORK.SHORTEST] and error < inf):
        h[METHOD_WORK.REACHED] = t1


def project_by_law(
    model: Ints,
    reals: Floats,
    data: Floats,
    t: float,
    y: Floats,
    state_errors: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> bool:
    """Project a state onto the constraints by the law of the model.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t: time (s).
        y: state; changed.
        state_errors: estimated errors of the state, see `projection.project`.
        has_errors: 0 if no errors are known.
        tolerance: accepted errors of the constraints.
        limit: largest errors to start from.

    Returns:
        Whether the constraints hold afterwards.
    """
    data[WORK.TIME], data[WORK.SCRATCH], data[WORK.SCRATCH + 1] = t, tolerance, limit
    return (
        call(
            model[MODEL.LAWS + model[model[MODEL.CONSTRAINED] + CONSTRAINED.PROJECT]],
            model,
            reals,
            data,
            y,
            state_errors,
            has_errors,
        )
        == OUTCOME.OK
    )


def project_and_measure(
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
    """Project the end of a step onto the constraints and return the norm of its errors.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t1: time at the end of the step (s).
        y0: state at the start.
        y1: state at the end; projected onto the constraints.
        errors: estimated errors of y1; their component normal to the constraints is removed.
        h: record of the method.
        is_strict: whether the largest error of an auxiliary state counts, see `error_norm`.

    Returns:
        Norm of the errors, see `error_norm`; infinite if the projection fails. Where the norm is
        more than 16 times the accepted error, or the model has no constraints, the state is not
        projected.
    """
    error = error_norm(model, y0, errors, h, is_strict)
    # As in Simbody: a projection cannot repair an error that half a step would not.
    if model[MODEL.CONSTRAINED] == 0 or not error <= 16.0 * h[METHOD_WORK.ACCEPTED]:
        return error
    # A projection is exact to a tenth of the accuracy. It may start as far away as the square root
    # of that, as in Simbody.
    tolerance = h[METHOD_WORK.ACCEPTED] / 10.0
    # The projection removes the normal component of the absolute errors, as Simbody's does.
    for k in range(model[MODEL.STATE_SIZE]):
        errors[k] = abs(errors[k])
    if not project_by_law(
        model, reals, data, t1, y1, errors, 1, tolerance, max(2.0 * tolerance, sqrt(tolerance))
    ):
        return inf
    return error_norm(model, y0, errors, h, is_strict)


def error_norm(model: Ints, y0: Floats, errors: Floats, h: Floats, is_strict: int) -> float:
    """Return Simbody's norm of the errors of a step.

    It is the largest of three root mean squares: of the errors of q; of those of u and of z, relative
    to y0 where |y0| > 1. One fiber among those of many muscles may err much in this norm. An explicit
    method corrects it, since it has to take short steps; implicit ones may not. For these the norm is
    strict: the largest error of z counts.

    Args:
        model: integers of the model.
        y0: state at the start of the step.
        errors: errors of the state at its end.
        h: record of the method.
        is_strict: whether the largest error of z counts.
    """
    n, size = model[MODEL.DOFS], model[MODEL.STATE_SIZE]
    of_q = of_u = of_z = 0.0
    for k in range(n):
        of_q += errors[k] * errors[k]
    for k in range(n, 2 * n):
        weighted_error = error_weight(y0[k]) * errors[k]
        of_u += weighted_error * weighted_error
    for k in range(2 * n, size):
        weighted_error = error_weight(y0[k]) * errors[k]
        square = weighted_error * weighted_error
        of_z = max(of_z, square) if is_strict else of_z + square
    of_q /= max(h[METHOD_WORK.COUNTED_Q], 1.0)
    of_u /= max(h[METHOD_WORK.COUNTED_U], 1.0)
    if not is_strict:
        of_z /= max(size - 2 * n, 1)
    return sqrt(max(of_q, of_u, of_z)) if isfinite(of_q + of_u + of_z) else inf
