"""Assembly of poses: the pose nearest to a target that fulfils the constraints, for many poses.

The search is that of :mod:`osimlite.mechanics.multibody.assembly`: a projection onto the
constraints by Newton's method, then minimisation of half the sum of squared changes of the
coordinates along the constraints (J. Nocedal, S. Wright, Numerical Optimization, 2006, chapter
15.3). With Z, an orthonormal basis of the null space of the linearized equations, g, the gradient,
and H, the Hessian, the step is Z p with Zᵀ H Z p = -Zᵀ g. H lacks the curvature of the constraints
while the search converges quickly, and contains it otherwise.
"""

from __future__ import annotations

from math import inf

from osimlite.mechanics.kernels.assembly_equations import (
    ASSEMBLY,
    ASSEMBLY_ARRAY,
    ASSEMBLY_NUMBERS,
    HOLD,
    UNCOUNTED_MOBILITY,
    Assembly,
    count_equations,
    equation_factor,
    equation_rows,
    evaluate_equations,
    factorise_rows,
    list_freed,
)
from osimlite.mechanics.kernels.layout import CONSTRAINED, MODEL, OUTCOME, WORK, Record
from osimlite.mechanics.kernels.linear_algebra import (
    diagonalize,
    factor_size,
    factorise_cholesky,
    solve_cholesky,
    solve_minimum_norm,
    write_null_space,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, copy_numbers


class POSE_STATUS(metaclass=Record):
    """Results for a pose."""

    ASSEMBLED = 0.0
    """Pose that fulfils the constraints."""
    UNASSEMBLED = 1.0
    """Pose near which no pose fulfils the constraints."""


MAX_STEPS = 100
"""Largest number of steps of a search."""
LONGEST_STEP = 0.5
"""Largest change of a coordinate in one step towards the constraints (m or rad)."""
RANGE_TOLERANCE = 1e-12
"""Largest distance of a coordinate outside of its range (m or rad)."""
ROUNDING_ERROR = 1e-15
"""Errors of equations below this are rounding errors (m or rad)."""
SHORTEST_STEP = 1e-13
"""A step shorter than this part of the largest coordinate, or of 1, ends the search."""
TINY_STEP = 1e-6
"""Length (m or rad) below which rounding hides whether a step decreases the cost.

Such a step is taken as long as steps shrink.
"""
FAST_CONVERGENCE = 0.1
"""Steps that shrink by less than this factor need the curvature of the constraints."""
DIFFERENCE_STEP = 1e-6
"""Length of the finite differences of the equations (m or rad)."""
MIN_CURVATURE = 1e-7
"""Curvature of the cost below which a direction counts as undetermined."""
MIN_SLOPE = 1e-12
"""Slope of the cost (m or rad) below which a direction without curvature counts as level."""
SAFE_PIVOT = 1e-6
"""Least pivot of Cholesky's method above which no curvature is below `MIN_CURVATURE`."""


def assembly_work_size(count: int, size: int) -> int:
    """Return the length of the work vector.

    Args:
        count: number of equations m.
        size: number of degrees of freedom n.
    """
    # The terms follow the sections that `Assembly` lists.
    return (
        7 * size
        + 3 * count
        + 2 * count * size
        + factor_size(count, size)
        + count * count
        + 5 * size * size
    )


def assemble_poses(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, p: Ints, c: Floats, w: Floats, frames: Floats,
    solutions: Floats, count: int,
) -> int:  # fmt: skip
    """Assemble poses, each independently of the others.

    Args:
        model: integers of a model, all of whose coordinates are degrees of freedom.
        reals: numbers of the model.
        data: workspace of an evaluation.
        y: workspace for a state.
        f: workspace for the rates of a state.
        p: integers of the assembly.
        c: parameters of the assembly.
        w: workspace, see `assembly_work_size`.
        frames: time (s), then values of all degrees of freedom, of each pose (count, 1 + n).
        solutions: filled with the values that fulfil the constraints, then a `POSE_STATUS`, of each
            pose (count, n + 1).
        count: number of poses.

    Returns:
        `OUTCOME.OK`, also if some poses cannot be assembled: `solutions` has the status of each.
    """
    a = Assembly(model, reals, data, y, f, p, c, w)
    size = model[MODEL.DOFS]
    # Speeds stay 0: only positions are evaluated, and laws must not see old speeds.
    for k in range(2 * size):
        y[k] = f[k] = 0.0
    for number in range(count):
        frame, solution = at(frames, (1 + size) * number), at(solutions, (1 + size) * number)
        data[WORK.TIME] = frame[0]
        solution[size] = (
            POSE_STATUS.ASSEMBLED
            if assemble_pose(a, at(frame, 1), solution)
            else POSE_STATUS.UNASSEMBLED
        )
    return OUTCOME.OK


def assemble_pose(a: Assembly, target: Floats, q: Floats) -> bool:
    """Fill q with the nearest pose in which clamped coordinates are in their ranges.

    Args:
        a: mechanism and assembly with their work vectors.
        target: desired values of the coordinates (n,).
        q: filled with the pose (n,).

    Returns:
        Whether there is such a pose.
    """
    size = a.model[MODEL.DOFS]
    status = at(a.p, ASSEMBLY.HEAD)
    ranges = at(a.c, ASSEMBLY_NUMBERS.RANGES)
    clamped = at(status, ASSEMBLY_ARRAY.CLAMPED * size)
    fixed = a.w
    for k in range(size):
        fixed[k] = target[k]
        # A coordinate that an earlier pose left at the end of its range is free again.
        if status[k] == HOLD.HELD_AT_END:
            status[k] = HOLD.FREED
    while True:
        if not find_nearest(a, target, q):
            return False
        worst, largest_violation = -1, RANGE_TOLERANCE
        for k in range(size):
            if clamped[k] > 0 and status[k] == HOLD.FREED:
                violation = max(ranges[2 * k] - q[k], q[k] - ranges[2 * k + 1])
                if violation > largest_violation:
                    worst, largest_violation = k, violation
        if worst < 0:
            return True
        # Fix the coordinate that leaves its range furthest at the end of it; then the others may
        # fit.
        status[worst] = HOLD.HELD_AT_END
        fixed[worst] = min(max(q[worst], ranges[2 * worst]), ranges[2 * worst + 1])


def find_nearest(a: Assembly, target: Floats, q: Floats) -> bool:
    """Fill q with the nearest pose, whatever the ranges.

    Args:
        a: mechanism and assembly; the work vector begins with the values of fixed coordinates.
        target: desired values of the coordinates (n,).
        q: filled with the pose (n,).

    Returns:
        Whether there is such a pose.
    """
    size, tolerance = a.model[MODEL.DOFS], a.c[ASSEMBLY_NUMBERS.TOLERANCE]
    copy_numbers(size, a.w, q)
    list_freed(a)
    trial = at(a.w, 4 * size)
    largest = evaluate_equations(a, q)
    # OpenSim leaves an assembled pose unchanged; its integrator projects it onto the constraints.
    is_assembled = largest <= tolerance
    # Couplers that are followed first leave fewer errors to the projection, and no wrong branch of
    # it.
    if not is_assembled:
        follow_couplers(a, q)
    if not restore_pose(a, q, is_assembled):
        return False
    if is_assembled:
        return True
    # Minimize the change of the coordinates along the constraints.
    previous_length = inf
    has_curvature = False
    step = at(a.w, size)
    for _ in range(MAX_STEPS):
        value = measure_change(a, target, q)
        # Squares of changes below the tolerance do not count as motion.
        if value < tolerance * tolerance:
            # No coordinate that counts has moved.
            return True
        length = find_step(a, target, q, has_curvature)
        # Curvature costs 2 evaluations per free direction, so it is used only where convergence is
        # slow, or where the cost alone determines no step.
        if not has_curvature and (not length < inf or length > FAST_CONVERGENCE * previous_length):
            has_curvature = True
            length = find_step(a, target, q, has_curvature)
        furthest = 1.0
        for k in range(size):
            furthest = max(furthest, 1.0 + abs(q[k]))
        if length < SHORTEST_STEP * furthest:
            return True
        # Within rounding the cost cannot be compared; a step that is at most half as long as the
        # last one is taken as progress.
        is_tiny = length < TINY_STEP and length <= 0.5 * previous_length
        fraction = 1.0
        while True:
            for k in range(size):
                trial[k] = q[k] + fraction * step[k]
            if not restore_pose(a, trial, False):
                return False
            if is_tiny or measure_change(a, target, trial) < value:
                break
            fraction *= 0.5
            # A thousandth of the step that still does not decrease the cost means that the
            # direction is poor.
            if fraction < 1e-3:
                break
        if fraction < 1e-3:
            # The step does not decrease the cost: rounding, or missing curvature of the constraints.
            if has_curvature:
                return True
            has_curvature, previous_length = True, inf
        else:
            copy_numbers(size, trial, q)
            previous_length = length if fraction == 1.0 else inf
    return True


def measure_change(a: Assembly, target: Floats, q: Floats) -> float:
    """Return half the sum of the squared changes that count.

    Args:
        a: mechanism and assembly with their work vectors.
        target: desired values of the coordinates (n,).
        q: present values (n,).
    """
    size = a.model[MODEL.DOFS]
    total = 0.0
    is_counted = at(a.p, ASSEMBLY.HEAD + ASSEMBLY_ARRAY.IS_COUNTED * size)
    for k in range(size):
        if is_counted[k] > 0:
            total += (q[k] - target[k]) * (q[k] - target[k])
    return 0.5 * total


def follow_couplers(a: Assembly, q: Floats) -> None:
    """Move dependent coordinates that do not count to the values that their couplers give.

    Args:
        a: mechanism and assembly with their work vectors.
        q: pose (n,); changed.
    """
    size = a.model[MODEL.DOFS]
    status = at(a.p, ASSEMBLY.HEAD)
    is_counted = at(status, ASSEMBLY_ARRAY.IS_COUNTED * size)
    couplers = at(status, ASSEMBLY_ARRAY.COUPLER_AT * size)
    start = a.model[MODEL.CONSTRAINED]
    for k in range(a.p[ASSEMBLY.COUPLERS]):
        dependent = couplers[2 * k]
        if status[dependent] == HOLD.FREED and is_counted[dependent] == 0:
            # Evaluate again for each coupler, because its argument may depend on one before.
            evaluate_equations(a, q)
            # The error of a coupler is its function less the coordinate.
            q[dependent] += a.data[a.model[start + CONSTRAINED.WORK_ERRORS] + couplers[2 * k + 1]]


def restore_pose(a: Assembly, q: Floats, is_assembled: bool) -> bool:
    """Move q to where the equations hold, by Newton's method with the shortest steps.

    Args:
        a: mechanism and assembly with their work vectors.
        q: pose to start from (n,); filled with the last pose of the iteration.
        is_assembled: whether the pose fulfils the equations within the tolerance already; then all
            coordinates move alike.

    Returns:
        Whether the equations hold.
    """
    size = a.model[MODEL.DOFS]
    count = count_equations(a)
    tolerance = a.c[ASSEMBLY_NUMBERS.TOLERANCE]
    status = at(a.p, ASSEMBLY.HEAD)
    errors = at(a.w, 7 * size)
    factor = equation_factor(a)
    is_counted = at(status, ASSEMBLY_ARRAY.IS_COUNTED * size)
    free_list = at(status, ASSEMBLY_ARRAY.FREE * size)
    step = at(a.w, 2 * size)
    trial = at(a.w, 3 * size)
    work = at(factor, factor_size(count, size))
    lengths = at(errors, count)
    values = at(errors, 2 * count)
    free = list_freed(a)
    largest = evaluate_equations(a, q)
    for _ in range(MAX_STEPS):
        # The first condition is false for infinite and undefined errors.
        if not largest < inf or largest <= ROUNDING_ERROR:
            break
        rank = factorise_rows(a, free, not is_assembled)
        for i in range(count):
            values[i] = -errors[i] / lengths[i]
        solve_minimum_norm(count, free, factor, rank, values, work, step)
        furthest = LONGEST_STEP
        for k in range(free):
            # The unknown of an eased coordinate is its change over UNCOUNTED_MOBILITY.
            if not is_assembled and is_counted[free_list[k]] == 0:
                step[k] *= UNCOUNTED_MOBILITY
            furthest = max(furthest, abs(step[k]))
        # Far from a solution the linearization is poor: take short steps, even where errors grow.
        copy_numbers(size, q, trial)
        for k in range(free):
            trial[free_list[k]] += LONGEST_STEP / furthest * step[k]
        new = evaluate_equations(a, trial)
        # Within the tolerance, continue only while errors at least halve; then rounding is reached.
        if largest <= tolerance and not new < 0.5 * largest:
            break
        largest = new
        copy_numbers(size, trial, q)
    return largest <= tolerance


def find_step(a: Assembly, target: Floats, q: Floats, has_curvature: bool) -> float:
    """Find Newton's step in the null space of the linearized equations.

    Args:
        a: mechanism and assembly; the work vector is filled with the step of every degree of
            freedom (rad or m).
        target: desired values of the coordinates (n,).
        q: present values (n,).
        has_curvature: whether the Hessian contains the equations times their multipliers, besides the cost.

    Returns:
        The largest change of a coordinate (rad or m). Infinity if the cost has a slope but no
        curvature in a direction, so that only the curvature of the equations can determine the step.
    """
    size = a.model[MODEL.DOFS]
    count = count_equations(a)
    status = at(a.p, ASSEMBLY.HEAD)
    factor = equation_factor(a)
    step = at(a.w, size)
    is_counted = at(status, ASSEMBLY_ARRAY.IS_COUNTED * size)
    free_list = at(status, ASSEMBLY_ARRAY.FREE * size)
    gradient = at(a.w, 5 * size)
    null_space = at(factor, factor_size(count, size) + count * size + count * count)
    evaluate_equations(a, q)
    free = list_freed(a)
    rank = factorise_rows(a, free, False)
    dimension = free - rank
    curvature = at(null_space, size * size)
    spare = at(null_space, 2 * size * size)
    # The cost is half the sum of squares, so that its Hessian is the identity for the coordinates
    # that count.
    for k in range(free):
        gradient[k] = (
            q[free_list[k]] - target[free_list[k]] if is_counted[free_list[k]] > 0 else 0.0
        )
    write_null_space(free, factor, rank, null_space)
    for k in range(dimension):
        for m in range(dimension):
            total = 0.0
            for j in range(free):
                if is_counted[free_list[j]] > 0:
                    total += null_space[free * k + j] * null_space[free * m + j]
            curvature[dimension * k + m] = total
    if has_curvature:
        add_curvature(a, q, free, dimension, null_space, curvature)
    # The negative gradient in the null space, replaced by the solution of the linear system.
    # `lengths` are the components p of the step along the basis.
    lengths = at(a.w, 6 * size)
    for k in range(dimension):
        lengths[k] = 0.0
        for j in range(free):
            lengths[k] -= null_space[free * k + j] * gradient[j]
    copy_numbers(dimension * dimension, curvature, spare)
    is_convex = factorise_cholesky(dimension, spare, 0.0)
    # A pivot that is too small hides a direction without curvature, which `step_downhill` handles.
    for k in range(dimension):
        is_convex = is_convex and spare[dimension * k + k] * spare[dimension * k + k] > SAFE_PIVOT
    if is_convex:
        solve_cholesky(dimension, spare, lengths)
    else:
        slope = step_downhill(dimension, curvature, spare, at(spare, size * size), lengths)
        if not has_curvature and slope > MIN_SLOPE:
            return inf
    for k in range(size):
        step[k] = 0.0
    largest = 0.0
    for j in range(free):
        total = 0.0
        for k in range(dimension):
            total += null_space[free * k + j] * lengths[k]
        step[free_list[j]] = total
        largest = max(largest, abs(total))
    return largest


def add_curvature(
    a: Assembly, q: Floats, free: int, dimension: int, null_space: Floats, curvature: Floats
) -> None:
    """Add the second derivatives of the equations times their multipliers to the Hessian.

    The multipliers are the least-squares solution of Gᵀ λ = -g with the unit rows G; the
    derivatives are central differences of the rows along the basis of the null space.

    Args:
        a: the assembly, whose rows and gradient are known.
        q: present values (n,).
        free: number of free degrees of freedom.
        dimension: dimension of the null space.
        null_space: basis of the null space, by rows (left, free).
        curvature: reduced Hessian (left, left); changed.
    """
    size = a.model[MODEL.DOFS]
    count = count_equations(a)
    factor = equation_factor(a)
    gradient = at(a.w, 5 * size)
    rows = equation_rows(a)
    lengths = at(a.w, 7 * size + count)
    multipliers = at(a.w, 7 * size + 2 * count)
    free_list = at(a.p, ASSEMBLY.HEAD + ASSEMBLY_ARRAY.FREE * size)
    trial = at(a.w, 3 * size)
    unit = at(factor, factor_size(count, size))
    normal = at(unit, count * size)
    row_change = at(null_space, 2 * size * size)
    for i in range(count):
        multipliers[i] = 0.0
        for k in range(free):
            unit[free * i + k] = rows[size * i + free_list[k]] / lengths[i]
            multipliers[i] -= unit[free * i + k] * gradient[k]
    for i in range(count):
        for j in range(count):
            # The small diagonal keeps the normal equations regular where constraints are redundant.
            total = 1e-12 if i == j else 0.0
            for k in range(free):
                total += unit[free * i + k] * unit[free * j + k]
            normal[count * i + j] = total
    if not factorise_cholesky(count, normal, 0.0):
        return
    solve_cholesky(count, normal, multipliers)
    # Multipliers of the equations themselves, which were scaled to unit length.
    for i in range(count):
        multipliers[i] /= lengths[i]
    for k in range(dimension):
        for j in range(free):
            row_change[j] = 0.0
        for side in range(2):
            change = DIFFERENCE_STEP if side == 0 else -DIFFERENCE_STEP
            copy_numbers(size, q, trial)
            for j in range(free):
                trial[free_list[j]] += change * null_space[free * k + j]
            evaluate_equations(a, trial)
            for j in range(free):
                for i in range(count):
                    row_change[j] += multipliers[i] * rows[size * i + free_list[j]] / (2.0 * change)
        for m in range(dimension):
            total = 0.0
            for j in range(free):
                total += null_space[free * m + j] * row_change[j]
            # Half on either side of the diagonal keeps the matrix symmetric despite rounding.
            curvature[dimension * k + m] += 0.5 * total
            curvature[dimension * m + k] += 0.5 * total


def step_downhill(count: int, curvature: Floats, vectors: Floats, work: Floats, x: Floats) -> float:
    """Solve for a step where the Hessian is indefinite: downhill for negative, zero for no curvature.

    Args:
        count: number of unknowns.
        curvature: symmetric matrix (count, count); destroyed.
        vectors: workspace (count, count).
        work: workspace (count,).
        x: negative gradient, then the step.

    Returns:
        The largest slope in a direction of no curvature.
    """
    steepest = 0.0
    diagonalize(count, curvature, vectors)
    for k in range(count):
        total = 0.0
        value = abs(curvature[count * k + k])
        for j in range(count):
            total += vectors[count * k + j] * x[j]
        # The absolute value turns a direction of negative curvature downhill.
        work[k] = 0.0 if value < MIN_CURVATURE else total / value
        if value < MIN_CURVATURE:
            steepest = max(steepest, abs(total))
    for j in range(count):
        x[j] = 0.0
        for k in range(count):
            x[j] += vectors[count * k + j] * work[k]
    return steepest
