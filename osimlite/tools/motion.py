"""A motion under analysis: states of a model over time, and what is computed of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass, field, replace
from osimlite.base.text import format_count, suggest_name
from osimlite.errors import SettingError
from osimlite.io.tables.headers import suffixes
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.link_motion import LinkMotion
from osimlite.simulation.paths import Paths
from osimlite.simulation.run import Simulation
from osimlite.simulation.run_report import Moment
from osimlite.simulation.system import System
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome

Record = tuple[Array, Array]
"""Times (r,) and generalized speeds (r, n)."""

BoolArray = NDArray[np.bool_]

PATH_RECORDS = {"length": "length", "rate": "rate", "speed": "rate"}
"""Records of a muscle that follow from its path alone, whatever its fibers do."""
LEAST_TIMES = 6
"""That splines of fifth degree go through."""


@dataclass(frozen=True, eq=False)
class Motion:
    """States of a model over time."""

    model: Model  # what moves
    simulation: Simulation  # that computes its forces and accelerations
    times: Array  # (t,), s
    states: Array  # (t, y), in the order of the simulation's engine
    # the start and the ends of all steps, if the motion was integrated
    steps: Sequence[Moment] = ()
    record: Callable[[], Record] | None = (
        None  # gives what was measured, of which the motion is a part
    )
    # By path of each muscle without an equilibrium at some times: whether it has none (t,). Its
    # states are NaN then.
    unbalanced: Mapping[str, BoolArray] = field(default_factory=dict)
    # Makes the simulation of another version of the model; needed if some muscles are unbalanced.
    simulate: Callable[[Model], Simulation] | None = None
    left_out: frozenset[str] = frozenset()  # paths of muscles of the model that were switched off

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

    def select(self, rows: BoolArray) -> Motion:
        """Return the motion at some of its times.

        Args:
            rows: whether each time is among them (t,).
        """
        unbalanced = {
            path: missing[rows] for path, missing in self.unbalanced.items() if missing[rows].any()
        }
        return replace(
            self, times=self.times[rows], states=self.states[rows], unbalanced=unbalanced
        )

    @cached_property
    def balanced(self) -> BoolArray:
        """Return for each time (t,) whether every muscle that needs an equilibrium has one."""
        return ~np.any([np.zeros(len(self.times), dtype=bool), *self.unbalanced.values()], axis=0)

    @cached_property
    def parts(self) -> list[tuple[BoolArray, Motion]]:
        """Times (t,) at which the same muscles lack an equilibrium, and the motion then, without these muscles."""
        if not self.unbalanced:
            return [(np.ones(len(self.times), dtype=bool), self)]
        names, missing = [*self.unbalanced], np.column_stack([*self.unbalanced.values()])
        result = []
        for pattern in np.unique(missing, axis=0):
            rows = (missing == pattern).all(axis=1)
            part = self.select(rows)
            if pattern.any():
                part = self._switch_off_muscles(part, frozenset(np.array(names)[pattern].tolist()))
            result.append((rows, part))
        return result

    def _switch_off_muscles(self, part: Motion, muscles: frozenset[str]) -> Motion:
        """Return a part of the motion with a model in which some muscles are switched off."""
        assert self.simulate is not None
        model = self.model.copy_deep()
        tree = model.tree()
        for path in muscles:
            tree.at(path).appliesForce = False
        # The states of what is off count for nothing, but must be numbers.
        states = np.nan_to_num(part.states)
        simulation = self.simulate(model)
        return replace(
            part, model=model, simulation=simulation, states=states, unbalanced={}, left_out=muscles
        )

    def compute_balanced(self, compute: Callable[[Motion], Array]) -> Array:
        """Return rows (t, ...) of what needs the forces of all muscles; NaN where one lacks an equilibrium.

        Args:
            compute: gives the rows of a motion.
        """
        if not self.unbalanced:
            return compute(self)
        part = compute(self.select(self.balanced))
        result = np.full((len(self.times), *part.shape[1:]), np.nan)
        result[self.balanced] = part
        return result

    def compute_by_parts(self, compute: Callable[[Motion], Array]) -> Array:
        """Return rows (t, ...) of what does not need the forces of muscles without equilibrium.

        Args:
            compute: gives the rows of a motion; `left_out` of that names muscles that are off.
        """
        rows = [(chosen, compute(part)) for chosen, part in self.parts]
        result = np.full((len(self.times), *rows[0][1].shape[1:]), np.nan)
        for chosen, part in rows:
            result[chosen] = part
        return result

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
            columns[f"{info.path}/value"], columns[f"{info.path}/speed"] = (
                self.values[:, index],
                self.speeds[:, index],
            )
        return {path: columns[path] for path in self.simulation.paths}

    def looked(self, places: Sequence[int], stage: int = STAGE.FORCE) -> Array:
        """What the kernels find at every time (t, m), NaN where a muscle lacks an equilibrium; see `System.looked`."""
        return self.compute_balanced(
            lambda motion: motion.system.looked(motion.table, places, stage)
        )

    def known(self, paths: Sequence[str], *names: str) -> dict[str, Array]:
        """What is known of force elements of some paths at every time (t, m), by the names of their kinds.

        At times when a muscle lacks an equilibrium only what follows from its path is known of it.
        """
        result = self.compute_by_parts(lambda motion: motion._records(paths, names))
        if self.unbalanced:
            self._add_path_records(result, paths, names)
        return {name: result[:, :, k] for k, name in enumerate(names)}

    def _records(self, paths: Sequence[str], names: Sequence[str]) -> Array:
        """Records (t, p, m) of force elements; NaN of those that are left out."""
        result = np.full((len(self.times), len(paths), len(names)), np.nan)
        there = [k for k, path in enumerate(paths) if path not in self.left_out]
        places = [place for k in there for place in self.system.places_of(paths[k], names)]
        result[:, there] = self.looked(places).reshape(len(self.times), len(there), len(names))
        return result

    def _add_path_records(self, result: Array, paths: Sequence[str], names: Sequence[str]) -> None:
        """Fill in lengths and speeds of the paths of muscles without equilibrium."""
        wanted = [k for k, name in enumerate(names) if name in PATH_RECORDS]
        chosen = [k for k, path in enumerate(paths) if path in self.unbalanced]
        if not (wanted and chosen):
            return
        measured = Paths(self.model)
        for row in np.flatnonzero(~self.balanced):
            lengths = measured.lengths(self.values[row])
            speeds = measured.speeds(self.values[row], self.speeds[row])
            for muscle in chosen:
                if self.unbalanced[paths[muscle]][row]:
                    for k in wanted:
                        source = lengths if PATH_RECORDS[names[k]] == "length" else speeds
                        result[row, muscle, k] = source[paths[muscle]]

    @cached_property
    def accelerations(self) -> Array:
        """Derivatives of the speeds (t, n), by all that acts on the model; NaN where a muscle lacks an equilibrium."""
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
            message = f"the motion has {format_count(len(times), 'time')}; accelerations need at least {LEAST_TIMES}"
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
                raise SettingError(f"there is no '{name}' for {what}{suggest_name(name, names)}")
        return [names.index(name) for name in asked]


@dataclass(frozen=True, eq=False)
class Tables:
    """Where the tables of an analysis go."""

    job: Job  # the setup
    outcome: Outcome  # that has them written
    name: str  # of the analysis
    times: Array  # of all rows (t,), s
    note: str = ""  # what the header says of rows that are no numbers

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
        if self.note and np.isnan(rows).any():
            description = f"\n{self.note}{description}"
        table = StoTable(title, self.times, tuple(columns), rows, in_degrees)
        self.outcome.table(
            self._path(f"{of}_{suffix}"), table, description, self.job.setup.output_precision
        )

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
