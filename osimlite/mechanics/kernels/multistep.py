"""Multistep methods of variable order and step: backward differentiation formulas, and Adams-Moulton's.

Both keep backward differences, with steps that are equal for a while and orders that change: the
numerical differentiation formulas of orders 1 to 5 (L. F. Shampine, M. W. Reichelt, The MATLAB ODE
Suite, SIAM J. Sci. Comput. 18, 1997) those of the state, Adams' formulas of orders 2 to 8 those of
its derivative (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I,
chapter III.1). These err much less where they are stable; their error is estimated as that of the
formula of one order less. Both solve c f(y) = psi + d, where d is what y differs from its
prediction, by Newton's iteration; its linear equations are those of
:mod:`osimlite.mechanics.kernels.condensation`.
"""

from __future__ import annotations

from itertools import pairwise
from math import inf, sqrt

from osimlite.mechanics.kernels.condensation import condense, correct, linearise, product
from osimlite.mechanics.kernels.error_control import (
    ACCEPTED,
    ERRORS,
    EVALUATED,
    HAS_DERIVATIVE,
    LAST_TIME,
    MEMORY,
    NEXT_STEP,
    REACHED,
    error_norm,
    step_error,
)
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, is_finite

ORDER, STEP, EQUAL, CONDENSED, AGE, REFUSED, MATRICES = range(MEMORY, MEMORY + 7)
"""Order; step, s; how many steps were equal; c that the linear equations are for, 0 if for none;
for how many steps their derivatives have served; how many steps were refused in turn; place of
three matrices (8, 8) that change the step, and of a column.
"""
WIDTH = 8
HEAD = MATRICES + 3 * WIDTH * WIDTH + WIDTH

IS_IMPLICIT = True
BDF, ADAMS = 0, 1
MOST_ORDER = 5, 7
ROWS = max(MOST_ORDER) + 3
STATES = ROWS + 2
"""Room for so many states: y and its backward differences, or y and those of h f; d, and psi."""

_ONES = (1.0,) * WIDTH
_KAPPA = (0.0, -0.1850, -1.0 / 9.0, -0.0823, -0.0415, 0.0, 0.0, 0.0)
_SUMS = tuple(sum((1.0 / k for k in range(1, order + 1)), 0.0) for order in range(WIDTH))
_ADAMS = (1.0, 1 / 2, 5 / 12, 3 / 8, 251 / 720, 95 / 288, 19087 / 60480, 5257 / 17280)
PREDICTED = (*_ONES, 0.0, *_ADAMS[:-1])
GIVEN = _SUMS + _ONES
ALPHA = (
    *((1.0 - kappa) * total for kappa, total in zip(_KAPPA, _SUMS, strict=True)),
    *(1.0 / g for g in _ADAMS),
)
DIFFERENCE = _ONES + ALPHA[WIDTH:]
ERROR_CONSTANT = (
    *(
        kappa * total + 1.0 / (k + 1.0)
        for k, (kappa, total) in enumerate(zip(_KAPPA, _SUMS, strict=True))
    ),
    *(1.0, *(before - g for before, g in pairwise(_ADAMS))),
)
"""Constants of both methods: by difference its weight in the prediction, and in psi; by order h /
c, the newest difference by d, and the error by the newest difference.
"""

ITERATIONS, CONVERGED, SOLVED = 4, 0.05, 1e-3
"""Newton's steps at most; what the error of an iteration may be, of that of a step; how far off
equations may be that need no second one.
"""
RENEWED = 20
"""After so many steps the derivatives are computed anew."""
SAFETY, SHRINK, GROW, WORTH = 0.8, 0.2, 8.0, 1.2
"""Of the step that should just do, which is taken; how much a step changes at most, and at least to be made longer."""
PATIENCE = 3
"""So many refused steps in turn and the history is dropped: something has changed abruptly."""


def bdf(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, place: int) -> int:
    """Try one step from y0, behind which its derivative stands, to y1, which its derivative is put behind."""
    return multistep(model, reals, data, y0, y1, place, BDF)


def adams(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, place: int) -> int:
    """The same by the other method."""
    return multistep(model, reals, data, y0, y1, place, ADAMS)


def multistep(
    model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, place: int, method: int
) -> int:
    """The same by either: BDF or ADAMS."""
    size = model[MODEL.STATE_SIZE]
    h = at(data, place)
    rows, room = at(h, HEAD), at(h, HEAD + STATES * size)
    d, psi, errors = (
        at(rows, ROWS * size),
        at(rows, (ROWS + 1) * size),
        at(data, model[MODEL.WORK_STATE] + ERRORS * size),
    )
    h[EVALUATED], h[HAS_DERIVATIVE] = 0.0, 1.0
    if h[ORDER] == 0.0:
        begin(model, h, y0, rows)
    t0, accuracy, order = h[REACHED], h[ACCEPTED], int(h[ORDER])
    t1 = t0 + h[STEP]
    if h[LAST_TIME] <= t0 + 1.001 * h[STEP]:
        t1 = h[LAST_TIME]
        rescale(size, method, h, rows, (t1 - t0) / h[STEP])
    constants = WIDTH * method + order
    c = h[STEP] / ALPHA[constants]
    iterations, is_new = 0, False
    while True:
        predict(size, method, order, rows, y1, psi)
        if h[AGE] <= 0.0 or h[AGE] > RENEWED:
            data[WORK.TIME] = t1
            is_new = linearise(model, reals, data, y1, at(y1, size), room, 0.0) == OUTCOME.OK
            h[AGE], h[CONDENSED] = 1.0 if is_new else 0.0, 0.0
        if h[AGE] > 0.0 and (h[CONDENSED] == c or condense(model, c, room)):
            h[CONDENSED] = c
            iterations = newton(model, reals, data, t1, c, y0, y1, d, psi, errors, room, h)
        if iterations > 0 or is_new or h[AGE] <= 0.0:
            break
        h[AGE] = 0.0
    error = inf
    if iterations > 0:
        for k in range(size):
            errors[k] = ERROR_CONSTANT[constants] * DIFFERENCE[constants] * d[k]
        error = step_error(model, reals, data, t1, y0, y1, errors, h, 1)
    if not error <= accuracy:
        refuse(size, method, h, rows, error / accuracy)
        return OUTCOME.OK
    h[AGE] += 1.0
    h[REFUSED] = 0.0
    h[REACHED] = t1
    for k in range(size):
        y1[size + k] = (psi[k] + d[k]) / c
        newest = DIFFERENCE[constants] * d[k]
        if method == BDF:
            # Of the states as they were projected; their derivatives are not.
            newest = y1[k]
            for i in range(order + 1):
                newest -= rows[size * i + k]
        rows[size * (order + 2) + k] = newest - rows[size * (order + 1) + k]
        rows[size * (order + 1) + k] = newest
        for i in range(order, 0, -1):
            rows[size * i + k] += rows[size * (i + 1) + k]
        rows[k] = y1[k]
    h[EQUAL] += 1.0
    if h[EQUAL] > order:
        choose(
            model,
            method,
            h,
            y0,
            rows,
            errors,
            error,
            SAFETY * (2 * ITERATIONS + 1) / (2 * ITERATIONS + iterations),
        )
    h[NEXT_STEP] = h[STEP]
    return OUTCOME.OK


def begin(model: Ints, h: Floats, y0: Floats, rows: Floats) -> None:
    """Start with order 1, and a step that changes little."""
    size = model[MODEL.STATE_SIZE]
    speed = error_norm(model, y0, at(y0, size), h, 1)
    h[STEP] = min(h[NEXT_STEP], 0.1 * sqrt(h[ACCEPTED]) / max(speed, 1.0))
    h[ORDER], h[EQUAL], h[AGE], h[REFUSED] = 1.0, 0.0, 0.0, 0.0
    for k in range(size):
        rows[k] = y0[k]
        rows[size + k] = h[STEP] * y0[size + k]
        for i in range(2, ROWS):
            rows[size * i + k] = 0.0


def predict(size: int, method: int, order: int, rows: Floats, y: Floats, psi: Floats) -> None:
    """The end of a step if the newest difference is zero, and psi."""
    first = WIDTH * method
    for k in range(size):
        y[k], psi[k] = rows[k], 0.0
        for i in range(1, order + 1):
            y[k] += PREDICTED[first + i] * rows[size * i + k]
            psi[k] += GIVEN[first + i] * rows[size * i + k]
        psi[k] /= ALPHA[first + order]


def newton(
    model: Ints,
    reals: Floats,
    data: Floats,
    t: float,
    c: float,
    y0: Floats,
    y1: Floats,
    d: Floats,
    psi: Floats,
    step: Floats,
    room: Floats,
    h: Floats,
) -> int:
    """Solve c f(t, y1) = psi + d, where y1 is the prediction and d what is added to it; how many iterations that took.

    None if they do not converge.
    """
    size, f1, rest, before = model[MODEL.STATE_SIZE], at(y1, model[MODEL.STATE_SIZE]), 0.0, 0.0
    for k in range(size):
        d[k] = 0.0
    for iteration in range(ITERATIONS):
        h[EVALUATED] += 1.0
        data[WORK.TIME] = t
        if call(
            model[MODEL.LAWS], model, reals, data, y1, f1, STAGE.ACCELERATION
        ) != OUTCOME.OK or not is_finite(size, f1):
            return 0
        for k in range(size):
            step[k] = c * f1[k] - psi[k] - d[k]
        residual = error_norm(model, y0, step, h, 1)
        correct(model, c, room, step)
        length = error_norm(model, y0, step, h, 1)
        for k in range(size):
            y1[k] += step[k]
            d[k] += step[k]
        if residual <= SOLVED * h[ACCEPTED]:
            return iteration + 1
        # Where derivatives have become far too large, all steps are short: only what they leave
        # tells.
        if iteration > 0:
            if not (residual < rest and length < before):
                return 0
            rate = max(residual / rest, length / before)
            if rate / (1.0 - rate) * length <= CONVERGED * h[ACCEPTED]:
                return iteration + 1
        rest, before = residual, length
    return 0


def refuse(size: int, method: int, h: Floats, rows: Floats, excess: float) -> None:
    """Make the step shorter; the excess is infinite if there was no solution."""
    h[REFUSED] += 1.0
    h[EQUAL] = 0.0
    if h[REFUSED] > PATIENCE:
        h[NEXT_STEP], h[ORDER] = SHRINK * h[STEP], 0.0
        return
    wanted = SAFETY * excess ** (-1.0 / (h[ORDER] + 1.0)) if excess < inf else 0.25
    rescale(size, method, h, rows, min(max(wanted, SHRINK), SAFETY))
    h[NEXT_STEP] = h[STEP]


def choose(
    model: Ints,
    method: int,
    h: Floats,
    y0: Floats,
    rows: Floats,
    errors: Floats,
    error: float,
    safety: float,
) -> None:
    """Choose order and step for the next steps."""
    size, order, accuracy = model[MODEL.STATE_SIZE], int(h[ORDER]), h[ACCEPTED]
    best, factor = order, reach(error / accuracy, order)
    for other in (order - 1, order + 1):
        if not 1 <= other <= MOST_ORDER[method]:
            continue
        for k in range(size):
            errors[k] = ERROR_CONSTANT[WIDTH * method + other] * rows[size * (other + 1) + k]
        result = reach(error_norm(model, y0, errors, h, 1) / accuracy, other)
        if result > factor:
            best, factor = other, result
    factor = min(safety * factor, GROW)
    if factor >= WORTH or factor < 1.0:
        h[ORDER], h[EQUAL] = float(best), 0.0
        rescale(size, method, h, rows, max(factor, SHRINK))


def reach(excess: float, order: int) -> float:
    """How many times longer a step would just do, of which the error is so many times what it may be."""
    return max(excess, 1e-12) ** (-1.0 / (order + 1.0))


def rescale(size: int, method: int, h: Floats, rows: Floats, factor: float) -> None:
    """Change the step: the differences at other distances, on the polynomial through the same values."""
    # Adams' are of the derivative times the step, behind the state.
    order, differing = int(h[ORDER]) - method, at(rows, size * method)
    scale = factor if method == ADAMS else 1.0
    new, unit, both = (
        at(h, MATRICES),
        at(h, MATRICES + WIDTH * WIDTH),
        at(h, MATRICES + 2 * WIDTH * WIDTH),
    )
    column = at(both, WIDTH * WIDTH)
    differences(order, factor, new)
    differences(order, 1.0, unit)
    for i in range(order + 1):
        for j in range(order + 1):
            both[WIDTH * i + j] = 0.0
            for m in range(order + 1):
                both[WIDTH * i + j] += scale * new[WIDTH * j + m] * unit[WIDTH * m + i]
    for k in range(size):
        for i in range(order + 1):
            column[i] = differing[size * i + k]
        for i in range(order + 1):
            differing[size * i + k] = product(0, order + 1, at(both, WIDTH * i), column)
    h[STEP] *= factor
    h[EQUAL] = 0.0


def differences(order: int, factor: float, matrix: Floats) -> None:
    """What makes of differences those of which the steps are so many times longer."""
    for j in range(order + 1):
        total = 1.0
        matrix[j] = total
        for i in range(1, order + 1):
            total *= (i - 1 - factor * j) / i if j > 0 else 0.0
            matrix[WIDTH * i + j] = total
