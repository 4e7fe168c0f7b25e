"""Restricted Python in which kernels and laws are written.

They are functions of floats, integers, vectors and tuples of these. A writer of another language
starts from a `Kernel`, which has the syntax tree of one function and resolves the names in it. It
supports a few kinds of statements and expressions; any other is an error that quotes it.
"""

from __future__ import annotations

import ast
import builtins
import linecache
from collections.abc import Callable
from functools import cached_property
from types import ModuleType
from typing import Any, TypeVar

from osimlite.base.syntax_trees import parse_module
from osimlite.errors import UnsupportedError
from osimlite.mechanics.kernels.layout import Record

Function = Callable[..., Any]
"""Function of the package."""


class TranslationError(UnsupportedError, NotImplementedError):
    """Error of a kernel that uses something without a counterpart in the language of a writer."""


class Kernel:
    """Function of the package as the writers of C++ and JavaScript see it.

    Attributes:
        function: function of the package.
        tree: syntax tree of the function.
        body: statements of the function without the docstring.
        argument_names: names of the arguments of the function.

    Args:
        function: function of the package.
        language: language that it is translated to, for messages.
    """

    def __init__(self, function: Function, language: str) -> None:
        tree = self.parse(function)
        self.function, self.tree, self.language = function, tree, language
        self.body = tree.body[1:] if ast.get_docstring(tree) else tree.body
        self.argument_names = [argument.arg for argument in tree.args.args]

    def parse(self, function: Function) -> ast.FunctionDef:
        """Return the syntax tree of a function, which all kernels of the function share."""
        return find_tree(function)

    @cached_property
    def local_names(self) -> list[str]:
        """Names of its local variables besides arguments, by their first appearance."""
        return [name for name in list_assigned_names(self.tree) if name not in self.argument_names]

    @property
    def name(self) -> str:
        """Name of the function that is unique among all modules."""
        return name_of(self.function)

    def value(self, node: ast.expr) -> Any:
        """Return the value of a global name, or of an attribute of a record or module.

        A name without a value there, as of a local variable, gives None.
        """
        if isinstance(node, ast.Attribute):
            owner = (
                self.value(node.value) if isinstance(node.value, ast.Name | ast.Attribute) else None
            )
            return (
                getattr(owner, node.attr, None) if isinstance(owner, Record | ModuleType) else None
            )
        name = node.id if isinstance(node, ast.Name) else ""
        scope = self.function.__globals__
        return scope[name] if name in scope else getattr(builtins, name, None)

    @property
    def file(self) -> str:
        """Path of the file of its source."""
        return self.function.__code__.co_filename

    def line_of(self, node: ast.AST) -> int:
        """Return the line of a part of the function in its file."""
        return getattr(node, "lineno", self.tree.lineno)

    def refuse(self, node: ast.AST, reason: str = "") -> TranslationError:
        """Return the error for a part of the function without a counterpart in the language.

        Args:
            node: syntax tree of the part.
            reason: clause that explains the error; empty if the language has nothing like this
                part.
        """
        text = " ".join(ast.unparse(node).split())
        text = text if len(text) <= LONGEST_QUOTE else f"{text[:LONGEST_QUOTE]}..."
        message = f"the function '{self.name}' cannot be written as {self.language}: {text}"
        message += f" ({reason})" if reason else " is not supported"
        return TranslationError(message, file=self.file, line=self.line_of(node))


_parsed: dict[str, tuple[list[str], dict[tuple[int, str], ast.FunctionDef]]] = {}
"""Lines of each file, and its functions by their first line and name."""


def find_tree(function: Function) -> ast.FunctionDef:
    """Return the syntax tree of a function from its file.

    Raises:
        OSError: the file does not exist, or does not contain the function any more.
    """
    file = function.__code__.co_filename
    # A file that has changed since the import must not be translated by old line numbers.
    linecache.checkcache(file)
    lines = linecache.getlines(file, function.__globals__)
    # linecache returns the same list until the file changes.
    if file not in _parsed or _parsed[file][0] is not lines:
        trees = list_functions(parse_module("".join(lines)))
        starts = [
            min([tree.lineno, *(decorator.lineno for decorator in tree.decorator_list)])
            for tree in trees
        ]
        tree_of_key = {(start, tree.name): tree for start, tree in zip(starts, trees, strict=True)}
        _parsed[file] = lines, tree_of_key
    key = function.__code__.co_firstlineno, function.__code__.co_name
    if key not in _parsed[file][1]:
        raise OSError(
            f"{file} has no function {key[1]} in line {key[0]}: it has changed, or its text is not kept"
        )
    return _parsed[file][1][key]


def list_functions(tree: ast.AST) -> list[ast.FunctionDef]:
    """Return the functions in a module, without descending into expressions as `ast.walk` does."""
    result = list[ast.FunctionDef]()
    pending = [tree]
    while pending:
        node = pending.pop()
        if isinstance(node, ast.FunctionDef):
            result.append(node)
        for field in ("body", "orelse", "handlers", "finalbody", "cases"):
            inner = getattr(node, field, ())
            pending += inner if isinstance(inner, list) else ()
    return result


Node = TypeVar("Node", bound=ast.AST)


def copy_tree(node: Node) -> Node:
    """Return a copy of a tree that shares nodes without parts, such as operators.

    It is ten times as fast as `copy.deepcopy`, which takes a tenth of the time of a small study.
    """
    result = type(node).__new__(type(node))
    state = vars(result)
    for name, value in vars(node).items():
        if isinstance(value, ast.AST):
            state[name] = copy_tree(value) if value._fields else value
        elif isinstance(value, list):
            state[name] = [copy_tree(item) if isinstance(item, ast.AST) else item for item in value]
        else:
            state[name] = value
    return result


LONGEST_QUOTE = 100
"""Largest number of characters of code that an error message quotes."""


def name_of(function: Function) -> str:
    """Return a name of a function that is unique among all modules.

    Modules of kernels have different names, whatever their packages.
    """
    return f"{function.__module__.rpartition('.')[2]}_{function.__name__}"


def list_assigned_names(*trees: ast.AST) -> list[str]:
    """Return the names of the variables that some code assigns, each once."""
    nodes = (node for tree in trees for node in ast.walk(tree))
    return list(
        dict.fromkeys(
            n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
        )
    )
