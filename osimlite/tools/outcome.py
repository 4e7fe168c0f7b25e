"""What came out of a tool: tables and documents that are still to be written, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.files import make_folder, written_atomically
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass, field
from osimlite.simulation.files.storage import StoTable

DEGREES = (
    "If the header above contains a line with 'inDegrees', this indicates whether rotational values are in degrees "
    "(yes) or radians (no).\n"
)
UNITS = f"Units are S.I. units (second, meters, Newtons, ...)\n{DEGREES}"
"""What OpenSim says of its tables in their headers."""
PRECISION = 8
"""Digits behind the point that OpenSim prints unless it is told otherwise."""
_PADDING = 8


def printed(table: StoTable, description: str = "", precision: int = PRECISION) -> Iterator[str]:
    """The lines of a table as OpenSim's ``Storage`` prints it.

    Args:
        table: the table.
        description: what stands before the end of the header; a line end is added.
        precision: digits behind the point.
    """
    yield f"{table.name}\nversion=1\nnRows={len(table.times)}\nnColumns={len(table.columns) + 1}\n"
    yield f"inDegrees={'yes' if table.in_degrees else 'no'}\n"
    if description:
        yield f"{description}\n"
    yield "endheader\n"
    yield "\t".join(("time", *table.columns)) + "\n"
    line = "\t".join([f"%{precision + _PADDING}.{precision}f"] * (len(table.columns) + 1)) + "\n"
    for row in np.column_stack([table.times, table.rows]).tolist():
        yield line % tuple(row)


@dataclass(eq=False)
class Outcome:
    """What came out of a setup.

    Attributes:
        tables: by the names of their files.
        summary: numbers that say how it went.
        told: the same in words: a name, and what is said of it.
        files: those that were written.
        done: whether the tool did what it was asked for; what it found is written all the same.
    """

    tables: dict[str, StoTable] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    told: list[tuple[str, str]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    done: bool = True
    _texts: dict[Path, tuple[str | StoTable, str, int]] = field(default_factory=dict)

    def table(
        self,
        path: Path,
        name: str,
        times: Array,
        columns: Sequence[str],
        rows: Array,
        *,
        in_degrees: bool = False,
        description: str = "",
        precision: int = PRECISION,
    ) -> None:
        """Have a table written as OpenSim prints it.

        Args:
            path: of the file.
            name: first line of the file.
            times: (t,), s.
            columns: labels (m,).
            rows: (t, m).
            in_degrees: whether rotational values are in degrees.
            description: what the header says besides.
            precision: digits behind the point.
        """
        table = StoTable(name, times, tuple(columns), rows, in_degrees, file=str(path))
        self.tables[path.name] = table
        self._texts[path] = table, description, precision

    def text(self, path: Path, content: str) -> None:
        """Have a text written."""
        self._texts[path] = content, "", 0

    def tell(self, name: str, words: str) -> None:
        """Say something of what came out."""
        self.told.append((name, words))

    def write(self) -> None:
        """Write what is still to be written, each file whole or not at all.

        Raises:
            OsimliteError: a file cannot be written.
        """
        for path, (content, description, precision) in self._texts.items():
            make_folder(path.parent)
            with written_atomically(path) as stream:
                lines = printed(content, description, precision) if isinstance(content, StoTable) else (content,)
                stream.writelines(line.encode() for line in lines)
            self.files.append(path)
        self._texts.clear()
