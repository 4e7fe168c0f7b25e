"""Where bodies are in a pose, as far as it can be told without the numeric library.

That is not needed to validate. So what takes it has no known place: a joint along a smoothing
spline, and one whose motion is a rule of its class; and what hangs on another joint, on a
prescribed coordinate or on a frame laid through stations. Constraints, which may move the model
when it is assembled, are left out.

Where centimetres do not matter, smoothing splines are taken for straight lines between their
points, and prescribed coordinates have the values they are given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from osimlite.errors import OsimliteError
from osimlite.lint.axes import axes_of, coordinates_of
from osimlite.lint.skeleton import skeleton
from osimlite.lint.subject import Subject, once
from osimlite.mechanics.laws.rotations import (
    Axes,
    X,
    Y,
    Z,
    about_axis,
    along_axes,
    body_fixed,
    transposed,
    turned_axes,
)
from osimlite.mechanics.laws.vectors import (
    ZERO,
    Vector,
    along,
    elementwise,
    norm,
    over,
    plus,
    times,
)
from osimlite.schema.base import Component, Unknown
from osimlite.schema.frames import Body, Ground, PhysicalOffsetFrame
from osimlite.schema.functions import Constant, GCVSpline, PiecewiseLinearFunction, SimmSpline
from osimlite.schema.joints import EllipsoidJoint, GimbalJoint, Joint
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.functions import Function
    from osimlite.schema.custom_joint import CustomJoint, TransformAxis


class Pose(NamedTuple):
    """A frame in another: its axes, and its origin (m)."""

    axes: Axes = (X, Y, Z)
    position: Vector = ZERO

    def turned(self, vector: Vector) -> Vector:
        """A vector of the inner frame, expressed in the outer one."""
        return along_axes(self.axes, vector)

    def of(self, point: Vector) -> Vector:
        """A point of the inner frame, in the outer one."""
        return plus(along_axes(self.axes, point), self.position)

    def then(self, inner: Pose) -> Pose:
        """A frame within this one, seen from outside."""
        return Pose(turned_axes(self.axes, inner.axes), self.of(inner.position))

    def inverse(self) -> Pose:
        """The outer frame, seen from the inner one."""
        back = transposed(self.axes)
        return Pose(back, times(-1.0, along_axes(back, self.position)))


End = tuple[Component, Pose] | None
"""The body or ground that a frame is fixed to, and where it is on it."""


def fixed(angles: Vector, position: Vector) -> Pose:
    """A frame displaced, and turned by body-fixed X-Y-Z angles."""
    (s1, c1), (s2, c2), (s3, c3) = map(_sine_cosine, angles)
    return Pose(body_fixed(s1, c1, s2, c2, s3, c3), position)


def _sine_cosine(angle: float) -> tuple[float, float]:
    return (math.sin(angle), math.cos(angle)) if math.isfinite(angle) else (math.nan, math.nan)


def on_base(subject: Subject, frame: Component | None) -> End:
    """The body or ground that a frame is fixed to, and where it is on it; None if that is not known."""
    pose, seen = Pose(), 0
    while isinstance(frame, PhysicalOffsetFrame) and seen < 100:
        pose = fixed(frame.orientation, frame.translation).then(pose)
        frame, seen = subject.target_of(frame, "socket_parent"), seen + 1
    return (frame, pose) if isinstance(frame, (Body, Ground)) else None


@once
def default_poses(subject: Subject) -> dict[int, Pose]:
    """The pose in ground of each body (by identity) whose place is known."""
    return poses_at(subject)


@once
def _ends(subject: Subject) -> dict[int, tuple[End, End]]:
    """Where the frames of the joints are, by the identities of these."""
    links = skeleton(subject).links
    return {
        id(link.joint): (on_base(subject, link.parent), on_base(subject, link.child))
        for link in links
    }


def poses_at(subject: Subject, values: Mapping[str, float] | None = None) -> dict[int, Pose]:
    """The pose in ground of each body (by identity) whose place is known.

    Args: subject: the model. values: those of coordinates, rad or m; others have their default
        values. Given, places may be off by some centimetres.
    """
    bones, ends, ways = skeleton(subject), _ends(subject), _ways(subject, values is not None)
    poses: dict[int, Pose] = {id(bones.ground): Pose()}
    pending: list[Component] = [bones.ground]
    while pending:
        base = pending.pop(0)
        for link in bones.of(base):
            parent, child = ends[id(link.joint)]
            if (
                parent is None
                or child is None
                or (id(parent[0]) in poses and id(child[0]) in poses)
            ):
                continue
            if id(link.joint) not in ways or any(
                isinstance(item, Unknown) or (item.prescribed and values is None)
                for item in link.joint.coordinates
            ):
                continue
            across = (
                parent[1]
                .then(_motion(link.joint, ways[id(link.joint)], values))
                .then(child[1].inverse())
            )
            end, step = (child[0], across) if parent[0] is base else (parent[0], across.inverse())
            poses[id(end)] = poses[id(base)].then(step)
            pending.append(end)
    return poses


class _Way(NamedTuple):
    """What a joint turns about or shifts along, and by which function of coordinates; None is the coordinate itself."""

    turns: bool
    axis: Vector  # a unit vector, or zeros
    names: list[str]
    function: Function | None = None

    def amount(self, values: Mapping[str, float]) -> float:
        """How far (rad or m)."""
        arguments = [values.get(name, 0.0) for name in self.names]
        return arguments[0] if self.function is None else self.function.evaluate(arguments)[0]


@once
def _ways(subject: Subject, rough: bool) -> dict[int, list[_Way]]:
    """The ways of the joints (by identity) whose motion is known; a turn is about an axis that those before turned."""
    result: dict[int, list[_Way]] = {}
    for link in skeleton(subject).links:
        joint, names = link.joint, [item.name for item in link.joint.coordinates]
        if is_a(joint, "CustomJoint"):
            axes = [*enumerate(axes_of(cast("CustomJoint", joint)))]
            functions = [_function(axis, rough) for _, axis in axes]
            known = [function for function in functions if function is not None]
            if len(known) == len(axes):
                result[id(joint)] = [
                    _Way(
                        place < 3,
                        over(axis.axis, norm(axis.axis) or 1.0),
                        [] if isinstance(axis.function, Constant) else axis.names,
                        function,
                    )
                    for (place, axis), function in zip(axes, known, strict=True)
                ]
        elif (
            joint.moves is not None
            and len(words := joint.moves.split()) == len(names)
            and "r" not in words
        ):
            result[id(joint)] = [
                _Way(word[0] == "r", (X, Y, Z)["xyz".index(word[1])], [name])
                for word, name in zip(words, names, strict=True)
            ]
    return result


def _function(axis: TransformAxis, rough: bool) -> Function | None:
    """What an axis moves by; None if that is not known."""
    from osimlite.mechanics.multibody.schema_functions import convert_function

    function: Any = axis.function
    if isinstance(function, GCVSpline):
        function = (
            PiecewiseLinearFunction.build({"x": function.x, "y": function.y}, set())
            if rough
            else None
        )
    count = len(axis.coordinates)
    try:
        # Of several coordinates, which should not be, a curve takes the first.
        takes_one = isinstance(function, (SimmSpline, PiecewiseLinearFunction))
        return convert_function(function, min(count, 1) if takes_one else count, axis.name)
    except OsimliteError:
        return None


def _motion(joint: Joint, ways: list[_Way], given: Mapping[str, float] | None) -> Pose:
    """The child frame of a joint in its parent frame."""
    values = {
        item.name: (given or {}).get(item.name, item.default_value) for item in joint.coordinates
    }
    axes, place = (X, Y, Z), ZERO
    for way in ways:
        amount = way.amount(values)
        if way.turns and amount:
            axes = turned_axes(axes, about_axis(way.axis, *_sine_cosine(amount)))
        elif amount:
            place = along(place, amount, way.axis)
    if isinstance(joint, EllipsoidJoint):
        place = elementwise(joint.radii_x_y_z, axes[2])
    return Pose(axes, place)


def turning_axes(subject: Subject, joint: Joint) -> list[tuple[str, Vector]]:
    """What the rotations of a gimbal or custom joint turn about in the default pose.

    Returns: The coordinate of each rotation and its axis, a unit vector in the parent frame.
        Nothing for a joint of another class, and where a rotation does not follow one coordinate of
        its own or cannot be computed.
    """
    values = {item.name: item.default_value for item in coordinates_of(joint)}
    result: dict[str, Vector] = {}
    axes = X, Y, Z
    for way in _ways(subject, False).get(id(joint), []):
        if not way.turns or len(way.names) != 1:
            continue
        if way.names[0] not in values or way.axis == ZERO:
            return []
        result[way.names[0]] = along_axes(axes, way.axis)
        axes = turned_axes(axes, about_axis(way.axis, *_sine_cosine(way.amount(values))))
    return (
        list(result.items()) if isinstance(joint, GimbalJoint) or is_a(joint, "CustomJoint") else []
    )
