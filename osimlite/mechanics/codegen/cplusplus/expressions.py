"""Expressions of kernels as C++.

Python evaluates operands and arguments from left to right; C++ leaves the order open. Where one
operand writes memory that another may read or write, the operands become variables before the
statement, in Python's order.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Sequence
from types import FunctionType
from typing import Any

from osimlite.mechanics.codegen.cplusplus.inference import WRITES, Specialisation, is_record_class
from osimlite.mechanics.codegen.cplusplus.operators import (
    AND,
    CHOICE,
    COMPARISONS,
    EQUALITY,
    FUNCTIONS,
    OPERATORS,
    OR,
    PRIMARY,
    SHIFT,
    SUM,
    UNARY,
    ExpressionText,
    Names,
    escape_name,
    is_simple,
    right_of,
    write_number,
)
from osimlite.mechanics.codegen.cplusplus.types import (
    BOOLEAN,
    Callee,
    Pointer,
    Scalar,
    Tuple,
    Type,
    is_integral,
    is_number,
    type_of_constant,
)


class ExpressionWriter:
    """Writer of the expressions of one function.

    Args:
        function: function with the types of its variables and expressions.
        names: library that contains the function.
    """

    def __init__(self, function: Specialisation, names: Names) -> None:
        self.function = function
        self.names = names
        self.pending: list[str] = []
        """Definitions of variables that must stand before the statement that is being written."""
        self._temporaries = 0

    # --------------------------------------------------------------------------------------------------- helpers
    def local(self, name: str) -> str:
        """Return the name of a variable."""
        return escape_name(name)

    def new_name(self, stem: str) -> str:
        """Return a name that no variable of the function has."""
        while True:
            self._temporaries += 1
            name = f"{stem}_{self._temporaries}"
            if name not in self.function.variables:
                return name

    def hold(self, kind: Type, text: str) -> str:
        """Define a variable before the statement that is being written.

        Args:
            kind: type of the variable.
            text: text of its initial value.

        Returns:
            Name of the variable.
        """
        name = self.new_name("temporary")
        self.pending.append(f"const {self.names.name_type(kind)} {name} = {text};")
        # Kernels write through pointers, so that these must not be constant.
        if isinstance(kind, Pointer):
            self.pending[-1] = self.pending[-1].removeprefix("const ")
        return name

    def text(self, node: ast.expr, least: int = CHOICE) -> str:
        """Return the text of an expression, in parentheses if it binds less closely than needed.

        Args:
            node: the expression.
            least: the lowest precedence that needs no parentheses.
        """
        code = self.code(node)
        return code.text if code.precedence >= least else f"({code.text})"

    def guard_expression(self, write: Callable[..., str], *arguments: Any) -> str:
        """Return the text of an expression that is not always evaluated.

        Variables that it needs are defined within it, in a lambda expression.

        Args:
            write: function that returns the text of the expression.
            arguments: arguments of `write`.
        """
        before, self.pending = self.pending, []
        try:
            text = write(*arguments)
            inner = self.pending
        finally:
            self.pending = before
        return f"[&] {{ {' '.join(inner)} return {text}; }}()" if inner else text

    def order_operands(
        self, nodes: Sequence[ast.expr], write: Callable[[ast.expr], str]
    ) -> list[str]:
        """Return the texts of operands that C++ may evaluate in any order.

        Args:
            nodes: the operands.
            write: function that returns the text of an operand.

        Returns:
            Texts in the order of the operands; earlier ones are names of variables where the order
            matters.
        """
        if len(nodes) < 2 or not self.function.effects & WRITES:
            # Operands that only read memory may be evaluated in any order.
            return [write(node) for node in nodes]
        effects = [self.function.effects_of(node) for node in nodes]
        active = [index for index, effect in enumerate(effects) if effect]
        is_hazard = len(active) > 1 and any(effects[index] & WRITES for index in active)
        texts = []
        for index, node in enumerate(nodes):
            text = write(node)
            if is_hazard and index in active[:-1]:
                kind = self.function.require_type(
                    node.value if isinstance(node, ast.Starred) else node
                )
                text = self.hold(kind, text)
            texts.append(text)
        return texts

    def convert(self, text: str, have: Type, want: Type) -> str:
        """Return the text of a value as one of another type.

        Args:
            text: text of the value.
            have: type of the value.
            want: type that is needed; numbers convert implicitly.
        """
        if have is want or (is_number(have) and is_number(want)) or isinstance(have, Callee):
            return text
        assert isinstance(have, Tuple) and isinstance(want, Tuple)
        # A name costs nothing to repeat; any other text becomes a variable first.
        name = text if text.replace(".", "").replace("_", "").isalnum() else self.hold(have, text)
        parts = [self.item(name, have, index) for index in range(len(have.parts))]
        return self.build(want, parts, have.parts)

    def cast(self, text: str, have: Type, want: Type) -> str:
        """Return the text of a value whose type is exactly the one that is needed.

        Args:
            text: text of the value.
            have: type of the value.
            want: type that is needed.
        """
        if have is want:
            return text
        if is_number(have) and is_number(want):
            name = self.names.name_type(want)
            return f"static_cast<{name}>({text})" if isinstance(want, Scalar) else f"{name}({text})"
        return self.convert(text, have, want)

    def item(self, text: str, kind: Tuple, index: int) -> str:
        """Return the text of an item of a tuple.

        Args:
            text: text of the tuple.
            kind: type of the tuple.
            index: index of the item; negative ones count from the end.
        """
        index %= len(kind.parts)
        if kind.is_array:
            return f"{text}.items[{index}]"
        return (
            f"{text}.{escape_name(kind.record._fields[index]) if kind.record else f'item{index}'}"
        )

    def build(self, kind: Tuple, texts: Sequence[str], types: Sequence[Type]) -> str:
        """Return the text of a new tuple.

        Args:
            kind: type of the tuple.
            texts: texts of the items.
            types: types of the items.
        """
        parts = [
            self.cast(text, source_type, target_type)
            for text, source_type, target_type in zip(texts, types, kind.parts, strict=True)
        ]
        inner = f"{{{', '.join(parts)}}}"
        return self.names.name_type(kind) + (f"{{{inner}}}" if kind.is_array else inner)

    def text_as(self, node: ast.expr, want: Type, least: int = CHOICE) -> str:
        """Return the text of an expression as a value of a type.

        Args:
            node: the expression.
            want: the type.
            least: the lowest precedence that needs no parentheses.
        """
        have = self.function.require_type(node)
        if have is not want and isinstance(want, Tuple):
            if isinstance(node, ast.Tuple) and not any(
                isinstance(part, ast.Starred) for part in node.elts
            ):
                # Convert the items instead of the tuple, so that no temporary tuple is made.
                type_by_part = dict(zip(node.elts, want.parts, strict=True))
                texts = self.order_operands(
                    node.elts, lambda part: self.text_as(part, type_by_part[part])
                )
                kinds = [
                    self.function.require_type(part) if is_number(target_type) else target_type
                    for part, target_type in type_by_part.items()
                ]
                return self.build(want, texts, kinds)
            if isinstance(node, ast.IfExp):
                code = self.choose(node, want)
                return code.text if code.precedence >= least else f"({code.text})"
        return self.convert(self.text(node, least), have, want)

    # ----------------------------------------------------------------------------------------------- conditions
    def condition(self, node: ast.expr) -> ExpressionText:
        """Return the text of an expression as a truth value."""
        match node:
            case ast.BoolOp(op=op, values=values):
                sign, precedence = ("&&", AND) if isinstance(op, ast.And) else ("||", OR)
                first, *others = values
                texts = [self._condition_part(first, precedence)]
                texts += [
                    self.guard_expression(self._condition_part, value, precedence)
                    for value in others
                ]
                return ExpressionText(f" {sign} ".join(texts), precedence)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                code = self.condition(operand)
                return ExpressionText(
                    f"!{code.text}" if code.precedence == PRIMARY else f"!({code.text})", UNARY
                )
        code = self.code(node)
        if self.function.require_type(node) is BOOLEAN:
            return code
        text = code.text if code.precedence > EQUALITY else f"({code.text})"
        return ExpressionText(f"{text} != 0", EQUALITY)

    def _condition_part(self, node: ast.expr, outer: int) -> str:
        code = self.condition(node)
        # Compilers warn where one of && and || stands in the other without parentheses.
        return code.text if code.precedence > AND or code.precedence == outer else f"({code.text})"

    # ---------------------------------------------------------------------------------------------- expressions
    def code(self, node: ast.expr) -> ExpressionText:
        """Return the text of an expression with its precedence."""
        match node:
            case ast.Constant(value=value):
                return self.number(value)
            case ast.Name(id=name) if name in self.function.variables:
                return ExpressionText(self.local(name))
            case ast.Name(id=name):
                return self.constant(name, self.function.value(node))
            case ast.Attribute(value=owner, attr=name):
                if (value := self.function.value(node)) is not None:
                    return self.constant(ast.unparse(node).replace(".", "_"), value)
                kind = self.function.require_type(owner)
                assert isinstance(kind, Tuple)
                return ExpressionText(
                    self.item(self.text(owner, PRIMARY), kind, kind.record._fields.index(name))
                )
            case ast.Tuple():
                return self.new_tuple(node)
            case ast.Subscript(value=owner, slice=index):
                return self.subscript(owner, index)
            case ast.UnaryOp(op=ast.Not()):
                return self.condition(node)
            case ast.UnaryOp(op=op, operand=operand):
                sign = {ast.USub: "-", ast.UAdd: "+", ast.Invert: "~"}[type(op)]
                return ExpressionText(f"{sign}{self.text(operand, PRIMARY)}", UNARY)
            case ast.BinOp(left=left, op=op, right=right):
                texts = self.order_operands(
                    [left, right], lambda part: self._operand(part, op, part is right)
                )
                return self.operation(
                    texts, op, [self.function.require_type(part) for part in (left, right)], node
                )
            case ast.BoolOp():
                return self.either(node)
            case ast.Compare():
                return self.compare(node)
            case ast.IfExp():
                return self.choose(node, self.function.require_type(node))
            case ast.Call(func=function, args=arguments):
                return self.call(node, self.function.resolve_call(function), arguments)
        raise self.function.refuse(node)

    @staticmethod
    def number(value: Any) -> ExpressionText:
        """Return the text of a constant."""
        text = write_number(value)
        return ExpressionText(text, UNARY if text.startswith("-") else PRIMARY)

    def constant(self, name: str, value: Any) -> ExpressionText:
        """Return the text of a value of a module.

        Args:
            name: name in Python.
            value: the value.
        """
        if isinstance(value, tuple):
            return ExpressionText(self.names.name_constant(name, value))
        # A function that is passed on is a part of the specialisation that is called, and no
        # argument.
        return ExpressionText("") if isinstance(value, FunctionType) else self.number(value)

    def new_tuple(self, node: ast.Tuple) -> ExpressionText:
        """Return the text of a new tuple."""
        kind = self.function.require_type(node)
        assert isinstance(kind, Tuple)
        texts, kinds = self.arguments(node.elts)
        return ExpressionText(self.build(kind, texts, kinds))

    def subscript(self, owner: ast.expr, index: ast.expr) -> ExpressionText:
        """Return the text of an item of a vector or a tuple.

        Args:
            owner: the vector or tuple.
            index: the index.
        """
        kind = self.function.require_type(owner)
        if isinstance(kind, Pointer):
            texts = self.order_operands(
                [owner, index], lambda part: self.text(part, PRIMARY if part is owner else CHOICE)
            )
            return ExpressionText(f"{texts[0]}[{texts[1]}]")
        assert isinstance(kind, Tuple)
        constant = self.function.constant_index(index)
        if constant is not None:
            return ExpressionText(self.item(self.text(owner, PRIMARY), kind, constant))
        texts = self.order_operands(
            [owner, index], lambda part: self.text(part, PRIMARY if part is owner else CHOICE)
        )
        # A variable index counts from the start: a test whether it is negative costs more than the
        # laws' curves may.
        return ExpressionText(f"{texts[0]}.items[{texts[1]}]")

    def _operand(self, node: ast.expr, op: ast.operator, is_right: bool) -> str:
        if type(op) in FUNCTIONS:
            return self.text(node)
        _, precedence = OPERATORS[type(op)]
        # Bit operators get parentheses in any case, because compilers warn without them.
        if precedence < SUM:
            return self.text(node, PRIMARY)
        return self.text(node, precedence + is_right)

    def operation(
        self, texts: Sequence[str], op: ast.operator, kinds: Sequence[Type], node: ast.AST
    ) -> ExpressionText:
        """Return the text of an operation.

        Args:
            texts: the operands.
            op: the operator.
            kinds: types of the operands.
            node: the operation, for messages.
        """
        one, two = texts
        are_integers = all(map(is_integral, kinds))
        if type(op) in FUNCTIONS:
            # The functions of the header have an overload for integers and one for floats.
            is_integer = are_integers and not (
                isinstance(op, ast.Pow) and self.function.is_negative(right_of(node))
            )
            if is_integral(kinds[0]):
                one = f"static_cast<{'int64_t' if is_integer else 'double'}>({one})"
            if is_integral(kinds[1]):
                # A power by an integer is a product of factors, whatever the base is.
                two = f"static_cast<{'int64_t' if is_integer or isinstance(op, ast.Pow) else 'double'}>({two})"
            return ExpressionText(f"py::{FUNCTIONS[type(op)]}({one}, {two})")
        # C++ leaves the behaviour of signed overflow undefined: generators of random numbers
        # multiply by a function of the header.
        if type(op) not in OPERATORS:
            raise self.function.refuse(node)
        sign, precedence = OPERATORS[type(op)]
        if isinstance(op, ast.Mult) and are_integers and self._may_overflow(node):
            return ExpressionText(f"py::multiply({one}, {two})")
        # Division of integers gives a float in Python.
        if isinstance(op, ast.Div) and are_integers:
            one = f"static_cast<double>({one})"
        return ExpressionText(f"{one} {sign} {two}", precedence)

    def _may_overflow(self, node: ast.AST) -> bool:
        """Return whether a product may overflow, judged by the size of a constant factor.

        Only generators of random numbers have such factors.
        """
        factors = [node.left, node.right] if isinstance(node, ast.BinOp) else [right_of(node)]
        return any(
            abs(self.function.constant_index(part) or 0) >= 2**31
            for part in factors
            if part is not None
        )

    def either(self, node: ast.BoolOp) -> ExpressionText:
        """Return the text of `and` or `or`; of numbers it is the one that decides."""
        kind = self.function.require_type(node)
        if kind is BOOLEAN:
            return self.condition(node)
        return ExpressionText(self._decide(node.op, node.values, kind))

    def _decide(self, op: ast.boolop, values: Sequence[ast.expr], kind: Type) -> str:
        first, *others = values
        have = self.function.require_type(first)
        if not others:
            return self.cast(self.text(first), have, kind)
        # The first operand is both tested and returned, so that it must be evaluated once.
        name = (
            self.text(first) if isinstance(first, ast.Name) else self.hold(have, self.text(first))
        )
        first_value = self.cast(name, have, kind)
        other_values = self.guard_expression(self._decide, op, others, kind)
        test = name if have is BOOLEAN else f"{name} != 0"
        return (
            f"({test} ? {other_values} : {first_value})"
            if isinstance(op, ast.And)
            else f"({test} ? {first_value} : {other_values})"
        )

    def compare(self, node: ast.Compare) -> ExpressionText:
        """Return the text of a chain of comparisons."""
        if any(isinstance(op, ast.In | ast.NotIn) for op in node.ops):
            return self._contains(node)
        operands = [node.left, *node.comparators]
        # A middle operand is part of two comparisons.
        if any(self.function.effects_of(operand) & WRITES for operand in operands[2:-1]):
            raise self.function.refuse(node, "an operand that writes memory is compared twice")
        texts = self.order_operands(operands[:2], self._comparand)
        for operand in operands[2:]:
            before = operands[len(texts) - 1]
            if not is_simple(before):
                # It is compared twice and evaluated once.
                texts[-1] = self.hold(self.function.require_type(before), texts[-1])
            texts.append(self.guard_expression(self._comparand, operand))
        signs = [COMPARISONS[type(op)][0] for op in node.ops]
        parts = [f"{a} {sign} {b}" for a, sign, b in zip(texts[:-1], signs, texts[1:], strict=True)]
        return ExpressionText(
            " && ".join(parts), COMPARISONS[type(node.ops[0])][1] if len(parts) == 1 else AND
        )

    def _comparand(self, node: ast.expr) -> str:
        # Compilers warn where one comparison stands in another without parentheses.
        return self.text(node, SHIFT)

    def _contains(self, node: ast.Compare) -> ExpressionText:
        """Return the text of a question whether a number is among others."""
        if len(node.ops) > 1 or not isinstance(node.comparators[0], ast.Tuple):
            raise self.function.refuse(node)
        text = self._comparand(node.left)
        if not is_simple(node.left):
            text = self.hold(self.function.require_type(node.left), text)
        tests = [
            f"{text} == {self.guard_expression(self._comparand, item)}"
            for item in node.comparators[0].elts
        ]
        inner = f"({' || '.join(tests) or 'false'})"
        return (
            ExpressionText(inner)
            if isinstance(node.ops[0], ast.In)
            else ExpressionText(f"!{inner}", UNARY)
        )

    def choose(self, node: ast.IfExp, kind: Type) -> ExpressionText:
        """Return the text of a conditional expression.

        Args:
            node: the expression.
            kind: the type that both values are to have.
        """
        test = self.condition(node.test)
        question = test.text if test.precedence > CHOICE else f"({test.text})"
        first, second = (
            self.guard_expression(self._write_branch, part, kind)
            for part in (node.body, node.orelse)
        )
        return ExpressionText(f"{question} ? {first} : {second}", CHOICE)

    def _write_branch(self, node: ast.expr, kind: Type) -> str:
        have = self.function.require_type(node)
        if have is not kind and is_number(kind):
            return self.cast(self.text(node), have, kind)
        return self.text_as(node, kind, OR)

    # ---------------------------------------------------------------------------------------------------- calls
    def arguments(self, nodes: Sequence[ast.expr]) -> tuple[list[str], list[Type]]:
        """Write arguments or items, with starred ones unpacked.

        Returns:
            Texts and types, one of each per argument.
        """

        def write(node: ast.expr) -> str:
            if not isinstance(node, ast.Starred):
                return self.text(node)
            text = self.text(node.value)
            return (
                text
                if isinstance(node.value, ast.Name)
                else self.hold(self.function.require_type(node.value), text)
            )

        texts: list[str] = []
        kinds: list[Type] = []
        for node, text in zip(nodes, self.order_operands(nodes, write), strict=True):
            if isinstance(node, ast.Starred):
                kind = self.function.require_type(node.value)
                assert isinstance(kind, Tuple)
                texts += [self.item(text, kind, index) for index in range(len(kind.parts))]
                kinds += kind.parts
            else:
                texts.append(text)
                kinds.append(self.function.require_type(node))
        return texts, kinds

    def call(self, node: ast.Call, function: Any, nodes: Sequence[ast.expr]) -> ExpressionText:
        """Return the text of a call.

        Args:
            node: the call.
            function: the function that is called.
            nodes: syntax trees of the arguments.
        """
        texts, kinds = self.arguments(nodes)
        if (intrinsic := self.function.intrinsic(function)) is not None:
            result = self.function.require_type(node)
            text = intrinsic.write(texts, kinds, result)
            return ExpressionText(text)
        if is_record_class(function):
            kind = self.function.require_type(node)
            assert isinstance(kind, Tuple)
            for name in function._fields[len(texts) :]:
                default = function._field_defaults[name]
                texts.append(self.constant(f"{function.__name__}_{name}", default).text)
                kinds.append(self._constant_type(default))
            return ExpressionText(self.build(kind, texts, kinds))
        if isinstance(function, FunctionType):
            complete = self.function.complete_arguments(function, tuple(kinds))
            # Defaults are values of the Python function; C++ functions have none.
            defaults = (
                (function.__defaults__ or ())[len(kinds) - len(complete) :]
                if len(complete) > len(kinds)
                else ()
            )
            texts += [
                self.constant(f"{function.__name__}_default", value).text for value in defaults
            ]
            callee = self.function.specialise(function, complete)
            # Functions as arguments are part of the specialisation.
            argument_texts = [
                text
                for text, kind in zip(texts, complete, strict=True)
                if not isinstance(kind, Callee)
            ]
            return ExpressionText(
                f"{self.names.name_function(callee)}({', '.join(argument_texts)})"
            )
        raise self.function.refuse(node)

    @staticmethod
    def _constant_type(value: Any) -> Type:
        kind = type_of_constant(value)
        assert kind is not None
        return kind
