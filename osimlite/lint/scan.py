"""Scan the rows of a table once: cells that are not numbers, missing markers, and the times.

Rows are examined in blocks. `osimlite.lint.shapes` recognises rows of plain numbers many at a time;
only the other rows are examined cell by cell.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import groupby, islice, pairwise
from math import inf, isfinite, isnan, nan, nextafter
from operator import lt

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
from osimlite.io.tables.vector_rows import (
    BLANKS,
    parse_leading_number,
    split_vector,
    split_vector_row,
)
from osimlite.lint.shapes import MARKERS, ROWS, VECTORS, RowLayout, compute_shapes

_MAX_FAULTS = 50
"""Largest number of faults of a kind that are reported, one for each column."""


class RowFault(NamedTuple):
    """Fault in the rows of a table: its kind and column, its first position, and how often it occurs.

    `kind` is ``cell`` (no number), ``vector`` (a cell with too few or too many numbers), ``row``
    (`number` of cells, `text` with details), ``comment``, ``words`` (`text` without numbers), ``blank``, ``order``, ``time`` (no
    number), ``part`` (a part of a marker), ``zero`` (a marker at the origin) or ``frame`` (a wrong
    number). `others` is the number of further columns with such a fault, which are not reported.
    """

    kind: str
    number: int
    line: int
    column: int
    length: int
    text: str
    times: int = 1
    others: int = 0

    def describe_repeats(self, noun: str = "row") -> str:
        """Return a phrase about further rows and columns with the same fault."""
        rows = (
            [f"; the same in {format_count(self.times - 1, f'more {noun}')}"]
            if self.times > 1
            else []
        )
        columns = [f"; also in {format_count(self.others, 'more column')}"] if self.others else []
        return "".join(rows + columns)


@dataclass(slots=True)
class TableRows:
    """Rows of a table.

    Attributes:
        cells: number of cells that a row should have.
        count: number of rows.
        times: time of each row.
        lines: row index and line number of rows after which the difference between the two changes.
        faults: faults by kind and column.
        samples: numbers of a few rows, NaN for text that is not a number.
        unseen: markers that no row contains.
    """

    cells: int = 0
    count: int = 0
    times: array[float] = field(default_factory=lambda: array("d"))
    lines: list[tuple[int, int]] = field(default_factory=list)
    faults: dict[tuple[str, int], RowFault] = field(default_factory=dict)
    samples: list[list[float]] = field(default_factory=list)
    unseen: set[int] = field(default_factory=set)

    def select(self, *kinds: str) -> list[RowFault]:
        """Return the faults of some kinds sorted by line; of very many the first."""
        result = sorted(
            (fault for fault in self.faults.values() if fault.kind in kinds),
            key=lambda fault: fault.line,
        )
        # The last of the reported faults carries the count of those that are left out.
        if len(result) > _MAX_FAULTS:
            result[_MAX_FAULTS - 1 :] = [
                result[_MAX_FAULTS - 1]._replace(others=len(result) - _MAX_FAULTS)
            ]
        return result

    def line_of(self, row: int) -> int:
        """Return the line of a row; lines count from 1, rows from 0."""
        # `lines` has one entry for each jump (blank lines, comments); a search from the end finds
        # the jump before this row.
        jump = next((entry for entry in reversed(self.lines) if entry[0] <= row), (0, 0))
        return jump[1] + row - jump[0]


BLOCK_BYTES = 16_000
"""Number of bytes that are examined together: few enough for the cache of a processor."""

_MAX_LINE_BYTES = 4_000_000
"""Length of a line, in bytes, above which recognising its shape would take too much memory."""
_MAX_QUOTED_LENGTH = 40
"""Largest number of letters of a line that a message quotes."""

_SAMPLED_ROWS = 64
"""Number of rows at the beginning that are all samples; later rows are sampled ever more sparsely."""
_MAX_SAMPLED_NUMBERS = 200_000
"""Largest total of numbers in these rows."""
# Python's float() also accepts underscores, which C++ does not, and NaN and infinity, which count
# as missing here.
_PLAIN = compile_later(rb"[-+]?(\d+(?:\.\d*)?|\.\d+)([eE][-+]?\d+)?")
# Exponents from 100 on: the number may be beyond the largest one, which C++ does not read.
_LARGE_EXPONENT = compile_later(rb"e\+?[1-9]\d\d")
_LARGE_CAPITAL_EXPONENT = compile_later(rb"E\+?[1-9]\d\d")
_WORD = compile_later(rb"\S+")
_LETTER = compile_later(rb"[A-Za-z]")
# A line with a digit, NaN or infinity is taken for a row, even if it has letters as well.
_OF_ROW = compile_later(rb"\d|\b(?:nan|inf)", re.IGNORECASE)
# For OpenSim, a line that begins with a tab or a blank is no frame.
_FRAME = compile_later(rb"^[^\t\r\n ]", re.MULTILINE)


@dataclass(slots=True)
class RowScanner:
    """Scanner that reads the rows of a table once.

    Args:
        cells: number of cells in a row; in a marker table with the frame number.
        parts: number of values in a cell, separated by commas. With several, tabs alone separate
            cells.
        markers: whether this is a marker table (.trc): a tab ends every cell, cells may be empty, and
            the time is the second cell. Otherwise blanks and tabs separate cells, and the time is
            the first.
    """

    cells: int
    parts: int = 1
    markers: bool = False
    rows: TableRows = field(default_factory=TableRows)
    _frame: int = 0

    def scan(self, data: bytes, start: int, line: int) -> TableRows:
        """Scan the rows from an offset on, which is in this line of the file.

        Returns:
            Number, times, faults and samples of the rows.
        """
        self.rows.cells = self.cells
        if self.markers:
            self.rows.unseen = set(range((self.cells - 2) // 3))
            # Before the first frame OpenSim passes over lines that have no number of one.
            frame = _FRAME.search(data, start)
            first_frame = frame.start() if frame else len(data)
            start, line = first_frame, line + data.count(b"\n", start, first_frame)
        layout = MARKERS if self.markers else VECTORS if self.parts > 1 else ROWS
        # The time is one number, also of vectors.
        cells = [b"0", *[b",".join([b"0"] * self.parts)] * (self.cells - 1)]
        plain_shape = (b"" if layout is ROWS else b"\t").join(cells)
        for block in _split_blocks(data, start):
            lines = block.split(b"\n")
            # Each line of a block ends with a line feed, so that the last piece is empty.
            lines.pop()
            shapes, zeros = (
                _compute_shapes(block, layout)
                if len(block) < _MAX_LINE_BYTES
                # A line of several megabytes would need tables of shapes of many times its size;
                # "!" sends it to the examination cell by cell.
                else (b"!\n" * len(lines), False)
            )
            if _may_overflow(block):
                forms = shapes.split(b"\n")
                shapes = b"".join(
                    (b"!" if _may_overflow(text) else form) + b"\n"
                    for text, form in zip(lines, forms, strict=False)
                )
            # The usual case: a block of rows of plain numbers is recognised by one comparison.
            if shapes == (plain_shape + b"\n") * len(lines):
                self._note_rows(lines, [plain_shape] * len(lines), line, zeros)
            else:
                forms = shapes.split(b"\n")
                # Where markers were not seen, a good row has another form than a whole one.
                kinds = [
                    form
                    and (
                        form == plain_shape
                        or (self.markers and _find_present_markers(form, self.cells) is not None)
                    )
                    for form in forms
                ]
                # Runs of valid rows are recorded together; each kind is True, False, or the empty
                # form of a blank line.
                for kind, group in groupby(range(len(lines)), kinds.__getitem__):
                    indices = list(group)
                    if kind:
                        selection = slice(indices[0], indices[-1] + 1)
                        self._note_rows(
                            lines[selection], forms[selection], line + indices[0], zeros
                        )
                    # A line of blanks has no shape, but is no blank line in a table of vectors.
                    elif kind is False or self.parts > 1:
                        for index in indices:
                            self.examine_odd_line(lines[index], line + index)
                    elif self.rows.count:
                        self._note_fault("blank", 0, line + indices[0], 0, b"", times=len(indices))
            line += len(lines)
        # Without rows every marker would be missing, which is not the fault of such a table.
        if not self.rows.count:
            self.rows.unseen.clear()
        return self.rows

    def _note_rows(self, lines: list[bytes], forms: list[bytes], line: int, zeros: bool) -> None:
        """Record times and samples of valid rows."""
        rows = self.rows
        self._note_line_of_row(line)
        if self.markers:
            times = self._read_marker_times(lines, line)
            shapes = set(forms)
            rows.unseen.difference_update(
                *(_find_present_markers(form, self.cells) or () for form in shapes if rows.unseen)
            )
            # Only incomplete rows and rows with three zeros in a row can hold faults of markers.
            if zeros or any(b"\t\t" in form for form in shapes):
                for number, (text, form) in enumerate(zip(lines, forms, strict=True)):
                    if b"\t\t" in form or b"\t\t\t" in text.translate(None, b"0.-+"):
                        self._examine_markers(text, line + number)
        else:
            times = [float(text.split(None, 1)[0]) for text in lines]
        # `not >` instead of `<=`, so that NaN counts as a fault of the order.
        if not times[0] > self._get_last_time() or not all(map(lt, times, islice(times, 1, None))):
            for number, (before, now) in enumerate(pairwise([self._get_last_time(), *times])):
                if not now > before:
                    self._note_time_order_fault(lines[number], line + number, now, before)
        rows.times.extend(times)
        rows.count += len(lines)
        if self._count_missing_samples() > 0:
            rows.samples += [
                self._read_numbers(text, float) for text in lines[: self._count_missing_samples()]
            ]
        # Beyond the first rows their number grows with the square root of the row count, so that
        # long tables cost little memory.
        elif len(rows.samples) ** 2 < 2 * rows.count:
            rows.samples.append(self._read_numbers(lines[0], float))

    def _read_marker_times(self, lines: list[bytes], line: int) -> list[float]:
        """Return the times of frames; a missing time becomes the next number after the previous time."""
        leading_cells = [text.split(b"\t", 2)[:2] for text in lines]
        # One comparison of lists is faster than a check of each frame number.
        if [frame for frame, _ in leading_cells] != [
            b"%d" % (self._frame + number) for number in range(1, len(leading_cells) + 1)
        ]:
            for number, (frame, _) in enumerate(leading_cells, line):
                self._expect_frame(frame.strip(), number)
        else:
            self._frame += len(leading_cells)
        times = [float(moment.strip() or b"nan") for _, moment in leading_cells]
        for number, time in enumerate(times):
            # Only NaN differs from itself.
            if time != time:
                self._note_fault(
                    "time",
                    1,
                    line + number,
                    len(leading_cells[number][0]) + 1,
                    leading_cells[number][1],
                )
                times[number] = nextafter(
                    times[number - 1] if number else self._get_last_time(), inf
                )
        return times

    def _examine_markers(self, text: bytes, line: int) -> None:
        """Record markers at the origin, and incomplete markers."""
        cells = text.split(b"\t")
        start = 0
        for number, cell in enumerate(cells[: self.cells]):
            if number > 1 and number % 3 == 2:
                # Cells 0 and 1 are the frame and the time; coordinates of markers start at cell 2.
                marker_cells = [part.strip() for part in cells[number : number + 3]]
                is_present = [part.lower() not in (b"", b"nan") for part in marker_cells]
                if any(is_present) and not all(is_present):
                    self._note_fault("part", number, line, start, cell)
                # What is left after removing zeros, points and signs is empty for a marker exactly
                # at the origin.
                elif all(is_present) and not b"".join(marker_cells).strip(b"0.-+"):
                    self._note_fault("zero", number, line, start, cell)
            start += len(cell) + 1

    def _count_missing_samples(self) -> int:
        """Return the number of further rows that become samples."""
        return max(
            2, min(_SAMPLED_ROWS, _MAX_SAMPLED_NUMBERS // max(1, self.cells * self.parts))
        ) - len(self.rows.samples)

    def _read_numbers(self, text: bytes, read: Callable[[bytes], float]) -> list[float]:
        """Return the numbers of a row; NaN for other cells."""
        if not self.markers:
            return list(map(read, text.replace(b",", b" ").split()))
        return [read(cell.strip() or b"nan") for cell in text.split(b"\t")]

    def examine_odd_line(self, text: bytes, line: int) -> None:
        """Examine one line that is not a valid row, cell by cell."""
        # One byte for each character, so that offsets count characters.
        text = text.decode("utf-8", "replace").encode("latin-1", "replace").rstrip(b"\r")
        # OpenSim rejects a table of vectors with a line of blanks, and ends it at an empty line,
        # also before the first row.
        if not (text if self.parts > 1 else text.strip()):
            if self.rows.count or self.parts > 1:
                self._note_fault("blank", 0, line, 0, b"")
            return
        rows = self.rows
        # Comments in tables are not allowed by OpenSim; these are the signs that other programs
        # begin them with.
        if text.lstrip()[:1] in (b"#", b"/", b"%", b";"):
            self._note_fault("comment", 0, line, 0, b"")
            return
        if _LETTER.search(text) and not _OF_ROW.search(text):
            words = _shorten(" ".join(text.decode("latin-1").split()))
            self._note_fault("words", 0, line, 0, b"", words)
            return
        cells, count = self._split_cells(text)
        if count != self.cells:
            # Blanks in place of tabs are a usual fault of converters, and deserve a message of
            # their own.
            end = cells[self.cells][0] if count > self.cells else len(text.rstrip())
            blanks = (
                (self.markers or self.parts > 1)
                and b"\t" not in text
                and len(text.split(None, self.cells)) == self.cells
            )
            self._note_fault(
                "row",
                count,
                line,
                end,
                b"",
                "; its cells are separated by spaces instead of tabs" if blanks else "",
            )
            if blanks and self.markers:
                self._expect_frame(text.split(None, 1)[0], line)
                return
            # Without the right cells, it is unknown to which column a number belongs.
            if blanks or self.parts > 1:
                return
        time = 1 if self.markers else 0
        for number, (start, cell) in enumerate(cells[: self.cells]):
            if self.markers and number == 0:
                self._expect_frame(cell, line)
            elif number == time:
                value = self._read_time(cell)
                if value != value:
                    self._note_fault("time", time, line, start, cell)
                # Only in tables of vectors is a time read that is no plain number.
                elif value != parse_number(cell):
                    self._note_fault("cell", time, line, start, cell)
                if value == value and not value > self._get_last_time():
                    self._note_time_order_fault(text, line, value, self._get_last_time())
            elif self.parts > 1:
                self._examine_vector(cell, number, line, start)
            elif not (self.markers and cell.lower() in (b"", b"nan")) and isnan(parse_number(cell)):
                self._note_fault("cell", number, line, start, cell)
        # A row of the right width counts even if cells are wrong, so that later times and lines
        # stay right.
        if count == self.cells > time:
            self._note_line_of_row(line)
            value = self._read_time(cells[time][1])
            rows.times.append(value if value == value else nextafter(self._get_last_time(), inf))
            rows.count += 1
            if self.markers:
                form = b"\t".join(
                    b"" if cell.lower() in (b"", b"nan") else b"0" for _, cell in cells
                )
                rows.unseen -= _find_present_markers(form, self.cells) or set()
                self._examine_markers(text, line)
            if self._count_missing_samples() > 0:
                rows.samples.append(
                    self._read_vectors(cells)
                    if self.parts > 1
                    else self._read_numbers(text, parse_number)
                )

    def _read_time(self, cell: bytes) -> float:
        """Return the time in a cell; NaN for a text without one."""
        # In tables of vectors, OpenSim ignores what follows the number.
        return (
            parse_leading_number(cell.decode("latin-1")) if self.parts > 1 else parse_number(cell)
        )

    def _examine_vector(self, cell: bytes, number: int, line: int, start: int) -> None:
        """Record a wrong number of values in a cell of several, or its first value that is no number."""
        parts = split_vector(cell.decode("latin-1"))
        if len(parts) != self.parts:
            self._note_fault("vector", number, line, start, cell)
            return
        for part in parts:
            word = part.strip(BLANKS).encode("latin-1")
            if not isfinite(parse_number(word)):
                start += len(part) - len(part.lstrip(BLANKS))
                self._note_fault("cell", number, line, start, word)
                return
            start += len(part) + 1

    def _read_vectors(self, cells: list[tuple[int, bytes]]) -> list[float]:
        """Return the numbers of a row of vectors; NaN for those that are missing."""
        result = [parse_number(cells[0][1])]
        for _, cell in cells[1:]:
            values = list(map(parse_leading_number, split_vector(cell.decode("latin-1"))))
            result += [*values, *[nan] * self.parts][: self.parts]
        return result

    def _split_cells(self, text: bytes) -> tuple[list[tuple[int, bytes]], int]:
        """Return the cells of a row with their offsets, at most one too many, and the number of all cells."""
        if self.parts > 1:
            return self._split_cells_of_vectors(text)
        if not self.markers:
            words = _WORD.finditer(text)
            cells = [(match.start(), match[0]) for match in islice(words, self.cells + 1)]
            return cells, len(cells) + sum(1 for _ in words)
        cells = []
        start = 0
        for cell in text.split(b"\t", self.cells + 1)[: self.cells + 1]:
            cells.append((start + len(cell) - len(cell.lstrip()), cell.strip()))
            start += len(cell) + 1
        count = text.count(b"\t") + 1
        # A tab may end the last cell, too.
        ends = count == self.cells + 1 and not cells[-1][1]
        return cells[: len(cells) - ends], count - ends

    def _split_cells_of_vectors(self, text: bytes) -> tuple[list[tuple[int, bytes]], int]:
        """Return the cells of a row of vectors with their offsets, and the number of all cells."""
        result: list[tuple[int, bytes]] = []
        start = 0
        pieces = split_vector_row(text.decode("latin-1"))
        for number, piece in enumerate(pieces[: self.cells + 1]):
            cell = piece.lstrip(BLANKS)
            offset = start + len(piece) - len(cell)
            # Blanks after the time are not part of it; `split_vector` removes those after a cell.
            result.append((offset, (cell if number else cell.rstrip(BLANKS)).encode("latin-1")))
            start += len(piece) + 1
        return result, len(pieces)

    def _get_last_time(self) -> float:
        """Return the time of the last row."""
        return self.rows.times[-1] if self.rows.times else -inf

    def _note_line_of_row(self, line: int) -> None:
        """Record the line of the next row where it does not follow the previous one."""
        if line != self.rows.line_of(self.rows.count):
            self.rows.lines.append((self.rows.count, line))

    def _expect_frame(self, cell: bytes, line: int) -> None:
        # Python refuses to convert integers of more than 4,300 digits.
        number = int(cell) if cell.isdigit() and len(cell) < 20 else None
        if number is None or (self._frame and number != self._frame + 1):
            self._note_fault("frame", 0, line, 0, cell)
        # After a wrong frame number the count continues from it: one shift is one finding.
        self._frame = number if number is not None else self._frame + 1

    def _note_time_order_fault(
        self, text: bytes, line: int, time: float, previous_time: float
    ) -> None:
        """Note that a row's time is not later than that of the row before, at the cell of the time.

        Args:
            text: text of the row.
            line: number of the line.
            time: time of the row, s.
            previous_time: time of the row before, s.
        """
        # Rows of marker files have a frame number before the time.
        match = _WORD.search(text, text.find(b"\t") if self.markers else 0)
        start, word = (match.start(), match[0]) if match else (0, b"")
        self._note_fault(
            "order", int(time < previous_time), line, start, word, f"{time:.9g} {previous_time:.9g}"
        )

    def _note_fault(
        self,
        kind: str,
        number: int,
        line: int,
        start: int,
        cell: bytes,
        text: str | None = None,
        times: int = 1,
    ) -> None:
        """Record the first fault of a kind in a column, and count the later ones."""
        faults = self.rows.faults
        if (kind, number) in faults:
            # A fault in the same column is counted, not reported again.
            fault = faults[kind, number]
            faults[kind, number] = fault._replace(times=fault.times + times)
        else:
            description = cell.decode("latin-1") if text is None else text
            faults[kind, number] = RowFault(
                kind, number, line, start + 1, max(1, len(cell)), description, times
            )


def _shorten(text: str) -> str:
    """Return a text, cut after `_MAX_QUOTED_LENGTH` letters."""
    return text if len(text) <= _MAX_QUOTED_LENGTH else f"{text[:_MAX_QUOTED_LENGTH]}..."


def _compute_shapes(block: bytes, layout: RowLayout) -> tuple[bytes, bool]:
    """Return the shapes of lines; missing markers (NaN) count as empty."""
    if b"\r" in block:
        block = block.replace(b"\r\n", b"\n")
    if layout is MARKERS and b"N" in block:
        # Twice, since one of two that follow on each other takes the tab from the other.
        block = (
            block.replace(b"\tNaN\t", b"\t\t")
            .replace(b"\tNaN\t", b"\t\t")
            .replace(b"\tNaN\n", b"\t\n")
        )
    return compute_shapes(block, layout)


@lru_cache(maxsize=256)
def _find_present_markers(form: bytes, cells: int) -> frozenset[int] | None:
    """Return the markers that a row of this shape contains; None if it is not a row of markers."""
    # This is cached, since tables have few distinct shapes of rows.
    numbers = form.split(b"\t")
    if len(numbers) == cells + 1 and not numbers[-1]:
        numbers.pop()
    if len(numbers) != cells or set(numbers) - {b"", b"0"}:
        return None
    return frozenset(
        marker
        for marker in range((cells - 2) // 3)
        if all(numbers[3 * marker + 2 : 3 * marker + 5])
    )


def _split_blocks(data: bytes, start: int) -> Iterator[bytes]:
    """Yield blocks of complete lines from an offset on, without blank lines at the end."""
    size = len(data)
    # Blank lines at the end are no rows and no fault.
    while size > start and data[size - 1] in b"\r\n" and data[size - 2] in b"\r\n":
        size -= 1
    while start < size:
        end = (
            # A line longer than a block becomes a block of its own.
            data.rfind(b"\n", start, min(start + BLOCK_BYTES, size)) + 1
            or data.find(b"\n", start, size) + 1
            or size
        )
        block = data[start:end]
        yield block if block.endswith(b"\n") else block + b"\n"
        start = end


def _may_overflow(text: bytes) -> bool:
    """Return whether a text may have a number beyond the largest one."""
    # Two expressions that begin with a letter are three times faster than one with both letters.
    return any(
        letter in text and expression.search(text) is not None
        for letter, expression in ((b"e", _LARGE_EXPONENT), (b"E", _LARGE_CAPITAL_EXPONENT))
    )


def parse_number(cell: bytes) -> float:
    """Return the number in a cell as C++ reads it; NaN for anything else.

    NaN, infinity and numbers beyond the largest one are not read either.
    """
    value = float(cell) if _PLAIN.fullmatch(cell) else nan
    return value if isfinite(value) else nan
