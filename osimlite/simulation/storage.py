"""OpenSim's storage files (.sto): tables over time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.errors import DocumentError, MissingFileError, UnsupportedError
from osimlite.files import write_atomically
from osimlite.multibody.spatial import Array


@dataclass(frozen=True, eq=False)
class StoTable:
    """A table over time.

    Attributes:
        name: first line of the file.
        times: (n,), s.
        columns: labels of the m columns besides the time, in order; OpenSim itself writes some labels twice.
        rows: (n, m).
        in_degrees: whether rotational values are in degrees.
        header: every ``key=value`` line of the header.
    """

    name: str
    times: Array
    columns: tuple[str, ...]
    rows: Array
    in_degrees: bool = False
    header: dict[str, str] = field(default_factory=dict)

    def __getitem__(self, column: str) -> Array:
        """The first column (n,) of a label; KeyError if there is none."""
        if column not in self.columns:
            raise KeyError(column)
        values: Array = self.rows[:, self.columns.index(column)]
        return values


def sto_text(
    name: str,
    times: Iterable[float],
    columns: Sequence[str],
    rows: Iterable[Iterable[float]],
    *,
    in_degrees: bool = False,
) -> str:
    """Write a table as OpenSim 4.6 does, but with all digits of every number."""
    lines = ["\t".join(map(_number, (t, *row))) for t, row in zip(times, rows, strict=True)]
    header = [
        name,
        f"inDegrees={'yes' if in_degrees else 'no'}",
        f"nColumns={len(columns) + 1}",
        f"nRows={len(lines)}",
        "DataType=double",
        "version=3",
        "endheader",
        "\t".join(("time", *columns)),
    ]
    return "\n".join([*header, *lines]) + "\n"


def write_sto(
    path: str | Path,
    name: str,
    times: Iterable[float],
    columns: Sequence[str],
    rows: Iterable[Iterable[float]],
    *,
    in_degrees: bool = False,
) -> None:
    """Write a table to a file, whole or not at all.

    Raises:
        OsimliteError: the file cannot be written.
    """
    write_atomically(path, sto_text(name, times, columns, rows, in_degrees=in_degrees))


def read_sto(path: str | Path) -> StoTable:
    """Read a table of numbers, as OpenSim 4 or an older version wrote it.

    Raises:
        MissingFileError: there is no such file, or it may not be read.
        DocumentError: it is not a storage file; the message names the line.
        UnsupportedError: it holds something else than numbers.
    """
    try:
        lines = Path(path).read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise MissingFileError(f"cannot read the file: {error.strerror}", file=str(path)) from None
    stripped = [line.strip().lower() for line in lines]
    if "endheader" not in stripped:
        raise DocumentError("this is no storage file: it has no line 'endheader'", file=str(path))
    end = stripped.index("endheader")
    header = dict(_pairs(lines[:end]))
    kind = header.get("DataType", "double")
    if kind.lower() != "double":
        raise UnsupportedError(f"the table holds {kind}; osimlite reads tables of plain numbers", file=str(path))
    start = next((place for place in range(end + 1, len(lines)) if stripped[place]), None)
    if start is None:
        raise DocumentError("the table ends before its column labels", file=str(path), line=len(lines))
    labels = lines[start].strip().split("\t") if "\t" in lines[start].strip() else lines[start].split()
    labels = [label.strip() for label in labels]
    if labels[0].lower() != "time":
        raise DocumentError(f"the first column is '{labels[0]}'; it must be 'time'", file=str(path), line=start + 1)
    numbers = [_parsed(lines[place], len(labels), path, place + 1) for place in range(start + 1, len(lines))]
    rows = np.array([row for row in numbers if row], dtype=float).reshape(-1, len(labels))
    name = next((line.strip() for line in lines[:end] if line.strip() and "=" not in line), "")
    degrees = header.get("inDegrees", "no").lower() in ("yes", "y", "true")
    return StoTable(name, rows[:, 0], tuple(labels[1:]), rows[:, 1:], degrees, header)


def _number(value: float) -> str:
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text


def _pairs(lines: Iterable[str]) -> Iterable[tuple[str, str]]:
    for line in lines:
        key, equals, value = line.partition("=")
        if equals:
            yield key.strip(), value.strip()


def _parsed(line: str, count: int, path: Any, number: int) -> list[float]:
    words = line.split()
    if not words:
        return []
    if len(words) != count:
        raise DocumentError(f"the row has {len(words)} numbers and needs {count}", file=str(path), line=number)
    try:
        return [float(word) for word in words]
    except ValueError as error:
        raise DocumentError(f"the row has something that is no number: {error}", file=str(path), line=number) from None
