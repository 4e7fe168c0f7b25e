"""Execution of code that branches on symbols, so that the result holds on both sides.

A branch whose sides only assign is run for both sides, and the assigned values are merged
(`AssigningBranch`). Where a side returns or leaves a loop, the complete function is run once for each
combination of sides (`run_all_branches`). Values that cannot be merged, such as the number of
points of a path, become unmergeable; when one is used, a wider part of the code is run for both
sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from osimlite.derivatives.symbols import (
    UNSET,
    BranchWideningSignal,
    NoFormula,
    RecordedVector,
    casadi,
    combine_condition,
    current_branch,
    is_symbol,
    merge_values,
    raise_interrupt,
    simplify_number,
)

MAX_BRANCH_COMBINATIONS = 64
"""Maximum number of combinations of branches through one function."""

BranchWrites = dict[tuple[int, int], tuple[list[Any], int, Any]]
"""Written cells by (identity of the list, index): the list, the index and the value."""


class _EvaluationState:
    """State of the evaluation of a system.

    Attributes:
        widened: parts of the code whose branches their caller decides, because a value that they
            merge cannot be merged.
        frame: function that is run for all combinations of its branches.
        failures: conditions under which a law has no solution, or a matrix no inverse.
    """

    def __init__(self) -> None:
        self.widened: set[Any] = set()
        self.frame: _FunctionFrame | None = None
        self.failures: list[Any] = []


run = _EvaluationState()
"""State of the present evaluation; there is one at a time."""


class _FunctionFrame:
    """One combination of branches through a function.

    Attributes:
        sides: side of each branch that was taken, in the order of execution.
        tests: condition of each of these branches.
        at: index of the next branch of the present run.
        count: number of runs so far.
    """

    def __init__(self) -> None:
        self.sides: list[bool] = []
        self.tests: list[Any] = []
        self.at = 0
        self.count = 0


def run_until_mergeable(function: Callable[[], Any]) -> Any:
    """Return the result of a function, rerun with wider branches until all used values can be merged.

    Args:
        function: function without arguments.

    Returns:
        Result of the function.

    Raises:
        NoFormula: a part depends on the state in a way that cannot be written as a formula.
    """
    while True:
        run.frame = None
        run.failures = []
        current_branch.condition = None
        RecordedVector.journals.clear()
        try:
            return function()
        except BranchWideningSignal as wider:
            # Widening the same part twice does not help, so this ends the loop.
            if wider.part in run.widened:
                raise NoFormula(
                    f"{wider.part} depends on the state in a way that cannot be written as a formula"
                ) from None
            # The run is repeated from its beginning, since earlier code may have used the narrower
            # branch.
            run.widened.add(wider.part)
        finally:
            RecordedVector.journals.clear()
            run.frame, current_branch.condition = None, None


def _undo_writes() -> BranchWrites:
    """Undo the writes since the last journal began.

    Returns:
        The undone writes, which `_apply_writes` can repeat.
    """
    undone: BranchWrites = {}
    for key, (cells, index, old_value) in RecordedVector.journals.pop().items():
        # Both sides of a branch must begin with the same vectors; the merge needs what this side wrote.
        undone[key] = cells, index, cells[index]
        cells[index] = old_value
    return undone


def _apply_writes(writes: BranchWrites) -> None:
    """Write values into their cells."""
    for cells, index, value in writes.values():
        RecordedVector(cells)[index] = value


def _merge_writes(
    test: Any, true_writes: BranchWrites, false_writes: BranchWrites, code_part: Any
) -> BranchWrites:
    """Return the writes of two sides, merged by a test.

    Args:
        test: condition of the branch.
        true_writes: writes of the side on which the condition holds.
        false_writes: writes of the other side.
        code_part: part of the code, for messages and identity.
    """
    result: BranchWrites = {}
    for key in true_writes | false_writes:
        cells, index, _ = true_writes.get(key) or false_writes[key]
        # A cell that one side did not write keeps its value on that side.
        true_value = true_writes[key][2] if key in true_writes else cells[index]
        false_value = false_writes[key][2] if key in false_writes else cells[index]
        result[key] = cells, index, merge_values(test, true_value, false_value, code_part)
    return result


class AssigningBranch:
    """Branch (`if`) whose sides only assign.

    Args:
        code_part: part of the code with the branch, for messages and for recognizing the branch.
        test: condition of the branch, a number or a symbol.

    Attributes:
        ends: values of the variables at the end of each side that was run.
    """

    def __init__(self, code_part: str, test: Any) -> None:
        self.part = code_part
        test = simplify_number(test)
        if is_symbol(test) and code_part in run.widened:
            # A widened branch is decided by its caller, which runs both combinations.
            test = decide(code_part, test)
        self.test = test
        self.ends: list[tuple[Any, ...]] = []

    def sides(self) -> Iterator[bool]:
        """Yield the sides to run: one for a known condition, both for a symbol.

        After each side its writes are undone, and the writes of both are merged at the end.
        """
        if not is_symbol(self.test):
            yield bool(self.test)
            return
        outer_condition = current_branch.condition
        writes_by_side: list[BranchWrites] = []
        for is_true_side in (True, False):
            current_branch.condition = outer_condition
            current_branch.condition = combine_condition(
                self.test if is_true_side else casadi.logic_not(self.test)
            )
            RecordedVector.journals.append({})
            yield is_true_side
            writes_by_side.append(_undo_writes())
        current_branch.condition = outer_condition
        _apply_writes(_merge_writes(self.test, writes_by_side[0], writes_by_side[1], self.part))

    @property
    def end(self) -> tuple[Any, ...]:
        """Values of the variables after the branch.

        Returns:
            Merged values in the order of the variables.
        """
        if len(self.ends) == 1:
            return self.ends[0]
        true_values, false_values = self.ends
        return tuple(
            merge_values(self.test, a, b, self.part)
            for a, b in zip(true_values, false_values, strict=True)
        )


def decide(code_part: str, test: Any) -> bool:
    """Return whether the true side of a branch is taken in the combination that is being run.

    Args:
        code_part: part of the code, for messages.
        test: condition of the branch.

    Raises:
        NoFormula: the branch is outside of functions that can be rerun.
    """
    test = simplify_number(test)
    if not is_symbol(test):
        return bool(test)
    frame = run.frame
    if frame is None:
        raise NoFormula(f"{code_part} branches by the state")
    number = frame.at
    frame.at += 1
    # A new branch is taken on its true side first; `run_all_branches` repeats the function for the
    # other.
    if number == len(frame.sides):
        frame.sides.append(True)
        frame.tests.append(test)
    is_true_side = frame.sides[number]
    current_branch.condition = combine_condition(test if is_true_side else casadi.logic_not(test))
    return is_true_side


def record_failure(test: Any) -> bool:
    """Record the condition of an error return.

    Args:
        test: condition; a symbol is recorded, and the results become NaN where it holds.

    Returns:
        Whether there is certainly no result.
    """
    test = simplify_number(test)
    if not is_symbol(test):
        return bool(test)
    run.failures.append(combine_condition(test))
    return False


def run_all_branches(code_part: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a function, merged over all combinations of its branches.

    Writes into vectors are merged in the same way. The combinations are the leaves of a binary
    tree: the first run takes the true side of every branch, and each false side is explored from
    the last branch to the first.

    Args:
        code_part: part of the code, for messages and identity.
        function: function whose branches depend on symbols.
        *arguments: arguments of the function.

    Returns:
        The merged result.

    Raises:
        NoFormula: there are more than `MAX_BRANCH_COMBINATIONS` combinations.
    """
    raise_interrupt()
    outer_frame = run.frame
    condition = current_branch.condition
    # The caller runs the combinations of a widened part, as if its branches were the caller's own.
    if code_part in run.widened and outer_frame is not None:
        return function(*arguments)
    frame = run.frame = _FunctionFrame()
    RecordedVector.journals.append({})
    result = function(*arguments)
    # A function without branches on symbols has one combination; its writes belong to the outer
    # journal.
    if not frame.sides:
        writes = RecordedVector.journals.pop()
        if RecordedVector.journals:
            RecordedVector.journals[-1].update(
                {key: writes[key] for key in writes if key not in RecordedVector.journals[-1]}
            )
        run.frame = outer_frame
        current_branch.condition = condition
        return result

    def run_others(fixed_count: int, result: Any) -> tuple[Any, BranchWrites]:
        """Merge a run with those of the combinations that agree in the first branches.

        Args:
            fixed_count: number of branches that all combinations share.
            result: result of the present run.

        Returns:
            Merged result and merged writes.

        Raises:
            NoFormula: the function has too many combinations of branches.
        """
        merged_writes = _undo_writes()
        sides = frame.sides
        tests = frame.tests
        # The first sides are fixed by outer calls; the rest of the tree below side k is explored by
        # recursion.
        for k in range(len(sides) - 1, fixed_count - 1, -1):
            frame.sides = [*sides[:k], False]
            frame.tests = tests[: k + 1]
            frame.at = 0
            frame.count += 1
            if frame.count > MAX_BRANCH_COMBINATIONS:
                raise NoFormula(
                    f"{code_part} has more than {MAX_BRANCH_COMBINATIONS} combinations of branches"
                )
            current_branch.condition = condition
            RecordedVector.journals.append({})
            other_result, other_writes = run_others(k + 1, function(*arguments))
            result = merge_values(tests[k], result, other_result, code_part)
            merged_writes = _merge_writes(tests[k], merged_writes, other_writes, code_part)
        return result, merged_writes

    result, merged_writes = run_others(0, result)
    run.frame = outer_frame
    current_branch.condition = condition
    _apply_writes(merged_writes)
    return result


__all__ = [
    "UNSET",
    "AssigningBranch",
    "NoFormula",
    "decide",
    "record_failure",
    "run",
    "run_all_branches",
    "run_until_mergeable",
]
