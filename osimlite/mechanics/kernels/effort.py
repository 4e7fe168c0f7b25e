"""How actuators share what is needed with the least effort, frame by frame.

Of all x with A x = b and bounds on each, the one with the least sum of |x|ᵖ, p > 1. For p = 2 it is
a function of one multiplier λ for each equation: x is Aᵀλ within its bounds. The λ at which the
equations hold are found by Newton's method on the concave dual function, whose second derivative is
that of the entries that are at no bound: an active set that changes as a whole (L. Qi, J. Sun,
Math. Programming 58, 1993). Each frame begins with the multipliers of the one before. Other p are
reached by Newton's method, each step of which is such a problem with weights.

The dual function is made strictly concave by a little of |λ - λ'|², where λ' is what was found
before (R. T. Rockafellar, Math. Oper. Research 1, 1976). So equations that repeat each other do no
harm, and where there is no solution, what is missing of b tends to the shortest that is possible.
"""

from __future__ import annotations

from math import sqrt

from osimlite.mechanics.kernels.layout import OUTCOME
from osimlite.mechanics.kernels.linear_algebra import cholesky, substitute
from osimlite.mechanics.kernels.pointers import Floats, Ints, at

FRAMES, EQUATIONS, UNKNOWNS, ENTRIES = 0, 1, 2, 3
"""Places of the counts; from ENTRIES on room for the places of the entries of a column that are not
0, after their count (n, 1 + m).
"""
POWER, BOUNDS = 0, 1
"""Places of the exponent, and of the bounds: all lower ones, then all upper ones (2, n)."""
TIGHTEST, CLOSEST, CLOSE = 1e-15, 1e-13, 1e-10
"""What may be missing of an equation, as part of its terms: nothing is looked for below the first,
a search ends at the second, and with the third there is a solution.
"""
ROUNDING, LEAST = 1e-12, 1e-14
"""What part of the largest entry of a column is none, and of that of all: a force within the body moves no pelvis."""
SLIGHT, SLOWEST = 1e-9, 0.9
"""How much of |λ - λ'|² is added, as part of the second derivative; what must be left at most of
what was missing at the λ' before, to go on.
"""
CENTRES, ROUNDS, HALVINGS, NEWTON_STEPS, PATIENCE = 30, 100, 60, 200, 20
"""Most λ' of a problem, steps from each, tries along a step, steps to another exponent than 2, steps in vain."""
SMALLEST, SOFTEST, LEAST_GAIN = 1e-6, 1e-8, 1e-15
"""Of such a step: the |x| below which |x|ᵖ is bent as there if p < 2, the least bend as part of the
largest if p > 2, and the part of the effort that a step must save to be worth it.
"""


def effort_room(equations: int, unknowns: int) -> int:
    """How many numbers the kernel works with."""
    return equations * (equations + 8) + 5 * unknowns


def least_effort(sizes: Ints, numbers: Floats, given: Floats, found: Floats, room: Floats) -> int:
    """Share out, frame by frame.

    Args: sizes: counts of frames, equations m and unknowns n, and room. numbers: exponent and
        bounds. given: of each frame the columns of A (n, m) and b (m,); changed. found: of each
        frame x (n,), what is missing of b (m,), and 1 if there is a solution, else 0. room: for
        what `effort_room` says.
    """
    m, n = sizes[EQUATIONS], sizes[UNKNOWNS]
    scales, carried, push, own = room, at(room, m), at(room, 2 * m), at(room, 3 * m)
    middles, softness = own, at(own, n)
    for k in range(m):
        carried[k] = 0.0
    for frame in range(sizes[FRAMES]):
        columns, x = at(given, (n + 1) * m * frame), at(found, (n + m + 1) * frame)
        scale(sizes, columns, scales)
        for j in range(n):
            middles[j], softness[j] = 0.0, 1.0
        for k in range(m):
            push[k] = carried[k] / scales[k]
        is_solved = share(sizes, numbers, columns, x, at(x, n), push, own) <= CLOSE
        if not is_solved and frame > 0:
            for k in range(m):
                push[k] = 0.0
            is_solved = share(sizes, numbers, columns, x, at(x, n), push, own) <= CLOSE
        for k in range(m):
            carried[k] = push[k] * scales[k] if is_solved else 0.0
        if is_solved and numbers[POWER] != 2.0:
            newton(sizes, numbers, columns, x, push, own)
        for k in range(m):
            x[n + k] /= scales[k]
        x[n + m] = 1.0 if is_solved else 0.0
    return OUTCOME.OK


def scale(sizes: Ints, columns: Floats, scales: Floats) -> None:
    """Make every equation as strong as the others, and note which entries there are."""
    m, n = sizes[EQUATIONS], sizes[UNKNOWNS]
    wanted = at(columns, m * n)
    most = 0.0
    for j in range(m * n):
        most = max(most, abs(columns[j]))
    for j in range(n):
        column, largest = at(columns, m * j), 0.0
        for k in range(m):
            largest = max(largest, abs(column[k]))
        for k in range(m):
            if abs(column[k]) <= max(ROUNDING * largest, LEAST * most):
                column[k] = 0.0
    for k in range(m):
        square = 0.0
        for j in range(n):
            square += columns[m * j + k] * columns[m * j + k]
        scales[k] = 1.0 / sqrt(square) if square > 0.0 else 1.0
        wanted[k] *= scales[k]
    for j in range(n):
        column, entries, count = at(columns, m * j), at(sizes, ENTRIES + (1 + m) * j), 0
        for k in range(m):
            if column[k] != 0.0:
                count += 1
                entries[count] = k
                column[k] *= scales[k]
        entries[0] = count


def newton(
    sizes: Ints, numbers: Floats, columns: Floats, x: Floats, push: Floats, room: Floats
) -> None:
    """From a solution to the one with the least sum of |x|ᵖ; x is followed by room for what is missing."""
    m, n, power = sizes[EQUATIONS], sizes[UNKNOWNS], numbers[POWER]
    middles, softness, tried = room, at(room, n), at(room, 4 * n + m * (m + 5))
    terms = at(room, 4 * n + 3 * m)
    for _ in range(NEWTON_STEPS):
        # The largest x is the unit: its powers are neither too large nor too small for floats.
        unit, stiffest = 0.0, 0.0
        for j in range(n):
            unit = max(unit, abs(x[j]))
        if unit == 0.0:
            return
        for j in range(n):
            size = abs(x[j]) / unit
            size = max(size, SMALLEST) if power < 2.0 else size
            # Below 2 Newton's steps go too far; what bounds |x|ᵖ from above by a square is steeper.
            softness[j] = max(power - 1.0, 1.0) * size ** (power - 2.0)
            stiffest = max(stiffest, softness[j])
        for j in range(n):
            stiffness = max(softness[j], SOFTEST * stiffest)
            slope = unit * (abs(x[j]) / unit) ** (power - 1.0)
            middles[j] = x[j] - (slope if x[j] > 0.0 else -slope) / stiffness
            softness[j] = stiffest / stiffness
        for k in range(m):
            push[k] = 0.0
        error = share(sizes, numbers, columns, tried, at(x, n), push, room)
        if error > CLOSEST and not mended(sizes, numbers, columns, tried, at(x, n), push, room):
            break
        before, part = effort(n, power, unit, x, tried, 0.0), 1.0
        after = effort(n, power, unit, x, tried, part)
        for _ in range(HALVINGS):
            if after < before:
                break
            part *= 0.5
            after = effort(n, power, unit, x, tried, part)
        if not after < before:
            break
        for j in range(n):
            x[j] += part * (tried[j] - x[j])
        if before - after <= LEAST_GAIN * before:
            break
    missing_of(sizes, columns, x, at(x, n), terms)


def effort(n: int, power: float, unit: float, x: Floats, to: Floats, part: float) -> float:
    """The sum of |x|ᵖ on the way to another x, for a unit of x."""
    total = 0.0
    for j in range(n):
        total += (abs(x[j] + part * (to[j] - x[j])) / unit) ** power
    return total


def share(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    x: Floats,
    missing: Floats,
    push: Floats,
    room: Floats,
) -> float:
    """Find the x with the least sum of (x - middle)² / softness, from multipliers on.

    The room begins with the middles and the softness.

    Returns:
        The largest part of the terms of an equation that is missing.
    """
    m, n = sizes[EQUATIONS], sizes[UNKNOWNS]
    wanted = at(columns, m * n)
    y, change, centre = at(room, 2 * n), at(room, 3 * n), at(room, 4 * n)
    slope, step = at(centre, m), at(centre, 2 * m)
    terms, slight, matrix = at(centre, 3 * m), at(centre, 4 * m), at(centre, 5 * m)
    error_before = error = 0.0
    for number in range(CENTRES):
        for k in range(m):
            centre[k] = push[k]
        pulled(sizes, columns, push, y)
        error = answers(sizes, numbers, columns, room, x, missing, terms)
        second(sizes, numbers, columns, room, matrix)
        trace = 0.0
        for k in range(m):
            trace += matrix[m * k + k]
        for k in range(m):
            slight[k] = SLIGHT * (trace / m if trace > 0.0 else 1.0)
        best, since = error, 0
        for _ in range(ROUNDS):
            since += 1
            if error < best:
                best, since = error, 0
            if error <= CLOSEST or since > PATIENCE:
                break
            largest = 0.0
            for k in range(m):
                slope[k] = missing[k] - slight[k] * (push[k] - centre[k])
                step[k] = slope[k]
                largest = max(largest, abs(slope[k]) / terms[k])
            if largest <= TIGHTEST:
                break
            second(sizes, numbers, columns, room, matrix)
            for k in range(m):
                matrix[m * k + k] += slight[k]
            if not cholesky(m, matrix, 0.0):
                break
            substitute(m, matrix, step)
            pulled(sizes, columns, step, change)
            part = way(sizes, numbers, wanted, step, push, room)
            for k in range(m):
                push[k] += part * step[k]
            pulled(sizes, columns, push, y)
            error = answers(sizes, numbers, columns, room, x, missing, terms)
        if error <= CLOSEST or (number > 1 and not error < SLOWEST * error_before):
            break
        error_before = error
    return error


def mended(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    x: Floats,
    missing: Floats,
    push: Floats,
    room: Floats,
) -> bool:
    """Change x as little as the equations take, which great softness has left to rounding; whether they hold then."""
    for j in range(sizes[UNKNOWNS]):
        room[j], room[sizes[UNKNOWNS] + j] = x[j], 1.0
    for k in range(sizes[EQUATIONS]):
        push[k] = 0.0
    return share(sizes, numbers, columns, x, missing, push, room) <= CLOSE


def pulled(sizes: Ints, columns: Floats, multipliers: Floats, y: Floats) -> None:
    """y = Aᵀλ."""
    m = sizes[EQUATIONS]
    for j in range(sizes[UNKNOWNS]):
        column, entries, total = at(columns, m * j), at(sizes, ENTRIES + (1 + m) * j), 0.0
        for e in range(1, entries[0] + 1):
            total += column[entries[e]] * multipliers[entries[e]]
        y[j] = total


def answer(numbers: Floats, n: int, j: int, room: Floats, y: float) -> float:
    """The x of an unknown for what the multipliers pull it with."""
    x = room[j] + room[n + j] * y
    return min(max(x, numbers[BOUNDS + j]), numbers[BOUNDS + n + j])


def answers(
    sizes: Ints,
    numbers: Floats,
    columns: Floats,
    room: Floats,
    x: Floats,
    missing: Floats,
    terms: Floats,
) -> float:
    """Fill in x for what the multipliers pull; returns as `missing_of`."""
    n = sizes[UNKNOWNS]
    for j in range(n):
        x[j] = answer(numbers, n, j, room, room[2 * n + j])
    return missing_of(sizes, columns, x, missing, terms)


def missing_of(sizes: Ints, columns: Floats, x: Floats, missing: Floats, terms: Floats) -> float:
    """What is missing of b, and how large the terms of the equations are; returns the largest part that is missing."""
    m, n = sizes[EQUATIONS], sizes[UNKNOWNS]
    wanted, worst = at(columns, m * n), 0.0
    for k in range(m):
        missing[k], terms[k] = wanted[k], abs(wanted[k])
    for j in range(n):
        column, entries = at(columns, m * j), at(sizes, ENTRIES + (1 + m) * j)
        for e in range(1, entries[0] + 1):
            k = entries[e]
            term = column[k] * x[j]
            missing[k] -= term
            terms[k] += abs(term)
    for k in range(m):
        # An equation without a term holds.
        terms[k] = terms[k] if terms[k] > 0.0 else 1.0
        worst = max(worst, abs(missing[k]) / terms[k])
    return worst


def second(sizes: Ints, numbers: Floats, columns: Floats, room: Floats, matrix: Floats) -> None:
    """The second derivative of the dual function without what is added, but for its sign; the lower triangle (m, m)."""
    m, n = sizes[EQUATIONS], sizes[UNKNOWNS]
    for k in range(m * m):
        matrix[k] = 0.0
    for j in range(n):
        x = room[j] + room[n + j] * room[2 * n + j]
        if not numbers[BOUNDS + j] < x < numbers[BOUNDS + n + j]:
            continue
        column, entries = at(columns, m * j), at(sizes, ENTRIES + (1 + m) * j)
        for e in range(1, entries[0] + 1):
            k = entries[e]
            row, factor = at(matrix, m * k), room[n + j] * column[k]
            for g in range(1, e + 1):
                row[entries[g]] += factor * column[entries[g]]


def way(
    sizes: Ints, numbers: Floats, wanted: Floats, step: Floats, push: Floats, room: Floats
) -> float:
    """The part of a step to take: all of it, or where the dual function rises half as much as at its start at most."""
    m, n, low, high, part, start = sizes[EQUATIONS], sizes[UNKNOWNS], 0.0, 1.0, 0.0, 0.0
    y, change, centre, slight = (
        at(room, 2 * n),
        at(room, 3 * n),
        at(room, 4 * n),
        at(room, 4 * n + 4 * m),
    )
    for _ in range(HALVINGS):
        rise = 0.0
        for k in range(m):
            rise += step[k] * (wanted[k] - slight[k] * (push[k] + part * step[k] - centre[k]))
        for j in range(n):
            if change[j] != 0.0:
                rise -= change[j] * answer(numbers, n, j, room, y[j] + part * change[j])
        if part == 0.0:
            start, part = rise, 1.0
        elif abs(rise) <= 0.1 * abs(start) or (part == 1.0 and rise > 0.0):
            break
        else:
            if rise > 0.0:
                low = part
            else:
                high = part
            part = 0.5 * (low + high)
    return part
