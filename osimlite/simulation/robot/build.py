"""Conversion of a mechanism to the neutral robot.

Each joint is expanded into joints that move along or about one axis.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Literal

import numpy as np

from osimlite.base.records import replace
from osimlite.base.text import make_unique_name
from osimlite.mechanics.multibody.functions import (
    IDENTITY,
    ConstantValue,
    Linear,
    ScaledFunction,
    SmoothFunction,
)
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.mechanism import Mechanism, Values
from osimlite.mechanics.multibody.motions import AxisMotion, FixedTransform
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.robot.couplings import find_line
from osimlite.simulation.robot.robot import WORLD, Robot, RobotJoint, RobotLink, Visual

_ALIGNMENT_TOLERANCE = 1e-14
"""Largest distance of a vector from an axis, relative to the length of the vector, at which it counts as parallel."""


def build_robot(
    mechanism: Mechanism,
    *,
    locked: Literal["fixed", "joint"] | Collection[int] = "fixed",
    body_frames: bool = True,
    at: Values | None = None,
    visuals: Mapping[str, Sequence[Visual]] | None = None,
    collisions: Mapping[str, Sequence[Visual]] | None = None,
) -> Robot:
    """Expand a mechanism into one-axis joints.

    Args:
        mechanism: the mechanism.
        locked: "fixed" if a locked coordinate becomes a fixed joint, "joint" if it stays a joint
            that moves; or indices of the coordinates that become fixed joints.
        body_frames: whether every body has a link whose frame is the body's. Where the body's frame
            is off the axis of its joint, this takes a massless link at the axis and a fixed joint.
            Without it, the body's link has its frame at the joint, which saves a link, and
            `Link.bodies` locates the body.
        at: coordinate values at which locked coordinates are fixed; by default their defaults.
        visuals: shapes by absolute path of the body (or ``"/ground"``), placed in the body's frame;
            None for none.
        collisions: contact shapes of the bodies, in the same form; None for none.

    Returns:
        The robot.
    """
    values = mechanism.values({} if at is None else at)
    if isinstance(locked, str):
        locked = [
            k for k, info in enumerate(mechanism.coordinates) if info.locked and locked == "fixed"
        ]
    return _RobotBuilder(mechanism, locked, body_frames, values).robot(
        visuals or {}, collisions or {}
    )


class _RobotBuilder:
    """Builder of one robot; for the arguments see :func:`build_robot`.

    Attributes:
        used_names: names of links and joints so far.
        body_names: name of the link of each body.
        coordinate_names: name of the joint of each coordinate; None once it is used.
        links: links so far.
        joints: joints so far.
    """

    def __init__(
        self, mechanism: Mechanism, still: Collection[int], body_frames: bool, values: Array
    ) -> None:
        self.mechanism = mechanism
        self.body_frames = body_frames
        self.values = values
        self.still = frozenset(still)
        # Bodies and coordinates get their own names; names that are invented give way.
        self.used_names = {WORLD}
        self.body_names = [self._unique(body.name) for body in mechanism.bodies]
        self.coordinate_names = [
            None if k in self.still else self._unique(info.name)
            for k, info in enumerate(mechanism.coordinates)
        ]
        self.links: list[RobotLink] = []
        self.joints: list[RobotJoint] = []

    def robot(
        self, visuals: Mapping[str, Sequence[Visual]], collisions: Mapping[str, Sequence[Visual]]
    ) -> Robot:
        """Return the robot.

        Args:
            visuals: shapes by path of the body.
            collisions: contact shapes by path of the body.
        """
        ground = "/ground"
        self.links.append(
            RobotLink(
                WORLD,
                visuals=tuple(visuals.get(ground, ())),
                collisions=tuple(collisions.get(ground, ())),
                bodies={ground: np.eye(4)},
            )
        )
        # Link and frame in it, of ground (-1) and every body so far.
        link_frames: dict[int, tuple[str, Array]] = {-1: (WORLD, np.eye(4))}
        for index, body in enumerate(self.mechanism.bodies):
            name, frame = self._body(index, *link_frames[body.parent])
            link_frames[index] = name, frame
            self.links[-1] = replace(
                self.links[-1],
                visuals=_transform_visuals(visuals.get(body.path, ()), frame),
                collisions=_transform_visuals(collisions.get(body.path, ()), frame),
            )
        return Robot(self.mechanism.name, tuple(self.links), tuple(self.joints), self.mechanism)

    def _body(self, index: int, parent: str, start: Array) -> tuple[str, Array]:
        """Add the joints and links up to a body, its own link last.

        Args:
            index: index of the body.
            parent: name of the link of the parent body.
            start: frame of the parent body in that link (4, 4).

        Returns:
            Name of the body's link, and the body's frame in it (4, 4).
        """
        body = self.mechanism.bodies[index]
        mobilizer = body.mobilizer
        motions, frames = self._split(mobilizer, start)
        name = self.body_names[index]
        # Most often the body's frame can be moved onto the axis of its joint, which needs no
        # further link.
        if motions and self.body_frames:
            _carry_back(motions, frames)
        last = frames.pop()
        off_axis = bool(motions) and self.body_frames and not np.array_equal(last, np.eye(4))
        for number, (motion, origin) in enumerate(zip(motions, frames, strict=True)):
            # The other joints of a mobilizer lead to massless links.
            carries_body = number == len(motions) - 1 and not off_axis
            joint = self._joint(
                motion, mobilizer, origin, parent, "" if carries_body else None, name
            )
            if not carries_body:
                self.links.append(RobotLink(joint.child))
            self.joints.append(joint)
            parent = joint.child
        if not motions or off_axis:
            suffix = "_frame" if off_axis else ""
            joint_name = self._unique(mobilizer.joint.rsplit("/", 1)[1] + suffix)
            self.joints.append(
                RobotJoint(joint_name, "fixed", parent, name, last, source=mobilizer.joint)
            )
            last = np.eye(4)
        properties = body.mass_properties
        self.links.append(
            RobotLink(
                name,
                properties.mass,
                last[:3, :3] @ properties.center + last[:3, 3],
                # Inertia along the axes of the link, about the mass centre.
                last[:3, :3] @ properties.inertia @ last[:3, :3].T,
                bodies={body.path: last},
            )
        )
        return name, last

    def _joint(
        self,
        motion: AxisMotion,
        mobilizer: Mobilizer,
        origin: Array,
        parent: str,
        child: str | None,
        body_name: str,
    ) -> RobotJoint:
        """Return the joint of one motion.

        Args:
            motion: the motion.
            mobilizer: mobilizer of the body.
            origin: frame of the joint in the parent link (4, 4).
            parent: name of the parent link.
            child: None if the child is a new massless link, else the child is the body's link.
            body_name: name of the body's link.
        """
        indices = tuple(mobilizer.coordinates[argument] for argument in motion.coordinates)
        name = self.coordinate_names[indices[0]] if motion.coordinate is not None else None
        if name is not None:
            # A second joint driven by the same coordinate needs a name of its own.
            self.coordinate_names[indices[0]] = None
        else:
            name = self._unique(f"{self.mechanism.coordinates[indices[0]].name}_{_letter(motion)}")
        return RobotJoint(
            name=name,
            kind="revolute" if motion.kind == "rotate" else "prismatic",
            parent=parent,
            child=body_name if child is not None else self._unique(f"{body_name}_{name}"),
            origin=origin,
            axis=motion.axis,
            coordinates=indices,
            function=motion.function,
            source=mobilizer.joint,
        )

    def _split(self, mobilizer: Mobilizer, start: Array) -> tuple[list[AxisMotion], list[Array]]:
        """Split a mobilizer into motions of one axis and fixed transforms.

        Args:
            mobilizer: the mobilizer.
            start: first fixed transform (4, 4).

        Returns:
            The m motions, and the m + 1 fixed transforms before, between and after them.
        """
        coordinate_indices = list(mobilizer.coordinates)
        motions: list[AxisMotion] = []
        frames = [start]
        for part in mobilizer.elementary():
            for factor in self._simplify_motion(part, coordinate_indices):
                if isinstance(factor, FixedTransform):
                    frames[-1] = frames[-1] @ factor.matrix
                else:
                    motions.append(factor)
                    frames.append(np.eye(4))
        return motions, frames

    def _simplify_motion(
        self, part: FixedTransform | AxisMotion, coordinate_indices: Sequence[int]
    ) -> Iterator[FixedTransform | AxisMotion]:
        """Yield a motion with its constant part as a fixed transform.

        Args:
            part: part of a mobilizer.
            coordinate_indices: indices in the mechanism of the mobilizer's coordinates.

        Yields:
            Fixed transforms and at most one motion, whose product is the part.
        """
        if isinstance(part, FixedTransform):
            yield part
        elif _is_constant(part.function) or all(
            coordinate_indices[argument] in self.still for argument in part.coordinates
        ):
            yield FixedTransform(part.transform(self.values[coordinate_indices]))
        elif part.function == IDENTITY or (line := find_line(part.function)) is None:
            yield part
        else:
            slope = line.slope
            first = AxisMotion(part.kind, part.axis, (0,), ConstantValue(line.offset))
            yield FixedTransform(first.transform(np.zeros(1)))
            unit = abs(slope) == 1.0
            yield AxisMotion(
                part.kind,
                # A slope of -1 is the opposite axis, which every format can express.
                part.axis * slope if unit else part.axis,
                part.coordinates,
                IDENTITY if unit else Linear(slope),
            )

    def _unique(self, name: str) -> str:
        unique = make_unique_name(name, self.used_names)
        self.used_names.add(unique)
        return unique


def _carry_back(motions: list[AxisMotion], frames: list[Array]) -> None:
    """Move the last fixed transform in front of the last motion if that leaves the product unchanged.

    Any transform commutes with a translation, and one along its axis with a rotation; the axis
    turns with it.

    Args:
        motions: motions of one axis; the last one may be replaced.
        frames: fixed transforms around them; the last two may be replaced.
    """
    motion, last = motions[-1], frames[-1]
    turn = last[:3, :3]
    shift = last[:3, 3]
    along = np.linalg.norm(np.cross(motion.axis, shift)) <= _ALIGNMENT_TOLERANCE * float(
        np.linalg.norm(shift)
    )
    # A fixed offset commutes with a translation, and with a rotation about an axis through its
    # origin.
    if motion.kind == "translate" or along:
        # Behind the offset the same axis has other components.
        motions[-1] = replace(motion, axis=turn.T @ motion.axis)
        frames[-2:] = [frames[-2] @ last, np.eye(4)]


def _transform_visuals(shapes: Sequence[Visual], frame: Array) -> tuple[Visual, ...]:
    return tuple(replace(shape, origin=frame @ shape.origin) for shape in shapes)


def _is_constant(function: SmoothFunction) -> bool:
    if isinstance(function, ScaledFunction):
        return function.scale == 0.0 or _is_constant(function.function)
    line = find_line(function)
    return isinstance(function, ConstantValue) or (line is not None and line.slope == 0.0)


def _letter(motion: AxisMotion) -> str:
    """Return the end of the name of a joint that is not its coordinate: the nearest axis, such as ``rx`` or ``tz``."""
    return ("r" if motion.kind == "rotate" else "t") + "xyz"[int(np.argmax(np.abs(motion.axis)))]
