"""Orientation sensors on a model: the frames that stand for them, and where these are put, as OpenSim's IMUPlacer does.

A sensor has the name of a frame of the model. What is measured of it is how its axes lie in ground.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

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

ENDING = "_imu"
"""What the name of a sensor has behind that of the frame that it is worn on."""
AXES = "xyz"


class PlacedSensors(NamedTuple):
    """Sensors that were put onto a model."""

    names: tuple[str, ...]  # of the sensors
    left_out: tuple[str, ...]  # names of those of the data for which the model has no frame
    # angle about the vertical by which the data were turned so that the base faces where the model
    # does (rad), None if they were not
    heading: float | None


def sensor_frames(
    model: Model, mechanism: Mechanism, wanted: Iterable[str]
) -> dict[str, FramePlacement]:
    """The frames of a model that have wanted names, in the model's order.

    Raises:
        SettingError: there are none, or several of one name.
    """
    tree, wanted, result = model.tree(), list(wanted), dict[str, FramePlacement]()
    frames = [(frame.name, tree.path_of(frame) or "") for frame in model.components(PhysicalFrame)]
    for name, path in frames:
        if name in wanted:
            if name in result:
                raise SettingError(
                    f"'{model.name}' has several frames '{name}'; a sensor has the name of one"
                )
            result[name] = mechanism.frames[path]
    if not result:
        near = suggest_name(wanted[0], [name for name, _ in frames]) if wanted else ""
        raise SettingError(
            f"'{model.name}' has no frame that is called as a sensor ({join_words(wanted)}){near}"
        )
    return result


def place_sensors(
    model: Model, data: OrientationData, base: str = "", axis: str = ""
) -> PlacedSensors:
    """Put sensors onto a model in the pose in which the subject stood, its default one.

    The sensor of a frame is called as the frame with ``_imu`` behind. It becomes a frame there, in
    the mass centre of a body, with an IMU; where there is such a frame already, that is turned.

    Args: model: is changed. data: orientations of the sensors in ground, of which the first frame
        counts. base: the sensor whose axis points where the model faces; if left out, the data are
        not turned. axis: that axis: x, y or z, with a minus sign if it points back.

    Raises: SettingError: there is no such sensor or axis, the model has no frame of any sensor, or
        one was not measured. SimulationError: the default pose cannot keep the constraints.
    """
    mechanism = build_mechanism(model)
    q, _ = mechanism.default_state()
    state = mechanism.at(q)
    measured = dict(zip(data.names, data.values[0], strict=True))
    heading = None
    if base and axis:
        if base not in measured:
            raise SettingError(
                f"there is no sensor '{base}' in {data.source}{suggest_name(base, data.names)}"
            )
        faced = _axis_of(measured[base], axis)
        heading = _heading(_forwards(model, mechanism, state.rotations), faced)
        turn = rotation_about_space((0.0, heading, 0.0))
        measured = {name: turn @ rotation for name, rotation in measured.items()}
    frames, placed = list(model.components(PhysicalFrame)), []
    for name, rotation in measured.items():
        owner, ending, _ = name.rpartition(ENDING)
        worn = _only_one(frames, owner, model) if ending else None
        if worn is None:
            continue
        if not np.isfinite(rotation).all():
            raise SettingError(
                f"{data.source} does not say in its first frame how the sensor '{name}' is turned"
            )
        body, matrix = mechanism.frames[model.tree().path_of(worn) or ""]
        inside = (state.transform(body) @ matrix)[:3, :3].T @ rotation
        placed.append((name, worn, tuple(angles_xyz(inside).tolist())))
    if not placed:
        example = f", as '{frames[-1].name}{ENDING}' is" if frames else ""
        raise SettingError(
            f"no sensor of {data.source} ({join_words(data.names)}) is called as a frame of '{model.name}' with '{ENDING}' "
            f"behind{example}"
        )
    for name, worn, angles in placed:
        there = _only_one(
            [frame for frame in frames if isinstance(frame, PhysicalOffsetFrame)], name, model
        )
        if isinstance(there, PhysicalOffsetFrame):
            there.orientation = angles
            continue
        centre = worn.mass_center if isinstance(worn, Body) else (0.0, 0.0, 0.0)
        frame = PhysicalOffsetFrame(
            name=name, socket_parent="..", translation=centre, orientation=angles
        )
        worn.components.append(frame)
        model.add(IMU(name=name, socket_frame=frame))
    names = tuple(name for name, _, _ in placed)
    return PlacedSensors(names, tuple(name for name in data.names if name not in names), heading)


def _only_one(frames: Iterable[PhysicalFrame], name: str, model: Model) -> PhysicalFrame | None:
    """The frame of a name, if there is one."""
    result = [frame for frame in frames if frame.name == name]
    if len(result) > 1:
        raise SettingError(f"'{model.name}' has several frames '{name}'; a sensor is worn on one")
    return result[0] if result else None


def _axis_of(rotation: Array, axis: str) -> Array:
    """Where an axis of a sensor points (3,)."""
    word = axis.lower()
    if word[-1] not in AXES:
        raise SettingError(f"the axis '{axis}' is none; give x, y, z, -x, -y or -z")
    column: Array = rotation[:, AXES.index(word[-1])]
    return -column if word[0] == "-" else column


def _forwards(model: Model, mechanism: Mechanism, rotations: Array) -> Array:
    """Where a model faces (3,): the x axis of the body of the first joint on ground."""
    tree = model.tree()
    for joint in model.joint_set.objects:
        ends = [
            mechanism.frames[
                tree.path_of(tree.target(joint, socket, getattr(joint, socket))) or ""
            ].body
            for socket in ("socket_parent_frame", "socket_child_frame")
        ]
        if ends[0] == GROUND:
            return rotations[ends[1]][:, 0]
    raise SettingError(f"no joint of '{model.name}' begins at ground; leave out base_imu_label")


def _heading(forwards: Array, faced: Array) -> float:
    """The angle about the vertical that OpenSim turns data by (rad): that between two directions, at most 180°."""
    angle = math.acos(min(1.0, max(-1.0, float(forwards @ faced))))
    return -angle if float(np.cross(forwards, faced)[1]) > 0.0 else angle
