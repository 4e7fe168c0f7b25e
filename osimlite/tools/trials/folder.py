"""Files of a trial: setups, their inputs and their results, anywhere below some folders."""

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
from osimlite.io.document.cache import get_object, read_object
from osimlite.io.document.reader import read_any
from osimlite.io.document.source import Position, Source
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.lint.project_files import is_opensim_file
from osimlite.lint.table import Table
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.forces import Force, ForceSet
from osimlite.schema.model import Model
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.tools.job import NO_FILE, Job

T = TypeVar("T")
"""Type of a cached value."""
SETUPS = (
    "ScaleTool",
    "InverseKinematicsTool",
    "InverseDynamicsTool",
    "RRATool",
    "CMCTool",
    "AnalyzeTool",
)
"""Classes of setups whose results are checked, in the order in which a trial is processed."""
SUFFIXES = (".osim", ".xml", ".sto", ".mot", ".trc", ".c3d")
"""Suffixes of files that can belong to a trial."""
MOTIONS = ("coordinates_file", "desired_kinematics_file")
"""Properties of setups that name the motion."""
LOADS = "external_loads_file"
"""Property of setups that names the measured loads."""
CUTOFFS = ("lowpass_cutoff_frequency_for_coordinates", "lowpass_cutoff_frequency")
"""Properties of setups with the cutoff frequency of the motion's filter.

The first is of InverseDynamicsTool and AnalyzeTool, the second of RRATool and CMCTool.
"""


class MissingInput(OsimliteError):
    """Error for a missing file without which something cannot be checked."""


class TrialFolder:
    """Folders and setups of a trial.

    Args:
        paths: folders, which count with everything below, or setups, which count with their
            folders.
        written: results of these setups in other folders; they take precedence over files of the
            same name.

    Raises:
        MissingFileError: a path does not exist.
        OsimliteError: a file is not a setup.
    """

    def __init__(self, paths: Sequence[str | Path], written: Iterable[Path] = ()) -> None:
        self.tools: list[TrialTool] = []
        self.has_folder = any(map(os.path.isdir, paths))
        self._written = {file.name: file for file in written}
        self._cache: dict[Any, Any] = {}
        self._named: dict[str, list[Path]] = {}
        setups: dict[str, Path] = {}
        for path in map(Path, paths):
            if not path.exists():
                raise make_missing_error(path, may_be_folder=True)
            for file in sorted((path if path.is_dir() else path.parent).rglob("*")):
                if file.suffix.lower() in SUFFIXES and file.is_file():
                    # The given folders may overlap.
                    same_named = self._named.setdefault(file.name, [])
                    if file not in same_named:
                        same_named.append(file)
                    if (
                        path.is_dir()
                        and file.suffix.lower() == ".xml"
                        and is_opensim_file(str(file))
                    ):
                        setups.setdefault(os.path.realpath(file), file)
            if not path.is_dir():
                if type(read_any(path)).__name__ not in SETUPS:
                    raise OsimliteError(
                        f"this is not a setup of {', '.join(SETUPS[:-1])} or {SETUPS[-1]}",
                        file=str(path),
                    )
                setups.setdefault(os.path.realpath(path), path)
        # The real path is the key, so that links and overlapping folders do not count a setup
        # twice.
        for file in setups.values():
            setup_object = get_object(str(file))
            if setup_object is not None and type(setup_object).__name__ in SETUPS:
                self.tools.append(TrialTool(self, Job(setup_object, file)))
        # The order in which a trial is processed.
        self.tools.sort(key=lambda tool: SETUPS.index(tool.tag))

    def compute_once(self, key: Any, compute: Callable[[], T]) -> T:
        """Return a value; compute it at the first request.

        Args:
            key: key of the value.
            compute: function that computes it.
        """
        if key not in self._cache:
            self._cache[key] = compute()
        return self._cache[key]

    def find_file(self, path: Path) -> Path | None:
        """Return a path if the file exists, or else the nearest file of its name, or None."""
        # Results of this run are newer than files of the same name beside the setup.
        if path.name in self._written:
            return self._written[path.name]
        if path.is_file():
            return Path(os.path.normpath(path))

        def count_steps(file: Path) -> int:
            return os.path.relpath(file.parent, path.parent).count(os.sep)

        # Trials are often moved after their setups were written, so that paths in setups lead
        # elsewhere.
        return min(self._named.get(path.name, ()), key=count_steps, default=None)

    def find_files(self, *endings: str) -> Iterator[Path]:
        """Yield all files with some endings of their names."""
        for name, files in self._named.items():
            if name.endswith(endings):
                yield from files

    def read_model(self, file: Path) -> Model:
        """Return the model in a file; cached."""
        return self.compute_once(("model", file), lambda: read_object(file, Model))

    def build_mechanism(self, file: Path) -> Mechanism:
        """Return the mechanism of the model in a file; cached."""
        return self.compute_once(
            ("mechanism", file), lambda: build_mechanism(self.read_model(file))
        )

    def read_table(self, file: Path) -> StoTable:
        """Return the table in a file; cached."""
        return self.compute_once(("table", file), lambda: read_sto(file))

    def read_motion(self, file: Path, model: Path) -> RecordedMotion:
        """Return the motion in a file, without the rows that RRA writes twice; cached.

        Args:
            file: table of the motion.
            model: file of the model.
        """

        def build_motion() -> RecordedMotion:
            table = self.read_table(file)
            # A repeated time has no slope: splines and filters need increasing times.
            is_later = np.diff(np.maximum.accumulate(table.times), prepend=-np.inf) > 0.0
            increasing_table = replace(
                table, times=table.times[is_later], rows=table.rows[is_later]
            )
            return RecordedMotion.from_table(self.build_mechanism(model), increasing_table)

        return self.compute_once(("motion", file, model), build_motion)

    def read_loads(self, file: Path) -> tuple[ExternalLoads, StoTable]:
        """Return measured loads and their data; cached.

        Returns:
            Document of the loads, and table of their data.
        """

        def read_files() -> tuple[ExternalLoads, StoTable]:
            document = read_object(file, ExternalLoads)
            data = self.find_file(file.parent / document.datafile.strip())
            if data is None:
                raise MissingInput(f"'{document.datafile}' is missing, the data of '{file}'")
            return document, self.read_table(data)

        return self.compute_once(("loads", file), read_files)

    def locate_row(self, file: Path, row: int) -> Position:
        """Return the position of a row of a table in its file."""
        table = self.compute_once(
            ("text", file), lambda: Table(Source.from_file(file).data, str(file))
        )
        return table.locate_time(table.rows.line_of(row))

    def locate_time(self, file: Path, time: float) -> Position:
        """Return the position, in the file of a table, of the row that is nearest to a time."""
        return self.locate_row(file, int(np.argmin(np.abs(self.read_table(file).times - time))))


class TrialTool:
    """Setup of a trial, with its inputs and results.

    Args:
        folder: files of the trial.
        job: setup of the tool, with the paths of its files.
    """

    def __init__(self, folder: TrialFolder, job: Job) -> None:
        self.folder = folder
        self.job = job
        self.setup = job.setup
        self.tag = type(job.setup).__name__

    def __str__(self) -> str:
        return f"{self.tag.removesuffix('Tool')} '{self.job.file.name}'"

    def find_input(self, *tags: str) -> Path | None:
        """Return the path of the file that the first non-empty of some properties names.

        Args:
            tags: names of properties of the setup.

        Returns:
            Path of the file; None if all properties are empty.

        Raises:
            MissingInput: the file does not exist.
        """
        for tag in tags:
            name = str(getattr(self.setup, tag, "")).strip()
            if name not in NO_FILE:
                result = self.folder.find_file(self.job.resolve_name(name) or Path(name))
                if result is None:
                    raise MissingInput(f"'{name}' is missing, the {tag} of {self}")
                return result
        return None

    def require_input(self, *tags: str) -> Path:
        """Return the path of the file that one of some properties names.

        Raises:
            MissingInput: all properties are empty, or the file does not exist.
        """
        result = self.find_input(*tags)
        if result is None:
            raise MissingInput(f"{self} names no {tags[0]}")
        return result

    def find_result(self, name: str) -> Path | None:
        """Return the path of a result; None if it is missing."""
        return self.folder.find_file(self.job.get_results_path(name))

    @property
    def model_file(self) -> Path:
        """Path of the model file that the setup names."""
        return self.require_input("model_file")

    @property
    def model(self) -> Model:
        """Model that the setup names, from the cache."""
        return self.folder.read_model(self.model_file)

    @property
    def mechanism(self) -> Mechanism:
        """Mechanism of this model, from the cache."""
        return self.folder.build_mechanism(self.model_file)

    @property
    def motion(self) -> RecordedMotion:
        """Motion that the tool reads."""
        return self.folder.read_motion(self.require_input(*MOTIONS), self.model_file)

    @property
    def cutoff(self) -> float:
        """Cutoff frequency of the filter of that motion, Hz; negative for no filter."""
        return next(
            (float(getattr(self.setup, tag)) for tag in CUTOFFS if hasattr(self.setup, tag)), -1.0
        )

    @cached_property
    def span(self) -> tuple[float, float]:
        """First and last time of the results.

        Returns:
            Two times (s), which are infinite if the setup has none.
        """
        # Inverse kinematics and dynamics have a range, the other tools two single times.
        time_range = getattr(self.setup, "time_range", None)
        if time_range is not None and len(time_range) > 1:
            return float(time_range[0]), float(time_range[1])
        if hasattr(self.setup, "initial_time"):
            return float(self.setup.initial_time), float(self.setup.final_time)
        return float("-inf"), float("inf")

    @cached_property
    def forces(self) -> list[Force]:
        """Forces of the model, extended or replaced by those of the setup."""
        result = (
            []
            if getattr(self.setup, "replace_force_set", False)
            else list(self.model.components(Force))
        )
        for name in getattr(self.setup, "force_set_files", ()):
            file = (
                self.folder.find_file(self.job.resolve_name(name) or Path(name))
                if name.strip() not in NO_FILE
                else None
            )
            if file is not None:
                result += self.job.read_object(file, ForceSet).objects
        return result
