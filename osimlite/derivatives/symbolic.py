"""Conversion of kernels to Python functions that run on symbols.

The code stays the same; its operators, branches and calls are rewritten into calls of helpers,
which build CasADi expressions.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from osimlite.derivatives import branches, symbols
from osimlite.derivatives.curves import (
    evaluate_curve,
    evaluate_pieces,
    solve_damped_velocity,
)
from osimlite.derivatives.symbols import COUNTERPARTS, UNSET, NoFormula, RecordedVector
from osimlite.mechanics.codegen.reader import (
    Function,
    Kernel,
    copy_tree,
    list_assigned_names,
    name_of,
)
from osimlite.mechanics.kernels import pointers
from osimlite.mechanics.kernels.functions import evaluate_piecewise
from osimlite.mechanics.laws.bezier import curve_value
from osimlite.mechanics.laws.dual_numbers import is_exact_zero
from osimlite.mechanics.laws.millard2012_equilibrium import find_damped_velocity
from osimlite.mechanics.laws.rotations import sine_cosine

HELPERS = {
    "plus_": symbols.plus,
    "minus_": symbols.minus,
    "times_": symbols.times,
    "divide_": symbols.divide,
    "power_": symbols.power,
    "both_": symbols.logical_and,
    "either_": symbols.logical_or,
    "negated_": symbols.logical_not,
    "choose_": symbols.select_value,
    "branch_": branches.AssigningBranch,
    "decide_": branches.decide,
    "fails_": branches.record_failure,
    "unset_": UNSET,
}
"""Helper functions that the rewritten code calls."""

EXIT_STATEMENTS = ast.Return, ast.Break, ast.Continue
"""Statements that leave a function or a loop."""
OPERATOR_HELPERS: dict[type, str] = {
    ast.Add: "plus_",
    ast.Sub: "minus_",
    ast.Mult: "times_",
    ast.Div: "divide_",
    ast.Pow: "power_",
}
"""Helper function of each arithmetic operator."""


def _slice_vector(vector: Any, start: int) -> Any:
    """Return the part of a vector that begins at an index."""
    return vector.get_tail(start) if isinstance(vector, RecordedVector) else vector[start:]


def _call_law(address: int, *arguments: Any) -> int:
    """Run the law at an address on symbols.

    Args:
        address: number of the law.
        arguments: arguments of the law; the last one is the offset of the item.

    Returns:
        Outcome of the law.

    Raises:
        NoFormula: the law has no formula; the error collects the items of the calls.
    """
    law = pointers.laws[address]
    try:
        result: int = branches.run_all_branches(
            f"the law {name_of(law)}", make_symbolic(law), *arguments
        )
    except NoFormula as error:
        # The last argument is the item of the force, from which the message finds its name.
        error.items.append(arguments[-1])
        raise
    return result


_counterparts: dict[Any, Any] = {
    pointers.at: _slice_vector,
    pointers.call: _call_law,
    sine_cosine: symbols.sine_cosine,
    is_exact_zero: symbols.is_zero,
    curve_value: evaluate_curve,
    find_damped_velocity: solve_damped_velocity,
    evaluate_piecewise: evaluate_pieces,
}
"""Symbolic counterparts of the functions that were used so far."""


def make_symbolic(function: Any) -> Any:
    """Return a kernel or law as a function that takes symbols too.

    Args:
        function: function in the restricted Python of kernels.

    Raises:
        NotImplementedError: the code contains something that has no meaning for symbols.
    """
    if function not in _counterparts:
        writer = _KernelRewriter(function, "formula")
        rewritten = writer.compile_function()
        _counterparts[function] = rewritten
    return _counterparts[function]


@contextmanager
def replace_kernel(function: Any, replacement: Any) -> Iterator[None]:
    """Call another function instead of a kernel on symbols within a block.

    Args:
        function: the kernel.
        replacement: the function that replaces it.
    """
    original = make_symbolic(function)
    _counterparts[function] = replacement
    try:
        yield
    finally:
        _counterparts[function] = original


def register_symbolic(function: Any) -> Any:
    """Register a function that takes symbols as it is, and return it.

    Returns:
        The function itself, so that this can be a decorator.
    """
    _counterparts[function] = function
    return function


class _KernelScope(dict[str, Any]):
    """Names of a module with their symbolic counterparts, which are made when they are first called."""

    def __init__(self, function: Any) -> None:
        super().__init__(HELPERS, __builtins__=builtins)
        for name in function.__code__.co_names:
            value = function.__globals__.get(name, getattr(builtins, name, None))
            if _is_package_function(value):
                self[name] = _LazyFunction(value)
            elif (isinstance(value, type) and value not in COUNTERPARTS) or not callable(value):
                self[name] = value
            else:
                self[name] = COUNTERPARTS.get(value, value)


class _LazyFunction:
    """Function of the package whose counterpart is made when it is first called."""

    def __init__(self, function: Any) -> None:
        self.function = function

    def __call__(self, *arguments: Any) -> Any:
        return make_symbolic(self.function)(*arguments)


def _is_package_function(value: Any) -> bool:
    """Return whether a value is a function of this package."""
    return isinstance(value, FunctionType) and value.__module__.startswith("osimlite.")


class _KernelRewriter(Kernel, ast.NodeTransformer):
    """Rewriter of one function.

    Attributes:
        number: number of parts of the code so far, which name them in messages.
        returns_early: whether a branch returns or leaves a loop, so that all combinations are run.
        branch_variables: variables that are assigned in branches, and unset before.
    """

    def __init__(self, function: Function, language: str) -> None:
        super().__init__(function, language)
        self.number, self.returns_early = 0, False
        self.branch_variables: set[str] = set()

    def parse(self, function: Function) -> ast.FunctionDef:
        """Return a syntax tree that may be changed."""
        return copy_tree(super().parse(function))

    def compile_function(self) -> Any:
        """Return the rewritten function, compiled."""
        tree = self.tree
        body = [
            rewritten_statement
            for statement in self.body
            for rewritten_statement in self._wrap_list(self.visit(statement))
        ]
        # A variable that only one side assigns must exist on the other side, too.
        clear = [
            ast.Assign([_store_name(name)], _load_name("unset_"))
            for name in sorted(self.branch_variables - set(self.argument_names))
        ]
        tree.body = [*clear, *body]
        tree.returns = None
        tree.decorator_list = []
        for argument in tree.args.args:
            argument.annotation = None
        code = compile(
            ast.fix_missing_locations(ast.Module([tree], [])), f"<{self.name} on symbols>", "exec"
        )
        scope = _KernelScope(self.function)
        exec(code, scope)
        rewritten = scope[tree.name]
        return (
            (lambda *arguments: branches.run_all_branches(self.name, rewritten, *arguments))
            if self.returns_early
            else rewritten
        )

    @staticmethod
    def _wrap_list(node: Any) -> list[ast.stmt]:
        """Return one statement or several as a list."""
        return node if isinstance(node, list) else [node]

    # ------------------------------------------------------------------------------------------- expressions
    def _number_part(self, node: ast.AST) -> ast.Constant:
        """Return the name of the next part of the code, for messages and identity."""
        self.number += 1
        return ast.Constant(f"{self.name} {self.number}")

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        self.generic_visit(node)
        sign = OPERATOR_HELPERS.get(type(node.op))
        return _make_call(sign, node.left, node.right) if sign else node

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.expr:
        self.generic_visit(node)
        return _make_call(
            "both_" if isinstance(node.op, ast.And) else "either_", *map(_wrap_lambda, node.values)
        )

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.expr:
        self.generic_visit(node)
        return _make_call("negated_", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        self.generic_visit(node)
        # `a < b < c` becomes `a < b and b < c`, since the first test may be a symbol.
        if len(node.ops) == 1:
            return node
        operands = [node.left, *node.comparators]
        comparisons = zip(operands, node.ops, operands[1:], strict=False)
        return _make_call(
            "both_", *(_wrap_lambda(ast.Compare(a, [op], [b])) for a, op, b in comparisons)
        )

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        return _make_call(
            "choose_",
            node.test,
            _wrap_lambda(node.body),
            _wrap_lambda(node.orelse),
            self._number_part(node),
        )

    # -------------------------------------------------------------------------------------------- statements
    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        sign = OPERATOR_HELPERS.get(type(node.op))
        if sign is None:
            self.generic_visit(node)
            return node
        old_value: Any = copy_tree(node.target)
        old_value.ctx = ast.Load()
        return ast.Assign(
            [self.visit(node.target)],
            _make_call(sign, self.visit(old_value), self.visit(node.value)),
        )

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        assert node.value is not None
        return ast.Assign([node.target], self.visit(node.value))

    def visit_While(self, node: ast.While) -> ast.stmt:
        self.returns_early = True
        code_part = self._number_part(node)
        self.generic_visit(node)
        # A loop on symbols has no end that is known beforehand: each pass is a branch.
        node.test = _make_call("decide_", code_part, node.test)
        return node

    def visit_If(self, node: ast.If) -> Any:
        """Return the replacement of a branch: test of a failure, decision, or loop over its sides."""
        code_part = self._number_part(node)
        is_failure = self._is_failure(node)
        exits_early = any(map(_exits_block, (*node.body, *node.orelse)))
        names = list_assigned_names(*node.body, *node.orelse)
        self.generic_visit(node)
        if is_failure:
            # A failure needs no other side: results where it is true become NaN.
            node.test = _make_call("fails_", node.test)
            return node
        if exits_early:
            self.returns_early = True
            node.test = _make_call("decide_", code_part, node.test)
            return node
        # The branch becomes a loop over its sides:
        # for side in branch.sides():
        #     restore the variables; if side: ... else: ...; branch.ends.append(variables)
        self.branch_variables.update(names)
        branch_name, side_name, saved_name = (
            f"{name}{self.number}_" for name in ("branch", "side", "before")
        )
        self.number += 1
        test = node.test
        node.test = _load_name(side_name)
        append = ast.Attribute(
            ast.Attribute(_load_name(branch_name), "ends", ast.Load()), "append", ast.Load()
        )
        side_iterator = ast.Call(
            ast.Attribute(_load_name(branch_name), "sides", ast.Load()), [], []
        )
        restoring: list[ast.stmt] = [_assign_names(names, _load_name(saved_name))] if names else []
        assigning: list[ast.stmt] = (
            [_assign_names(names, ast.Attribute(_load_name(branch_name), "end", ast.Load()))]
            if names
            else []
        )
        recording = ast.Expr(ast.Call(append, [_load_tuple(names)], []))
        return [
            ast.Assign([_store_name(branch_name)], _make_call("branch_", code_part, test)),
            ast.Assign([_store_name(saved_name)], _load_tuple(names)),
            ast.For(_store_name(side_name), side_iterator, [*restoring, node, recording], []),
            *assigning,
        ]

    def _is_failure(self, node: ast.If) -> bool:
        """Return whether a branch only returns an error code.

        Kernels that return an outcome return anything but OK in this case. Such a branch is no
        alternative: the results are NaN where it is taken.

        Args:
            node: the branch.
        """
        match node:
            case ast.If(body=[ast.Return(value=ast.expr() as value)], orelse=[]):
                returns = self.tree.returns
                return_type = (
                    returns.value
                    if isinstance(returns, ast.Constant)
                    else getattr(returns, "id", "")
                )
                return return_type == "int" and ast.unparse(value) != "OUTCOME.OK"
        return False


def _exits_block(node: ast.AST) -> bool:
    """Return whether a statement returns, or leaves a loop around it."""
    if isinstance(node, EXIT_STATEMENTS):
        return True
    if isinstance(node, ast.For | ast.While):
        # A `break` in an inner loop leaves only that loop.
        return any(isinstance(child, ast.Return) for child in ast.walk(node))
    return any(map(_exits_block, ast.iter_child_nodes(node)))


def _load_name(name: str) -> ast.Name:
    """Return a name that is read."""
    return ast.Name(name, ast.Load())


def _store_name(name: str) -> ast.Name:
    """Return a name that is assigned."""
    return ast.Name(name, ast.Store())


def _load_tuple(names: list[str]) -> ast.Tuple:
    """Return a tuple of names that are read."""
    return ast.Tuple([_load_name(name) for name in names], ast.Load())


def _assign_names(names: list[str], value: ast.expr) -> ast.Assign:
    """Return the assignment of a tuple to names."""
    return ast.Assign([ast.Tuple([_store_name(name) for name in names], ast.Store())], value)


def _wrap_lambda(node: ast.expr) -> ast.Lambda:
    """Return an expression as a function without arguments."""
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), node)


def _make_call(function: str, *arguments: ast.expr) -> ast.Call:
    """Return a call of a helper function."""
    return ast.Call(_load_name(function), list(arguments), [])
