"""Functions of time, coordinates or other variables, which the object with the function chooses."""

from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.fields import (
    LegacyMany,
    LegacyOptional,
    LegacyReals,
    real,
)
from osimlite.schema.sets import Set

UNIVARIATE_FUNCTIONS = (
    "GCVSpline",
    "PiecewiseConstantFunction",
    "PiecewiseLinearFunction",
    "PolynomialFunction",
    "SimmSpline",
    "Sine",
    "StepFunction",
)
"""Names of the classes whose functions have exactly one argument."""


class Function(Object, abstract=True):
    """A function of one or several variables."""


class Constant(Function):
    """Function with the same value everywhere."""

    value: Annotated[float, real(legacy=True)] = 0.0
    """The value at every argument."""


class LinearFunction(Function):
    """A weighted sum of the variables plus a constant."""

    coefficients: LegacyReals = (1.0, 0.0)
    """A slope for each argument in order, then the constant."""


class MultiplierFunction(Function):
    """Another function times `scale`, as scaling a model makes it from a spline."""

    function: LegacyOptional[Function] = None
    """The function that is multiplied."""
    scale: Annotated[float, real(legacy=True)] = 1.0
    """Factor of all its values."""


class FunctionSet(Set):
    """A list of functions."""

    objects: LegacyMany[Function] = make_empty_list()
    """Functions, whose order has a meaning for the owner of the set."""
