"""OpenSim's InverseKinematicsTool: weights and targets from its tasks, and its result."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.inverse_kinematics import check_weight, find_marker_stations, fit_motion
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.pose_layout import CoordinateTarget
from osimlite.io.tables.storage import StoTable, expect_time_range, read_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.ik_tasks import IKCoordinateTask, IKMarkerTask, IKTask

if TYPE_CHECKING:
    from osimlite.schema.tools.inverse_kinematics import InverseKinematicsTool

NO_FILE = ("", "Unassigned")
"""Values of a file property that name no file."""


class FitTargets(NamedTuple):
    """Targets of inverse kinematics."""

    # Weights of the markers that are fitted or reported, in the order of the data.
    weights: dict[str, float]
    goals: list[CoordinateTarget]  # coordinates with target values
    target_values: Array  # target values (t, k), rad or m


def collect_targets(
    model: Model,
    mechanism: Mechanism,
    tasks: Iterable[IKTask],
    data: MarkerData,
    coordinates: StoTable | None,
) -> FitTargets:
    """Return the targets that a set of tasks defines.

    Without a marker task that applies, all markers have weight 1. As in OpenSim, values from a file
    are taken as degrees, whatever its header says, and interpolated by splines of degree five.

    Args:
        model: model whose markers are fitted.
        mechanism: mechanism of the model.
        tasks: tasks of the setup.
        data: measured markers.
        coordinates: table with values of coordinates; None without a file.

    Raises:
        SettingError: a coordinate does not exist or has no value in the file, or a weight is
            invalid.
        OsimliteError: the model and the data share no marker of the tasks.
    """
    applied = [task for task in tasks if task.apply]
    for task in applied:
        check_weight(task.weight, f"the task '{task.name}'")
    requested = {
        task.name: float(task.weight) for task in applied if isinstance(task, IKMarkerTask)
    } or None
    names = data.find_shared_names([*find_marker_stations(model, mechanism)], requested)
    # Markers of weight 0 are not fitted, but their errors are reported.
    weights = {name: 1.0 if requested is None else requested[name] for name in names}
    goals, targets = [], []
    for task in applied:
        if isinstance(task, IKCoordinateTask):
            index = mechanism.coordinate_index(task.name)
            goals.append(CoordinateTarget(index, float(task.weight)))
            targets.append(_compute_target_values(task, mechanism, index, data.times, coordinates))
    return FitTargets(weights, goals, np.array(targets).reshape(len(goals), len(data.times)).T)


def _compute_target_values(
    task: IKCoordinateTask,
    mechanism: Mechanism,
    index: int,
    times: Array,
    coordinates: StoTable | None,
) -> Array:
    """Return the target values of a coordinate over time, rad or m.

    Raises:
        SettingError: the values are read from a file, but there is no file or it has no such
            column.
    """
    info = mechanism.coordinates[index]
    if task.value_type == "manual_value":
        return np.full(len(times), float(task.value))
    if task.value_type != "from_file":
        return np.full(len(times), info.default_value)
    columns = () if coordinates is None else coordinates.columns
    if coordinates is None or task.name not in columns:
        reason = (
            "there is no coordinate_file"
            if coordinates is None
            else f"'{coordinates.file}' has no such column"
        )
        raise SettingError(
            f"the value of '{task.name}' is read from a file, but "
            f"{reason}{suggest_name(task.name, columns)}"
        )
    values = (
        np.deg2rad(coordinates[task.name])
        if info.motion_type == "rotational"
        else coordinates[task.name]
    )
    order = min(3, (len(values) + 1) // 2)
    if len(values) < 2:
        return np.full(len(times), float(values[0]))
    spline = smoothing_spline(coordinates.times, values, order, 0.0)
    return np.array([spline.derivatives(t)[0] for t in times.tolist()])


def run_inverse_kinematics(
    tool: InverseKinematicsTool, model: Model, data: MarkerData, coordinates: StoTable | None = None
) -> FittedMotion:
    """Return the motion that an InverseKinematicsTool computes from measured markers.

    Args:
        tool: setup of the tool.
        model: model whose markers are fitted.
        data: measured markers.
        coordinates: table with values of coordinates; None without a file.

    Raises:
        OsimliteError: the tasks do not fit the model or the data, see :func:`collect_targets`.
    """
    start, end = expect_time_range(tool.time_range)
    frames = data.select_times(start, end)
    mechanism = build_mechanism(model)
    tasks = collect_targets(model, mechanism, tool.ik_task_set.objects, frames, coordinates)
    return fit_motion(model, mechanism, frames, tasks.weights, tasks.goals, tasks.target_values)


def create_motion_table(motion: FittedMotion) -> StoTable:
    """Return the table of coordinates that the tool writes, in degrees."""
    return StoTable(
        "Coordinates", motion.times, motion.coordinates, motion.in_degrees, in_degrees=True
    )


def read_coordinate_table(name: str, folder: Path) -> StoTable | None:
    """Return the coordinate file of a setup; None if the setup names none."""
    return None if name in NO_FILE else read_sto(folder / name)
