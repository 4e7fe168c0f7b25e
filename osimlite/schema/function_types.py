"""Polynomials, waves, steps and expressions."""

from collections.abc import Iterator
from typing import Annotated

from osimlite.schema.facts import Contradiction, Facts
from osimlite.schema.fields import (
    Number,
    Text,
    Value,
    Vector,
    real,
)
from osimlite.schema.functions import Function


class PolynomialFunction(Function):
    """A polynomial of one variable."""

    coefficients: Vector = (1.0,)
    """Coefficients from the highest power down to the constant."""


class MultivariatePolynomialFunction(Function):
    """A polynomial of `dimension` variables with every product of powers up to `order`."""

    facts = Facts(refused="dimension order")

    coefficients: Vector = ()
    """In ascending powers, those of the last argument first: for x, y to order 2: 1, y, y^2, x, x y, x^2."""
    dimension: Annotated[int, Value("int", domain=">= 0")] = 0
    """Number of arguments."""
    order: Annotated[int, Value("int", domain=">= 0")] = 0
    """Largest sum of the exponents in one term."""


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
