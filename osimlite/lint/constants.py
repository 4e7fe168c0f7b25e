"""Functions that have one value, whatever their arguments."""

from __future__ import annotations

from osimlite.schema.base import Object
from osimlite.schema.functions import (
    Constant,
    GCVSpline,
    LinearFunction,
    MultiplierFunction,
    PiecewiseConstantFunction,
    PiecewiseLinearFunction,
    PolynomialFunction,
    SimmSpline,
)


def constant_value(function: Object | None) -> float | None:
    """Return the value of a function that is constant; None if it changes, or is not known."""
    match function:
        case Constant():
            return function.value
        case MultiplierFunction():
            inner = constant_value(function.function)
            return None if inner is None else function.scale * inner
        case LinearFunction() if len(function.coefficients) > 1:
            return None if function.coefficients[0] else function.coefficients[1]
        case PolynomialFunction() if function.coefficients:
            return None if any(function.coefficients[:-1]) else function.coefficients[-1]
        case (
            SimmSpline() | GCVSpline() | PiecewiseLinearFunction() | PiecewiseConstantFunction()
        ) if function.y:
            return function.y[0] if len({*function.y}) == 1 else None
    return None
