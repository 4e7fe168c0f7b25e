"""What is known of the rows of a table: how many there are, their times, and what is wrong with them."""

from __future__ import annotations

from array import array
from typing import NamedTuple

from osimlite.base.records import dataclass, field
from osimlite.base.text import counted

_TOLD = 50
"""Faults of a kind that are told, one for each column."""


class Fault(NamedTuple):
    """Something wrong in the rows: of what kind, in which column of the table, where it is met first, and how often.

    `kind` is ``cell`` (no number), ``row`` (`number` says how many cells, `text` more),
    ``comment``, ``blank``, ``order``, ``time`` (no number), ``part`` (a part of a marker), ``zero``
    (a marker at the origin) or ``frame`` (a wrong number). `others` is how many more columns have
    such a fault that is not told.
    """

    kind: str
    number: int
    line: int
    column: int
    length: int
    text: str
    times: int = 1
    others: int = 0

    def more(self, noun: str = "row") -> str:
        """What to say of further rows, and of further columns."""
        rows = (
            [f"; so it is in {counted(self.times - 1, f'more {noun}')}"] if self.times > 1 else []
        )
        columns = (
            [f"; there is such in {counted(self.others, 'more column')}"] if self.others else []
        )
        return "".join(rows + columns)


@dataclass(slots=True)
class Rows:
    """What is known of the rows of a table.

    `cells` is how many cells a row should have, `samples` are the numbers of a few rows (NaN for
    what is none), `unseen` the markers that no row has.
    """

    cells: int = 0
    count: int = 0
    times: array[float] = field(default_factory=lambda: array("d"))
    lines: list[tuple[int, int]] = field(default_factory=list)
    faults: dict[tuple[str, int], Fault] = field(default_factory=dict)
    samples: list[list[float]] = field(default_factory=list)
    unseen: set[int] = field(default_factory=set)

    def of(self, *kinds: str) -> list[Fault]:
        """The faults of some kinds, by place; of very many the first."""
        result = sorted(
            (fault for fault in self.faults.values() if fault.kind in kinds),
            key=lambda fault: fault.line,
        )
        if len(result) > _TOLD:
            result[_TOLD - 1 :] = [result[_TOLD - 1]._replace(others=len(result) - _TOLD)]
        return result

    def line_of(self, row: int) -> int:
        """The line of the file that holds a row, as both are counted from 0 and 1."""
        first = next((place for place in reversed(self.lines) if place[0] <= row), (0, 0))
        return first[1] + row - first[0]
