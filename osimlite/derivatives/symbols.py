"""Numbers that may be CasADi symbols, and the operations of kernels on them. Only this module imports CasADi.

A branch that depends on a symbol becomes a selection, and both sides are computed. While a side is
computed, a condition says where it is active. An operation that could be NaN elsewhere (a quotient,
a root) is computed from 1 there, so that no NaN reaches the derivatives of the other side.
"""

from __future__ import annotations

import math
import operator
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from osimlite.base.require import require
from osimlite.errors import MissingDependency

_interruptions: list[object] = []
"""Presses of Ctrl-C within `postpone_interrupts` that no `raise_interrupt` has raised yet."""


@contextmanager
def postpone_interrupts() -> Iterator[None]:
    """Raise an interruption by the keyboard between calls of CasADi only.

    CasADi's conversion of arguments calls Python, and discards whatever that raises: an exception
    that Python's handler of Ctrl-C raises there would be lost, and the work would continue. Within
    this context Ctrl-C is only noted. `raise_interrupt` and the end of the context raise it.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed within the block.
    """
    # Python delivers signals to the main thread only. A handler of the caller's stays.
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGINT) is not signal.default_int_handler
    ):
        yield
        return
    _interruptions.clear()
    signal.signal(signal.SIGINT, lambda *arguments: _interruptions.append(arguments))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    raise_interrupt()


def raise_interrupt() -> None:
    """Raise an interruption that `postpone_interrupts` has noted.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed.
    """
    if _interruptions:
        _interruptions.clear()
        raise KeyboardInterrupt


if "opensim" in sys.modules and "casadi" not in sys.modules:
    # OpenSim ships another version of CasADi's library under the same name.
    raise MissingDependency("casadi cannot be loaded after opensim; use another process")
with postpone_interrupts():
    casadi: Any = require("casadi", extra="casadi", purpose="a model as functions of CasADi")
SX: Any = casadi.SX
"""Type of CasADi's symbolic scalar expressions."""

Number = Any
"""Float, integer, or `SX`."""


class UnsetVariable:
    """Value of a variable before its first assignment."""


UNSET = UnsetVariable()
"""The only instance of `UnsetVariable`."""


class NoFormula(Exception):
    """Error for code, or a use of it, that has no meaning for symbols.

    Attributes:
        items: items of the calls that led there, the innermost first.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.items: list[int] = []


class BranchWideningSignal(Exception):
    """Signal that a merged value is used which cannot be merged.

    A wider part of the code must then be run for both sides.

    Attributes:
        part: part of the code that merged the value.
    """

    def __init__(self, code_part: Any) -> None:
        super().__init__(str(code_part))
        self.part = code_part


class UnmergeableValue:
    """Integer, or similar value, that differs between the sides of a branch.

    Any use of it raises `BranchWideningSignal`.

    Args:
        code_part: part of the code that merged the value.
    """

    def __init__(self, code_part: Any) -> None:
        self.part = code_part

    def _require_wider(self, *_: Any) -> Any:
        raise BranchWideningSignal(self.part)

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = (
        __neg__
    ) = _require_wider
    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __index__ = __int__ = __float__ = (
        __bool__
    ) = _require_wider
    __getitem__ = __setitem__ = __floordiv__ = __mod__ = __pow__ = __and__ = __iter__ = __len__ = (
        _require_wider
    )
    __hash__ = None  # type: ignore[assignment]


class RecordedVector:
    """List from an index on; writes are recorded while a branch is being computed."""

    __slots__ = ("cells", "first")
    journals: list[dict[tuple[int, int], tuple[list[Any], int, Any]]] = []  # noqa: RUF012 - one for all
    """Cells that each open branch has written, with their previous values."""

    def __init__(self, cells: list[Any], first: int = 0) -> None:
        self.cells = cells
        self.first = first

    def __getitem__(self, index: Any) -> Number:
        if type(index) is slice:
            return self.cells[self.first + index.start : self.first + index.stop]
        index = self.first + index
        if index < 0:
            raise IndexError("a kernel reads before the beginning of a vector")
        return self.cells[index]

    def __setitem__(self, index: int, value: Number) -> None:
        index = self.first + index
        if index < 0:
            raise IndexError("a kernel writes before the beginning of a vector")
        if self.journals:
            self.journals[-1].setdefault(
                (id(self.cells), index), (self.cells, index, self.cells[index])
            )
        self.cells[index] = value

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, RecordedVector)
            and self.cells is other.cells
            and self.first == other.first
        )

    __hash__ = None  # type: ignore[assignment]

    def get_tail(self, start: int) -> RecordedVector:
        """Return the vector from an index on."""
        return RecordedVector(self.cells, self.first + start)


class _ActiveCondition:
    """Condition under which the current computation is active; None if always."""

    condition: Any = None


current_branch = _ActiveCondition()
"""The only active condition."""


def is_symbol(value: Any) -> bool:
    """Return whether a number depends on a symbol."""
    return isinstance(value, SX) and not value.is_constant()


def simplify_number(value: Any) -> Any:
    """Return a number that depends on no symbol as a float, and others unchanged."""
    return float(value) if isinstance(value, SX) and value.is_constant() else value


@contextmanager
def restrict_condition(test: Any) -> Iterator[None]:
    """Restrict the active condition by a test within a block."""
    outer_condition = current_branch.condition
    current_branch.condition = combine_condition(test)
    try:
        yield
    finally:
        current_branch.condition = outer_condition


def combine_condition(test: Any) -> Any:
    """Return the conjunction of the active condition and a test.

    Args:
        test: the test, a symbol.
    """
    return (
        test
        if current_branch.condition is None
        else casadi.logic_and(current_branch.condition, test)
    )


def guard_value(value: Any, instead: float = 1.0) -> Any:
    """Return a value where the active condition holds, and a harmless number elsewhere.

    Args:
        value: symbol.
        instead: number for which the next operation is defined.
    """
    return (
        value
        if current_branch.condition is None
        else casadi.if_else(current_branch.condition, value, instead)
    )


def merge_values(test: Any, a: Any, b: Any, code_part: Any) -> Any:
    """Return `a` where a test holds, else `b`.

    Args:
        test: symbol.
        a: number, tuple of numbers, or a value that is equal in both.
        b: value of the same kind.
        code_part: part of the code, which is run for both sides if an unmergeable value is used.

    Returns:
        A selection of CasADi; the value itself if both are equal, or one is unset.
    """
    if a is b or isinstance(b, UnsetVariable):
        return a
    if isinstance(a, UnsetVariable):
        return b
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        merged = [merge_values(test, x, y, code_part) for x, y in zip(a, b, strict=True)]
        return type(a)(*merged) if hasattr(a, "_fields") else tuple(merged)
    a = simplify_number(a)
    b = simplify_number(b)
    if isinstance(a, bool) and isinstance(b, bool):
        return a if a == b else (test if a else casadi.logic_not(test))
    if isinstance(a, UnmergeableValue) or isinstance(b, UnmergeableValue):
        return UnmergeableValue(code_part)
    if isinstance(a, SX) or isinstance(b, SX):
        # Equal expressions need no selection, which keeps the formulas small.
        if isinstance(a, SX) and isinstance(b, SX) and casadi.is_equal(a, b, 1):
            return a
        return casadi.if_else(test, a, b)
    if type(a) is type(b) and a == b:
        return a
    if isinstance(a, float) or isinstance(b, float):
        return casadi.if_else(test, a, b)
    return UnmergeableValue(code_part)


# ------------------------------------------------------------------------------------------ instead of Python's own
def _make_binary_operation(
    operation: Callable[[Any, Any], Any], number: int
) -> Callable[[Any, Any], Any]:
    """Return an operation on two numbers.

    CasADi's own operators take eight times as long, since they check the types of their operands.

    Args:
        operation: operation on floats.
        number: CasADi's number of the operation.
    """
    binary = SX.binary

    def apply_operation(a: Any, b: Any) -> Any:
        return binary(number, a, b) if isinstance(a, SX) or isinstance(b, SX) else operation(a, b)

    return apply_operation


plus = _make_binary_operation(operator.add, casadi.OP_ADD)
"""Sum of two numbers or symbols."""
minus = _make_binary_operation(operator.sub, casadi.OP_SUB)
"""Difference of two numbers or symbols."""
times = _make_binary_operation(operator.mul, casadi.OP_MUL)
"""Product of two numbers or symbols."""


def divide(a: Any, b: Any) -> Any:
    """Return a / b with the rules of IEEE arithmetic for division by zero.

    Args:
        a: dividend.
        b: divisor.
    """
    if is_symbol(b):
        return a / guard_value(b)
    a = simplify_number(a)
    b = simplify_number(b)
    if b == 0.0 and not isinstance(a, SX):
        return (
            math.nan
            if a == 0.0 or math.isnan(a)
            else math.copysign(math.inf, a) * math.copysign(1.0, b)
        )
    return a / b


def power(a: Any, b: Any) -> Any:
    """Return a to the power of b.

    Args:
        a: base.
        b: exponent; a whole number gives a product, which is defined for negative bases.
    """
    a = simplify_number(a)
    b = simplify_number(b)
    if not (isinstance(a, SX) or isinstance(b, SX)):
        return a**b
    if not isinstance(b, SX) and b == int(b) and b >= 0:
        return a ** int(b)
    return (guard_value(a) if isinstance(a, SX) else a) ** b


def logical_and(*tests: Callable[[], Any]) -> Any:
    """Return the conjunction of lazily evaluated parts."""
    return _evaluate_logical(tests, stop=False)


def logical_or(*tests: Callable[[], Any]) -> Any:
    """Return the disjunction of lazily evaluated parts."""
    return _evaluate_logical(tests, stop=True)


def _evaluate_logical(tests: Iterable[Callable[[], Any]], *, stop: bool) -> Any:
    """Evaluate parts in turn, each under the condition that the ones before did not decide.

    Args:
        tests: functions that return tests.
        stop: value that decides: False for a conjunction, True for a disjunction.

    Returns:
        The combined test.
    """
    combined: Any = None
    outer_condition = current_branch.condition
    try:
        for compute_test in tests:
            value = simplify_number(compute_test())
            if not is_symbol(value):
                if bool(value) is stop:
                    return stop
                continue
            combined = (
                value
                if combined is None
                else (casadi.logic_or if stop else casadi.logic_and)(combined, value)
            )
            current_branch.condition = combine_condition(casadi.logic_not(value) if stop else value)
    finally:
        current_branch.condition = outer_condition
    return (not stop) if combined is None else combined


def logical_not(value: Any) -> Any:
    """Return the negation of a test."""
    return casadi.logic_not(value) if is_symbol(value) else not simplify_number(value)


def select_value(test: Any, a: Callable[[], Any], b: Callable[[], Any], code_part: Any) -> Any:
    """Return ``a() if test else b()``.

    Args:
        test: condition.
        a: function for the value if the test holds.
        b: function for the value otherwise.
        code_part: part of the code, for messages and identity.
    """
    if not is_symbol(test):
        return a() if simplify_number(test) else b()
    with restrict_condition(test):
        true_value = a()
    with restrict_condition(casadi.logic_not(test)):
        false_value = b()
    return merge_values(test, true_value, false_value, code_part)


def is_zero(value: Any) -> bool:
    """Return whether a number is 0 for all values of the symbols."""
    return not is_symbol(value) and simplify_number(value) == 0.0


def minimum_of(*values: Any) -> Any:
    """Return the minimum of numbers."""
    return _reduce_values(casadi.fmin, min, values)


def maximum_of(*values: Any) -> Any:
    """Return the maximum of numbers."""
    return _reduce_values(casadi.fmax, max, values)


def _reduce_values(symbolic: Any, numeric: Any, values: tuple[Any, ...]) -> Any:
    """Reduce numbers by a symbolic operation if one of them is a symbol, else by the numeric one.

    Returns:
        A symbol if one of the values is a symbol, else a number.
    """
    result, *other_values = map(simplify_number, values)
    for value in other_values:
        operation = symbolic if isinstance(result, SX) or isinstance(value, SX) else numeric
        result = operation(result, value)
    return result


def absolute_value(value: Any) -> Any:
    """Return the absolute value of a number."""
    return casadi.fabs(value) if is_symbol(value) else abs(simplify_number(value))


def truncate_number(value: Any) -> int:
    """Return the integer part of a number.

    Raises:
        NoFormula: the number depends on a symbol.
    """
    if is_symbol(value):
        raise NoFormula("an index into a table depends on the state")
    return int(simplify_number(value))


def square_root(value: Any) -> Any:
    """Return the square root of a number.

    Args:
        value: number; the derivative at 0, and at a square clamped at zero, is 0.
    """
    if not is_symbol(value):
        return math.sqrt(simplify_number(value))
    # max(x, 0) has the derivative 0 below 0, where sqrt would still divide by it.
    test = value > 0.0 if value.op() == casadi.OP_FMAX else value != 0.0
    with restrict_condition(test):
        return casadi.if_else(test, casadi.sqrt(guard_value(value)), 0.0)


def hypotenuse(*values: Any) -> Any:
    """Return the square root of the sum of squares."""
    if not any(map(is_symbol, values)):
        return math.hypot(*map(simplify_number, values))
    return square_root(sum(value * value for value in values))


def _make_counterpart(name: str, instead: float | None = None) -> Callable[..., Any]:
    """Return a function of `math` that takes symbols too.

    Args:
        name: name of the function.
        instead: argument that replaces inactive ones; None if the function is defined everywhere.
    """
    numeric = getattr(math, name)
    symbolic = getattr(casadi, name)

    def function(*values: Any) -> Any:
        if not any(map(is_symbol, values)):
            return numeric(*map(simplify_number, values))
        return symbolic(
            *(
                guard_value(v, instead) if instead is not None and is_symbol(v) else v
                for v in values
            )
        )

    return function


def sine_cosine(angle: Any) -> tuple[Any, Any]:
    """Return sine and cosine of an angle as functions, instead of the polynomials of `laws/rotations.py`.

    Args:
        angle: angle, rad.

    Returns:
        Sine, and cosine.
    """
    return COUNTERPARTS[math.sin](angle), COUNTERPARTS[math.cos](angle)


COUNTERPARTS: dict[Any, Any] = {
    min: minimum_of,
    max: maximum_of,
    abs: absolute_value,
    int: truncate_number,
    float: lambda value: value if is_symbol(value) else float(simplify_number(value)),
    bool: lambda value: value if is_symbol(value) else bool(simplify_number(value)),
    math.sqrt: square_root,
    math.hypot: hypotenuse,
    math.isnan: lambda value: False if is_symbol(value) else math.isnan(simplify_number(value)),
    math.isfinite: lambda value: (
        True if is_symbol(value) else math.isfinite(simplify_number(value))
    ),
}
"""Functions that replace Python's built-in and mathematical functions on symbols."""
# Functions that are defined everywhere need no guard; the others get a harmless argument on the
# inactive side of a branch.
for _name in ("sin", "cos", "tan", "atan", "tanh", "floor", "ceil", "erf", "copysign"):
    COUNTERPARTS[getattr(math, _name)] = _make_counterpart(_name)
for _name in ("exp", "expm1", "sinh", "cosh", "asin", "acos"):
    COUNTERPARTS[getattr(math, _name)] = _make_counterpart(_name, 0.0)
for _name in ("log", "log1p", "atan2"):
    COUNTERPARTS[getattr(math, _name)] = _make_counterpart(_name, 1.0)
COUNTERPARTS[math.erfc] = lambda value: (
    1.0 - COUNTERPARTS[math.erf](value) if is_symbol(value) else math.erfc(value)
)
