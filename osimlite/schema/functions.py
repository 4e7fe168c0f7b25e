"""Functions of time, of coordinates, or of whatever their owner says."""

from typing import Annotated

from osimlite.schema.base import Object, none
from osimlite.schema.fields import (
    LegacyMany,
    LegacyOptional,
    LegacyReals,
    Number,
    Text,
    Value,
    Vector,
    real,
)
from osimlite.schema.sets import ObjectGroup


class Function(Object, abstract=True):
    """A function of one or several variables."""


class Constant(Function):
    """The same value everywhere."""

    value: Annotated[float, real(legacy=True)] = 0.0


class LinearFunction(Function):
    """A weighted sum of the variables plus a constant; `coefficients` are the weights in order, the constant last."""

    coefficients: LegacyReals = (1.0, 0.0)


class PolynomialFunction(Function):
    """A polynomial of one variable, `coefficients` from the highest power down to the constant."""

    coefficients: Vector = (1.0,)


class MultivariatePolynomialFunction(Function):
    """A polynomial of `dimension` variables with every product of powers up to `order`."""

    coefficients: Vector = ()
    dimension: Annotated[int, Value("int", domain=">= 0")] = 0
    order: Annotated[int, Value("int", domain=">= 0")] = 0


class PiecewiseConstantFunction(Function):
    """Steps: from each of `x` on, the value beside it in `y`."""

    x: LegacyReals = ()
    y: LegacyReals = ()


class PiecewiseLinearFunction(Function):
    """Straight lines between the points (`x`, `y`), continued beyond the first and the last."""

    x: LegacyReals = ()
    y: LegacyReals = ()


class SimmSpline(Function):
    """A cubic spline through the points (`x`, `y`) by the formulas of SIMM, continued as straight lines."""

    x: LegacyReals = ()
    y: LegacyReals = ()


class GCVSpline(Function):
    """A spline of degree 2 `half_order` - 1 (Woltring's), smoothed as far as `error_variance` allows."""

    half_order: Annotated[int, Value("int", legacy=True, domain=">= 0")] = 0
    error_variance: Annotated[float, real(legacy=True)] = 0.0
    x: LegacyReals = ()
    y: LegacyReals = ()
    weights: LegacyReals = ()
    coefficients: LegacyReals = ()


class MultiplierFunction(Function):
    """Another function times `scale`; what scaling a model makes of a spline."""

    function: LegacyOptional[Function] = None
    scale: Annotated[float, real(legacy=True)] = 1.0


class Sine(Function):
    """`offset` + `amplitude` sin(`omega` x + `phase`)."""

    amplitude: Number = 1.0
    omega: Annotated[float, real("rad/s")] = 1.0
    phase: Number = 0.0
    offset: Number = 0.0


class StepFunction(Function):
    """A smooth change from `start_value` to `end_value` between two times."""

    transition_start_time: Annotated[float, real(legacy=True)] = 0.99
    transition_end_time: Annotated[float, real(legacy=True)] = 1.01
    start_value: Annotated[float, real(legacy=True)] = 0.0
    end_value: Annotated[float, real(legacy=True)] = 1.0


class ExpressionBasedFunction(Function):
    """A formula in the `variables`, in the order of the arguments."""

    expression: Text = ""
    variables: Annotated[tuple[str, ...], Value("string", "list")] = ()


class FunctionSet(Object):
    """A list of functions."""

    objects: LegacyMany[Function] = none()
    groups: LegacyMany[ObjectGroup] = none()


class GCVSplineSet(FunctionSet):
    """A list of GCV splines, one for each column of a table."""
