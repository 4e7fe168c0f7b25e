"""Measured markers: from .trc and .c3d files, tables, and arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import DocumentError, MissingDependency, OsimliteError, SettingError
from osimlite.files import read_file
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass
from osimlite.simulation.files.storage import read_sto
from osimlite.tables import METRES, MarkerHeader
from osimlite.text import did_you_mean, listed


@dataclass(frozen=True, eq=False)
class MarkerData:
    """Places of m markers at t times.

    Attributes:
        names: of the markers (m,).
        times: (t,), s.
        positions: in ground (t, m, 3), m; NaN where a marker was not seen.
        file: where they were read from.
    """

    names: tuple[str, ...]
    times: Array
    positions: Array
    file: str | None = None

    def __post_init__(self) -> None:
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise DocumentError(f"two markers are called {listed(twice)}; rename one of each", file=self.file)
        if len(self.times) == 0:
            raise DocumentError("there are markers but no frames", file=self.file)
        if self.positions.shape != (len(self.times), len(self.names), 3):
            raise SettingError(
                f"the positions of {len(self.names)} markers at {len(self.times)} times are an array of that many "
                f"times, markers and 3 numbers; got {' × '.join(map(str, self.positions.shape))}"
            )
        steps = np.diff(self.times)
        if not (steps > 0.0).all() or not np.isfinite(self.times).all():
            frame = int(np.argmin(steps > 0.0)) + 2 if len(steps) else 1
            raise DocumentError(
                f"the times of the frames must increase, and frame {frame} does not come after the one before it",
                file=self.file,
            )

    @classmethod
    def of(cls, source: Measured, times: ArrayLike | None = None) -> MarkerData:
        """Markers from a file, or from arrays (t, 3) or (3,) in metres by their names.

        Args:
            source: a .trc, .c3d or .sto file, arrays by name, or what is markers already.
            times: of the frames of arrays, s; by default 0, 1, 2 ...

        Raises:
            MissingFileError: there is no such file.
            DocumentError: it is damaged.
            SettingError: the arrays do not fit together.
            MissingDependency: ezc3d, which reads .c3d files, is not installed.
        """
        if isinstance(source, MarkerData):
            return source
        if isinstance(source, str | Path):
            return _READERS.get(Path(source).suffix.lower(), read_trc)(source)
        arrays = {name: np.atleast_2d(np.asarray(value, dtype=float)) for name, value in source.items()}
        counts = {array.shape for array in arrays.values()}
        if len(counts) != 1 or next(iter(counts))[1:] != (3,):
            raise SettingError("every marker has one row of three numbers for each frame, as many as all others")
        (count, _), *_ = counts
        moments = np.arange(count, dtype=float) if times is None else np.asarray(times, dtype=float).reshape(-1)
        return cls(tuple(arrays), moments, np.stack([*arrays.values()], axis=1))

    def between(self, first: float, last: float) -> MarkerData:
        """The frames from the one nearest to a time to the one nearest to another, both cut to the data.

        Raises:
            SettingError: no frame lies between.
        """
        low, high = max(first, float(self.times[0])), min(last, float(self.times[-1]))
        if not low <= high:
            where = f" of '{self.file}'" if self.file else ""
            raise SettingError(
                f"no frame{where} lies between {first:g} and {last:g} s; the data are from {self.times[0]:g} to "
                f"{self.times[-1]:g} s"
            )
        start, end = (int(np.argmin(np.abs(self.times - t))) for t in (low, high))
        return MarkerData(self.names, self.times[start : end + 1], self.positions[start : end + 1], self.file)

    def only(self, names: Sequence[str]) -> Array:
        """The positions (t, k, 3) of some markers.

        Raises:
            SettingError: there is no such marker.
        """
        places = {name: place for place, name in enumerate(self.names)}
        for name in names:
            if name not in places:
                where = f"'{self.file}'" if self.file else "the data"
                raise SettingError(f"{where} has no marker '{name}'{did_you_mean(name, self.names)}")
        return self.positions[:, [places[name] for name in names]]


def read_trc(path: str | Path) -> MarkerData:
    """The markers of a .trc file.

    An empty cell, or NaN, is a marker that was not seen.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: its header or a row is damaged; with line and column.
    """
    data, file = read_file(path), str(path)
    header = MarkerHeader(data)
    names = tuple(label.text for label in header.labels)
    if not names or not header.lines[0].lstrip("\ufeff").startswith("PathFileType"):
        raise DocumentError("it is no marker file: it must begin with 'PathFileType' and name markers", file=file)
    unit = header.entries["Units"].value.text if "Units" in header.entries else ""
    if unit not in METRES:
        raise DocumentError(f"the markers are in '{unit}'; Units is one of {', '.join(METRES)}", file=file, line=3)
    width = 2 + 3 * len(names)
    rows = []
    for number, line in enumerate(data[header.rows :].decode("utf-8", "replace").splitlines(), header.row_line):
        if not line.strip():
            continue
        cells = line.rstrip("\r\n").split("\t")
        if len(cells) < width and len(line.split()) == width:
            cells = line.split()
        if any(cell.strip() for cell in cells[width:]):
            raise DocumentError(
                f"the row has more than the {width} cells of {len(names)} markers", file=file, line=number
            )
        rows.append([_number(cell, file, number, place) for place, cell in enumerate(cells[:width])])
        rows[-1] += [np.nan] * (width - len(rows[-1]))
    table = np.array(rows, dtype=float).reshape(-1, width)
    return MarkerData(names, table[:, 1], METRES[unit] * table[:, 2:].reshape(-1, len(names), 3), file)


def _number(cell: str, file: str, line: int, place: int) -> float:
    text = cell.strip()
    try:
        return float(text) if text else np.nan
    except ValueError:
        raise DocumentError(
            f"'{text}' in column {place + 1} is no number; leave the cells of a marker that was not seen empty",
            file=file,
            line=line,
        ) from None


def read_sto_markers(path: str | Path) -> MarkerData:
    """The markers of a table of Vec3 (.sto), or of one with three columns for each marker, in metres.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it is damaged, or its columns are no markers.
    """
    table = read_sto(path)
    ends = ("_x", "_y", "_z") if table.kind == "Vec3" else ("_tx", "_ty", "_tz")
    firsts = table.columns[::3]
    names = tuple(label.removesuffix(ends[0]) for label in firsts)
    if [f"{name}{end}" for name in names for end in ends] != [*table.columns]:
        raise DocumentError(
            f"the columns are no places of markers: a marker has three, which end in {', '.join(ends)}", file=str(path)
        )
    unit = METRES.get(table.header.get("Units", "m"), 1.0)
    return MarkerData(names, table.times, unit * table.rows.reshape(-1, len(names), 3), str(path))


def read_c3d(path: str | Path) -> MarkerData:
    """The markers of a .c3d file, in the axes of the file.

    Raises:
        MissingFileError: there is no such file.
        DocumentError: it is no .c3d file.
        MissingDependency: ezc3d is not installed.
    """
    read_file(path)
    try:
        found: Any = import_module("ezc3d").c3d(str(path))
    except ImportError:
        raise MissingDependency(
            "a .c3d file is read by ezc3d, which is not installed; run: pip install ezc3d", file=str(path)
        ) from None
    except (OSError, RuntimeError, ValueError) as error:
        raise DocumentError(f"the file cannot be read: {error}", file=str(path)) from None
    points = found["parameters"]["POINT"]
    unit = METRES.get(points["UNITS"]["value"][0].strip().lower(), 0.001)
    names = tuple(name for key, more in points.items() if key.startswith("LABELS") for name in more["value"])
    positions = np.moveaxis(found["data"]["points"][:3], (2, 1, 0), (0, 1, 2))
    rate, first = found["header"]["points"]["frame_rate"], found["header"]["points"]["first_frame"]
    times = (first + np.arange(len(positions))) / rate
    return MarkerData(names[: positions.shape[1]], times, unit * positions, str(path))


def common(model: Sequence[str], data: MarkerData, chosen: Mapping[str, float] | None = None) -> list[str]:
    """Names of the markers that a model and data share, in the order of the data.

    Args:
        model: names of the markers of the model.
        data: what was measured.
        chosen: only of these, if given.

    Raises:
        OsimliteError: there are none.
    """
    names = [name for name in data.names if name in model and (chosen is None or name in chosen)]
    if not names:
        where = f"'{data.file}'" if data.file else "the data"
        raise OsimliteError(
            f"no marker of {where} ({listed([*data.names])}) is one of the model ({listed([*model])}); "
            "give the markers of the model the names of the data"
        )
    return names


Measured = MarkerData | str | Path | Mapping[str, ArrayLike]
"""Markers in any form."""

_READERS = {".trc": read_trc, ".c3d": read_c3d, ".sto": read_sto_markers}
