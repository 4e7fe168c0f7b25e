"""Tables (.sto, .mot, .trc) as check targets: header, labels and rows."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import islice, pairwise
from math import inf
from typing import ClassVar

from osimlite.base.patterns import compile_later
from osimlite.io.document.source import Position
from osimlite.io.tables.headers import MARK, Entry, MarkerHeader, StorageHeader, Word
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.scan import RowScanner, TableRows, parse_number
from osimlite.lint.suppressions import Suppression, read_header_suppressions

MAX_STEP_RATIO = 2.5
"""Largest ratio of a step of time to the usual one; rounded times can double a step."""

_CELL = compile_later(rb"[^ \t\r\n]+")
_ROW = compile_later(rb"[^ \t\r\n][^\n]*")


class Table(CheckTarget):
    """Table under check; everything readable is available, even if parts of the text are invalid.

    Args:
        data: content of the file.
        file: path of the file.
        config: configuration of the check.
    """

    about: ClassVar[str] = "table"
    file: str

    def __init__(self, data: bytes, file: str, config: Config | None = None) -> None:
        super().__init__(config)
        self.data, self.file = data, file
        self.is_markers = file.lower().endswith(".trc")

    @cached_property
    def header(self) -> StorageHeader | MarkerHeader:
        """Header before the rows."""
        return MarkerHeader(self.data) if self.is_markers else StorageHeader(self.data, self.file)

    @property
    def entries(self) -> dict[str, Entry]:
        """Entries of the header.

        Returns:
            Entries by key.
        """
        return self.header.entries

    @property
    def is_strict(self) -> bool:
        """True if OpenSim's newer reader reads this storage file: every row is a line, and NaN is a value."""
        return isinstance(self.header, StorageHeader) and self.header.is_strict

    @property
    def parts(self) -> int:
        """Number of values of a cell; 1 except in tables of vectors."""
        return self.header.parts if isinstance(self.header, StorageHeader) else 1

    @property
    def labels(self) -> list[Word]:
        """Labels of the columns including time; in a marker file only those of the markers."""
        return self.header.labels

    @property
    def columns(self) -> list[str]:
        """Labels without that of the time."""
        return [label.text for label in (self.labels if self.is_markers else self.labels[1:])]

    @cached_property
    def rows(self) -> TableRows:
        """Rows of the table with their faults, scanned on first access."""
        header = self.header
        cells = len(self.labels)
        # If labels are missing or too many, the first row determines the number of cells.
        first_row = _ROW.search(self.data, header.rows)
        if isinstance(header, MarkerHeader):
            markers = (len(first_row[0].rstrip().split(b"\t")) - 2) // 3 if first_row else 0
            declared_count = (
                self.entries["NumMarkers"].value.text if "NumMarkers" in self.entries else ""
            )
            cells = markers if str(markers) == declared_count else cells
            return RowScanner(cells * 3 + 2, markers=True).scan(
                self.data, header.rows, header.row_line
            )
        # OpenSim rejects tables with commas as a whole; findings for each row would say nothing
        # new.
        if not header.labels or "," in header.labels[0].text:
            return TableRows()
        # OpenSim ignores the count in tables of vectors, where blanks do not separate cells.
        if (
            header.parts == 1
            and first_row
            and str(len(first_row[0].split())) == header.value("nColumns")
        ):
            cells = len(first_row[0].split())
        return RowScanner(cells, header.parts).scan(self.data, header.rows, header.row_line)

    def iterate_rows(self, time: float) -> Iterator[list[bytes]]:
        """Yield the cells of the rows from a time on; the first is found by bisection."""
        data = self.data
        time_column = int(self.is_markers)
        low = self.header.rows
        high = len(data)
        # The remaining rows are few, so reading them one by one is as fast.
        while high - low > 2000:
            middle = data.find(b"\n", (low + high) // 2, high) + 1
            # Frame number and time are in the first letters of a row, which may have thousands of
            # cells.
            cells = data[middle : middle + 200].split(None, 2) if middle else []
            if len(cells) <= time_column or not parse_number(cells[time_column]) < time:
                high = (low + high) // 2
            else:
                low = middle
        while low < len(data):
            end = data.find(b"\n", low) + 1 or len(data)
            line = data[low:end].rstrip(b"\r\n")
            cells = line.split(b"\t") if self.is_markers else line.split()
            if len(cells) > time_column and parse_number(cells[time_column]) >= time:
                yield cells
            low = end

    def read_row(self, time: float) -> list[float]:
        """Return the numbers of the first row from a time on, NaN for other cells; empty without a row."""
        return [parse_number(cell) for cell in next(self.iterate_rows(time), [])]

    @property
    def span(self) -> tuple[float, float] | None:
        """Time span of the rows.

        Returns:
            First and last time, s; None without rows, or if a row has no readable time.
        """
        times = self.rows.times
        return (times[0], times[-1]) if times and not self.rows.select("time") else None

    @cached_property
    def step(self) -> float:
        """Usual step from one time to the next, s; 0 if fewer than two rows have a time, or a row has none."""
        from statistics import median

        times = self.rows.times
        if len(times) < 2 or self.rows.select("time"):
            return 0
        return median(after - before for before, after in pairwise(times))

    @cached_property
    def rate(self) -> float:
        """Rows per second, Hz; 0 if fewer than two rows have a time, or a row has none.

        The mean of many steps is exact although times are rounded: 0, 0.017, 0.033, 0.050 are 60 Hz.
        Gaps do not count.
        """
        if self.span is None or len(self.rows.times) < 2:
            return 0.0
        longest = MAX_STEP_RATIO * self.step if self.step > 0.0 else inf
        steps = (after - before for before, after in pairwise(self.rows.times))
        gaps = [step for step in steps if step > longest]
        first, last = self.span
        duration = last - first - sum(gaps)
        return (len(self.rows.times) - 1 - len(gaps)) / duration if duration > 0.0 else 0.0

    def label_of(self, number: int) -> str:
        """Return the label of a column by its index; in a marker file that of its marker."""
        index = (number - 2) // 3 if self.is_markers else number
        return (
            "Time"
            if index < 0
            else self.labels[index].text
            if index < len(self.labels)
            else str(number)
        )

    def locate_time(self, line: int) -> Position:
        """Return the position of the time in the row of a line."""
        start = self.line_start(line)
        text = self.data[start : self.line_start(2, start)]
        first, *other_cells = islice(_CELL.finditer(text), 2)
        result = other_cells[0] if self.is_markers else first
        return Position(line, result.start() + 1, len(result[0]))

    def suppressions(self) -> list[Suppression]:
        """Return the lines of the header that ignore findings; a marker file cannot have any."""
        return [] if self.is_markers else read_header_suppressions(self.header.lines)

    def make_replacement(
        self, position: Position, expected: object, text: str, *, certain: bool
    ) -> Fix | None:
        """Return the fix that replaces a text in the header or among the labels; None if the encoding is unknown.

        `expected` is the present text, or None for any text.
        """
        start = self.line_start(position.line)
        line = self.data[start : self.line_start(2, start)].rstrip(b"\r\n")
        # The byte order mark is not counted as a column.
        if start == 0 and line.startswith(MARK):
            start, line = len(MARK), line.removeprefix(MARK)
        try:
            letters = line.decode()
        except UnicodeDecodeError:
            return None
        before = letters[: position.column - 1]
        old = letters[position.column - 1 :][: position.length]
        # Columns count letters, edits count bytes.
        start += len(before.encode())
        safe = certain or text.lower() == old.lower()
        return Fix((Edit(start, start + len(old.encode()), text),), safe)

    def insert_line(self, number: int, line: str) -> Fix:
        """Return the fix that inserts a line before another.

        Args:
            number: number of the line before which the new one is inserted.
            line: text of the new line.
        """
        start = self.line_start(number)
        return Fix((Edit(start, start, line + ("\r\n" if b"\r\n" in self.data[:1000] else "\n")),))

    def line_start(self, number: int, start: int = 0) -> int:
        """Return the offset in bytes of a line, counted from the line that begins at `start`."""
        for _ in range(number - 1):
            start = self.data.find(b"\n", start) + 1 or len(self.data)
        return start
