"""The model of a tool in the poses that its tables tell, to some centimetres."""

from __future__ import annotations

import math
from typing import Any

from osimlite.io.tables.headers import StorageHeader
from osimlite.lint.placement import Pose, on_base, poses_at
from osimlite.lint.setup import Setup
from osimlite.lint.subject import Subject, once
from osimlite.lint.table import Table
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.states import motions_of
from osimlite.schema.tree import is_a


def angles_of(setup: Setup) -> set[str]:
    """The coordinates of the model that are angles."""
    joints: Any = [] if setup.tree is None else setup.tree.of_class("Joint").values()
    return {
        name
        for joint in joints
        for name, motion in motions_of(joint).items()
        if motion == "rotational"
    }


def coordinate_of(column: str) -> str:
    """The name of the coordinate whose values a column has."""
    return column.removesuffix("/value").rpartition("/")[2]


@once
def poses_in(setup: Setup, motion: Table, time: float) -> dict[int, Pose]:
    """The pose in ground of each body (by identity), at a time of a motion given as coordinates."""
    angles = angles_of(setup)
    turn = (
        math.pi / 180.0
        if isinstance(motion.header, StorageHeader) and motion.header.in_degrees
        else 1.0
    )
    values = {
        name: value * turn if name in angles else value
        for name, value in zip(
            map(coordinate_of, motion.columns), motion.row_at(time)[1:], strict=False
        )
    }
    return poses_at(model_subject(setup), values)


@once
def marker_places(setup: Setup) -> dict[str, Vector]:
    """Where the markers of the model are in the default pose, in ground, m."""
    model = model_subject(setup)
    poses = poses_at(model, {})
    result: dict[str, Vector] = {}
    # What a set of markers adds has absolute paths.
    added = [item for _, top in setup.added for item in top.walk() if is_a(item, "Marker")]
    for marker in (*model.named("Marker"), *added):
        frame = on_base(
            model, model.tree.walk(str(marker.socket_parent_frame), "/markerset", "Frame").target
        )
        if frame is not None and id(frame[0]) in poses:
            result[marker.name] = poses[id(frame[0])].then(frame[1]).of(marker.location)
    return result


@once
def model_subject(setup: Setup) -> Subject:
    """Return the model that the tool of a setup works on, as rules on models see it."""
    assert setup.tree is not None
    return Subject(setup.tree.model)
