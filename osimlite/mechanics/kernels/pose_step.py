"""One step towards the pose that fits best: where the quadratic model of the cost is least.

The model counts for what couplers, equations and the ends of the ranges leave free (J. Nocedal, S.
Wright, Numerical Optimization, 2006, chapters 16.2 and 16.7).
"""

from __future__ import annotations

from osimlite.mechanics.kernels.layout import MODEL
from osimlite.mechanics.kernels.linear_algebra import (
    cholesky,
    factorise,
    minimum_norm,
    substitute,
    write_null_space,
)
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.kernels.pose_cost import equations_of
from osimlite.mechanics.kernels.pose_record import (
    AT_END,
    BEND,
    CURVES,
    ERRORS,
    FREE_AT,
    RANGES_AT,
    RESOLVED_AT,
    ROOM,
    ROWS,
    SLOPE,
    STEP,
    STIFFNESS,
    VARIABLE,
    Fit,
)
from osimlite.mechanics.kernels.projection import REDUNDANT

SMALLEST = 1e-14
"""What part of its stiffness a coordinate must keep when all others follow, for the model to be a bowl."""
SOFTEST = 0.01
"""Damping of a step is relative to the stiffness of a coordinate and this (m²/rad²)."""


def list_free(m: Fit) -> int:
    """List the coordinates that are free, and at no end of their ranges; returns their count."""
    p, count = m.p, 0
    for k in range(m.model[MODEL.DOFS]):
        if p[p[RESOLVED_AT] + k] == VARIABLE:
            p[p[FREE_AT] + count] = k
            count += 1
    return count


def equations_for(m: Fit, free: int, has_step: int) -> tuple[Floats, Floats, Floats]:
    """The equations for the free coordinates, what they are to give after steps of others, and room behind."""
    p, v, size = m.p, m.v, m.model[MODEL.DOFS]
    count, rows, errors, step = equations_of(m), at(v, p[ROWS]), at(v, p[ERRORS]), at(v, p[STEP])
    factor = at(v, p[ROOM] + 2 * size)
    right = at(factor, count * size + count * count + 3 * count + 1)
    for k in range(count):
        right[k] = -errors[k]
        for j in range(free):
            factor[free * k + j] = rows[size * k + p[p[FREE_AT] + j]]
        if has_step > 0:
            for j in range(size):
                if p[p[RESOLVED_AT] + j] == AT_END:
                    right[k] -= rows[size * k + j] * step[j]
    return factor, right, at(right, count)


def find_ends(m: Fit, y: Floats) -> None:
    """Which coordinates stay at ends of their ranges: those that are there, and are pulled outwards."""
    p, v = m.p, m.v
    ranges, slope = at(m.c, p[RANGES_AT]), at(v, p[SLOPE])
    for k in range(m.model[MODEL.DOFS]):
        if p[p[RESOLVED_AT] + k] == VARIABLE or p[p[RESOLVED_AT] + k] == AT_END:
            low, high = ranges[2 * k], ranges[2 * k + 1]
            out = (
                (y[k] <= low and slope[k] > 0.0) or (y[k] >= high and slope[k] < 0.0) or low == high
            )
            p[p[RESOLVED_AT] + k] = AT_END if out else VARIABLE


def free_ends(m: Fit) -> None:
    """No coordinate stays at an end of its range any more."""
    p = m.p
    for k in range(m.model[MODEL.DOFS]):
        if p[p[RESOLVED_AT] + k] == AT_END:
            p[p[RESOLVED_AT] + k] = VARIABLE


def find_step(m: Fit, y: Floats, damping: float, bends: bool) -> bool:
    """The step of all coordinates to where the quadratic model is least, in their ranges; false if it is no bowl."""
    p, v, size = m.p, m.v, m.model[MODEL.DOFS]
    step, ranges = at(v, p[STEP]), at(m.c, p[RANGES_AT])
    for k in range(size):
        step[k] = 0.0
    while True:
        free = list_free(m)
        solution = solve_free(m, free, damping, 1.0 if bends else 0.0, SMALLEST)
        if solution < 0:
            return False
        result = at(v, solution)
        again = False
        for k in range(free):
            freedom = p[p[FREE_AT] + k]
            to = y[freedom] + result[k]
            end = ranges[2 * freedom] if to < ranges[2 * freedom] else ranges[2 * freedom + 1]
            if to < ranges[2 * freedom] or to > ranges[2 * freedom + 1]:
                step[freedom], p[p[RESOLVED_AT] + freedom], again = end - y[freedom], AT_END, True
        if not again:
            for k in range(free):
                step[p[p[FREE_AT] + k]] = result[k]
            return True


def solve_free(m: Fit, free: int, damping: float, bent: float, smallest: float) -> int:
    """The step of the free coordinates, after those of others; its place in the work, or -1 if the model is no bowl."""
    p, v, size = m.p, m.v, m.model[MODEL.DOFS]
    stiffness, bend, slope, step = (
        at(v, p[STIFFNESS]),
        at(v, p[BEND]),
        at(v, p[SLOPE]),
        at(v, p[STEP]),
    )
    count = equations_of(m)
    place = p[ROOM] + 2 * size + (count * size + count * count + 3 * count + 1) + 2 * count
    solution, matrix = at(v, place), at(v, place + size)
    for k in range(free):
        freedom = p[p[FREE_AT] + k]
        row, more, total = at(stiffness, size * freedom), at(bend, size * freedom), -slope[freedom]
        bonds = at(v, p[CURVES] + (size * freedom if count > 0 else 0))
        for j in range(size):
            if p[p[RESOLVED_AT] + j] == AT_END:
                total -= (row[j] + bent * more[j]) * step[j]
        solution[k] = total
        for j in range(free):
            other = p[p[FREE_AT] + j]
            matrix[free * k + j] = row[other] + bent * more[other]
            if count > 0:
                matrix[free * k + j] += bent * bonds[other]
        matrix[free * k + k] += damping * (row[freedom] + SOFTEST)
    if count == 0:
        if not cholesky(free, matrix, smallest):
            return -1
        substitute(free, matrix, solution)
        return place
    return solve_along(m, free, place, smallest)


def solve_along(m: Fit, free: int, place: int, smallest: float) -> int:
    """The same where equations bind the coordinates: along the directions that they leave free."""
    v, size, count = m.v, m.model[MODEL.DOFS], equations_of(m)
    solution, matrix = at(v, place), at(v, place + size)
    across = at(matrix, size * size)
    directions = at(across, size)
    reduced = at(directions, size * size)
    factor, right, room = equations_for(m, free, 1)
    rank = factorise(count, free, factor, REDUNDANT * count)
    minimum_norm(count, free, factor, rank, right, room, across)
    left = free - rank
    write_null_space(free, factor, rank, directions)
    for k in range(free):
        for j in range(free):
            solution[k] -= matrix[free * k + j] * across[j]
    wanted = at(reduced, left * left)
    for k in range(left):
        row = at(directions, free * k)
        wanted[k] = 0.0
        for j in range(free):
            wanted[k] += row[j] * solution[j]
    for k in range(left):
        row = at(directions, free * k)
        made = at(wanted, left)
        for i in range(free):
            made[i] = 0.0
            for j in range(free):
                made[i] += matrix[free * i + j] * row[j]
        for other in range(k + 1):
            total, second = 0.0, at(directions, free * other)
            for i in range(free):
                total += second[i] * made[i]
            reduced[left * k + other] = reduced[left * other + k] = total
    if not cholesky(left, reduced, smallest):
        return -1
    substitute(left, reduced, wanted)
    for j in range(free):
        total = across[j]
        for k in range(left):
            total += directions[free * k + j] * wanted[k]
        solution[j] = total
    return place
