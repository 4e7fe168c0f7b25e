"""A Rosenbrock W-method of order 3 for stiff motion at loose tolerances.

It solves four linear systems per step and iterates nothing. The first two stages are at the start
of the step, so that a step takes two evaluations besides that at its end. The method is L-stable
and stiffly accurate. The conditions of order 3, and of order 2 for any approximation of the
Jacobian J, leave one free parameter, the diagonal (E. Hairer, G. Wanner, Solving Ordinary
Differential Equations II, chapters IV.6 and IV.7); a quarter is near the smallest stable value. The
terms that J of :mod:`osimlite.mechanics.kernels.condensation` omits therefore cost little accuracy.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.condensation import (
    condense_system,
    linearise_state,
    solve_condensed,
)
from osimlite.mechanics.kernels.error_control import ERRORS, METHOD_WORK, project_and_measure
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK, Record
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, copy_numbers, is_finite


class ROSENBROCK_WORK(metaclass=Record):
    """Memory of the method in its record, see `METHOD_WORK`."""

    IS_NEW = METHOD_WORK.MEMORY
    """1.0 if the derivatives are those at the start of the step."""


HEAD = METHOD_WORK.MEMORY + 1
"""Length of the head of the method's record, see `error_control`."""
IS_IMPLICIT = True
"""Whether the method needs derivatives of the forces."""

STAGES = 4
"""Number of stages."""
STATES = STAGES
"""Number of states of workspace: one per stage."""

DIAGONAL = 0.25
"""Diagonal coefficient gamma."""
ALPHA = (
    (0.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0),
    (1 / 3, 0.0, 0.0, 0.0),
    (43 / 56, 31 / 56, -9 / 28, 0.0),
)
"""Coefficients alpha_ij of the arguments of the stages."""
GAMMA = (
    (DIAGONAL, 0.0, 0.0, 0.0),
    (0.5, DIAGONAL, 0.0, 0.0),
    (-11 / 72, -7 / 72, DIAGONAL, 0.0),
    (-43 / 56, -31 / 56, 15 / 14, DIAGONAL),
)
"""Coefficients gamma_ij of the products with J."""
WEIGHTS = (0.0, 0.0, 0.75, DIAGONAL)
"""Weights of the stages in the result."""
EMBEDDED = (43 / 168, 31 / 168, 0.5 - 3 / 28, 1 / 6)
"""Weights of the stages in the formula for the error estimate.

It is a third of the way to the formula of order 2 at the argument of the last stage, so that the
estimate is as large as the errors at the end are.
"""


def _divide_by_gamma(row: tuple[float, ...]) -> tuple[float, ...]:
    """Return a row times the inverse of GAMMA."""
    result = [0.0] * STAGES
    for j in range(STAGES - 1, -1, -1):
        later_sum = sum(result[i] * GAMMA[i][j] for i in range(j + 1, STAGES))
        result[j] = (row[j] - later_sum) / DIAGONAL
    return tuple(result)


UNIT = tuple(tuple(float(i == j) for j in range(STAGES)) for i in range(STAGES))
"""Unit matrix."""
STAGE_STATES = tuple(value for row in ALPHA for value in _divide_by_gamma(row))
"""ALPHA times the inverse of GAMMA, by rows.

In terms of the transformed stages no product with J occurs (E. Hairer, G. Wanner, Solving Ordinary
Differential Equations II, chapter IV.7).
"""
RIGHT_SIDE_WEIGHTS = tuple(-DIAGONAL * value for row in UNIT for value in _divide_by_gamma(row))
"""Coefficients of the transformed earlier stages on the right side of a stage, by rows."""
RESULT_WEIGHTS = _divide_by_gamma(WEIGHTS)
"""Coefficients of the transformed stages in the result."""
ERROR_WEIGHTS = _divide_by_gamma(
    tuple(one - other for one, other in zip(WEIGHTS, EMBEDDED, strict=True))
)
"""Coefficients of the transformed stages in the error estimate."""
STAGE_TIMES = tuple(sum(row) for row in ALPHA)
"""Times of the stages, as part of the step; at 0 the derivative is known."""

SAFETY = 0.9
"""Ratio of the chosen step to the one that would just meet the accuracy."""
MIN_STEP_FACTOR = 0.2
"""Smallest factor of a change of the step."""
MAX_STEP_FACTOR = 5.0
"""Largest factor of a change of the step."""
MIN_GROWTH = 1.1
"""Smallest factor with which a step is made longer."""


def rosenbrock(
    model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int
) -> int:
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
    size = model[MODEL.STATE_SIZE]
    h = at(data, offset)
    stages = at(h, HEAD)
    work = at(h, HEAD + STATES * size)
    errors = at(data, model[MODEL.WORK_STATE] + ERRORS * size)
    f1 = at(y1, size)
    t0, accuracy, step = h[METHOD_WORK.REACHED], h[METHOD_WORK.ACCEPTED], h[METHOD_WORK.NEXT_STEP]
    h[METHOD_WORK.EVALUATED], h[METHOD_WORK.HAS_DERIVATIVE] = 2.0, 0.0
    # A step that almost reaches the limit is stretched or cut to it.
    t1 = h[METHOD_WORK.LAST_TIME] if h[METHOD_WORK.LAST_TIME] <= t0 + 1.001 * step else t0 + step
    # A step that was cut much shorter is no basis for the size of the next one.
    is_shortened = t1 - t0 < 0.95 * step
    step = t1 - t0
    c = DIAGONAL * step
    error = inf
    # After a rejection the derivatives at the start are still valid.
    if h[ROSENBROCK_WORK.IS_NEW] == 0.0:
        data[WORK.TIME] = t0
        copy_numbers(size, y0, y1)
        h[ROSENBROCK_WORK.IS_NEW] = (
            1.0
            if linearise_state(model, reals, data, y1, f1, work, h[METHOD_WORK.IS_EVALUATED])
            == OUTCOME.OK
            else 0.0
        )
    h[METHOD_WORK.IS_EVALUATED] = 0.0
    if (
        h[ROSENBROCK_WORK.IS_NEW] > 0.0
        and condense_system(model, c, work)
        and compute_stages(model, reals, data, t0, step, c, y0, y1, stages, work)
    ):
        for k in range(size):
            y1[k], errors[k] = y0[k], 0.0
            for i in range(STAGES):
                y1[k] += RESULT_WEIGHTS[i] * stages[size * i + k]
                errors[k] += ERROR_WEIGHTS[i] * stages[size * i + k]
        error = project_and_measure(model, reals, data, t1, y0, y1, errors, h, 1)
    # The error has order 3, and is bounded from below so that the factor stays finite.
    factor = SAFETY * (accuracy / max(error, 1e-9 * accuracy)) ** (1.0 / 3.0)
    if not error <= accuracy:
        # Near the resolution of time, the actual step is longer than the requested one.
        h[METHOD_WORK.NEXT_STEP] = min(
            max(factor, MIN_STEP_FACTOR) * step, SAFETY * h[METHOD_WORK.NEXT_STEP]
        )
        return OUTCOME.OK
    h[METHOD_WORK.REACHED], h[ROSENBROCK_WORK.IS_NEW] = t1, 0.0
    if factor < 1.0 or (factor >= MIN_GROWTH and not is_shortened):
        h[METHOD_WORK.NEXT_STEP] = min(factor, MAX_STEP_FACTOR) * step
    return OUTCOME.OK


def compute_stages(
    model: Ints,
    reals: Floats,
    data: Floats,
    t0: float,
    step: float,
    c: float,
    y0: Floats,
    y: Floats,
    stages: Floats,
    work: Floats,
) -> bool:
    """Compute the stages of a step.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t0: time at the start (s).
        step: step (s).
        c: diagonal coefficient times the step (s).
        y0: state at the start, then its derivative.
        y: workspace of a state and its derivative.
        stages: filled with the transformed stages.
        work: condensed linear equations.

    Returns:
        Whether all evaluations succeeded.
    """
    size = model[MODEL.STATE_SIZE]
    f = at(y, model[MODEL.STATE_SIZE])
    for i in range(STAGES):
        stage = at(stages, size * i)
        rates = f if STAGE_TIMES[i] > 0.0 else at(y0, size)
        # Stages at the start use the derivative that is known there.
        if STAGE_TIMES[i] > 0.0:
            for k in range(size):
                y[k] = y0[k]
                for j in range(i):
                    y[k] += STAGE_STATES[STAGES * i + j] * stages[size * j + k]
            data[WORK.TIME] = t0 + STAGE_TIMES[i] * step
            if call(
                model[MODEL.LAWS], model, reals, data, y, f, STAGE.ACCELERATION
            ) != OUTCOME.OK or not is_finite(size, f):
                return False
        for k in range(size):
            stage[k] = c * rates[k]
            for j in range(i):
                stage[k] += RIGHT_SIDE_WEIGHTS[STAGES * i + j] * stages[size * j + k]
        solve_condensed(model, c, work, stage)
    return True
