"""Functions of coordinates from a table of numbers.

Each function has a kind and a piece of the table, which begins with a factor for the whole function.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.multibody import functions as f
from osimlite.multibody.smoothing_spline import PiecewisePolynomial
from osimlite.simulation.kernels.arrays import Floats, Numbers, Structure, Work

PIECES, SINE, STEP, MONOMIALS = 0, 1, 2, 3
"""Kinds: polynomials between knots, a sine, a smooth step, a sum of products of powers of several arguments."""


def function_table(function: f.Function, where: str) -> tuple[int, list[float]]:
    """Kind and numbers of a function.

    Raises:
        UnsupportedError: there is no kind for it.
    """
    factor = 1.0
    while isinstance(function, f.Scaled):
        factor *= function.scale
        function = function.function
    if isinstance(function, f.Sine):
        return SINE, [factor, function.amplitude, function.omega, function.phase, function.offset]
    if isinstance(function, f.Step):
        return STEP, [factor, function.start, function.end, function.start_value, function.end_value]
    if isinstance(function, f.WeightedSum):
        size = len(function.weights)
        powers = np.vstack([np.eye(size), np.zeros(size)])
        return MONOMIALS, [factor, size + 1.0, *function.weights, function.start, *powers.ravel().tolist()]
    if isinstance(function, f.MultivariatePolynomial) and not function.opensim_derivatives:
        powers = np.array(function.powers, dtype=float)
        return MONOMIALS, [factor, float(len(powers)), *function.coefficients, *powers.ravel().tolist()]
    knots, pieces = _pieces(function, where)
    width = max(map(len, pieces))
    rows = [[*piece, *[0.0] * (width - len(piece))] for piece in pieces]
    return PIECES, [factor, float(len(knots)), float(width), *knots, *(x for row in rows for x in row)]


def _pieces(function: f.Function, where: str) -> tuple[list[float], list[list[float]]]:
    """Knots, and the polynomial after each of them from the constant up; the first one goes on before its knot."""
    if isinstance(function, f.Constant):
        return [0.0], [[function.value]]
    if isinstance(function, f.Linear):
        return [0.0], [[function.start, function.rate]]
    if isinstance(function, f.Polynomial):
        return [0.0], [[*reversed(function.coefficients)]]
    if isinstance(function, f.PiecewiseConstant):
        return [*function.x], [[y] for y in function.y]
    if isinstance(function, f.PiecewiseLinear):
        slopes = np.diff(function.y) / np.diff(function.x)
        return [*function.x[:-1]], [[y, slope] for y, slope in zip(function.y[:-1], slopes.tolist(), strict=True)]
    if isinstance(function, f.SimmSpline):
        first, *_, last = pieces = [list(piece) for piece in function.pieces]
        return [function.x[0], *function.x], [first[:2], *pieces[:-1], last[:2]]
    if isinstance(function, PiecewisePolynomial):
        return function.knots.tolist(), function.pieces.tolist()
    raise UnsupportedError(
        f"an axis of the joint '{where}' moves by a {type(function).__name__}, which the compiled engine cannot do; "
        "take --engine bullet, or another function"
    )


def argument(s: Structure, x: Numbers, q: Floats, place: int) -> float:
    """Value of an argument."""
    freedom = s.arguments[place]
    value: float = q[freedom] if freedom >= 0 else x.constants[place]
    return value


def value_of(s: Structure, x: Numbers, q: Floats, operation: int) -> float:
    """The amount of an operation that has a function."""
    first, number = s.first_argument[operation], s.function[operation]
    at, kind, table = s.function_start[number], s.function_kind[number], x.table
    factor: float = table[at]
    total = 0.0
    if kind == MONOMIALS:
        count, size = int(table[at + 1]), s.first_argument[operation + 1] - first
        for term in range(count):
            product: float = table[at + 2 + term]
            for place in range(size):
                power = int(table[at + 2 + count + term * size + place])
                product *= argument(s, x, q, first + place) ** power
            total += product
        return factor * total
    z = argument(s, x, q, first)
    if kind == SINE:
        wave: float = table[at + 1] * sin(table[at + 2] * z + table[at + 3]) + table[at + 4]
        return factor * wave
    if kind == STEP:
        t = (z - table[at + 1]) / (table[at + 2] - table[at + 1])
        t = min(max(t, 0.0), 1.0)
        rise: float = (table[at + 4] - table[at + 3]) * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
        found: float = factor * (table[at + 3] + rise)
        return found
    start, width, t = piece_at(table, at, z)
    for k in range(width - 1, -1, -1):
        total = total * t + table[start + k]
    return factor * total


def piece_at(table: Floats, at: int, z: float) -> tuple[int, int, float]:
    """Where the polynomial for an argument begins, how many coefficients it has, and its own argument."""
    knots, width = int(table[at + 1]), int(table[at + 2])
    low, high = 0, knots
    while high - low > 1:
        middle = (low + high) // 2
        if z < table[at + 3 + middle]:
            high = middle
        else:
            low = middle
    return at + 3 + knots + low * width, width, z - table[at + 3 + low]


def slope_of(s: Structure, x: Numbers, w: Work, q: Floats, u: Floats, operation: int) -> tuple[float, float]:
    """Rate of the amount of an operation, and its second derivative while the speeds stay; fills `w.gradient`."""
    first, number = s.first_argument[operation], s.function[operation]
    at, kind, table = s.function_start[number], s.function_kind[number], x.table
    factor = table[at]
    if kind == MONOMIALS:
        return slope_of_monomials(s, x, w, q, u, operation)
    z = argument(s, x, q, first)
    slope = curvature = 0.0
    if kind == SINE:
        angle = table[at + 2] * z + table[at + 3]
        slope = table[at + 1] * table[at + 2] * cos(angle)
        curvature = -table[at + 1] * table[at + 2] * table[at + 2] * sin(angle)
    elif kind == STEP:
        rate = 1.0 / (table[at + 2] - table[at + 1])
        t, rise = (z - table[at + 1]) * rate, table[at + 4] - table[at + 3]
        if 0.0 < t < 1.0:
            slope = 30.0 * rise * rate * t * t * (1.0 - t) * (1.0 - t)
            curvature = 60.0 * rise * rate * rate * t * (1.0 - t) * (1.0 - 2.0 * t)
    else:
        start, width, t = piece_at(table, at, z)
        total = 0.0
        for k in range(width - 1, -1, -1):
            curvature = curvature * t + slope
            slope = slope * t + total
            total = total * t + table[start + k]
        curvature *= 2.0
    freedom = s.arguments[first]
    speed = u[freedom] if freedom >= 0 else 0.0
    w.gradient[0] = factor * slope
    return factor * slope * speed, factor * curvature * speed * speed


def slope_of_monomials(s: Structure, x: Numbers, w: Work, q: Floats, u: Floats, operation: int) -> tuple[float, float]:
    """As `slope_of`, for MONOMIALS."""
    first, number = s.first_argument[operation], s.function[operation]
    at, table = s.function_start[number], x.table
    count, size = int(table[at + 1]), s.first_argument[operation + 1] - first
    for place in range(size):
        w.gradient[place] = 0.0
    rate = curvature = 0.0
    for term in range(count):
        powers = at + 2 + count + term * size
        for i in range(size):
            one = table[at] * table[at + 2 + term] * table[powers + i]
            if one == 0.0:
                continue
            for place in range(size):
                one *= argument(s, x, q, first + place) ** (int(table[powers + place]) - (1 if place == i else 0))
            w.gradient[i] += one
            rate += one * speed_of(s, u, first + i)
            for j in range(size):
                two = table[at] * table[at + 2 + term] * table[powers + i]
                two *= table[powers + j] - (1.0 if i == j else 0.0)
                if two == 0.0:
                    continue
                for place in range(size):
                    less = (1 if place == i else 0) + (1 if place == j else 0)
                    two *= argument(s, x, q, first + place) ** (int(table[powers + place]) - less)
                curvature += two * speed_of(s, u, first + i) * speed_of(s, u, first + j)
    return rate, curvature


def speed_of(s: Structure, u: Floats, place: int) -> float:
    """Speed of an argument."""
    freedom = s.arguments[place]
    return u[freedom] if freedom >= 0 else 0.0
