"""One step towards the pose that fits best: the minimum of the quadratic model of the cost.

The model is minimized over the directions that couplers, equations and ends of ranges leave free
(J. Nocedal, S. Wright, Numerical Optimization, 2006, chapters 16.2 and 16.7).
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.linear_algebra import (
    factorise_cholesky,
    factorise_equations,
    solve_cholesky,
    solve_minimum_norm,
    write_null_space,
)
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.kernels.pose_cost import count_equations
from osimlite.mechanics.kernels.pose_record import FIT, FREEDOM, Fit
from osimlite.mechanics.kernels.projection import INDEPENDENCE

MIN_PIVOT = 1e-14
"""Smallest pivot relative to the stiffness with which the model counts as convex."""
ADDED_STIFFNESS = 0.01
"""Stiffness (m²/rad²) that is added to that of a coordinate where a step is damped."""


def list_free_coordinates(m: Fit) -> int:
    """List the coordinates that are free and not at an end of their range.

    Args:
        m: the fit; its list of free coordinates is filled.

    Returns:
        Number of these coordinates.
    """
    p, count = m.p, 0
    for k in range(m.model[MODEL.DOFS]):
        if p[p[FIT.RESOLVED_AT] + k] == FREEDOM.VARIABLE:
            p[p[FIT.FREE_AT] + count] = k
            count += 1
    return count


def gather_free_equations(m: Fit, free: int, has_step: int) -> tuple[Floats, Floats, Floats]:
    """Return the equations for the free coordinates.

    Args:
        m: inputs and workspace of the fit.
        free: number of free coordinates.
        has_step: 1 if the steps of coordinates at ends of ranges are subtracted, else 0.

    Returns:
        Workspace of their factor, which begins with the left sides; right sides; workspace after them.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    count = count_equations(m)
    rows = at(v, p[FIT.ROWS])
    errors = at(v, p[FIT.ERRORS])
    step = at(v, p[FIT.STEP])
    factor = at(v, p[FIT.WORKSPACE] + 2 * size)
    right = at(factor, count * size + count * count + 3 * count + 1)
    for k in range(count):
        right[k] = -errors[k]
        for j in range(free):
            factor[free * k + j] = rows[size * k + p[p[FIT.FREE_AT] + j]]
        if has_step > 0:
            for j in range(size):
                if p[p[FIT.RESOLVED_AT] + j] == FREEDOM.AT_END:
                    right[k] -= rows[size * k + j] * step[j]
    return factor, right, at(right, count)


def find_active_range_ends(m: Fit, y: Floats) -> None:
    """Mark the coordinates that stay at an end of their range.

    These are the ones that the gradient pulls outwards, and those whose range is a single value.

    Args:
        m: the fit, with the gradient of the pose.
        y: state of the pose.
    """
    p, v = m.p, m.v
    ranges, slope = at(m.c, p[FIT.RANGES_AT]), at(v, p[FIT.SLOPE])
    for k in range(m.model[MODEL.DOFS]):
        if (
            p[p[FIT.RESOLVED_AT] + k] == FREEDOM.VARIABLE
            or p[p[FIT.RESOLVED_AT] + k] == FREEDOM.AT_END
        ):
            low = ranges[2 * k]
            high = ranges[2 * k + 1]
            is_at_end_of_range = (
                (y[k] <= low and slope[k] > 0.0) or (y[k] >= high and slope[k] < 0.0) or low == high
            )
            p[p[FIT.RESOLVED_AT] + k] = FREEDOM.AT_END if is_at_end_of_range else FREEDOM.VARIABLE


def release_range_ends(m: Fit) -> None:
    """Mark all coordinates at an end of their range as free."""
    p = m.p
    for k in range(m.model[MODEL.DOFS]):
        if p[p[FIT.RESOLVED_AT] + k] == FREEDOM.AT_END:
            p[p[FIT.RESOLVED_AT] + k] = FREEDOM.VARIABLE


def find_step(m: Fit, y: Floats, damping: float, uses_hessian: bool) -> bool:
    """Compute the step of all coordinates to the minimum of the model within the ranges.

    Args:
        m: inputs and workspace of the fit.
        y: state.
        damping: damping of the step.
        uses_hessian: whether the model includes the part of the Hessian beyond Gauss-Newton.

    Returns:
        Whether the model is convex.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    step, ranges = at(v, p[FIT.STEP]), at(m.c, p[FIT.RANGES_AT])
    for k in range(size):
        step[k] = 0.0
    # Active-set method: coordinates that would leave their ranges stop at the ends, and the others
    # are solved again.
    while True:
        free = list_free_coordinates(m)
        solution = solve_free(m, free, damping, 1.0 if uses_hessian else 0.0, MIN_PIVOT)
        if solution < 0:
            return False
        result = at(v, solution)
        has_left_range = False
        for k in range(free):
            freedom = p[p[FIT.FREE_AT] + k]
            trial_value = y[freedom] + result[k]
            end = (
                ranges[2 * freedom]
                if trial_value < ranges[2 * freedom]
                else ranges[2 * freedom + 1]
            )
            if trial_value < ranges[2 * freedom] or trial_value > ranges[2 * freedom + 1]:
                step[freedom], p[p[FIT.RESOLVED_AT] + freedom], has_left_range = (
                    end - y[freedom],
                    FREEDOM.AT_END,
                    True,
                )
        if not has_left_range:
            for k in range(free):
                step[p[p[FIT.FREE_AT] + k]] = result[k]
            return True


def solve_free(m: Fit, free: int, damping: float, curvature_factor: float, smallest: float) -> int:
    """Compute the step of the free coordinates, after that of the coordinates at ends of ranges.

    Args:
        m: inputs and workspace of the fit.
        free: number of free coordinates.
        damping: damping of the step.
        curvature_factor: factor of the part of the Hessian beyond Gauss-Newton.
        smallest: smallest pivot relative to the stiffness.

    Returns:
        The offset of the step in the workspace, or -1 if the model is not convex.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    stiffness = at(v, p[FIT.STIFFNESS])
    bend = at(v, p[FIT.BEND])
    slope = at(v, p[FIT.SLOPE])
    step = at(v, p[FIT.STEP])
    count = count_equations(m)
    offset = (
        p[FIT.WORKSPACE] + 2 * size + (count * size + count * count + 3 * count + 1) + 2 * count
    )
    solution = at(v, offset)
    matrix = at(v, offset + size)
    for k in range(free):
        freedom = p[p[FIT.FREE_AT] + k]
        # Steps that are known already move to the right side.
        row = at(stiffness, size * freedom)
        bend_row = at(bend, size * freedom)
        total = -slope[freedom]
        constraint_row = at(v, p[FIT.CURVES] + (size * freedom if count > 0 else 0))
        for j in range(size):
            if p[p[FIT.RESOLVED_AT] + j] == FREEDOM.AT_END:
                total -= (row[j] + curvature_factor * bend_row[j]) * step[j]
        solution[k] = total
        for j in range(free):
            column = p[p[FIT.FREE_AT] + j]
            matrix[free * k + j] = row[column] + curvature_factor * bend_row[column]
            if count > 0:
                matrix[free * k + j] += curvature_factor * constraint_row[column]
        # Levenberg-Marquardt damping relative to the stiffness, plus a part for coordinates without
        # any.
        matrix[free * k + k] += damping * (row[freedom] + ADDED_STIFFNESS)
    if count == 0:
        if not factorise_cholesky(free, matrix, smallest):
            return -1
        solve_cholesky(free, matrix, solution)
        return offset
    return solve_constrained(m, free, offset, smallest)


def solve_constrained(m: Fit, free: int, offset: int, smallest: float) -> int:
    """Compute the step of the free coordinates in the null space of the equations.

    Args:
        m: inputs and workspace of the fit.
        free: number of free coordinates.
        offset: offset of the right side and the matrix in the workspace.
        smallest: smallest pivot relative to the stiffness.

    Returns:
        The offset of the step in the workspace, or -1 if the model is not convex.
    """
    v = m.v
    size = m.model[MODEL.DOFS]
    count = count_equations(m)
    solution = at(v, offset)
    matrix = at(v, offset + size)
    across = at(matrix, size * size)
    directions = at(across, size)
    reduced = at(directions, size * size)
    # The shortest step that restores the equations; the rest moves in their null space.
    factor, right, work = gather_free_equations(m, free, 1)
    rank = factorise_equations(count, free, factor, INDEPENDENCE * count)
    solve_minimum_norm(count, free, factor, rank, right, work, across)
    dimension = free - rank
    write_null_space(free, factor, rank, directions)
    # Gradient after that step.
    for k in range(free):
        for j in range(free):
            solution[k] -= matrix[free * k + j] * across[j]
    rhs = at(reduced, dimension * dimension)
    # Projections of gradient and Hessian on the null space.
    for k in range(dimension):
        row = at(directions, free * k)
        rhs[k] = 0.0
        for j in range(free):
            rhs[k] += row[j] * solution[j]
    for k in range(dimension):
        row = at(directions, free * k)
        product = at(rhs, dimension)
        for i in range(free):
            product[i] = 0.0
            for j in range(free):
                product[i] += matrix[free * i + j] * row[j]
        for column in range(k + 1):
            total = 0.0
            second = at(directions, free * column)
            for i in range(free):
                total += second[i] * product[i]
            reduced[dimension * k + column] = reduced[dimension * column + k] = total
    if not factorise_cholesky(dimension, reduced, smallest):
        return -1
    solve_cholesky(dimension, reduced, rhs)
    for j in range(free):
        total = across[j]
        for k in range(dimension):
            total += directions[free * k + j] * rhs[k]
        solution[j] = total
    return offset
