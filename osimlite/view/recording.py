"""Motions from files, with contact forces from another file or from the model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.recorded_motion import RecordedMotion
from osimlite.view.motion import interpolate_columns


class MeasuredMarkers(NamedTuple):
    """Measured positions of markers during a motion, and their stations in the model."""

    names: Sequence[str]  # names of the m markers
    # index of the body of each marker (-1 for ground), and its position in the body (3,), m
    stations: Sequence[tuple[int, Array]]
    positions: Array  # measured positions (t, m, 3) in ground, m; NaN where a marker was not seen


@dataclass(frozen=True, eq=False)
class Recording:
    """Motion from a file, with the attributes of a :class:`osimlite.view.motion.DrawableMotion`.

    `remarks` are sentences about data that the files lack, `measured` the markers from which the
    motion was computed.
    """

    times: Array
    coordinates: Sequence[str]
    values: Array
    speeds: Array
    forces: Mapping[str, Array] = field(default_factory=dict)
    auxiliary: Mapping[str, Array] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    measured: MeasuredMarkers | None = None


def read_recording(
    model: Model,
    mechanism: Mechanism,
    path: str | Path,
    forces: str | Path | None = None,
    values: Mapping[str, float] | None = None,
    *,
    folder: Path | None = None,
) -> Recording:
    """Read the motion in a .sto or .mot file.

    Coordinates that the file lacks keep their default values, or follow others by their couplers.
    Contact forces come from the file `forces` (with the labels of OpenSim's ForceReporter). Without
    it they are computed if the file has speeds; forces that osimlite does not support are left out.

    Args:
        model: model that moves.
        mechanism: mechanism of `model`.
        path: motion file (.sto or .mot).
        forces: file with forces; None to compute them.
        values: constant values (rad, m) by the names or paths of coordinates, which replace those
            in the file.
        folder: folder of the model's file, where the files of contact meshes are searched.

    Returns:
        Motion with its speeds, forces and activations, and remarks about missing data.

    Raises:
        OsimliteError: a file is missing or is not a motion; see :meth:`.RecordedMotion.read`.
    """
    recorded_motion = RecordedMotion.read(mechanism, path)
    # The caller's values replace those of the file; their keys may be names or paths.
    rows = recorded_motion.values
    replaced_names = set()
    for key, value in (values or {}).items():
        index = mechanism.coordinate_index(key)
        rows[:, index] = value
        replaced_names.add(mechanism.coordinates[index].name)
    coupled_names = _follow_couplers(mechanism, rows, set(recorded_motion.missing))
    table = read_sto(path)
    speeds = _read_speeds(mechanism, table)
    remarks = recorded_motion.describe_columns(coupled_names | replaced_names)
    columns: Mapping[str, Array] = {}
    if forces is not None:
        columns = _find_columns(read_sto(forces), recorded_motion.times)
    elif speeds is not None:
        try:
            columns = compute_forces(model, mechanism, recorded_motion.times, rows, speeds, folder)
        except OsimliteError as error:
            remarks.append(f"no forces are shown: {error.message}")
    # Without speeds there are no forces that depend on them.
    known_speeds = np.zeros_like(rows) if speeds is None else speeds
    states = {label: table[label] for label in table.columns if label.endswith("activation")}
    return Recording(
        recorded_motion.times,
        mechanism.coordinate_names,
        rows,
        known_speeds,
        columns,
        states,
        tuple(remarks),
    )


def _follow_couplers(mechanism: Mechanism, rows: Array, missing_names: set[str]) -> set[str]:
    """Set coordinates that the file lacks, in place, by their couplers, which may form chains.

    Returns:
        Names of these coordinates.
    """
    couplers = [
        constraint for constraint in mechanism.constraints if isinstance(constraint, Coupler)
    ]
    couplers = [
        constraint
        for constraint in couplers
        if mechanism.coordinates[constraint.dependent].name in missing_names
    ]
    # The values of a chain of couplers are complete after as many rounds as it has couplers.
    for coupler in couplers * len(couplers):
        arguments = list(coupler.independent)
        rows[:, coupler.dependent] = [coupler.function.evaluate(row[arguments])[0] for row in rows]
    return {mechanism.coordinates[coupler.dependent].name for coupler in couplers}


def compute_forces(
    model: Model,
    mechanism: Mechanism,
    times: Array,
    values: Array,
    speeds: Array,
    folder: Path | None = None,
) -> dict[str, Array]:
    """Compute the values that OpenSim's ForceReporter would report at n states.

    Forces that osimlite does not support are left out. No engine is needed.

    Args:
        model: model with the forces.
        mechanism: mechanism of `model`.
        times: times (n,), s.
        values: coordinate values (n, k), rad or m.
        speeds: generalized speeds (n, k).
        folder: folder of the model's file, where the files of contact meshes are searched.

    Returns:
        Columns (n,) by label, in SI units; empty if no force is supported.

    Raises:
        OsimliteError: a file is missing or cannot be read.
        SimulationError: at a state the rates of coordinates are not defined.
    """
    # Imported here: files with forces need no engine.
    from osimlite.simulation.elements import force_elements
    from osimlite.simulation.system import System

    forces = force_elements(model, mechanism, skip_unsupported=True, folder=folder)
    if not forces.elements:
        return {}
    system = System(mechanism, forces)
    table = system.force_table(times, system.state.pack_rows(values, speeds))
    return {label: table[:, index] for index, label in enumerate(system.columns)}


def _read_speeds(mechanism: Mechanism, table: StoTable) -> Array | None:
    """Return generalized speeds (n, k) of a table; None if an unlocked coordinate lacks them."""
    speeds = np.zeros((len(table.times), len(mechanism.coordinates)))
    for index, coordinate in enumerate(mechanism.coordinates):
        label = f"{coordinate.path}/speed"
        if label in table.columns:
            # Files in degrees have angular speeds in degrees per second.
            in_degrees = table.in_degrees and coordinate.motion_type == "rotational"
            speeds[:, index] = np.radians(table[label]) if in_degrees else table[label]
        elif not coordinate.locked:
            return None
    return speeds


def _find_columns(table: StoTable, times: Array) -> dict[str, Array]:
    if not len(table.times):
        return {}
    rows = interpolate_columns(
        Recording(table.times, (), table.rows, table.rows), table.rows, times
    )
    return {label: rows[:, index] for index, label in enumerate(table.columns)}
