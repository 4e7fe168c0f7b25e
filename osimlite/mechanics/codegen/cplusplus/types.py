"""Types of values in the C++ of kernels.

Kernels have no reliable type declarations: their types follow from those of the arguments. Every
type is therefore an object that the inference compares, joins and passes on. Equal types are the
same object.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import FunctionType
from typing import Any


class Type:
    """Type of a value; see the subclasses."""

    __slots__ = ()


class Scalar(Type):
    """Number type without derivatives, or `void`.

    Attributes:
        name: the name in C++.
        rank: position in the order in which Python's arithmetic widens numbers.
    """

    __slots__ = "name", "rank"

    def __init__(self, name: str, rank: int) -> None:
        self.name = name
        self.rank = rank

    def __repr__(self) -> str:
        return self.name


BOOLEAN = Scalar("bool", 0)
"""Type of truth values."""
INTEGER = Scalar("int64_t", 1)
"""Type of integers."""
FLOAT = Scalar("double", 2)
"""Type of floats."""
VOID = Scalar("void", -1)
"""Type of functions without a result."""


class Dual(Type):
    """Number with derivatives along a fixed number of directions."""

    __slots__ = ("directions",)

    def __init__(self, directions: int) -> None:
        self.directions = directions

    def __repr__(self) -> str:
        return f"Dual<{self.directions}>"


class Pointer(Type):
    """Vector of numbers, represented by the address of its first one."""

    __slots__ = ("element",)

    def __init__(self, element: Type) -> None:
        self.element = element

    def __repr__(self) -> str:
        return f"{self.element!r}*"


class Tuple(Type):
    """Tuple, or instance of a class of named tuples.

    Attributes:
        parts: types of the items.
        record: the class of named tuples, None for a plain tuple.
    """

    __slots__ = "parts", "record"

    def __init__(self, parts: tuple[Type, ...], record: Any) -> None:
        self.parts = parts
        self.record = record

    def __repr__(self) -> str:
        name = self.record.__name__ if self.record else "tuple"
        return f"{name}({', '.join(map(repr, self.parts))})"

    @property
    def is_array(self) -> bool:
        """Tell whether the type is a plain tuple whose items have one type."""
        return self.record is None and len({*self.parts}) == 1


class Callee(Type):
    """Function that is passed as an argument; each one makes a specialisation of its own."""

    __slots__ = ("function",)

    def __init__(self, function: FunctionType) -> None:
        self.function = function

    def __repr__(self) -> str:
        return f"function {self.function.__name__}"


dual = cache(Dual)
"""Return the type of numbers with some derivatives."""
pointer_to = cache(Pointer)
"""Return the type of vectors of some numbers."""
callee = cache(Callee)
"""Return the type of a function as an argument."""


@cache
# The cache makes equal types the same object.
def _make_tuple(parts: tuple[Type, ...], record: Any) -> Tuple:
    return Tuple(parts, record)


def tuple_of(parts: Sequence[Type], record: Any = None) -> Tuple:
    """Return the type of a tuple.

    Args:
        parts: types of the items.
        record: the class of named tuples that it is an instance of, None for a plain tuple.
    """
    return _make_tuple(tuple(parts), record)


def is_integral(kind: Type | None) -> bool:
    """Return whether a type has integers or truth values as its values."""
    return kind is INTEGER or kind is BOOLEAN


def is_plain_number(kind: Type | None) -> bool:
    """Return whether a type is a number without derivatives."""
    return kind is FLOAT or is_integral(kind)


def is_number(kind: Type | None) -> bool:
    """Return whether a type is a number, with derivatives or without."""
    return is_plain_number(kind) or isinstance(kind, Dual)


def join_types(one: Type | None, two: Type | None) -> Type | None:
    """Return the type that holds the values of two types.

    None stands for a type that is not known yet.

    Args:
        one: first type.
        two: second type.

    Raises:
        TypeError: no type holds both.
    """
    if one is two or two is None:
        return one
    if one is None:
        return two
    if isinstance(one, Scalar) and isinstance(two, Scalar) and VOID not in (one, two):
        return one if one.rank > two.rank else two
    if isinstance(one, Dual) and is_plain_number(two):
        return one
    if isinstance(two, Dual) and is_plain_number(one):
        return two
    if isinstance(one, Tuple) and isinstance(two, Tuple) and len(one.parts) == len(two.parts):
        parts = [join_types(a, b) for a, b in zip(one.parts, two.parts, strict=True)]
        # A plain tuple may be stored where a named one is expected, but not one of another class.
        if one.record is None or two.record is None or one.record is two.record:
            return tuple_of([part for part in parts if part is not None], one.record or two.record)
    raise TypeError(f"a value that is sometimes {one!r} and sometimes {two!r}")


def type_of_constant(value: Any) -> Type | None:
    """Return the type of a constant; None if constants of its kind are not supported."""
    if isinstance(value, bool):
        return BOOLEAN
    if isinstance(value, int):
        # Integers of more than 64 bits do not exist in C++.
        return INTEGER if -(2**63) < value < 2**63 else None
    if isinstance(value, float):
        return FLOAT
    if isinstance(value, FunctionType):
        return callee(value)
    if isinstance(value, tuple):
        parts = [type_of_constant(part) for part in value]
        part_types = [part for part in parts if part is not None and not isinstance(part, Callee)]
        record = type(value) if type(value) is not tuple else None
        return tuple_of(part_types, record) if len(part_types) == len(parts) else None
    return None
