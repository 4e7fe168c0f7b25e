"""Numbers that carry their derivatives along several directions, as Python has them, and their rules.

A kernel runs on such numbers from the text that it has, with functions of them in the place of
Python's mathematics. What takes no derivatives from one (a comparison, an integer, a vector of
floats) takes its value.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from osimlite.mechanics.laws.dual_numbers import (
    carrying,
    carrying_room,
    is_nothing,
    plain,
    settled,
    slope_of,
)

# Where a slope has no end, at the edge of what a function is defined for, it counts as 0.
SLOPES: dict[Any, tuple[Callable[..., float], ...]] = {
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
"""Of functions the derivative by each argument, from the arguments and the value."""
ARITHMETIC: dict[Any, tuple[Callable[..., float], ...]] = {
    operator.add: (lambda x, y, f: 1.0, lambda x, y, f: 1.0),
    operator.sub: (lambda x, y, f: 1.0, lambda x, y, f: -1.0),
    operator.mul: (lambda x, y, f: y, lambda x, y, f: x),
    operator.truediv: (lambda x, y, f: 1.0 / y, lambda x, y, f: -f / y),
}
"""The same of what machine code has instructions for."""


class Carrying:
    """A number with its derivatives along several directions."""

    __array_ufunc__ = None
    # Two are equal where their values are, whatever they carry, so that none is a key.
    __hash__ = None  # type: ignore[assignment]
    __slots__ = "slopes", "value"

    def __init__(self, value: float, slopes: list[float]) -> None:
        self.value, self.slopes = value, slopes

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return self.value != 0.0


class DualVector:
    """A vector of such numbers, which are made of the rows of an array where they are read.

    Args:
        rows: (n, 1 + directions), each a number and its derivatives.
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
            else Carrying(float(row[0]), row[1:].tolist())
        )

    def __setitem__(self, index: int, number: Any) -> None:
        row = self._rows[index]
        if isinstance(number, Carrying):
            row[0], row[1:] = number.value, number.slopes
        else:
            row[0], row[1:] = number, 0.0


def _through(function: Any, slopes: tuple[Callable[..., float], ...]) -> Callable[..., Any]:
    """A function of such numbers and of floats."""

    def called(*given: Any) -> Any:
        values = [float(x) for x in given]
        result = function(*values)
        change: list[float] = []
        for x, slope in zip(given, slopes, strict=True):
            if isinstance(x, Carrying):
                by = slope(*values, result)
                more = [by * own for own in x.slopes]
                change = [a + b for a, b in zip(change, more, strict=True)] if change else more
        return Carrying(result, change) if change else result

    return called


def _compared(comparison: Callable[[float, float], bool]) -> Callable[[Any, Any], bool]:
    return lambda x, y: comparison(float(x), float(y))


_RULES = {
    function: _through(function, slopes) for function, slopes in (SLOPES | ARITHMETIC).items()
}
for _name in ("neg", "abs"):
    setattr(Carrying, f"__{_name}__", _RULES[abs if _name == "abs" else operator.neg])
for _name in ("add", "sub", "mul", "truediv", "mod", "pow"):
    _rule = _RULES[getattr(operator, _name)]
    setattr(Carrying, f"__{_name}__", _rule)
    setattr(Carrying, f"__r{_name}__", lambda x, y, rule=_rule: rule(y, x))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(Carrying, f"__{_name}__", _compared(getattr(operator, _name)))


def _begun(number: float, direction: int, directions: int) -> Carrying:
    return Carrying(float(number), [float(k == direction) for k in range(directions)])


def _settled(root: Any, error: Any, slope: Any) -> Any:
    return root - (error - float(error)) / float(slope)


def _is_nothing(number: Any) -> bool:
    return not number and not (isinstance(number, Carrying) and any(number.slopes))


IN_PLACE: dict[Any, Any] = {
    **_RULES,
    plain: float,
    settled: _settled,
    is_nothing: _is_nothing,
    carrying: _begun,
    carrying_room: lambda vector, directions: [0.0] * len(vector),
    slope_of: lambda number, direction: (
        number.slopes[direction] if isinstance(number, Carrying) else 0.0
    ),
}
"""What stands in the place of functions where numbers carry derivatives."""


@cache
def carried_by(function: Any) -> Any:
    """A kernel or a law that takes numbers with derivatives too, and makes such where its text says so."""
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        value = scope.get(name, float if name == "float" else None)
        if (
            isinstance(value, FunctionType)
            and value not in IN_PLACE
            and value.__module__.startswith("osimlite.")
        ):
            scope[name] = carried_by(value)
        elif callable(value):
            scope[name] = IN_PLACE.get(value, value)
    return FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
