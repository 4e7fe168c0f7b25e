"""A Rosenbrock method of order 3, for stiff motion at loose tolerances: four linear systems a step, and no iteration.

The first two stages are at the start of the step, so that two evaluations do for a step besides
that at its end. The method is L-stable and stiffly accurate. The conditions of order 3, and of
order 2 whatever the derivatives J are, leave a method of this shape one free number, its diagonal
(E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, chapters IV.6 and IV.7); a
quarter is near the least with which it is stable. What J of
:mod:`osimlite.mechanics.kernels.condensation` leaves out costs it little.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.condensation import condense, correct, linearise
from osimlite.mechanics.kernels.error_control import (
    ACCEPTED,
    ERRORS,
    EVALUATED,
    HAS_DERIVATIVE,
    IS_EVALUATED,
    LAST_TIME,
    MEMORY,
    NEXT_STEP,
    REACHED,
    step_error,
)
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, copy, is_finite

IS_NEW = MEMORY
"""Whether the derivatives are those at the start of the step."""
HEAD, IS_IMPLICIT = MEMORY + 1, True

STAGES = 4
STATES = STAGES
"""The method keeps a derivative for each stage: so many vectors as long as a state."""

DIAGONAL = 0.25
ALPHA = (
    (0.0, 0.0, 0.0, 0.0),
    (0.0, 0.0, 0.0, 0.0),
    (1 / 3, 0.0, 0.0, 0.0),
    (43 / 56, 31 / 56, -9 / 28, 0.0),
)
GAMMA = (
    (DIAGONAL, 0.0, 0.0, 0.0),
    (0.5, DIAGONAL, 0.0, 0.0),
    (-11 / 72, -7 / 72, DIAGONAL, 0.0),
    (-43 / 56, -31 / 56, 15 / 14, DIAGONAL),
)
WEIGHTS = (0.0, 0.0, 0.75, DIAGONAL)
EMBEDDED = (43 / 168, 31 / 168, 0.5 - 3 / 28, 1 / 6)
"""A third of the way to the formula of order 2 where the last stage is evaluated: as large as errors are at the end."""


def _by_gamma(row: tuple[float, ...]) -> tuple[float, ...]:
    """A row times the inverse of GAMMA."""
    result = [0.0] * STAGES
    for j in range(STAGES - 1, -1, -1):
        rest = sum(result[i] * GAMMA[i][j] for i in range(j + 1, STAGES))
        result[j] = (row[j] - rest) / DIAGONAL
    return tuple(result)


UNIT = tuple(tuple(float(i == j) for j in range(STAGES)) for i in range(STAGES))
PLACES = tuple(value for row in ALPHA for value in _by_gamma(row))
CARRIED = tuple(-DIAGONAL * value for row in UNIT for value in _by_gamma(row))
ENDS = _by_gamma(WEIGHTS)
MISSES = _by_gamma(tuple(one - other for one, other in zip(WEIGHTS, EMBEDDED, strict=True)))
TIMES = tuple(sum(row) for row in ALPHA)
"""The coefficients as the stages need them, in which no product with J occurs (E. Hairer, G.
Wanner, Solving Ordinary Differential Equations II, chapter IV.7): by rows where a stage is
evaluated, and what it has of those before it; what end and error have of the stages; times, of
which 0 is the start, where the derivative is known.
"""

SAFETY, SHRINK, GROW, WORTH = 0.9, 0.2, 5.0, 1.1
"""Of the step that should just do, which is taken; how much a step changes at most, and at least to be made longer."""


def rosenbrock(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, place: int) -> int:
    """Try one step from y0, behind which its derivative stands, to y1."""
    size = model[MODEL.STATE_SIZE]
    h = at(data, place)
    stages, room = at(h, HEAD), at(h, HEAD + STATES * size)
    errors, f1 = at(data, model[MODEL.WORK_STATE] + ERRORS * size), at(y1, size)
    t0, accuracy, step = h[REACHED], h[ACCEPTED], h[NEXT_STEP]
    h[EVALUATED], h[HAS_DERIVATIVE] = 2.0, 0.0
    t1 = h[LAST_TIME] if h[LAST_TIME] <= t0 + 1.001 * step else t0 + step
    cut = t1 - t0 < 0.95 * step
    step = t1 - t0
    c, error = DIAGONAL * step, inf
    if h[IS_NEW] == 0.0:
        data[WORK.TIME] = t0
        copy(size, y0, y1)
        h[IS_NEW] = (
            1.0
            if linearise(model, reals, data, y1, f1, room, h[IS_EVALUATED]) == OUTCOME.OK
            else 0.0
        )
    h[IS_EVALUATED] = 0.0
    if (
        h[IS_NEW] > 0.0
        and condense(model, c, room)
        and staged(model, reals, data, t0, step, c, y0, y1, stages, room)
    ):
        for k in range(size):
            y1[k], errors[k] = y0[k], 0.0
            for i in range(STAGES):
                y1[k] += ENDS[i] * stages[size * i + k]
                errors[k] += MISSES[i] * stages[size * i + k]
        error = step_error(model, reals, data, t1, y0, y1, errors, h, 1)
    factor = SAFETY * (accuracy / max(error, 1e-9 * accuracy)) ** (1.0 / 3.0)
    if not error <= accuracy:
        # Near the resolution of the time, the step was longer than it was to be.
        h[NEXT_STEP] = min(max(factor, SHRINK) * step, SAFETY * h[NEXT_STEP])
        return OUTCOME.OK
    h[REACHED], h[IS_NEW] = t1, 0.0
    if factor < 1.0 or (factor >= WORTH and not cut):
        h[NEXT_STEP] = min(factor, GROW) * step
    return OUTCOME.OK


def staged(
    model: Ints,
    reals: Floats,
    data: Floats,
    t0: float,
    step: float,
    c: float,
    y0: Floats,
    y: Floats,
    stages: Floats,
    room: Floats,
) -> bool:
    """Compute the stages; y has room for a state and its derivative."""
    size, f = model[MODEL.STATE_SIZE], at(y, model[MODEL.STATE_SIZE])
    for i in range(STAGES):
        stage, rates = at(stages, size * i), f if TIMES[i] > 0.0 else at(y0, size)
        if TIMES[i] > 0.0:
            for k in range(size):
                y[k] = y0[k]
                for j in range(i):
                    y[k] += PLACES[STAGES * i + j] * stages[size * j + k]
            data[WORK.TIME] = t0 + TIMES[i] * step
            if call(
                model[MODEL.LAWS], model, reals, data, y, f, STAGE.ACCELERATION
            ) != OUTCOME.OK or not is_finite(size, f):
                return False
        for k in range(size):
            stage[k] = c * rates[k]
            for j in range(i):
                stage[k] += CARRIED[STAGES * i + j] * stages[size * j + k]
        correct(model, c, room, stage)
    return True
