"""Conversion of the function components of a model to functions with derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.text import (
    SAME_CLASS_SIMILARITY,
    add_article,
    format_count,
    join_words,
    suggest_name,
)
from osimlite.errors import ModelError, UnsupportedError
from osimlite.mechanics.multibody import functions as f
from osimlite.schema import functions as schema
from osimlite.schema.base import Object, Unknown
from osimlite.schema.resolution import is_a

if TYPE_CHECKING:
    from osimlite.schema.function_types import MultivariatePolynomialFunction, StepFunction
    from osimlite.schema.splines import (
        GCVSpline,
        PiecewiseConstantFunction,
        PiecewiseLinearFunction,
    )


def convert_function(
    function: Object | None, arguments: int, where: str, *, opensim_derivatives: bool = False
) -> f.SmoothFunction:
    """Return the function that a component of a model describes.

    Args:
        function: one of OpenSim's functions.
        arguments: number of arguments that it will be called with.
        where: path and property of the function, for messages.
        opensim_derivatives: whether a multivariate polynomial has OpenSim's wrong second
            derivatives.

    Raises:
        ModelError: the function is missing, has another number of arguments, or has impossible
            values.
        UnsupportedError: the function is of an unknown class.
    """
    if function is None:
        raise ModelError(f"{where} is missing; give one, for instance a LinearFunction")
    class_name = type(function).__name__
    try:
        if isinstance(function, schema.MultiplierFunction):
            inner = convert_function(
                function.function, arguments, where, opensim_derivatives=opensim_derivatives
            )
            return f.ScaledFunction(function.scale, inner)
        if is_a(function, "MultivariatePolynomialFunction"):
            polynomial = cast("MultivariatePolynomialFunction", function)
            _require_argument_count(polynomial, polynomial.dimension, arguments)
            return f.MultivariatePolynomial.complete(
                polynomial.coefficients,
                polynomial.dimension,
                polynomial.order,
                opensim_derivatives=opensim_derivatives,
            )
        if isinstance(function, schema.LinearFunction):
            return _convert_linear(function, arguments)
        if isinstance(function, schema.Constant):
            return f.ConstantValue(function.value)
        if class_name not in _UNIVARIATE:
            name = function.class_name if isinstance(function, Unknown) else class_name
            supported = [
                "Constant",
                "LinearFunction",
                "MultiplierFunction",
                "MultivariatePolynomialFunction",
            ]
            supported += _UNIVARIATE
            supported_list = (
                f"; the supported functions are {join_words(supported, max_count=len(supported))}"
            )
            raise UnsupportedError(
                f"{where} is {add_article(name)}, which osimlite cannot differentiate twice"
                f"{suggest_name(name, supported, cutoff=SAME_CLASS_SIMILARITY) or supported_list}"
            )
        _require_argument_count(function, 1, arguments)
        return _UNIVARIATE[class_name](function)
    except _Impossible as problem:
        raise ModelError(f"{where} ({class_name}): {problem}") from None


class _Impossible(Exception):
    """Error of a function, with the remedy but without its position in the model."""


def _require_argument_count(function: Object, expected: int, count: int) -> None:
    if count != expected:
        raise _Impossible(
            f"it takes {format_count(expected, 'variable')}, but {format_count(count, 'argument')} are listed; "
            f"list {expected}, or use a function of {format_count(count, 'variable')}"
        )


def _convert_linear(function: schema.LinearFunction, arguments: int) -> f.SmoothFunction:
    """Return a linear function of one or several arguments.

    Args:
        function: function of the file.
        arguments: number of arguments.

    Raises:
        _Impossible: the function has no coefficient for an argument or for the constant.
    """
    count = len(function.coefficients)
    if count <= arguments:
        raise _Impossible(
            f"it has {format_count(count, 'coefficient')}; give {arguments + 1}, the constant last"
        )
    # OpenSim uses the coefficient after the weights as the constant, and ignores those after it.
    weights = function.coefficients[:arguments]
    start = function.coefficients[arguments]
    return f.Linear(weights[0], start) if arguments == 1 else f.WeightedSum(weights, start)


def _read_points(
    function: Any, least: int, *, distinct: bool = False
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the abscissae and ordinates of a function through points, after checks.

    Args:
        function: function with properties `x` and `y`; ordinates beyond the last abscissa are
            ignored, as in OpenSim.
        least: smallest number of points.
        distinct: whether abscissae must differ.

    Returns:
        Abscissae and ordinates.

    Raises:
        _Impossible: there are too few points, an abscissa has no ordinate, a number is not finite,
            or the abscissae do not increase.
    """
    x = tuple(function.x)
    y = tuple(function.y)[: len(x)]
    if len(x) != len(y) or len(x) < least:
        raise _Impossible(
            f"it has {format_count(len(x), 'x value')} and {format_count(len(y), 'y value')}; "
            f"give the same number of both, at least {least}"
        )
    if not all(map(isfinite, (*x, *y))):
        raise _Impossible("a point is not finite; give numbers")
    if any(right < left or (distinct and right == left) for left, right in pairwise(x)):
        repeated = " and remove repeated ones" if distinct else ""
        raise _Impossible(f"its x do not increase; sort the points{repeated}")
    return x, y


def _piecewise_linear(function: PiecewiseLinearFunction) -> f.SmoothFunction:
    """Return straight lines through points; one point is a constant.

    Raises:
        _Impossible: the points are invalid, or the first two or last two abscissae are equal.
    """
    x, y = _read_points(function, 1)
    if len(x) == 1:
        return f.ConstantValue(y[0])
    if x[0] == x[1] or x[-1] == x[-2]:
        # The line that continues outside of the points would be vertical.
        raise _Impossible("its first or last two x are equal; remove one of them")
    return f.PiecewiseLinear(x, y)


def _piecewise_constant(function: PiecewiseConstantFunction) -> f.SmoothFunction:
    """Return steps through points; one point is a constant."""
    x, y = _read_points(function, 1)
    return f.PiecewiseConstant(x, y) if len(x) > 1 else f.ConstantValue(y[0])


def _convert_gcv_spline(function: GCVSpline) -> f.SmoothFunction:
    """Return the smoothing spline of a GCVSpline, after checks.

    Raises:
        _Impossible: the half order is less than 1, or the points are invalid or too few for it.
    """
    half_order = function.half_order
    if half_order < 1:
        raise _Impossible(f"its half_order is {half_order}; give 1 or more, 2 for a cubic spline")
    x, y = _read_points(function, 2 * half_order, distinct=True)
    # The module is imported here, because the linter evaluates other functions without numpy.
    splines: Any = import_module("osimlite.mechanics.multibody.smoothing_spline")
    spline: f.SmoothFunction = splines.smoothing_spline(x, y, half_order, function.error_variance)
    return spline


def _convert_step(function: StepFunction) -> f.SmoothFunction:
    """Return a smooth step, with ascending arguments.

    Raises:
        _Impossible: the transition starts and ends at the same time, or one of the times is NaN.
    """
    start, end = function.transition_start_time, function.transition_end_time
    if start > end:
        # OpenSim follows the same curve from its other end.
        return f.QuinticStep(end, start, function.end_value, function.start_value)
    if not start < end:
        raise _Impossible(
            f"its transition starts and ends at {end:g}; set different times for its start and end"
        )
    return f.QuinticStep(start, end, function.start_value, function.end_value)


def _read_floats(values: Sequence[float]) -> tuple[float, ...]:
    if not values:
        raise _Impossible("it has no coefficients; give at least one")
    return tuple(float(value) for value in values)


_UNIVARIATE: dict[str, Callable[[Any], f.SmoothFunction]] = {
    "PolynomialFunction": lambda item: f.Polynomial(_read_floats(item.coefficients)),
    "Sine": lambda item: f.SineWave(item.amplitude, item.omega, item.phase, item.offset),
    "StepFunction": _convert_step,
    "PiecewiseConstantFunction": _piecewise_constant,
    "PiecewiseLinearFunction": _piecewise_linear,
    "SimmSpline": lambda item: f.SimmCubicSpline(*_read_points(item, 2)),
    "GCVSpline": _convert_gcv_spline,
}
"""Conversions by class; as names, so that classes which a model does not use are not imported."""
