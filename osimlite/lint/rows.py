"""The rows of a table: what is no number, what is missing, and the times, at the speed of a few passes over the bytes.

Rows are looked at by the megabyte. Without its digits, signs and points a block of good rows is the same few tabs over
and over; without its digits alone only a few forms are left of all its numbers. Where a block is not so, its rows are
looked at one by one.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice, pairwise, product
from math import inf, nan, nextafter
from operator import lt
from typing import NamedTuple

BLOCK = 1_000_000
"""Bytes that are looked at together."""

_DIGITS = b"0123456789"
_REST = b"+-.eE"
_AS_ZERO = bytes.maketrans(_DIGITS + _REST, b"0" * 15)
_COMMA_AS_TAB = bytes.maketrans(b",", b"\t")
_FORMS = {
    (sign + point + exponent).encode()
    for sign, point, exponent in product(
        ("", "-", "+"), ("", "."), ("", *(mark + sign for mark in "eE" for sign in ("", "-", "+")))
    )
}
"""What is left of a number without its digits."""
_JOINTS = {last + b"\n" + first for last in _FORMS for first in _FORMS}
_KNOWN = frozenset(_FORMS | _JOINTS)
_EMPTY = frozenset(form for form in _KNOWN if b"" in form.split(b"\n"))
_SIGNED = frozenset(form for form in _KNOWN if {b"-", b"+"} & {*form.split(b"\n")})
_POWERS = frozenset(form for form in _KNOWN if b"e" in form or b"E" in form)
_WHOLE_POWERS = frozenset(
    form for form in _POWERS if any(part.lstrip(b"+-")[:1] in (b"e", b"E") for part in form.split(b"\n"))
)
_KINDS = bytes.maketrans(_DIGITS + b".+-eE\n,", b"0" * 11 + b"--ee\t\t")
_PLAIN = re.compile(rb"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_WORD = re.compile(rb"\S+")
_CELL = re.compile(rb"[^\t]*")
_BLANKS_AT_TAB = re.compile(rb" *\t *")


class Fault(NamedTuple):
    """Something wrong in the rows: of what kind, in which column of the table, where it is met first, and how often.

    `kind` is ``cell`` (no number), ``row`` (`text` says how many cells), ``comment``, ``blank``, ``order``, ``time``
    (no number), ``part`` (a part of a marker), ``zero`` (a marker at the origin) or ``frame`` (a wrong number).
    """

    kind: str
    number: int
    line: int
    column: int
    length: int
    text: str
    times: int = 1


@dataclass(slots=True)
class Rows:
    """What is known of the rows of a table.

    `samples` are the numbers of a few rows (NaN for what is none), `unseen` the markers that no row has.
    """

    count: int = 0
    times: array[float] = field(default_factory=lambda: array("d"))
    lines: list[tuple[int, int]] = field(default_factory=list)
    faults: dict[tuple[str, int], Fault] = field(default_factory=dict)
    samples: list[list[float]] = field(default_factory=list)
    unseen: set[int] = field(default_factory=set)

    def of(self, *kinds: str) -> list[Fault]:
        """The faults of some kinds, by place."""
        return sorted((fault for fault in self.faults.values() if fault.kind in kinds), key=lambda fault: fault.line)

    def line_of(self, row: int) -> int:
        """The line of the file that holds a row, as both are counted from 0 and 1."""
        first = next((place for place in reversed(self.lines) if place[0] <= row), (0, 0))
        return first[1] + row - first[0]


@dataclass(slots=True)
class Scan:
    """Goes once through the rows of a table.

    Args:
        cells: how many numbers a row has; of a marker table with the number of the frame.
        parts: how many numbers, with commas between, make a cell.
        markers: whether these are markers (.trc): a tab ends every cell, cells may be empty, and the time is the
            second. Else blanks and tabs separate, and the time comes first.
    """

    cells: int
    parts: int = 1
    markers: bool = False
    rows: Rows = field(default_factory=Rows)
    _ends_in_tab: bool = False
    _holes: bool = False
    _frame: int = 0

    def run(self, data: bytes, start: int, line: int) -> Rows:
        """Look at the rows from an offset on, which is in this line of the file."""
        if self.markers:
            self.rows.unseen = set(range((self.cells - 2) // 3))
            while start < len(data) and data[start : start + 1] in b"\t\r\n ":
                # Before the first frame OpenSim passes over lines that have no number of one.
                start, line = data.find(b"\n", start) + 1 or len(data), line + 1
        for block in _blocks(data, start):
            good = self._clean(block)
            if good is not None and (taken := self._take(good, line)):
                line += taken
                continue
            for text in block.split(b"\n")[:-1]:
                good = self._clean(text + b"\n")
                if good is None or not self._take(good, line):
                    self._odd(text, line)
                line += 1
        if not self.rows.count:
            self.rows.unseen.clear()
        return self.rows

    def _clean(self, block: bytes) -> bytes | None:
        """The block with nothing but tabs between its numbers, None if it has anything but whole rows of numbers."""
        if b"\r" in block:
            block = block.replace(b"\r\n", b"\n")
        if b" " in block:
            # From behind, CPython finds this pair three times as fast.
            if block.translate(_AS_ZERO).rfind(b"0 ") < 0:
                # Blanks before numbers make columns of one width; others separate.
                block = block.translate(None, b" ")
            elif self.markers:
                block = _BLANKS_AT_TAB.sub(b"\t", block)
            else:
                block = b"\n".join([b"\t".join(row.split()) for row in block.split(b"\n")])
        if self.markers and b"N" in block:
            block = block.replace(b"\tNaN", b"\t")
        bones = block.translate(None if self.parts == 1 else _COMMA_AS_TAB, _DIGITS)
        if not self._is_pattern(bones.translate(None, _REST)):
            return None
        forms = set(bones.split(b"\t"))
        if self._ends_in_tab and block.count(b"\t\n") != block.count(b"\n"):
            return None
        # Without its digits a number may look like what is none; the few passes that tell are made where it matters.
        if not forms <= _KNOWN or (b"\t." in block and (b"\t.\t" in block or b"\t.\n" in block)):
            return None
        doubts = [
            *((b"0-", b"-\t") if not forms.isdisjoint(_SIGNED) else ()),
            *((b"e\t", b"-\t") if not forms.isdisjoint(_POWERS) else ()),
            *((b"\te", b"-e") if not forms.isdisjoint(_WHOLE_POWERS) else ()),
        ]
        if doubts:
            kinds = block.translate(_KINDS)
            if any(doubt in kinds for doubt in doubts):
                return None
        self._holes = not forms.isdisjoint(_EMPTY) and (
            b"\t\t" in block or b"\n\t" in block or (not self._ends_in_tab and b"\t\n" in block)
        )
        return None if self._holes and not self.markers else block

    def _is_pattern(self, between: bytes) -> bool:
        """Whether what stands between the numbers of a block is that of whole rows; a tab may end all of them."""
        row = b"\t" * (self.cells * self.parts - 1)
        self._ends_in_tab = between.startswith(row + b"\t")
        pattern = row + (b"\t\n" if self._ends_in_tab else b"\n")
        count, rest = divmod(len(between), len(pattern))
        return not rest and between == pattern * count

    def _take(self, block: bytes, line: int) -> int:
        """Note times and samples of good rows; how many there are, 0 if a time is no number after all."""
        lines = block.split(b"\n")
        lines.pop()
        rows = self.rows
        heads = [text.split(b"\t", 2) for text in lines] if self.markers else []
        try:
            times = [float(head[1] or b"nan") for head in heads] or [float(text.split(b"\t", 1)[0]) for text in lines]
        except ValueError:
            return 0
        self._begin(line)
        if self.markers:
            for number, (frame, time, *_) in enumerate(heads):
                self._expect_frame(frame, line + number)
                if not time:
                    self._note("time", 1, line + number, len(frame) + 2, 1, "")
                    times[number] = nextafter(times[number - 1] if number else self._last(), inf)
            if rows.unseen or self._holes or b"\t\t\t" in block.translate(None, b"0.-+"):
                for number, text in enumerate(lines):
                    self._markers(text, line + number)
        if not times[0] > self._last() or not all(map(lt, times, islice(times, 1, None))):
            for number, (before, now) in enumerate(pairwise([self._last(), *times])):
                if not now > before:
                    self._order(line + number, now, before)
        rows.times.extend(times)
        rows.count += len(lines)
        for text in lines[:: max(1, len(lines) // 4)] if len(lines) > 4 or len(rows.samples) < 64 else ():
            rows.samples.append([_number(word) for word in text.translate(_COMMA_AS_TAB).split(b"\t")])
        return len(lines)

    def _last(self) -> float:
        """The time of the last row."""
        return self.rows.times[-1] if self.rows.times else -inf

    def _begin(self, line: int) -> None:
        """Note in which line the next row is, where it does not follow the one before."""
        if line != self.rows.line_of(self.rows.count):
            self.rows.lines.append((self.rows.count, line))

    def _markers(self, text: bytes, line: int) -> None:
        """Look for markers at the origin, for parts of markers, and for those that were not seen so far."""
        cells = text.split(b"\t")
        for marker, start in enumerate(range(2, self.cells, 3)):
            x, y, z = cells[start : start + 3]
            if x and y and z:
                self.rows.unseen.discard(marker)
                if not (x + y + z).strip(b"0.-+"):
                    self._note("zero", start, line, sum(map(len, cells[:start])) + start + 1, len(x), "")
            elif x or y or z:
                self._note("part", start, line, sum(map(len, cells[:start])) + start + 1, max(1, len(x)), "")

    def _odd(self, text: bytes, line: int) -> None:
        """Look at one row that is not good."""
        if not text.strip():
            if self.rows.count:
                self._note("blank", 0, line, 1, 1, "")
            return
        finds = _CELL.finditer(text.rstrip(b"\r\n")) if self.markers else _WORD.finditer(text)
        cells = [(match.start() + 1, match.group().strip()) for match in finds if not self.markers or _starts(match)]
        if self.markers and cells and not cells[-1][1] and len(cells) == self.cells + 1:
            cells.pop()
        rows = self.rows
        time = 1 if self.markers else 0
        if len(cells) != self.cells:
            comment = text.lstrip()[:1] in (b"#", b"/", b"%", b";")
            kind = "comment" if comment else "row"
            column = cells[self.cells][0] if len(cells) > self.cells else len(text.rstrip()) + 1
            self._note(kind, 0 if comment else len(cells), line, 1 if comment else column, 1, str(len(cells)))
            if comment:
                return
        numbers = [_number(part) for _, cell in cells for part in cell.split(b",", self.parts - 1)]
        for number, (column, cell) in enumerate(cells):
            if self.markers and number == 0:
                self._expect_frame(cell, line)
            elif number == time:
                value = _number(cell)
                if value != value:
                    self._note("time", time, line, column, len(cell), _shown(cell))
                elif not value > self._last():
                    self._order(line, value, self._last())
            elif not (self.markers and cell.lower() in (b"", b"nan")):
                parts = cell.split(b",") if self.parts > 1 else [cell]
                if len(parts) != self.parts or any(_number(part) != _number(part) for part in parts):
                    self._note("cell", number, line, column, max(1, len(cell)), _shown(cell))
        if len(cells) > time and len(cells) == self.cells:
            self._begin(line)
            value = _number(cells[time][1])
            rows.times.append(value if value == value else nextafter(self._last(), inf))
            rows.count += 1
            if self.markers:
                self._markers(b"\t".join(b"" if cell.lower() == b"nan" else cell for _, cell in cells), line)
            if len(rows.samples) < 64:
                rows.samples.append(numbers)

    def _expect_frame(self, cell: bytes, line: int) -> None:
        number = int(cell) if cell.isdigit() else None
        if number is None or (self._frame and number != self._frame + 1):
            self._note("frame", 0, line, 1, max(1, len(cell)), _shown(cell))
        self._frame = number if number is not None else self._frame + 1

    def _order(self, line: int, time: float, before: float) -> None:
        self._note("order", int(time < before), line, 1, 1, f"{time:.9g} {before:.9g}")

    def _note(self, kind: str, number: int, line: int, column: int, length: int, text: str) -> None:
        faults = self.rows.faults
        known = faults.get((kind, number))
        new = Fault(kind, number, line, column, length, text)
        faults[kind, number] = new if known is None else known._replace(times=known.times + 1)


def _blocks(data: bytes, start: int) -> Iterator[bytes]:
    """Whole lines from an offset on, each with its end; blank lines at the end of all left out."""
    size = len(data)
    while size > start and data[size - 1] in b"\r\n" and data[size - 2] in b"\r\n":
        size -= 1
    while start < size:
        end = data.rfind(b"\n", start, min(start + BLOCK, size)) + 1 or data.find(b"\n", start, size) + 1 or size
        block = data[start:end]
        yield block if block.endswith(b"\n") else block + b"\n"
        start = end


def _starts(match: re.Match[bytes]) -> bool:
    """Whether a match is that of a cell, and not of the nothing at the end of one."""
    return match.start() == 0 or match.string[match.start() - 1 : match.start()] == b"\t"


def _number(cell: bytes) -> float:
    """A number; NaN for a text that is none as C++ reads numbers, which knows neither NaN nor infinity."""
    return float(cell) if _PLAIN.fullmatch(cell) else nan


def _shown(cell: bytes) -> str:
    return cell.decode("utf-8", "replace")
