"""Functions as quartics for MuJoCo's joint equalities: exact where possible, else fitted."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import Composition, find_knots, find_line
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
        return Polynomial((line.offset, line.slope))
    match function:
        case f.ConstantValue(value):
            return Polynomial((value,))
        case f.Polynomial(coefficients):
            # OpenSim lists the coefficient of the highest power first.
            return Polynomial(coefficients[::-1]).trim()
        case f.MultivariatePolynomial(coefficients, powers) if all(
            len(exponents) == 1 for exponents in powers
        ):
            all_coefficients = np.zeros(1 + max(power for (power,) in powers))
            for coefficient, (power,) in zip(coefficients, powers, strict=True):
                all_coefficients[power] += coefficient
            return Polynomial(all_coefficients).trim()
        case f.ScaledFunction(scale, inner):
            inner_polynomial = find_polynomial(inner)
            return None if inner_polynomial is None else scale * inner_polynomial
        case Composition(outer, inner):
            argument_polynomial = find_polynomial(inner)
            outer_polynomial = find_polynomial(outer)
            if argument_polynomial is not None and outer_polynomial is not None:
                composed = outer_polynomial(argument_polynomial)
                return composed if isinstance(composed, Polynomial) else None
    return None


def fit_quartic(
    function: f.SmoothFunction, interval: tuple[float, float], unit: str
) -> PolynomialFit:
    """Return the polynomial of degree 4 that is, or is nearest to, a function.

    The nearest one has the smallest maximum error.

    The fit uses Lawson's algorithm: least squares with weights that are multiplied by the error,
    repeatedly, which converges to the minimax approximation.

    Args:
        function: function of one argument.
        interval: range of the argument.
        unit: unit of the value, for the error.
    """
    exact = find_polynomial(function)
    if exact is not None and exact.degree() <= DEGREE:
        return PolynomialFit(tuple(exact.coef.tolist()))
    lower, upper = interval
    middle = 0.5 * (upper + lower)
    half_width = 0.5 * (upper - lower)
    # Chebyshev points are dense at the ends, where the error of a fit is largest.
    x = middle + half_width * np.cos(np.linspace(0.0, np.pi, _SAMPLE_COUNT))
    y = sample_function(function, x)
    basis = np.polynomial.chebyshev.chebvander((x - middle) / half_width, DEGREE)
    weights = np.full(_SAMPLE_COUNT, 1.0 / _SAMPLE_COUNT)
    best = np.zeros(DEGREE + 1)
    smallest_error = np.inf
    for _ in range(60):
        root_weights = np.sqrt(weights)
        result = np.linalg.lstsq(root_weights[:, None] * basis, root_weights * y, rcond=None)[0]
        errors = np.abs(basis @ result - y)
        if errors.max() < smallest_error:
            best = result
            smallest_error = errors.max()
        # All weights of an exact fit would vanish.
        if not errors.any():
            break
        weights *= errors
        weights /= weights.sum()
    fitted = Chebyshev(best, domain=[lower, upper]).convert(kind=Polynomial)
    # The reported error is from other points than those of the fit.
    check_points = np.linspace(lower, upper, _SAMPLE_COUNT)
    return PolynomialFit(
        tuple(fitted.coef.tolist()),
        Error.measure(fitted(check_points) - sample_function(function, check_points), unit),
    )


def sample_function(function: f.SmoothFunction, x: Array) -> Array:
    """Evaluate a function of one argument at many values (k,).

    Args:
        function: function of one argument.
        x: values of the argument (k,).

    Returns:
        Values of the function (k,).

    Raises:
        FloatingPointError: a value is too large for a fit.
    """
    values = np.array([function.evaluate(np.array((value,)))[0] for value in x])
    if not (np.abs(values) < _MAX_VALUE).all():
        raise FloatingPointError(
            "a function has values that are too large for a fit, or not finite"
        )
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
    lower, upper = limits
    points = find_knots(function)
    if not upper - lower <= _MAX_RANGE and points:
        lower = max(lower, min(points))
        upper = min(upper, max(points))
    # An empty or absurd range says nothing about the motion.
    if not 0.0 < upper - lower <= _MAX_RANGE:
        lower = start - 1.0
        upper = start + 1.0
    return min(lower, start), max(upper, start)
