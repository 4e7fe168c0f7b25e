"""Operators, names and numbers of C++: how Python's are spelled there, and how closely they bind.

A text of C++ carries the precedence of its outermost operator, so that parentheses are written only
where C++ needs them. Operators whose meaning differs from Python's are functions of the header.
"""

from __future__ import annotations

import ast
import math
from typing import Any, Protocol

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.codegen.cplusplus.inference import Specialisation
from osimlite.mechanics.codegen.cplusplus.types import (
    Type,
)

PRIMARY = 13
"""Precedence of C++ expressions without an operator; a higher number binds more closely."""
UNARY = 12
"""Precedence of signs and of `!`."""
PRODUCT = 11
"""Precedence of `*` and `/`."""
SUM = 10
"""Precedence of `+` and `-`."""
SHIFT = 9
"""Precedence of `<<` and `>>`."""
ORDER = 8
"""Precedence of `<`, `<=`, `>` and `>=`."""
EQUALITY = 7
"""Precedence of `==` and `!=`."""
BIT_AND = 6
"""Precedence of `&`, which in Python binds more closely than comparisons."""
BIT_XOR = 5
"""Precedence of `^`."""
BIT_OR = 4
"""Precedence of `|`."""
AND = 3
"""Precedence of `&&`."""
OR = 2
"""Precedence of `||`."""
CHOICE = 1
"""Precedence of `?:`."""

OPERATORS: dict[type[ast.operator], tuple[str, int]] = {
    ast.Mult: ("*", PRODUCT),
    ast.Div: ("/", PRODUCT),
    ast.Add: ("+", SUM),
    ast.Sub: ("-", SUM),
    ast.RShift: (">>", SHIFT),
    ast.BitAnd: ("&", BIT_AND),
    ast.BitXor: ("^", BIT_XOR),
    ast.BitOr: ("|", BIT_OR),
}
"""Signs of operators that C++ has with the same meaning, with their precedences."""
FUNCTIONS: dict[type[ast.operator], str] = {
    ast.FloorDiv: "floor_divide",
    ast.Mod: "modulo",
    ast.Pow: "power",
    ast.LShift: "shift_left",
}
"""Functions of the header for operators that differ in C++ or do not exist there."""
COMPARISONS: dict[type[ast.cmpop], tuple[str, int]] = {
    ast.Lt: ("<", ORDER),
    ast.LtE: ("<=", ORDER),
    ast.Gt: (">", ORDER),
    ast.GtE: (">=", ORDER),
    ast.Eq: ("==", EQUALITY),
    ast.NotEq: ("!=", EQUALITY),
}
"""Signs of comparisons with their precedences."""

RESERVED = frozenset((
    "alignas", "alignof", "and_eq", "asm", "assert", "auto", "bitand", "bitor", "bool", "case", "catch", "char",
    "compl", "concept", "const", "const_cast", "constexpr", "decltype", "default", "delete", "do", "double",
    "dynamic_cast", "enum", "errno", "explicit", "export", "extern", "false", "float", "friend", "goto", "inline",
    "int", "int64_t", "linux", "long", "mutable", "namespace", "new", "noexcept", "not_eq", "nullptr", "operator",
    "or_eq", "private", "protected", "public", "py", "register", "reinterpret_cast", "requires", "short", "signed",
    "sizeof", "static", "static_assert", "static_cast", "std", "struct", "switch", "template", "this", "thread_local",
    "throw", "true", "typedef", "typeid", "typename", "uint64_t", "union", "unix", "unsigned", "using", "virtual",
    "void", "volatile", "wchar_t", "xor", "xor_eq", "Array", "Dual", "INFINITY", "NAN",
))  # fmt: skip
"""Names that a kernel may use, but that mean something else in C++ or in the header."""


class ExpressionText(NamedTuple):
    """Text of an expression, and the precedence of its outermost operator."""

    text: str
    precedence: int = PRIMARY


def escape_name(name: str) -> str:
    """Return a name with a trailing underscore if it means something else in C++."""
    return f"{name}_" if name in RESERVED else name


def write_number(value: bool | int | float) -> str:
    """Return the text of a number, which C++ reads as the same number."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0.0 else "-INFINITY"
    # repr() gives the shortest text that is read as the same number.
    return repr(value)


def right_of(node: ast.AST) -> ast.expr | None:
    """Return the right operand of an operation or an augmented assignment, None for other nodes."""
    match node:
        case ast.BinOp(right=operand) | ast.AugAssign(value=operand):
            return operand
    return None


def is_simple(node: ast.expr) -> bool:
    """Return whether an expression costs nothing to evaluate again."""
    return isinstance(node, ast.Name | ast.Constant) or (
        isinstance(node, ast.UnaryOp) and isinstance(node.operand, ast.Constant)
    )


class Names(Protocol):
    """Interface of the library that names types, functions and constants."""

    def name_type(self, kind: Type) -> str:
        """Return the name of a type, after defining it if necessary."""

    def name_function(self, function: Specialisation) -> str:
        """Return the name of a function, after writing it if necessary."""

    def name_constant(self, name: str, value: tuple[Any, ...]) -> str:
        """Return the name of a constant tuple, after defining it if necessary.

        Args:
            name: name in Python.
            value: the tuple.
        """
