"""Accelerations under constraints: M udot + Gᵀ λ = f and G udot = b.

Where M alone is well conditioned, udot is eliminated: the tree's own factor of M gives what each
equation's force does. Otherwise the motion is solved for along the directions that the equations
leave free. Equations that contradict each other are fulfilled as well as can be.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.dynamics import SMALLEST_PIVOT, solve
from osimlite.mechanics.kernels.layout import CONSTRAINED, DOF, ITEM, MODEL, OUTCOME
from osimlite.mechanics.kernels.linear_algebra import (
    REDUNDANT,
    ROUNDING,
    apply_q,
    cholesky,
    factored,
    solved,
    substitute,
)
from osimlite.mechanics.kernels.pointers import Floats, Ints, at, call
from osimlite.mechanics.laws.dual_numbers import is_nothing

SAFE_MASS = 1e-10
"""What each speed must move, as part of its inertia, for the mass matrix to be divided by."""
SLIGHT = 2.0**-19.5
"""Times the root of their number: equations whose forces move this part of what the strongest one's
do are left out, as in Simbody: its complete orthogonal factorization of G M⁻¹ Gᵀ has the square of
it as tolerance.
"""


def constrained_dynamics(
    model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int
) -> int:
    """Solve for the accelerations: the second half of f has the generalized forces before."""
    h, size = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS]
    right = at(f, size)
    bind(model, reals, data, y, f)
    # Of the mass matrix and the forces, nothing is left when they have been solved for.
    system, matrix = (
        at(data, h[CONSTRAINED.WORK_SYSTEM]),
        at(data, model[model[MODEL.DOF_AT] + DOF.ROW]),
    )
    for k in range(h[CONSTRAINED.ENTRIES]):
        system[k] = matrix[k]
    forces = at(system, h[CONSTRAINED.ENTRIES])
    for k in range(size):
        forces[k] = right[k]
    if solve(model, data, right) < 0 and by_multipliers(model, data, right, at(forces, size)):
        return OUTCOME.OK
    return by_directions(model, data, system, forces, right, at(forces, size))


def bind(model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats) -> None:
    """Fill in all equations; f has the rates of the coordinates."""
    h, size = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS]
    rows, rates = at(data, h[CONSTRAINED.WORK_ROWS]), at(data, h[CONSTRAINED.WORK_RATES])
    for k in range(h[CONSTRAINED.EQUATIONS] * size):
        rows[k] = 0.0
    for k in range(h[CONSTRAINED.EQUATIONS]):
        rates[k] = 0.0
    for number in range(h[CONSTRAINED.CONSTRAINTS]):
        constraint = model[h[CONSTRAINED.CONSTRAINT_AT] + number]
        call(model[MODEL.LAWS + model[constraint + ITEM.LAW]], model, reals, data, y, f, constraint)


def by_multipliers(model: Ints, data: Floats, right: Floats, room: Floats) -> bool:
    """From the accelerations without constraints to those with them, if M is well conditioned; room for 2 (n + m).

    With M = Uᵀ D U the equations of what U and D make of udot have as their shortest solution the
    multipliers' push.
    """
    h, size = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS]
    count, freedoms, pivots = (
        h[CONSTRAINED.EQUATIONS],
        at(model, model[MODEL.DOF_AT]),
        at(data, model[MODEL.WORK_PIVOT]),
    )
    scales, push, values, spare = (
        room,
        at(room, size),
        at(room, 2 * size),
        at(room, 2 * size + count),
    )
    for k in range(size):
        pivot = data[freedoms[DOF.SIZE * k + DOF.ROW]]
        if not pivot > SAFE_MASS * pivots[k]:
            return False
        scales[k] = 1.0 / sqrt(pivot)
    rows, drifts, weighted = (
        at(data, h[CONSTRAINED.WORK_ROWS]),
        at(data, h[CONSTRAINED.WORK_DRIFTS]),
        at(data, h[CONSTRAINED.WORK_FACTOR]),
    )
    for i in range(count):
        row, turned, longest = at(rows, size * i), at(weighted, size * i), 0.0
        for k in range(size):
            longest = max(longest, abs(row[k]))
        for k in range(size):
            turned[k] = row[k] if longest > ROUNDING else 0.0
        toward_ground(model, data, turned)
        for k in range(size):
            turned[k] *= scales[k]
    factored(model, data, count, weighted, SLIGHT * sqrt(count))
    # The second time mends the rounding of the first.
    for _ in range(2):
        for i in range(count):
            row, missing = at(rows, size * i), drifts[i]
            for k in range(size):
                missing -= row[k] * right[k]
            values[i] = missing
        solved(model, count, weighted, values, spare, push)
        for k in range(size):
            push[k] *= scales[k]
        away_from_ground(model, data, push)
        for k in range(size):
            right[k] += push[k]
    return True


def toward_ground(model: Ints, data: Floats, right: Floats) -> None:
    """Solve with Uᵀ of the factor that `solve` left, in place."""
    freedoms = at(model, model[MODEL.DOF_AT])
    for k in range(model[MODEL.DOFS] - 1, -1, -1):
        j, load = at(freedoms, DOF.SIZE * k), right[k]
        if is_nothing(load):
            continue
        row, i = at(data, j[DOF.ROW]), j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            right[i] -= row[m] * load
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]


def away_from_ground(model: Ints, data: Floats, right: Floats) -> None:
    """Solve with U of the factor that `solve` left, in place."""
    freedoms = at(model, model[MODEL.DOF_AT])
    for k in range(model[MODEL.DOFS]):
        j, total = at(freedoms, DOF.SIZE * k), right[k]
        row, i = at(data, j[DOF.ROW]), j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        right[k] = total


def by_directions(
    model: Ints, data: Floats, matrix: Floats, forces: Floats, right: Floats, room: Floats
) -> int:
    """The accelerations by the null space of the equations; room for 2 n (n + 1) numbers, or 2 m more than that."""
    h, size = at(model, model[MODEL.CONSTRAINED]), model[MODEL.DOFS]
    count, rows, drifts, equations = (
        h[CONSTRAINED.EQUATIONS],
        at(data, h[CONSTRAINED.WORK_ROWS]),
        at(data, h[CONSTRAINED.WORK_DRIFTS]),
        at(data, h[CONSTRAINED.WORK_FACTOR]),
    )
    # All equations weigh the same, but those that are rounding errors.
    values, spare = room, at(room, count)
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
    rank = factored(model, data, count, equations, REDUNDANT)
    free = size - rank
    solved(model, count, equations, values, spare, right)
    pushed, reduced, basis = (
        at(spare, count),
        at(spare, count + 2 * size),
        at(spare, count + 2 * size + size * size),
    )
    rest = at(pushed, size)
    times_mass(model, matrix, right, pushed)
    for k in range(size):
        forces[k] -= pushed[k]
    for j in range(free):
        direction = at(basis, size * j)
        for k in range(size):
            direction[k] = 1.0 if k == rank + j else 0.0
        apply_q(size, equations, rank, direction)
        times_mass(model, matrix, direction, pushed)
        for i in range(j + 1):
            total = 0.0
            for k in range(size):
                total += basis[size * i + k] * pushed[k]
            reduced[free * j + i] = total
        total = 0.0
        for k in range(size):
            total += direction[k] * forces[k]
        rest[j] = total
    if not cholesky(free, reduced, SMALLEST_PIVOT):
        return OUTCOME.SINGULAR_MASS
    substitute(free, reduced, rest)
    for j in range(free):
        for k in range(size):
            right[k] += rest[j] * basis[size * j + k]
    return OUTCOME.OK


def times_mass(model: Ints, matrix: Floats, u: Floats, found: Floats) -> None:
    """The mass matrix, of which the rows stand one after the other, times a vector."""
    size, freedoms, place = model[MODEL.DOFS], at(model, model[MODEL.DOF_AT]), 0
    for k in range(size):
        found[k] = 0.0
    for k in range(size):
        j = at(freedoms, DOF.SIZE * k)
        found[k] += matrix[place] * u[k]
        i = j[DOF.ABOVE]
        for m in range(1, j[DOF.DEPTH] + 1):
            found[k] += matrix[place + m] * u[i]
            found[i] += matrix[place + m] * u[k]
            i = freedoms[DOF.SIZE * i + DOF.ABOVE]
        place += j[DOF.DEPTH] + 1
