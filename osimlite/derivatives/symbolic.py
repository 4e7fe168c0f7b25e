"""Kernels as Python that runs on symbols: the same text, in which what branches does so by `ways`."""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from osimlite.derivatives import symbols, ways
from osimlite.derivatives.curves import (
    curve_value_on_symbols,
    damped_velocity_on_symbols,
    pieces_on_symbols,
)
from osimlite.derivatives.symbols import COUNTERPARTS, UNSET, NoFormula, Vector
from osimlite.mechanics.codegen.reader import Function, Kernel, copy_tree, name_of, stored
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.functions import pieces_at
from osimlite.mechanics.laws.bezier import curve_value
from osimlite.mechanics.laws.dual_numbers import is_nothing
from osimlite.mechanics.laws.millard2012_equilibrium import damped_velocity
from osimlite.mechanics.laws.rotations import sine_cosine

HELP = {
    "plus_": symbols.plus,
    "minus_": symbols.minus,
    "times_": symbols.times,
    "divide_": symbols.divide,
    "power_": symbols.power,
    "both_": symbols.both,
    "either_": symbols.either,
    "negated_": symbols.negated,
    "choose_": symbols.choose,
    "branch_": ways.Branch,
    "decide_": ways.decide,
    "fails_": ways.fails,
    "unset_": UNSET,
}
"""What the rewritten text calls."""

LEAVING = ast.Return, ast.Break, ast.Continue
SIGNS: dict[type, str] = {
    ast.Add: "plus_",
    ast.Sub: "minus_",
    ast.Mult: "times_",
    ast.Div: "divide_",
    ast.Pow: "power_",
}


def _at(vector: Any, place: int) -> Any:
    return vector.rest(place) if isinstance(vector, Vector) else vector[place:]


def _call(address: int, *given: Any) -> int:
    law = pointers.laws[address]
    try:
        result: int = ways.in_ways(f"the law {name_of(law)}", on_symbols(law), *given)
    except NoFormula as error:
        error.items.append(given[-1])
        raise
    return result


_known: dict[Any, Any] = {
    pointers.at: _at,
    pointers.call: _call,
    sine_cosine: symbols.sine_cosine,
    is_nothing: symbols.is_nothing,
    curve_value: curve_value_on_symbols,
    damped_velocity: damped_velocity_on_symbols,
    pieces_at: pieces_on_symbols,
}
"""The counterparts of functions that have been asked for."""


def on_symbols(function: Any) -> Any:
    """A kernel or a law as a function that takes symbols too.

    Raises:
        NotImplementedError: there is something in it that has no meaning for symbols.
    """
    if function not in _known:
        writer = _Writer(function, "formula")
        made = writer.made()
        _known[function] = made
    return _known[function]


@contextmanager
def standing_in(function: Any, twin: Any) -> Iterator[None]:
    """While this is open, another function is called on symbols in the place of a kernel."""
    before = on_symbols(function)
    _known[function] = twin
    try:
        yield
    finally:
        _known[function] = before


def taken(function: Any) -> Any:
    """A function that takes symbols as it is, known as such from then on."""
    _known[function] = function
    return function


class _Scope(dict[str, Any]):
    """The names of a module, each with its counterpart; these are made when they are first asked for."""

    def __init__(self, function: Any) -> None:
        super().__init__(HELP, __builtins__=builtins)
        for name in function.__code__.co_names:
            value = function.__globals__.get(name, getattr(builtins, name, None))
            if _is_ours(value):
                self[name] = _Later(value)
            elif (isinstance(value, type) and value not in COUNTERPARTS) or not callable(value):
                self[name] = value
            else:
                self[name] = COUNTERPARTS.get(value, value)


class _Later:
    """A function of ours that is written when it is first called."""

    def __init__(self, function: Any) -> None:
        self.function = function

    def __call__(self, *given: Any) -> Any:
        return on_symbols(self.function)(*given)


def _is_ours(value: Any) -> bool:
    return isinstance(value, FunctionType) and value.__module__.startswith("osimlite.")


class _Writer(Kernel, ast.NodeTransformer):
    """Rewrites one function."""

    def __init__(self, function: Function, language: str) -> None:
        super().__init__(function, language)
        self.number, self.is_divided = 0, False
        self.cleared: set[str] = set()

    def parse(self, function: Function) -> ast.FunctionDef:
        """Return a tree that can be rewritten."""
        return copy_tree(super().parse(function))

    def made(self) -> Any:
        """The function."""
        tree = self.tree
        body = [part for item in self.body for part in self._listed(self.visit(item))]
        clear = [
            ast.Assign([_set(name)], _name("unset_"))
            for name in sorted(self.cleared - set(self.given))
        ]
        tree.body, tree.returns, tree.decorator_list = [*clear, *body], None, []
        for argument in tree.args.args:
            argument.annotation = None
        code = compile(
            ast.fix_missing_locations(ast.Module([tree], [])), f"<{self.name} on symbols>", "exec"
        )
        scope = _Scope(self.function)
        exec(code, scope)
        made = scope[tree.name]
        return (lambda *given: ways.in_ways(self.name, made, *given)) if self.is_divided else made

    @staticmethod
    def _listed(node: Any) -> list[ast.stmt]:
        return node if isinstance(node, list) else [node]

    # ------------------------------------------------------------------------------------------- expressions
    def _part(self, node: ast.AST) -> ast.Constant:
        """A part of the code, for messages and to tell it from others."""
        self.number += 1
        return ast.Constant(f"{self.name} {self.number}")

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        sign = SIGNS.get(type(node.op))
        return _call_of(sign, node.left, node.right) if sign else node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        return _call_of(
            "both_" if isinstance(node.op, ast.And) else "either_", *map(_lazy, node.values)
        )

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        return _call_of("negated_", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        if len(node.ops) == 1:
            return node
        sides = [node.left, *node.comparators]
        pairs = zip(sides, node.ops, sides[1:], strict=False)
        return _call_of("both_", *(_lazy(ast.Compare(a, [op], [b])) for a, op, b in pairs))

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        return _call_of(
            "choose_", node.test, _lazy(node.body), _lazy(node.orelse), self._part(node)
        )

    # -------------------------------------------------------------------------------------------- statements
    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        sign = SIGNS.get(type(node.op))
        if sign is None:
            self.generic_visit(node)
            return node
        before: Any = copy_tree(node.target)
        before.ctx = ast.Load()
        return ast.Assign(
            [self.visit(node.target)], _call_of(sign, self.visit(before), self.visit(node.value))
        )

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        assert node.value is not None
        return ast.Assign([node.target], self.visit(node.value))

    def visit_While(self, node: ast.While) -> ast.stmt:
        self.is_divided = True
        part = self._part(node)
        self.generic_visit(node)
        node.test = _call_of("decide_", part, node.test)
        return node

    def visit_If(self, node: ast.If) -> Any:
        part, is_failure = self._part(node), self._is_failure(node)
        leaves = any(map(_leaves, (*node.body, *node.orelse)))
        names = stored(*node.body, *node.orelse)
        self.generic_visit(node)
        if is_failure:
            node.test = _call_of("fails_", node.test)
            return node
        if leaves:
            self.is_divided = True
            node.test = _call_of("decide_", part, node.test)
            return node
        # for side in branch.sides(): the variables as before; if side: ... else: ...;
        # branch.ends.append(the variables)
        self.cleared.update(names)
        branch, side, before = (f"{name}{self.number}_" for name in ("branch", "side", "before"))
        self.number += 1
        test, node.test = node.test, _name(side)
        append = ast.Attribute(
            ast.Attribute(_name(branch), "ends", ast.Load()), "append", ast.Load()
        )
        sides = ast.Call(ast.Attribute(_name(branch), "sides", ast.Load()), [], [])
        back: list[ast.stmt] = [_assign(names, _name(before))] if names else []
        after: list[ast.stmt] = (
            [_assign(names, ast.Attribute(_name(branch), "end", ast.Load()))] if names else []
        )
        kept = ast.Expr(ast.Call(append, [_tuple(names)], []))
        return [
            ast.Assign([_set(branch)], _call_of("branch_", part, test)),
            ast.Assign([_set(before)], _tuple(names)),
            ast.For(_set(side), sides, [*back, node, kept], []),
            *after,
        ]

    def _is_failure(self, node: ast.If) -> bool:
        """Whether all that is done is to return what went wrong: anything but OK of a function that returns that."""
        match node:
            case ast.If(body=[ast.Return(value=ast.expr() as value)], orelse=[]):
                returns = self.tree.returns
                kind = (
                    returns.value
                    if isinstance(returns, ast.Constant)
                    else getattr(returns, "id", "")
                )
                return kind == "int" and ast.unparse(value) != "OUTCOME.OK"
        return False


def _leaves(node: ast.AST) -> bool:
    """Whether a statement returns, or leaves a loop that it is not the whole of."""
    if isinstance(node, LEAVING):
        return True
    if isinstance(node, ast.For | ast.While):
        # Its own `break` is none of ours.
        return any(isinstance(part, ast.Return) for part in ast.walk(node))
    return any(map(_leaves, ast.iter_child_nodes(node)))


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _set(name: str) -> ast.Name:
    return ast.Name(name, ast.Store())


def _tuple(names: list[str]) -> ast.Tuple:
    return ast.Tuple([_name(name) for name in names], ast.Load())


def _assign(names: list[str], value: ast.expr) -> ast.Assign:
    return ast.Assign([ast.Tuple([_set(name) for name in names], ast.Store())], value)


def _lazy(node: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), node)


def _call_of(function: str, *given: ast.expr) -> ast.Call:
    return ast.Call(_name(function), list(given), [])
