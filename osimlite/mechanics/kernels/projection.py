"""The nearest state where constraints hold.

When states are projected, how exactly, and by which measure of nearness, is as in Simbody, so that
the steps are those of OpenSim: positions and speeds are left alone as long as the root mean square
of the errors of all constraints, locks included, is below the tolerance, and brought to a tenth of
it otherwise; a change of a speed above 1 counts relative to it; and what lies across the
constraints counts as no error of the integration.
"""

from __future__ import annotations

from math import inf, sqrt

from osimlite.mechanics.kernels.constrained_dynamics import bind
from osimlite.mechanics.kernels.layout import CONSTRAINED, CONSTRAINT, MODEL, OUTCOME, STAGE, WORK
from osimlite.mechanics.kernels.linear_algebra import factored, solved
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.laws.rotations import sine_cosine

OVERSHOOT = 0.1
"""The part of the tolerance that a projection aims at."""
FINEST = 2.0 ** (-52.0 * 7.0 / 8.0)
"""Errors of constraints below this are rounding: Simbody's significant part of a double (Real), eps^(7/8)."""
REDUNDANT = 2.0**-26
"""Times the number of equations: how nearly one must follow from others to be dropped."""
ITERATIONS = 20
"""Newton's steps of a projection."""


def project(
    model: Ints, reals: Floats, data: Floats, y: Floats, off: Floats, has_errors: int
) -> int:
    """Move a state to where the constraints hold, if it is near; else it stays.

    Args: model: the mechanism. reals: its numbers. data: what the constraints may be off, and may
        be off at most in y, are in SCRATCH. y: the state. off: how far off each entry of it may be;
        of that, what lies across the constraints is taken away. has_errors: 0 if that is not known.

    Returns:
        OK if they hold then.
    """
    size, h = model[MODEL.DOFS], at(model, model[MODEL.CONSTRAINED])
    tolerance, limit = data[WORK.SCRATCH], data[WORK.SCRATCH + 1]
    trial = at(data, h[CONSTRAINED.WORK_TRIAL])
    for k in range(2 * size):
        trial[k] = y[k]
    status = bound(model, reals, data, trial)
    if status == OUTCOME.OK:
        status = project_values(model, reals, data, trial, off, has_errors, tolerance, limit)
    if status == OUTCOME.OK:
        status = project_speeds(model, data, trial, at(off, size), has_errors, tolerance, limit)
    if status == OUTCOME.OK:
        for k in range(2 * size):
            y[k] = trial[k]
    return status


def bound(model: Ints, reals: Floats, data: Floats, y: Floats) -> int:
    """All equations at a state."""
    f = at(data, model[model[MODEL.CONSTRAINED] + CONSTRAINED.WORK_TRIAL] + 2 * model[MODEL.DOFS])
    status = call(model[MODEL.LAWS], model, reals, data, y, f, STAGE.VELOCITY)
    if status == OUTCOME.OK:
        bind(model, reals, data, y, f)
    return status


def project_values(
    model: Ints,
    reals: Floats,
    data: Floats,
    y: Floats,
    off: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> int:
    """Change the values of a state whose equations are known, and the errors with them; the equations follow."""
    size, h = model[MODEL.DOFS], at(model, model[MODEL.CONSTRAINED])
    count, kept, factor = (
        h[CONSTRAINED.POSITIONS],
        at(data, h[CONSTRAINED.WORK_KEPT]),
        at(data, h[CONSTRAINED.WORK_FACTOR]),
    )
    errors = at(data, h[CONSTRAINED.WORK_SYSTEM])
    room, step, following = (
        at(errors, count),
        at(errors, 2 * count),
        at(data, h[CONSTRAINED.WORK_TRIAL] + 4 * size),
    )
    norm = position_errors(model, data, errors)
    if norm <= tolerance:
        return OUTCOME.OK
    if not norm <= limit:
        return OUTCOME.FAR
    for iteration in range(ITERATIONS):
        rows_by_values(model, data, y, kept)
        for k in range(count * size):
            factor[k] = kept[k]
        factored(model, data, count, factor, REDUNDANT * count)
        solved(model, count, factor, errors, room, step)
        for k in range(size):
            following[k], following[size + k] = y[k] - step[k], y[size + k]
        before, norm = norm, inf
        if bound(model, reals, data, following) == OUTCOME.OK:
            norm = position_errors(model, data, errors)
        if iteration > 0 and not norm <= before:
            norm = before
            break
        for k in range(size):
            y[k] = following[k]
        if norm <= max(OVERSHOOT * tolerance, FINEST):
            break
    if not norm <= tolerance:
        return OUTCOME.FAR
    if has_errors > 0:
        across(model, count, kept, factor, off, errors, room, step)
        for k in range(size):
            off[k] -= step[k]
    return bound(model, reals, data, y)


def project_speeds(
    model: Ints,
    data: Floats,
    y: Floats,
    off: Floats,
    has_errors: int,
    tolerance: float,
    limit: float,
) -> int:
    """Change the speeds of a state whose equations are known, and their errors with them."""
    size, h = model[MODEL.DOFS], at(model, model[MODEL.CONSTRAINED])
    count, rows, factor = (
        h[CONSTRAINED.EQUATIONS],
        at(data, h[CONSTRAINED.WORK_ROWS]),
        at(data, h[CONSTRAINED.WORK_FACTOR]),
    )
    errors, scales, u = (
        at(data, h[CONSTRAINED.WORK_SYSTEM]),
        at(data, h[CONSTRAINED.WORK_TRIAL] + 4 * size),
        at(y, size),
    )
    room, step = at(errors, count), at(errors, 2 * count)
    norm = speed_errors(model, data, u, errors)
    if norm <= tolerance:
        return OUTCOME.OK
    if not norm <= limit:
        return OUTCOME.FAR
    for k in range(size):
        scales[k] = max(abs(u[k]), 1.0)
    for i in range(count):
        for k in range(size):
            factor[size * i + k] = scales[k] * rows[size * i + k]
    factored(model, data, count, factor, REDUNDANT * count)
    # The rows do not depend on the speeds: one step does, a second one mends its rounding.
    for _ in range(2):
        solved(model, count, factor, errors, room, step)
        for k in range(size):
            u[k] -= scales[k] * step[k]
        norm = speed_errors(model, data, u, errors)
        if norm <= max(OVERSHOOT * tolerance, FINEST):
            break
    if not norm <= tolerance:
        return OUTCOME.FAR
    if has_errors > 0:
        across(model, count, rows, factor, off, errors, room, step)
        for k in range(size):
            off[k] -= scales[k] * step[k]
    return OUTCOME.OK


def across(
    model: Ints,
    count: int,
    rows: Floats,
    factor: Floats,
    off: Floats,
    values: Floats,
    room: Floats,
    found: Floats,
) -> None:
    """What of some errors lies across equations, of which the factor is known."""
    size = model[MODEL.DOFS]
    for i in range(count):
        values[i] = 0.0
        for k in range(size):
            values[i] += rows[size * i + k] * off[k]
    solved(model, count, factor, values, room, found)


def position_errors(model: Ints, data: Floats, errors: Floats) -> float:
    """The errors of the positions one after the other, and their root mean square."""
    h, count, total = at(model, model[MODEL.CONSTRAINED]), 0, 0.0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = at(model, model[h[CONSTRAINED.CONSTRAINT_AT] + number])
        for row in range(
            constraint[CONSTRAINT.FIRST_EQUATION], constraint[CONSTRAINT.END_POSITION]
        ):
            errors[count] = data[h[CONSTRAINED.WORK_ERRORS] + row]
            total += errors[count] * errors[count]
            count += 1
    return sqrt(total / max(count + h[CONSTRAINED.LOCKS], 1))


def speed_errors(model: Ints, data: Floats, u: Floats, errors: Floats) -> float:
    """The errors of the speeds, and their root mean square."""
    h, size, total = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS], 0.0
    rows, rates = at(data, h[CONSTRAINED.WORK_ROWS]), at(data, h[CONSTRAINED.WORK_RATES])
    for i in range(h[CONSTRAINED.EQUATIONS]):
        error = -rates[i]
        for k in range(size):
            error += rows[size * i + k] * u[k]
        errors[i] = error
        total += error * error
    return sqrt(total / max(h[CONSTRAINED.EQUATIONS] + h[CONSTRAINED.LOCKS], 1))


def rows_by_values(model: Ints, data: Floats, y: Floats, rows: Floats) -> None:
    """Derivatives of the errors of the positions by the coordinates."""
    h, size, count = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS], 0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = at(model, model[h[CONSTRAINED.CONSTRAINT_AT] + number])
        for i in range(constraint[CONSTRAINT.FIRST_EQUATION], constraint[CONSTRAINT.END_POSITION]):
            row, given = at(rows, size * count), at(data, h[CONSTRAINED.WORK_ROWS] + size * i)
            for k in range(size):
                row[k] = given[k]
            count += 1
    for number in range(h[CONSTRAINED.BALLS]):
        a = at(model, model[h[CONSTRAINED.BALL_AT] + number])
        s1, c1 = sine_cosine(y[a[0]])
        s2, c2 = sine_cosine(y[a[1]])
        for i in range(count):
            # The speeds are the rates of the angles times their axes.
            row = at(rows, size * i)
            ux, uy, uz = row[a[0]], row[a[1]], row[a[2]]
            row[a[1]] = c1 * uy + s1 * uz
            row[a[2]] = s2 * ux - s1 * c2 * uy + c1 * c2 * uz
