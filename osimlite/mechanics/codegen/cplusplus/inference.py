"""Types of the variables and expressions of one function, for known types of its arguments.

A function is inferred again and again until no type changes, since in a loop a variable may be used
before the statement that determines its type. Annotations are ignored, because one force law serves
floats and numbers with derivatives.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Sequence
from types import FunctionType, ModuleType
from typing import Any

from osimlite.mechanics.codegen.cplusplus.intrinsics import INTRINSICS, Intrinsic
from osimlite.mechanics.codegen.cplusplus.types import (
    BOOLEAN,
    FLOAT,
    INTEGER,
    VOID,
    Callee,
    Dual,
    Pointer,
    Tuple,
    Type,
    is_integral,
    is_number,
    join_types,
    tuple_of,
    type_of_constant,
)
from osimlite.mechanics.codegen.reader import Function, Kernel
from osimlite.mechanics.kernels.layout import Record

MAX_ROUNDS = 20
"""Largest number of rounds of inference in one function; a round without change is the last."""
INTEGER_OPERATORS = ast.BitAnd, ast.BitOr, ast.BitXor, ast.LShift, ast.RShift
"""Operators that only integers have."""


READS = 1
"""Bit of an expression that may read memory: it must stay behind earlier writes."""
WRITES = 2
"""Bit of an expression that may write memory: it must keep its order among other expressions."""


class Specialisation(Kernel):
    """Function for known types of its arguments.

    Attributes:
        variables: types of arguments and local variables by name.
        result: type of the result of the function.
        effects: effects of a call on memory, as bits of READS and WRITES.

    Args:
        function: function to specialise.
        arguments: types of the arguments of the function.
        specialise: function that returns the specialisation of a function that this one calls.
    """

    def __init__(
        self,
        function: Function,
        arguments: Sequence[Type],
        specialise: Callable[[FunctionType, Sequence[Type]], Specialisation],
    ) -> None:
        super().__init__(function, "C++")
        self.specialise = specialise
        self.arguments = tuple(arguments)
        if len(self.arguments) != len(self.argument_names):
            raise self.refuse(self.tree.args, f"called with {len(self.arguments)} arguments")
        for node in (
            self.tree.args.kwonlyargs,
            self.tree.args.vararg,
            self.tree.args.kwarg,
            self.tree.args.posonlyargs,
        ):
            if node:
                raise self.refuse(self.tree.args)
        self.variables: dict[str, Type | None] = dict(
            zip(self.argument_names, arguments, strict=True)
        )
        self.result: Type | None = None
        self.effects = 0
        self._locals = frozenset((*self.argument_names, *self.local_names))
        self._types: dict[ast.expr, Type | None] = {}
        self._effects: dict[ast.AST, int] = {}
        self._infer()

    # --------------------------------------------------------------------------------------------- fixed point
    def _infer(self) -> None:
        for _ in range(MAX_ROUNDS):
            # Types only become wider from round to round, so that the iteration ends.
            before = dict(self.variables), self.result
            # A variable may have become wider: infer all types again.
            self._types.clear()
            for statement in self.body:
                self._infer_statement(statement)
            if (self.variables, self.result) == before:
                break
        else:
            raise self.refuse(self.tree.args, f"its types do not converge in {MAX_ROUNDS} rounds")
        if self.result is None:
            self.result = VOID
        # C++ does not define what such a function returns.
        elif not leaves(self.body):
            raise self.refuse(self.body[-1], "the function may end without returning a value")

    def _infer_statement(self, node: ast.stmt) -> None:
        match node:
            case ast.Assign(targets=targets, value=value):
                kind = self.type_of(value)
                if kind is VOID:
                    raise self.refuse(value, "it has no value")
                for target in targets:
                    self._assign(target, kind)
            case ast.AnnAssign(target=target, value=ast.expr() as value):
                self._assign(target, self.type_of(value))
            case ast.AugAssign(target=ast.Name() | ast.Subscript() as target, op=op, value=value):
                self._assign(target, self._type_of_operation(node, to_load(target), op, value))
            case ast.Return(value=None) | ast.Expr(value=ast.Constant()):
                pass
            case ast.Return(value=ast.expr() as value):
                self.result = self._join(value, self.result, self.type_of(value))
            case ast.Expr(value=value):
                self.type_of(value)
            case ast.If(test=test, body=body, orelse=others):
                self.type_of(test)
                for statement in (*body, *others):
                    self._infer_statement(statement)
            case ast.While(test=test, body=body, orelse=[]):
                self.type_of(test)
                for statement in body:
                    self._infer_statement(statement)
            case ast.For(target=ast.Name() as target, iter=iterated, body=body, orelse=[]):
                self._infer_loop(target, iterated)
                for statement in body:
                    self._infer_statement(statement)
            case ast.Break() | ast.Continue() | ast.Pass():
                pass
            case _:
                raise self.refuse(node)

    def _infer_loop(self, target: ast.Name, iterated: ast.expr) -> None:
        if self.is_range(iterated):
            assert isinstance(iterated, ast.Call)
            for bound in iterated.args:
                if not is_integral(self.type_of(bound)):
                    raise self.refuse(bound, "a bound of range() is no integer")
            self._assign(target, INTEGER)
        elif isinstance(iterated, ast.Tuple):
            for part in iterated.elts:
                self._assign(target, self.type_of(part))
        else:
            raise self.refuse(
                iterated, "a loop is over range() or over a tuple that is written out"
            )

    def _assign(self, target: ast.expr, kind: Type | None) -> None:
        # Python's convention for a value that is not used.
        match target:
            case ast.Name(id="_"):
                pass
            case ast.Name(id=name):
                self.variables[name] = self._join(target, self.variables.get(name), kind)
            case ast.Tuple(elts=parts) if kind is not None:
                if not isinstance(kind, Tuple) or len(kind.parts) != len(parts):
                    raise self.refuse(target, f"what is unpacked is {kind!r}")
                for part, part_type in zip(parts, kind.parts, strict=True):
                    self._assign(part, part_type)
            case ast.Tuple():
                pass
            case ast.Subscript(value=vector):
                element = self.type_of(to_load(target))
                # Tuples are values in C++, and cannot be changed in place.
                if element is not None and not isinstance(self.type_of(vector), Pointer):
                    raise self.refuse(target, "an item of a tuple is assigned")
                self.effects |= WRITES
                if (
                    kind is not None
                    and element is not None
                    and join_types(element, kind) is not element
                ):
                    raise self.refuse(target, f"{kind!r} is stored in a vector of {element!r}")
            case _:
                raise self.refuse(target)

    def _join(self, node: ast.AST, one: Type | None, two: Type | None) -> Type | None:
        try:
            return join_types(one, two)
        except TypeError as error:
            raise self.refuse(node, str(error)) from None

    # --------------------------------------------------------------------------------------------- expressions
    def type_of(self, node: ast.expr) -> Type | None:
        """Return the type of an expression; None where it is not known yet."""
        if node in self._types:
            return self._types[node]
        kind = self._types[node] = self._type_of(node)
        return kind

    def require_type(self, node: ast.expr) -> Type:
        """Return the type of an expression.

        Raises:
            TranslationError: the type does not follow from anything.
        """
        kind = self.type_of(node)
        if kind is None:
            raise self.refuse(node, "its type is not known")
        return kind

    def _type_of(self, node: ast.expr) -> Type | None:
        match node:
            case ast.Constant(value=value):
                return self._type_of_constant(node, value)
            case ast.Name(id=name) if name in self.variables:
                return self.variables[name]
            case ast.Name(id=name) if name in self._locals:
                return None
            case ast.Name():
                return self._type_of_constant(node, self.value(node))
            case ast.Attribute(value=owner, attr=name):
                if (value := self.value(node)) is not None:
                    return self._type_of_constant(node, value)
                kind = self.type_of(owner)
                if kind is None:
                    return None
                if (
                    isinstance(kind, Tuple)
                    and kind.record is not None
                    and name in kind.record._fields
                ):
                    return kind.parts[kind.record._fields.index(name)]
                raise self.refuse(node)
            case ast.Tuple(elts=parts):
                items = self.infer_types(parts)
                return None if items is None else tuple_of(items)
            case ast.Subscript(value=owner, slice=index):
                return self._type_of_item(node, owner, index)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                self._check_number(operand)
                return BOOLEAN
            case ast.UnaryOp(op=op, operand=operand):
                kind = self._check_number(operand)
                if isinstance(op, ast.Invert) and kind is not None and not is_integral(kind):
                    raise self.refuse(node)
                return INTEGER if kind is BOOLEAN else kind
            case ast.BinOp(left=left, op=op, right=right):
                return self._type_of_operation(node, left, op, right)
            case ast.BoolOp(values=values):
                return self._join_all(node, [self._check_number(value) for value in values])
            case ast.Compare(left=left, ops=ops, comparators=others):
                for comparison, part in zip((None, *ops), (left, *others), strict=True):
                    if isinstance(comparison, ast.In | ast.NotIn):
                        if not isinstance(part, ast.Tuple):
                            raise self.refuse(node, "'in' asks a tuple that is written out")
                        for item in part.elts:
                            self._check_number(item)
                    elif isinstance(comparison, ast.Is | ast.IsNot):
                        raise self.refuse(node)
                    else:
                        self._check_number(part)
                return BOOLEAN
            case ast.IfExp(test=test, body=body, orelse=other):
                self._check_number(test)
                return self._join(node, self.type_of(body), self.type_of(other))
            case ast.Call(func=function, args=arguments, keywords=[]):
                return self._type_of_call(node, self.resolve_call(function), arguments)
        raise self.refuse(node)

    def _check_number(self, node: ast.expr) -> Type | None:
        kind = self.type_of(node)
        if kind is not None and not is_number(kind):
            raise self.refuse(node, f"{kind!r} is no number")
        return kind

    def _join_all(self, node: ast.expr, kinds: Sequence[Type | None]) -> Type | None:
        result: Type | None = None
        for kind in kinds:
            result = self._join(node, result, kind)
        return result

    def _type_of_constant(self, node: ast.expr, value: Any) -> Type:
        kind = type_of_constant(value)
        if kind is None:
            raise self.refuse(
                node,
                f"{type(value).__name__} is no number" if value is not None else "it is not known",
            )
        return kind

    def _type_of_item(self, node: ast.expr, owner: ast.expr, index: ast.expr) -> Type | None:
        kind = self.type_of(owner)
        if isinstance(index, ast.Slice):
            raise self.refuse(node, "write at(vector, index)")
        index_kind = self.type_of(index)
        if index_kind is not None and not is_integral(index_kind):
            raise self.refuse(node, f"the index is {index_kind!r}")
        if isinstance(kind, Pointer):
            if self.is_negative(index):
                raise self.refuse(node, "a vector has no last item")
            self.effects |= READS
            return kind.element
        if isinstance(kind, Tuple):
            item_index = self.constant_index(index)
            if item_index is None:
                if not kind.is_array:
                    raise self.refuse(node, "its type depends on the index")
                return kind.parts[0]
            if not -len(kind.parts) <= item_index < len(kind.parts):
                raise self.refuse(node, "there is no such item")
            return kind.parts[item_index]
        if kind is not None:
            raise self.refuse(node, f"{kind!r} has no items")
        return None

    def _type_of_operation(
        self, node: ast.AST, left: ast.expr, op: ast.operator, right: ast.expr
    ) -> Type | None:
        one, two = self._check_number(left), self._check_number(right)
        if one is None or two is None:
            # A loop may use a variable before it is known whether integers or floats are stored in
            # it.
            one = two = one or two
        if one is None or two is None:
            return None
        kind = self._join(node, one, two)
        if isinstance(op, ast.Div):
            return kind if isinstance(kind, Dual) else FLOAT
        if isinstance(op, INTEGER_OPERATORS):
            if not is_integral(kind):
                raise self.refuse(node, f"{kind!r} has no bits")
            return kind if isinstance(op, ast.BitAnd | ast.BitOr | ast.BitXor) else INTEGER
        if isinstance(op, ast.FloorDiv) and isinstance(kind, Dual):
            raise self.refuse(node, "it has no derivatives")
        if isinstance(op, ast.MatMult):
            raise self.refuse(node)
        if isinstance(op, ast.Pow) and is_integral(kind) and self.is_negative(right):
            return FLOAT
        return INTEGER if kind is BOOLEAN else kind

    def _type_of_call(
        self, node: ast.Call, function: Any, arguments: Sequence[ast.expr]
    ) -> Type | None:
        kinds = self.infer_types(arguments)
        if isinstance(function, FunctionType) and function not in INTRINSICS:
            if kinds is None:
                return None
            callee = self.specialise(function, self.complete_arguments(function, kinds))
            self.effects |= callee.effects
            return callee.result
        if is_record_class(function):
            if kinds is None:
                return None
            kinds = self.complete_fields(function, kinds)
            if len(kinds) != len(function._fields):
                raise self.refuse(node, f"{function.__name__} has {len(function._fields)} fields")
            return tuple_of(kinds, function)
        intrinsic = self.intrinsic(function)
        if intrinsic is None:
            raise self.refuse(node)
        if intrinsic.has_effects:
            self.effects |= READS | WRITES
        if kinds is None:
            return intrinsic.early
        try:
            return intrinsic.infer(self, arguments, kinds)
        except TypeError as error:
            raise self.refuse(node, str(error)) from None

    # ------------------------------------------------------------------------------------------ what names mean
    def value(self, node: ast.expr) -> Any:
        """Return the value of a global name, or of an attribute of a record or module.

        A name without a value there, as of a local variable, gives None.

        Args:
            node: name or attribute.
        """
        if isinstance(node, ast.Attribute):
            owner = (
                self.value(node.value) if isinstance(node.value, ast.Name | ast.Attribute) else None
            )
            return (
                getattr(owner, node.attr, None) if isinstance(owner, Record | ModuleType) else None
            )
        if not isinstance(node, ast.Name) or node.id in self._locals:
            return None
        scope = self.function.__globals__
        return scope[node.id] if node.id in scope else getattr(builtins, node.id, None)

    def resolve_call(self, node: ast.expr) -> Any:
        """Return the function that is called, which may be one that was passed as an argument."""
        if isinstance(node, ast.Name) and isinstance(kind := self.variables.get(node.id), Callee):
            return kind.function
        return self.value(node)

    def intrinsic(self, function: Any) -> Intrinsic | None:
        """Return the rules of a function that is not a kernel, None if it has no counterpart."""
        try:
            return INTRINSICS.get(function)
        # Values that cannot be hashed are no functions.
        except TypeError:
            return None

    def is_range(self, node: ast.expr) -> bool:
        """Return whether an expression is a call of range()."""
        return isinstance(node, ast.Call) and not node.keywords and self.value(node.func) is range

    def constant_index(self, node: ast.expr) -> int | None:
        """Return the value of an expression that is an integer when the code is generated.

        Such are literals, with or without a minus sign, and names and attributes whose value is an
        integer, such as fields of layouts.

        Args:
            node: the expression.

        Returns:
            Value of the expression; None if it is computed at run time, or is no integer.
        """
        match node:
            case ast.Constant(value=int() as value):
                return value
            case ast.UnaryOp(op=ast.USub(), operand=ast.Constant(value=int() as value)):
                return -value
            case ast.Name() | ast.Attribute():
                value = self.value(node)
                return value if isinstance(value, int) else None
        return None

    def is_negative(self, node: ast.expr | None) -> bool:
        """Return whether an expression is a negative integer constant."""
        return node is not None and (self.constant_index(node) or 0) < 0

    def infer_types(self, nodes: Sequence[ast.expr]) -> tuple[Type, ...] | None:
        """Infer the types of arguments or items, with starred ones unpacked.

        Returns:
            One type per argument, or None while one of them is not known.
        """
        result: list[Type | None] = []
        for node in nodes:
            if isinstance(node, ast.Starred):
                kind = self.type_of(node.value)
                if kind is not None and not isinstance(kind, Tuple):
                    raise self.refuse(node, f"{kind!r} is no tuple")
                result += kind.parts if isinstance(kind, Tuple) else [None]
            else:
                result.append(self.type_of(node))
        types = tuple(kind for kind in result if kind is not None)
        return types if len(types) == len(result) else None

    @staticmethod
    def complete_arguments(function: FunctionType, kinds: tuple[Type, ...]) -> tuple[Type, ...]:
        """Return the types of all arguments of a call, including those left at their defaults.

        Defaults count with the types of their values.

        Args:
            function: the called function.
            kinds: types of the arguments that are written.

        Returns:
            One type per parameter.
        """
        missing_count = function.__code__.co_argcount - len(kinds)
        defaults = (function.__defaults__ or ())[-missing_count:] if missing_count > 0 else ()
        return kinds + tuple(kind for kind in map(type_of_constant, defaults) if kind is not None)

    @staticmethod
    def complete_fields(record: Any, kinds: tuple[Type, ...]) -> tuple[Type, ...]:
        """Return the types of all fields of a new named tuple, including those with defaults.

        Args:
            record: class of named tuples.
            kinds: types of the fields that are written.

        Returns:
            One type per field.
        """
        missing_fields = record._fields[len(kinds) :]
        defaults = [
            type_of_constant(record._field_defaults[name])
            for name in missing_fields
            if name in record._field_defaults
        ]
        return kinds + tuple(kind for kind in defaults if kind is not None)

    # ------------------------------------------------------------------------------------------------- effects
    def effects_of(self, node: ast.AST) -> int:
        """Return the effects of an expression on memory, as bits of READS and WRITES."""
        if node not in self._effects:
            effect = self._direct_effect(node)
            for child in ast.iter_child_nodes(node):
                effect |= self.effects_of(child)
            self._effects[node] = effect
        return self._effects[node]

    def _direct_effect(self, node: ast.AST) -> int:
        if isinstance(node, ast.Subscript):
            return READS if isinstance(self.type_of(node.value), Pointer) else 0
        if isinstance(node, ast.Call):
            function = self.resolve_call(node.func)
            if (intrinsic := self.intrinsic(function)) is not None:
                # A law that is called by address may do anything.
                return READS | WRITES if intrinsic.has_effects else 0
            kinds = self.infer_types(node.args)
            if isinstance(function, FunctionType) and kinds is not None:
                return self.specialise(function, self.complete_arguments(function, kinds)).effects
        return 0


def is_record_class(value: Any) -> bool:
    """Return whether a value is a class of named tuples."""
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields")


def to_load(node: ast.expr) -> ast.expr:
    """Return the expression that reads what a target of an assignment stores."""
    if isinstance(node, ast.Name):
        return ast.copy_location(ast.Name(node.id, ast.Load()), node)
    if isinstance(node, ast.Subscript) and not isinstance(node.ctx, ast.Load):
        return ast.copy_location(ast.Subscript(node.value, node.slice, ast.Load()), node)
    return node


def leaves(body: Sequence[ast.stmt]) -> bool:
    """Return whether a block always ends by a return statement."""
    match body[-1] if body else None:
        case ast.Return():
            return True
        case ast.If(body=first, orelse=second):
            return leaves(first) and leaves(second)
        case ast.While(test=ast.Constant(value=True), body=inner):
            return not any(map(_breaks, inner))
    return False


def _breaks(node: ast.stmt) -> bool:
    """Return whether a statement may end the loop that it is in."""
    match node:
        case ast.Break():
            return True
        case ast.If(body=body, orelse=others):
            return any(map(_breaks, (*body, *others)))
    return False
