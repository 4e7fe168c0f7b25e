"""Motion of a model over time, and quantities that analyses compute from it."""

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
from osimlite.io.tables.headers import list_suffixes
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

SpeedRecord = tuple[Array, Array]
"""Times (r,) in s and generalized speeds (r, n) of a measured motion."""

BoolArray = NDArray[np.bool_]
"""Array of truth values."""

PATH_RECORDS = {"length": "length", "rate": "rate", "speed": "rate"}
"""Records of a muscle that depend on its path alone, with the quantity of the path."""
MIN_TIMES = 6
"""Number of samples that a spline of degree five needs."""


@dataclass(frozen=True, eq=False)
class Motion:
    """States of a model over time."""

    model: Model  # model that moves
    simulation: Simulation  # simulation that computes forces and accelerations
    times: Array  # times (t,), s
    states: Array  # states (t, y), in the order of the simulation's engine
    # Start and ends of all steps, if the motion was integrated.
    steps: Sequence[Moment] = ()
    # Function that returns the complete measured motion; this motion is a part of it.
    record: Callable[[], SpeedRecord] | None = None
    # Masks of the times (t,) at which a muscle has no equilibrium and its states are NaN, by path
    # of the muscle.
    unbalanced: Mapping[str, BoolArray] = field(default_factory=dict)
    # Function that simulates another version of the model; required if muscles are unbalanced.
    simulate: Callable[[Model], Simulation] | None = None
    left_out: frozenset[str] = frozenset()  # paths of muscles that are off

    @cached_property
    def _cache(self) -> dict[str, Any]:
        """Values of :meth:`compute_once` by their names."""
        return {}

    def compute_once(self, name: str, find: Callable[[], Any]) -> Any:
        """Return a value that several analyses need; compute it at the first request.

        Args:
            name: key of the value.
            find: function that computes it.
        """
        if name not in self._cache:
            self._cache[name] = find()
        return self._cache[name]

    @property
    def mechanism(self) -> Any:
        """Mechanism of the model, as the simulation uses it."""
        return self.simulation.mechanism

    @property
    def system(self) -> System:
        """Engine of the simulation, which evaluates the kernels at a state."""
        assert isinstance(self.simulation.engine, System)
        return self.simulation.engine

    @cached_property
    def table(self) -> Array:
        """Times and states as one array (t, 1 + y)."""
        return np.column_stack([self.times, self.states])

    def select_times(self, rows: BoolArray) -> Motion:
        """Return the motion at some of its times.

        Args:
            rows: whether to include each time (t,).
        """
        unbalanced = {
            path: missing[rows] for path, missing in self.unbalanced.items() if missing[rows].any()
        }
        return replace(
            self, times=self.times[rows], states=self.states[rows], unbalanced=unbalanced
        )

    @cached_property
    def balanced(self) -> BoolArray:
        """Mask of the times (t,) at which every muscle that needs an equilibrium has one."""
        return ~np.any([np.zeros(len(self.times), dtype=bool), *self.unbalanced.values()], axis=0)

    @cached_property
    def parts(self) -> list[tuple[BoolArray, Motion]]:
        """Parts of the motion in which the same muscles lack an equilibrium.

        Each part is a mask of its times (t,) and the motion at these times, with these muscles off.
        """
        if not self.unbalanced:
            return [(np.ones(len(self.times), dtype=bool), self)]
        names = [*self.unbalanced]
        missing = np.column_stack([*self.unbalanced.values()])
        result = []
        # Times with the same unbalanced muscles share one model.
        for pattern in np.unique(missing, axis=0):
            rows = (missing == pattern).all(axis=1)
            part_motion = self.select_times(rows)
            if pattern.any():
                part_motion = self._switch_off_muscles(
                    part_motion, frozenset(np.array(names)[pattern].tolist())
                )
            result.append((rows, part_motion))
        return result

    def _switch_off_muscles(self, part_motion: Motion, muscles: frozenset[str]) -> Motion:
        """Return a part of the motion with a model in which some muscles are switched off.

        Args:
            part_motion: motion at some of the times.
            muscles: paths of the muscles.
        """
        assert self.simulate is not None
        model = self.model.copy_deep()
        tree = model.tree()
        for path in muscles:
            tree.find(path).appliesForce = False
        # States of muscles that are off have no effect, but must be finite.
        states = np.nan_to_num(part_motion.states)
        simulation = self.simulate(model)
        return replace(
            part_motion,
            model=model,
            simulation=simulation,
            states=states,
            unbalanced={},
            left_out=muscles,
        )

    def compute_balanced(self, compute: Callable[[Motion], Array]) -> Array:
        """Compute rows that depend on the forces of all muscles.

        Args:
            compute: function that returns the rows of a motion.

        Returns:
            Rows (t, ...); NaN at times at which a muscle lacks an equilibrium.
        """
        if not self.unbalanced:
            return compute(self)
        balanced_rows = compute(self.select_times(self.balanced))
        result = np.full((len(self.times), *balanced_rows.shape[1:]), np.nan)
        result[self.balanced] = balanced_rows
        return result

    def compute_by_parts(self, compute: Callable[[Motion], Array]) -> Array:
        """Compute rows that do not depend on the forces of muscles without equilibrium.

        Args:
            compute: function that returns the rows of a motion, whose `left_out` names the muscles
                that are off.

        Returns:
            Rows (t, ...).
        """
        rows = [(selected, compute(part_motion)) for selected, part_motion in self.parts]
        result = np.full((len(self.times), *rows[0][1].shape[1:]), np.nan)
        for selected, part_motion in rows:
            result[selected] = part_motion
        return result

    @property
    def moments(self) -> Iterator[tuple[float, list[float]]]:
        """Pairs of a time in s and its state (y,)."""
        return zip(self.times.tolist(), self.states.tolist(), strict=True)

    @cached_property
    def _histories(self) -> tuple[Array, Array]:
        """Values and speeds of all coordinates, each (t, n)."""
        return self.simulation.state.extract_histories(self.states.tolist())

    @property
    def values(self) -> Array:
        """Values of all coordinates (t, n) in the order of the mechanism, rad and m."""
        return self._histories[0]

    @property
    def speeds(self) -> Array:
        """Generalized speeds (t, n) in the order of the mechanism, rad/s and m/s."""
        return self._histories[1]

    @cached_property
    def histories(self) -> dict[str, Array]:
        """Histories of all states, in OpenSim's order.

        Returns:
            Column (t,) by the path of the state.
        """
        columns = self.simulation.state.extract_auxiliary(self.states)
        for index, info in enumerate(self.mechanism.coordinates):
            columns[f"{info.path}/value"], columns[f"{info.path}/speed"] = (
                self.values[:, index],
                self.speeds[:, index],
            )
        return {path: columns[path] for path in self.simulation.paths}

    def evaluate_kernels(self, offsets: Sequence[int], stage: int = STAGE.FORCE) -> Array:
        """Evaluate entries of the work vector of the kernels at every time; see `System.looked`.

        Args:
            offsets: offsets of m entries in the work vector.
            stage: stage up to which to realize each state.

        Returns:
            Entries (t, m); NaN at times at which a muscle lacks an equilibrium.
        """
        return self.compute_balanced(
            lambda motion: motion.system.evaluate_moments(motion.table, offsets, stage)
        )

    def read_records(self, paths: Sequence[str], *names: str) -> dict[str, Array]:
        """Return quantities that force elements record, at every time.

        Args:
            paths: paths of m force elements.
            names: names of the quantities, for example ``"tension"``.

        Returns:
            Values (t, m) by name. For a muscle without equilibrium only quantities of its path are
            known; the others are NaN.
        """
        result = self.compute_by_parts(lambda motion: motion._collect_records(paths, names))
        if self.unbalanced:
            self._add_path_records(result, paths, names)
        return {name: result[:, :, k] for k, name in enumerate(names)}

    def _collect_records(self, paths: Sequence[str], names: Sequence[str]) -> Array:
        """Return records of force elements; NaN for muscles that are switched off.

        Args:
            paths: paths of p force elements.
            names: names of m quantities.

        Returns:
            Records (t, p, m).
        """
        result = np.full((len(self.times), len(paths), len(names)), np.nan)
        indices = [k for k, path in enumerate(paths) if path not in self.left_out]
        offsets = [offset for k in indices for offset in self.system.find_offsets(paths[k], names)]
        result[:, indices] = self.evaluate_kernels(offsets).reshape(
            len(self.times), len(indices), len(names)
        )
        return result

    def _add_path_records(self, result: Array, paths: Sequence[str], names: Sequence[str]) -> None:
        """Fill in path lengths and lengthening speeds of muscles without equilibrium.

        Args:
            result: records (t, p, m), changed in place.
            paths: paths of p force elements.
            names: names of m quantities.
        """
        requested = [quantity for quantity, name in enumerate(names) if name in PATH_RECORDS]
        selected = [quantity for quantity, path in enumerate(paths) if path in self.unbalanced]
        if not (requested and selected):
            return
        # Path lengths do not depend on the state of the muscle.
        model_paths = Paths(self.model)
        for row in np.flatnonzero(~self.balanced):
            lengths = model_paths.lengths(self.values[row])
            speeds = model_paths.speeds(self.values[row], self.speeds[row])
            for muscle in selected:
                if self.unbalanced[paths[muscle]][row]:
                    for quantity in requested:
                        source = lengths if PATH_RECORDS[names[quantity]] == "length" else speeds
                        result[row, muscle, quantity] = source[paths[muscle]]

    @cached_property
    def accelerations(self) -> Array:
        """Derivatives of the speeds (t, n) under all forces; NaN without an equilibrium."""
        order = list(self.simulation.state.order)
        result = np.zeros_like(self.values)
        # The derivative of the state follows the work vector: rates of coordinates, then of speeds.
        first_offset = self.system.work_size + len(order)
        result[:, order] = self.evaluate_kernels(
            range(first_offset, first_offset + len(order)), STAGE.ACCELERATION
        )
        return result

    @cached_property
    def measured_accelerations(self) -> Array:
        """Derivatives of the measured speeds (t, n), from natural splines of degree five.

        Raises:
            SettingError: the motion has fewer than six samples.
        """
        assert self.record is not None
        times, speeds = self.record()
        if len(times) < MIN_TIMES:
            message = f"the motion has {format_count(len(times), 'time')}; accelerations need at least {MIN_TIMES}"
            raise SettingError(message)
        (result,) = derivatives_of_samples(times, speeds, self.times, (1,), MIN_TIMES // 2)
        return result

    @cached_property
    def links(self) -> LinkMotion:
        """Positions, velocities and accelerations of the bodies at every time."""
        # Positions and velocities need neither constraints nor forces; accelerations are given.
        system = System(self.mechanism.without_constraints(), Forces(()))
        moments = np.column_stack([self.times, system.state.pack_rows(self.values, self.speeds)])
        return LinkMotion.compute(system, moments, self.accelerations[:, list(system.order)])

    def find_frame_path(self, requested: str, class_name: str, *parents: str) -> str | None:
        """Return the path of a frame that a name or relative path denotes, or None.

        Args:
            requested: name or path as in a setup.
            class_name: class of the frame.
            parents: paths of components below which to search after the model itself.
        """
        tree = self.model.tree()
        candidates = (tree.walk(requested, parent, class_name).target for parent in ("", *parents))
        return next(
            (tree.path_of(component) for component in candidates if component is not None), None
        )

    def find_indices(self, requested: Sequence[Any], names: Sequence[str], what: str) -> list[int]:
        """Return the indices of the names that an analysis requests; "all" requests all of them.

        Args:
            requested: requested names.
            names: names from which the analysis requests some.
            what: description of the names, for the message.

        Raises:
            SettingError: a requested name is unknown.
        """
        requested_names = [str(name) for name in requested]
        # In OpenSim "all" counts wherever it stands in the list.
        if "all" in requested_names:
            return list(range(len(names)))
        for name in requested_names:
            if name not in names:
                raise SettingError(f"unknown name '{name}' for {what}{suggest_name(name, names)}")
        return [names.index(name) for name in requested_names]


@dataclass(frozen=True, eq=False)
class AnalysisTables:
    """Writer of the tables of one analysis."""

    job: Job  # setup of the tool
    outcome: Outcome  # outcome to which the tables are added
    name: str  # name of the analysis
    times: Array  # times of all rows (t,), s
    note: str = ""  # note in the header about missing numbers

    def add_table(
        self,
        suffix: str,
        title: str,
        columns: Sequence[str],
        rows: Array,
        *,
        in_degrees: bool = False,
        description: str = "",
        name_part: str = "",
    ) -> None:
        """Add a table in the format of OpenSim's Storage, with the precision of the setup.

        Args:
            suffix: end of the file's name.
            title: first line of the file.
            columns: labels of m columns.
            rows: values (t, m).
            in_degrees: whether rotational values are in degrees.
            description: text that the header contains as well.
            name_part: part of the file's name before the suffix, besides the name of the analysis.
        """
        # Tables without missing numbers need no note about them.
        if self.note and np.isnan(rows).any():
            description = f"\n{self.note}{description}"
        table = StoTable(title, self.times, tuple(columns), rows, in_degrees)
        self.outcome.add_table(
            self._create_path(f"{name_part}_{suffix}"),
            table,
            description,
            self.job.setup.output_precision,
        )

    def add_typed_table(
        self, suffix: str, columns: Sequence[str], rows: Array, value_type: str
    ) -> None:
        """Add a table in the format of OpenSim's TimeSeriesTable, named after the tool alone.

        Args:
            suffix: end of the file's name.
            columns: labels of the values, one for each.
            rows: values (t, m); a value may take several columns.
            value_type: type of the values, for example ``"Vec3"``.
        """
        labels = tuple(f"{column}{end}" for column in columns for end in list_suffixes(value_type))
        path = self.job.get_results_path(f"{self.job.setup.name}_{suffix}")
        self.outcome.add_typed_table(path, StoTable("", self.times, labels, rows, kind=value_type))

    def add_text(self, suffix: str, content: str) -> None:
        """Add a text in a file of the analysis.

        Args:
            suffix: end of the file's name.
            content: content of the file.
        """
        self.outcome.add_text(self._create_path(f"_{suffix}"), content)

    def _create_path(self, ending: str) -> Path:
        """Return the path of a file of the analysis."""
        return self.job.get_results_path(f"{self.job.setup.name}_{self.name}{ending}")
