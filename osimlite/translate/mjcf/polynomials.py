"""Functions as quartics for MuJoCo's joint equalities: exact where possible, else fitted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import Composition, find_line, knots
from osimlite.translate.fidelity import Error

DEGREE = 4
"""Degree of the polynomials in an equality of MuJoCo."""

_SAMPLE_COUNT = 400
"""Number of samples of a function for a fit."""
_MAX_VALUE = 1e100
"""Largest value of a function that can be fitted: its square is still a finite number."""
_MAX_RANGE = 4.0 * np.pi
"""Largest range (rad or m) of a coordinate that is taken seriously; two turns."""


class PolynomialFit(NamedTuple):
    """Polynomial for a function.

    Attributes:
        coefficients: coefficients, constant first.
        error: error of the polynomial; None if it is exact.
    """

    coefficients: tuple[float, ...]
    error: Error | None = None


def find_polynomial(function: f.SmoothFunction) -> Polynomial | None:
    """Return the polynomial that a function of one argument is, or None."""
    line = find_line(function)
    if line is not None:
        return Polynomial((line.start, line.slope))
    match function:
        case f.ConstantValue(value):
            return Polynomial((value,))
        case f.Polynomial(coefficients):
            # OpenSim lists the coefficient of the highest power first.
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
        case Composition(outer, inner):
            first = find_polynomial(inner)
            second = find_polynomial(outer)
            if first is not None and second is not None:
                whole = second(first)
                return whole if isinstance(whole, Polynomial) else None
    return None


def fit_quartic(function: f.SmoothFunction, span: tuple[float, float], unit: str) -> PolynomialFit:
    """Return the polynomial of degree 4 that is, or is nearest to, a function.

    The nearest one has the smallest maximum error.

    The fit uses Lawson's algorithm: least squares with weights that are multiplied by the error,
    repeatedly, which converges to the minimax approximation.

    Args:
        function: function of one argument.
        span: range of the argument.
        unit: unit of the value, for the error.
    """
    exact = find_polynomial(function)
    if exact is not None and exact.degree() <= DEGREE:
        return PolynomialFit(tuple(exact.coef.tolist()))
    low, high = span
    middle, half = 0.5 * (high + low), 0.5 * (high - low)
    # Chebyshev points are dense at the ends, where the error of a fit is largest.
    x = middle + half * np.cos(np.linspace(0.0, np.pi, _SAMPLE_COUNT))
    y = sample_function(function, x)
    basis = np.polynomial.chebyshev.chebvander((x - middle) / half, DEGREE)
    weights = np.full(_SAMPLE_COUNT, 1.0 / _SAMPLE_COUNT)
    best = np.zeros(DEGREE + 1)
    least = np.inf
    for _ in range(60):
        root = np.sqrt(weights)
        result = np.linalg.lstsq(root[:, None] * basis, root * y, rcond=None)[0]
        off = np.abs(basis @ result - y)
        if off.max() < least:
            best, least = result, off.max()
        # All weights of an exact fit would vanish.
        if not off.any():
            break
        weights *= off
        weights /= weights.sum()
    fitted = Chebyshev(best, domain=[low, high]).convert(kind=Polynomial)
    # The reported error is from other points than those of the fit.
    even = np.linspace(low, high, _SAMPLE_COUNT)
    return PolynomialFit(
        tuple(fitted.coef.tolist()),
        Error.measure(fitted(even) - sample_function(function, even), unit),
    )


def sample_function(function: f.SmoothFunction, x: Array) -> Array:
    """Evaluate a function of one argument at many values (k,).

    Args:
        function: function of one argument.
        x: arguments (k,).

    Raises:
        FloatingPointError: a value is too large for a fit.
    """
    values = np.array([function.evaluate(np.array((value,)))[0] for value in x])
    if not (np.abs(values) < _MAX_VALUE).all():
        raise FloatingPointError("a function has values that nothing can be fitted to")
    return values


def select_span(
    function: f.SmoothFunction, limits: tuple[float, float], start: float
) -> tuple[float, float]:
    """Return the range in which a function of a coordinate is fitted.

    It is the range of the coordinate. A range wider than `_MAX_RANGE` is replaced by that of the
    function's knots, or by 1 to either side of the default value.

    Args:
        function: function of the coordinate.
        limits: range of the coordinate.
        start: default value of the coordinate, which the range always includes.

    Returns:
        Lower and upper end.
    """
    low, high = limits
    points = knots(function)
    if not high - low <= _MAX_RANGE and points:
        low = max(low, min(points))
        high = min(high, max(points))
    # An empty or absurd range says nothing about the motion.
    if not 0.0 < high - low <= _MAX_RANGE:
        low, high = start - 1.0, start + 1.0
    return min(low, start), max(high, start)
