"""Motions over time: coordinates alone (`Movement`), and simulated motions with forces and energies (`Trajectory`)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.files import make_folder, write_atomically
from osimlite.base.lazy import make_notebook_repr, make_plot
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.require import require
from osimlite.base.text import format_count, format_json
from osimlite.io.tables.storage import StoTable, describe_times, format_sto
from osimlite.io.tables.tabular import Tabular
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tree import Snapshot


class Trajectory(Tabular):
    """Motion of a mechanism over time, with its forces, energies and summary.

    Forces, energies and events are computed when they are first read.

    Attributes:
        mechanism: the mechanism.
        times: times of the n rows, s.
        coordinates: names of the k coordinates, in the mechanism's order.
        values: coordinate values (n, k), rad or m.
        speeds: generalized speeds (n, k).
        auxiliary: columns (n,) of the other integrated states, by their paths in OpenSim:
            activations, fiber lengths, and the energy (J) that the dampers of a BushingForce have
            dissipated.
        paths: paths of all states in OpenSim's order: ".../value" and ".../speed" of the
            coordinates, and those of `auxiliary`.
        controller: record of a controller, one row for each of its control steps; None without one.
    """

    _repr_html_ = make_notebook_repr("trajectory")
    plot = make_plot("plot_trajectory")

    def __init__(
        self,
        mechanism: Mechanism,
        times: Sequence[float],
        values: ArrayLike,
        speeds: ArrayLike,
        report: TrajectoryReports,
        auxiliary: Mapping[str, ArrayLike] = MappingProxyType({}),
        paths: Sequence[str] = (),
        model: Model | Snapshot | None = None,
        controller: StoTable | None = None,
    ) -> None:
        count = len(mechanism.coordinates)
        self.mechanism, self._model, self.controller = mechanism, model, controller
        self.times: Array = np.array(times, dtype=float)
        self.coordinates = mechanism.coordinate_names
        self.values: Array = np.array(values, dtype=float).reshape(len(self.times), count)
        self.speeds: Array = np.array(speeds, dtype=float).reshape(len(self.times), count)
        default_paths = [
            f"{info.path}/{quantity}"
            for info in mechanism.coordinates
            for quantity in ("value", "speed")
        ]
        self.paths = tuple(paths) or (*default_paths, *auxiliary)
        # Auxiliary states get the order in which OpenSim writes them.
        # States that the model does not list come last.
        rank = {path: number for number, path in enumerate(self.paths)}
        ordered = sorted(auxiliary, key=lambda path: rank.get(path, len(rank)))
        self.auxiliary: dict[str, Array] = {
            path: np.array(auxiliary[path], dtype=float) for path in ordered
        }
        self._report: TrajectoryReports | None = report

    @property
    def model(self) -> Model | None:
        """Copy of the simulated model, which notebooks show; None if the model is unknown."""
        return self._model.model if isinstance(self._model, Snapshot) else self._model

    @property
    def heading(self) -> str:
        """One-line description of the trajectory."""
        return (
            f"Trajectory of '{self.mechanism.name}': {describe_times(self.times)}, "
            f"{format_count(len(self.coordinates), 'coordinate')}"
        )

    @property
    def _text_columns(self) -> Mapping[str, Array]:
        """Coordinates: forces would have to be computed first."""
        return dict(zip(self.coordinates, self.values.T, strict=True))

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the `columns` of coordinates and their speeds; a coupled coordinate has none."""
        result: dict[str, str] = {}
        for info in self.mechanism.coordinates:
            if info.unit:
                result |= {info.name: info.unit, f"{info.name}/speed": f"{info.unit}/s"}
        return result

    def to_frame(self, *, paths: bool = False) -> Any:
        """Return the `columns` as a pandas DataFrame over ``time`` (s).

        ``frame.attrs["units"]`` has the units of coordinates and speeds.

        Args:
            paths: whether coordinates and speeds are called by their paths in state files,
                ``.../value`` and ``.../speed``, instead of ``<coordinate>`` and
                ``<coordinate>/speed``.

        Raises:
            MissingDependency: pandas is not installed.
        """
        names: dict[str, str] = {}
        for info in self.mechanism.coordinates if paths else ():
            names |= {info.name: f"{info.path}/value", f"{info.name}/speed": f"{info.path}/speed"}
        return self._make_frame(
            {names.get(name, name): column for name, column in self.columns.items()},
            {names.get(name, name): unit for name, unit in self.units.items()},
        )

    def __getstate__(self) -> dict[str, Any]:
        # The report refers to an engine, which cannot be sent to another process.
        # Reading the properties computes and stores them.
        _ = self.forces, self.energy, self.probes, self.summary
        return {**self.__dict__, "_report": None, "_model": self.model}

    @cached_property
    def forces(self) -> Mapping[str, Array]:
        """Columns (n,) of the force records by the labels of OpenSim's ForceReporter, in SI units.

        Labels such as ``RFootForce.RightShank.force.X`` stand for forces (N) and, about the body's
        origin, torques (N·m) on bodies, in ground. ``RKneeLimitTorque`` is a generalized force,
        ``RKneeLimitTorque.PotentialEnergy`` its energy (J). Surfaces of one force on the same body
        share the columns of that body.
        """
        labels, table = self._force_table
        return {label: table[:, index] for index, label in enumerate(labels)}

    @cached_property
    def _force_table(self) -> tuple[Sequence[str], Array]:
        assert self._report is not None
        labels, rows = self._report.forces()
        return labels, np.array(rows, dtype=float).reshape(len(self.times), len(labels))

    @cached_property
    def probes(self) -> Mapping[str, Array]:
        """Columns (n,) of the model's probes by the labels of OpenSim's ProbeReporter."""
        labels, table = self._probe_table
        return {label: table[:, index] for index, label in enumerate(labels)}

    @cached_property
    def _probe_table(self) -> tuple[Sequence[str], Array]:
        assert self._report is not None
        labels, rows = self._report.probes()
        return labels, np.array(rows, dtype=float).reshape(len(self.times), len(labels))

    @cached_property
    def energy(self) -> Mapping[str, Array]:
        """Columns (n,) ``kinetic``, ``gravity``, ``stored`` (in contacts and limit springs) and ``total``, in J."""
        assert self._report is not None
        table = np.array(self._report.energies(), dtype=float).reshape(len(self.times), 3)
        energies = dict(zip(("kinetic", "gravity", "stored"), table.T, strict=True))
        return {**energies, "total": table.sum(axis=1)}

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Counts, settings, energies, contact events and largest forces, as in summary.json.

        Returns:
            Data that JSON can hold, by name.
        """
        assert self._report is not None
        return self._report.summary()

    def to_bvh(self, path: str | Path, *, scale: float = 100.0) -> None:
        """Write skeleton and motion as a BVH file, for Blender and other animation programs.

        Args:
            path: the file.
            scale: numbers of the file per metre; 100 writes centimetres.

        Raises:
            OsimliteError: the file cannot be written.
        """
        from osimlite.base.files import write_atomically
        from osimlite.io.bvh import format_bvh
        from osimlite.simulation.bvh_export import make_bvh

        motion = make_bvh(self.mechanism, self.times, self.values, scale=scale).motion
        write_atomically(path, "".join(format_bvh(motion)))

    def to_sto(self, path: str | Path) -> None:
        """Write the states with OpenSim's column names.

        The file is complete or not written at all.

        Args:
            path: the file.

        Raises:
            OsimliteError: the file cannot be written.
        """
        write_atomically(path, self.states_text())

    @property
    def columns(self) -> dict[str, Array]:
        """Columns (n,) of values, speeds, states, forces and probes, in SI units and radians.

        Names are ``<coordinate>`` and ``<coordinate>/speed``, and those of `auxiliary`, `forces`
        and `probes`. A force or probe with the name of another column, such as an actuator that is
        called like its coordinate, is called ``<name>/force`` or ``<name>/probe``.

        Returns:
            Columns by name.
        """
        columns: dict[str, Array] = {}
        for index, name in enumerate(self.coordinates):
            columns[name] = self.values[:, index]
            columns[f"{name}/speed"] = self.speeds[:, index]
        columns |= self.auxiliary
        for ending, group in (("force", self.forces), ("probe", self.probes)):
            for name, column in group.items():
                columns[f"{name}/{ending}" if name in columns else name] = column
        return columns

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Motion as a table.

        Returns:
            The key column ``time`` (s), and the `columns`, by name.
        """
        return {"time": self.times}, self.columns

    def to_xarray(self) -> Any:
        """Return an xarray Dataset over ``time`` (s), in SI units and radians.

        ``value`` and ``speed`` are also over ``coordinate``. ``state``, ``force``, ``probe`` and
        ``energy`` hold `auxiliary`, `forces`, `probes` and `energy`, over ``state_name`` and so on;
        empty ones are left out.

        Raises:
            MissingDependency: xarray is not installed.
        """
        xarray = require("xarray", extra="frame", purpose="a data set of xarray")
        groups = {
            "state": self.auxiliary,
            "force": self.forces,
            "probe": self.probes,
            "energy": self.energy,
        }
        data: dict[str, Any] = {"value": (("time", "coordinate"), self.values)}
        data["speed"] = ("time", "coordinate"), self.speeds
        coords: dict[str, Any] = {"time": self.times, "coordinate": list(self.coordinates)}
        for name, columns in groups.items():
            if columns:
                coords[f"{name}_name"] = list(columns)
                data[name] = ("time", f"{name}_name"), np.column_stack(list(columns.values()))
        return xarray.Dataset(data, coords, {"model": self.mechanism.name})

    @property
    def states(self) -> StoTable:
        """Table of all states, in the order of `paths`."""
        columns: dict[str, Array] = dict(self.auxiliary)
        # Paths of states have the form that OpenSim writes.
        for index, info in enumerate(self.mechanism.coordinates):
            columns[f"{info.path}/value"], columns[f"{info.path}/speed"] = (
                self.values[:, index],
                self.speeds[:, index],
            )
        rows = (
            np.array([columns[path] for path in self.paths])
            # Also a table without states keeps its times.
            .reshape(len(self.paths), len(self.times))
            .T
        )
        return StoTable(self.mechanism.name, self.times, self.paths, rows)

    def states_text(self) -> str:
        """Return the text of states.sto."""
        return format_table(self.states)

    def forces_text(self) -> str:
        """Return the text of forces.sto, with the labels of OpenSim's ForceReporter."""
        labels, table = self._force_table
        return format_sto(
            "ModelForces", self.times.tolist(), label_as_opensim(labels), table.tolist()
        )

    def probes_text(self) -> str:
        """Return the text of probes.sto, with the labels of OpenSim's ProbeReporter; empty without probes."""
        labels, table = self._probe_table
        return (
            format_sto("ModelProbes", self.times.tolist(), labels, table.tolist()) if labels else ""
        )

    def write(self, folder: str | Path) -> list[Path]:
        """Write the motion into a folder.

        The files are ``states.sto``, ``forces.sto`` and ``summary.json``, and ``probes.sto`` and
        ``controller.sto`` if the model has probes or a controller.

        Args:
            folder: output folder; it is made if it does not exist.

        Returns:
            Paths of the written files.

        Raises:
            OsimliteError: the folder cannot be made or a file cannot be written.
        """
        base = Path(folder)
        # Everything is computed first, so that an error leaves no half of a result.
        # All texts are made before the first file is written, so that an error leaves no half of a
        # result.
        texts = {
            "states.sto": self.states_text(),
            "forces.sto": self.forces_text(),
            **({"probes.sto": text} if (text := self.probes_text()) else {}),
            **(
                {} if self.controller is None else {"controller.sto": format_table(self.controller)}
            ),
            "summary.json": format_json(self.summary),
        }
        make_folder(base)
        for name, text in texts.items():
            write_atomically(base / name, text)
        return [base / name for name in texts]


def format_table(table: StoTable) -> str:
    """Return the text of a table's .sto file."""
    return format_sto(
        table.name, table.times.tolist(), table.columns, table.rows.tolist(), header=table.header
    )


class Interrupted(KeyboardInterrupt):
    """Interruption of a simulation by Ctrl-C.

    Attributes:
        trajectory: the motion up to the last time that was reached.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        super().__init__(trajectory)
        self.trajectory = trajectory


class TrajectoryReports(NamedTuple):
    """Functions with which a trajectory computes its reports when they are first read.

    Attributes:
        forces: function that returns labels, and one row of numbers for each moment.
        energies: function that returns kinetic energy, potential energy of gravity and stored
            energy at each moment, J.
        probes: function that returns labels, and one row of numbers for each moment.
        summary: function that returns the content of summary.json.
    """

    forces: Callable[[], tuple[Sequence[str], Sequence[Sequence[float]]]]
    energies: Callable[[], Sequence[Sequence[float]]]
    probes: Callable[[], tuple[Sequence[str], Sequence[Sequence[float]]]]
    summary: Callable[[], dict[str, Any]]


class Movement(Tabular):
    """Motion of a mechanism from any source: values of its coordinates over time.

    Attributes:
        mechanism: the mechanism.
        times: times (t,), s.
        values: values of all n coordinates (t, n), in the mechanism's order, rad and m.
    """

    mechanism: Mechanism
    times: Array
    values: Array

    plot = make_plot("plot_movement")

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates, in the mechanism's order.

        Returns:
            One name for each column of `values`.
        """
        return self.mechanism.coordinate_names

    @property
    def table(self) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
        """Motion as a table.

        Returns:
            The key column ``time`` (s), and the coordinates (rad, m), by name.
        """
        return {"time": self.times}, dict(zip(self.coordinates, self.values.T, strict=True))

    @property
    def heading(self) -> str:
        """One-line description of the motion."""
        return (
            f"{type(self).__name__} of '{self.mechanism.name}': {describe_times(self.times)}, "
            f"{format_count(len(self.coordinates), 'coordinate')}"
        )

    @property
    def units(self) -> Mapping[str, str]:
        """Units of the coordinates; a coupled coordinate has none."""
        return {info.name: info.unit for info in self.mechanism.coordinates if info.unit}

    @property
    def in_degrees(self) -> Array:
        """Values (t, n) with rotational coordinates in degrees, as in OpenSim's files."""
        turning = [info.motion_type == "rotational" for info in self.mechanism.coordinates]
        return np.where(turning, np.rad2deg(self.values), self.values)

    def to_xarray(self) -> Any:
        """Return an xarray Dataset: ``value`` over ``time`` and ``coordinate``, rad and m.

        Raises:
            MissingDependency: xarray is not installed.
        """
        xarray = require("xarray", extra="frame", purpose="a data set of xarray")
        coordinates = {"time": self.times, "coordinate": list(self.coordinates)}
        return xarray.Dataset(
            {"value": (("time", "coordinate"), self.values)},
            coordinates,
            {"model": self.mechanism.name},
        )


LIMIT_ENERGY_LABEL = "PotentialEnergy"
"""OpenSim's label of the energy of a CoordinateLimitForce; several in one file share it."""


def label_as_opensim(labels: Iterable[str]) -> list[str]:
    """Return labels of force records as OpenSim's ForceReporter and StaticOptimization write them.

    Args:
        labels: labels of the force elements, in which the energy of a limit force carries the name
            of that force.

    Returns:
        The labels; OpenSim gives all limit forces the same label for their energy.
    """
    return [
        LIMIT_ENERGY_LABEL if label.endswith(f".{LIMIT_ENERGY_LABEL}") else label
        for label in labels
    ]
