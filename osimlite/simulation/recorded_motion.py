"""Recorded motions: coordinates from files or arrays, kinematics of bodies and markers, and inverse dynamics.

The quantities, their names and their order are those of OpenSim's BodyKinematics analysis and
InverseDynamicsTool.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.deprecation import make_deprecated_method
from osimlite.base.progress import watch_items
from osimlite.base.records import dataclass, replace
from osimlite.base.text import format_count, join_words, suggest_name
from osimlite.errors import DocumentError, ModelError, SettingError
from osimlite.io.tables.storage import StoTable, expect_increasing_times, expect_numbers, read_sto
from osimlite.mechanics.multibody.dynamics import MassCentres
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array, angles_xyz
from osimlite.schema.forces import Force
from osimlite.schema.model import Model
from osimlite.schema.tree import is_a
from osimlite.simulation.elements import Forces
from osimlite.simulation.initial_state import match_state_columns
from osimlite.simulation.lowpass import filter_lowpass
from osimlite.simulation.system import System
from osimlite.simulation.trajectory import Movement

if TYPE_CHECKING:
    from osimlite.simulation.trajectory import Trajectory

MAX_COORDINATE = 1e25
"""Largest accepted coordinate (rad or m); larger numbers overflow in later computations."""
SAME_VALUE_TOLERANCE = 1e-6
"""Values (rad or m) at one time that differ by less are the same."""
_HALF_SPLINE_ORDER = 3
"""Half of the order of OpenSim's splines of fifth degree, with which coordinates are differentiated."""

FORCE_KEYWORDS = {"all": "Force", "actuators": "Actuator", "muscles": "Muscle"}
"""Words (in any case) that stand for all forces of a class in a list of forces, with the class."""


def exclude_forces(model: Model, names: Iterable[str]) -> None:
    """Switch forces of a model off, as OpenSim's tools do with `forces_to_exclude`.

    Args:
        model: the model, which is changed.
        names: names of forces or of groups, or keywords; see :func:`find_excluded_forces`.

    Raises:
        SettingError: there is no such force or group.
    """
    for force in find_excluded_forces(model, names):
        force.appliesForce = False


def find_excluded_forces(model: Model, names: Iterable[str]) -> list[Force]:
    """Return the forces that OpenSim's tools switch off for `forces_to_exclude`.

    Args:
        model: model with the forces.
        names: names of forces or of groups, or "All", "Actuators" or "Muscles".

    Returns:
        The forces in the order of the names; a force that several names select occurs several
        times.

    Raises:
        SettingError: there is no such force or group.
    """
    forces = {force.name: force for force in model.components(Force)}
    groups = {group.name: group.members for group in model.force_set.groups}
    result: list[Force] = []
    for name in names:
        force_class = FORCE_KEYWORDS.get(name.lower())
        members = (
            [force for force in forces.values() if is_a(force, force_class)] if force_class else []
        )
        if not force_class:
            if name not in groups and name not in forces:
                suggestion = suggest_name(name, [*forces, *groups])
                raise SettingError(
                    f"'{model.name}' has no force and no group of forces '{name}'{suggestion}"
                )
            named = [str(getattr(member, "name", member)) for member in groups.get(name, (name,))]
            members = [forces[member] for member in named if member in forces]
        result += members
    return result


@dataclass(frozen=True, eq=False)
class RecordedMotion(Movement):
    """Values of all coordinates of a mechanism at t times.

    As a table it has these values; :meth:`bodies`, :meth:`markers` and :meth:`inverse_dynamics`
    return other tables.

    Attributes:
        mechanism: the mechanism.
        times: times (t,), s.
        values: values (t, n) in the order of the mechanism's coordinates, rad and m.
        missing: coordinates that the record lacks; they keep their default values.
        ignored: columns of the record that are not coordinates.
        around: times (s,) and values (s, n) that are differentiated, if they extend beyond `times`.
        named_by_path: coordinates whose columns are named by paths, as in files of states.
    """

    mechanism: Mechanism
    times: Array
    values: Array
    missing: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    around: tuple[Array, Array] | None = None
    named_by_path: tuple[str, ...] = ()

    def describe_columns(self, computed: Collection[str] = ()) -> list[str]:
        """Return sentences about coordinates without a column, and columns without a coordinate.

        Args:
            computed: names of coordinates whose values the caller provides where the record lacks
                them, and which are not named.
        """
        sentences = []
        if missing := [name for name in self.missing if name not in computed]:
            sentences.append(f"not in the motion, default value used: {join_words(missing)}")
        if self.ignored:
            names = join_words(self.ignored)
            sentences.append(f"ignored columns (no coordinate, or a repeated one): {names}")
        return sentences

    @classmethod
    def from_source(
        cls, mechanism: Mechanism, source: MotionSource, times: ArrayLike | None = None
    ) -> RecordedMotion:
        """Return a motion from a file, from arrays, or from another motion.

        Args:
            mechanism: the mechanism.
            source: a .mot or .sto file; a motion, such as a fitted one or a trajectory, which may
                be of another model; or arrays (t,) in rad and m by the names or paths of
                coordinates.
            times: times (t,) of a motion that consists of arrays, s; not used for other motions.

        Returns:
            The motion of this mechanism.

        Raises:
            SettingError: times of arrays are missing, or the lengths differ.
            OsimliteError: the source is not a motion, see :meth:`read`.
        """
        if isinstance(source, str | Path):
            return cls.read(mechanism, source)
        if isinstance(source, Mapping):
            if times is None:
                raise SettingError("arrays of coordinates need `times`, one for each row")
            moments = np.asarray(times, dtype=float).reshape(-1)
            columns = [np.asarray(column, dtype=float) for column in source.values()]
            for name, column in zip(source, columns, strict=True):
                if column.shape != moments.shape:
                    had = " × ".join(map(str, column.shape)) or "one"
                    raise SettingError(
                        f"'{name}' has {had} values for {format_count(len(moments), 'time')}; give one each"
                    )
            rows = np.column_stack([np.empty((len(moments), 0)), *columns])
            return cls.from_table(mechanism, StoTable("arrays", moments, tuple(source), rows))
        result = source.mechanism.coordinates
        return cls.from_table(
            mechanism,
            StoTable("motion", source.times, tuple(info.path for info in result), source.values),
        )

    @classmethod
    def read(cls, mechanism: Mechanism, path: str | Path) -> RecordedMotion:
        """Read a motion from a .mot or .sto file.

        A column is named like the coordinate, or like its value in a file of states of any version
        (``/jointset/knee/knee_angle/value``, ``knee/knee_angle/value``). If the file is in
        degrees, rotational coordinates are converted and coupled ones are not, as in OpenSim.

        Args:
            mechanism: the mechanism.
            path: the file.

        Returns:
            The motion.

        Raises:
            DocumentError: the file is not a table, has no rows, its times do not increase, a
                coordinate is not a finite number or is too large, or no column is a coordinate of
                the mechanism.
            ModelError: the mechanism has no coordinates.
        """
        return cls.from_table(mechanism, read_sto(path))

    @classmethod
    def from_table(cls, mechanism: Mechanism, table: StoTable) -> RecordedMotion:
        """Return the motion in a table; see :meth:`read`.

        Args:
            mechanism: the mechanism.
            table: table of coordinates or states.

        Raises:
            DocumentError: the table has no rows, its times do not increase, a coordinate is not a
                finite number or is too large, or no column is a coordinate of the mechanism.
            ModelError: the mechanism has no coordinates.
        """
        if not len(table.times):
            raise DocumentError("the motion has no rows", file=table.file)
        # Coordinates without a column keep their default value.
        values = np.tile(mechanism.values({}), (len(table.times), 1))
        # Of columns with one label, the first counts.
        first_columns = {label: index for index, label in reversed([*enumerate(table.columns)])}
        states = match_state_columns(
            table.columns,
            [
                f"{info.path}/{quantity}"
                for info in mechanism.coordinates
                for quantity in ("value", "speed")
            ],
        )
        result: dict[int, int] = {}
        for index, info in enumerate(mechanism.coordinates):
            columns = (
                first_columns.get(info.name),
                first_columns.get(info.path),
                states.get(f"{info.path}/value"),
            )
            column = next(
                # A column belongs to one coordinate only, even if two coordinates share a name.
                (
                    candidate
                    for candidate in columns
                    if candidate is not None and candidate not in result.values()
                ),
                None,
            )
            if column is not None:
                result[index] = column
                is_in_degrees = table.in_degrees and info.motion_type == "rotational"
                values[:, index] = (
                    np.radians(table.rows[:, column]) if is_in_degrees else table.rows[:, column]
                )
        # Speeds in a file of states are recomputed from the values, and states of forces do not
        # belong to a pose.
        used = {*result.values(), *states.values()}
        ignored = [
            label
            for index, label in enumerate(table.columns)
            if index not in used and not label.startswith("/forceset/")
        ]
        if not mechanism.coordinates:
            raise ModelError(
                f"'{mechanism.name}' has no coordinates: it cannot follow a motion", file=table.file
            )
        if not result:
            raise DocumentError(
                f"no column is a coordinate of '{mechanism.name}', which has "
                f"{join_words(mechanism.coordinate_names)}",
                file=table.file,
            )
        # Only then are times compared: a repeated time is an error if the poses differ.
        close = (np.abs(np.diff(values, axis=0)) < SAME_VALUE_TOLERANCE).all(axis=1)
        if len(repeated_rows := np.flatnonzero((np.diff(table.times) == 0.0) & close)):
            # OpenSim's tools write the last time twice, with values that differ by rounding.
            table = replace(
                table,
                times=np.delete(table.times, repeated_rows),
                rows=np.delete(table.rows, repeated_rows, axis=0),
            )
            values = np.delete(values, repeated_rows, axis=0)
        expect_increasing_times(table.times, table.file)
        # The negation also finds NaN.
        gaps = np.argwhere(~(np.abs(values) < MAX_COORDINATE))
        if len(gaps):
            row, index = gaps[0]
            name = mechanism.coordinates[index].name
            message = f"'{name}' is {values[row, index]} at {table.times[row]:g} s; "
            message += (
                "fill the gaps"
                if not np.isfinite(values[row, index])
                else "no body can be that far away"
            )
            raise DocumentError(message, file=table.file)
        missing = tuple(
            info.name for index, info in enumerate(mechanism.coordinates) if index not in result
        )
        plain = {*table.columns}
        by_path = tuple(mechanism.coordinates[index].name for index in sorted(result))
        by_path = tuple(name for name in by_path if name not in plain)
        return cls(mechanism, table.times, values, missing, tuple(ignored), named_by_path=by_path)

    @cached_property
    def rates(self) -> tuple[Array, Array]:
        """First and second derivatives of the values, by natural splines of fifth degree through them.

        Returns:
            First derivatives (t, n) per s, and second derivatives (t, n) per s².

        Raises:
            SettingError: there are fewer than six times.
        """
        self._require_time_count("accelerations need")
        first, second = derivatives_of_samples(
            *(self.around or (self.times, self.values)), self.times, (1, 2), _HALF_SPLINE_ORDER
        )
        return first, second

    def apply_lowpass(self, cutoff: float, *, continued: bool = False) -> RecordedMotion:
        """Return the motion after OpenSim's low-pass filter, at evenly spaced times.

        Args:
            cutoff: frequency, Hz.
            continued: whether the motion includes the extensions that the filter adds at both ends,
                half the length of the motion each, and a frequency that is too high is reduced, as
                in OpenSim's tools.

        Returns:
            The filtered motion.

        Raises:
            SettingError: the frequency is not positive, or too high for the times, or there are
                fewer than six times.
        """
        self._require_time_count("a filter needs")
        times, values = filter_lowpass(self.times, self.values, cutoff, limited=continued)
        if continued:
            return replace(self, times=times, values=values, around=None)
        # The extensions of the filter at both ends are not recorded data.
        slack = 1e-6 * (times[1] - times[0])
        is_inside = (times >= self.times[0] - slack) & (times <= self.times[-1] + slack)
        return replace(
            self, times=times[is_inside], values=values[is_inside], around=(times, values)
        )

    def select_times(self, first: float, last: float) -> RecordedMotion:
        """Return a part of the motion, at least one row.

        Args:
            first: time at or before which the part begins, s: with the last such row, or the first
                of all.
            last: time at or before which the part ends, s: with the last such row, or the first of
                all.

        Returns:
            The part, which keeps the other rows so that derivatives at its ends are those of the
            complete motion.

        Raises:
            SettingError: `last` is before `first`.
        """
        if not first <= last:
            raise SettingError(
                f"the first time, {first:g} s, is after the last, {last:g} s; exchange them"
            )
        start, end = (
            max(0, int(np.searchsorted(self.times, time, side="right")) - 1)
            for time in (first, last)
        )
        around = self.around or (self.times, self.values)
        return replace(
            self,
            times=self.times[start : end + 1],
            values=self.values[start : end + 1],
            around=around,
        )

    def _require_time_count(self, purpose: str) -> None:
        """Check that there are as many times as splines of fifth degree need.

        Raises:
            SettingError: the motion has fewer times than these splines need.
        """
        count = len(self.around[0] if self.around else self.times)
        if count < 2 * _HALF_SPLINE_ORDER:
            raise SettingError(
                f"the motion has {format_count(count, 'time')}; {purpose} at least {2 * _HALF_SPLINE_ORDER}"
            )

    def assemble_poses(self) -> RecordedMotion:
        """Return the motion with every pose moved to the nearest one that fulfils the constraints.

        Raises:
            SimulationError: a pose is too far from fulfilling them.
        """
        from osimlite.simulation.pose_assembly import assemble_motion

        poses = assemble_motion(self.mechanism, self.times, self.values)
        return RecordedMotion(self.mechanism, self.times, poses, self.missing, self.ignored)

    assembled = make_deprecated_method("assemble_poses")
    between = make_deprecated_method("select_times")
    lowpassed = make_deprecated_method("apply_lowpass")

    def bodies(self) -> StoTable:
        """Return the positions of all mass centres and the orientations of all bodies.

        The columns are those of OpenSim's BodyKinematics analysis in ground: for each body the
        position (m) of its mass centre and its body-fixed X-Y-Z angles (degrees), then the mass
        centre of the model (m).
        """
        mechanism = self.mechanism
        columns = [
            f"{body.name}_{quantity}"
            for body in mechanism.bodies
            for quantity in ("X", "Y", "Z", "Ox", "Oy", "Oz")
        ]
        rows = np.empty((len(self.times), len(columns) + 3))
        poses = watch_items("computing positions of bodies", self.values)
        for row, q in zip(rows, poses, strict=True):
            state = mechanism.at(q)
            angles = np.degrees(angles_xyz(state.rotations[:-1]))
            centres = MassCentres.compute(state).positions()
            row[:-3] = np.concatenate([centres, angles], axis=1).ravel()
            # A massless model has its mass centre at the origin, instead of NaN.
            row[-3:] = mechanism.inertial[0] @ centres / (mechanism.total_mass or 1.0)
        labels = (*columns, *(f"center_of_mass_{axis}" for axis in "XYZ"))
        return StoTable("Positions", self.times, labels, rows, in_degrees=True)

    def markers(self) -> StoTable:
        """Return the positions of all markers.

        The columns are X, Y and Z of each marker in ground, m.
        """
        mechanism = self.mechanism
        stations = {
            path: station
            for path, station in mechanism.stations.items()
            if path.startswith("/markerset/")
        }
        columns = [f"{path.rsplit('/', 1)[1]}_{axis}" for path in stations for axis in "XYZ"]
        rows = np.empty((len(self.times), len(columns)))
        poses = watch_items("computing positions of markers", self.values)
        for row, q in zip(rows, poses, strict=True):
            state = mechanism.at(q)
            row[:] = [number for station in stations.values() for number in state.point(*station)]
        return StoTable("MarkerPositions", self.times, tuple(columns), rows)

    def inverse_dynamics(self, forces: Forces | None = None) -> StoTable:
        """Return the generalized forces that the motion requires beyond gravity and the given forces.

        Locks and other constraints are ignored, as in OpenSim. The forces belong to the generalized
        speeds: for ball and free joints they are moments about axes of the joint's parent frame.
        OpenSim's tool uses the rates of the angles as speeds there, which is wrong unless the
        angles are small.

        Args:
            forces: forces on the mechanism, such as springs, contacts and measured loads; their
                states have initial values. None for gravity alone.

        Returns:
            A column (N or N·m) for each coordinate, in the order of OpenSim's tool.

        Raises:
            SimulationError: a force cannot be computed at one of the states, or a result is NaN or
                infinite.
        """
        mechanism = self.mechanism
        system = System(mechanism.without_constraints(), forces or Forces(()))
        order = list(system.order)
        speeds, accelerations = (rates.copy() for rates in self.rates)
        if mechanism.turning:
            for q, u, udot in zip(self.values, speeds, accelerations, strict=True):
                u[:] = mechanism.speeds_from_rates(q, u)
                # With qdot = N(q) u, the derivative is qddot = N udot + Ndot u, and the bias is
                # Ndot u.
                udot[:] = mechanism.speeds_from_rates(q, udot - mechanism.rate_bias(q, u))
        states = system.state.pack_rows(self.values, speeds)
        rows = np.empty_like(self.values)
        rows[:, order] = system.compute_required_forces(
            np.column_stack([self.times, states]), accelerations[:, order]
        )
        # OpenSim's tool lists coordinates in the order of the multibody tree, not of the model.
        order = [index for body in mechanism.bodies for index in body.mobilizer.coordinates]
        infos = [mechanism.coordinates[index] for index in order]
        labels = [
            f"{info.name}_{'moment' if info.motion_type == 'rotational' else 'force'}"
            for info in infos
        ]
        name = "Inverse Dynamics Generalized Forces"
        expect_numbers(name, labels, self.times, rows[:, order])
        return StoTable(name, self.times, tuple(labels), rows[:, order])


MotionSource: TypeAlias = "str | Path | Mapping[str, ArrayLike] | Movement | Trajectory"
"""A motion in any form."""
