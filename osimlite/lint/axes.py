"""Coordinates on the axes of a CustomJoint, and the treatment of unknown names in OpenSim 4.6."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.tree import ILLEGAL_CHARACTERS

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint, TransformAxis
    from osimlite.schema.joints import Joint


def list_axes(joint: CustomJoint) -> list[TransformAxis]:
    """Return the six axes in order: three rotations, three translations."""
    return [*joint.spatial_transform.axes().values()]


def list_coordinates(joint: Joint) -> list[Coordinate]:
    """Return the coordinates that a joint declares; OpenSim ignores other objects among them."""
    return [item for item in joint.coordinates if isinstance(item, Coordinate)]


def list_axis_names(joint: CustomJoint) -> list[str]:
    """Return the coordinates that the axes name, in the order of their first use."""
    return list(dict.fromkeys(name for axis in list_axes(joint) for name in axis.names))


def refuses_axes(joint: CustomJoint) -> bool:
    """Return whether OpenSim rejects the joint because of the coordinates that its axes name.

    OpenSim goes through the names in the order of :func:`list_axis_names`, and creates a coordinate
    for each name that the joint does not declare. It fails in three cases: a created coordinate
    does not come right after the declared ones; no axis names any coordinate; or declared
    coordinates would have to change their order while their number differs from that of the names.
    (Measured on 1,200 random joints.) OpenSim also rejects a name that no component may have, and
    the name of a frame of the joint: it then renames the frame and does not find it.
    """
    # OpenSim has renamed the second coordinate of a name before, so that no axis names it.
    declared: list[str] = []
    for coordinate in list_coordinates(joint):
        declared.append(
            coordinate.name
            if coordinate.name not in declared
            else f"{coordinate.name}_{len(declared)}/"
        )
    names = list_axis_names(joint)
    if any(frame.name in names and frame.name not in declared for frame in joint.frames):
        # The created coordinate takes the name of the frame.
        return True
    if not names:
        return bool(declared)
    existing_names = list(declared)
    for index, name in enumerate(names):
        if name not in existing_names:
            if len(existing_names) != index or any(
                character in name for character in ILLEGAL_CHARACTERS
            ):
                return True
            existing_names.append(name)
    is_reordered = any(
        names.index(name) != index for index, name in enumerate(declared) if name in names
    )
    return is_reordered and len(declared) != len(names)


@cache_per_subject
def find_made_up_paths(subject: Subject) -> set[str]:
    """Return the paths of the coordinates that OpenSim creates because only an axis names them."""
    return {
        f"{subject.path(joint)}/{name}"
        for joint in subject.find_by_class("CustomJoint")
        if not refuses_axes(joint)
        for name in set(list_axis_names(joint))
        - {coordinate.name for coordinate in list_coordinates(joint)}
    }
