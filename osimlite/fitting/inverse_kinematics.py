"""Inverse kinematics: motion of a model that fits measured markers and orientations best.

The cost of a frame is half the weighted mean of the squared distances of the markers that were
seen, plus half the weighted mean of the squared rotation angles of sensors from their measurements,
plus half the weighted squared deviations of coordinates. OpenSim minimizes the same cost up to
constant factors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import replace
from osimlite.base.text import format_count, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.marker_data import MarkerData, MarkerSource
from osimlite.fitting.orientation_data import OrientationData, OrientationSource
from osimlite.fitting.pose_fit import FittedPoses, PoseFit
from osimlite.fitting.pose_layout import CoordinateTarget, MarkerTarget, SensorTarget
from osimlite.fitting.sensors import find_sensor_frames
from osimlite.fitting.undetermined import find_undetermined
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Lock, PrescribedCoordinate
from osimlite.mechanics.multibody.mechanism import Mechanism, StationPlacement
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.markers import Marker as ModelMarker
from osimlite.schema.model import Model

TIME_TOLERANCE_S = 1e-9
"""Largest difference between the times of markers and of orientations, s."""


def inverse_kinematics(
    model: Model,
    markers: MarkerSource | None = None,
    *,
    orientations: OrientationSource | None = None,
    times: ArrayLike | None = None,
    weights: Mapping[str, float] | None = None,
    coordinates: Mapping[str, float | tuple[float, float]] | None = None,
    constraints: bool = True,
    start: float = -np.inf,
    end: float = np.inf,
) -> FittedMotion:
    """Fit the pose of a model to measured markers, orientations of sensors, or both, in each frame.

    Args:
        model: model with markers named as the measured ones, and frames named as the sensors.
        markers: path of a .trc, .c3d or .sto file, or arrays (t, 3) by name in ground, m; NaN where
            a marker was not seen.
        orientations: a .sto file of quaternions, or arrays by name: quaternions (t, 4), scalar
            first, or rotation matrices (t, 3, 3) from the axes of a sensor to ground; NaN where one
            was not measured. Without markers, translational coordinates keep their default values,
            as in OpenSim. With markers, both must have the same times.
        times: times of the frames of arrays, s; by default 0, 1, 2 ...
        weights: weights of markers and sensors by name; the others have weight 1, and weight 0
            excludes.
        coordinates: weights (1/rad², 1/m²) with which coordinates keep their default values, or
            weights and target values (rad or m), by name. A weight of 1 is large compared with the
            mean over the markers.
        constraints: whether the constraints of the model hold.
        start: first time, s.
        end: last time, s.

    Returns:
        The motion, each frame at its minimum to 1e-8 rad. Clamped coordinates stay in their ranges,
        locked ones at their default values.

    Raises:
        OsimliteError: a file cannot be read, or the model and the data share no marker.
        SettingError: there is nothing to fit, or a weight, a target or all sensors have unknown
            names.
        SimulationError: no pose satisfies the constraints.
        UnsupportedError: osimlite does not support a joint or constraint of the model.
    """
    if markers is None and orientations is None:
        raise SettingError("nothing to fit; pass markers, orientations, or both")
    orientation_data = (
        None
        if orientations is None
        else OrientationData.from_source(orientations, times).select_times(start, end)
    )
    if markers is not None:
        data = MarkerData.from_source(markers, times).select_times(start, end)
    elif orientation_data is not None:
        # Without markers the fit has the times of the orientations.
        data = MarkerData.create_empty(orientation_data.times)
    mechanism = build_mechanism(model)
    stations = find_marker_stations(model, mechanism)
    frames = (
        {}
        if orientation_data is None
        else find_sensor_frames(model, mechanism, orientation_data.names)
    )
    # By default every marker that the model and the data share counts equally.
    marker_weights = {
        name: 1.0 for name in (data.find_shared_names([*stations]) if markers is not None else ())
    }
    sensor_weights = {name: 1.0 for name in frames}
    for name, weight in (weights or {}).items():
        if name not in stations and name not in frames:
            known_names = [*stations, *frames]
            noun = "marker" if not frames else "sensor" if markers is None else "marker or sensor"
            raise SettingError(
                f"'{model.name}' has no {noun} '{name}'{suggest_name(name, known_names)}"
            )
        check_weight(weight, f"'{name}'")
        # A marker and a sensor of one name share the weight.
        for group in (marker_weights, sensor_weights):
            if name in group:
                group[name] = float(weight)
    goals, targets = [], []
    for name, goal in (coordinates or {}).items():
        index = mechanism.coordinate_index(name)
        weight, value = (
            goal if isinstance(goal, tuple) else (goal, mechanism.coordinates[index].default_value)
        )
        check_weight(float(weight), f"the coordinate '{name}'")
        goals.append(CoordinateTarget(index, float(weight)))
        targets.append(float(value))
    # Constant targets, in the form of a table over time.
    rows = np.tile(targets, (len(data.times), 1))
    return fit_motion(
        model,
        mechanism,
        data,
        marker_weights,
        goals,
        rows,
        constraints,
        orientation_data,
        sensor_weights,
    )


def fit_motion(
    model: Model,
    mechanism: Mechanism,
    data: MarkerData,
    weights: Mapping[str, float],
    goals: Sequence[CoordinateTarget],
    targets: Array,
    constraints: bool = True,
    orientations: OrientationData | None = None,
    sensor_weights: Mapping[str, float] | None = None,
) -> FittedMotion:
    """Fit markers, sensors and coordinates of a model.

    Args:
        model: model that has the markers.
        mechanism: mechanism of the model.
        data: measured markers.
        weights: weights of the markers to fit, by name.
        goals: k coordinates with target values.
        targets: target values (t, k), rad or m.
        constraints: whether the constraints of the model hold.
        orientations: measured orientations of sensors; None without sensors.
        sensor_weights: weights of the sensors to fit, by name.

    Returns:
        Motion that fits best in each frame, with the errors of markers and sensors.

    Raises:
        SimulationError: no pose satisfies the constraints.
        SettingError: markers and orientations have different times.
    """
    orientation_data = (
        OrientationData.create_empty(data.times) if orientations is None else orientations
    )
    if (
        data.times.shape != orientation_data.times.shape
        or np.abs(data.times - orientation_data.times).max() > TIME_TOLERANCE_S
    ):
        raise SettingError(
            f"the {format_count(len(data.times), 'frame')} of the markers and the "
            f"{format_count(len(orientation_data.times), 'frame')} of the orientations have different times; "
            "resample one of them"
        )
    if not data.names:
        # Orientations determine no positions.
        mechanism = lock_translations(mechanism)
    names = tuple(weights)
    sensors = find_sensor_frames(model, mechanism, sensor_weights) if sensor_weights else {}
    stations = find_marker_stations(model, mechanism)
    marker_targets = [MarkerTarget(stations[name], weights[name]) for name in names]
    sensor_targets = [
        SensorTarget(frame, (sensor_weights or {})[name]) for name, frame in sensors.items()
    ]
    pose_fit = PoseFit(mechanism, marker_targets, sensor_targets, goals, constraints=constraints)
    marker_positions = data.select_values(names)
    count = len(data.times)
    measurements = marker_positions, orientation_data.select_values([*sensors]), targets
    poses: FittedPoses = pose_fit.fit_frames(
        np.hstack([array.reshape(count, -1) for array in measurements]),
        data.times,
        compute_first_pose(mechanism, float(data.times[0]), constraints),
    )
    # A marker with one missing component counts as unseen.
    is_measured = np.asarray(np.isfinite(marker_positions).all(axis=2))
    undetermined = find_undetermined(
        mechanism,
        poses.values,
        is_measured,
        marker_targets,
        sensor_targets,
        goals,
        constraints=constraints,
    )
    return FittedMotion(
        mechanism,
        data.times,
        poses.values,
        names,
        marker_positions,
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


def check_weight(weight: float, owner: str) -> None:
    """Raise an error for an invalid weight.

    Args:
        weight: weight of a marker, a sensor or a task.
        owner: description of the marker, sensor or task, for the message.

    Raises:
        SettingError: the weight is negative, infinite or NaN.
    """
    # NaN fails this comparison, too.
    if not 0.0 <= weight < np.inf:
        raise SettingError(
            f"the weight {weight:g} of {owner} is invalid; set a number that is not negative"
        )


def lock_translations(mechanism: Mechanism) -> Mechanism:
    """Return a mechanism with all translations locked, as OpenSim fits orientations."""
    infos = tuple(
        replace(info, locked=True) if info.motion_type == "translational" else info
        for info in mechanism.coordinates
    )
    constraints = tuple(
        # Locks and prescribed motions are in the coordinates already.
        constraint
        for constraint in mechanism.constraints
        if not isinstance(constraint, Lock | PrescribedCoordinate)
    )
    return replace(mechanism, coordinates=infos, constraints=constraints)


def compute_first_pose(mechanism: Mechanism, time: float, constraints: bool) -> Array:
    """Return the default pose (n,), in which a fit starts."""
    return mechanism.assemble({}, time) if constraints else mechanism.values({})


def find_marker_stations(model: Model, mechanism: Mechanism) -> dict[str, StationPlacement]:
    """Return body and location of each marker by name; the first of several with one name counts.

    Args:
        model: model that has the markers.
        mechanism: mechanism of the model.

    Returns:
        Stations by name.
    """
    tree = model.tree()
    result = dict[str, StationPlacement]()
    for marker in model.components(ModelMarker):
        placement = mechanism.stations.get(tree.path_of(marker) or "")
        if placement is not None:
            # OpenSim finds the first marker of a name.
            result.setdefault(marker.name, placement)
    return result
