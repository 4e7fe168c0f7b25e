"""OpenSim's InverseKinematicsTool: tasks become weights and goals, results its files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.inverse_kinematics import check_weight, fitted, marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.pose_layout import Goal
from osimlite.io.tables.storage import StoTable, both_of, read_sto
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.tools.inverse_kinematics import (
    IKCoordinateTask,
    IKMarkerTask,
    IKTask,
    InverseKinematicsTool,
)

UNNAMED = ("", "Unassigned")
"""What stands for no file."""


class Tasks(NamedTuple):
    """What inverse kinematics is asked for."""

    # of the markers that are fitted or reported, in the order of the data
    weights: dict[str, float]
    goals: list[Goal]  # coordinates that are to have values
    wanted: Array  # these values (t, k), rad or m


def tasks_of(
    model: Model,
    mechanism: Mechanism,
    tasks: Iterable[IKTask],
    data: MarkerData,
    coordinates: StoTable | None,
) -> Tasks:
    """What a set of tasks asks for of a model and data.

    Without a marker task that applies, all markers weigh 1. Values from a file are taken in
    degrees, whatever it says, and from splines of fifth degree, as in OpenSim.

    Raises:
        SettingError: a coordinate is not there, has no value in the file, or a weight is none.
        OsimliteError: no marker of the tasks is in the model and in the data.
    """
    applied = [task for task in tasks if task.apply]
    for task in applied:
        check_weight(task.weight, f"the task '{task.name}'")
    asked = {
        task.name: float(task.weight) for task in applied if isinstance(task, IKMarkerTask)
    } or None
    names = data.shared([*marker_stations(model, mechanism)], asked)
    weights = {name: 1.0 if asked is None else asked[name] for name in names}
    goals, wanted = [], []
    for task in applied:
        if isinstance(task, IKCoordinateTask):
            place = mechanism.coordinate_index(task.name)
            goals.append(Goal(place, float(task.weight)))
            wanted.append(_values(task, mechanism, place, data.times, coordinates))
    return Tasks(weights, goals, np.array(wanted).reshape(len(goals), len(data.times)).T)


def _values(
    task: IKCoordinateTask,
    mechanism: Mechanism,
    place: int,
    times: Array,
    coordinates: StoTable | None,
) -> Array:
    """The values of a coordinate task over time, rad or m."""
    info = mechanism.coordinates[place]
    if task.value_type == "manual_value":
        return np.full(len(times), float(task.value))
    if task.value_type != "from_file":
        return np.full(len(times), info.default_value)
    columns = () if coordinates is None else coordinates.columns
    if coordinates is None or task.name not in columns:
        where = (
            "there is no coordinate_file"
            if coordinates is None
            else f"'{coordinates.file}' has no such column"
        )
        raise SettingError(
            f"the value of '{task.name}' is to be from a file, and {where}{suggest_name(task.name, columns)}"
        )
    values = (
        np.deg2rad(coordinates[task.name])
        if info.motion_type == "rotational"
        else coordinates[task.name]
    )
    half = min(3, (len(values) + 1) // 2)
    if len(values) < 2:
        return np.full(len(times), float(values[0]))
    spline = smoothing_spline(coordinates.times, values, half, 0.0)
    return np.array([spline.derivatives(t)[0] for t in times.tolist()])


def run_inverse_kinematics(
    tool: InverseKinematicsTool, model: Model, data: MarkerData, coordinates: StoTable | None = None
) -> FittedMotion:
    """What the tool computes, for a model and data that are read already; errors as those of `tasks_of`."""
    first, last = both_of(tool.time_range)
    frames = data.between(first, last)
    mechanism = build_mechanism(model)
    tasks = tasks_of(model, mechanism, tool.ik_task_set.objects, frames, coordinates)
    return fitted(model, mechanism, frames, tasks.weights, tasks.goals, tasks.wanted)


def motion_table(motion: FittedMotion) -> StoTable:
    """The coordinates as the tool writes them, in degrees."""
    return StoTable(
        "Coordinates", motion.times, motion.coordinates, motion.in_degrees, in_degrees=True
    )


def coordinate_table(name: str, folder: Path) -> StoTable | None:
    """The coordinate file of a setup, if it names one."""
    return None if name in UNNAMED else read_sto(folder / name)
