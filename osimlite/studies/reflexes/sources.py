"""What reflexes feel: each kind of reflex, and of what it goes by, is one declaration here.

The kernels compute the sources, see :mod:`osimlite.mechanics.kernels.sensors`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from osimlite.mechanics.kernels.sensors import (
    ANGLE,
    IN_ROW,
    POSITION,
    SENSES,
    SPINDLE,
    TURN,
    VELOCITY,
)
from osimlite.mechanics.multibody.spatial import Array
from osimlite.studies.reflexes.settings import Node
from osimlite.studies.reflexes.walkers import SIDES, Felt


class Source(NamedTuple):
    """What is felt of a model.

    Attributes:
        name: in records.
        kind, place, more: as of `SOURCE` in the kernels.
        numbers: instead of `more`, where they will be.
    """

    name: str
    kind: int
    place: int
    more: int = 0
    numbers: tuple[float, ...] = ()


Feel = Callable[[Felt, Node, int, str], Source]
"""Makes the source of a reflex: for a model, from what is written, the number of what has the name
that is the `source`, and the side that the reflex is on, if any.
"""


class Channel(NamedTuple):
    """A part of a reflex: ``K`` and a letter are its gain, the letter and ``0`` its offset.

    Attributes:
        letter: of it.
        feel: makes the source.
        rest: offset without a setting.
        is_free: whether it may be negative without a setting; None where there is no setting for
            that.
    """

    letter: str
    feel: Feel
    rest: float = 0.0
    is_free: bool | None = True


class Kind(NamedTuple):
    """A kind of reflexes.

    Attributes:
        names: what a source is called, in the order of its numbers.
        channels: which are added up.
        corrects: whether it is a gain times what is missing to the offset, instead of what is
            beyond it.
        is_own: whether without a source the target is that.
        settings: of the sources.
        refused: settings of SCONE that are not done here.
    """

    names: Callable[[Felt], list[str]]
    channels: tuple[Channel, ...]
    corrects: bool = True
    is_own: bool = False
    settings: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


def _list_muscles(felt: Felt) -> list[str]:
    return felt.names[: len(felt.muscles)]


def _list_coordinates(felt: Felt) -> list[str]:
    return felt.coordinates


def _list_bodies(felt: Felt) -> list[str]:
    return [body.name for body in felt.mechanism.bodies]


def _read_muscle(what: str, first: int) -> Feel:
    def feel(felt: Felt, node: Node, number: int, side: str) -> Source:
        return Source(
            f"{felt.paths[number].removeprefix('/')}.{what}",
            IN_ROW,
            int(felt.senses[first]) + number,
        )

    return feel


def _spindle(felt: Felt, node: Node, number: int, side: str) -> Source:
    length, speed = (
        int(felt.senses[first]) + number for first in (SENSES.LENGTHS, SENSES.VELOCITIES)
    )
    return Source(f"{felt.paths[number].removeprefix('/')}.spindle", SPINDLE, length, speed)


def coordinate(what: str, first: int) -> Feel:
    """Of a coordinate a number of the row."""

    def feel(felt: Felt, node: Node, number: int, side: str) -> Source:
        return Source(
            f"{felt.coordinates[number]}.{what}", IN_ROW, int(felt.senses[first]) + number
        )

    return feel


VALUE, SPEED = coordinate("value", SENSES.VALUES), coordinate("speed", SENSES.SPEEDS)


def load(felt: Felt, leg: int) -> Source:
    """Of the ground on a leg."""
    return Source(f"leg{felt.legs[leg].side}.load", IN_ROW, int(felt.senses[SENSES.LOADS]) + leg)


def _describe(*vectors: Array) -> str:
    return "".join(f"({','.join(f'{x + 0.0:.10g}' for x in vector)})" for vector in vectors)


def _point(what: str, kind: int) -> Feel:
    def feel(felt: Felt, node: Node, number: int, side: str) -> Source:
        offset, direction = node.vector("offset", "0 0 0"), node.vector("direction")
        if not direction.any():
            raise node.error("'direction' is 0 0 0, along which nothing is felt")
        link, frame = felt.engine.placements[number]
        numbers = *(frame[:3, :3] @ offset + frame[:3, 3]), *direction
        return Source(
            f"{_list_bodies(felt)[number]}.{what}{_describe(offset, direction)}",
            kind,
            link,
            0,
            numbers,
        )

    return feel


def _axis(felt: Felt, node: Node, number: int, side: str) -> Array:
    """About which a body turns; on the left that of the mirrored motion."""
    if node.flag("use_rotation_vector", False):
        raise node.error("'use_rotation_vector' of reflexes is not done here")
    axis = node.vector("axis", "0 0 1")
    if not axis.any():
        raise node.error("'axis' has no direction")
    own = next((end for end in SIDES if _list_bodies(felt)[number].endswith(end)), side)
    return axis / np.linalg.norm(axis) * ((-1.0, -1.0, 1.0) if own == SIDES[0] else (1.0, 1.0, 1.0))


def _angle(felt: Felt, node: Node, number: int, side: str) -> Source:
    axis, (link, frame) = _axis(felt, node, number, side), felt.engine.placements[number]
    if np.count_nonzero(axis) != 1:
        raise node.error(
            "angles are about [ 1 0 0 ], [ 0 1 0 ] or [ 0 0 1 ]; about another 'axis' there is only KV"
        )
    name = f"{_list_bodies(felt)[number]}.angle{_describe(axis)}"
    return Source(name, ANGLE, link, 0, (*np.ravel(frame[:3, :3].T), *axis))


def _mirror_axis(felt: Felt, node: Node, number: int, side: str) -> Source:
    axis, (link, frame) = _axis(felt, node, number, side), felt.engine.placements[number]
    return Source(
        f"{_list_bodies(felt)[number]}.turn{_describe(axis)}",
        TURN,
        link,
        0,
        tuple(frame[:3, :3] @ axis),
    )


_OF_MUSCLES = (
    Channel("L", _read_muscle("length", SENSES.LENGTHS), 1.0),
    Channel("V", _read_muscle("velocity", SENSES.VELOCITIES), is_free=False),
    Channel("F", _read_muscle("force", SENSES.FORCES)),
    Channel("S", _spindle, is_free=False),
    Channel("A", _read_muscle("activation", SENSES.ACTIVATIONS), is_free=False),
)
KINDS = {
    "MuscleReflex": Kind(_list_muscles, _OF_MUSCLES, corrects=False, is_own=True),
    "ConditionalMuscleReflex": Kind(_list_muscles, _OF_MUSCLES, corrects=False, is_own=True),
    "DofReflex": Kind(
        _list_coordinates,
        (Channel("P", VALUE), Channel("V", SPEED)),
        refused=(
            "source_parent",
            "mirror_left",
            "KA",
            "condition",
            "filter_cutoff_frequency",
            "P0_source",
        ),
    ),
    "BodyPointReflex": Kind(
        _list_bodies,
        (
            Channel("P", _point("position", POSITION), is_free=None),
            Channel("V", _point("speed", VELOCITY), is_free=None),
        ),
        settings=("offset", "direction"),
        refused=("KA",),
    ),
    "BodyOrientationReflex": Kind(
        _list_bodies,
        (Channel("P", _angle), Channel("V", _mirror_axis)),
        settings=("axis", "axis_name", "use_rotation_vector"),
    ),
}
"""Of reflexes, by SCONE's names."""
