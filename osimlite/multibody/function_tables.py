"""Functions as tables of numbers, which the kernels evaluate; see :mod:`osimlite.kernels.functions`."""

from __future__ import annotations

from math import isfinite

import numpy as np

from osimlite.errors import ModelError, UnsupportedError
from osimlite.kernels.functions import ARC, MONOMIALS, MONOMIALS_OF_OPENSIM, PIECES, PIECES_OF_OPENSIM, SINE, STEP
from osimlite.multibody import functions as f
from osimlite.multibody.arc import COSINE_TERMS, SINE_TERMS, ArcPoint
from osimlite.multibody.smoothing_spline import PiecewisePolynomial


def function_table(function: f.Function, where: str) -> list[float]:
    """The table of a function.

    Raises:
        UnsupportedError: there is no kind for it.
    """
    factor = 1.0
    while isinstance(function, f.Scaled):
        factor *= function.scale
        function = function.function
    if isinstance(function, f.Sine):
        return [SINE, factor, function.amplitude, function.omega, function.phase, function.offset]
    if isinstance(function, f.Step):
        return [STEP, factor, function.start, function.end, function.start_value, function.end_value]
    if isinstance(function, f.WeightedSum):
        size = len(function.weights)
        powers = np.vstack([np.eye(size), np.zeros(size)])
        return [MONOMIALS, factor, size + 1.0, *function.weights, function.start, *powers.ravel().tolist()]
    if isinstance(function, f.MultivariatePolynomial):
        powers = np.array(function.powers, dtype=float)
        kind = MONOMIALS_OF_OPENSIM if function.opensim_derivatives else MONOMIALS
        return [kind, factor, float(len(powers)), *function.coefficients, *powers.ravel().tolist()]
    if isinstance(function, ArcPoint):
        start = [ARC, factor, float(function.component), function.length, *function.neutral, float(len(SINE_TERMS))]
        return [*start, *SINE_TERMS.tolist(), *COSINE_TERMS.tolist()]
    if isinstance(function, PiecewisePolynomial):
        head = PIECES, factor, len(function.knots), function.pieces.shape[1]
        table: list[float] = np.concatenate([head, function.knots, function.pieces.ravel()]).tolist()
        return table
    knots, pieces = _pieces(function, where)
    width = max(map(len, pieces))
    rows = [[*piece, *[0.0] * (width - len(piece))] for piece in pieces]
    return [PIECES, factor, float(len(knots)), float(width), *knots, *(x for row in rows for x in row)]


def table_of_one(function: f.Function, where: str) -> list[float]:
    """The table of a function of one number, for `value_at`.

    Raises:
        ModelError: one of its numbers is not finite.
        UnsupportedError: there is no kind for it.
    """
    table = _table_of_one(function, where)
    # A sum that is finite has finite parts only.
    if not isfinite(sum(table)) and not all(map(isfinite, table)):
        raise ModelError(f"{where} has a number that is not finite; give one that is")
    return table


def _table_of_one(function: f.Function, where: str) -> list[float]:
    if isinstance(function, f.Scaled):
        kind, factor, *rest = _table_of_one(function.function, where)
        return [kind, function.scale * factor, *rest]
    if isinstance(function, f.WeightedSum):
        function = f.Linear(function.weights[0], function.start)
    elif isinstance(function, f.MultivariatePolynomial):
        coefficients = [0.0] * (1 + max(power for (power,) in function.powers))
        for (power,), coefficient in zip(function.powers, function.coefficients, strict=True):
            coefficients[power] += coefficient
        kind, *rest = function_table(f.Polynomial(tuple(reversed(coefficients))), where)
        return [PIECES_OF_OPENSIM if function.opensim_derivatives else kind, *rest]
    return function_table(function, where)


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
    raise UnsupportedError(f"{where} is a {type(function).__name__}, which cannot be computed; take another function")
