"""Kernels as JavaScript: the page computes poses and paths by the very functions that simulations run.

Kernels are functions of floats, integers, vectors and tuples of these, with the few statements that are read here; what
else there is in one is an error. Vectors are typed arrays, of which `at` gives the rest from a place on; a law has its
number in a list `laws` for its address.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from types import FunctionType
from typing import Any

from osimlite.codegen.reader import Function, Kernel, name_of
from osimlite.codegen.sources import collect_functions
from osimlite.kernels import pointers

BINARY = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**", ast.BitAnd: "&"}
COMPARED = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "===", ast.NotEq: "!=="}
SIGNS = {ast.USub: "-", ast.UAdd: "+", ast.Not: "!"}
CALLED: dict[Any, str] = {
    abs: "Math.abs",
    min: "Math.min",
    max: "Math.max",
    int: "Math.trunc",
    float: "Number",
    bool: "Boolean",
    math.isnan: "Number.isNaN",
}
"""Functions that have another name; the others of `math` have theirs in `Math`."""
MODULO = "const modulo = (a, b) => { const r = a % b; return r !== 0 && (r < 0) !== (b < 0) ? r + b : r; };"
"""The remainder, which in Python has the sign of the divisor."""
RESERVED = frozenset((
    "case", "catch", "const", "default", "delete", "do", "function", "let", "new", "switch", "this", "throw", "typeof",
    "var", "void",
))  # fmt: skip
"""Names that a kernel may have and JavaScript not."""


def as_javascript(laws: Sequence[Function], others: Sequence[Function] = ()) -> str:
    """Kernels, and all that they call, as the text of one expression: an object that has them.

    Args:
        laws: that are called by their numbers, from 1 on; the object has them as `laws`.
        others: that the object has by their names.

    Raises:
        NotImplementedError: there is something in a kernel that has no counterpart here.
    """
    every = dict.fromkeys(part for function in (*laws, *others) for part in collect_functions(function))
    texts = "\n".join(_text(function) for function in every if function not in POINTERS)
    numbered = ", ".join(("null", *map(name_of, laws)))
    named = "".join(f", {function.__name__}: {name_of(function)}" for function in others)
    return f"(() => {{\n{MODULO}\n{texts}\nconst laws = [{numbered}];\nreturn {{ laws{named} }};\n}})()"


POINTERS: dict[Any, Callable[..., str]] = {
    pointers.at: lambda vector, place: f"{vector}.subarray({place})",
    pointers.call: lambda law, *given: f"laws[{law}]({', '.join(given)})",
}
"""What the two operations on addresses are."""


@cache
def _text(function: Function) -> str:
    return _Writer(function, "JavaScript").text()


class _Writer(Kernel):
    """Writes one function."""

    temporaries = 0

    def text(self) -> str:
        lines = self.block(self.body)
        names = [*map(_local, self.own), *(f"${k}" for k in range(self.temporaries))]
        declared = [f"let {', '.join(names)};"] if names else []
        head = f"function {self.name}({', '.join(map(_local, self.given))}) {{"
        return "\n".join((head, *declared, *lines, "}"))

    # ------------------------------------------------------------------------------------------- statements
    def block(self, body: Iterable[ast.stmt]) -> list[str]:
        return [line for statement in body for line in self.statement(statement)]

    def statement(self, node: ast.stmt) -> list[str]:
        match node:
            case ast.Assign(targets=targets, value=value):
                return self.assigned(targets, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return self.assigned([target], value)
            case ast.AugAssign(target=target, op=op, value=value):
                return self.assigned([target], ast.BinOp(target, op, value))
            case ast.Return(value=value):
                return [f"return {self.of(value)};" if value else "return;"]
            case ast.Expr(value=value):
                return [f"{self.of(value)};"]
            case ast.If(test=test, body=body, orelse=others):
                tail = ["} else {", *self.block(others), "}"] if others else ["}"]
                return [f"if ({self.of(test)}) {{", *self.block(body), *tail]
            case ast.While(test=test, body=body, orelse=[]):
                return [f"while ({self.of(test)}) {{", *self.block(body), "}"]
            case ast.For(target=ast.Name(id=name), iter=over, body=body, orelse=[]):
                # As in Python, what becomes of the variable within the loop makes no difference to the next round.
                counter = self.temporary()
                return [f"for ({self.loop(counter, over)}) {{", f"{_local(name)} = {counter};", *self.block(body), "}"]
            case ast.Break():
                return ["break;"]
            case ast.Continue():
                return ["continue;"]
            case ast.Pass():
                return []
        raise self.refuse(node)

    def assigned(self, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        if len(targets) == 1 and not isinstance(targets[0], ast.Tuple):
            return [f"{self.of(targets[0])} = {self.of(value)};"]
        if isinstance(value, ast.Tuple) and all(isinstance(t, ast.Tuple) for t in targets):
            # All of it is computed before any of it is stored.
            held = [self.temporary() for _ in value.elts]
            lines = [f"{name} = {self.of(part)};" for name, part in zip(held, value.elts, strict=True)]
            return lines + [line for target in targets for line in self.spread(target, held)]
        whole = self.temporary()
        lines = [f"{whole} = {self.of(value)};"]
        for target in targets:
            parts = len(target.elts) if isinstance(target, ast.Tuple) else 0
            lines += self.spread(target, [f"{whole}[{k}]" for k in range(parts)] if parts else [whole])
        return lines

    def spread(self, target: ast.expr, values: Sequence[str]) -> list[str]:
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        return [f"{self.of(part)} = {value};" for part, value in zip(targets, values, strict=True)]

    def temporary(self) -> str:
        self.temporaries += 1
        return f"${self.temporaries - 1}"

    def loop(self, name: str, over: ast.expr) -> str:
        if not (isinstance(over, ast.Call) and self.value(over.func) is range):
            return f"{name} of {self.of(over)}"
        bounds = [self.of(part) for part in over.args]
        first, stop, step = ["0", *bounds, "1"] if len(bounds) == 1 else [*bounds, "1"][:3]
        end, sign = self.temporary(), ">" if step.startswith("(-") else "<"
        return f"{name} = {first}, {end} = {stop}; {name} {sign} {end}; {name} += {step}"

    # ------------------------------------------------------------------------------------------ expressions
    def of(self, node: ast.expr) -> str:
        match node:
            case ast.Constant(value=value):
                return _number(value)
            case ast.Attribute():
                return self.constant(node)
            case ast.Name(id=name):
                return _local(name) if name in self.own or name in self.given else self.constant(node)
            case ast.BinOp(left=left, op=ast.FloorDiv(), right=right):
                return f"Math.floor({self.of(left)} / {self.of(right)})"
            case ast.BinOp(left=left, op=ast.Mod(), right=right):
                return f"modulo({self.of(left)}, {self.of(right)})"
            case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
                return f"({self.of(left)} {BINARY[type(op)]} {self.of(right)})"
            case ast.UnaryOp(op=op, operand=operand) if type(op) in SIGNS:
                return f"({SIGNS[type(op)]}{self.of(operand)})"
            case ast.BoolOp(op=op, values=values):
                return f"({(' && ' if isinstance(op, ast.And) else ' || ').join(map(self.of, values))})"
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in COMPARED for op in ops):
                parts = [self.of(part) for part in (left, *others)]
                pairs = zip(parts[:-1], ops, parts[1:], strict=True)
                return f"({' && '.join(f'{a} {COMPARED[type(op)]} {b}' for a, op, b in pairs)})"
            case ast.IfExp(test=test, body=body, orelse=other):
                return f"({self.of(test)} ? {self.of(body)} : {self.of(other)})"
            case ast.Tuple(elts=parts):
                return f"[{', '.join(map(self.of, parts))}]"
            case ast.Subscript(value=value, slice=place) if not isinstance(place, ast.Slice):
                return f"{self.of(value)}[{self.of(place)}]"
            case ast.Starred(value=value):
                return f"...{self.of(value)}"
            case ast.Call(func=function, args=given, keywords=[]):
                return self.call(self.value(function), [self.of(part) for part in given], node)
        raise self.refuse(node)

    def call(self, called: Any, given: Sequence[str], node: ast.expr) -> str:
        if called in POINTERS:
            return POINTERS[called](*given)
        if isinstance(called, FunctionType):
            name = name_of(called)
        elif called in CALLED:
            name = CALLED[called]
        elif called in vars(math).values():
            name = f"Math.{called.__name__}"
        else:
            raise self.refuse(node)
        return f"{name}({', '.join(given)})"

    def constant(self, node: ast.Name | ast.Attribute) -> str:
        value = self.value(node)
        if isinstance(value, tuple):
            return f"[{', '.join(map(_number, value))}]"
        if isinstance(value, int | float):
            return _number(value)
        raise self.refuse(node)


def _local(name: str) -> str:
    """A name that means nothing else in JavaScript."""
    return f"{name}_" if name in RESERVED else name


def _number(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if math.isnan(value):
        return "NaN"
    text = repr(value) if math.isfinite(value) else f"{'-' * (value < 0)}Infinity"
    return f"({text})" if value < 0 else text
