"""Accelerations under constraints: M udot + Gᵀ λ = f and G udot = b.

Where that is safe, udot is eliminated: the tree's own factor of M gives what each equation's force does. It is safe
where M alone is well conditioned and no equation all but follows from others. Otherwise the motion is solved for along
the directions that the equations leave free, and equations that contradict each other are fulfilled as well as can be.
"""

from __future__ import annotations

from osimlite.multibody.linear import NEGLIGIBLE, REDUNDANT, ROUNDING
from osimlite.simulation.constrained import SAFE_COUPLING, SAFE_MASS
from osimlite.simulation.kernels.dynamics import SMALLEST_PIVOT, solve
from osimlite.simulation.kernels.layout import (
    ABOVE,
    CONSTRAINED,
    CONSTRAINT_AT,
    CONSTRAINTS,
    DEPTH,
    ENTRIES,
    EQUATIONS,
    FREEDOM_AT,
    FREEDOM_INTS,
    FREEDOMS,
    LAW,
    LAWS,
    OK,
    ROW,
    SINGULAR_MASS,
    WORK_DRIFTS,
    WORK_FACTOR,
    WORK_KEPT,
    WORK_PIVOT,
    WORK_RATES,
    WORK_ROWS,
    WORK_SYSTEM,
)
from osimlite.simulation.kernels.least_squares import apply_q, cholesky, factored, solved, substitute
from osimlite.simulation.kernels.pointers import Floats, Ints, at, call


def constrained_dynamics(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats, unused: int) -> int:
    """Solve for the accelerations: the second half of f has the generalized forces before."""
    h, size = at(s, s[CONSTRAINED]), s[FREEDOMS]
    right = at(f, size)
    bind(s, x, w, y, f)
    # Of the mass matrix and the forces, nothing is left when they have been solved for.
    system, matrix = at(w, h[WORK_SYSTEM]), at(w, s[s[FREEDOM_AT] + ROW])
    for k in range(h[ENTRIES]):
        system[k] = matrix[k]
    forces = at(system, h[ENTRIES])
    for k in range(size):
        forces[k] = right[k]
    if solve(s, w, right) < 0 and by_multipliers(s, w, right, at(forces, size)):
        return OK
    return by_directions(s, w, system, forces, right, at(forces, size))


def bind(s: Ints, x: Floats, w: Floats, y: Floats, f: Floats) -> None:
    """Fill in all equations; f has the rates of the coordinates."""
    h, size = at(s, s[CONSTRAINED]), s[FREEDOMS]
    rows, rates = at(w, h[WORK_ROWS]), at(w, h[WORK_RATES])
    for k in range(h[EQUATIONS] * size):
        rows[k] = 0.0
    for k in range(h[EQUATIONS]):
        rates[k] = 0.0
    for number in range(h[CONSTRAINTS]):
        constraint = s[h[CONSTRAINT_AT] + number]
        call(s[LAWS + s[constraint + LAW]], s, x, w, y, f, constraint)


def by_multipliers(s: Ints, w: Floats, right: Floats, room: Floats) -> bool:
    """From the accelerations without constraints to those with them, if that is safe; room for (m + 1) m numbers."""
    h, size = at(s, s[CONSTRAINED]), s[FREEDOMS]
    count, freedoms, pivots = h[EQUATIONS], at(s, s[FREEDOM_AT]), at(w, s[WORK_PIVOT])
    for k in range(size):
        if not w[freedoms[FREEDOM_INTS * k + ROW]] > SAFE_MASS * pivots[k]:
            return False
    rows, drifts, columns = at(w, h[WORK_ROWS]), at(w, h[WORK_DRIFTS]), at(w, h[WORK_KEPT])
    coupling, multipliers = room, at(room, count * count)
    least = most = 0.0
    for i in range(count):
        row, column, longest = at(rows, size * i), at(columns, size * i), 0.0
        for k in range(size):
            column[k] = row[k]
            longest = max(longest, abs(row[k]))
        if not longest > ROUNDING:
            return False
        solve_again(s, w, column)
        for j in range(i + 1):
            other, total = at(rows, size * j), 0.0
            for k in range(size):
                total += other[k] * column[k]
            coupling[count * i + j] = total
        own = coupling[count * i + i]
        least, most = own if i == 0 else min(least, own), max(most, own)
    if not least > NEGLIGIBLE * NEGLIGIBLE * most or not cholesky(count, coupling, SAFE_COUPLING * SAFE_COUPLING):
        return False
    # The second time mends the rounding of the first.
    for _ in range(2):
        for i in range(count):
            row, missing = at(rows, size * i), -drifts[i]
            for k in range(size):
                missing += row[k] * right[k]
            multipliers[i] = missing
        substitute(count, coupling, multipliers)
        for i in range(count):
            column, factor = at(columns, size * i), multipliers[i]
            for k in range(size):
                right[k] -= factor * column[k]
    return True


def solve_again(s: Ints, w: Floats, right: Floats) -> None:
    """Solve with the factor that `solve` left, in place."""
    size, freedoms = s[FREEDOMS], at(s, s[FREEDOM_AT])
    for k in range(size - 1, -1, -1):
        j, load = at(freedoms, FREEDOM_INTS * k), right[k]
        if load == 0.0:
            continue
        row, i = at(w, j[ROW]), j[ABOVE]
        for m in range(1, j[DEPTH] + 1):
            right[i] -= row[m] * load
            i = freedoms[FREEDOM_INTS * i + ABOVE]
        right[k] = load / row[0]
    for k in range(size):
        j, total = at(freedoms, FREEDOM_INTS * k), right[k]
        row, i = at(w, j[ROW]), j[ABOVE]
        for m in range(1, j[DEPTH] + 1):
            total -= row[m] * right[i]
            i = freedoms[FREEDOM_INTS * i + ABOVE]
        right[k] = total


def by_directions(s: Ints, w: Floats, matrix: Floats, forces: Floats, right: Floats, room: Floats) -> int:
    """The accelerations by the null space of the equations; room for 2 n (n + 1) numbers, or 2 m more than that."""
    h, size = at(s, s[CONSTRAINED]), s[FREEDOMS]
    count, rows, drifts, equations = h[EQUATIONS], at(w, h[WORK_ROWS]), at(w, h[WORK_DRIFTS]), at(w, h[WORK_FACTOR])
    # All equations spatial_inertias_and_bias the same, but those that are rounding errors.
    values, spare = room, at(room, count)
    longest = 0.0
    for i in range(count):
        square = 0.0
        for k in range(size):
            square += rows[size * i + k] * rows[size * i + k]
        values[i] = square**0.5
        longest = max(longest, values[i])
    for i in range(count):
        scale = 1.0 / values[i] if values[i] > max(NEGLIGIBLE * longest, ROUNDING) else 0.0
        values[i] = scale * drifts[i]
        for k in range(size):
            equations[size * i + k] = scale * rows[size * i + k]
    rank = factored(s, w, count, equations, REDUNDANT)
    free = size - rank
    solved(s, count, equations, values, spare, right)
    pushed, reduced, basis = at(spare, count), at(spare, count + 2 * size), at(spare, count + 2 * size + size * size)
    rest = at(pushed, size)
    times_mass(s, matrix, right, pushed)
    for k in range(size):
        forces[k] -= pushed[k]
    for j in range(free):
        direction = at(basis, size * j)
        for k in range(size):
            direction[k] = 1.0 if k == rank + j else 0.0
        apply_q(size, equations, rank, direction)
        times_mass(s, matrix, direction, pushed)
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
        return SINGULAR_MASS
    substitute(free, reduced, rest)
    for j in range(free):
        for k in range(size):
            right[k] += rest[j] * basis[size * j + k]
    return OK


def times_mass(s: Ints, matrix: Floats, u: Floats, found: Floats) -> None:
    """The mass matrix, of which the rows stand one after the other, times a vector."""
    size, freedoms, place = s[FREEDOMS], at(s, s[FREEDOM_AT]), 0
    for k in range(size):
        found[k] = 0.0
    for k in range(size):
        j = at(freedoms, FREEDOM_INTS * k)
        found[k] += matrix[place] * u[k]
        i = j[ABOVE]
        for m in range(1, j[DEPTH] + 1):
            found[k] += matrix[place + m] * u[i]
            found[i] += matrix[place + m] * u[k]
            i = freedoms[FREEDOM_INTS * i + ABOVE]
        place += j[DEPTH] + 1
