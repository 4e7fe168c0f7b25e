"""Reading and writing of OpenSim's storage files (.sto, .mot), which are tables over time."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np

from osimlite.base.files import open_atomically
from osimlite.base.lazy import make_plot
from osimlite.base.records import dataclass, field
from osimlite.base.text import format_count
from osimlite.errors import DocumentError, OsimliteError, SettingError, SimulationError
from osimlite.io.tables.headers import MAX_TIME_S, list_suffixes
from osimlite.io.tables.table_stream import TableStream
from osimlite.io.tables.tabular import Tabular
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class StoTable(Tabular):
    """Table over time.

    Attributes:
        name: first line of the file.
        times: times (n,), s.
        columns: labels of the m columns besides the time; OpenSim writes some labels twice.
        rows: values (n, m).
        in_degrees: whether rotational values are in degrees.
        header: rest of every line of the header by its first word.
        kind: type of a value (``DataType``); a value other than ``double`` has several columns.
        file: path of the file.
    """

    name: str
    times: Array
    columns: tuple[str, ...]
    rows: Array
    in_degrees: bool = False
    header: dict[str, str] = field(default_factory=dict)
    kind: str = "double"
    file: str | None = None

    plot = make_plot("plot_table")

    @property
    def heading(self) -> str:
        """Class, name, times and number of columns, in one line."""
        words = f"{type(self).__name__} '{self.name}': {describe_times(self.times)}"
        return f"{words}, {format_count(len(self.columns), 'column')}"

    def __getitem__(self, column: str) -> Array:
        """Return the first column (n,) with a label.

        Raises:
            KeyError: no column has this label.
        """
        if column not in self.columns:
            raise KeyError(column)
        return self.rows[:, self.columns.index(column)]

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """The times and the columns; the second column of a label is called ``label.1``.

        Returns:
            The index, which is ``time`` (s), and the columns by label, each (n,).
        """
        columns = dict[str, Array]()
        label_counts = Counter[str]()
        for label, column in zip(self.columns, self.rows.T, strict=True):
            columns[f"{label}.{label_counts[label]}" if label_counts[label] else label] = column
            # A label may occur several times.
            label_counts[label] += 1
        return {"time": self.times}, columns


def describe_times(times: Array) -> str:
    """Return number and range of times, in words."""
    if not len(times):
        return "no times"
    return f"{format_count(len(times), 'time')} from {times[0]:g} to {times[-1]:g} s"


def format_sto(
    name: str,
    times: Iterable[float],
    columns: Sequence[str],
    rows: Iterable[Iterable[float]],
    *,
    in_degrees: bool = False,
    header: Mapping[str, str] = MappingProxyType({}),
) -> str:
    """Return a table as the text of a storage file, with all digits of every number."""
    lines = list(_format_lines(times, rows, 1))
    first_line, *other_lines = _format_header(name, columns, len(lines), in_degrees, "double")
    return "".join(
        [first_line, *(f"{key}={value}\n" for key, value in header.items()), *other_lines, *lines]
    )


def write_sto(
    path: str | Path,
    name: str,
    times: Iterable[float],
    columns: Sequence[str],
    rows: Iterable[Iterable[float]],
    *,
    in_degrees: bool = False,
    kind: str = "double",
    has_missing: bool = False,
) -> None:
    """Write a table to a file atomically; the rows are taken one by one.

    Args:
        path: file to write.
        name: first line of the file.
        times: times of the rows, s.
        columns: labels of the columns; for a type other than ``double``, one for each cell.
        rows: rows of numbers, those of one cell after the other.
        in_degrees: whether rotational values are in degrees.
        kind: type of a cell (``DataType``): ``double``, ``Vec3``, ``Quaternion`` or another of
            OpenSim.
        has_missing: whether numbers may be NaN for missing measurements, such as markers that were
            not seen. No number is checked then.

    Raises:
        SimulationError: a number is NaN or infinite, and `has_missing` is false.
        OsimliteError: the file cannot be written, or a row ends within a cell.
        UnsupportedError: OpenSim has no such type.
    """
    # Imported here, since many programs read tables and write none.
    import shutil
    import tempfile

    # The header states the number of rows and precedes them, so rows go to a temporary file first.
    with tempfile.TemporaryFile("w+b") as body:
        count = 0
        for line in _format_lines(
            times, rows, len(list_suffixes(kind)), () if has_missing else columns
        ):
            body.write(line.encode())
            count += 1
        body.seek(0)
        with open_atomically(path) as stream:
            stream.write("".join(_format_header(name, columns, count, in_degrees, kind)).encode())
            shutil.copyfileobj(body, stream)


def read_sto(path: str | Path) -> StoTable:
    """Read a table that OpenSim 4 or an older version wrote; for errors see :class:`TableStream`.

    Returns:
        Table with the labels and all rows of the file.
    """
    times, rows = array("d"), array("d")
    with TableStream(path) as stream:
        for time, row in stream:
            times.append(time)
            rows.extend(row)
        return StoTable(
            stream.name,
            # `frombuffer` shares the memory of the arrays, without a copy.
            np.frombuffer(times) if times else np.zeros(0),
            stream.columns,
            np.frombuffer(rows).reshape(-1, len(stream.columns))
            if rows
            # A table without columns still has times.
            else np.zeros((len(times), len(stream.columns))),
            stream.in_degrees,
            stream.header,
            stream.kind,
            str(path),
        )


def find_named_file(folder: Path, name: str) -> Path:
    """Return the path of a file that a document names.

    It is searched in the folder of the document, then in the current folder.

    Args:
        folder: folder of the document.
        name: name of the file in the document.
    """
    in_document_folder = folder / name
    in_current_folder = Path(name)
    # The folder of the document wins; if the file is in neither place, messages name that folder.
    return (
        in_document_folder
        if in_document_folder.is_file() or not in_current_folder.is_file()
        else in_current_folder
    )


def expect_plain_labels(name: str, columns: Sequence[str]) -> None:
    """Refuse names that a table cannot hold: a tab ends a label, and a line end the header.

    Args:
        name: name of the table.
        columns: labels of the columns.

    Raises:
        OsimliteError: a name has a tab or a line end.
    """
    for label in (name, *columns):
        # Readers of text end lines at more characters than at line feeds.
        if "\t" in label or len(f"{label}.".splitlines()) > 1:
            raise OsimliteError(
                f"a table cannot have the name {label!r}, which holds a tab or a line end; rename it in the model"
            )


def expect_increasing_times(times: Array, file: str | None) -> None:
    """Refuse times of an input through which no function can be fitted.

    Args:
        times: times (n,), s.
        file: path of the table, for messages.

    Raises:
        DocumentError: a time is not finite, is beyond `MAX_TIME_S`, or does not come after the one
            before.
    """
    # `not <` catches NaN as well.
    invalid = np.flatnonzero(~(np.abs(times) < MAX_TIME_S))
    if len(invalid):
        raise DocumentError(
            f"the time of row {invalid[0] + 1} is {times[invalid[0]]:g} s; correct it", file=file
        )
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        previous_time, next_time = times[late[0] : late[0] + 2]
        raise DocumentError(
            f"the time {next_time:g} does not come after {previous_time:g}; sort the rows",
            file=file,
        )


def expect_numbers(name: str, columns: Sequence[str], times: Array, rows: Array) -> None:
    """Refuse a result that is no number: this is the guard of all tables that are no input.

    Args:
        name: name of the result, for the message.
        columns: labels of the columns.
        times: times of the rows (t,), s.
        rows: rows of numbers (t, k).

    Raises:
        SimulationError: a value is NaN or infinite; with its column and time.
    """
    invalid = np.argwhere(~np.isfinite(rows))
    if len(invalid):
        row, column = invalid[0]
        raise SimulationError(
            f"'{columns[column]}' of the {name or 'results'} is {rows[row, column]:g} at {times[row]:g} s; look for a "
            "number in the model or the data that is far too large"
        )


def _format_header(
    name: str, columns: Sequence[str], rows: int, in_degrees: bool, kind: str
) -> Iterator[str]:
    expect_plain_labels(name, columns)
    yield f"{name}\n"
    yield f"inDegrees={'yes' if in_degrees else 'no'}\n"
    yield f"nColumns={len(columns) + 1}\n"
    yield f"nRows={rows}\n"
    yield f"DataType={kind}\n"
    yield "version=3\nendheader\n"
    yield "\t".join(("time", *columns)) + "\n"


def _format_lines(
    times: Iterable[float], rows: Iterable[Iterable[float]], size: int, columns: Sequence[str] = ()
) -> Iterator[str]:
    """Yield lines of numbers, `size` per value; numbers of named columns must be finite.

    Raises:
        SimulationError: a number of a named column is NaN or infinite.
        OsimliteError: the numbers of a row cannot be divided into values of `size` numbers.
    """
    for time, row in zip(times, rows, strict=True):
        # Rows are checked one by one, since they may come from a generator.
        if columns and not np.isfinite(values := np.array([*row], dtype=float)).all():
            labels = columns if size == 1 else [column for column in columns for _ in range(size)]
            expect_numbers("results", labels, np.array([time]), values[None])
        # Integers are written without ".0", as OpenSim does.
        words = [word[:-2] if word.endswith(".0") else word for word in map(repr, map(float, row))]
        if size > 1:
            if len(words) % size:
                raise OsimliteError(
                    f"a row has {format_count(len(words), 'number')}, which cannot be divided into values of {size} numbers"
                )
            words = [",".join(words[start : start + size]) for start in range(0, len(words), size)]
        yield "\t".join((format_number(time), *words)) + "\n"


def format_adapter_table(table: StoTable) -> Iterator[str]:
    """Yield the lines of a table as OpenSim's ``STOFileAdapter`` writes it, without OpenSim's version."""
    expect_plain_labels("", (*table.columns, *table.header, *map(str, table.header.values())))
    yield "".join(f"{key}={value}\n" for key, value in table.header.items())
    yield f"DataType={table.kind}\nversion=3\nendheader\n"
    ends = list_suffixes(table.kind)
    # Vectors have one label for all their components.
    labels = [column.removesuffix(ends[0]) for column in table.columns[:: len(ends)]]
    yield "\t".join(("time", *labels)) + "\n"
    # One format for the complete row is several times faster than one for each number.
    line = "\t".join(["%.16g", *[",".join(["%.16g"] * len(ends))] * len(labels)]) + "\n"
    for row in np.column_stack([table.times, table.rows]).tolist():
        yield line % tuple(row)


def format_number(value: float) -> str:
    """Return a number with all digits, an integer without a decimal point."""
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text


def expect_time_range(time_range: Sequence[float]) -> tuple[float, float]:
    """Return the two times of a `time_range`; as in OpenSim, more numbers have no effect.

    Returns:
        The first and the last time (s).

    Raises:
        SettingError: the range has fewer than two numbers.
    """
    if len(time_range) < 2:
        count = format_count(len(time_range), "number")
        raise SettingError(f"time_range has {count}; it needs two, the first and the last time")
    return time_range[0], time_range[1]
