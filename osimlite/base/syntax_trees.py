"""Syntax trees of Python source, in processes with threads and finalizers.

CPython 3.11 counts the depth of the conversion to a tree once per interpreter. If the garbage
collector runs in the middle and lets another thread, or a finalizer, parse as well, the outer call
raises a SystemError ("AST constructor recursion depth mismatch"; CPython issue 106905).
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from threading import RLock
from typing import TypeVar

MAX_ATTEMPTS = 10
"""Attempts to parse before the error of CPython is raised: each one fails on its own only."""

_Tree = TypeVar("_Tree", ast.Module, ast.Expression)
_lock = RLock()


def parse_module(text: str) -> ast.Module:
    """Return the syntax tree of a module.

    Raises:
        SyntaxError: the text is not Python.
    """
    return _parse_with_retries(lambda: ast.parse(text))


def parse_expression(text: str) -> ast.Expression:
    """Return the syntax tree of one expression.

    Raises:
        SyntaxError: the text is not an expression of Python, or nests too deeply.
    """
    try:
        return _parse_with_retries(lambda: ast.parse(text, mode="eval"))
    except (RecursionError, MemoryError):
        raise SyntaxError("the expression nests too deeply") from None


def _parse_with_retries(parse: Callable[[], _Tree]) -> _Tree:
    """Return the result of `parse`, one thread at a time, again if it was disturbed."""
    for _ in range(MAX_ATTEMPTS - 1):
        try:
            with _lock:
                return parse()
        except SystemError:
            continue
    return parse()
