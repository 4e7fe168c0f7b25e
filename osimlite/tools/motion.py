"""A motion under analysis: states of a model over time, and what is computed of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.errors import SettingError
from osimlite.kernels.layout import STAGE
from osimlite.multibody.smoothing_spline import derivatives_of_samples
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.files.storage import StoTable
from osimlite.simulation.link_motion import LinkMotion
from osimlite.simulation.probed import Moment
from osimlite.simulation.run import Simulation
from osimlite.simulation.system import System
from osimlite.tables import suffixes
from osimlite.text import counted, did_you_mean
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome

Record = tuple[Array, Array]
"""Times (r,) and generalized speeds (r, n)."""

LEAST_TIMES = 6
"""That splines of fifth degree go through."""


@dataclass(frozen=True, eq=False)
class Motion:
    """States of a model over time."""

    model: Model  # what moves
    simulation: Simulation  # that computes its forces and accelerations
    times: Array  # (t,), s
    states: Array  # (t, y), in the order of the simulation's engine
    steps: Sequence[Moment] = ()  # the start and the ends of all steps, if the motion was integrated
    record: Callable[[], Record] | None = None  # gives what was measured, of which the motion is a part

    @cached_property
    def _found(self) -> dict[str, Any]:
        return {}

    def once(self, name: str, find: Callable[[], Any]) -> Any:
        """What several analyses need, found by the first of them."""
        if name not in self._found:
            self._found[name] = find()
        return self._found[name]

    @property
    def mechanism(self) -> Any:
        """The mechanism of the model."""
        return self.simulation.mechanism

    @property
    def system(self) -> System:
        """What the kernels find of the forces at a state."""
        assert isinstance(self.simulation.engine, System)
        return self.simulation.engine

    @cached_property
    def table(self) -> Array:
        """Each time with its state (t, 1 + y)."""
        return np.column_stack([self.times, self.states])

    @property
    def moments(self) -> Iterator[tuple[float, list[float]]]:
        """Each time with its state."""
        return zip(self.times.tolist(), self.states.tolist(), strict=True)

    @cached_property
    def _histories(self) -> tuple[Array, Array]:
        return self.simulation.state.histories(self.states.tolist())

    @property
    def values(self) -> Array:
        """Of all coordinates in the mechanism's order (t, n), rad and m."""
        return self._histories[0]

    @property
    def speeds(self) -> Array:
        """Generalized speeds (t, n)."""
        return self._histories[1]

    @cached_property
    def histories(self) -> dict[str, Array]:
        """All states (t,) by their paths, in OpenSim's order."""
        columns = self.simulation.state.auxiliary_histories(self.states)
        for index, info in enumerate(self.mechanism.coordinates):
            columns[f"{info.path}/value"], columns[f"{info.path}/speed"] = self.values[:, index], self.speeds[:, index]
        return {path: columns[path] for path in self.simulation.paths}

    def looked(self, places: Sequence[int], stage: int = STAGE.FORCE) -> Array:
        """What the kernels find at every time (t, m); see :meth:`System.looked`."""
        return self.system.looked(self.table, places, stage)

    def known(self, paths: Sequence[str], *names: str) -> dict[str, Array]:
        """What is known of force elements of some paths at every time (t, m), by the names of their kinds."""
        places = [place for path in paths for place in self.system.places_of(path, names)]
        result = self.looked(places).reshape(len(self.times), len(paths), len(names))
        return {name: result[:, :, k] for k, name in enumerate(names)}

    @cached_property
    def accelerations(self) -> Array:
        """Derivatives of the speeds (t, n), by all that acts on the model."""
        order, result = list(self.simulation.state.order), np.zeros_like(self.values)
        first = self.system.room + len(order)
        result[:, order] = self.looked(range(first, first + len(order)), STAGE.ACCELERATION)
        return result

    @cached_property
    def wanted(self) -> Array:
        """Derivatives of the speeds (t, n) that were measured, by natural splines of fifth degree through all of them.

        Raises:
            SettingError: fewer than six times were measured.
        """
        assert self.record is not None
        times, speeds = self.record()
        if len(times) < LEAST_TIMES:
            message = f"the motion has {counted(len(times), 'time')}; accelerations need at least {LEAST_TIMES}"
            raise SettingError(message)
        (result,) = derivatives_of_samples(times, speeds, self.times, (1,), LEAST_TIMES // 2)
        return result

    @cached_property
    def links(self) -> LinkMotion:
        """Where the bodies are and how they move at every time."""
        system = System(self.mechanism.released(), Forces(()))
        moments = np.column_stack([self.times, system.state.rows(self.values, self.speeds)])
        return LinkMotion.of(system, moments, self.accelerations[:, list(system.order)])

    def frame(self, asked: str, kind: str, *places: str) -> str | None:
        """The path of a frame of a class that is found by its path from the model, or from other places there."""
        tree = self.model.tree()
        result = (tree.walk(asked, place, kind).target for place in ("", *places))
        return next((tree.path_of(item) for item in result if item is not None), None)

    def chosen(self, wanted: Sequence[Any], names: Sequence[str], what: str) -> list[int]:
        """Places of the names that an analysis asks for; "all" stands for all of them.

        Raises:
            SettingError: there is none of a name.
        """
        asked = [str(name) for name in wanted]
        if "all" in asked:
            return list(range(len(names)))
        for name in asked:
            if name not in names:
                raise SettingError(f"there is no '{name}' for {what}{did_you_mean(name, names)}")
        return [names.index(name) for name in asked]


@dataclass(frozen=True, eq=False)
class Tables:
    """Where the tables of an analysis go."""

    job: Job  # the setup
    outcome: Outcome  # that has them written
    name: str  # of the analysis
    times: Array  # of all rows (t,), s

    def add(
        self,
        suffix: str,
        title: str,
        columns: Sequence[str],
        rows: Array,
        *,
        in_degrees: bool = False,
        description: str = "",
        of: str = "",
    ) -> None:
        """Have a table written, with the precision of the setup.

        Args:
            suffix: end of the file's name.
            title: first line of the file.
            columns: labels (m,).
            rows: (t, m).
            in_degrees: whether rotational values are in degrees.
            description: what the header says besides.
            of: what stands before the suffix in the file's name, if not the analysis alone.
        """
        table = StoTable(title, self.times, tuple(columns), rows, in_degrees)
        self.outcome.table(self._path(f"{of}_{suffix}"), table, description, self.job.setup.output_precision)

    def add_newer(self, suffix: str, columns: Sequence[str], rows: Array, kind: str) -> None:
        """Have a table written in the newer form of OpenSim's storage files, which is not named after the analysis.

        Args:
            suffix: end of the file's name.
            columns: a label for each value.
            rows: (t, m), where a value of a kind may take several columns.
            kind: of the values.
        """
        labels = tuple(f"{column}{end}" for column in columns for end in suffixes(kind))
        path = self.job.in_results(f"{self.job.setup.name}_{suffix}")
        self.outcome.new_table(path, StoTable("", self.times, labels, rows, kind=kind))

    def add_text(self, suffix: str, content: str) -> None:
        """Have a text written, whose file's name ends so."""
        self.outcome.text(self._path(f"_{suffix}"), content)

    def _path(self, ending: str) -> Path:
        return self.job.in_results(f"{self.job.setup.name}_{self.name}{ending}")
