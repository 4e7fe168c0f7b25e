"""Projection of states onto the constraints.

When states are projected, how exactly, and in which norm follows Simbody, so that the steps are
those of OpenSim: positions and speeds are left alone as long as the root mean square of the errors
of all constraints, locks included, is below the tolerance, and are brought to a tenth of it
otherwise. A change of a speed above 1 counts relative to the speed. The component of an
integration error normal to the constraints is removed from the error.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.layout import CONSTRAINED, CONSTRAINT, MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.linear_algebra import factorise_by_law, solve_by_law
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.laws.rotations import sine_cosine

TARGET_FRACTION = 0.1
"""Part of the tolerance that a projection aims at."""
ROUNDING_ERROR = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Errors of constraints below this are rounding: Simbody's significant part of a double (Real), eps^(7/8)."""
INDEPENDENCE = 2.0**-26
"""Threshold of independence per equation, see `factorise_equations`."""
MAX_NEWTON_STEPS = 20
"""Largest number of Newton steps of a projection."""


def project(
    model: Ints, reals: Floats, data: Floats, y: Floats, state_errors: Floats, has_errors: int
) -> int:
    """Move a state onto the constraints if it is near them; else leave it as it is.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; SCRATCH holds the tolerance, and the largest error to start from.
        y: state; changed.
        state_errors: estimated error of each entry of the state, whose normal component is removed.
        has_errors: 0 if no errors are known.

    Returns:
        `OUTCOME.OK` if the constraints hold afterwards, else FAR or the outcome of an evaluation.
    """
    size = model[MODEL.DOFS]
    h = at(model, model[MODEL.CONSTRAINED])
    tolerance = data[WORK.SCRATCH]
    limit = data[WORK.SCRATCH + 1]
    # Work on a copy: a state that cannot be projected stays as it was.
    trial = at(data, h[CONSTRAINED.WORK_TRIAL])
    for k in range(2 * size):
        trial[k] = y[k]
    status = evaluate_equations(model, reals, data, trial)
    if status == OUTCOME.OK:
        status = project_values(
            model, reals, data, trial, state_errors, has_errors, tolerance, limit
        )
    if status == OUTCOME.OK:
        # Speeds after positions, because G depends on the positions.
        status = project_speeds(
            model, data, trial, at(state_errors, size), has_errors, tolerance, limit
        )
    if status == OUTCOME.OK:
        for k in range(2 * size):
            y[k] = trial[k]
    return status


def evaluate_equations(model: Ints, reals: Floats, data: Floats, y: Floats) -> int:
    """Evaluate all constraint equations at a state.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results; changed.
        y: state.

    Returns:
        Outcome of the evaluation, see `OUTCOME`.
    """
    # Rates go to workspace behind the trial state.
    f = at(data, model[model[MODEL.CONSTRAINED] + CONSTRAINED.WORK_TRIAL] + 2 * model[MODEL.DOFS])
    status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.VELOCITY)
    if status == OUTCOME.OK:
        evaluate_constraints(model, reals, data, y, f)
    return status


def project_values(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    state_errors: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> int:
    """Project the coordinates of a state onto the position constraints by Gauss-Newton steps.

    Each step solves J dq = g(q) with least |dq|, and subtracts dq (as `projectQ` of Simbody does).
    The constraint equations must have been evaluated at the state; they are evaluated again at the
    projected one.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the equations.
        y: state; its coordinates are changed.
        state_errors: estimated errors of the coordinates (n,), whose normal component is removed.
        has_errors: 0 if no errors are known.
        tolerance: accepted root mean square of the errors.
        limit: largest root mean square to start from.

    Returns:
        `OUTCOME.OK` or FAR.
    """
    size = model[MODEL.DOFS]
    h = at(model, model[MODEL.CONSTRAINED])
    count = h[CONSTRAINED.POSITIONS]
    jacobian = at(data, h[CONSTRAINED.WORK_COPY])
    factor = at(data, h[CONSTRAINED.WORK_FACTOR])
    errors = at(data, h[CONSTRAINED.WORK_SYSTEM])
    work = at(errors, count)
    step = at(errors, 2 * count)
    trial_state = at(data, h[CONSTRAINED.WORK_TRIAL] + 4 * size)
    # Simbody leaves states alone that fulfil the constraints within the tolerance.
    norm = collect_position_errors(model, data, errors)
    if norm <= tolerance:
        return OUTCOME.OK
    # Also true for NaN.
    if not norm <= limit:
        return OUTCOME.FAR
    for iteration in range(MAX_NEWTON_STEPS):
        write_position_jacobian(model, data, y, jacobian)
        for k in range(count * size):
            factor[k] = jacobian[k]
        factorise_by_law(model, data, count, factor, INDEPENDENCE * count)
        solve_by_law(model, count, factor, errors, work, step)
        for k in range(size):
            # Speeds are copied, since the evaluation of velocities needs a complete state.
            trial_state[k], trial_state[size + k] = y[k] - step[k], y[size + k]
        previous_norm, norm = norm, inf
        if evaluate_equations(model, reals, data, trial_state) == OUTCOME.OK:
            norm = collect_position_errors(model, data, errors)
        # As in Simbody, the first step is accepted even if it increases the errors; a later one
        # that does ends the search.
        if iteration > 0 and not norm <= previous_norm:
            norm = previous_norm
            break
        for k in range(size):
            y[k] = trial_state[k]
        if norm <= max(TARGET_FRACTION * tolerance, ROUNDING_ERROR):
            break
    if not norm <= tolerance:
        return OUTCOME.FAR
    # The integrator must not shrink its steps for errors that the projection has removed.
    if has_errors > 0:
        normal_component(model, count, jacobian, factor, state_errors, errors, work, step)
        for k in range(size):
            state_errors[k] -= step[k]
    # The last evaluation may have been at a rejected state.
    return evaluate_equations(model, reals, data, y)


def project_speeds(
    model: Ints,
    data: Floats,
    y: Floats,
    state_errors: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> int:
    """Project the speeds of a state whose equations are known.

    Args:
        model: integers of the model.
        data: results with the equations.
        y: state; its speeds are changed.
        state_errors: estimated errors of the speeds (n,), whose normal component is removed.
        has_errors: 0 if no errors are known.
        tolerance: accepted root mean square of the errors.
        limit: largest root mean square to start from.

    Returns:
        `OUTCOME.OK` or FAR.
    """
    size = model[MODEL.DOFS]
    h = at(model, model[MODEL.CONSTRAINED])
    count = h[CONSTRAINED.EQUATIONS]
    rows = at(data, h[CONSTRAINED.WORK_ROWS])
    factor = at(data, h[CONSTRAINED.WORK_FACTOR])
    errors = at(data, h[CONSTRAINED.WORK_SYSTEM])
    scales = at(data, h[CONSTRAINED.WORK_TRIAL] + 4 * size)
    u = at(y, size)
    work = at(errors, count)
    step = at(errors, 2 * count)
    norm = compute_speed_errors(model, data, u, errors)
    if norm <= tolerance:
        return OUTCOME.OK
    if not norm <= limit:
        return OUTCOME.FAR
    # Simbody weights a change of a speed above 1 by the speed.
    for k in range(size):
        scales[k] = max(abs(u[k]), 1.0)
    for i in range(count):
        for k in range(size):
            factor[size * i + k] = scales[k] * rows[size * i + k]
    factorise_by_law(model, data, count, factor, INDEPENDENCE * count)
    # G does not depend on the speeds: one step is enough, a second one removes its rounding errors.
    for _ in range(2):
        solve_by_law(model, count, factor, errors, work, step)
        for k in range(size):
            u[k] -= scales[k] * step[k]
        norm = compute_speed_errors(model, data, u, errors)
        if norm <= max(TARGET_FRACTION * tolerance, ROUNDING_ERROR):
            break
    if not norm <= tolerance:
        return OUTCOME.FAR
    if has_errors > 0:
        normal_component(model, count, rows, factor, state_errors, errors, work, step)
        for k in range(size):
            state_errors[k] -= scales[k] * step[k]
    return OUTCOME.OK


def normal_component(
    model: Ints,
    count: int,
    rows: Floats,
    factor: Floats,
    state_errors: Floats,
    values: Floats,
    work: Floats,
    normal: Floats,
) -> None:
    """Compute the component of a vector of errors normal to factorised equations.

    Args:
        model: integers of the model.
        count: number of equations.
        rows: coefficients of the equations (count, n).
        factor: factorisation of `rows`.
        state_errors: vector of errors (n,).
        values: workspace (count,).
        work: workspace (count,).
        normal: filled with the normal component (n,).
    """
    size = model[MODEL.DOFS]
    for i in range(count):
        values[i] = 0.0
        for k in range(size):
            values[i] += rows[size * i + k] * state_errors[k]
    solve_by_law(model, count, factor, values, work, normal)


def collect_position_errors(model: Ints, data: Floats, errors: Floats) -> float:
    """Collect the errors of the positions.

    Args:
        model: integers of the model.
        data: results with the equations.
        errors: filled with the errors (p,).

    Returns:
        Root mean square of the errors; locks count as equations without error, as in Simbody.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    count = 0
    total = 0.0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = at(model, model[h[CONSTRAINED.CONSTRAINT_AT] + number])
        for row in range(
            constraint[CONSTRAINT.FIRST_EQUATION], constraint[CONSTRAINT.END_POSITION]
        ):
            errors[count] = data[h[CONSTRAINED.WORK_ERRORS] + row]
            total += errors[count] * errors[count]
            count += 1
    return sqrt(total / max(count + h[CONSTRAINED.LOCKS], 1))


def compute_speed_errors(model: Ints, data: Floats, u: Floats, errors: Floats) -> float:
    """Compute the errors G u - b of the speeds.

    Args:
        model: integers of the model.
        data: results with the equations.
        u: generalized speeds (n,).
        errors: filled with the errors (m,).

    Returns:
        Root mean square of the errors; locks count as equations without error, as in Simbody.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    total = 0.0
    rows, rates = at(data, h[CONSTRAINED.WORK_ROWS]), at(data, h[CONSTRAINED.WORK_RATES])
    for i in range(h[CONSTRAINED.EQUATIONS]):
        error = -rates[i]
        for k in range(size):
            error += rows[size * i + k] * u[k]
        errors[i] = error
        total += error * error
    return sqrt(total / max(h[CONSTRAINED.EQUATIONS] + h[CONSTRAINED.LOCKS], 1))


def write_position_jacobian(model: Ints, data: Floats, y: Floats, rows: Floats) -> None:
    """Write the derivatives of the position errors by the coordinates, not by the speeds.

    Args:
        model: integers of the model.
        data: results with the equations.
        y: state.
        rows: filled with the derivatives (p, n).
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    count = 0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = at(model, model[h[CONSTRAINED.CONSTRAINT_AT] + number])
        for i in range(constraint[CONSTRAINT.FIRST_EQUATION], constraint[CONSTRAINT.END_POSITION]):
            row = at(rows, size * count)
            speed_row = at(data, h[CONSTRAINED.WORK_ROWS] + size * i)
            for k in range(size):
                row[k] = speed_row[k]
            count += 1
    # Speeds and coordinates differ for balls only. With the angular velocity w = B qdot, the
    # derivatives by the angles are those by the speeds times B.
    for number in range(h[CONSTRAINED.BALLS]):
        a = at(model, model[h[CONSTRAINED.BALL_AT] + number])
        s1, c1 = sine_cosine(y[a[0]])
        s2, c2 = sine_cosine(y[a[1]])
        for i in range(count):
            # The angular velocity of a ball is the sum of its axes times the rates of the angles.
            row = at(rows, size * i)
            ux, uy, uz = row[a[0]], row[a[1]], row[a[2]]
            row[a[1]] = c1 * uy + s1 * uz
            row[a[2]] = s2 * ux - s1 * c2 * uy + c1 * c2 * uz
