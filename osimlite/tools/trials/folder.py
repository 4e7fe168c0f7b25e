"""The files of a trial: setups, what they name, and what they wrote, wherever that is below the folders."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from osimlite.base.files import make_missing_error
from osimlite.base.records import replace
from osimlite.errors import OsimliteError
from osimlite.io.document.cache import read_object, top_at
from osimlite.io.document.reader import read_any
from osimlite.io.document.source import Position, Source
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.lint.project_files import begins_as_ours
from osimlite.lint.table import Table
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.forces import Force, ForceSet
from osimlite.schema.model import Model
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.job import NONE, Job

T = TypeVar("T")
SETUPS = (
    "ScaleTool", "InverseKinematicsTool", "InverseDynamicsTool", "RRATool", "CMCTool", "AnalyzeTool",
)  # fmt: skip
"""Classes of setups whose results are looked at."""
ENDINGS = (".osim", ".xml", ".sto", ".mot", ".trc", ".c3d")
MOTIONS = ("coordinates_file", "desired_kinematics_file")
LOADS, CUTOFFS = (
    "external_loads_file",
    ("lowpass_cutoff_frequency_for_coordinates", "lowpass_cutoff_frequency"),
)


class Missing(OsimliteError):
    """A file is not there that something would have been looked at in."""


class Folder:
    """Folders and setups that a trial consists of.

    Args: paths: folders, of which everything below counts, or setups, of which the folder counts.
        written: results of these setups, wherever they are; they count before others of their
        names.

    Raises:
        MissingFileError: a path is not there.
        OsimliteError: a file is no setup.
    """

    def __init__(self, paths: Sequence[str | Path], written: Iterable[Path] = ()) -> None:
        self.tools: list[Tool] = []
        self.is_whole = any(map(os.path.isdir, paths))
        self._written = {file.name: file for file in written}
        self._kept: dict[Any, Any] = {}
        self._named: dict[str, list[Path]] = {}
        setups: dict[str, Path] = {}
        for path in map(Path, paths):
            if not path.exists():
                raise make_missing_error(path, may_be_folder=True)
            for file in sorted((path if path.is_dir() else path.parent).rglob("*")):
                if file.suffix.lower() in ENDINGS and file.is_file():
                    known = self._named.setdefault(file.name, [])
                    if file not in known:
                        known.append(file)
                    if (
                        path.is_dir()
                        and file.suffix.lower() == ".xml"
                        and begins_as_ours(str(file))
                    ):
                        setups.setdefault(os.path.realpath(file), file)
            if not path.is_dir():
                if type(read_any(path)).__name__ not in SETUPS:
                    raise OsimliteError(
                        f"this is no setup of {', '.join(SETUPS[:-1])} or {SETUPS[-1]}",
                        file=str(path),
                    )
                setups.setdefault(os.path.realpath(path), path)
        for file in setups.values():
            top = top_at(str(file))
            if top is not None and type(top).__name__ in SETUPS:
                self.tools.append(Tool(self, Job(top, file)))
        # In the order in which a trial is worked on.
        self.tools.sort(key=lambda tool: SETUPS.index(tool.tag))

    def once(self, key: Any, make: Callable[[], T]) -> T:
        """What is needed several times, made once."""
        if key not in self._kept:
            self._kept[key] = make()
        return self._kept[key]

    def near(self, path: Path) -> Path | None:
        """A file, or else one of its name that is nearest to its place; None if there is none."""
        if path.name in self._written:
            return self._written[path.name]
        if path.is_file():
            return Path(os.path.normpath(path))

        def away(file: Path) -> int:
            return os.path.relpath(file.parent, path.parent).count(os.sep)

        return min(self._named.get(path.name, ()), key=away, default=None)

    def ending(self, *endings: str) -> Iterator[Path]:
        """Every file whose name ends so."""
        for name, files in self._named.items():
            if name.endswith(endings):
                yield from files

    def model(self, file: Path) -> Model:
        """The model in a file."""
        return self.once(("model", file), lambda: read_object(file, Model))

    def mechanism(self, file: Path) -> Mechanism:
        """That of the model in a file."""
        return self.once(("mechanism", file), lambda: build_mechanism(self.model(file)))

    def table(self, file: Path) -> StoTable:
        """The table in a file."""
        return self.once(("table", file), lambda: read_sto(file))

    def motion(self, file: Path, model: Path) -> RecordedMotion:
        """The motion in a file, of the model in another, without the rows that RRA writes twice."""

        def read() -> RecordedMotion:
            table = self.table(file)
            is_later = np.diff(np.maximum.accumulate(table.times), prepend=-np.inf) > 0.0
            kept = replace(table, times=table.times[is_later], rows=table.rows[is_later])
            return RecordedMotion.of_table(self.mechanism(model), kept)

        return self.once(("motion", file, model), read)

    def loads(self, file: Path) -> tuple[ExternalLoads, StoTable]:
        """Measured loads, and their data."""

        def read() -> tuple[ExternalLoads, StoTable]:
            document = read_object(file, ExternalLoads)
            data = self.near(file.parent / document.datafile.strip())
            if data is None:
                raise Missing(f"'{document.datafile}' is missing, the data of '{file}'")
            return document, self.table(data)

        return self.once(("loads", file), read)

    def place(self, file: Path, row: int) -> Position:
        """Where a row of a table is in its file."""
        table = self.once(("text", file), lambda: Table(Source.of_file(file).data, str(file)))
        return table.time_at(table.rows.line_of(row))

    def at(self, file: Path, time: float) -> Position:
        """Where the row nearest to a time is in its file."""
        return self.place(file, int(np.argmin(np.abs(self.table(file).times - time))))


class Tool:
    """A setup, its inputs, and the results that are there.

    Args:
        folder: that it belongs to.
        job: the setup.
    """

    def __init__(self, folder: Folder, job: Job) -> None:
        self.folder, self.job, self.setup = folder, job, job.setup
        self.tag = type(job.setup).__name__

    def __str__(self) -> str:
        return f"{self.tag.removesuffix('Tool')} '{self.job.file.name}'"

    def input(self, *tags: str) -> Path | None:
        """The file that the first of some properties names that names one; None if none does.

        Raises:
            Missing: it is not there.
        """
        for tag in tags:
            name = str(getattr(self.setup, tag, "")).strip()
            if name not in NONE:
                result = self.folder.near(self.job.place(name) or Path(name))
                if result is None:
                    raise Missing(f"'{name}' is missing, the {tag} of {self}")
                return result
        return None

    def needed(self, *tags: str) -> Path:
        """As :meth:`input`, of what must be named."""
        result = self.input(*tags)
        if result is None:
            raise Missing(f"{self} names no {tags[0]}")
        return result

    def result(self, name: str) -> Path | None:
        """A file in the folder of results; None if it is not there."""
        return self.folder.near(self.job.in_results(name))

    @property
    def model_file(self) -> Path:
        """The file of the model."""
        return self.needed("model_file")

    @property
    def model(self) -> Model:
        """The model."""
        return self.folder.model(self.model_file)

    @property
    def mechanism(self) -> Mechanism:
        """That of the model."""
        return self.folder.mechanism(self.model_file)

    @property
    def motion(self) -> RecordedMotion:
        """The motion that the tool is given."""
        return self.folder.motion(self.needed(*MOTIONS), self.model_file)

    @property
    def cutoff(self) -> float:
        """Of the filter of that motion, Hz; negative for none."""
        return next(
            (float(getattr(self.setup, tag)) for tag in CUTOFFS if hasattr(self.setup, tag)), -1.0
        )

    @cached_property
    def span(self) -> tuple[float, float]:
        """The first and the last time, s, that the tool computes."""
        given = getattr(self.setup, "time_range", None)
        if given is not None and len(given) > 1:
            return float(given[0]), float(given[1])
        if hasattr(self.setup, "initial_time"):
            return float(self.setup.initial_time), float(self.setup.final_time)
        return float("-inf"), float("inf")

    @cached_property
    def forces(self) -> list[Force]:
        """The forces of the model, and those that the setup adds to them or puts in their place."""
        result = (
            []
            if getattr(self.setup, "replace_force_set", False)
            else list(self.model.components(Force))
        )
        for name in getattr(self.setup, "force_set_files", ()):
            file = (
                self.folder.near(self.job.place(name) or Path(name))
                if name.strip() not in NONE
                else None
            )
            if file is not None:
                result += self.job.read(file, ForceSet).objects
        return result
