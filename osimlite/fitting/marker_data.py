"""Measured markers from .trc and .c3d files, tables and arrays."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.files import read_file
from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import DocumentError
from osimlite.fitting.measurements import Measurements
from osimlite.io.tables.c3d import ENDING, read_c3d_markers
from osimlite.io.tables.headers import METRES_PER_UNIT, MarkerHeader
from osimlite.io.tables.storage import read_sto
from osimlite.io.tables.vector_rows import DECIMAL_COMMA
from osimlite.mechanics.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class MarkerData(Measurements):
    """Measured positions of m markers in ground (t, m, 3), m; NaN where a marker was not seen."""

    noun = "marker"
    shape = (3,)

    @classmethod
    def from_source(cls, source: MarkerSource, times: ArrayLike | None = None) -> MarkerData:
        """Return markers from a file, or from arrays (t, 3) or (3,) by name, m.

        Args:
            source: path of a .trc, .c3d or .sto file, arrays by name, or MarkerData.
            times: times of the frames of arrays, s; by default 0, 1, 2 ...

        Raises:
            MissingFileError: the file does not exist.
            DocumentError: the file is damaged.
            SettingError: the arrays do not fit together.
            MissingDependency: ezc3d, which reads .c3d files, is not installed.
        """
        if isinstance(source, MarkerData):
            return source
        if isinstance(source, str | Path):
            return _READERS.get(Path(source).suffix.lower(), read_trc)(source)
        return cls.from_arrays(source, times)

    @property
    def positions(self) -> Array:
        """Positions (t, m, 3), m."""
        return self.values

    def select_times(self, start_time: float, end_time: float) -> MarkerData:
        """Return the frames between those nearest to two times.

        Args:
            start_time: first time, s; earlier than the data means from the start.
            end_time: last time, s; later than the data means to the end.

        Raises:
            SettingError: there is no frame between these times.
        """
        clipped_start = max(start_time, float(self.times[0]))
        clipped_end = min(end_time, float(self.times[-1]))
        if not clipped_start <= clipped_end:
            raise self.create_range_error(start_time, end_time)
        start, end = (int(np.argmin(np.abs(self.times - t))) for t in (clipped_start, clipped_end))
        return self.slice_frames(start, end + 1)


def read_trc(path: str | Path) -> MarkerData:
    """Return the markers of a .trc file, in metres.

    An empty cell, or NaN, is a marker that was not seen.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: its header or a row is damaged; with line and column.
    """
    data, file = read_file(path), str(path)
    header = MarkerHeader(data)
    names = tuple(label.text for label in header.labels)
    # Spreadsheet programs write a byte order mark before the first word.
    if not names or not header.lines[0].lstrip("\ufeff").startswith("PathFileType"):
        raise DocumentError(
            "this is not a marker file: it must begin with 'PathFileType' and name markers",
            file=file,
        )
    unit = header.entries["Units"].value.text if "Units" in header.entries else ""
    if unit not in METRES_PER_UNIT:
        raise DocumentError(
            f"the markers are in '{unit}'; Units is one of {', '.join(METRES_PER_UNIT)}",
            file=file,
            line=3,
        )
    # Frame number, time, and three coordinates of each marker.
    width = 2 + 3 * len(names)
    rows = []
    for number, line in enumerate(
        data[header.rows :].decode("utf-8", "replace").splitlines(), header.row_line
    ):
        if not line.strip():
            continue
        cells = line.rstrip("\r\n").split("\t")
        # Some programs separate cells by spaces, which is unambiguous if no cell is empty.
        if len(cells) < width and len(line.split()) == width:
            cells = line.split()
        if any(cell.strip() for cell in cells[width:]):
            raise DocumentError(
                f"the row has more than the {format_count(width, 'cell')} of {format_count(len(names), 'marker')}",
                file=file,
                line=number,
            )
        rows.append(
            [_parse_number(cell, file, number, index) for index, cell in enumerate(cells[:width])]
        )
        # Editors remove tabs at the end of a line, and with them the cells of unseen markers.
        rows[-1] += [np.nan] * (width - len(rows[-1]))
    table = np.array(rows, dtype=float).reshape(-1, width)
    return MarkerData(
        names, table[:, 1], METRES_PER_UNIT[unit] * table[:, 2:].reshape(-1, len(names), 3), file
    )


def _parse_number(cell: str, file: str, line: int, index: int) -> float:
    """Return the number in a cell; NaN for an empty one.

    Raises:
        DocumentError: the cell has other text than a number; with its line.
    """
    text = cell.strip()
    try:
        return float(text) if text else np.nan
    except ValueError:
        if DECIMAL_COMMA.fullmatch(text):
            advice = "write decimal points instead of commas"
        elif index < 2:
            advice = "each row starts with the number of the frame and its time"
        else:
            advice = "leave the cells of an unseen marker empty"
        raise DocumentError(
            f"'{text}' in column {index + 1} is not a number; {advice}",
            file=file,
            line=line,
        ) from None


def read_sto_markers(path: str | Path) -> MarkerData:
    """Return the markers of a table (.sto) of Vec3, or of three columns for each marker.

    Positions are in metres, converted from the unit in the header of the table.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: the file is damaged, or its columns are not markers.
    """
    table = read_sto(path)
    suffixes = ("_x", "_y", "_z") if table.kind == "Vec3" else ("_tx", "_ty", "_tz")
    first_columns = table.columns[::3]
    names = tuple(label.removesuffix(suffixes[0]) for label in first_columns)
    if [f"{name}{suffix}" for name in names for suffix in suffixes] != [*table.columns]:
        raise DocumentError(
            "the columns are not marker positions: each marker has three columns, which end in "
            f"{', '.join(suffixes)}",
            file=str(path),
        )
    unit = METRES_PER_UNIT.get(table.header.get("Units", "m"), 1.0)
    return MarkerData(names, table.times, unit * table.rows.reshape(-1, len(names), 3), str(path))


def read_c3d(path: str | Path) -> MarkerData:
    """Return the markers of a .c3d file, in metres along the axes of the file.

    Raises:
        MissingFileError: the file does not exist.
        DocumentError: the file is not a .c3d file.
        MissingDependency: ezc3d is not installed.
    """
    return MarkerData(*read_c3d_markers(path), str(path))


MarkerSource = MarkerData | str | Path | Mapping[str, ArrayLike]
"""Sources of markers: data, a file, or arrays by name."""

_READERS = {".trc": read_trc, ENDING: read_c3d, ".sto": read_sto_markers}
"""Readers by suffix of the file; .trc is the default."""
