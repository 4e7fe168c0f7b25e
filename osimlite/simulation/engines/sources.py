"""What a compiled function is made of: its own code, and that of all of ours that it calls.

Two states of the sources that would be compiled to the same have the same digest: comments, docstrings and places of
lines do not count.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

from osimlite.kernels.layout import Record


@cache
def digest_of(function: Any) -> str:
    """What tells whether a function, anything that it calls, or the settings of the compiler have changed."""
    parts = [_settings(), *(_told(part) for part in functions_within(function))]
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


def functions_within(function: Any) -> Iterator[FunctionType]:
    """A function and all of ours that it calls, and those that these call, each once.

    What is called by its address is not among them: it is compiled by itself.
    """
    pending, seen = [function], set()
    while pending:
        result = pending.pop()
        if result in seen:
            continue
        seen.add(result)
        yield result
        pending += [value for _, value in _named(result) if _is_ours(value)]


def _told(function: FunctionType) -> tuple[Any, ...]:
    """All of a function that decides what it is compiled to."""
    values = [(name, value.__qualname__ if _is_ours(value) else _constant(value)) for name, value in _named(function)]
    return function.__qualname__, function.__annotations__, function.__defaults__, _code(function), values


def _code(function: FunctionType) -> tuple[Any, ...]:
    code = function.__code__
    constants = [item.co_code if isinstance(item, CodeType) else item for item in code.co_consts]
    if function.__doc__ is not None and constants[0] == function.__doc__:
        constants[0] = None
    return code.co_code, constants, code.co_names, code.co_varnames


def _named(function: FunctionType) -> list[tuple[str, Any]]:
    """What the names in a function stand for in its module."""
    scope = function.__globals__
    return [(name, scope[name]) for name in function.__code__.co_names if name in scope]


def _is_ours(value: object) -> bool:
    return isinstance(value, FunctionType) and value.__module__.startswith("osimlite.")


def _constant(value: Any) -> Any:
    """What a value is in another process too: compiled code holds numbers, and knows the fields of classes."""
    if isinstance(value, Record):
        return value.__qualname__, {name: number for name, number in vars(value).items() if name.isupper()}
    if isinstance(value, type):
        return value.__qualname__, getattr(value, "_fields", ()), getattr(value, "__annotations__", {})
    if isinstance(value, int | float | str | tuple):
        return value
    return getattr(value, "__qualname__", type(value).__name__)


@cache
def _settings() -> str:
    """How the compiler is set."""
    here = Path(__file__)
    return hashlib.sha256(b"\0".join((here.with_name(name)).read_bytes() for name in SETTINGS)).hexdigest()


SETTINGS = ("carrying.py", "compiler.py", "object_code.py", "tangents.py")
"""The modules that set the compiler."""
