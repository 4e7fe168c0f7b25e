"""Orientation sensors on a model, placed as OpenSim's IMUPlacer does.

A sensor has the name of a frame of the model. Its measurement is the orientation of that frame in
ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import join_words, suggest_name
from osimlite.errors import SettingError
from osimlite.fitting.orientation_data import OrientationData
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.mechanism import FramePlacement, Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array, angles_xyz, rotation_about_space
from osimlite.schema.frames import Body, PhysicalFrame, PhysicalOffsetFrame
from osimlite.schema.markers import IMU
from osimlite.schema.model import Model

SENSOR_SUFFIX = "_imu"
"""Suffix of a sensor's name after the name of the frame on which it is worn."""
AXES = "xyz"
"""Names of the axes."""


class SensorPlacement(NamedTuple):
    """Sensors that were placed on a model."""

    names: tuple[str, ...]  # names of the sensors
    left_out: tuple[str, ...]  # names of sensors without a frame in the model
    # Angle about the vertical by which the data were rotated, so that the base faces where the
    # model does, rad; None without a base.
    heading: float | None


def find_sensor_frames(
    model: Model, mechanism: Mechanism, requested: Iterable[str]
) -> dict[str, FramePlacement]:
    """Return the frames of a model with the names of sensors, in the model's order.

    Args:
        model: model with the frames.
        mechanism: mechanism of the model.
        requested: names of the sensors.

    Returns:
        Frames by name.

    Raises:
        SettingError: no frame has such a name, or several have the same.
    """
    tree = model.tree()
    requested = list(requested)
    result = dict[str, FramePlacement]()
    frames = [(frame.name, tree.path_of(frame) or "") for frame in model.components(PhysicalFrame)]
    for name, path in frames:
        if name in requested:
            if name in result:
                raise SettingError(
                    f"'{model.name}' has several frames '{name}'; the name of a sensor must be "
                    "unique"
                )
            result[name] = mechanism.frames[path]
    if not result:
        suggestion = suggest_name(requested[0], [name for name, _ in frames]) if requested else ""
        raise SettingError(
            f"'{model.name}' has no frame with the name of a sensor ({join_words(requested)}){suggestion}"
        )
    return result


def place_sensors(
    model: Model, data: OrientationData, base: str = "", axis: str = ""
) -> SensorPlacement:
    """Place sensors on a model in its default pose, in which the subject stood.

    The name of a sensor is the name of a frame with the suffix ``_imu``. The sensor becomes an
    offset frame there, in the mass centre of a body, with an IMU; an existing frame of that name is
    rotated.

    Args:
        model: model to which the sensors are added.
        data: orientations of the sensors in ground; only the first frame counts.
        base: sensor whose axis points where the model faces; without it, the data are not rotated.
        axis: axis of `base`: x, y or z, with a minus sign if it points backwards.

    Returns:
        Names of placed and unused sensors, and the heading.

    Raises:
        SettingError: the sensor or axis is unknown, the model has no frame of any sensor, or a
            sensor was not measured.
        SimulationError: the default pose cannot satisfy the constraints.
    """
    mechanism = build_mechanism(model)
    q, _ = mechanism.default_state()
    state = mechanism.at(q)
    rotations = dict(zip(data.names, data.values[0], strict=True))
    heading = None
    if base and axis:
        if base not in rotations:
            raise SettingError(
                f"unknown sensor '{base}' in {data.source}{suggest_name(base, data.names)}"
            )
        faced_direction = _get_axis_direction(rotations[base], axis)
        heading = _compute_heading(
            _find_forward_direction(model, mechanism, state.rotations), faced_direction
        )
        # The vertical is y in OpenSim.
        heading_rotation = rotation_about_space((0.0, heading, 0.0))
        rotations = {name: heading_rotation @ rotation for name, rotation in rotations.items()}
    frames = list(model.components(PhysicalFrame))
    placements = []
    for name, rotation in rotations.items():
        frame_name, ending, _ = name.rpartition(SENSOR_SUFFIX)
        # A sensor without the suffix is not worn on a body.
        carrier_frame = _find_single_frame(frames, frame_name, model) if ending else None
        if carrier_frame is None:
            continue
        if not np.isfinite(rotation).all():
            raise SettingError(
                f"the first frame of {data.source} has no orientation of the sensor '{name}'"
            )
        body, matrix = mechanism.frames[model.tree().path_of(carrier_frame) or ""]
        # Orientation of the sensor in the frame on which it is worn.
        local_rotation = (state.transform(body) @ matrix)[:3, :3].T @ rotation
        placements.append((name, carrier_frame, tuple(angles_xyz(local_rotation).tolist())))
    if not placements:
        example = f"; an example is '{frames[-1].name}{SENSOR_SUFFIX}'" if frames else ""
        raise SettingError(
            f"no sensor of {data.source} ({join_words(data.names)}) has the name of a frame of "
            f"'{model.name}' "
            f"and the suffix '{SENSOR_SUFFIX}'{example}"
        )
    # All sensors are checked before the model is changed.
    for name, carrier_frame, angles in placements:
        sensor_frame = _find_single_frame(
            [frame for frame in frames if isinstance(frame, PhysicalOffsetFrame)], name, model
        )
        if isinstance(sensor_frame, PhysicalOffsetFrame):
            sensor_frame.orientation = angles
            continue
        # OpenSim places the sensor of a body in its mass centre.
        centre = carrier_frame.mass_center if isinstance(carrier_frame, Body) else (0.0, 0.0, 0.0)
        frame = PhysicalOffsetFrame(
            name=name, socket_parent="..", translation=centre, orientation=angles
        )
        carrier_frame.components.append(frame)
        model.add(IMU(name=name, socket_frame=frame))
    names = tuple(name for name, _, _ in placements)
    return SensorPlacement(names, tuple(name for name in data.names if name not in names), heading)


def _find_single_frame(
    frames: Iterable[PhysicalFrame], name: str, model: Model
) -> PhysicalFrame | None:
    """Return the frame of a name, or None.

    Raises:
        SettingError: several frames have the name.
    """
    result = [frame for frame in frames if frame.name == name]
    if len(result) > 1:
        raise SettingError(
            f"'{model.name}' has several frames '{name}'; the frame of a sensor must be unique"
        )
    return result[0] if result else None


def _get_axis_direction(rotation: Array, axis: str) -> Array:
    """Return the direction (3,) of an axis of a sensor.

    Args:
        rotation: rotation matrix (3, 3) of the sensor.
        axis: name of the axis, such as x or -z.

    Raises:
        SettingError: the name of the axis does not end in x, y or z.
    """
    axis_name = axis.lower()
    if axis_name[-1] not in AXES:
        raise SettingError(f"unknown axis '{axis}'; expected x, y, z, -x, -y or -z")
    column: Array = rotation[:, AXES.index(axis_name[-1])]
    return -column if axis_name[0] == "-" else column


def _find_forward_direction(model: Model, mechanism: Mechanism, rotations: Array) -> Array:
    """Return the direction in which a model faces (3,): x of the first joint's body on ground.

    Raises:
        SettingError: no joint of the model has ground as its parent.
    """
    tree = model.tree()
    for joint in model.joint_set.objects:
        end_bodies = [
            mechanism.frames[
                tree.path_of(tree.target(joint, socket, getattr(joint, socket))) or ""
            ].body
            for socket in ("socket_parent_frame", "socket_child_frame")
        ]
        # OpenSim takes the first joint whose parent is ground.
        if end_bodies[0] == GROUND:
            return rotations[end_bodies[1]][:, 0]
    raise SettingError(f"no joint of '{model.name}' has ground as parent; leave out base_imu_label")


def _compute_heading(forwards: Array, faced: Array) -> float:
    """Return the angle about the vertical by which OpenSim rotates data, rad.

    It is the angle between two directions, at most 180°.

    Args:
        forwards: direction in which the model faces (3,).
        faced: direction of the sensor's axis (3,).
    """
    # Rounding may leave the cosine slightly beyond 1.
    angle = math.acos(min(1.0, max(-1.0, float(forwards @ faced))))
    return -angle if float(np.cross(forwards, faced)[1]) > 0.0 else angle
