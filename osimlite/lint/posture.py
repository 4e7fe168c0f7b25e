"""Poses of the model of a tool along its tables, accurate to some centimetres."""

from __future__ import annotations

import math
from typing import Any

from osimlite.io.tables.headers import StorageHeader
from osimlite.lint.placement import FramePose, compute_poses, locate_frame
from osimlite.lint.setup import Setup
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.lint.table import Table
from osimlite.mechanics.laws.vectors import Vector
from osimlite.schema.states import list_motions
from osimlite.schema.tree import is_a


def find_angles(setup: Setup) -> set[str]:
    """Return the names of the coordinates of the model that are angles."""
    joints: Any = [] if setup.tree is None else setup.tree.find_by_class("Joint").values()
    return {
        name
        for joint in joints
        for name, motion in list_motions(joint).items()
        if motion == "rotational"
    }


def coordinate_name(column: str) -> str:
    """Return the name of the coordinate whose values a column has."""
    return column.removesuffix("/value").rpartition("/")[2]


@cache_per_subject
def compute_poses_of_motion(setup: Setup, motion: Table, time: float) -> dict[int, FramePose]:
    """Return the pose in ground of each body at a time of a motion.

    Args:
        setup: setup of a tool.
        motion: table of coordinates.
        time: time of the pose, s.

    Returns:
        Poses by the identity of the body.
    """
    angles = find_angles(setup)
    radians_per_unit = (
        math.pi / 180.0
        if isinstance(motion.header, StorageHeader) and motion.header.in_degrees
        else 1.0
    )
    values = {
        name: value * radians_per_unit if name in angles else value
        for name, value in zip(
            map(coordinate_name, motion.columns), motion.read_row(time)[1:], strict=False
        )
    }
    return compute_poses(make_model_subject(setup), values)


@cache_per_subject
def locate_markers(setup: Setup) -> dict[str, Vector]:
    """Return the positions of the markers in ground in the default pose, m.

    Returns:
        The positions by the names of the markers.
    """
    model = make_model_subject(setup)
    poses = compute_poses(model, {})
    result: dict[str, Vector] = {}
    # Markers that a set adds have absolute paths.
    added = [item for _, top in setup.added_sets for item in top.walk() if is_a(item, "Marker")]
    for marker in (*model.find_by_class("Marker"), *added):
        frame = locate_frame(
            model, model.tree.walk(str(marker.socket_parent_frame), "/markerset", "Frame").target
        )
        if frame is not None and id(frame[0]) in poses:
            result[marker.name] = (
                poses[id(frame[0])].compose(frame[1]).transform_point(marker.location)
            )
    return result


@cache_per_subject
def make_model_subject(setup: Setup) -> Subject:
    """Return the model of the tool of a setup as a check target for rules on models."""
    assert setup.tree is not None
    return Subject(setup.tree.model)
