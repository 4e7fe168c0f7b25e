"""Inverse kinematics: the motion of a model that fits measured markers and orientations best, to the last digits.

OpenSim minimises the same cost, but for numbers that it leaves out: half the weighted mean of the
squared distances of the markers that were seen, half that of the squared angles by which sensors
are turned from where they were measured, and half of the weighted squared deviations of
coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import replace
from osimlite.base.text import suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.marker_data import MarkerData, Measured
from osimlite.fitting.orientation_data import OrientationData, Orientations
from osimlite.fitting.pose_fit import PoseFit, Poses
from osimlite.fitting.pose_layout import Goal, Marker, Sensor
from osimlite.fitting.sensors import sensor_frames
from osimlite.fitting.undetermined import find_undetermined
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock, Prescribed
from osimlite.mechanics.multibody.mechanism import Mechanism, StationPlacement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model

SAME_TIMES = 1e-9
"""What the times of markers and orientations may be apart (s)."""


def inverse_kinematics(
    model: Model,
    markers: Measured | None = None,
    *,
    orientations: Orientations | None = None,
    times: ArrayLike | None = None,
    weights: Mapping[str, float] | None = None,
    coordinates: Mapping[str, float | tuple[float, float]] | None = None,
    constraints: bool = True,
    start: float = -np.inf,
    end: float = np.inf,
) -> FittedMotion:
    """Fit the pose of a model to measured markers, orientations of sensors, or both, frame by frame.

    Args: model: whose markers have the names of the measured ones, and frames those of the sensors.
        markers: a .trc, .c3d or .sto file, or arrays (t, 3) by name in ground, m; NaN where a
        marker was not seen. orientations: a .sto file of quaternions, or by name arrays of
        quaternions (t, 4), scalar first, or rotation matrices (t, 3, 3) that turn what is given
        along the axes of a sensor into ground; NaN where one was not measured. Without markers they
        say nothing of where the model is: coordinates that are translations keep their default
        values, as in OpenSim. With markers they are of the same times. times: of the frames of
        arrays, s; by default 0, 1, 2 ... weights: of markers and sensors by name; those left out
        weigh 1, those of 0 do not count. coordinates: weights (1/rad², 1/m²) of coordinates that
        are to keep their default values, by name, or the weight and the value (rad or m) that one
        is to have. Beside the mean over the markers such a weight of 1 is large. constraints:
        whether those of the model hold. start: first time, s. end: last time, s.

    Returns: The motion, every frame at its minimum to 1e-8 rad. Clamped coordinates stay in their
        ranges, locked ones at their defaults.

    Raises:
        OsimliteError: a file cannot be read, or no marker is in both the model and the data.
        SettingError: nothing is given, or a weight, a goal or all sensors name what is not there.
        SimulationError: no pose fulfils the constraints.
        UnsupportedError: the model has a joint or a constraint that cannot be computed.
    """
    if markers is None and orientations is None:
        raise SettingError("there is nothing to fit; give markers, orientations, or both")
    turned = (
        None
        if orientations is None
        else OrientationData.of(orientations, times).between(start, end)
    )
    if markers is not None:
        data = MarkerData.of(markers, times).between(start, end)
    elif turned is not None:
        data = MarkerData.nothing(turned.times)
    mechanism = build_mechanism(model)
    stations = marker_stations(model, mechanism)
    frames = {} if turned is None else sensor_frames(model, mechanism, turned.names)
    weighed = {name: 1.0 for name in (data.shared([*stations]) if markers is not None else ())}
    sensed = {name: 1.0 for name in frames}
    for name, weight in (weights or {}).items():
        if name not in stations and name not in frames:
            known = [*stations, *frames]
            what = "marker" if not frames else "sensor" if markers is None else "marker or sensor"
            raise SettingError(f"'{model.name}' has no {what} '{name}'{suggest_name(name, known)}")
        check_weight(weight, f"'{name}'")
        for kind in (weighed, sensed):
            if name in kind:
                kind[name] = float(weight)
    goals, wanted = [], []
    for name, goal in (coordinates or {}).items():
        place = mechanism.coordinate_index(name)
        weight, value = (
            goal if isinstance(goal, tuple) else (goal, mechanism.coordinates[place].default_value)
        )
        goals.append(Goal(place, float(weight)))
        wanted.append(float(value))
    rows = np.tile(wanted, (len(data.times), 1))
    return fitted(model, mechanism, data, weighed, goals, rows, constraints, turned, sensed)


def fitted(
    model: Model,
    mechanism: Mechanism,
    data: MarkerData,
    weights: Mapping[str, float],
    goals: Sequence[Goal],
    wanted: Array,
    constraints: bool = True,
    orientations: OrientationData | None = None,
    sensed: Mapping[str, float] | None = None,
) -> FittedMotion:
    """Fit markers and sensors of a model that are in the data, by their weights, and coordinates to values (t, k).

    Raises:
        SettingError: markers and orientations are not of the same times.
    """
    turned = OrientationData.nothing(data.times) if orientations is None else orientations
    if (
        data.times.shape != turned.times.shape
        or np.abs(data.times - turned.times).max() > SAME_TIMES
    ):
        raise SettingError(
            f"the {len(data.times)} frames of the markers and the {len(turned.times)} of the orientations are not of "
            "the same times; give both at the times of one"
        )
    if not data.names:
        mechanism = without_slides(mechanism)
    names, sensors = tuple(weights), sensor_frames(model, mechanism, sensed) if sensed else {}
    stations = marker_stations(model, mechanism)
    points = [Marker(stations[name], weights[name]) for name in names]
    turning = [Sensor(frame, (sensed or {})[name]) for name, frame in sensors.items()]
    fit = PoseFit(mechanism, points, turning, goals, constraints=constraints)
    measured, count = data.only(names), len(data.times)
    given = measured, turned.only([*sensors]), wanted
    poses: Poses = fit.fit(
        np.hstack([item.reshape(count, -1) for item in given]),
        data.times,
        first_pose(mechanism, float(data.times[0]), constraints),
    )
    seen = np.asarray(np.isfinite(measured).all(axis=2))
    undetermined = find_undetermined(
        mechanism, poses.values, seen, points, turning, goals, constraints=constraints
    )
    return FittedMotion(
        mechanism,
        data.times,
        poses.values,
        names,
        measured,
        poses.places,
        poses.costs,
        poses.steps,
        poses.unseen,
        poses.unsettled,
        model,
        tuple(sensors),
        poses.turns,
        undetermined,
    )


def check_weight(weight: float, what: str) -> None:
    """Refuse what is no weight.

    Raises:
        SettingError: it is negative, infinite or no number.
    """
    if not 0.0 <= weight < np.inf:
        raise SettingError(f"the weight {weight:g} of {what} is no weight; give one from 0 on")


def without_slides(mechanism: Mechanism) -> Mechanism:
    """The mechanism with all translations locked at their default values, as OpenSim fits orientations."""
    infos = tuple(
        replace(info, locked=True) if info.motion_type == "translational" else info
        for info in mechanism.coordinates
    )
    others = tuple(
        item for item in mechanism.constraints if not isinstance(item, Lock | Prescribed)
    )
    return replace(mechanism, coordinates=infos, constraints=others)


def first_pose(mechanism: Mechanism, time: float, constraints: bool) -> Array:
    """Where a fit begins: the default pose."""
    return mechanism.assemble({}, time) if constraints else mechanism.values({})


def marker_stations(model: Model, mechanism: Mechanism) -> dict[str, StationPlacement]:
    """Where the markers of a model are on its bodies, by their names; of markers that share a name the first."""
    tree, result = model.tree(), dict[str, StationPlacement]()
    for marker in model.components(ModelMarker):
        placed = mechanism.stations.get(tree.path_of(marker) or "")
        if placed is not None:
            result.setdefault(marker.name, placed)
    return result
