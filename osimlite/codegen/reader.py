"""The Python that kernels and laws are written in: functions of floats, integers, vectors and tuples of these.

A writer of another language starts from a `Kernel`, which has the text of one function and knows what the names in it
stand for. It meets a few kinds of statements and expressions only; what else there is, is an error that names it.
"""

from __future__ import annotations

import ast
import builtins
import inspect
from collections.abc import Callable
from functools import cached_property
from textwrap import dedent
from typing import Any

from osimlite.kernels.layout import Record

Function = Callable[..., Any]


class Kernel:
    """One function as a writer sees it.

    Args:
        function: of ours.
        language: that it is to become, for messages.

    Attributes:
        function: as given.
        tree: of its text.
        body: its statements without the docstring.
        given: names of its arguments.
    """

    def __init__(self, function: Function, language: str) -> None:
        (tree,) = ast.parse(dedent(inspect.getsource(function))).body
        assert isinstance(tree, ast.FunctionDef)
        self.function, self.tree, self.language = function, tree, language
        self.body = tree.body[1:] if ast.get_docstring(tree) else tree.body
        self.given = [argument.arg for argument in tree.args.args]

    @cached_property
    def own(self) -> list[str]:
        """Names of its other variables, in the order of their first appearance."""
        return [name for name in stored(self.tree) if name not in self.given]

    @property
    def name(self) -> str:
        """Of the function among those of all modules."""
        return name_of(self.function)

    def value(self, node: ast.expr) -> Any:
        """What a name means in the module of the function, or a field of a record there; None if nothing."""
        if isinstance(node, ast.Attribute):
            record = self.value(node.value)
            return getattr(record, node.attr) if isinstance(record, Record) else None
        name = node.id if isinstance(node, ast.Name) else ""
        scope = self.function.__globals__
        return scope[name] if name in scope else getattr(builtins, name, None)

    def unknown(self, node: ast.AST) -> NotImplementedError:
        """The error for what the language has not."""
        return NotImplementedError(f"{self.name} has what is no {self.language} here: {ast.unparse(node)}")


def name_of(function: Function) -> str:
    """Of a function among those of all modules."""
    return f"{function.__module__.rpartition('.')[2]}_{function.__name__}"


def stored(*trees: ast.AST) -> list[str]:
    """Names of the variables that some code sets, each once."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    return list(dict.fromkeys(n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)))
