"""Functions of kernels as C++: statements, and definitions of variables."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Sequence
from functools import cache

from osimlite.mechanics.codegen.cplusplus.expressions import ExpressionWriter
from osimlite.mechanics.codegen.cplusplus.inference import WRITES, Specialisation, to_load
from osimlite.mechanics.codegen.cplusplus.operators import OPERATORS, Names, write_number
from osimlite.mechanics.codegen.cplusplus.types import (
    VOID,
    Callee,
    Pointer,
    Tuple,
    Type,
    is_integral,
    is_number,
)
from osimlite.mechanics.codegen.reader import Function, Kernel

INDENT = "    "
"""Indentation of one level."""


class FunctionWriter(ExpressionWriter):
    """Writer of one function.

    Args:
        function: function with the types of its variables and expressions.
        names: library that contains the function.
    """

    def __init__(self, function: Specialisation, names: Names) -> None:
        super().__init__(function, names)
        self._scopes = find_variable_scopes(function.function)

    def write(self, name: str) -> str:
        """Return the text of the function.

        Args:
            name: name of the function in C++.
        """
        function = self.function
        copies, parameters = [], []
        for parameter, kind in zip(function.argument_names, function.arguments, strict=True):
            variable_type = function.variables[parameter]
            if isinstance(kind, Callee) or variable_type is None:
                continue
            local = self.local(parameter)
            parameter_name = local if variable_type is kind else f"{local}_given"
            parameters.append(f"{self.names.name_type(kind)} {parameter_name}")
            if variable_type is not kind:
                # The function assigns a wider type to this parameter, so it needs a copy.
                copies.append(
                    f"{self.names.name_type(variable_type)} {local} = {self.convert(parameter_name, kind, variable_type)};"
                )
                copies[-1:-1] = self._take_pending()
        outer = [
            f"{self.names.name_type(outer_type)} {self.local(variable)};"
            for variable in self._scopes.outer
            if (outer_type := function.variables[variable]) is not None
            and not isinstance(outer_type, Callee)
        ]
        lines = [*copies, *outer, *self.block(function.body)]
        result = self.names.name_type(function.result or VOID)
        head = f"OSIMLITE_FUNCTION {result} {name}({', '.join(parameters)}) {{"
        return "\n".join((head, *(f"{INDENT}{line}" for line in lines), "}"))

    # ------------------------------------------------------------------------------------------------- blocks
    def block(self, body: Iterable[ast.stmt]) -> list[str]:
        """Return the lines of some statements, each after a comment with its Python."""
        lines: list[str] = []
        for statement in body:
            if isinstance(statement, ast.Pass) or (
                isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
            ):
                continue
            written = self.statement(statement)
            if written:
                lines += [f"// {describe_statement(statement)}", *self._take_pending(), *written]
        return lines

    def _take_pending(self) -> list[str]:
        lines, self.pending = self.pending, []
        return lines

    def inner_block(self, body: Sequence[ast.stmt]) -> list[str]:
        """Return the lines of the body of a compound statement, indented.

        Variables of the statement before the body must not be defined within it.
        """
        before, self.pending = self.pending, []
        lines = [f"{INDENT}{line}" for line in self.block(body)]
        self.pending = before
        return lines

    def statement(self, node: ast.stmt) -> list[str]:
        """Return the lines of one statement."""
        match node:
            case ast.Assign(targets=targets, value=value):
                return self.assign(node, targets, value)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                return self.assign(node, [target], value)
            case ast.AugAssign(target=target, op=op, value=value):
                return self.augment(node, target, op, value)
            case ast.Return(value=None):
                return ["return;"]
            case ast.Return(value=ast.expr() as value):
                assert self.function.result is not None
                return [f"return {self.text_as(value, self.function.result)};"]
            case ast.Expr(value=value):
                return [f"{self.text(value)};"]
            case ast.If():
                return self.branch(node)
            case ast.While():
                return [
                    f"while ({self.guard_expression(self._condition_of, node)}) {{",
                    *self.inner_block(node.body),
                    "}",
                ]
            case ast.For(target=ast.Name(id=name), iter=iterated, body=body):
                return self.loop(node, name, iterated, body)
            case ast.Break():
                return ["break;"]
            case ast.Continue():
                return ["continue;"]
        raise self.function.refuse(node)

    def branch(self, node: ast.If) -> list[str]:
        """Return the lines of an if statement."""
        lines = [f"if ({self._condition_of(node)}) {{", *self.inner_block(node.body)]
        others = node.orelse
        while len(others) == 1 and isinstance(after := others[0], ast.If):
            condition = self.guard_expression(self._condition_of, after)
            lines += [f"}} else if ({condition}) {{  // {describe_statement(after, 'elif')}"]
            lines += self.inner_block(after.body)
            others = after.orelse
        return [*lines, "} else {", *self.inner_block(others), "}"] if others else [*lines, "}"]

    def _condition_of(self, node: ast.If | ast.While) -> str:
        return self.condition(node.test).text

    # ------------------------------------------------------------------------------------------------- loops
    def loop(
        self, node: ast.For, name: str, iterated: ast.expr, body: Sequence[ast.stmt]
    ) -> list[str]:
        """Return the lines of a for statement.

        As in Python, assignments to the loop variable in the body do not affect the next round.

        Args:
            node: the statement.
            name: name of the loop variable.
            iterated: expression that the loop iterates over: a call of range() or a tuple.
            body: statements in the loop.
        """
        is_local = name == "_" or name in self._scopes.loop_variables.get(node, ())
        # A variable that is used after the loop, or assigned in it, needs a counter besides.
        counter = self.new_name("index") if name == "_" or not is_local else self.local(name)
        store = [] if is_local else [f"{INDENT}{self.local(name)} = {counter};"]
        if self.function.is_range(iterated):
            assert isinstance(iterated, ast.Call)
            head = self._range_head(counter, iterated.args, iterated)
        else:
            assert isinstance(iterated, ast.Tuple)
            kind = self._variable_type(name, iterated)
            items = self.order_operands(iterated.elts, self.text)
            parts = [
                self.cast(text, self.function.require_type(part), kind)
                for text, part in zip(items, iterated.elts, strict=True)
            ]
            array = self.new_name("items")
            type_name = self.names.name_type(kind)
            self.pending.append(f"const {type_name} {array}[] = {{{', '.join(parts)}}};")
            head = f"for (const {type_name} {counter} : {array})"
        return [f"{head} {{", *store, *self.inner_block(body), "}"]

    def _variable_type(self, name: str, iterated: ast.Tuple) -> Type:
        kind = self.function.variables.get(name) if name != "_" else None
        for part in iterated.elts:
            kind = kind or self.function.require_type(part)
        assert kind is not None
        return kind

    def _range_head(self, counter: str, bounds: Sequence[ast.expr], node: ast.expr) -> str:
        texts = self.order_operands(bounds, self.text)
        first, stop, step = ["0", *texts, "1"] if len(texts) == 1 else [*texts, "1"][:3]
        ends = ""
        stop_node = bounds[0] if len(bounds) == 1 else bounds[1]
        # Python evaluates the end once, before the loop.
        if self.function.constant_index(stop_node) is None:
            end = self.new_name(f"{counter}_end")
            ends = f", {end} = {stop}"
            stop = end
        start = f"int64_t {counter} = {first}{ends}"
        if len(texts) < 3:
            return f"for ({start}; {counter} < {stop}; ++{counter})"
        constant = self.function.constant_index(bounds[2])
        # Without a constant step its sign is known at run time only.
        if constant is None:
            step_name = self.new_name(f"{counter}_step")
            return (
                f"for ({start}, {step_name} = {step}; {step_name} > 0 ? {counter} < {stop} : {counter} > {stop}; "
                f"{counter} += {step_name})"
            )
        if constant == 0:
            raise self.function.refuse(node, "the step is 0")
        sign = "<" if constant > 0 else ">"
        return f"for ({start}; {counter} {sign} {stop}; {counter} += {write_number(constant)})"

    # ------------------------------------------------------------------------------------------- assignments
    def assign(self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        """Return the lines of an assignment to one target or several.

        Args:
            node: the assignment.
            targets: targets.
            value: assigned expression.
        """
        kind = self.function.require_type(value)
        if isinstance(kind, Callee):
            return []
        if len(targets) == 1 and not isinstance(targets[0], ast.Tuple):
            return self._assign_one(node, targets[0], value, kind)
        if isinstance(value, ast.Tuple) and self._are_separate(targets, value):
            return self._assign_items(node, targets, value)
        # Several targets, or a tuple that is unpacked: evaluate the value once.
        text = self.text(value)
        value_name = (
            text if is_number(kind) and isinstance(value, ast.Constant) else self.hold(kind, text)
        )
        lines = self._take_pending()
        return lines + [
            line for target in targets for line in self.store(node, target, value_name, kind)
        ]

    @staticmethod
    def _are_separate(targets: Sequence[ast.expr], value: ast.Tuple) -> bool:
        """Return whether single items are assigned, so that no tuple has to be made.

        Args:
            targets: targets.
            value: tuple of the values.
        """
        return all(isinstance(target, ast.Tuple) for target in targets) and not any(
            isinstance(part, ast.Starred) for part in value.elts
        )

    def _assign_one(
        self, node: ast.stmt, target: ast.expr, value: ast.expr, kind: Type
    ) -> list[str]:
        """Return the lines of C++ that assign one value to one name or item.

        Args:
            node: the assignment in Python.
            target: name or item of an array.
            value: assigned expression.
            kind: type of the value.
        """
        if isinstance(target, ast.Name):
            # A variable that is never read has no type; its value counts only for its effects.
            declared_type = self.function.variables.get(target.id)
            if declared_type is None:
                return [f"{self.text(value)};"] if self.function.effects_of(value) & WRITES else []
            return [
                f"{self._definition(node, target.id)}{self.local(target.id)} = {self.text_as(value, declared_type)};"
            ]
        # C++17 evaluates the value before the target of an assignment, as Python does.
        text = self.text(value)
        return [f"{self.text(target)} = {text};"]

    def _assign_items(
        self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.Tuple
    ) -> list[str]:
        """Return the lines of a tuple assignment.

        All values are computed before the first one is stored.

        Args:
            node: the assignment.
            targets: tuples of targets.
            value: tuple of the values.
        """
        first = targets[0]
        assert isinstance(first, ast.Tuple)
        stored = {part.id for part in first.elts if isinstance(part, ast.Name)}
        lines: list[str] = []
        if len(targets) == 1 and self._is_independent(first, value, stored):
            for target, part in zip(first.elts, value.elts, strict=True):
                item_lines = self._assign_one(node, target, part, self.function.require_type(part))
                lines += [*self._take_pending(), *item_lines]
            return lines
        value_names = []
        for part in value.elts:
            text = self.text(part)
            value_names.append(
                text
                if isinstance(part, ast.Constant)
                else self.hold(self.function.require_type(part), text)
            )
            lines += self._take_pending()
        for target in targets:
            assert isinstance(target, ast.Tuple)
            for target_part, text, part in zip(target.elts, value_names, value.elts, strict=True):
                lines += self.store(node, target_part, text, self.function.require_type(part))
        return lines

    def _is_independent(self, target: ast.Tuple, value: ast.Tuple, stored: set[str]) -> bool:
        """Return whether each value may be stored as soon as it is computed.

        It may if no target occurs in the values.
        """
        if not all(isinstance(part, ast.Name) and part.id != "_" for part in target.elts):
            return False
        used = {node.id for node in ast.walk(value) if isinstance(node, ast.Name)}
        return len(stored) == len(target.elts) and not used & stored

    def store(self, node: ast.stmt, target: ast.expr, text: str, kind: Type) -> list[str]:
        """Return the lines that store a value in a target.

        Args:
            node: the assignment.
            target: variable, item of a vector, or tuple of these.
            text: text of the value, which costs nothing to evaluate again.
            kind: type of the value.
        """
        if isinstance(kind, Callee):
            return []
        match target:
            case ast.Name(id="_"):
                return []
            case ast.Name(id=name):
                variable_type = self.function.variables[name]
                assert variable_type is not None
                return [
                    f"{self._definition(node, name)}{self.local(name)} = {self.convert(text, kind, variable_type)};"
                ]
            case ast.Tuple(elts=parts):
                assert isinstance(kind, Tuple)
                lines = []
                for index, part in enumerate(parts):
                    lines += self.store(node, part, self.item(text, kind, index), kind.parts[index])
                return lines
        line = f"{self.text(target)} = {text};"
        return [*self._take_pending(), line]

    def _definition(self, node: ast.stmt, name: str) -> str:
        """Return the type before a variable where it is defined, and an empty text elsewhere.

        Args:
            node: the assignment.
            name: name of the variable.
        """
        if self._scopes.definitions.get(name) is not node:
            return ""
        kind = self.function.variables[name]
        assert kind is not None
        constant = (
            "const " if name in self._scopes.constants and not isinstance(kind, Pointer) else ""
        )
        return f"{constant}{self.names.name_type(kind)} "

    def augment(
        self, node: ast.AugAssign, target: ast.expr, op: ast.operator, value: ast.expr
    ) -> list[str]:
        """Return the lines of an augmented assignment.

        Args:
            node: the statement.
            target: variable or item of a vector that is changed.
            op: operator of the assignment.
            value: expression on the right side.
        """
        kinds = [self.function.require_type(to_load(target)), self.function.require_type(value)]
        is_written = bool(self.function.effects_of(value) & WRITES)
        if isinstance(target, ast.Subscript):
            target_text = (
                f"{self.text(target.value)}[{self._store_index(target.slice, is_written)}]"
            )
        else:
            target_text = self.text(target)
        # Python reads the target before it evaluates the right side, which may change it.
        before = (
            self.hold(kinds[0], target_text)
            if is_written and isinstance(target, ast.Subscript)
            else target_text
        )
        is_direct = type(op) in OPERATORS and not (
            isinstance(op, ast.Div) and all(map(is_integral, kinds))
        )
        if is_direct and before == target_text:
            return [f"{target_text} {OPERATORS[type(op)][0]}= {self.text(value)};"]
        texts = [before, self._operand(value, op, is_right=True)]
        return [f"{target_text} = {self.operation(texts, op, kinds, node).text};"]

    def _store_index(self, node: ast.expr, is_written: bool) -> str:
        text = self.text(node)
        if self.function.effects_of(node) and is_written:
            return self.hold(self.function.require_type(node), text)
        return text


class VariableScopes:
    """Position of the definition of each variable of a function.

    A variable is defined by the assignment to it, by its loop, or before all statements.

    Attributes:
        definitions: the statement that defines a variable by its first assignment.
        loop_variables: the variables that are defined by a loop.
        outer: variables that are defined before the first statement.
        constants: variables that only one statement stores.
    """

    def __init__(self, function: Kernel) -> None:
        self.definitions: dict[str, ast.stmt] = {}
        self.loop_variables: dict[ast.stmt, set[str]] = {}
        self.outer: list[str] = []
        self._names: dict[ast.AST, set[str]] = {}
        stores: dict[str, int] = {}
        for statement in function.body:
            for node in ast.walk(statement):
                if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                    stores[node.id] = stores.get(node.id, 0) + 1
        # A variable with a single assignment may be constant in C++.
        self.constants = {name for name, count in stores.items() if count == 1}
        self._find_scopes(function.body, [name for name in function.local_names if name != "_"])

    def _find_used_names(self, node: ast.AST) -> set[str]:
        """Return the names of all variables in a part of the function."""
        if node not in self._names:
            names = {node.id} if isinstance(node, ast.Name) else set()
            self._names[node] = names.union(*map(self._find_used_names, ast.iter_child_nodes(node)))
        return self._names[node]

    def _find_scopes(self, body: Sequence[ast.stmt], names: Sequence[str]) -> None:
        """Find the position of variables that are used in one block only.

        Args:
            body: statements of the block.
            names: names of the variables.
        """
        for name in names:
            users = [statement for statement in body if name in self._find_used_names(statement)]
            first = users[0]
            if len(users) == 1 and self._find_scope_within(first, name):
                continue
            if self._defines(first, name):
                self.definitions[name] = first
            else:
                # It may keep its value from one round of a loop to the next, or from one branch to
                # another.
                self.outer.append(name)

    def _find_scope_within(self, node: ast.stmt, name: str) -> bool:
        """Find the position of a variable that is used in one compound statement only.

        Args:
            node: the statement.
            name: name of the variable.

        Returns:
            Whether it can be defined within the statement.
        """
        blocks = [
            block
            for field in ("body", "orelse")
            for block in [getattr(node, field, None)]
            if isinstance(block, list)
        ]
        heads = [child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.stmt)]
        if (
            isinstance(node, ast.For)
            and isinstance(node.target, ast.Name)
            and node.target.id == name
        ):
            stored = {
                part.id
                for statement in node.body
                for part in ast.walk(statement)
                if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)
            }
            # The variable of a range loop is defined by the loop, if the body does not assign it.
            if name in stored or name in self._find_used_names(node.iter):
                return False
            self.loop_variables.setdefault(node, set()).add(name)
            return True
        if any(name in self._find_used_names(head) for head in heads):
            return False
        users = [
            block
            for block in blocks
            if any(name in self._find_used_names(statement) for statement in block)
        ]
        if len(users) != 1:
            return False
        self._find_scopes(users[0], [name])
        return True

    def _defines(self, node: ast.stmt, name: str) -> bool:
        """Return whether an assignment gives a variable its first value without using it."""
        match node:
            case ast.Assign(targets=targets, value=value):
                pass
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                targets = [target]
            case _:
                return False
        parts = [part for target in targets for part in ast.walk(target)]
        count = sum(isinstance(part, ast.Name) and part.id == name for part in parts)
        return count == 1 and name not in self._find_used_names(value)


@cache
def find_variable_scopes(function: Function) -> VariableScopes:
    """Return the positions of the definitions of all variables of a function."""
    return VariableScopes(Kernel(function, "C++"))


@cache
def describe_statement(node: ast.stmt, keyword: str = "") -> str:
    """Return the Python text of a statement in one line; of a compound one the head only.

    Args:
        node: the statement.
        keyword: replacement of `if`, such as `elif`; empty for the statement as it is.
    """
    match node:
        case ast.If(test=test):
            text = f"{keyword or 'if'} {ast.unparse(test)}:"
        case ast.While(test=test):
            text = f"while {ast.unparse(test)}:"
        case ast.For(target=target, iter=iterated):
            text = f"for {ast.unparse(target)} in {ast.unparse(iterated)}:"
        case _:
            text = ast.unparse(node)
    return " ".join(text.split())
