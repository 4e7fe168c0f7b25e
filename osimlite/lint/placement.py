"""Positions of bodies in a pose, as far as they can be computed without numpy.

The linter does not require numpy. Some positions are therefore unknown: those of joints along a
smoothing spline or with a motion that only their class defines, and of everything beyond another
joint, a prescribed coordinate or a frame through stations. Constraints, which may move the model
when it is assembled, are ignored.

Where centimetres do not matter, smoothing splines are replaced by straight lines between their
points, and prescribed coordinates have the values of the caller.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from osimlite.base.named_tuples import NamedTuple
from osimlite.errors import OsimliteError
from osimlite.lint.axes import list_axes, list_coordinates
from osimlite.lint.skeleton import build_skeleton
from osimlite.lint.subject import Subject, cache_per_subject
from osimlite.mechanics.laws.rotations import (
    Axes,
    X,
    Y,
    Z,
    combine_axes,
    multiply_rotations,
    rotation_about_axis,
    rotation_from_xyz,
    transpose_rotation,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    add_scaled,
    divide,
    multiply_elementwise,
    norm,
    plus,
    times,
)
from osimlite.schema.base import Component, Unknown
from osimlite.schema.frames import Body, Ground, PhysicalOffsetFrame
from osimlite.schema.functions import Constant
from osimlite.schema.joints import Joint
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.functions import SmoothFunction
    from osimlite.schema.custom_joint import CustomJoint, TransformAxis
    from osimlite.schema.joint_types import EllipsoidJoint


class FramePose(NamedTuple):
    """Pose of a frame in another: its axes, and its origin (m)."""

    axes: Axes = (X, Y, Z)
    position: Vector = ZERO

    def rotate(self, vector: Vector) -> Vector:
        """Rotate a vector of the inner frame into the outer frame.

        Returns:
            The vector in the outer frame.
        """
        return combine_axes(self.axes, vector)

    def transform_point(self, point: Vector) -> Vector:
        """Transform a point of the inner frame to the outer frame.

        Returns:
            The point in the outer frame.
        """
        return plus(combine_axes(self.axes, point), self.position)

    def compose(self, inner: FramePose) -> FramePose:
        """Return a frame inside this one, relative to the outer frame."""
        return FramePose(
            multiply_rotations(self.axes, inner.axes), self.transform_point(inner.position)
        )

    def inverse(self) -> FramePose:
        """Return the pose of the outer frame in the inner one."""
        back = transpose_rotation(self.axes)
        return FramePose(back, times(-1.0, combine_axes(back, self.position)))


FrameLocation = tuple[Component, FramePose] | None
"""Body or ground to which a frame is fixed, and the pose of the frame in it."""


def make_offset(angles: Vector, position: Vector) -> FramePose:
    """Return the pose of a frame with an offset and body-fixed X-Y-Z angles.

    Args:
        angles: body-fixed X-Y-Z angles, rad.
        position: offset, m.
    """
    (s1, c1), (s2, c2), (s3, c3) = map(_sine_cosine, angles)
    return FramePose(rotation_from_xyz(s1, c1, s2, c2, s3, c3), position)


def _sine_cosine(angle: float) -> tuple[float, float]:
    return (math.sin(angle), math.cos(angle)) if math.isfinite(angle) else (math.nan, math.nan)


def locate_frame(subject: Subject, frame: Component | None) -> FrameLocation:
    """Return the body or ground that a frame is fixed to, and its pose there; None if unknown.

    Args:
        subject: check target with the model.
        frame: frame of the model; None if it is unknown.
    """
    pose = FramePose()
    depth = 0
    # The bound ends a chain of frames that forms a loop.
    while isinstance(frame, PhysicalOffsetFrame) and depth < 100:
        pose = make_offset(frame.orientation, frame.translation).compose(pose)
        frame = subject.target_of(frame, "socket_parent")
        depth += 1
    return (frame, pose) if isinstance(frame, (Body, Ground)) else None


@cache_per_subject
def compute_default_poses(subject: Subject) -> dict[int, FramePose]:
    """Return the default pose in ground of each body that can be located.

    Returns:
        The poses by the identity of the body.
    """
    return compute_poses(subject)


@cache_per_subject
def _locate_joint_frames(subject: Subject) -> dict[int, tuple[FrameLocation, FrameLocation]]:
    """Return the locations of parent and child frame of each joint, by its identity."""
    links = build_skeleton(subject).links
    return {
        id(link.joint): (locate_frame(subject, link.parent), locate_frame(subject, link.child))
        for link in links
    }


def compute_poses(
    subject: Subject, values: Mapping[str, float] | None = None
) -> dict[int, FramePose]:
    """Return the pose in ground of each body that can be located, by its identity.

    Args:
        subject: check target with the model.
        values: values of coordinates, rad or m; the others have their defaults. With values,
            positions may be off by some centimetres.

    Returns:
        The poses by the identity of the body.
    """
    bones = build_skeleton(subject)
    ends = _locate_joint_frames(subject)
    motions = _find_joint_motions(subject, values is not None)
    poses: dict[int, FramePose] = {id(bones.ground): FramePose()}
    pending: list[Component] = [bones.ground]
    # Breadth first from ground, as in the assembly of the tree of joints.
    while pending:
        base = pending.pop(0)
        # Either the parent or the child of a joint may be the known end, and either may be located
        # first.
        for link in bones.find_joints(base):
            parent, child = ends[id(link.joint)]
            if (
                parent is None
                or child is None
                or (id(parent[0]) in poses and id(child[0]) in poses)
            ):
                continue
            if id(link.joint) not in motions or any(
                isinstance(item, Unknown) or (item.prescribed and values is None)
                for item in link.joint.coordinates
            ):
                continue
            joint_pose = (
                parent[1]
                .compose(_compute_joint_pose(link.joint, motions[id(link.joint)], values))
                .compose(child[1].inverse())
            )
            # A joint whose child is known is passed backwards, by the inverse of its transform.
            next_base, step = (
                (child[0], joint_pose) if parent[0] is base else (parent[0], joint_pose.inverse())
            )
            poses[id(next_base)] = poses[id(base)].compose(step)
            pending.append(next_base)
    return poses


class _JointMotion(NamedTuple):
    """Rotation or translation of a joint by a function of coordinates; None is the coordinate itself."""

    is_rotation: bool
    axis: Vector  # a unit vector, or zeros
    names: list[str]
    function: SmoothFunction | None = None

    def amount(self, values: Mapping[str, float]) -> float:
        """Return the rotation or translation along this axis (rad or m)."""
        arguments = [values.get(name, 0.0) for name in self.names]
        return arguments[0] if self.function is None else self.function.evaluate(arguments)[0]


@cache_per_subject
def _find_joint_motions(subject: Subject, rough: bool) -> dict[int, list[_JointMotion]]:
    """Return the motions of the joints with known functions, by identity; later axes are rotated by earlier ones."""
    result: dict[int, list[_JointMotion]] = {}
    for link in build_skeleton(subject).links:
        joint = link.joint
        names = [item.name for item in link.joint.coordinates]
        # The first three of the six axes of a CustomJoint rotate, the others translate.
        if is_a(joint, "CustomJoint"):
            axes = [*enumerate(list_axes(cast("CustomJoint", joint)))]
            functions = [_make_function(axis, rough) for _, axis in axes]
            defined_functions = [function for function in functions if function is not None]
            if len(defined_functions) == len(axes):
                result[id(joint)] = [
                    _JointMotion(
                        index < 3,
                        # OpenSim normalizes axes; a zero axis stays zero.
                        divide(axis.axis, norm(axis.axis) or 1.0),
                        [] if isinstance(axis.function, Constant) else axis.names,
                        function,
                    )
                    for (index, axis), function in zip(axes, defined_functions, strict=True)
                ]
        elif (
            joint.coordinate_motions is not None
            and len(words := joint.coordinate_motions.split()) == len(names)
            # "r" is a rotation whose axis depends on the properties of the joint.
            and "r" not in words
        ):
            result[id(joint)] = [
                _JointMotion(word[0] == "r", (X, Y, Z)["xyz".index(word[1])], [name])
                for word, name in zip(words, names, strict=True)
            ]
    return result


def _make_function(axis: TransformAxis, rough: bool) -> SmoothFunction | None:
    """Return the function of an axis; None if it is not known."""
    # Imported here, since the rules that do not place bodies run without this module.
    from osimlite.mechanics.multibody.schema_functions import convert_function

    function: Any = axis.function
    if function is not None and is_a(function, "GCVSpline"):
        from osimlite.schema.splines import PiecewiseLinearFunction

        function = (
            PiecewiseLinearFunction.build({"x": function.x, "y": function.y}, set())
            if rough
            else None
        )
    count = len(axis.coordinates)
    # OpenSim's curves are functions of one argument, while polynomials and products may have more.
    try:
        # Of several coordinates, which should not be, a curve takes the first.
        takes_one = function is not None and (
            is_a(function, "SimmSpline") or is_a(function, "PiecewiseLinearFunction")
        )
        return convert_function(function, min(count, 1) if takes_one else count, axis.name)
    except OsimliteError:
        return None


def _compute_joint_pose(
    joint: Joint, motions: list[_JointMotion], values_by_name: Mapping[str, float] | None
) -> FramePose:
    """Return the pose of the child frame of a joint in its parent frame."""
    values = {
        item.name: (values_by_name or {}).get(item.name, item.default_value)
        for item in joint.coordinates
    }
    axes = (X, Y, Z)
    position = ZERO
    for motion in motions:
        amount = motion.amount(values)
        if motion.is_rotation and amount:
            axes = multiply_rotations(axes, rotation_about_axis(motion.axis, *_sine_cosine(amount)))
        elif amount:
            position = add_scaled(position, amount, motion.axis)
    # OpenSim places the child on the ellipsoid where the rotated z axis points.
    if is_a(joint, "EllipsoidJoint"):
        position = multiply_elementwise(cast("EllipsoidJoint", joint).radii_x_y_z, axes[2])
    return FramePose(axes, position)


def find_rotation_axes(subject: Subject, joint: Joint) -> list[tuple[str, Vector]]:
    """Return the rotation axes of a gimbal or custom joint in the default pose.

    Args:
        subject: check target with the model.
        joint: joint of the model.

    Returns:
        The coordinate of each rotation and its axis, a unit vector in the parent frame. Empty for a
        joint of another class, and where a rotation does not follow exactly one coordinate or
        cannot be computed.
    """
    values = {item.name: item.default_value for item in list_coordinates(joint)}
    result: dict[str, Vector] = {}
    axes = X, Y, Z
    for motion in _find_joint_motions(subject, False).get(id(joint), []):
        if not motion.is_rotation or len(motion.names) != 1:
            continue
        # Without a direction neither this rotation nor the following ones can be computed.
        if motion.names[0] not in values or motion.axis == ZERO:
            return []
        result[motion.names[0]] = combine_axes(axes, motion.axis)
        # Each rotation is about an axis that all earlier rotations have turned.
        axes = multiply_rotations(
            axes, rotation_about_axis(motion.axis, *_sine_cosine(motion.amount(values)))
        )
    return list(result.items()) if is_a(joint, "GimbalJoint") or is_a(joint, "CustomJoint") else []
