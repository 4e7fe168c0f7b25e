"""Types of reflexes and the sensors that they use, one declaration each.

The kernels compute the sensors, see :mod:`osimlite.mechanics.kernels.sensors`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.kernels.sensors import SENSOR_PLAN, SOURCE_TYPE
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import SettingNode
from osimlite.studies.reflexes.walkers import SIDES, SensedModel


class Source(NamedTuple):
    """Sensor of a reflex.

    Attributes:
        name: name in records.
        kind: kind of sensor, such as `SOURCE_TYPE.IN_ROW` of the kernels.
        sensor_index: index in the sensor row, or number of a link.
        more: second index in the sensor row, where the kind has one.
        numbers: numbers of the sensor, such as a point and a direction. If there are any, the
            kernels find their offset where `more` would be.
    """

    name: str
    kind: int
    sensor_index: int
    more: int = 0
    numbers: tuple[float, ...] = ()


SourceFactory = Callable[[SensedModel, SettingNode, int, str], Source]
"""Function that makes the sensor of a reflex.

Its arguments are the model, the node of the reflex, the index of the muscle, coordinate or body
that is its `source`, and the side of the reflex ("" for a reflex without a side).
"""


class Channel(NamedTuple):
    """Term of a reflex: gain `K` + letter, offset letter + `0`.

    Attributes:
        letter: letter of the channel, for example `L` for the length of a muscle.
        make_source: function that makes its sensor.
        default_offset: offset without a setting.
        allows_negative: whether the term may be negative without a setting `allow_neg_`; None if
            SCONE has no such setting for it.
    """

    letter: str
    make_source: SourceFactory
    default_offset: float = 0.0
    allows_negative: bool | None = True


class ReflexType(NamedTuple):
    """Class of reflexes in SCONE.

    Attributes:
        names: function that lists the names which a `source` may have, in the order of their
            indices.
        channels: channels whose terms are added.
        corrects: True for gain * (offset - sensor), False for gain * (sensor - offset).
        defaults_to_target: whether the target is the source of a reflex that names no source.
        settings: keys that the sensors of the reflex read.
        refused: keys of SCONE that are not supported.
    """

    names: Callable[[SensedModel], list[str]]
    channels: tuple[Channel, ...]
    corrects: bool = True
    defaults_to_target: bool = False
    settings: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


def _list_muscles(sensed_model: SensedModel) -> list[str]:
    """Return the names of the muscles, in the order of their indices."""
    return sensed_model.names[: len(sensed_model.muscles)]


def _list_coordinates(sensed_model: SensedModel) -> list[str]:
    """Return the names of the coordinates, in the order of their indices."""
    return sensed_model.coordinates


def _list_bodies(sensed_model: SensedModel) -> list[str]:
    """Return the names of the bodies, in the order of their indices."""
    return [body.name for body in sensed_model.mechanism.bodies]


def _select_muscle_factory(quantity: str, offset_index: int) -> SourceFactory:
    """Return the factory of a sensor of muscles.

    Args:
        quantity: quantity for the name of the sensor.
        offset_index: index in `SENSOR_PLAN` of the offset of this quantity in the sensor row.
    """

    def make_source(sensed_model: SensedModel, node: SettingNode, number: int, side: str) -> Source:
        return Source(
            f"{sensed_model.paths[number].removeprefix('/')}.{quantity}",
            SOURCE_TYPE.IN_ROW,
            int(sensed_model.sensor_plan[offset_index]) + number,
        )

    return make_source


def _make_spindle_source(
    sensed_model: SensedModel, node: SettingNode, number: int, side: str
) -> Source:
    """Return the sensor of the firing rate of a muscle's spindles, from fiber length and velocity."""
    length, speed = (
        int(sensed_model.sensor_plan[offset_index]) + number
        for offset_index in (SENSOR_PLAN.LENGTHS, SENSOR_PLAN.VELOCITIES)
    )
    return Source(
        f"{sensed_model.paths[number].removeprefix('/')}.spindle",
        SOURCE_TYPE.SPINDLE,
        length,
        speed,
    )


def select_coordinate_factory(quantity: str, offset_index: int) -> SourceFactory:
    """Return the factory of a sensor of coordinates.

    Args:
        quantity: quantity for the name of the sensor.
        offset_index: index in `SENSOR_PLAN` of the offset of this quantity in the sensor row.
    """

    def make_source(sensed_model: SensedModel, node: SettingNode, number: int, side: str) -> Source:
        return Source(
            f"{sensed_model.coordinates[number]}.{quantity}",
            SOURCE_TYPE.IN_ROW,
            int(sensed_model.sensor_plan[offset_index]) + number,
        )

    return make_source


VALUE_SOURCE = select_coordinate_factory("value", SENSOR_PLAN.VALUES)
"""Factory of sensors of the value of a coordinate (rad or m)."""
SPEED_SOURCE = select_coordinate_factory("speed", SENSOR_PLAN.SPEEDS)
"""Factory of sensors of the speed of a coordinate (rad/s or m/s)."""


def make_load_source(sensed_model: SensedModel, leg: int) -> Source:
    """Return the sensor of the ground reaction force on a leg over the body weight.

    Args:
        sensed_model: model with its legs.
        leg: index of the leg.
    """
    return Source(
        f"leg{sensed_model.legs[leg].side}.load",
        SOURCE_TYPE.IN_ROW,
        int(sensed_model.sensor_plan[SENSOR_PLAN.LOADS]) + leg,
    )


def _format_vectors(*vectors: Array) -> str:
    """Return vectors as text for the name of a sensor; adding 0.0 turns -0 into 0."""
    return "".join(f"({','.join(f'{x + 0.0:.10g}' for x in vector)})" for vector in vectors)


def _select_point_factory(quantity: str, source_type: int) -> SourceFactory:
    """Return the factory of a sensor of a point of a body.

    Args:
        quantity: quantity for the name of the sensor.
        source_type: kind of sensor, `SOURCE_TYPE.POSITION` or `SOURCE_TYPE.VELOCITY`.
    """

    def make_source(sensed_model: SensedModel, node: SettingNode, number: int, side: str) -> Source:
        """Return the sensor of the position or velocity of a point along a direction."""
        offset = node.vector("offset", "0 0 0")
        direction = node.vector("direction")
        if not direction.any():
            raise node.error("'direction' is 0 0 0; set a direction other than zero")
        # The offset is in the frame of the body, the kernels know its link only.
        link, frame = sensed_model.engine.placements[number]
        numbers = *(frame[:3, :3] @ offset + frame[:3, 3]), *direction
        return Source(
            f"{_list_bodies(sensed_model)[number]}.{quantity}{_format_vectors(offset, direction)}",
            source_type,
            link,
            0,
            numbers,
        )

    return make_source


def _read_axis(sensed_model: SensedModel, node: SettingNode, number: int, side: str) -> Array:
    """Return the unit vector (3,) of a reflex on the rotation of a body.

    On the left side x and y change sign, so that one setting serves both sides: a mirror image in
    the sagittal plane reverses rotations about x and y and keeps those about z.
    """
    node.refuse_flags("reflexes", ("use_rotation_vector",))
    axis = node.vector("axis", "0 0 1")
    if not axis.any():
        raise node.error("'axis' is 0 0 0; set an axis other than zero")
    # A body with a side counts as of this side, else the side of the reflex decides.
    body_side = next(
        (end for end in SIDES if _list_bodies(sensed_model)[number].endswith(end)), side
    )
    return (
        axis
        / np.linalg.norm(axis)
        * ((-1.0, -1.0, 1.0) if body_side == SIDES[0] else (1.0, 1.0, 1.0))
    )


def _make_angle_source(
    sensed_model: SensedModel, node: SettingNode, number: int, side: str
) -> Source:
    """Return the sensor of the rotation of a body about one of the axes x, y and z of ground."""
    axis, (link, frame) = (
        _read_axis(sensed_model, node, number, side),
        sensed_model.engine.placements[number],
    )
    # A rotation about a general axis has no angle that is a function of the orientation alone.
    if np.count_nonzero(axis) != 1:
        raise node.error(
            "a reflex to an angle needs the 'axis' [ 1 0 0 ], [ 0 1 0 ] or [ 0 0 1 ]; for another axis, only KV is supported"
        )
    name = f"{_list_bodies(sensed_model)[number]}.angle{_format_vectors(axis)}"
    return Source(name, SOURCE_TYPE.ANGLE, link, 0, (*np.ravel(frame[:3, :3].T), *axis))


def _make_angular_velocity_source(
    sensed_model: SensedModel, node: SettingNode, number: int, side: str
) -> Source:
    """Return the sensor of the angular velocity of a body about an axis."""
    axis, (link, frame) = (
        _read_axis(sensed_model, node, number, side),
        sensed_model.engine.placements[number],
    )
    return Source(
        f"{_list_bodies(sensed_model)[number]}.turn{_format_vectors(axis)}",
        SOURCE_TYPE.TURN,
        link,
        0,
        # The axis is in the frame of the body, the kernels know its link only.
        tuple(frame[:3, :3] @ axis),
    )


_MUSCLE_CHANNELS = (
    Channel("L", _select_muscle_factory("length", SENSOR_PLAN.LENGTHS), 1.0),
    Channel("V", _select_muscle_factory("velocity", SENSOR_PLAN.VELOCITIES), allows_negative=False),
    Channel("F", _select_muscle_factory("force", SENSOR_PLAN.FORCES)),
    Channel("S", _make_spindle_source, allows_negative=False),
    Channel(
        "A", _select_muscle_factory("activation", SENSOR_PLAN.ACTIVATIONS), allows_negative=False
    ),
)
"""Channels of reflexes on muscles: length, velocity, force, spindle rate and activation.

Offsets, and whether a term may be negative, are as in SCONE by default.
"""
REFLEX_TYPES = {
    "MuscleReflex": ReflexType(
        _list_muscles, _MUSCLE_CHANNELS, corrects=False, defaults_to_target=True
    ),
    "ConditionalMuscleReflex": ReflexType(
        _list_muscles, _MUSCLE_CHANNELS, corrects=False, defaults_to_target=True
    ),
    "DofReflex": ReflexType(
        _list_coordinates,
        (Channel("P", VALUE_SOURCE), Channel("V", SPEED_SOURCE)),
        refused=(
            "source_parent",
            "mirror_left",
            "KA",
            "condition",
            "filter_cutoff_frequency",
            "P0_source",
        ),
    ),
    "BodyPointReflex": ReflexType(
        _list_bodies,
        (
            Channel(
                "P", _select_point_factory("position", SOURCE_TYPE.POSITION), allows_negative=None
            ),
            Channel(
                "V", _select_point_factory("speed", SOURCE_TYPE.VELOCITY), allows_negative=None
            ),
        ),
        settings=("offset", "direction"),
        refused=("KA",),
    ),
    "BodyOrientationReflex": ReflexType(
        _list_bodies,
        (Channel("P", _make_angle_source), Channel("V", _make_angular_velocity_source)),
        settings=("axis", "axis_name", "use_rotation_vector"),
    ),
}
"""Supported types of reflexes by SCONE's names."""
