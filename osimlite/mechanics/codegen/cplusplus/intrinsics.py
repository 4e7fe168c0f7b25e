"""Functions that kernels call and that are not kernels themselves.

These are Python's own, those of `math`, and the operations on vectors and dual numbers. Each has a
rule for its type and one for its text. Their C++ is in the header `kernel_runtime.h`.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.codegen.cplusplus.types import (
    BOOLEAN,
    FLOAT,
    INTEGER,
    Dual,
    Pointer,
    Scalar,
    Type,
    dual,
    is_integral,
    is_number,
    join_types,
    pointer_to,
)
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.laws import dual_numbers


class Reader(Protocol):
    """Interface of the inference for the rules."""

    def constant_index(self, node: ast.expr) -> int | None:
        """Return the value of an integer constant, None for any other expression."""


Nodes = Sequence[ast.expr]
Types = Sequence[Type]


class Intrinsic(NamedTuple):
    """Rules of a function that is not a kernel.

    Attributes:
        infer: function that returns the type of the result from the arguments and their types; it
            raises a TypeError for wrong arguments.
        write: function that returns the text from those of the arguments, their types, and the type
            of the result.
        early: type of the result while types of arguments are not known yet, if it depends on none.
        has_effects: whether it may read and write memory.
    """

    infer: Callable[[Reader, Nodes, Types], Type]
    write: Callable[[Sequence[str], Types, Type], str]
    early: Type | None = None
    has_effects: bool = False


def _check_numbers(kinds: Types, least: int, most: int) -> None:
    if not least <= len(kinds) <= most:
        raise TypeError(f"called with {len(kinds)} arguments")
    for kind in kinds:
        if not is_number(kind):
            raise TypeError(f"{kind!r} is no number")


def cast_to(code: str, have: Type, want: Type) -> str:
    """Return the text of a number as one of another type.

    Args:
        code: text of the number.
        have: type of the number.
        want: type that is needed.
    """
    if have is want:
        return code
    return f"static_cast<{want!r}>({code})" if isinstance(want, Scalar) else f"{want!r}({code})"


def _dual_or_float(kinds: Types) -> Type:
    return next((kind for kind in kinds if isinstance(kind, Dual)), FLOAT)


def _convert_to_floats(codes: Sequence[str], kinds: Types) -> list[str]:
    """Return the texts of numbers with integers as floats.

    Args:
        codes: texts of the numbers.
        kinds: types of the numbers.

    Returns:
        Texts of floats and dual numbers.
    """
    return [
        cast_to(code, kind, FLOAT) if is_integral(kind) else code
        for code, kind in zip(codes, kinds, strict=True)
    ]


# ------------------------------------------------------------------------------------------------- families
def _mathematics(name: str, count: int) -> Intrinsic:
    """Return the rules of a function of `math`, whose result is a float or dual number.

    Args:
        name: name of the function in the header.
        count: number of arguments.
    """

    def infer(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
        _check_numbers(kinds, count, count)
        return _dual_or_float(kinds)

    def write(codes: Sequence[str], kinds: Types, result: Type) -> str:
        return f"py::{name}({', '.join(_convert_to_floats(codes, kinds))})"

    return Intrinsic(infer, write)


def _declare_fixed_result(name: str, result: Type) -> Intrinsic:
    """Return the rules of a function of one number whose result always has the same type.

    Args:
        name: name of the function in the header.
        result: type of the result.
    """

    def infer(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
        _check_numbers(kinds, 1, 1)
        return result

    def write(codes: Sequence[str], kinds: Types, result: Type) -> str:
        return f"py::{name}({_convert_to_floats(codes, kinds)[0]})"

    return Intrinsic(infer, write, result)


def _extreme(name: str) -> Intrinsic:
    """Return the rules of `min` or `max` of two numbers or more.

    The C++ text compares in Python's order, on which the result for NaN depends.
    """

    def infer(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
        # No upper limit on the number of arguments.
        _check_numbers(kinds, 2, len(kinds) + 2)
        result: Type | None = None
        for kind in kinds:
            result = join_types(result, kind)
        assert result is not None
        return result

    def write(codes: Sequence[str], kinds: Types, result: Type) -> str:
        text = codes[0]
        for code in codes[1:]:
            # The template argument is explicit, as the arguments may have different types.
            text = f"py::{name}<{result!r}>({text}, {code})"
        return text

    return Intrinsic(infer, write)


# ------------------------------------------------------------------------------------------- Python's own
def _infer_integer(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 1, 1)
    return INTEGER


def _write_integer(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return (
        cast_to(codes[0], kinds[0], INTEGER)
        if is_integral(kinds[0])
        else f"py::to_integer({codes[0]})"
    )


def _write_rounded(name: str) -> Callable[[Sequence[str], Types, Type], str]:
    def write(codes: Sequence[str], kinds: Types, result: Type) -> str:
        if is_integral(kinds[0]):
            return cast_to(codes[0], kinds[0], INTEGER)
        return f"py::to_integer(py::{name}({codes[0]}))"

    return write


def _infer_float(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 1, 1)
    return _dual_or_float(kinds)


def _write_float(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return cast_to(codes[0], kinds[0], result)


def _infer_truth(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 1, 1)
    return BOOLEAN


def _write_truth(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return codes[0] if kinds[0] is BOOLEAN else f"({codes[0]} != 0)"


def _infer_magnitude(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 1, 1)
    return INTEGER if kinds[0] is BOOLEAN else kinds[0]


def _write_magnitude(codes: Sequence[str], kinds: Types, result: Type) -> str:
    # The overload for integers is no better match for a literal than that for floats.
    return (
        f"py::abs(static_cast<int64_t>({codes[0]}))"
        if is_integral(kinds[0])
        else f"py::abs({codes[0]})"
    )


# -------------------------------------------------------------------------------------------------- vectors
def _infer_offset(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    if len(kinds) != 2 or not isinstance(kinds[0], Pointer) or not is_integral(kinds[1]):
        raise TypeError("at() takes a vector and an integer")
    return kinds[0]


def _infer_call(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    if len(kinds) != 7 or not all(isinstance(kind, Pointer) for kind in kinds[1:6]):
        raise TypeError("call() takes an address, five vectors and an integer")
    return INTEGER


def _write_call(codes: Sequence[str], kinds: Types, result: Type) -> str:
    # A law is called by its address, with vectors and an integer; see `pointers.Law`.
    vectors = ", ".join(repr(kind) for kind in kinds[1:6])
    law = f"reinterpret_cast<int64_t (*)({vectors}, int64_t)>({codes[0]})"
    return f"{law}({', '.join(codes[1:])})"


# -------------------------------------------------------------------------------------- numbers with derivatives
def _constant(reader: Reader, node: ast.expr) -> int:
    value = reader.constant_index(node)
    if value is None:
        raise TypeError("it takes an integer constant")
    return value


def _infer_differentiate_root(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 3, 3)
    return _dual_or_float(kinds[:2])


def _write_differentiate_root(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return f"py::differentiate_root({', '.join(_convert_to_floats(codes, kinds))})"


def _infer_plain(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 1, 2)
    return FLOAT


def _write_plain(name: str) -> Callable[[Sequence[str], Types, Type], str]:
    return lambda codes, kinds, result: (
        f"py::{name}({', '.join([*_convert_to_floats(codes[:1], kinds[:1]), *codes[1:]])})"
    )


def _infer_seed_derivative(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    _check_numbers(kinds, 3, 3)
    if not 0 <= _constant(reader, nodes[1]) < _constant(reader, nodes[2]):
        raise TypeError("there is no such direction")
    return dual(_constant(reader, nodes[2]))


def _write_seed_derivative(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return f"{result!r}::along({_convert_to_floats(codes[:1], kinds[:1])[0]}, {codes[1]})"


def _infer_dual_workspace(reader: Reader, nodes: Nodes, kinds: Types) -> Type:
    if len(kinds) != 2 or not isinstance(kinds[0], Pointer) or kinds[0].element is not FLOAT:
        raise TypeError("it takes a vector of floats and an integer constant")
    return pointer_to(dual(_constant(reader, nodes[1])))


def _write_dual_workspace(codes: Sequence[str], kinds: Types, result: Type) -> str:
    return f"reinterpret_cast<{result!r}>({codes[0]})"


UNARY = (
    "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sinh", "cosh", "tanh", "erf", "erfc", "radians",
)  # fmt: skip
"""Functions of `math` of one number, by their names in Python and in the header."""

INTRINSICS: dict[Any, Intrinsic] = {
    **{getattr(math, name): _mathematics(name, 1) for name in UNARY},
    math.atan2: _mathematics("atan2", 2),
    math.copysign: _mathematics("copysign", 2),
    math.fabs: _mathematics("abs", 1),
    math.isnan: _declare_fixed_result("isnan", BOOLEAN),
    math.isfinite: _declare_fixed_result("isfinite", BOOLEAN),
    math.isinf: _declare_fixed_result("isinf", BOOLEAN),
    math.floor: Intrinsic(_infer_integer, _write_rounded("floor"), INTEGER),
    math.ceil: Intrinsic(_infer_integer, _write_rounded("ceil"), INTEGER),
    int: Intrinsic(_infer_integer, _write_integer, INTEGER),
    float: Intrinsic(_infer_float, _write_float),
    bool: Intrinsic(_infer_truth, _write_truth, BOOLEAN),
    abs: Intrinsic(_infer_magnitude, _write_magnitude),
    min: _extreme("min"),
    max: _extreme("max"),
    pointers.at: Intrinsic(
        _infer_offset, lambda codes, kinds, result: f"({codes[0]} + {codes[1]})"
    ),
    pointers.call: Intrinsic(_infer_call, _write_call, INTEGER, has_effects=True),
    dual_numbers.differentiate_root: Intrinsic(
        _infer_differentiate_root, _write_differentiate_root
    ),
    dual_numbers.is_exact_zero: _declare_fixed_result("is_exact_zero", BOOLEAN),
    dual_numbers.strip_derivatives: Intrinsic(
        _infer_plain, _write_plain("strip_derivatives"), FLOAT
    ),
    dual_numbers.get_derivative: Intrinsic(_infer_plain, _write_plain("get_derivative"), FLOAT),
    dual_numbers.seed_derivative: Intrinsic(_infer_seed_derivative, _write_seed_derivative),
    dual_numbers.make_dual_workspace: Intrinsic(_infer_dual_workspace, _write_dual_workspace),
}
"""Rules of each function that is not a kernel."""
