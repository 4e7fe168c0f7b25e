"""Execution of code that branches on symbols, so that the result holds on both sides.

A branch whose sides only assign is run for both sides, and the assigned values are merged
(`Branch`). Where a side returns or leaves a loop, the whole function is run once for each
combination of sides (`run_all_branches`). Values that cannot be merged, such as the number of
points of a path, become unmergeable; when one is used, a wider part of the code is run for both
sides.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from osimlite.derivatives.symbols import (
    UNSET,
    NoFormula,
    Vector,
    WiderBranchNeeded,
    casadi,
    combine_condition,
    is_symbol,
    merge_values,
    simplify_number,
    where,
)

MAX_BRANCH_COMBINATIONS = 64
"""Maximum number of combinations of branches through one function."""

Writes = dict[tuple[int, int], tuple[list[Any], int, Any]]
"""Cells with the values written into them."""


class _EvaluationState:
    """State of the evaluation of a system.

    Attributes:
        widened: parts of the code whose branches belong to their caller, as a merged value of them
            was unmergeable.
        frame: function that is run for all combinations of its branches.
        failures: conditions under which a law has no solution, or a matrix no inverse.
    """

    def __init__(self) -> None:
        self.widened: set[Any] = set()
        self.frame: _FunctionFrame | None = None
        self.failures: list[Any] = []


run = _EvaluationState()


class _FunctionFrame:
    """One combination of branches through a function: the sides taken, and their tests."""

    def __init__(self) -> None:
        self.sides: list[bool] = []
        self.tests: list[Any] = []
        self.at = 0
        self.count = 0


def run_until_mergeable(function: Callable[[], Any]) -> Any:
    """Return the result of a function, rerun with wider branches until all used values can be merged.

    Raises:
        NoFormula: a part depends on the state in a way that has no formula.
    """
    while True:
        run.frame = None
        run.failures = []
        where.condition = None
        Vector.journals.clear()
        try:
            return function()
        except WiderBranchNeeded as wider:
            if wider.part in run.widened:
                raise NoFormula(
                    f"{wider.part} depends on the state in a way that has no formula"
                ) from None
            run.widened.add(wider.part)
        finally:
            Vector.journals.clear()
            run.frame, where.condition = None, None


def _undo_writes() -> Writes:
    """Undo what was written since the last journal began, and return it."""
    written: Writes = {}
    for key, (cells, place, before) in Vector.journals.pop().items():
        written[key] = cells, place, cells[place]
        cells[place] = before
    return written


def _apply_writes(written: Writes) -> None:
    """Write values into their cells."""
    for cells, place, value in written.values():
        Vector(cells)[place] = value


def _merge_writes(test: Any, one: Writes, other: Writes, part: Any) -> Writes:
    """Return the writes of two sides, merged by a test."""
    result: Writes = {}
    for key in one | other:
        cells, place, _ = one.get(key) or other[key]
        a = one[key][2] if key in one else cells[place]
        b = other[key][2] if key in other else cells[place]
        result[key] = cells, place, merge_values(test, a, b, part)
    return result


class Branch:
    """Branch (`if`) whose sides only assign.

    Args:
        part: part of the code, for messages and identity.
        test: condition.
    """

    def __init__(self, part: str, test: Any) -> None:
        self.part = part
        test = simplify_number(test)
        if is_symbol(test) and part in run.widened:
            test = decide(part, test)
        self.test = test
        self.ends: list[tuple[Any, ...]] = []

    def sides(self) -> Iterator[bool]:
        """Yield the sides to run."""
        if not is_symbol(self.test):
            yield bool(self.test)
            return
        before = where.condition
        written: list[Writes] = []
        for side in (True, False):
            where.condition = before
            where.condition = combine_condition(self.test if side else casadi.logic_not(self.test))
            Vector.journals.append({})
            yield side
            written.append(_undo_writes())
        where.condition = before
        _apply_writes(_merge_writes(self.test, written[0], written[1], self.part))

    @property
    def end(self) -> tuple[Any, ...]:
        """Values of the variables after the branch."""
        if len(self.ends) == 1:
            return self.ends[0]
        one, other = self.ends
        return tuple(
            merge_values(self.test, a, b, self.part) for a, b in zip(one, other, strict=True)
        )


def decide(part: str, test: Any) -> bool:
    """Return the side of a branch in the combination that is being run.

    Raises:
        NoFormula: the branch is outside of functions that can be rerun.
    """
    test = simplify_number(test)
    if not is_symbol(test):
        return bool(test)
    frame = run.frame
    if frame is None:
        raise NoFormula(f"{part} branches by the state")
    number = frame.at
    frame.at += 1
    if number == len(frame.sides):
        frame.sides.append(True)
        frame.tests.append(test)
    side = frame.sides[number]
    where.condition = combine_condition(test if side else casadi.logic_not(test))
    return side


def record_failure(test: Any) -> bool:
    """Return whether there is certainly no result; record a test on symbols, where results become NaN."""
    test = simplify_number(test)
    if not is_symbol(test):
        return bool(test)
    run.failures.append(combine_condition(test))
    return False


def run_all_branches(part: str, function: Callable[..., Any], *given: Any) -> Any:
    """Return what a function returns, merged over all combinations of its branches; writes are merged too.

    Args:
        part: part of the code, for messages and identity.
        function: function.
        *given: arguments of the function.

    Raises:
        NoFormula: there are more than `MAX_BRANCH_COMBINATIONS` combinations.
    """
    outer = run.frame
    condition = where.condition
    if part in run.widened and outer is not None:
        return function(*given)
    frame = run.frame = _FunctionFrame()
    Vector.journals.append({})
    result = function(*given)
    if not frame.sides:
        writes = Vector.journals.pop()
        if Vector.journals:
            Vector.journals[-1].update(
                {key: writes[key] for key in writes if key not in Vector.journals[-1]}
            )
        run.frame = outer
        where.condition = condition
        return result

    def run_others(first: int, result: Any) -> tuple[Any, Writes]:
        """Return result and writes, merged with those of the combinations that differ after `first` branches."""
        written = _undo_writes()
        sides = frame.sides
        tests = frame.tests
        for k in range(len(sides) - 1, first - 1, -1):
            frame.sides = [*sides[:k], False]
            frame.tests = tests[: k + 1]
            frame.at = 0
            frame.count += 1
            if frame.count > MAX_BRANCH_COMBINATIONS:
                raise NoFormula(
                    f"{part} has more than {MAX_BRANCH_COMBINATIONS} combinations of branches"
                )
            where.condition = condition
            Vector.journals.append({})
            other, also_written = run_others(k + 1, function(*given))
            result = merge_values(tests[k], result, other, part)
            written = _merge_writes(tests[k], written, also_written, part)
        return result, written

    result, written = run_others(0, result)
    run.frame = outer
    where.condition = condition
    _apply_writes(written)
    return result


__all__ = [
    "UNSET",
    "Branch",
    "NoFormula",
    "decide",
    "record_failure",
    "run",
    "run_all_branches",
    "run_until_mergeable",
]
