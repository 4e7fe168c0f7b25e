"""Multistep methods of variable order and step: NDF (a variant of BDF) and Adams-Moulton formulas.

Both store backward differences at equal steps, whose order and step change now and then. The
numerical differentiation formulas (NDF) of orders 1 to 5 store differences of the state (L. F.
Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18, 1997). The Adams-Moulton
formulas of orders 2 to 8 store differences of its derivative (E. Hairer, S. P. Norsett, G. Wanner,
Solving Ordinary Differential Equations I, chapter III.1). The latter are much more accurate where
they are stable; their error is estimated by the formula of one order less.

Both solve c f(y) = psi + d by Newton's iteration, where d is the difference of y from its
prediction. The linear equations are those of :mod:`osimlite.mechanics.kernels.condensation`.
"""

from __future__ import annotations

from itertools import pairwise
from math import inf, sqrt

from osimlite.mechanics.kernels.condensation import (
    condense_system,
    linearise_state,
    solve_condensed,
)
from osimlite.mechanics.kernels.error_control import (
    ERRORS,
    METHOD_WORK,
    error_norm,
    project_and_measure,
)
from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK, Record
from osimlite.mechanics.kernels.linear_algebra import dot_range
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call, is_finite


class MULTISTEP_WORK(metaclass=Record):
    """Memory of the methods in their record, see `METHOD_WORK`."""

    ORDER = METHOD_WORK.MEMORY
    """Order, 0 before the first step."""
    STEP = METHOD_WORK.MEMORY + 1
    """Step (s)."""
    EQUAL = METHOD_WORK.MEMORY + 2
    """Number of equal steps since the last change."""
    CONDENSED = METHOD_WORK.MEMORY + 3
    """Coefficient c of the factorised linear equations, 0 if there are none."""
    AGE = METHOD_WORK.MEMORY + 4
    """Number of steps for which the derivatives have been used, 0 if there are none."""
    REFUSED = METHOD_WORK.MEMORY + 5
    """Number of consecutive rejected steps."""
    MATRICES = METHOD_WORK.MEMORY + 6
    """Three matrices (8, 8) that change the step, and a column (8,)."""


WIDTH = 8
"""Number of coefficients per method, and size of the matrices."""
HEAD = MULTISTEP_WORK.MATRICES + 3 * WIDTH * WIDTH + WIDTH
"""Length of the head of the method's record, see `error_control`."""

IS_IMPLICIT = True
"""Whether the method needs derivatives of the forces."""


class FORMULAS(metaclass=Record):
    """Families of formulas."""

    BDF = 0
    """Numerical differentiation formulas."""
    ADAMS = 1
    """Adams-Moulton formulas."""


MOST_ORDER = 5, 7
"""Highest order index of each method."""
ROWS = max(MOST_ORDER) + 3
"""Number of stored differences: y and its differences, or y and the differences of h f."""
STATES = ROWS + 2
"""Number of states of workspace: the differences, d, and psi."""

# Kappa are the coefficients of Shampine and Reichelt that reduce the error of BDF at little cost in
# stability; the sums are those of 1 / k.
_ONES = (1.0,) * WIDTH
_KAPPA = (0.0, -0.1850, -1.0 / 9.0, -0.0823, -0.0415, 0.0, 0.0, 0.0)
_SUMS = tuple(sum((1.0 / k for k in range(1, order + 1)), 0.0) for order in range(WIDTH))
_ADAMS = (1.0, 1 / 2, 5 / 12, 3 / 8, 251 / 720, 95 / 288, 19087 / 60480, 5257 / 17280)
PREDICTION_WEIGHTS = (*_ONES, 0.0, *_ADAMS[:-1])
"""Weight of each difference in the prediction, for both methods."""
PSI_WEIGHTS = _SUMS + _ONES
"""Weight of each difference in psi, for both methods."""
ALPHA = (
    *((1.0 - kappa) * total for kappa, total in zip(_KAPPA, _SUMS, strict=True)),
    *(1.0 / g for g in _ADAMS),
)
"""Ratio of the step to the coefficient c, by order, for both methods."""
DIFFERENCE_RATIO = _ONES + ALPHA[WIDTH:]
"""Ratio of the newest difference to d, by order, for both methods."""
ERROR_CONSTANT = (
    *(
        kappa * total + 1.0 / (k + 1.0)
        for k, (kappa, total) in enumerate(zip(_KAPPA, _SUMS, strict=True))
    ),
    *(1.0, *(before - g for before, g in pairwise(_ADAMS))),
)
"""Ratio of the error to the newest difference, by order, for both methods."""

MAX_NEWTON_ITERATIONS = 4
"""Largest number of Newton iterations per step."""
NEWTON_TOLERANCE = 0.05
"""Accepted error of the iteration relative to the accuracy of the step."""
SINGLE_ITERATION_RESIDUAL = 1e-3
"""Residual relative to the accuracy with which one iteration is enough."""
MAX_JACOBIAN_AGE = 20
"""Number of steps after which the derivatives are computed anew."""
SAFETY = 0.8
"""Ratio of the chosen step to the one that would just meet the accuracy."""
MIN_STEP_FACTOR = 0.2
"""Smallest factor of a change of the step."""
MAX_STEP_FACTOR = 8.0
"""Largest factor of a change of the step."""
MIN_GROWTH = 1.2
"""Smallest factor with which a step is made longer."""
MAX_REJECTIONS = 3
"""Number of consecutive rejections after which the history is dropped, as the motion has a kink."""


def bdf(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int) -> int:
    """Try one step by a numerical differentiation formula, see `try_multistep`.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y0: state at the start, then its derivative.
        y1: filled with the state at the end, then its derivative.
        offset: offset of the method's record in data.

    Returns:
        `OUTCOME.OK`; the record says whether the step was accepted.
    """
    return try_multistep(model, reals, data, y0, y1, offset, FORMULAS.BDF)


def adams(model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int) -> int:
    """Try one step by an Adams-Moulton formula, see `try_multistep`.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y0: state at the start, then its derivative.
        y1: filled with the state at the end, then its derivative.
        offset: offset of the method's record in data.

    Returns:
        `OUTCOME.OK`; the record says whether the step was accepted.
    """
    return try_multistep(model, reals, data, y0, y1, offset, FORMULAS.ADAMS)


def try_multistep(
    model: Ints, reals: Floats, data: Floats, y0: Floats, y1: Floats, offset: int, method: int
) -> int:
    """Try one step from y0, which is followed by its derivative, to y1.

    The derivative at the end is written after y1.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y0: state at the start, then its derivative.
        y1: filled with the state at the end, then its derivative.
        offset: offset of the method's record in data.
        method: BDF or ADAMS of `FORMULAS`.

    Returns:
        `OUTCOME.OK`; the record says whether the step was accepted.
    """
    size = model[MODEL.STATE_SIZE]
    h = at(data, offset)
    rows = at(h, HEAD)
    work = at(h, HEAD + STATES * size)
    d = at(rows, ROWS * size)
    psi = at(rows, (ROWS + 1) * size)
    errors = at(data, model[MODEL.WORK_STATE] + ERRORS * size)
    h[METHOD_WORK.EVALUATED], h[METHOD_WORK.HAS_DERIVATIVE] = 0.0, 1.0
    if h[MULTISTEP_WORK.ORDER] == 0.0:
        start_history(model, h, y0, rows)
    t0 = h[METHOD_WORK.REACHED]
    accuracy = h[METHOD_WORK.ACCEPTED]
    order = int(h[MULTISTEP_WORK.ORDER])
    t1 = t0 + h[MULTISTEP_WORK.STEP]
    # A step that almost reaches the limit is stretched or cut to it.
    if h[METHOD_WORK.LAST_TIME] <= t0 + 1.001 * h[MULTISTEP_WORK.STEP]:
        t1 = h[METHOD_WORK.LAST_TIME]
        rescale_differences(size, method, h, rows, (t1 - t0) / h[MULTISTEP_WORK.STEP])
    constants = WIDTH * method + order
    c = h[MULTISTEP_WORK.STEP] / ALPHA[constants]
    iterations, is_new = 0, False
    while True:
        predict_state(size, method, order, rows, y1, psi)
        # Derivatives are kept over several steps: the iteration converges as long as they are
        # roughly right.
        if h[MULTISTEP_WORK.AGE] <= 0.0 or h[MULTISTEP_WORK.AGE] > MAX_JACOBIAN_AGE:
            data[WORK.TIME] = t1
            is_new = linearise_state(model, reals, data, y1, at(y1, size), work, 0.0) == OUTCOME.OK
            h[MULTISTEP_WORK.AGE], h[MULTISTEP_WORK.CONDENSED] = 1.0 if is_new else 0.0, 0.0
        # The factorization depends on the coefficient c, which changes with step and order.
        if h[MULTISTEP_WORK.AGE] > 0.0 and (
            h[MULTISTEP_WORK.CONDENSED] == c or condense_system(model, c, work)
        ):
            h[MULTISTEP_WORK.CONDENSED] = c
            iterations = iterate_newton(model, reals, data, t1, c, y0, y1, h)
        # Without convergence, repeat once with new derivatives.
        if iterations > 0 or is_new or h[MULTISTEP_WORK.AGE] <= 0.0:
            break
        h[MULTISTEP_WORK.AGE] = 0.0
    error = inf
    if iterations > 0:
        # The error is a multiple of the newest difference.
        for k in range(size):
            errors[k] = ERROR_CONSTANT[constants] * DIFFERENCE_RATIO[constants] * d[k]
        error = project_and_measure(model, reals, data, t1, y0, y1, errors, h, 1)
    if not error <= accuracy:
        shorten_step(size, method, h, rows, error / accuracy)
        return OUTCOME.OK
    h[MULTISTEP_WORK.AGE] += 1.0
    h[MULTISTEP_WORK.REFUSED] = 0.0
    h[METHOD_WORK.REACHED] = t1
    # The derivative follows from the formula, without another evaluation.
    for k in range(size):
        y1[size + k] = (psi[k] + d[k]) / c
        newest = DIFFERENCE_RATIO[constants] * d[k]
        if method == FORMULAS.BDF:
            # Use differences of the projected states; their derivatives are not projected.
            newest = y1[k]
            for i in range(order + 1):
                newest -= rows[size * i + k]
        # Backward differences are updated from the newest one down.
        rows[size * (order + 2) + k] = newest - rows[size * (order + 1) + k]
        rows[size * (order + 1) + k] = newest
        for i in range(order, 0, -1):
            rows[size * i + k] += rows[size * (i + 1) + k]
        rows[k] = y1[k]
    h[MULTISTEP_WORK.EQUAL] += 1.0
    # A change of order or step needs order + 1 equal steps before it, for a reliable error
    # estimate.
    if h[MULTISTEP_WORK.EQUAL] > order:
        choose_order(
            model,
            method,
            h,
            y0,
            rows,
            errors,
            error,
            SAFETY * (2 * MAX_NEWTON_ITERATIONS + 1) / (2 * MAX_NEWTON_ITERATIONS + iterations),
        )
    h[METHOD_WORK.NEXT_STEP] = h[MULTISTEP_WORK.STEP]
    return OUTCOME.OK


def start_history(model: Ints, h: Floats, y0: Floats, rows: Floats) -> None:
    """Start the history with order 1 and a step that changes the state little.

    Args:
        model: integers of the model.
        h: record of the method.
        y0: state at the start, then its derivative.
        rows: differences; filled.
    """
    size = model[MODEL.STATE_SIZE]
    speed = error_norm(model, y0, at(y0, size), h, 1)
    # A step whose change of the state is a tenth of the square root of the accuracy.
    h[MULTISTEP_WORK.STEP] = min(
        h[METHOD_WORK.NEXT_STEP], 0.1 * sqrt(h[METHOD_WORK.ACCEPTED]) / max(speed, 1.0)
    )
    (
        h[MULTISTEP_WORK.ORDER],
        h[MULTISTEP_WORK.EQUAL],
        h[MULTISTEP_WORK.AGE],
        h[MULTISTEP_WORK.REFUSED],
    ) = 1.0, 0.0, 0.0, 0.0
    for k in range(size):
        rows[k] = y0[k]
        rows[size + k] = h[MULTISTEP_WORK.STEP] * y0[size + k]
        for i in range(2, ROWS):
            rows[size * i + k] = 0.0


def predict_state(size: int, method: int, order: int, rows: Floats, y: Floats, psi: Floats) -> None:
    """Compute psi, and the state at the end of a step whose newest difference is zero.

    Args:
        size: length of a state.
        method: BDF or ADAMS of `FORMULAS`.
        order: order index of the formula.
        rows: differences.
        y: filled with the prediction.
        psi: filled with the sum over older differences.
    """
    first = WIDTH * method
    for k in range(size):
        y[k], psi[k] = rows[k], 0.0
        for i in range(1, order + 1):
            y[k] += PREDICTION_WEIGHTS[first + i] * rows[size * i + k]
            psi[k] += PSI_WEIGHTS[first + i] * rows[size * i + k]
        psi[k] /= ALPHA[first + order]


def iterate_newton(
    model: Ints,
    reals: Floats,
    data: Floats,
    t: float,
    c: float,
    y0: Floats,
    y1: Floats,
    h: Floats,
) -> int:
    """Solve c f(t, y1) = psi + d by Newton's iteration, where d = y1 - prediction.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        t: time at the end of the step (s).
        c: coefficient of the formula (s).
        y0: state at the start, for the error norm.
        y1: prediction, then the solution and its derivative.
        h: record of the method, with psi and the condensed equations; d is filled in.

    Returns:
        The number of iterations, 0 if they do not converge.
    """
    size = model[MODEL.STATE_SIZE]
    previous_residual = 0.0
    previous_length = 0.0
    rows = at(h, HEAD)
    work = at(h, HEAD + STATES * size)
    f1 = at(y1, size)
    d = at(rows, ROWS * size)
    psi = at(rows, (ROWS + 1) * size)
    change = at(data, model[MODEL.WORK_STATE] + ERRORS * size)
    for k in range(size):
        d[k] = 0.0
    for iteration in range(MAX_NEWTON_ITERATIONS):
        h[METHOD_WORK.EVALUATED] += 1.0
        data[WORK.TIME] = t
        if call(
            model[MODEL.LAWS], model, reals, data, y1, f1, STAGE.ACCELERATION
        ) != OUTCOME.OK or not is_finite(size, f1):
            return 0
        for k in range(size):
            change[k] = c * f1[k] - psi[k] - d[k]
        residual = error_norm(model, y0, change, h, 1)
        solve_condensed(model, c, work, change)
        length = error_norm(model, y0, change, h, 1)
        for k in range(size):
            y1[k] += change[k]
            d[k] += change[k]
        # A tiny residual before the correction makes a second iteration unnecessary.
        if residual <= SINGLE_ITERATION_RESIDUAL * h[METHOD_WORK.ACCEPTED]:
            return iteration + 1
        # With outdated, too large derivatives all steps are short: check the residuals too.
        if iteration > 0:
            if not (residual < previous_residual and length < previous_length):
                return 0
            rate = max(residual / previous_residual, length / previous_length)
            # Error of the iteration if it continues to converge at this rate.
            if rate / (1.0 - rate) * length <= NEWTON_TOLERANCE * h[METHOD_WORK.ACCEPTED]:
                return iteration + 1
        previous_residual, previous_length = residual, length
    return 0


def shorten_step(size: int, method: int, h: Floats, rows: Floats, excess: float) -> None:
    """Shorten the step after a rejection.

    Args:
        size: length of a state.
        method: BDF or ADAMS of `FORMULAS`.
        h: record of the method.
        rows: differences.
        excess: error over accuracy, infinite if there was no solution.
    """
    h[MULTISTEP_WORK.REFUSED] += 1.0
    h[MULTISTEP_WORK.EQUAL] = 0.0
    # After several rejections the history describes another motion, as before a contact: restart.
    if h[MULTISTEP_WORK.REFUSED] > MAX_REJECTIONS:
        h[METHOD_WORK.NEXT_STEP], h[MULTISTEP_WORK.ORDER] = (
            MIN_STEP_FACTOR * h[MULTISTEP_WORK.STEP],
            0.0,
        )
        return
    factor = SAFETY * excess ** (-1.0 / (h[MULTISTEP_WORK.ORDER] + 1.0)) if excess < inf else 0.25
    rescale_differences(size, method, h, rows, min(max(factor, MIN_STEP_FACTOR), SAFETY))
    h[METHOD_WORK.NEXT_STEP] = h[MULTISTEP_WORK.STEP]


def choose_order(
    model: Ints,
    method: int,
    h: Floats,
    y0: Floats,
    rows: Floats,
    errors: Floats,
    error: float,
    safety: float,
) -> None:
    """Choose order and step for the next steps.

    Args:
        model: integers of the model.
        method: BDF or ADAMS of `FORMULAS`.
        h: record of the method.
        y0: state at the start of the last step.
        rows: differences.
        errors: workspace of a state.
        error: norm of the error of the last step.
        safety: ratio of the step to the one that would just meet the accuracy.
    """
    size = model[MODEL.STATE_SIZE]
    order = int(h[MULTISTEP_WORK.ORDER])
    accuracy = h[METHOD_WORK.ACCEPTED]
    best = order
    factor = step_factor(error / accuracy, order)
    # Compare the steps that each neighbouring order allows.
    for candidate in (order - 1, order + 1):
        if not 1 <= candidate <= MOST_ORDER[method]:
            continue
        for k in range(size):
            errors[k] = (
                ERROR_CONSTANT[WIDTH * method + candidate] * rows[size * (candidate + 1) + k]
            )
        result = step_factor(error_norm(model, y0, errors, h, 1) / accuracy, candidate)
        if result > factor:
            best, factor = candidate, result
    factor = min(safety * factor, MAX_STEP_FACTOR)
    if factor >= MIN_GROWTH or factor < 1.0:
        h[MULTISTEP_WORK.ORDER], h[MULTISTEP_WORK.EQUAL] = float(best), 0.0
        rescale_differences(size, method, h, rows, max(factor, MIN_STEP_FACTOR))


def step_factor(excess: float, order: int) -> float:
    """Return the factor of the step with which the error would just meet the accuracy.

    Args:
        excess: error over accuracy.
        order: order of the formula.
    """
    return max(excess, 1e-12) ** (-1.0 / (order + 1.0))


def rescale_differences(size: int, method: int, h: Floats, rows: Floats, factor: float) -> None:
    """Change the step by a factor.

    The differences are interpolated on the polynomial through the same values.

    Args:
        size: length of a state.
        method: BDF or ADAMS of `FORMULAS`.
        h: record of the method; the step is changed.
        rows: differences; changed.
        factor: ratio of the new step to the old one.
    """
    # Adams' differences are those of h f, and follow the state.
    order = int(h[MULTISTEP_WORK.ORDER]) - method
    differing = at(rows, size * method)
    scale = factor if method == FORMULAS.ADAMS else 1.0
    new = at(h, MULTISTEP_WORK.MATRICES)
    unit = at(h, MULTISTEP_WORK.MATRICES + WIDTH * WIDTH)
    product = at(h, MULTISTEP_WORK.MATRICES + 2 * WIDTH * WIDTH)
    column = at(product, WIDTH * WIDTH)
    fill_difference_matrix(order, factor, new)
    fill_difference_matrix(order, 1.0, unit)
    # The product of both matrices maps old differences to new ones; the unit matrix inverts the
    # conversion of differences to values.
    for i in range(order + 1):
        for j in range(order + 1):
            product[WIDTH * i + j] = 0.0
            for m in range(order + 1):
                product[WIDTH * i + j] += scale * new[WIDTH * j + m] * unit[WIDTH * m + i]
    for k in range(size):
        for i in range(order + 1):
            column[i] = differing[size * i + k]
        for i in range(order + 1):
            differing[size * i + k] = dot_range(0, order + 1, at(product, WIDTH * i), column)
    h[MULTISTEP_WORK.STEP] *= factor
    h[MULTISTEP_WORK.EQUAL] = 0.0


def fill_difference_matrix(order: int, factor: float, matrix: Floats) -> None:
    """Fill the matrix that evaluates differences at steps that are `factor` times as long.

    Args:
        order: number of differences.
        factor: ratio of the steps.
        matrix: filled, in rows of WIDTH numbers.
    """
    for j in range(order + 1):
        total = 1.0
        matrix[j] = total
        for i in range(1, order + 1):
            total *= (i - 1 - factor * j) / i if j > 0 else 0.0
            matrix[WIDTH * i + j] = total
