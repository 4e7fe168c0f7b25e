"""Named tuples from JSON, with every value checked against its annotation."""

from __future__ import annotations

import json
from functools import cache
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

T = TypeVar("T")


def parse_record(kind: type[T], text: bytes) -> T:
    """Return the named tuple that a text contains, as ``json.dumps`` writes it.

    Args:
        kind: class of the named tuple. Its values may be numbers, switches, texts, named tuples, and
            lists, tuples and dictionaries of those.
        text: JSON; NaN and Infinity are numbers.

    Raises:
        ValueError: the text is not JSON, or a value does not fit its annotation.
    """
    result: T = _convert(kind, json.loads(text))
    return result


def _convert(kind: Any, value: Any) -> Any:
    """Return a JSON value in the type of an annotation.

    Raises:
        ValueError: the value does not fit the annotation.
    """
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is dict and isinstance(value, dict):
        return {name: _convert(arguments[1], item) for name, item in value.items()}
    if isinstance(value, list):
        if origin is list or (origin is tuple and arguments[1:] == (...,)):
            return origin(_convert(arguments[0], item) for item in value)
        if origin is tuple and len(arguments) == len(value):
            return tuple(map(_convert, arguments, value))
        if hasattr(kind, "_fields") and len(kind._fields) == len(value):
            return kind(*map(_convert, _get_types(kind), value))
    if type(value) is kind:
        return value
    if kind is float and type(value) is int:
        return float(value)
    raise ValueError(f"expected {kind}, got {value!r}")


@cache
def _get_types(kind: type) -> list[Any]:
    return list(get_type_hints(kind).values())
