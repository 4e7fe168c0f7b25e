"""Functions of which a kernel consists, and a digest of their code.

A kernel consists of its own function and of all functions of this package that it calls. Two states
of the sources that compile to the same code have the same digest: comments, docstrings and line
numbers do not count. Every version of Python computes the same digest, because one compiled library
serves them all.
"""

from __future__ import annotations

import ast
import hashlib
import inspect
from collections.abc import Iterator
from functools import cache
from operator import itemgetter
from textwrap import dedent
from types import FunctionType
from typing import Any

from osimlite.base.syntax_trees import parse_module
from osimlite.mechanics.kernels.layout import Record


@cache
def compute_digest(function: Any, settings: str = "") -> str:
    """Return a digest of a kernel.

    It changes with the code of the function, of anything that it calls, and with the settings.

    Args:
        function: the kernel.
        settings: everything else that determines what the function is compiled to.

    Returns:
        The first 16 hexadecimal digits of a SHA-256.
    """
    descriptions = [
        settings,
        *(_describe_function(callee) for callee in collect_functions(function)),
    ]
    return hashlib.sha256(repr(descriptions).encode()).hexdigest()[:16]


def collect_functions(function: Any) -> Iterator[FunctionType]:
    """Yield a function and all functions of this package that it calls, each once.

    Calls may be direct or indirect.

    Functions that are called by their address are not included: they are kernels of their own.
    """
    pending = [function]
    visited = set()
    while pending:
        current = pending.pop()
        if current in visited:
            continue
        visited.add(current)
        yield current
        pending += [value for _, value in _global_values(current) if _is_local(value)]


def _describe_function(function: FunctionType) -> tuple[Any, ...]:
    """Return everything of one function that determines what it is compiled to.

    Returns:
        Name and text of the function, and the values of the global names in it.
    """
    # Sorted, because the order of names differs between versions of Python.
    values = [
        (name, value.__qualname__ if _is_local(value) else _describe_value(value))
        for name, value in sorted(_global_values(function), key=itemgetter(0))
    ]
    return function.__qualname__, _normalize_source(function), values


@cache
def _normalize_source(function: FunctionType) -> str:
    """Return the text of a function without comments and docstring, in one layout."""
    (tree,) = parse_module(dedent(inspect.getsource(function))).body
    assert isinstance(tree, ast.FunctionDef)
    if ast.get_docstring(tree, clean=False) is not None:
        del tree.body[0]
    return ast.unparse(tree)


def _global_values(function: FunctionType) -> list[tuple[str, Any]]:
    """Return the global names that a function uses, with their values."""
    scope = function.__globals__
    return [
        (name, scope[name]) for name in dict.fromkeys(function.__code__.co_names) if name in scope
    ]


def _is_local(value: object) -> bool:
    """Return whether a value is a function of this package."""
    return isinstance(value, FunctionType) and value.__module__.startswith("osimlite.")


def _describe_value(value: Any) -> Any:
    """Return the part of a global value on which compiled code depends.

    It is equal in every process.
    """
    if isinstance(value, Record):
        return value.__qualname__, {
            name: number for name, number in vars(value).items() if name.isupper()
        }
    if isinstance(value, type):
        return (
            value.__qualname__,
            getattr(value, "_fields", ()),
            getattr(value, "_field_defaults", {}),
        )
    if isinstance(value, int | float | str | tuple):
        return value
    return getattr(value, "__qualname__", type(value).__name__)
