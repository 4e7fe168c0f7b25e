"""Where bodies are in a pose, as far as a few lines of plain arithmetic can tell.

The numeric library that simulations use is not needed to validate, so that this knows only what it takes to look at
the first pose: joints that are made of plain rotations and translations, and custom joints whose functions are
constant, linear or polynomial. What hangs on another joint, on a prescribed coordinate or on a frame laid through
stations has no known place. Constraints, which may move the model when it is assembled, are left out.

Where centimetres do not matter, splines are taken for straight lines between their points, and prescribed coordinates
have the values they are given.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, cast

from osimlite.forces.vectors import Vector, along, dot, norm, over, plus
from osimlite.lint.axes import axes_of, coordinates_of, names_on
from osimlite.lint.skeleton import skeleton
from osimlite.lint.subject import Subject, once
from osimlite.schema.base import Component, Unknown
from osimlite.schema.frames import Body, Ground, PhysicalOffsetFrame
from osimlite.schema.functions import (
    Constant,
    Function,
    GCVSpline,
    LinearFunction,
    MultiplierFunction,
    PiecewiseLinearFunction,
    PolynomialFunction,
    SimmSpline,
)
from osimlite.schema.joints import (
    BallJoint,
    FreeJoint,
    GimbalJoint,
    Joint,
    PinJoint,
    PlanarJoint,
    SliderJoint,
    UniversalJoint,
    WeldJoint,
)
from osimlite.schema.tree import is_a

if TYPE_CHECKING:
    from osimlite.schema.custom_joint import CustomJoint, TransformAxis

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class Pose(NamedTuple):
    """A frame in another: the rows of its rotation matrix, and its origin (m)."""

    rotation: tuple[Vector, Vector, Vector] = (X, Y, Z)
    position: Vector = (0.0, 0.0, 0.0)

    def turned(self, vector: Vector) -> Vector:
        """A vector of the inner frame, expressed in the outer one."""
        return (dot(self.rotation[0], vector), dot(self.rotation[1], vector), dot(self.rotation[2], vector))

    def of(self, point: Vector) -> Vector:
        """A point of the inner frame, in the outer one."""
        return plus(self.turned(point), self.position)

    def then(self, inner: Pose) -> Pose:
        """A frame within this one, seen from outside."""
        # Written out: of a motion this is done a thousand times.
        (a, b, c), (d, e, f), (g, h, i) = inner.rotation
        one, two, three = (
            (x * a + y * d + z * g, x * b + y * e + z * h, x * c + y * f + z * i) for x, y, z in self.rotation
        )
        return Pose((one, two, three), self.of(inner.position))

    def inverse(self) -> Pose:
        """The outer frame, seen from the inner one."""
        one, two, three = zip(*self.rotation, strict=True)
        back = Pose((one, two, three))
        x, y, z = back.turned(self.position)
        return Pose(back.rotation, (-x, -y, -z))


End = tuple[Component, Pose] | None
"""The body or ground that a frame is fixed to, and where it is on it."""


def about(axis: Vector, angle: float) -> Pose:
    """A rotation about an axis, by Rodrigues' formula."""
    x, y, z = over(axis, norm(axis) or 1.0)
    c, s = (math.cos(angle), math.sin(angle)) if math.isfinite(angle) else (math.nan, math.nan)
    v = 1 - c
    return Pose(
        (
            (c + x * x * v, x * y * v - z * s, x * z * v + y * s),
            (y * x * v + z * s, c + y * y * v, y * z * v - x * s),
            (z * x * v - y * s, z * y * v + x * s, c + z * z * v),
        )
    )


def fixed(angles: Vector, position: Vector) -> Pose:
    """A frame displaced, and turned by body-fixed X-Y-Z angles."""
    return Pose(about(X, angles[0]).then(about(Y, angles[1])).then(about(Z, angles[2])).rotation, position)


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
    return {id(link.joint): (on_base(subject, link.parent), on_base(subject, link.child)) for link in links}


def poses_at(subject: Subject, values: Mapping[str, float] | None = None) -> dict[int, Pose]:
    """The pose in ground of each body (by identity) whose place is known.

    Args:
        subject: the model.
        values: those of coordinates, rad or m; others have their default values. Given, places may be off by some
            centimetres.
    """
    bones, ends = skeleton(subject), _ends(subject)
    poses: dict[int, Pose] = {id(bones.ground): Pose()}
    pending: list[Component] = [bones.ground]
    while pending:
        base = pending.pop(0)
        for link in bones.of(base):
            parent, child = ends[id(link.joint)]
            if parent is None or child is None or (id(parent[0]) in poses and id(child[0]) in poses):
                continue
            motion = _motion(link.joint, values)
            if motion is None:
                continue
            across = parent[1].then(motion).then(child[1].inverse())
            end, step = (child[0], across) if parent[0] is base else (parent[0], across.inverse())
            poses[id(end)] = poses[id(base)].then(step)
            pending.append(end)
    return poses


def _motion(joint: Joint, given: Mapping[str, float] | None) -> Pose | None:
    """The child frame of a joint in its parent frame."""
    if any(isinstance(item, Unknown) or (item.prescribed and given is None) for item in joint.coordinates):
        return None
    values = [(given or {}).get(item.name, item.default_value) for item in joint.coordinates]
    if is_a(joint, "CustomJoint"):
        names = [item.name for item in joint.coordinates]
        return _custom(cast("CustomJoint", joint), dict(zip(names, values, strict=True)), rough=given is not None)
    if joint.motion_types is None or len(values) != len(joint.motion_types):
        return None
    match joint:
        case WeldJoint():
            return Pose()
        case PinJoint():
            return about(Z, values[0])
        case SliderJoint():
            return Pose(position=(values[0], 0.0, 0.0))
        case PlanarJoint():
            return Pose(about(Z, values[0]).rotation, (values[1], values[2], 0.0))
        case UniversalJoint():
            return about(X, values[0]).then(about(Y, values[1]))
        case BallJoint() | GimbalJoint():
            return fixed((values[0], values[1], values[2]), (0.0, 0.0, 0.0))
        case FreeJoint():
            return fixed((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    return None


def turning_axes(joint: Joint) -> list[tuple[str, Vector]]:
    """What the rotations of a gimbal or custom joint turn about in the default pose.

    Returns:
        The coordinate of each rotation and its axis, a unit vector in the parent frame. Nothing for a joint of another
        class, and where a rotation does not follow one coordinate of its own or cannot be computed.
    """
    values = {item.name: item.default_value for item in coordinates_of(joint)}
    turns: list[tuple[str, Vector, float | None]] = []
    if isinstance(joint, GimbalJoint):
        turns = [(name, axis, value) for (name, value), axis in zip(values.items(), (X, Y, Z), strict=False)]
    elif is_a(joint, "CustomJoint"):
        for turn in axes_of(cast("CustomJoint", joint))[:3]:
            if len(turn.coordinates) == 1 and not isinstance(turn.function, Constant):
                turns.append((str(turn.coordinates[0]), turn.axis, _along(turn, values, rough=False)))
    result: dict[str, Vector] = {}
    turned = Pose()
    for name, axis, angle in turns:
        length = norm(axis)
        if angle is None or name not in values or length == 0.0:
            return []
        result[name] = turned.turned(over(axis, length))
        turned = turned.then(about(axis, angle))
    return list(result.items())


def _custom(joint: CustomJoint, values: dict[str, float], *, rough: bool) -> Pose | None:
    axes = axes_of(joint)
    moved = [_along(axis, values, rough) for axis in axes]
    known = [amount for amount in moved if amount is not None]
    if len(known) < len(axes):
        return None
    turned = Pose()
    for axis, amount in zip(axes[:3], known[:3], strict=True):
        turned = turned.then(about(axis.axis, amount))
    place = 0.0, 0.0, 0.0
    for axis, amount in zip(axes[3:], known[3:], strict=True):
        place = along(place, amount / (norm(axis.axis) or 1.0), axis.axis)
    return Pose(turned.rotation, place)


def _along(axis: TransformAxis, values: dict[str, float], rough: bool) -> float | None:
    names = names_on(axis)
    return _value(axis.function, [values.get(name, 0.0) for name in names], rough)


def _value(function: Function | None, arguments: list[float], rough: bool) -> float | None:
    match function:
        case Constant():
            return function.value
        case LinearFunction() if len(function.coefficients) == len(arguments) + 1:
            *weights, rest = function.coefficients
            return rest + sum(weight * value for weight, value in zip(weights, arguments, strict=True))
        case PolynomialFunction() if len(arguments) == 1:
            total = 0.0
            for coefficient in function.coefficients:
                total = total * arguments[0] + coefficient
            return total
        case MultiplierFunction():
            inner = _value(function.function, arguments, rough)
            return None if inner is None else function.scale * inner
        case SimmSpline() | GCVSpline() | PiecewiseLinearFunction() if (
            rough and arguments and len(function.x) == len(function.y) > 1
        ):
            at = min(max(bisect_right(function.x, arguments[0]), 1), len(function.x) - 1)
            (x0, x1), (y0, y1) = function.x[at - 1 : at + 1], function.y[at - 1 : at + 1]
            return y0 + (y1 - y0) * (arguments[0] - x0) / ((x1 - x0) or 1.0)
    return None
