"""Dual numbers: numbers with derivatives along several directions, and their rules in Python.

A kernel runs on dual numbers with unchanged code; the functions of Python's `math` are replaced.
Comparisons, integers and vectors of floats use the value alone.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from osimlite.mechanics.laws.dual_numbers import (
    differentiate_root,
    get_derivative,
    is_exact_zero,
    make_dual_workspace,
    seed_derivative,
    strip_derivatives,
)

# At the edge of a function's domain, where the slope is infinite, it counts as 0.
FUNCTION_SLOPES: dict[Any, tuple[Callable[..., float], ...]] = {
    operator.neg: (lambda x, f: -1.0,),
    abs: (lambda x, f: -1.0 if x < 0.0 else 1.0,),
    float: (lambda x, f: 1.0,),
    math.sqrt: (lambda x, f: 0.5 / f if x > 0.0 else 0.0,),
    math.sin: (lambda x, f: math.cos(x),),
    math.cos: (lambda x, f: -math.sin(x),),
    math.tan: (lambda x, f: 1.0 + f * f,),
    math.asin: (lambda x, f: 1.0 / math.sqrt(1.0 - x * x) if abs(x) < 1.0 else 0.0,),
    math.acos: (lambda x, f: -1.0 / math.sqrt(1.0 - x * x) if abs(x) < 1.0 else 0.0,),
    math.atan: (lambda x, f: 1.0 / (1.0 + x * x),),
    math.exp: (lambda x, f: f,),
    math.log: (lambda x, f: 1.0 / x,),
    math.sinh: (lambda x, f: math.cosh(x),),
    math.cosh: (lambda x, f: math.sinh(x),),
    math.tanh: (lambda x, f: 1.0 - f * f,),
    math.erf: (lambda x, f: 1.1283791670955126 * math.exp(-x * x),),
    math.erfc: (lambda x, f: -1.1283791670955126 * math.exp(-x * x),),
    math.radians: (lambda x, f: 0.017453292519943295,),
    math.atan2: (lambda y, x, f: x / (x * x + y * y), lambda y, x, f: -y / (x * x + y * y)),
    math.copysign: (lambda x, y, f: 1.0 if (x < 0.0) == (f < 0.0) else -1.0, lambda x, y, f: 0.0),
    operator.mod: (lambda x, y, f: 1.0, lambda x, y, f: (f - x) / y),
    operator.pow: (
        lambda x, y, f: y * x ** (y - 1.0) if x != 0.0 or y >= 1.0 else 0.0,
        lambda x, y, f: f * math.log(x) if x > 0.0 else 0.0,
    ),
}
"""Derivative of each function by each argument, from the arguments and the value f."""
ARITHMETIC_SLOPES: dict[Any, tuple[Callable[..., float], ...]] = {
    operator.add: (lambda x, y, f: 1.0, lambda x, y, f: 1.0),
    operator.sub: (lambda x, y, f: 1.0, lambda x, y, f: -1.0),
    operator.mul: (lambda x, y, f: y, lambda x, y, f: x),
    operator.truediv: (lambda x, y, f: 1.0 / y, lambda x, y, f: -f / y),
}
"""Derivatives of the operations for which machine code has instructions."""


class DualNumber:
    """Number with its derivatives along several directions.

    Args:
        value: value of the number.
        slopes: derivatives along the directions.
    """

    __array_ufunc__ = None
    # Equality compares values only, so dual numbers cannot be dictionary keys.
    __hash__ = None  # type: ignore[assignment]
    __slots__ = "slopes", "value"

    def __init__(self, value: float, slopes: list[float]) -> None:
        self.value = value
        self.slopes = slopes

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return self.value != 0.0


class DualVector:
    """Vector of dual numbers, which are made from the rows of an array when they are read.

    Args:
        rows: numbers with their derivatives (n, 1 + directions).
    """

    __slots__ = ("_rows",)

    def __init__(self, rows: Any) -> None:
        self._rows = rows

    @property
    def values(self) -> Any:
        """The numbers alone, as a view (n,)."""
        return self._rows[:, 0]

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Any) -> Any:
        row = self._rows[index]
        return (
            DualVector(row)
            if isinstance(index, slice)
            else DualNumber(float(row[0]), row[1:].tolist())
        )

    def __setitem__(self, index: int, number: Any) -> None:
        row = self._rows[index]
        if isinstance(number, DualNumber):
            row[0], row[1:] = number.value, number.slopes
        else:
            row[0], row[1:] = number, 0.0


def _apply_chain_rule(
    function: Any, slopes: tuple[Callable[..., float], ...]
) -> Callable[..., Any]:
    """Return a function of dual numbers and floats.

    Args:
        function: function of floats.
        slopes: derivative of the function by each argument, as functions of the arguments and the
            value.

    Returns:
        Function that returns a float if all arguments are floats.
    """

    def differentiate(*arguments: Any) -> Any:
        values = [float(x) for x in arguments]
        result = function(*values)
        change: list[float] = []
        for x, slope in zip(arguments, slopes, strict=True):
            if isinstance(x, DualNumber):
                partial_slope = slope(*values, result)
                scaled_slopes = [partial_slope * component for component in x.slopes]
                change = (
                    [a + b for a, b in zip(change, scaled_slopes, strict=True)]
                    if change
                    else scaled_slopes
                )
        return DualNumber(result, change) if change else result

    return differentiate


def _compare_values(comparison: Callable[[float, float], bool]) -> Callable[[Any, Any], bool]:
    """Return a comparison of values that ignores derivatives."""
    return lambda x, y: comparison(float(x), float(y))


_RULES = {
    function: _apply_chain_rule(function, slopes)
    for function, slopes in (FUNCTION_SLOPES | ARITHMETIC_SLOPES).items()
}
for _name in ("neg", "abs"):
    setattr(DualNumber, f"__{_name}__", _RULES[abs if _name == "abs" else operator.neg])
for _name in ("add", "sub", "mul", "truediv", "mod", "pow"):
    _rule = _RULES[getattr(operator, _name)]
    setattr(DualNumber, f"__{_name}__", _rule)
    # The default binds the rule of this pass of the loop.
    setattr(DualNumber, f"__r{_name}__", lambda x, y, rule=_rule: rule(y, x))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(DualNumber, f"__{_name}__", _compare_values(getattr(operator, _name)))


def _seed_direction(number: float, direction: int, directions: int) -> DualNumber:
    """Return a number whose derivative is 1 along one direction and 0 along the others."""
    return DualNumber(float(number), [float(k == direction) for k in range(directions)])


def _differentiate_root(root: Any, error: Any, slope: Any) -> Any:
    """Return a root with its derivatives, by the implicit function theorem.

    From g(x, p) = 0 follows dx = -dg / (∂g/∂x). It is computed as one Newton step whose value is 0.

    Args:
        root: solution x, found without derivatives.
        error: g at the root, with derivatives by the parameters.
        slope: ∂g/∂x.
    """
    # One step of Newton's method with dual numbers: its value stays the root, its slopes are those
    # of the implicit function.
    return root - (error - float(error)) / float(slope)


def _is_zero(number: Any) -> bool:
    """Return whether a number and all its derivatives are 0."""
    # A force that is zero here may still have a slope.
    return not number and not (isinstance(number, DualNumber) and any(number.slopes))


DUAL_REPLACEMENTS: dict[Any, Any] = {
    **_RULES,
    strip_derivatives: float,
    differentiate_root: _differentiate_root,
    is_exact_zero: _is_zero,
    seed_derivative: _seed_direction,
    make_dual_workspace: lambda vector, directions: [0.0] * len(vector),
    get_derivative: lambda number, direction: (
        number.slopes[direction] if isinstance(number, DualNumber) else 0.0
    ),
}
"""Functions that replace others where numbers are dual."""


@cache
def make_dual(function: Any) -> Any:
    """Return a kernel or law that also accepts dual numbers, together with the functions that it calls."""
    # The code of the function stays the same; the names that it calls are bound to other functions.
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        value = scope.get(name, float if name == "float" else None)
        if (
            isinstance(value, FunctionType)
            and value not in DUAL_REPLACEMENTS
            and value.__module__.startswith("osimlite.")
        ):
            scope[name] = make_dual(value)
        elif callable(value):
            scope[name] = DUAL_REPLACEMENTS.get(value, value)
    return FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
