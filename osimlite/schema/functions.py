"""Functions of time, of coordinates, or of whatever their owner says."""

from collections.abc import Iterator
from typing import Annotated

from osimlite.schema.base import Object, make_empty_list
from osimlite.schema.facts import Contradiction, Facts
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
from osimlite.schema.sets import Set


class Function(Object, abstract=True):
    """A function of one or several variables."""


class Constant(Function):
    """The same value everywhere."""

    value: Annotated[float, real(legacy=True)] = 0.0
    """The value at every argument."""


class LinearFunction(Function):
    """A weighted sum of the variables plus a constant."""

    coefficients: LegacyReals = (1.0, 0.0)
    """A slope for each argument in order, then the constant."""


class PolynomialFunction(Function):
    """A polynomial of one variable."""

    coefficients: Vector = (1.0,)
    """From the highest power down to the constant."""


class MultivariatePolynomialFunction(Function):
    """A polynomial of `dimension` variables with every product of powers up to `order`."""

    facts = Facts(refused="dimension order")

    coefficients: Vector = ()
    """In ascending powers, those of the last argument first: for x, y to order 2: 1, y, y^2, x, x y, x^2."""
    dimension: Annotated[int, Value("int", domain=">= 0")] = 0
    """Number of arguments."""
    order: Annotated[int, Value("int", domain=">= 0")] = 0
    """Largest sum of the exponents in one term."""


class PiecewiseConstantFunction(Function):
    """Steps between constant values."""

    x: LegacyReals = ()
    """Arguments at which the value changes, in ascending order."""
    y: LegacyReals = ()
    """Value from each x up to the next; the first holds before too, the last after."""


class PiecewiseLinearFunction(Function):
    """Straight lines between the points (`x`, `y`), continued beyond the first and the last."""

    x: LegacyReals = ()
    """Arguments of the points, in ascending order."""
    y: LegacyReals = ()
    """Values at the points; the outer lines go on beyond them."""


# OpenSim prints these lists of the first property system with six digits: a model that it has
# written again has slightly different splines.
class SimmSpline(Function):
    """A cubic spline through the points (`x`, `y`) by the formulas of SIMM, continued as straight lines."""

    x: LegacyReals = ()
    """Arguments of the points, in ascending order; two make a line."""
    y: LegacyReals = ()
    """Values at the points; beyond the ends it goes on as a line with the slope there."""


# In the lists OpenSim accepts commas and one pair of brackets, but neither nan nor inf: they belong
# to its first property system.
class GCVSpline(Function):
    """A spline of degree 2 `half_order` - 1 (Woltring's), smoothed as far as `error_variance` allows."""

    half_order: Annotated[int, Value("int", legacy=True, domain=">= 0")] = 0
    """Half of degree + 1: 1 is linear, 2 cubic, 3 quintic, 4 heptic."""
    error_variance: Annotated[float, real(legacy=True)] = 0.0
    """Variance of the noise in `y`: with 0 the spline runs through all points, below 0 cross-validation decides."""
    x: LegacyReals = ()
    """Arguments of the points, in ascending order; at least twice as many as `half_order`."""
    y: LegacyReals = ()
    """Values at the points."""
    weights: LegacyReals = ()
    """A number for each point; OpenSim's fit lets all points count the same."""
    coefficients: LegacyReals = ()
    """What the fit gave when the spline was written; OpenSim computes it anew from the points."""


class MultiplierFunction(Function):
    """Another function times `scale`; what scaling a model makes of a spline."""

    function: LegacyOptional[Function] = None
    """The function that is multiplied."""
    scale: Annotated[float, real(legacy=True)] = 1.0
    """Factor of all its values."""


class Sine(Function):
    """`offset` + `amplitude` sin(`omega` x + `phase`)."""

    amplitude: Number = 1.0
    """Factor of the sine."""
    omega: Annotated[float, real("rad/s")] = 1.0
    """Factor of the argument inside the sine."""
    phase: Number = 0.0
    """Added inside the sine (rad)."""
    offset: Number = 0.0
    """Added to the sine."""


class StepFunction(Function):
    """A smooth change from `start_value` to `end_value` between two times."""

    transition_start_time: Annotated[float, real(legacy=True)] = 0.99
    """Argument up to which the value is `start_value`."""
    transition_end_time: Annotated[float, real(legacy=True)] = 1.01
    """Argument from which on the value is `end_value`; between them it is smooth."""
    start_value: Annotated[float, real(legacy=True)] = 0.0
    """Value before the step."""
    end_value: Annotated[float, real(legacy=True)] = 1.0
    """Value after the step."""

    def find_contradictions(self) -> Iterator[Contradiction]:
        """Yield a transition without duration, which OpenSim rejects; it may go forwards or backwards."""
        if self.transition_start_time == self.transition_end_time:
            yield (
                "transition_end_time",
                f"its transition starts and ends at {self.transition_end_time:.6g}",
            )


class ExpressionBasedFunction(Function):
    """A formula in the `variables`, in the order of the arguments."""

    expression: Text = ""
    """Formula in the variables, without spaces."""
    variables: Annotated[tuple[str, ...], Value("string", "list")] = ()
    """Names in the formula, in the order of the arguments."""


class FunctionSet(Set):
    """A list of functions."""

    objects: LegacyMany[Function] = make_empty_list()
    """The functions; whoever owns the set says what their order means."""


class GCVSplineSet(FunctionSet):
    """A list of GCV splines, one for each column of a table."""
