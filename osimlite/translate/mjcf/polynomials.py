"""Functions as the quartics that MuJoCo's joint equalities hold: written exactly where they are, fitted where not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import Composed, as_line, knots
from osimlite.translate.fidelity import Error

DEGREE = 4
"""Of the polynomials in an equality of MuJoCo."""

_SAMPLE_COUNT = 400
_MAX_VALUE = 1e100
"""Of the values of functions: their squares are numbers too."""
_MAX_RANGE = 4.0 * np.pi
"""A range (rad, m) that is wider is taken for one that nobody meant."""


class Fit(NamedTuple):
    """A polynomial, constant first, and how far it is from the function; no error where it is the function."""

    coefficients: tuple[float, ...]
    error: Error | None = None


def find_polynomial(function: f.Function) -> Polynomial | None:
    """The polynomial that a function of one argument is, or None."""
    line = as_line(function)
    if line is not None:
        return Polynomial((line.start, line.slope))
    match function:
        case f.Constant(value):
            return Polynomial((value,))
        case f.Polynomial(coefficients):
            return Polynomial(coefficients[::-1]).trim()
        case f.MultivariatePolynomial(coefficients, powers) if all(
            len(item) == 1 for item in powers
        ):
            dense = np.zeros(1 + max(power for (power,) in powers))
            for coefficient, (power,) in zip(coefficients, powers, strict=True):
                dense[power] += coefficient
            return Polynomial(dense).trim()
        case f.ScaledFunction(scale, inner):
            own = find_polynomial(inner)
            return None if own is None else scale * own
        case Composed(outer, inner):
            first, second = find_polynomial(inner), find_polynomial(outer)
            if first is not None and second is not None:
                whole = second(first)
                return whole if isinstance(whole, Polynomial) else None
    return None


def fit_quartic(function: f.Function, span: tuple[float, float], unit: str) -> Fit:
    """The polynomial of degree four that is a function of one argument, or whose greatest error is least on a span.

    Fitted by Lawson's algorithm: least squares, again and again, with weights that grow where the
    error is large.
    """
    exact = find_polynomial(function)
    if exact is not None and exact.degree() <= DEGREE:
        return Fit(tuple(exact.coef.tolist()))
    low, high = span
    middle, half = 0.5 * (high + low), 0.5 * (high - low)
    x = middle + half * np.cos(np.linspace(0.0, np.pi, _SAMPLE_COUNT))
    y = sample_function(function, x)
    basis = np.polynomial.chebyshev.chebvander((x - middle) / half, DEGREE)
    weights, best, least = np.full(_SAMPLE_COUNT, 1.0 / _SAMPLE_COUNT), np.zeros(DEGREE + 1), np.inf
    for _ in range(60):
        root = np.sqrt(weights)
        result = np.linalg.lstsq(root[:, None] * basis, root * y, rcond=None)[0]
        off = np.abs(basis @ result - y)
        if off.max() < least:
            best, least = result, off.max()
        if not off.any():
            break
        weights *= off
        weights /= weights.sum()
    fitted = Chebyshev(best, domain=[low, high]).convert(kind=Polynomial)
    even = np.linspace(low, high, _SAMPLE_COUNT)
    return Fit(
        tuple(fitted.coef.tolist()),
        Error.measure(fitted(even) - sample_function(function, even), unit),
    )


def sample_function(function: f.Function, x: Array) -> Array:
    """Values of a function of one argument at many.

    Raises:
        FloatingPointError: they are too large to fit anything to.
    """
    values = np.array([function.evaluate(np.array((value,)))[0] for value in x])
    if not (np.abs(values) < _MAX_VALUE).all():
        raise FloatingPointError("a function has values that nothing can be fitted to")
    return values


def select_span(
    function: f.Function, limits: tuple[float, float], start: float
) -> tuple[float, float]:
    """Where a function of a coordinate is wanted: in the coordinate's range, as far as that means anything.

    Args:
        function: of the coordinate.
        limits: the range.
        start: the default value of the coordinate, which belongs to the span.
    """
    low, high = limits
    points = knots(function)
    if not high - low <= _MAX_RANGE and points:
        low, high = max(low, min(points)), min(high, max(points))
    if not 0.0 < high - low <= _MAX_RANGE:
        low, high = start - 1.0, start + 1.0
    return min(low, start), max(high, start)
