"""What came out of a tool: tables and documents that are still to be written, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.quantity import warn_caller
from osimlite.base.records import dataclass, field, replace
from osimlite.base.text import join_words
from osimlite.base.writing import ResultWriter
from osimlite.errors import DocumentError, SettingError, SimulationError
from osimlite.io.tables.old_storage import PRECISION, printed
from osimlite.io.tables.storage import StoTable, adapter_lines
from osimlite.lint.diagnostic import Finding
from osimlite.tools.evidence import Evidence
from osimlite.tools.named_files import inputs_among

MOST_DIGITS = 1074
"""Behind the point of a number, of which the last is no zero."""
DYNAMICS = "Inverse Dynamics Generalized Forces"
"""The name of the table that inverse dynamics gives."""


def _endless(what: str, time: float) -> SimulationError:
    return SimulationError(
        f"{what} at {time:g} s; look for a number in the data that is far too large"
    )


@dataclass(eq=False)
class Outcome:
    """What came out of a setup."""

    tables: dict[str, StoTable] = field(default_factory=dict)  # by the names of their files
    summary: dict[str, Any] = field(default_factory=dict)  # numbers that say how it went
    # the same in words: a name, and what is said of it
    told: list[tuple[str, str]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)  # those that were written
    # what the check of the setup and of what it names found beside errors; what has a suggestion
    # first
    warnings: list[Finding] = field(default_factory=list)
    evidence: Evidence | None = None  # what a report shows besides
    title: str = ""  # of a report of this alone, in the place of its folder's name
    # is told, line by line, how far a long search has come
    progress: Callable[[str], None] | None = None
    # whether the tool did what it was asked for; what it found is written all the same
    done: bool = True
    _texts: dict[Path, Iterable[str]] = field(default_factory=dict)

    def table(
        self, path: Path, table: StoTable, description: str = "", precision: int = PRECISION
    ) -> None:
        """Have a table written as OpenSim prints it.

        Args:
            path: of the file.
            table: what is printed.
            description: what the header says besides.
            precision: digits behind the point; OpenSim takes a negative number for none.

        Raises:
            SettingError: they are more than any number has.
        """
        if precision > MOST_DIGITS:
            raise SettingError(
                f"output_precision is {precision}; give the digits behind the point, {PRECISION} or 16"
            )
        if (missing := self._note_missing(path, table)) and "NaN" not in description:
            description = f"{description}\n{missing}" if description else f"\n{missing}\n"
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = printed(table, description, max(precision, 0))

    def new_table(self, path: Path, table: StoTable) -> None:
        """Have a table written in the newer form of OpenSim's storage files, with its own header."""
        if (missing := self._note_missing(path, table)) and "NaN" not in "".join(
            map(str, table.header.values())
        ):
            table = replace(table, header={**table.header, "missing": missing})
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = adapter_lines(table)

    def text(self, path: Path, content: str) -> None:
        """Have a text written."""
        self._texts[path] = (content,)

    def tell(self, name: str, words: str) -> None:
        """Say something of what came out."""
        self.told.append((name, words))

    def warn(self, name: str, words: str) -> None:
        """Say something of what came out that makes it doubtful, also on standard error."""
        self.tell(name, words)
        warn_caller(words)

    def _note_missing(self, path: Path, table: StoTable) -> str:
        """Return what a table says of the values that it lacks, and tell the user; "" if it lacks none.

        No file has NaN as if it were a result: muscles without an equilibrium and markers that were
        not seen leave it, and both the file and the summary name the columns.
        """
        missing = np.isnan(table.rows).any(axis=0) if table.rows.size else np.zeros(0, dtype=bool)
        if not missing.any():
            return ""
        names = join_words([f"'{table.columns[place]}'" for place in np.flatnonzero(missing)])
        if not any("NaN" in words for _, words in self.told):
            self.tell("not a number", f"{path.name} has NaN where there is no value: {names}")
        return f"NaN stands where there is no value: {names}"

    def _require_numbers(self) -> None:
        """Refuse motions that are no numbers, and infinite numbers. Unseen markers and some muscles have none."""
        motion = self.evidence
        if motion is not None and not np.isfinite(motion.values).all():
            row, place = np.argwhere(~np.isfinite(motion.values))[0]
            raise _endless(
                f"'{motion.coordinates[place]}' is {motion.values[row, place]}", motion.times[row]
            )
        for table in self.tables.values():
            odd = ~np.isfinite(table.rows) if table.name == DYNAMICS else np.isinf(table.rows)
            if odd.any():
                row, place = np.argwhere(odd)[0]
                raise _endless(
                    f"'{table.columns[place]}' is {table.rows[row, place]}", table.times[row]
                )

    def _require_inputs_kept(self, setup: Path) -> None:
        """Refuse to write over what the results come from. A model may take the place of the one it was made of."""
        kept = [
            path
            for path in self._texts
            if path.name in self.tables or path.suffix.lower() != ".osim"
        ]
        for path in inputs_among(kept, setup):
            message = f"a result would replace '{path}', which it is computed from; give it another name or place"
            raise DocumentError(message, file=str(setup))

    def write(self, setup: Path, writer: ResultWriter) -> None:
        """Write what is still to be written, all files whole or none of them.

        Args:
            setup: that all comes from.
            writer: decides which files may be written.

        Raises: OsimliteError: a file cannot be written or is one of the setup's own, or results are
            no numbers any more; then nothing is written.
        """
        self._require_numbers()
        self._require_inputs_kept(setup)
        with ExitStack() as all_or_none:
            # All names are checked before the first folder is made.
            for path in self._texts:
                writer.resolve(path)
            # They are put in their places in the end, the last first: of one place the last one
            # stays.
            for path, lines in reversed(self._texts.items()):
                all_or_none.enter_context(writer.written(path, lines))
        self.files += self._texts
        self._texts.clear()
