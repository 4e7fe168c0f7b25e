"""Poses that fulfil couplers, ranges and equations, and the curvature of the equations."""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.linear_algebra import (
    factorise_cholesky,
    factorise_equations,
    solve_cholesky,
    solve_minimum_norm,
)
from osimlite.mechanics.kernels.pointers import Floats, at, copy_numbers, is_finite
from osimlite.mechanics.kernels.pose_cost import (
    apply_couplers,
    count_equations,
    evaluate_coupler,
    evaluate_pose,
)
from osimlite.mechanics.kernels.pose_record import COUPLER, FIT, FREEDOM, Fit
from osimlite.mechanics.kernels.pose_step import gather_free_equations, list_free_coordinates
from osimlite.mechanics.kernels.projection import INDEPENDENCE

MAX_EQUATION_ERROR = 1e-13
"""Accepted error of the equations (m or rad)."""
DIFFERENCE_STEP = 1e-5
"""Step of the finite differences of equations (rad or m)."""


def fulfil_constraints(m: Fit, y: Floats) -> bool:
    """Move a pose into the ranges, to prescribed values, and onto couplers and equations.

    Args:
        m: inputs and workspace of the fit.
        y: state; its coordinates are changed.

    Returns:
        Whether the pose fulfils all equations afterwards.
    """
    p = m.p
    c = m.c
    v = m.v
    size = m.model[MODEL.DOFS]
    ranges, resolved = at(c, p[FIT.RANGES_AT]), at(p, p[FIT.RESOLVED_AT])
    for k in range(size):
        # Ranges first, then values that are prescribed, and those that depend on others last.
        if resolved[k] == FREEDOM.VARIABLE or resolved[k] >= FREEDOM.AT_END:
            y[k] = min(max(y[k], ranges[2 * k]), ranges[2 * k + 1])
    values = at(v, p[FIT.MEASURED] + 3 * p[FIT.MARKERS] + 9 * p[FIT.SENSORS] + p[FIT.GOALS])
    for k in range(p[FIT.PRESCRIBED]):
        y[p[p[FIT.PRESCRIBED_AT] + k]] = values[k]
    set_dependents(m, y)
    return count_equations(m) == 0 or restore_equations(m, y)


def set_dependents(m: Fit, y: Floats) -> None:
    """Set all dependent coordinates by their couplers, in the order of the couplers.

    Args:
        m: inputs and workspace of the fit.
        y: state; its coordinates are changed.
    """
    p = m.p
    size = m.model[MODEL.DOFS]
    for number in range(p[FIT.COUPLERS]):
        i = at(p, p[p[FIT.COUPLER_AT] + number])
        y[i[COUPLER.DEPENDENT]], _ = evaluate_coupler(
            m, i, y, at(m.v, p[FIT.WORKSPACE]), at(m.v, p[FIT.WORKSPACE] + size)
        )


def restore_equations(m: Fit, y: Floats) -> bool:
    """Move a pose onto the equations by minimum-norm Newton steps of the free coordinates.

    Args:
        m: inputs and workspace of the fit.
        y: state; its coordinates are changed.

    Returns:
        Whether the pose fulfils the equations afterwards.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    count = count_equations(m)
    errors = at(v, p[FIT.ERRORS])
    step = at(v, p[FIT.STEP])
    ranges = at(m.c, p[FIT.RANGES_AT])
    previous_error = inf
    for _ in range(50):
        evaluate_pose(m, y)
        apply_couplers(m, y)
        largest_error = 0.0
        for k in range(count):
            largest_error = max(largest_error, abs(errors[k]))
        if largest_error <= MAX_EQUATION_ERROR:
            return True
        # Rounding may keep the errors above MAX_EQUATION_ERROR; then the search ends when a step
        # no longer halves them.
        if largest_error <= 1e-9 and largest_error >= 0.5 * previous_error:
            return True
        previous_error = largest_error
        free = list_free_coordinates(m)
        factor, right, work = gather_free_equations(m, free, 0)
        rank = factorise_equations(count, free, factor, INDEPENDENCE * count)
        solve_minimum_norm(count, free, factor, rank, right, work, step)
        furthest = 0.0
        for k in range(free):
            furthest = max(furthest, abs(step[k]))
        # Steps of at most half a radian or metre keep the linearization valid.
        fraction = 1.0 if furthest <= 0.5 else 0.5 / furthest
        for k in range(free):
            freedom = p[p[FIT.FREE_AT] + k]
            trial_value = y[freedom] + fraction * step[k]
            y[freedom] = min(max(trial_value, ranges[2 * freedom]), ranges[2 * freedom + 1])
        set_dependents(m, y)
        if not is_finite(size, y):
            return False
    return False


def clear_curvature(m: Fit) -> None:
    """Set the equations' part of the Hessian to zero."""
    size = m.model[MODEL.DOFS]
    if count_equations(m) > 0:
        for k in range(size * size):
            m.v[m.p[FIT.CURVES] + k] = 0.0


def compute_curvature(m: Fit, y: Floats) -> None:
    """Compute the equations' part of the Hessian: their second derivatives times their multipliers.

    The derivatives of the cost must be known, and are lost.

    Args:
        m: inputs and workspace of the fit.
        y: state of the pose.
    """
    p = m.p
    v = m.v
    size = m.model[MODEL.DOFS]
    count = count_equations(m)
    rows, slope, curves = at(v, p[FIT.ROWS]), at(v, p[FIT.SLOPE]), at(v, p[FIT.CURVES])
    pulls = at(curves, size * size)
    trial = at(v, p[FIT.TRIAL])
    free = list_free_coordinates(m)
    normal = at(v, p[FIT.WORKSPACE] + 2 * size)
    for i in range(count):
        pulls[i] = 0.0
        for k in range(free):
            pulls[i] -= rows[size * i + p[p[FIT.FREE_AT] + k]] * slope[p[p[FIT.FREE_AT] + k]]
        for j in range(count):
            # A small diagonal keeps the normal equations regular where equations are redundant.
            total = 1e-12 if i == j else 0.0
            for k in range(free):
                freedom = p[p[FIT.FREE_AT] + k]
                total += rows[size * i + freedom] * rows[size * j + freedom]
            normal[count * i + j] = total
    clear_curvature(m)
    if not factorise_cholesky(count, normal, 0.0):
        return
    # Multipliers by least squares: the gradient of the Lagrangian is as small as possible.
    solve_cholesky(count, normal, pulls)
    for k in range(free):
        freedom = p[p[FIT.FREE_AT] + k]
        # Central differences of the rows, symmetrized by adding half on either side.
        for side in range(2):
            factor = (0.5 - side) / DIFFERENCE_STEP
            copy_numbers(size, y, trial)
            trial[freedom] += DIFFERENCE_STEP if side == 0 else -DIFFERENCE_STEP
            set_dependents(m, trial)
            evaluate_pose(m, trial)
            apply_couplers(m, trial)
            for i in range(count):
                for j in range(size):
                    change = 0.5 * factor * pulls[i] * rows[size * i + j]
                    curves[size * freedom + j] += change
                    curves[size * j + freedom] += change
