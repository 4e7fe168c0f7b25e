"""Kernels as JavaScript: a page computes poses and paths by the functions of simulations.

Vectors are typed arrays, of which `at` returns the rest from an offset on. The address of a law is
its index in a list `laws`. JavaScript has one type of numbers, so that results differ from Python's
only in the sign of an integer zero and in the last digits of mathematical functions. Integers
beyond 53 bits have no counterpart.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

from osimlite.mechanics.codegen.reader import Function, Kernel, name_of
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.layout import Record

OPERATORS = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
"""Signs of operators that JavaScript has with the same meaning."""
FUNCTIONS: dict[type[ast.operator], str] = {
    ast.FloorDiv: "floorDivide",
    ast.Mod: "modulo",
    ast.Pow: "power",
}
"""Functions of the runtime for operators that have another meaning in JavaScript."""
COMPARISONS = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
"""Signs of comparisons."""
SIGNS = {ast.USub: "-", ast.UAdd: "+"}
"""Signs before an operand."""
BUILT_IN_NAMES: dict[Any, str] = {
    abs: "Math.abs",
    min: "minimum",
    max: "maximum",
    int: "toInteger",
    float: "Number",
    bool: "isTrue",
    math.floor: "Math.floor",
    math.ceil: "Math.ceil",
    math.fabs: "Math.abs",
    math.isnan: "Number.isNaN",
    math.isfinite: "Number.isFinite",
    math.isinf: "isInfinite",
    math.copysign: "copySign",
    math.radians: "radians",
    math.erf: "errorFunction",
    math.erfc: "complementaryErrorFunction",
    **{
        getattr(math, name): f"Math.{name}"
        for name in (
            "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "log", "sinh", "cosh", "tanh",
        )
    },
}  # fmt: skip
"""Name in JavaScript or in the runtime of each function of Python."""
TRUTHS = frozenset((bool, math.isnan, math.isfinite, math.isinf))
"""Functions whose results are truth values."""
LARGEST_MASK = 2**31 - 1
"""Largest mask of bits; JavaScript makes larger numbers negative."""

RUNTIME = """\
const modulo = (a, b) => { const r = a % b; return r !== 0 && (r < 0) !== (b < 0) ? r + b : r; };
const floorDivide = (a, b) => {
  const r = a % b, q = (a - r) / b - (r !== 0 && (r < 0) !== (b < 0) ? 1 : 0), whole = Math.floor(q);
  return q === 0 ? copySign(0, a / b) : q - whole > 0.5 ? whole + 1 : whole;
};
const power = (a, b) => {
  if (!Number.isInteger(b) || Math.abs(b) > 65536) return a ** b;
  let result = 1;
  for (let rest = Math.abs(b), factor = a; rest > 0; rest = Math.floor(rest / 2), factor *= factor) {
    if (rest % 2 === 1) result *= factor;
  }
  return b < 0 ? 1 / result : result;
};
const minimum = (...all) => all.reduce((a, b) => b < a ? b : a);
const maximum = (...all) => all.reduce((a, b) => b > a ? b : a);
const toInteger = (a) => Number.isNaN(a) ? 0 : Math.trunc(a) + 0;
const isTrue = (a) => a != 0;
const isInfinite = (a) => a === Infinity || a === -Infinity;
const copySign = (a, b) => b < 0 || Object.is(b, -0) ? -Math.abs(a) : Math.abs(a);
const radians = (a) => a * 0.017453292519943295;
// A series of positive terms near zero, and a continued fraction by Lentz's method far from it.
const errorFunction = (x) => {
  if (Number.isNaN(x)) return x;
  if (Math.abs(x) > 2.5) return x > 0 ? 1 - errorTail(x) : errorTail(-x) - 1;
  let term = x, sum = x;
  for (let n = 1; Math.abs(term) > 1e-18 * Math.abs(sum); ++n) { term *= 2 * x * x / (2 * n + 1); sum += term; }
  return 1.1283791670955126 * Math.exp(-x * x) * sum;
};
const complementaryErrorFunction = (x) => {
  if (Number.isNaN(x)) return x;
  return x > 0.5 ? errorTail(x) : 1 - errorFunction(x);
};
const errorTail = (x) => {
  if (x > 27.3) return 0;
  let fraction = x, upper = x, lower = 0;
  for (let n = 1; n < 400; ++n) {
    lower = 1 / (x + 0.5 * n * lower); upper = x + 0.5 * n / upper;
    const change = upper * lower; fraction *= change;
    if (Math.abs(change - 1) < 1e-16) break;
  }
  return Math.exp(-x * x) / (fraction * 1.7724538509055159);
};"""
"""Python's arithmetic, and the functions that JavaScript lacks."""
RESERVED = frozenset((
    "await", "case", "catch", "class", "const", "debugger", "default", "delete", "do", "enum", "export", "extends",
    "false", "finally", "function", "implements", "import", "in", "instanceof", "interface", "let", "new", "null",
    "package", "private", "protected", "public", "return", "static", "super", "switch", "this", "throw", "true", "try",
    "typeof", "undefined", "var", "void", "with", "yield", "eval", "arguments", "laws", "Math", "Number", "Boolean",
    "Infinity", "NaN", "Object", *(line.split()[1] for line in RUNTIME.splitlines() if line.startswith("const ")),
))  # fmt: skip
"""Names that a kernel may use, but that mean something else in JavaScript or the runtime."""


def write_javascript(laws: Sequence[Function], named_functions: Sequence[Function] = ()) -> str:
    """Return kernels, with all functions that they call, as the text of one expression.

    The value of the expression is an object with the kernels.

    Args:
        laws: kernels that are called by their numbers, from 1 on; the object has them as `laws`.
        named_functions: kernels that the object has by their names.

    Raises:
        TranslationError: a kernel uses something that has no counterpart in JavaScript.
    """
    writers = []
    pending = dict.fromkeys((*laws, *named_functions))
    while pending:
        writers.append(_write_function(next(iter(pending))))
        pending.update(dict.fromkeys(writers[-1].functions))
        # A function that was written while others were pending must not be written again.
        for writer in writers:
            pending.pop(writer.function, None)
    records = dict.fromkeys(record for writer in writers for record in writer.records)
    texts = "\n".join((*map(_write_record, records), *(writer.written for writer in writers)))
    numbered = ", ".join(("null", *map(name_of, laws)))
    named = "".join(f", {function.__name__}: {name_of(function)}" for function in named_functions)
    return f"(() => {{\n{RUNTIME}\n{texts}\nconst laws = [{numbered}];\nreturn {{ laws{named} }};\n}})()"


POINTERS: dict[Any, Callable[..., str]] = {
    pointers.at: lambda vector, index: f"{vector}.subarray({index})",
    pointers.call: lambda law, *arguments: f"laws[{law}]({', '.join(arguments)})",
}
"""The two operations on addresses."""


@cache
def _write_function(function: Function) -> _JavaScriptWriter:
    writer = _JavaScriptWriter(function, "JavaScript")
    writer.written = writer.write()
    return writer


def _write_record(record: Any) -> str:
    """Return a class of named tuples as an array whose items also have names."""
    getters = " ".join(
        f"get ${name}() {{ return this[{k}]; }}" for k, name in enumerate(record._fields)
    )
    return f"class {_record_name(record)} extends Array {{ {getters} }}"


def _record_name(record: Any) -> str:
    return f"{record.__module__.rpartition('.')[2]}_{record.__name__}"


class _JavaScriptWriter(Kernel):
    """Writer of one function.

    Attributes:
        functions: functions that the written function calls or passes on.
        records: classes of the named tuples that it makes.
        written: text of the function in JavaScript; empty until `write` has run.
    """

    written = ""

    def __init__(self, function: Function, language: str) -> None:
        super().__init__(function, language)
        self.functions: list[Function] = []
        self.records: list[Any] = []
        self._temporaries = 0
        self._locals = frozenset((*self.argument_names, *self.local_names))

    def write(self) -> str:
        """Return the text of the function."""
        lines = self.block(self.body)
        names = [*map(_escape_name, self.local_names), *(f"${k}" for k in range(self._temporaries))]
        declared = [f"let {', '.join(names)};"] if names else []
        defaults = self.function.__defaults__ or ()
        parameters = [_escape_name(name) for name in self.argument_names]
        for k, value in enumerate(reversed(defaults), 1):
            parameters[-k] += f" = {_format_number(value)}"
        header = f"function {self.name}({', '.join(parameters)}) {{"
        return "\n".join((header, *declared, *lines, "}"))

    # ------------------------------------------------------------------------------------------- statements
    def block(self, body: Iterable[ast.stmt]) -> list[str]:
        """Return the lines of some statements."""
        return [line for statement in body for line in self.statement(statement)]

    def statement(self, node: ast.stmt) -> list[str]:
        """Return the lines of one statement."""
        match node:
            case ast.Assign(targets=targets, value=value):
                return self.assign(targets, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return self.assign([target], value)
            case ast.AugAssign(target=target, op=op, value=value):
                target_text = self.expression(target)
                return [
                    f"{target_text} = {self.operation(target_text, op, self.expression(value), node)};"
                ]
            case ast.Return(value=value):
                return [f"return {self.expression(value)};" if value else "return;"]
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                return []
            case ast.Expr(value=value):
                return [f"{self.expression(value)};"]
            case ast.If(test=test, body=body, orelse=others):
                tail = ["} else {", *self.block(others), "}"] if others else ["}"]
                return [f"if ({self.condition(test)}) {{", *self.block(body), *tail]
            case ast.While(test=test, body=body, orelse=[]):
                return [f"while ({self.condition(test)}) {{", *self.block(body), "}"]
            case ast.For(target=ast.Name(id=name), iter=iterated, body=body, orelse=[]):
                # As in Python, assignments to the loop variable in the body do not affect the next
                # round.
                counter = self.temporary()
                store = f"{_escape_name(name)} = {counter};"
                return [f"for ({self.loop(counter, iterated)}) {{", store, *self.block(body), "}"]
            case ast.Break():
                return ["break;"]
            case ast.Continue():
                return ["continue;"]
        raise self.refuse(node)

    def assign(self, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        """Return the lines of an assignment to one target or several.

        Args:
            targets: targets.
            value: assigned expression.
        """
        if len(targets) == 1 and isinstance(targets[0], ast.Name):
            return [f"{self.expression(targets[0])} = {self.expression(value)};"]
        if isinstance(value, ast.Tuple) and all(map(_has_separate_items, (value, *targets))):
            # All items are computed before any of them is stored.
            temporaries = [self.temporary() for _ in value.elts]
            lines = [
                f"{name} = {self.expression(element)};"
                for name, element in zip(temporaries, value.elts, strict=True)
            ]
            return lines + [line for target in targets for line in self.store(target, temporaries)]
        # JavaScript evaluates the target before the value, so the value gets a variable first.
        temporary = self.temporary()
        lines = [f"{temporary} = {self.expression(value)};"]
        for target in targets:
            element_count = len(target.elts) if isinstance(target, ast.Tuple) else 0
            lines += self.store(
                target,
                [f"{temporary}[{k}]" for k in range(element_count)]
                if element_count
                else [temporary],
            )
        return lines

    def store(self, target: ast.expr, values: Sequence[str]) -> list[str]:
        """Return the lines that store values in a target, or in its items.

        Args:
            target: target, or tuple of targets.
            values: texts of the values.
        """
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        return [
            f"{self.expression(element)} = {value};"
            for element, value in zip(targets, values, strict=True)
        ]

    def temporary(self) -> str:
        """Return the name of a new variable."""
        self._temporaries += 1
        return f"${self._temporaries - 1}"

    def loop(self, name: str, iterated: ast.expr) -> str:
        """Return the head of a loop.

        Args:
            name: name of the counter.
            iterated: expression that the loop iterates over: a call of range() or a tuple.
        """
        if not (isinstance(iterated, ast.Call) and self.value(iterated.func) is range):
            if not isinstance(iterated, ast.Tuple):
                raise self.refuse(
                    iterated, "a loop is over range() or over a tuple that is written out"
                )
            return f"{name} of {self.expression(iterated)}"
        bounds = [self.expression(bound) for bound in iterated.args]
        first, stop, step = ["0", *bounds, "1"] if len(bounds) == 1 else [*bounds, "1"][:3]
        # Python evaluates the end once, before the loop.
        end = self.temporary()
        if step.removeprefix("(-").rstrip(")").isdigit():
            sign = ">" if step.startswith("(-") else "<"
            return f"{name} = {first}, {end} = {stop}; {name} {sign} {end}; {name} += {step}"
        step_name = self.temporary()
        test = f"{step_name} > 0 ? {name} < {end} : {name} > {end}"
        return (
            f"{name} = {first}, {end} = {stop}, {step_name} = {step}; {test}; {name} += {step_name}"
        )

    # ------------------------------------------------------------------------------------------ expressions
    def expression(self, node: ast.expr) -> str:
        """Return the text of an expression."""
        match node:
            case ast.Constant(value=bool() | int() | float() as value):
                return _format_number(value)
            case ast.Attribute(value=owner, attr=name):
                if not self._is_local(owner) and isinstance(self.value(owner), Record | ModuleType):
                    return self.constant(node)
                return f"{self.expression(owner)}.${name}"
            case ast.Name(id=name):
                return _escape_name(name) if name in self._locals else self.constant(node)
            case ast.BinOp(left=left, op=op, right=right):
                return self.operation(self.expression(left), op, self.expression(right), node)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return f"(!{self.condition(operand)})"
            case ast.UnaryOp(op=op, operand=operand) if type(op) in SIGNS:
                return f"({SIGNS[type(op)]}{self.expression(operand)})"
            case ast.BoolOp(op=op, values=values):
                return self.either(op, values)
            case ast.Compare():
                return self.compare(node)
            case ast.IfExp(test=test, body=body, orelse=other):
                return (
                    f"({self.condition(test)} ? {self.expression(body)} : {self.expression(other)})"
                )
            case ast.Tuple(elts=parts):
                return f"[{', '.join(map(self.expression, parts))}]"
            case ast.Subscript(value=value, slice=index) if not isinstance(index, ast.Slice):
                owner_text, text = self.expression(value), self.expression(index)
                # Only a tuple has a last item.
                return (
                    f"{owner_text}.at({text})" if text.startswith("(-") else f"{owner_text}[{text}]"
                )
            case ast.Starred(value=value):
                return f"...{self.expression(value)}"
            case ast.Call(func=function, args=arguments, keywords=[]):
                callee = self.value(function) if not self._is_local(function) else None
                return self.call(
                    callee, function, [self.expression(argument) for argument in arguments], node
                )
        raise self.refuse(node)

    def _is_local(self, node: ast.expr) -> bool:
        return isinstance(node, ast.Name) and node.id in self._locals

    def operation(self, left: str, op: ast.operator, right: str, node: ast.AST) -> str:
        """Return the text of an operation.

        Args:
            left: the left operand.
            op: the operator.
            right: the right operand.
            node: the operation, for messages.
        """
        if type(op) in OPERATORS:
            return f"({left} {OPERATORS[type(op)]} {right})"
        if type(op) in FUNCTIONS:
            return f"{FUNCTIONS[type(op)]}({left}, {right})"
        # Bits of numbers up to 31 bits are the same in both languages.
        if isinstance(op, ast.BitAnd) and any(
            text.isdigit() and int(text) <= LARGEST_MASK for text in (left, right)
        ):
            return f"({left} & {right})"
        raise self.refuse(node, "JavaScript has no integers of 64 bits")

    def condition(self, node: ast.expr) -> str:
        """Return the text of an expression as a truth value.

        NaN is true, as in Python.
        """
        if isinstance(node, ast.BoolOp):
            sign = " && " if isinstance(node.op, ast.And) else " || "
            return f"({sign.join(map(self.condition, node.values))})"
        text = self.expression(node)
        return text if self.is_truth(node) else f"({text} != 0)"

    def is_truth(self, node: ast.expr) -> bool:
        """Return whether the value of an expression is known to be true or false."""
        match node:
            case ast.Compare() | ast.UnaryOp(op=ast.Not()) | ast.Constant(value=bool()):
                return True
            case ast.BoolOp(values=values):
                return all(map(self.is_truth, values))
            case ast.Call(func=function) if not self._is_local(function):
                value = self.value(function)
                return isinstance(value, type | type(abs)) and value in TRUTHS
        return False

    def either(self, op: ast.boolop, values: Sequence[ast.expr]) -> str:
        """Return the text of `and` or `or`, whose value is the operand that decides.

        Args:
            op: `and` or `or`.
            values: operands.
        """
        if all(map(self.is_truth, values)):
            sign = " && " if isinstance(op, ast.And) else " || "
            return f"({sign.join(map(self.expression, values))})"
        first, *others = values
        if not others:
            return self.expression(first)
        temporary = self.temporary()
        remainder = self.either(op, others)
        test = f"({temporary} = {self.expression(first)}) != 0"
        return (
            f"({test} ? {remainder} : {temporary})"
            if isinstance(op, ast.And)
            else f"({test} ? {temporary} : {remainder})"
        )

    def compare(self, node: ast.Compare) -> str:
        """Return the text of a chain of comparisons, whose operands are evaluated once."""
        left = self.expression(node.left)
        tests = []
        for k, (op, operand) in enumerate(zip(node.ops, node.comparators, strict=True)):
            if isinstance(op, ast.In | ast.NotIn) and isinstance(operand, ast.Tuple):
                if len(node.ops) > 1:
                    raise self.refuse(node)
                membership = f"{self.expression(operand)}.includes(Number({left}))"
                return membership if isinstance(op, ast.In) else f"(!{membership})"
            if type(op) not in COMPARISONS:
                raise self.refuse(node)
            right = text = self.expression(operand)
            # A middle operand is part of two comparisons but evaluated once.
            if k < len(node.ops) - 1 and not isinstance(operand, ast.Name | ast.Constant):
                right = self.temporary()
                text = f"({right} = {text})"
            tests.append(f"{left} {COMPARISONS[type(op)]} {text}")
            left = right
        return f"({' && '.join(tests)})"

    def call(
        self, callee: Any, function: ast.expr, arguments: Sequence[str], node: ast.expr
    ) -> str:
        """Return the text of a call.

        Args:
            callee: the function, None for a local one.
            function: expression of the function.
            arguments: texts of the arguments.
            node: the call, for messages.
        """
        if self._is_local(function):
            return f"{self.expression(function)}({', '.join(arguments)})"
        if isinstance(callee, FunctionType):
            if callee in POINTERS:
                return POINTERS[callee](*arguments)
            self.functions.append(callee)
            return f"{name_of(callee)}({', '.join(arguments)})"
        if isinstance(callee, type) and issubclass(callee, tuple) and hasattr(callee, "_fields"):
            return self.new_record(callee, arguments)
        if isinstance(callee, type | type(abs)) and callee in BUILT_IN_NAMES:
            return f"{BUILT_IN_NAMES[callee]}({', '.join(arguments)})"
        raise self.refuse(node)

    def new_record(self, record: Any, arguments: Sequence[str]) -> str:
        """Return the text of a new named tuple.

        Args:
            record: class of named tuples.
            arguments: texts of the arguments.
        """
        self.records.append(record)
        # Unpacked tuples fill all fields.
        is_complete = any(text.startswith("...") for text in arguments)
        missing = () if is_complete else record._fields[len(arguments) :]
        defaults = [
            _format_number(record._field_defaults[name])
            for name in missing
            if name in record._field_defaults
        ]
        return f"{_record_name(record)}.of({', '.join((*arguments, *defaults))})"

    def constant(self, node: ast.Name | ast.Attribute) -> str:
        """Return the text of a value of a module."""
        value = (
            getattr(self.value(node.value), node.attr)
            if isinstance(node, ast.Attribute)
            else self.value(node)
        )
        if isinstance(value, FunctionType):
            self.functions.append(value)
            return name_of(value)
        if isinstance(value, tuple | int | float):
            return _format_number(value)
        raise self.refuse(node)


def _has_separate_items(node: ast.expr) -> bool:
    return isinstance(node, ast.Tuple) and not any(
        isinstance(element, ast.Starred) for element in node.elts
    )


def _escape_name(name: str) -> str:
    """Return a name with a trailing underscore if it means something else in JavaScript."""
    return f"{name}_" if name in RESERVED else name


def _format_number(value: Any) -> str:
    """Return the text of a constant, or of a tuple of constants."""
    if isinstance(value, tuple):
        return f"[{', '.join(map(_format_number, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if math.isnan(value):
        return "NaN"
    text = repr(value) if math.isfinite(value) else f"{'-' * (value < 0)}Infinity"
    return f"({text})" if text.startswith("-") else text
