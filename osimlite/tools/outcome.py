"""Results of a tool: tables and documents to write, and messages about them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.deprecation import make_deprecated_property
from osimlite.base.progress import watch_items
from osimlite.base.quantity import warn_caller
from osimlite.base.records import dataclass, field, replace
from osimlite.base.result_writing import ResultWriter
from osimlite.base.text import format_count, join_words
from osimlite.errors import DocumentError, ResultWarning, SettingError, SimulationError
from osimlite.io.tables.old_storage import PRECISION, format_old_table
from osimlite.io.tables.storage import StoTable, format_adapter_table
from osimlite.lint.diagnostic import Finding
from osimlite.tools.evidence import Evidence
from osimlite.tools.named_files import find_inputs

MAX_PRECISION = 1074
"""Digits after the decimal point of the smallest number of double precision."""
MAX_LISTED = 6
"""Messages, and files, that the text of an outcome lists."""
DYNAMICS_TITLE = "Inverse Dynamics Generalized Forces"
"""Title of the table that inverse dynamics writes."""


def _create_number_error(subject: str, time: float) -> SimulationError:
    """Return the error for a result that is infinite or not a number."""
    return SimulationError(
        f"{subject} at {time:g} s; check the data for a number that is far too large"
    )


@dataclass(eq=False)
class Outcome:
    """Results of a setup: tables, files, messages and a summary."""

    tables: dict[str, StoTable] = field(default_factory=dict)  # tables by the names of their files
    summary: dict[str, Any] = field(default_factory=dict)  # numbers that describe the results
    # Messages about the results: subject and text of each.
    messages: list[tuple[str, str]] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)  # written files
    # Findings about the setup, and files that it names, that are not errors; those with a
    # suggestion first.
    warnings: list[Finding] = field(default_factory=list)
    evidence: Evidence | None = None  # motion for a report
    title: str = ""  # title of a report of this alone, instead of its folder
    # Function that receives lines about the progress of a long search.
    progress: Callable[[str], None] | None = None
    # Whether the tool succeeded; its results are written in either case.
    done: bool = True
    _texts: dict[Path, Iterable[str]] = field(default_factory=dict)

    told = make_deprecated_property("messages")

    def __repr__(self) -> str:
        status = "done" if self.done else "not done"
        counts = (
            f"{format_count(len(self.tables), 'table')}, {format_count(len(self.files), 'file')}"
        )
        lines = [f"Outcome: {status}, {counts}"]
        lines += [f"{name}: {message}" for name, message in self.messages[:MAX_LISTED]]
        lines += [str(path) for path in self.files[:MAX_LISTED]]
        if (omitted_count := len(self.files) - MAX_LISTED) > 0:
            lines.append(f"... and {format_count(omitted_count, 'more file')}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        from html import escape

        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(message)}</td></tr>"
            for name, message in [*self.messages, *(("file", str(path)) for path in self.files)]
        )
        status = "done" if self.done else "not done"
        return f"<div>Outcome: {status}</div><table>{rows}</table>"

    def add_table(
        self, path: Path, table: StoTable, description: str = "", precision: int = PRECISION
    ) -> None:
        """Add a table to write in the format of OpenSim's Storage.

        Args:
            path: file of the table.
            table: names, times and rows.
            description: text that the header contains as well.
            precision: digits after the decimal point; a negative number means none, as in OpenSim.

        Raises:
            SettingError: the precision is larger than any number needs.
        """
        if precision > MAX_PRECISION:
            raise SettingError(
                f"output_precision is {precision}; set the number of digits after the decimal "
                f"point, for example {PRECISION} or 16"
            )
        # Some analyses explain their missing numbers themselves.
        if (missing := self._note_missing(path, table)) and "NaN" not in description:
            description = f"{description}\n{missing}" if description else f"\n{missing}\n"
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = format_old_table(table, description, max(precision, 0))

    def add_typed_table(self, path: Path, table: StoTable) -> None:
        """Add a table to write in the format of OpenSim's TimeSeriesTable.

        Args:
            path: file of the table.
            table: names, times, rows and header.
        """
        if (missing := self._note_missing(path, table)) and "NaN" not in "".join(
            map(str, table.header.values())
        ):
            table = replace(table, header={**table.header, "missing": missing})
        self.tables[path.name] = replace(table, file=str(path))
        self._texts[path] = format_adapter_table(table)

    def add_text(self, path: Path, content: str) -> None:
        """Add a text to write."""
        self._texts[path] = (content,)

    def add_message(self, name: str, message: str) -> None:
        """Add a message about the results.

        Args:
            name: subject of the message, in one to three words.
            message: sentence for the user.
        """
        self.messages.append((name, message))

    def add_warning(self, name: str, message: str) -> None:
        """Add a message that makes the results doubtful, and issue it as a warning.

        Args:
            name: subject of the message, in one to three words.
            message: sentence for the user.
        """
        self.add_message(name, message)
        warn_caller(message, ResultWarning)

    def _note_missing(self, path: Path, table: StoTable) -> str:
        """Return a note about missing values of a table, and add a message; "" if none is missing.

        NaN stands for missing values, such as those of unseen markers and of muscles without
        equilibrium. The file and the summary both name the columns.
        """
        missing = np.isnan(table.rows).any(axis=0) if table.rows.size else np.zeros(0, dtype=bool)
        if not missing.any():
            return ""
        names = join_words([f"'{table.columns[index]}'" for index in np.flatnonzero(missing)])
        # One message suffices: all tables of a motion lack numbers for the same reason.
        if not any("NaN" in message for _, message in self.messages):
            self.add_message(
                "missing values", f"{path.name} has NaN where a value is missing, in {names}"
            )
        return f"NaN stands for missing values, in {names}"

    def _require_numbers(self) -> None:
        """Raise an error for a motion with NaN, or a table with infinite numbers.

        NaN is allowed in other tables, for unseen markers and for some muscles.

        Raises:
            SimulationError: a number is infinite, or is NaN where NaN is not allowed.
        """  # noqa: DOC501 - a function makes the error, which is named
        motion = self.evidence
        if motion is not None and not np.isfinite(motion.values).all():
            row, index = np.argwhere(~np.isfinite(motion.values))[0]
            raise _create_number_error(
                f"'{motion.coordinates[index]}' is {motion.values[row, index]}", motion.times[row]
            )
        for table in self.tables.values():
            is_invalid = (
                ~np.isfinite(table.rows) if table.name == DYNAMICS_TITLE else np.isinf(table.rows)
            )
            if is_invalid.any():
                row, index = np.argwhere(is_invalid)[0]
                raise _create_number_error(
                    f"'{table.columns[index]}' is {table.rows[row, index]}", table.times[row]
                )

    def _protect_inputs(self, setup: Path) -> None:
        """Raise an error if a result would replace an input; a model may replace its source.

        Raises:
            DocumentError: a result would replace an input of the setup.
        """
        protected_paths = [
            path
            for path in self._texts
            if path.name in self.tables or path.suffix.lower() != ".osim"
        ]
        for path in find_inputs(protected_paths, setup):
            message = f"a result would replace '{path}', an input of this setup; give the result another name or folder"
            raise DocumentError(message, file=str(setup))

    def write(self, setup: Path, writer: ResultWriter) -> None:
        """Write all results, or none of them.

        Args:
            setup: path of the setup.
            writer: writer of files, which refuses those that may not be written.

        Raises:
            OsimliteError: a file cannot be written or is an input of the setup, or results are not
                finite; then nothing is written.
        """
        self._require_numbers()
        self._protect_inputs(setup)
        with ExitStack() as all_or_none:
            # All names are checked before the first folder is created.
            for path in self._texts:
                writer.resolve(path)
            # Files are moved to their paths on exit from the stack, in reverse order. Of two results
            # with one path the later one is therefore moved last.
            texts = list(reversed(self._texts.items()))
            for path, lines in watch_items("writing results", texts, " files"):
                all_or_none.enter_context(writer.written(path, lines))
        self.files += self._texts
        self._texts.clear()
