"""Reader of storage files (.sto, .mot) row by row."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import inf, isfinite, isnan, nan
from pathlib import Path

from osimlite.base.files import open_file
from osimlite.base.patterns import compile_later
from osimlite.base.text import format_count
from osimlite.errors import DocumentError
from osimlite.io.tables.headers import MAX_HEADER_BYTES, StorageHeader, list_suffixes
from osimlite.io.tables.vector_rows import (
    BLANKS,
    parse_leading_number,
    split_vector,
    split_vector_row,
)

_NO_NUMBER = compile_later(r"[-+]?1\.#(IND|QNAN|SNAN|INF)\d*", re.IGNORECASE)
"""Pattern of NaN and infinity as programs on Windows wrote them."""


class TableStream:
    """Storage file that is read one row at a time.

    Close it after use, or use it in a ``with`` statement.
    """

    def __init__(self, path: str | Path) -> None:
        self.file, self.line, self.text = str(path), 0, ""
        self._stream = open_file(path)
        try:
            self._read_header()
        # Ctrl-C must not leave the file open either.
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file; further reads fail."""
        self._stream.close()

    def __enter__(self) -> TableStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[tuple[float, list[float]]]:
        time_column = self._time
        size = len(self.columns) + 1
        vectors = self.kind != "double"
        last_time = -inf
        for number, data in enumerate(self._stream, start=self.line + 1):
            # A broken character belongs to a word that is reported, not to an error of decoding.
            line = data.decode("utf-8", "replace")
            self.line, self.text = number, line
            if vectors:
                # An empty line ends the table for OpenSim; here it is passed over, as in other
                # tables, so that no row is lost.
                if line.rstrip("\r\n"):
                    time, row = self._parse_vectors(line, number)
                    if not time > last_time:
                        raise DocumentError(
                            f"the time {time:g} does not come after {last_time:g}",
                            file=self.file,
                            line=number,
                            column=1,
                        )
                    last_time = time
                    yield time, row
                continue
            try:
                # The fast path: nearly all rows are plain numbers.
                row = list(map(float, line.split()))
            except ValueError:
                row = self._parse_special_row(line, number)
            if not row:
                continue
            if len(row) != size:
                raise DocumentError(
                    f"the row has {format_count(len(row), 'number')} and needs {size}",
                    file=self.file,
                    line=number,
                    column=len(line.rstrip()) + 1
                    if len(row) < size
                    else find_word_start(line, size),
                )
            # The time may be in any column in files of version 1.
            time = row.pop(time_column)
            yield time, row

    def _parse_vectors(self, line: str, number: int) -> tuple[float, list[float]]:
        """Return the time and the numbers of a row of vectors, as OpenSim reads them.

        Args:
            line: text of the row.
            number: number of the line.

        Raises:
            DocumentError: OpenSim rejects the row, or its time is not a number.
        """
        # The fast path: nearly all rows are plain numbers. A sum that is not finite, underscores
        # and digits of other scripts need a closer look, since Python reads more than OpenSim.
        if [cell.count(",") for cell in line.split("\t")] == self._commas:
            try:
                row = list(map(float, line.replace("\t", ",").split(",")))
            except ValueError:
                row = [nan]
            if isfinite(sum(row)) and line.isascii() and "_" not in line:
                return row.pop(0), row
        time, *cells = split_vector_row(line) or [""]
        count = len(self.labels)
        if len(cells) != count:
            raise DocumentError(
                f"the row has {format_count(len(cells) + 1, 'cell')} and needs {count + 1}, with tabs between them",
                file=self.file,
                line=number,
                column=len(line.rstrip()) + 1,
            )
        value = parse_leading_number(time)
        if isnan(value):
            problem = f"'{time.strip()}' is not a number" if time.strip() else "the time is missing"
            raise DocumentError(problem, file=self.file, line=number, column=1)
        return value, self._parse_special_vectors(cells, number, len(time) + 2)

    def _parse_special_vectors(self, cells: list[str], number: int, column: int) -> list[float]:
        """Return the numbers of cells that hold other words than plain numbers.

        Args:
            cells: cells after the time.
            number: number of the line.
            column: column of the first cell in the line, from 1.

        Raises:
            DocumentError: a cell does not have as many numbers as a value of the table.
        """
        row = []
        size = self._size
        for label, cell in zip(self.labels, cells, strict=True):
            parts = split_vector(cell)
            if len(parts) != size:
                raise DocumentError(
                    f"the cell of column '{label}' has {format_count(len(parts), 'number')} and needs {size}",
                    file=self.file,
                    line=number,
                    column=column,
                )
            row += [
                # Programs on Windows wrote NaN as `1.#QNAN`. OpenSim reads 1 from it, but the
                # measurement is missing.
                nan if _NO_NUMBER.fullmatch(part.strip(BLANKS)) else parse_leading_number(part)
                for part in parts
            ]
            column += len(cell) + 1
        return row

    def _parse_special_row(self, text: str, number: int) -> list[float]:
        """Return the numbers of a row that has other words than plain numbers.

        Raises:
            DocumentError: a word is not a number.
        """
        row = []
        for match in re.finditer(r"\S+", text):
            word = match.group()
            non_finite = _NO_NUMBER.fullmatch(word)
            if non_finite:
                # "-1.#INF" becomes "-inf": the sign, without the digit.
                word = (
                    word[0].replace("1", "") + "inf"
                    if non_finite.group(1).upper() == "INF"
                    else "nan"
                )
            try:
                row.append(float(word))
            except ValueError:
                raise DocumentError(
                    f"'{word}' is not a number",
                    file=self.file,
                    line=number,
                    column=match.start() + 1,
                ) from None
        return row

    def _read_header(self) -> None:
        """Read the header, the labels, and the column of the time.

        Raises:
            DocumentError: the file is not a table, ends before its labels, or has no column 'time',
                or has vectors and another first column.
        """
        beginning = b"".join(self._stream.readlines(MAX_HEADER_BYTES))
        result = StorageHeader(beginning, self.file)
        if not result.end.text:
            raise DocumentError(_make_format_error(beginning[:100].lstrip()), file=self.file)
        self._stream.seek(result.rows)
        self.line, self.name, self.in_degrees = result.label_line, result.name, result.in_degrees
        self.header = {entry.key.text: entry.value.text for entry in result.entries.values()}
        ends = list_suffixes(result.kind, self.file)
        self.kind = "double" if ends == ("",) else result.kind
        if not result.labels:
            raise DocumentError(
                "the table ends before its column labels", file=self.file, line=result.end.at.line
            )
        labels = [label.text for label in result.labels]
        # OpenSim accepts "Time" in old files.
        time_column = next(
            (index for index, label in enumerate(labels) if label.lower() == "time"), None
        )
        # Vectors are split into columns, so that the time cannot stand between them.
        if time_column is None or (time_column > 0 and self.kind != "double"):
            raise DocumentError(
                f"the first column is '{labels[0]}'; it must be 'time'",
                file=self.file,
                line=self.line,
                column=result.labels[0].at.column,
            )
        self._time = time_column
        self.labels = (*labels[:time_column], *labels[time_column + 1 :])
        self.columns = tuple(label + end for label in self.labels for end in ends)
        # Number of values of a cell, and of commas in the cells of a row of vectors.
        self._size = len(ends)
        self._commas = [0] + [len(ends) - 1] * len(self.labels)


def _make_format_error(beginning: bytes) -> str:
    """Return the message for a file without a line 'endheader', by its beginning."""
    if beginning.startswith(b"PathFileType"):
        return (
            "these are markers over time (.trc), but a storage file is needed here (.sto, .mot); 'osimlite ik' computes "
            "coordinates from markers"
        )
    if beginning.startswith(b"<"):
        return "this is XML, not a storage file (.sto, .mot); are the arguments in the right order?"
    return "this is not a storage file (.sto, .mot): it has no line 'endheader'"


def find_word_start(text: str, word: int) -> int:
    """Return the column (from 1) at which a word (from 0) of a line starts.

    Args:
        text: line of the file.
        word: index of the word.
    """
    return [match.start() for match in re.finditer(r"\S+", text)][word] + 1


def stream_table(path: str | Path) -> TableStream:
    """Return a storage file that is open for reading row by row.

    Errors are those of :class:`TableStream`.

    Example::

        with stream_table("grf.mot") as table:
            for time, row in table:
                ...
    """
    return TableStream(path)
