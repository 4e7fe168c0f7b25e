"""Code that branches on symbols, run so that what it computes holds on both sides.

A branch that only assigns is run for both sides, and what they have set is merged at its end
(`Branch`). Where a side returns, or leaves a round of a loop, the whole function is run once for
each way through it (`in_ways`). What cannot be merged, such as how many points a path runs through,
is torn; if somebody asks for it, a wider part is run in both ways.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from osimlite.derivatives.symbols import (
    UNSET,
    NoFormula,
    Vector,
    WiderWays,
    also,
    casadi,
    is_symbol,
    merged,
    plain,
    where,
)

MOST_WAYS = 64
"""Through one function; what has more is refused."""

Writes = dict[tuple[int, int], tuple[list[Any], int, Any]]
"""Cells with what is written into them."""


class _Run:
    """What is known while a system is evaluated.

    Attributes: wider: parts of the code, what they would merge being needed apart: their branches
        are those of what calls them. frame: of the function that is being run in all its ways.
        failures: conditions under which a law has no solution, or a matrix no inverse.
    """

    def __init__(self) -> None:
        self.wider: set[Any] = set()
        self.frame: _Frame | None = None
        self.failures: list[Any] = []


run = _Run()


class _Frame:
    """One way through a function: what was taken at its branches, and the tests there."""

    def __init__(self) -> None:
        self.taken: list[bool] = []
        self.tests: list[Any] = []
        self.at = self.ways = 0


def repeated(function: Callable[[], Any]) -> Any:
    """What a function finds once it is known which of its parts are needed apart."""
    while True:
        run.frame, run.failures, where.condition = None, [], None
        Vector.journals.clear()
        try:
            return function()
        except WiderWays as wider:
            if wider.part in run.wider:
                raise NoFormula(
                    f"{wider.part} depends on the state in a way that has no formula"
                ) from None
            run.wider.add(wider.part)
        finally:
            Vector.journals.clear()
            run.frame, where.condition = None, None


def _undone() -> Writes:
    """Take back what was written since the last journal began; what it was."""
    written: Writes = {}
    for key, (cells, place, before) in Vector.journals.pop().items():
        written[key] = cells, place, cells[place]
        cells[place] = before
    return written


def _write(written: Writes) -> None:
    for cells, place, value in written.values():
        Vector(cells)[place] = value


def _merged_writes(test: Any, one: Writes, other: Writes, part: Any) -> Writes:
    result: Writes = {}
    for key in one | other:
        cells, place, _ = one.get(key) or other[key]
        a = one[key][2] if key in one else cells[place]
        b = other[key][2] if key in other else cells[place]
        result[key] = cells, place, merged(test, a, b, part)
    return result


class Branch:
    """An `if` whose sides only assign.

    Args:
        part: of the code.
        test: what decides.
    """

    def __init__(self, part: str, test: Any) -> None:
        self.part = part
        test = plain(test)
        if is_symbol(test) and part in run.wider:
            test = decide(part, test)
        self.test = test
        self.ends: list[tuple[Any, ...]] = []

    def sides(self) -> Iterator[bool]:
        """Which sides are run."""
        if not is_symbol(self.test):
            yield bool(self.test)
            return
        before = where.condition
        written: list[Writes] = []
        for side in (True, False):
            where.condition = before
            where.condition = also(self.test if side else casadi.logic_not(self.test))
            Vector.journals.append({})
            yield side
            written.append(_undone())
        where.condition = before
        _write(_merged_writes(self.test, written[0], written[1], self.part))

    @property
    def end(self) -> tuple[Any, ...]:
        """The variables afterwards."""
        if len(self.ends) == 1:
            return self.ends[0]
        one, other = self.ends
        return tuple(merged(self.test, a, b, self.part) for a, b in zip(one, other, strict=True))


def decide(part: str, test: Any) -> bool:
    """Which side of a branch is taken on the way that is being run."""
    test = plain(test)
    if not is_symbol(test):
        return bool(test)
    frame = run.frame
    if frame is None:
        raise NoFormula(f"{part} branches by the state")
    number = frame.at
    frame.at += 1
    if number == len(frame.taken):
        frame.taken.append(True)
        frame.tests.append(test)
    side = frame.taken[number]
    where.condition = also(test if side else casadi.logic_not(test))
    return side


def fails(test: Any) -> bool:
    """Whether there is no result; where that depends on the state, the results will be no numbers."""
    test = plain(test)
    if not is_symbol(test):
        return bool(test)
    run.failures.append(also(test))
    return False


def in_ways(part: str, function: Callable[..., Any], *given: Any) -> Any:
    """What a function returns and writes, merged over all ways through it."""
    outer, condition = run.frame, where.condition
    if part in run.wider and outer is not None:
        return function(*given)
    frame = run.frame = _Frame()
    Vector.journals.append({})
    result = function(*given)
    if not frame.taken:
        kept = Vector.journals.pop()
        if Vector.journals:
            Vector.journals[-1].update(
                {key: kept[key] for key in kept if key not in Vector.journals[-1]}
            )
        run.frame, where.condition = outer, condition
        return result

    def others(first: int, result: Any) -> tuple[Any, Writes]:
        """With the ways that part from this one after some branches."""
        written, taken, tests = _undone(), frame.taken, frame.tests
        for k in range(len(taken) - 1, first - 1, -1):
            frame.taken, frame.tests, frame.at = [*taken[:k], False], tests[: k + 1], 0
            frame.ways += 1
            if frame.ways > MOST_WAYS:
                raise NoFormula(f"{part} has more than {MOST_WAYS} ways through it")
            where.condition = condition
            Vector.journals.append({})
            other, also_written = others(k + 1, function(*given))
            result = merged(tests[k], result, other, part)
            written = _merged_writes(tests[k], written, also_written, part)
        return result, written

    result, written = others(0, result)
    run.frame, where.condition = outer, condition
    _write(written)
    return result


__all__ = ["UNSET", "Branch", "NoFormula", "decide", "fails", "in_ways", "repeated", "run"]
