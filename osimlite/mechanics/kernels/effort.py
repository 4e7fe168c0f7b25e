"""Static optimization: distribute generalized forces over actuators, frame by frame.

For each frame the kernel minimizes the sum of |x_j|^p, p > 1, over the controls x of the
actuators, subject to A x = b (the generalized forces) and bounds on each x_j.

For p = 2 the problem is solved in its dual form. With one multiplier λ_k per equation, the
minimizer is x = Aᵀ λ clamped to the bounds, and the equations determine λ. Newton's method on the
concave dual function finds λ; its second derivative involves only the unknowns that are not at a
bound, so that the active set changes as a whole (L. Qi, J. Sun, A nonsmooth version of Newton's
method, Math. Programming 58, 1993). Each frame starts from the multipliers of the previous one.
Other exponents p are reached by Newton steps, each of which is a weighted problem with p = 2.

A proximal term PROXIMAL_WEIGHT |λ - λ'|² makes the dual function strictly concave, where λ' is the
previous solution (R. T. Rockafellar, Augmented Lagrangians and applications of the proximal point
algorithm, Math. Oper. Research 1, 1976). Redundant equations are therefore harmless, and if the
problem is infeasible, the residual b - A x converges to the shortest possible one.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.layout import OUTCOME, Record
from osimlite.mechanics.kernels.linear_algebra import factorise_cholesky, solve_cholesky
from osimlite.mechanics.kernels.pointers import Floats, Ints, at


class EFFORT_SIZES(metaclass=Record):
    """Sizes of a problem."""

    FRAMES = 0
    """Number of frames."""
    EQUATIONS = 1
    """Number m of equations."""
    UNKNOWNS = 2
    """Number n of unknowns."""
    ENTRIES = 3
    """Sparsity of A (n, 1 + m): per column the count and rows of nonzeros."""


class EFFORT_NUMBERS(metaclass=Record):
    """Numbers of a problem."""

    POWER = 0
    """Exponent p."""
    BOUNDS = 1
    """Bounds (2, n): all lower ones, then all upper ones."""


MIN_RESIDUAL = 1e-15
"""Relative residual of the regularized equations below which an iteration cannot improve it."""
TARGET_RESIDUAL = 1e-13
"""Relative residual of the equations at which the search ends."""
MAX_RESIDUAL = 1e-10
"""Largest relative residual of the equations with which a frame counts as solved."""
ROUNDING = 1e-12
"""Entries below this part of the largest of their column are rounding errors and count as zero."""
MIN_ENTRY = 1e-14
"""Entries below this part of the largest of A count as zero: internal forces move no pelvis."""
PROXIMAL_WEIGHT = 1e-9
"""Weight of the proximal term |λ - λ'|², relative to the mean second derivative of the dual."""
MAX_RESIDUAL_RATIO = 0.9
"""A further proximal step must reduce the residual to this part of the previous one, or less."""
MAX_PROXIMAL_STEPS = 30
"""Largest number of proximal steps, each of which starts from a new λ'."""
MAX_NEWTON_STEPS = 100
"""Largest number of Newton steps per proximal step."""
MAX_LINE_SEARCH_TRIALS = 60
"""Largest number of trial lengths in a line search."""
NEWTON_STEPS = 200
"""Largest number of Newton steps towards the minimizer for an exponent other than 2."""
MAX_STALLED_STEPS = 20
"""Number of Newton steps without progress after which a proximal step ends."""
MIN_RELATIVE_X = 1e-6
"""For p < 2: relative |x| below which the curvature of |x|^p is taken at this value, as it diverges."""
MIN_RELATIVE_CURVATURE = 1e-8
"""For p > 2: smallest curvature relative to the largest one, as it vanishes at x = 0."""
LEAST_GAIN = 1e-15
"""Relative decrease of the sum below which the Newton steps for p other than 2 end."""


def effort_size(equations: int, unknowns: int) -> int:
    """Return the length of the workspace.

    Args:
        equations: number m of equations.
        unknowns: number n of unknowns.
    """
    return equations * (equations + 8) + 5 * unknowns


def least_effort(
    sizes: Ints, numbers: Floats, problems: Floats, solutions: Floats, work: Floats
) -> int:
    """Distribute generalized forces over actuators with the least effort, frame by frame.

    Args:
        sizes: numbers of frames, equations and unknowns, see `EFFORT_SIZES`.
        numbers: exponent and bounds, see `EFFORT_NUMBERS`.
        problems: columns of A (n, m), then right-hand side b (m,), of each frame (frames, n + 1,
            m); scaled in place.
        solutions: filled with x (n,), the residual b - A x (m,), and 1.0 if solved or 0.0 if not,
            of each frame (frames, n + m + 1).
        work: workspace of `effort_size` numbers: zeros before the first frame; after a call it
            holds multipliers from which the next frames start.

    Returns:
        `OUTCOME.OK`.
    """
    m, n = sizes[EFFORT_SIZES.EQUATIONS], sizes[EFFORT_SIZES.UNKNOWNS]
    # Multipliers of the previous frame are stored for unscaled equations, since scales change.
    scales = work
    previous = at(work, m)
    multipliers = at(work, 2 * m)
    inner_work = at(work, 3 * m)
    targets = inner_work
    compliances = at(inner_work, n)
    for frame in range(sizes[EFFORT_SIZES.FRAMES]):
        columns = at(problems, (n + 1) * m * frame)
        x = at(solutions, (n + m + 1) * frame)
        scale_equations(sizes, columns, scales)
        # With targets 0 and compliances 1 the weighted problem is that for p = 2.
        for j in range(n):
            targets[j], compliances[j] = 0.0, 1.0
        for k in range(m):
            multipliers[k] = previous[k] / scales[k]
        is_solved = (
            solve_weighted_least_squares(
                sizes, numbers, columns, x, at(x, n), multipliers, inner_work
            )
            <= MAX_RESIDUAL
        )
        # A start from a distant frame may stall; try again from zero.
        if not is_solved:
            for k in range(m):
                multipliers[k] = 0.0
            is_solved = (
                solve_weighted_least_squares(
                    sizes, numbers, columns, x, at(x, n), multipliers, inner_work
                )
                <= MAX_RESIDUAL
            )
        # After a frame that has no solution, start from zero.
        for k in range(m):
            previous[k] = multipliers[k] * scales[k] if is_solved else 0.0
        if is_solved and numbers[EFFORT_NUMBERS.POWER] != 2.0:
            minimize_powers(sizes, numbers, columns, x, multipliers, inner_work)
        # The residual is reported in the units of the generalized forces.
        for k in range(m):
            x[n + k] /= scales[k]
        x[n + m] = 1.0 if is_solved else 0.0
    return OUTCOME.OK


def scale_equations(sizes: Ints, columns: Floats, scales: Floats) -> None:
    """Scale each equation to unit length, drop negligible entries, and list the nonzeros of A.

    Args:
        sizes: sizes of the problem; its sparsity is filled.
        columns: columns of A (n, m), followed by b (m,); scaled in place.
        scales: filled with the factor of each equation (m,).
    """
    m, n = sizes[EFFORT_SIZES.EQUATIONS], sizes[EFFORT_SIZES.UNKNOWNS]
    rhs = at(columns, m * n)
    # Zeros first: a tiny entry that remains would make its equation look solvable.
    largest_entry = 0.0
    for j in range(m * n):
        largest_entry = max(largest_entry, abs(columns[j]))
    for j in range(n):
        column = at(columns, m * j)
        largest = 0.0
        for k in range(m):
            largest = max(largest, abs(column[k]))
        for k in range(m):
            if abs(column[k]) <= max(ROUNDING * largest, MIN_ENTRY * largest_entry):
                column[k] = 0.0
    for k in range(m):
        square = 0.0
        for j in range(n):
            square += columns[m * j + k] * columns[m * j + k]
        scales[k] = 1.0 / sqrt(square) if square > 0.0 else 1.0
        rhs[k] *= scales[k]
    # The list of nonzeros is made per frame, because moment arms vanish and appear.
    for j in range(n):
        column = at(columns, m * j)
        entries = at(sizes, EFFORT_SIZES.ENTRIES + (1 + m) * j)
        count = 0
        for k in range(m):
            if column[k] != 0.0:
                count += 1
                entries[count] = k
                column[k] *= scales[k]
        entries[0] = count


def minimize_powers(
    sizes: Ints, numbers: Floats, columns: Floats, x: Floats, multipliers: Floats, work: Floats
) -> None:
    """Minimize the sum of |x|^p for p other than 2 by Newton steps, starting from a solution for p = 2.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        columns: scaled columns of A, followed by b.
        x: feasible start, then the minimizer (n,), followed by its residual (m,).
        multipliers: workspace for the multipliers (m,).
        work: workspace, which begins with targets and compliances, see `solve_weighted_least_squares`.
    """
    m = sizes[EFFORT_SIZES.EQUATIONS]
    n = sizes[EFFORT_SIZES.UNKNOWNS]
    power = numbers[EFFORT_NUMBERS.POWER]
    targets = work
    compliances = at(work, n)
    tried = at(work, 4 * n + m * (m + 5))
    terms = at(work, 4 * n + 3 * m)
    for _ in range(NEWTON_STEPS):
        # Scale by the largest |x|, so that its powers neither overflow nor underflow.
        unit, stiffest = 0.0, 0.0
        for j in range(n):
            unit = max(unit, abs(x[j]))
        if unit == 0.0:
            return
        for j in range(n):
            size = abs(x[j]) / unit
            size = max(size, MIN_RELATIVE_X) if power < 2.0 else size
            # For p < 2 Newton steps overshoot: use the steeper quadratic majorizer of |x|^p.
            compliances[j] = max(power - 1.0, 1.0) * size ** (power - 2.0)
            stiffest = max(stiffest, compliances[j])
        for j in range(n):
            stiffness = max(compliances[j], MIN_RELATIVE_CURVATURE * stiffest)
            slope = unit * (abs(x[j]) / unit) ** (power - 1.0)
            # Newton's step to the minimum of the quadratic model of |x|^p becomes the target.
            targets[j] = x[j] - (slope if x[j] > 0.0 else -slope) / stiffness
            compliances[j] = stiffest / stiffness
        for k in range(m):
            multipliers[k] = 0.0
        error = solve_weighted_least_squares(
            sizes, numbers, columns, tried, at(x, n), multipliers, work
        )
        # Stop where rounding makes the equations worse.
        if error > TARGET_RESIDUAL and not restore_equations(
            sizes, numbers, columns, tried, at(x, n), multipliers, work
        ):
            break
        # The sum must decrease; halve the step until it does.
        previous_cost = sum_powers(n, power, unit, x, tried, 0.0)
        step_length = 1.0
        trial_cost = sum_powers(n, power, unit, x, tried, step_length)
        for _ in range(MAX_LINE_SEARCH_TRIALS):
            if trial_cost < previous_cost:
                break
            step_length *= 0.5
            trial_cost = sum_powers(n, power, unit, x, tried, step_length)
        if not trial_cost < previous_cost:
            break
        for j in range(n):
            x[j] += step_length * (tried[j] - x[j])
        if previous_cost - trial_cost <= LEAST_GAIN * previous_cost:
            break
    compute_residual(sizes, columns, x, at(x, n), terms)


def sum_powers(
    n: int, power: float, unit: float, x: Floats, end: Floats, step_length: float
) -> float:
    """Return the sum of (|x| / unit)^p at the fraction `step_length` of the way from x to `end`.

    Args:
        n: number of unknowns.
        power: exponent p.
        unit: scale of the unknowns.
        x: start of the way (n,).
        end: end of the way (n,).
        step_length: fraction of the way.
    """
    total = 0.0
    for j in range(n):
        total += (abs(x[j] + step_length * (end[j] - x[j])) / unit) ** power
    return total


def solve_weighted_least_squares(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    x: Floats,
    residual: Floats,
    multipliers: Floats,
    work: Floats,
) -> float:
    """Minimize the sum of (x_j - target_j)² / compliance_j subject to A x = b and the bounds.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        columns: scaled columns of A, followed by b.
        x: filled with the minimizer (n,).
        residual: filled with b - A x (m,).
        multipliers: start of the search (m,), then the multipliers of the equations.
        work: workspace that begins with the targets (n,) and the compliances (n,).

    Returns:
        The largest residual of an equation relative to the size of its terms.
    """
    m, n = sizes[EFFORT_SIZES.EQUATIONS], sizes[EFFORT_SIZES.UNKNOWNS]
    rhs = at(columns, m * n)
    y, change, centre = at(work, 2 * n), at(work, 3 * n), at(work, 4 * n)
    slope = at(centre, m)
    step = at(centre, 2 * m)
    terms, slight, matrix = at(centre, 3 * m), at(centre, 4 * m), at(centre, 5 * m)
    error_before = error = 0.0
    # Each proximal step moves the centre λ' to the last multipliers.
    for number in range(MAX_PROXIMAL_STEPS):
        for k in range(m):
            centre[k] = multipliers[k]
        transpose_times(sizes, columns, multipliers, y)
        error = update_primal(sizes, numbers, columns, work, x, residual, terms)
        fill_dual_hessian(sizes, numbers, columns, work, matrix)
        trace = 0.0
        for k in range(m):
            trace += matrix[m * k + k]
        # The regularization is relative to the mean curvature, so that it scales with the problem.
        for k in range(m):
            slight[k] = PROXIMAL_WEIGHT * (trace / m if trace > 0.0 else 1.0)
        # Newton's method on the dual function with the present proximal term.
        best, since = error, 0
        for _ in range(MAX_NEWTON_STEPS):
            since += 1
            if error < best:
                # A residual that has not improved for some steps is as small as rounding allows.
                best, since = error, 0
            if error <= TARGET_RESIDUAL or since > MAX_STALLED_STEPS:
                break
            largest = 0.0
            for k in range(m):
                slope[k] = residual[k] - slight[k] * (multipliers[k] - centre[k])
                step[k] = slope[k]
                largest = max(largest, abs(slope[k]) / terms[k])
            if largest <= MIN_RESIDUAL:
                break
            fill_dual_hessian(sizes, numbers, columns, work, matrix)
            for k in range(m):
                matrix[m * k + k] += slight[k]
            if not factorise_cholesky(m, matrix, 0.0):
                break
            solve_cholesky(m, matrix, step)
            transpose_times(sizes, columns, step, change)
            step_length = line_search(sizes, numbers, rhs, step, multipliers, work)
            for k in range(m):
                multipliers[k] += step_length * step[k]
            transpose_times(sizes, columns, multipliers, y)
            error = update_primal(sizes, numbers, columns, work, x, residual, terms)
        # From the third proximal step on, continue only while the residual decreases clearly.
        if error <= TARGET_RESIDUAL or (
            number > 1 and not error < MAX_RESIDUAL_RATIO * error_before
        ):
            break
        error_before = error
    return error


def restore_equations(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    x: Floats,
    residual: Floats,
    multipliers: Floats,
    work: Floats,
) -> bool:
    """Move x to the nearest point that fulfils the equations.

    Large compliances leave a residual of rounding errors, which equal compliances remove.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        columns: scaled columns of A, followed by b.
        x: unknowns (n,); changed.
        residual: filled with b - A x (m,).
        multipliers: workspace (m,).
        work: workspace of `solve_weighted_least_squares`.

    Returns:
        Whether the equations hold afterwards.
    """
    for j in range(sizes[EFFORT_SIZES.UNKNOWNS]):
        work[j], work[sizes[EFFORT_SIZES.UNKNOWNS] + j] = x[j], 1.0
    for k in range(sizes[EFFORT_SIZES.EQUATIONS]):
        multipliers[k] = 0.0
    return (
        solve_weighted_least_squares(sizes, numbers, columns, x, residual, multipliers, work)
        <= MAX_RESIDUAL
    )


def transpose_times(sizes: Ints, columns: Floats, multipliers: Floats, y: Floats) -> None:
    """Compute y = Aᵀ λ.

    Args:
        sizes: sizes of the problem, with the sparsity of A.
        columns: scaled columns of A.
        multipliers: multipliers λ (m,).
        y: filled with Aᵀ λ (n,).
    """
    m = sizes[EFFORT_SIZES.EQUATIONS]
    for j in range(sizes[EFFORT_SIZES.UNKNOWNS]):
        column = at(columns, m * j)
        entries = at(sizes, EFFORT_SIZES.ENTRIES + (1 + m) * j)
        total = 0.0
        for e in range(1, entries[0] + 1):
            total += column[entries[e]] * multipliers[entries[e]]
        y[j] = total


def primal_from_multipliers(numbers: Floats, n: int, j: int, work: Floats, y: float) -> float:
    """Return the unknown that minimizes the Lagrangian.

    It is target + compliance y, clamped to its bounds.

    Args:
        numbers: exponent and bounds.
        n: number of unknowns.
        j: index of the unknown.
        work: targets (n,), then compliances (n,).
        y: entry j of Aᵀ λ.
    """
    x = work[j] + work[n + j] * y
    return min(max(x, numbers[EFFORT_NUMBERS.BOUNDS + j]), numbers[EFFORT_NUMBERS.BOUNDS + n + j])


def update_primal(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    work: Floats,
    x: Floats,
    residual: Floats,
    terms: Floats,
) -> float:
    """Compute x from y = Aᵀ λ, and fill residual and sizes of the terms.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        columns: scaled columns of A, followed by b.
        work: workspace of `solve_weighted_least_squares`, with y.
        x: filled with the unknowns (n,).
        residual: filled with b - A x (m,).
        terms: filled with the sizes of the terms (m,).

    Returns:
        The largest ratio of residual to terms.
    """
    n = sizes[EFFORT_SIZES.UNKNOWNS]
    for j in range(n):
        x[j] = primal_from_multipliers(numbers, n, j, work, work[2 * n + j])
    return compute_residual(sizes, columns, x, residual, terms)


def compute_residual(
    sizes: Ints, columns: Floats, x: Floats, residual: Floats, terms: Floats
) -> float:
    """Compute the residual b - A x and the size of the terms of each equation.

    Args:
        sizes: sizes of the problem.
        columns: scaled columns of A, followed by b.
        x: unknowns (n,).
        residual: filled with b - A x (m,).
        terms: filled with |b_k| + Σ_j |A_kj x_j| (m,), or 1 for an equation without terms.

    Returns:
        The largest ratio of residual to terms.
    """
    m, n = sizes[EFFORT_SIZES.EQUATIONS], sizes[EFFORT_SIZES.UNKNOWNS]
    rhs = at(columns, m * n)
    largest = 0.0
    for k in range(m):
        residual[k], terms[k] = rhs[k], abs(rhs[k])
    for j in range(n):
        column = at(columns, m * j)
        entries = at(sizes, EFFORT_SIZES.ENTRIES + (1 + m) * j)
        for e in range(1, entries[0] + 1):
            k = entries[e]
            term = column[k] * x[j]
            residual[k] -= term
            terms[k] += abs(term)
    for k in range(m):
        # An equation without terms is fulfilled.
        terms[k] = terms[k] if terms[k] > 0.0 else 1.0
        largest = max(largest, abs(residual[k]) / terms[k])
    return largest


def fill_dual_hessian(
    sizes: Ints, numbers: Floats, columns: Floats, work: Floats, matrix: Floats
) -> None:
    """Fill the lower triangle of Σ_j compliance_j a_j a_jᵀ over unknowns within their bounds.

    a_j is column j of A. Unknowns at a bound do not change with the multipliers.

    This is the second derivative of the dual function without the proximal term, with opposite sign.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        columns: scaled columns of A.
        work: workspace of `solve_weighted_least_squares`, with y.
        matrix: lower triangle filled (m, m).
    """
    m, n = sizes[EFFORT_SIZES.EQUATIONS], sizes[EFFORT_SIZES.UNKNOWNS]
    for k in range(m * m):
        matrix[k] = 0.0
    for j in range(n):
        x = work[j] + work[n + j] * work[2 * n + j]
        if not numbers[EFFORT_NUMBERS.BOUNDS + j] < x < numbers[EFFORT_NUMBERS.BOUNDS + n + j]:
            continue
        column = at(columns, m * j)
        entries = at(sizes, EFFORT_SIZES.ENTRIES + (1 + m) * j)
        for e in range(1, entries[0] + 1):
            k = entries[e]
            row = at(matrix, m * k)
            factor = work[n + j] * column[k]
            for g in range(1, e + 1):
                row[entries[g]] += factor * column[entries[g]]


def line_search(
    sizes: Ints, numbers: Floats, rhs: Floats, step: Floats, multipliers: Floats, work: Floats
) -> float:
    """Return the step length in (0, 1] along `step`.

    Bisect until the slope of the dual function along the step is at most 0.1 of its initial value; the
    full step is accepted if the function still rises at its end.

    Args:
        sizes: sizes of the problem.
        numbers: exponent and bounds.
        rhs: right side b (m,).
        step: Newton step of the multipliers (m,).
        multipliers: multipliers at the start of the step (m,).
        work: workspace of `solve_weighted_least_squares`, with y = Aᵀ λ and its change along the step.
    """
    m = sizes[EFFORT_SIZES.EQUATIONS]
    n = sizes[EFFORT_SIZES.UNKNOWNS]
    low = 0.0
    high = 1.0
    step_length = 0.0
    start = 0.0
    y = at(work, 2 * n)
    change = at(work, 3 * n)
    centre = at(work, 4 * n)
    slight = at(work, 4 * n + 4 * m)
    for _ in range(MAX_LINE_SEARCH_TRIALS):
        # Slope of the dual function along the step, including the proximal term.
        rise = 0.0
        for k in range(m):
            rise += step[k] * (
                rhs[k] - slight[k] * (multipliers[k] + step_length * step[k] - centre[k])
            )
        for j in range(n):
            if change[j] != 0.0:
                rise -= change[j] * primal_from_multipliers(
                    numbers, n, j, work, y[j] + step_length * change[j]
                )
        # The first pass only measures the initial slope.
        if step_length == 0.0:
            start, step_length = rise, 1.0
        elif abs(rise) <= 0.1 * abs(start) or (step_length == 1.0 and rise > 0.0):
            break
        else:
            if rise > 0.0:
                low = step_length
            else:
                high = step_length
            step_length = 0.5 * (low + high)
    return step_length
