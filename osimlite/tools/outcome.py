"""What came out of a tool: tables and documents that are still to be written, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from osimlite.files import make_folder, written_atomically
from osimlite.records import dataclass, field, replace
from osimlite.simulation.files.old_storage import PRECISION, printed
from osimlite.simulation.files.storage import StoTable, adapter_lines
from osimlite.tools.evidence import Evidence


@dataclass(eq=False)
class Outcome:
    """What came out of a setup.

    Attributes:
        tables: by the names of their files.
        summary: numbers that say how it went.
        told: the same in words: a name, and what is said of it.
        files: those that were written.
        warnings: how many the check of the setup and of what it names gave.
        evidence: what a report shows besides.
        done: whether the tool did what it was asked for; what it found is written all the same.
    """

    tables: dict[str, StoTable] = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    told: list[tuple[str, str]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)
    warnings: int = 0
    evidence: Evidence | None = None
    done: bool = True
    _texts: dict[Path, Iterable[str]] = field(default_factory=dict)

    def table(self, path: Path, table: StoTable, description: str = "", precision: int = PRECISION) -> None:
        """Have a table written as OpenSim prints it.

        Args:
            path: of the file.
            table: what is printed.
            description: what the header says besides.
            precision: digits behind the point.
        """
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = printed(table, description, precision)

    def new_table(self, path: Path, table: StoTable) -> None:
        """Have a table written in the newer form of OpenSim's storage files, with its own header."""
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = adapter_lines(table)

    def text(self, path: Path, content: str) -> None:
        """Have a text written."""
        self._texts[path] = (content,)

    def tell(self, name: str, words: str) -> None:
        """Say something of what came out."""
        self.told.append((name, words))

    def write(self) -> None:
        """Write what is still to be written, each file whole or not at all.

        Raises:
            OsimliteError: a file cannot be written.
        """
        for path, lines in self._texts.items():
            make_folder(path.parent)
            with written_atomically(path) as stream:
                stream.writelines(line.encode() for line in lines)
            self.files.append(path)
        self._texts.clear()
