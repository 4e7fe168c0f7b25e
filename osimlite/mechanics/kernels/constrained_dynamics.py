"""Accelerations under constraints: M udot + Gᵀ λ = f and G udot = b.

M is the mass matrix (n, n), G the matrix of the constraint equations (m, n), f the generalized
forces and λ the multipliers. Where M is well conditioned, udot is eliminated: the sparse factor of
M gives the response to the force of each equation. Otherwise the motion is computed in the null
space of G. Contradictory equations are fulfilled in the least-squares sense.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.dynamics import SMALLEST_PIVOT, solve_accelerations
from osimlite.mechanics.kernels.layout import CONSTRAINED, DOF, ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.linear_algebra import (
    REDUNDANCY_TOLERANCE,
    ROUNDING,
    apply_q,
    factorise_by_law,
    factorise_cholesky,
    solve_by_law,
    solve_cholesky,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.laws.dual_numbers import is_exact_zero

SAFE_MASS = 1e-10
"""Smallest pivot of M relative to its diagonal with which M is inverted."""
INDEPENDENCE = 2.0**-19.5
"""Threshold of independence per square root of the number of equations.

Equations with a smaller response than this part of the largest one are dropped, as in Simbody,
whose complete orthogonal factorization of G M⁻¹ Gᵀ has the square of this as tolerance.
"""


def constrained_dynamics(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int
) -> int:
    """Solve for the accelerations under constraints.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results with the mass matrix.
        y: state.
        f: rates of the coordinates, then the generalized forces, which the accelerations replace.
        unused: argument without meaning, which all laws have.

    Returns:
        `OUTCOME.OK`, or `OUTCOME.SINGULAR_MASS`.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    right = at(f, size)
    evaluate_constraints(model, reals, data, y, f)
    # Copy mass matrix and forces, as the solver overwrites them.
    system = at(data, h[CONSTRAINED.WORK_SYSTEM])
    matrix = at(data, model[model[MODEL.DOF_AT] + DOF.ROW])
    for k in range(h[CONSTRAINED.ENTRIES]):
        system[k] = matrix[k]
    forces = at(system, h[CONSTRAINED.ENTRIES])
    for k in range(size):
        forces[k] = right[k]
    # A singular M, of a coordinate that moves no mass, may still be regular along the constraints.
    if solve_accelerations(model, data, right) < 0 and solve_by_multipliers(
        model, data, right, at(forces, size)
    ):
        return OUTCOME.OK
    return solve_in_null_space(model, data, system, forces, right, at(forces, size))


def evaluate_constraints(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> None:
    """Evaluate all constraint equations: G, errors, and the required values of G u and G udot.

    Args:
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation up to velocities; the equations are filled.
        y: state.
        f: rates of the coordinates.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    rows, rates = at(data, h[CONSTRAINED.WORK_ROWS]), at(data, h[CONSTRAINED.WORK_RATES])
    for k in range(h[CONSTRAINED.EQUATIONS] * size):
        rows[k] = 0.0
    for k in range(h[CONSTRAINED.EQUATIONS]):
        rates[k] = 0.0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = model[h[CONSTRAINED.CONSTRAINT_AT] + number]
        call(model[MODEL.LAWS + model[constraint + ITEM.LAW]], model, reals, data, y, f, constraint)


def solve_by_multipliers(model: Ints, data: Floats, right: Floats, work: Floats) -> bool:
    """Correct unconstrained accelerations by constraint forces, if M is well conditioned.

    With M = Uᵀ D U, the equations G U⁻¹ D^(-1/2) x = b - G udot have the shortest solution x, and
    U⁻¹ D^(-1/2) x is the response to the multipliers.

    Args:
        model: integers of the model.
        data: results with the factor of M and the equations.
        right: unconstrained accelerations (n,); corrected.
        work: workspace of 2 (n + m) numbers.

    Returns:
        Whether M is well conditioned; if not, nothing is changed.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    count = h[CONSTRAINED.EQUATIONS]
    freedoms = at(model, model[MODEL.DOF_AT])
    pivots = at(data, model[MODEL.WORK_PIVOT])
    scales = work
    correction = at(work, size)
    values = at(work, 2 * size)
    spare = at(work, 2 * size + count)
    for k in range(size):
        pivot = data[freedoms[DOF.SIZE * k + DOF.ROW]]
        if not pivot > SAFE_MASS * pivots[k]:
            return False
        scales[k] = 1.0 / sqrt(pivot)
    rows = at(data, h[CONSTRAINED.WORK_ROWS])
    drifts = at(data, h[CONSTRAINED.WORK_DRIFTS])
    weighted_rows = at(data, h[CONSTRAINED.WORK_FACTOR])
    for i in range(count):
        # An equation of rounding errors must not be enlarged by a light degree of freedom.
        row = at(rows, size * i)
        weighted_row = at(weighted_rows, size * i)
        longest = 0.0
        for k in range(size):
            longest = max(longest, abs(row[k]))
        for k in range(size):
            weighted_row[k] = row[k] if longest > ROUNDING else 0.0
        solve_transposed_factor(model, data, weighted_row)
        for k in range(size):
            weighted_row[k] *= scales[k]
    factorise_by_law(model, data, count, weighted_rows, INDEPENDENCE * sqrt(count))
    # The second pass removes rounding errors of the first.
    for _ in range(2):
        for i in range(count):
            row = at(rows, size * i)
            missing = drifts[i]
            for k in range(size):
                missing -= row[k] * right[k]
            values[i] = missing
        # The shortest solution in the scaled unknowns is the one that constraint forces cause.
        solve_by_law(model, count, weighted_rows, values, spare, correction)
        for k in range(size):
            correction[k] *= scales[k]
        solve_factor(model, data, correction)
        for k in range(size):
            right[k] += correction[k]
    return True


def solve_transposed_factor(model: Ints, data: Floats, right: Floats) -> None:
    """Solve Uᵀ x = b in place with the factor that `solve_accelerations` left.

    Args:
        model: integers of the model.
        data: results with the factor of M.
        right: right side b (n,), replaced by the solution.
    """
    freedoms = at(model, model[MODEL.DOF_AT])
    for k in range(model[MODEL.DOFS] - 1, -1, -1):
        # Skip zeros: rows of G touch few degrees of freedom.
        j = at(freedoms, DOF.SIZE * k)
        load = right[k]
        if is_exact_zero(load):
            continue
        row = at(data, j[DOF.ROW])
        i = j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            right[i] -= row[m] * load
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]


def solve_factor(model: Ints, data: Floats, right: Floats) -> None:
    """Solve U x = b in place with the factor that `solve_accelerations` left.

    Args:
        model: integers of the model.
        data: results with the factor of M.
        right: right side b (n,), replaced by the solution.
    """
    freedoms = at(model, model[MODEL.DOF_AT])
    for k in range(model[MODEL.DOFS]):
        j = at(freedoms, DOF.SIZE * k)
        total = right[k]
        row = at(data, j[DOF.ROW])
        i = j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = total


def solve_in_null_space(
    model: Ints, data: Floats, matrix: Floats, forces: Floats, right: Floats, work: Floats
) -> int:
    """Compute the accelerations in the null space of the constraint equations.

    Args:
        model: integers of the model.
        data: results with the equations.
        matrix: entries of the mass matrix.
        forces: generalized forces (n,); changed.
        right: filled with the accelerations (n,).
        work: workspace of 2 n (n + 1) + 2 m numbers.

    Returns:
        `OUTCOME.OK`, or SINGULAR_MASS if the reduced mass matrix is not positive definite.
    """
    h = at(model, model[MODEL.CONSTRAINED])
    size = model[MODEL.DOFS]
    count = h[CONSTRAINED.EQUATIONS]
    rows = at(data, h[CONSTRAINED.WORK_ROWS])
    drifts = at(data, h[CONSTRAINED.WORK_DRIFTS])
    equations = at(data, h[CONSTRAINED.WORK_FACTOR])
    # Scale all equations to unit length, and drop those that are rounding errors.
    values = work
    spare = at(work, count)
    longest = 0.0
    for i in range(count):
        square = 0.0
        for k in range(size):
            square += rows[size * i + k] * rows[size * i + k]
        values[i] = sqrt(square)
        longest = max(longest, values[i])
    for i in range(count):
        scale = 1.0 / values[i] if values[i] > ROUNDING * max(longest, 1.0) else 0.0
        values[i] = scale * drifts[i]
        for k in range(size):
            equations[size * i + k] = scale * rows[size * i + k]
    rank = factorise_by_law(model, data, count, equations, REDUNDANCY_TOLERANCE)
    # The complement of the rank is the number of remaining degrees of freedom.
    free = size - rank
    # A particular solution of the equations; the free motion is added to it.
    solve_by_law(model, count, equations, values, spare, right)
    mass_product = at(spare, count)
    reduced = at(spare, count + 2 * size)
    basis = at(spare, count + 2 * size + size * size)
    reduced_rhs = at(mass_product, size)
    # Its inertial forces reduce the forces of the free motion.
    multiply_mass(model, matrix, right, mass_product)
    for k in range(size):
        forces[k] -= mass_product[k]
    for j in range(free):
        direction = at(basis, size * j)
        for k in range(size):
            # The unit vectors beyond the rank, transformed by Q, span the null space of G.
            direction[k] = 1.0 if k == rank + j else 0.0
        apply_q(size, equations, rank, direction)
        multiply_mass(model, matrix, direction, mass_product)
        for i in range(j + 1):
            total = 0.0
            for k in range(size):
                total += basis[size * i + k] * mass_product[k]
            reduced[free * j + i] = total
        total = 0.0
        for k in range(size):
            total += direction[k] * forces[k]
        reduced_rhs[j] = total
    if not factorise_cholesky(free, reduced, SMALLEST_PIVOT):
        return OUTCOME.SINGULAR_MASS
    solve_cholesky(free, reduced, reduced_rhs)
    for j in range(free):
        for k in range(size):
            right[k] += reduced_rhs[j] * basis[size * j + k]
    return OUTCOME.OK


def multiply_mass(model: Ints, matrix: Floats, u: Floats, product: Floats) -> None:
    """Multiply a vector by the mass matrix, whose sparse rows are stored one after the other.

    Args:
        model: integers of the model.
        matrix: entries of the mass matrix, row by row.
        u: vector (n,).
        product: filled with M u (n,).
    """
    size = model[MODEL.DOFS]
    freedoms = at(model, model[MODEL.DOF_AT])
    start = 0
    for k in range(size):
        product[k] = 0.0
    for k in range(size):
        j = at(freedoms, DOF.SIZE * k)
        product[k] += matrix[start] * u[k]
        i = j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            # M is symmetric, and each entry off the diagonal is stored once.
            product[k] += matrix[start + m] * u[i]
            product[i] += matrix[start + m] * u[k]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        start += j[DOF.DEPTH] + 1
