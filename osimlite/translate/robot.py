"""The neutral robot: links and one-axis joints, between the mechanism and every target format.

How it corresponds to the mechanism it was built from:

- The root link, "world", is ground. Every body has one link; `Link.bodies` says by absolute path which bodies a link
  carries and where their frames are in the link's frame (identity unless `body_frames` was off or links were merged).
- A joint of the model is a chain of joints here: one per single-axis motion of its mobilizer, in their order, with
  massless links (mass and inertia zero) between them. Nothing depends on names: `RobotJoint.coordinates` are places
  in `Mechanism.coordinates`, and the joint's value is `RobotJoint.function` of them. Most often that function is the
  identity, and then `RobotJoint.coordinate` is the one place, and the joint is named after the coordinate.
- `Robot.joint_values(q)` gives the values of all moving joints by name, for joints driven by any function.
- A locked coordinate is a fixed joint at its value unless asked otherwise.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from osimlite.multibody.functions import IDENTITY, Constant, Function, Linear, Scaled
from osimlite.multibody.joints import Mobilizer
from osimlite.multibody.mechanism import Mechanism, Values
from osimlite.multibody.motions import AxisMotion, Fixed
from osimlite.multibody.spatial import Array, rotation_about, transform
from osimlite.translate.lines import as_line
from osimlite.translate.shapes import Visual

WORLD = "world"
"""Name of the root link, which URDF readers that let robots float take as the sign that it is fixed."""

JointKind = Literal["fixed", "revolute", "prismatic"]

_ALONG = 1e-14
"""How far off an axis, relative to its own length, a vector may be and still count as lying along it."""


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body of the robot.

    Attributes:
        name: unique among links and joints.
        mass: kg; 0 for a link that only stands between two joints.
        center: mass centre (3,) in the link frame, m.
        inertia: (3, 3) about the mass centre along the axes of the link frame, kg·m².
        visuals: what it looks like.
        collisions: what it touches others with; their colours mean nothing.
        bodies: frame (4, 4) in the link frame of each body it carries, by the body's absolute path.
    """

    name: str
    mass: float = 0.0
    center: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    visuals: tuple[Visual, ...] = ()
    collisions: tuple[Visual, ...] = ()
    bodies: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """A joint that moves along or about one axis, or not at all.

    The child link's frame in the parent link's frame is `origin`, then the motion by the joint's value along or about
    `axis`.

    Attributes:
        name: unique among links and joints.
        kind: how it moves.
        parent: name of the link it starts from.
        child: name of the link it moves.
        origin: (4, 4), the joint in the parent link.
        axis: unit vector (3,) in the joint's frame.
        coordinates: places in the mechanism of the coordinates that decide the value; empty for a fixed joint.
        function: the joint's value (rad, m) as a function of these coordinates.
        limits: hard limits of the value, or None.
        effort: greatest force (N, N·m) that a program may put on it, or None.
        velocity: greatest rate (m/s, rad/s) that a program may ask of it, or None.
        source: absolute path of the model's joint that it is a part of.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    origin: Array
    axis: Array = field(default_factory=lambda: np.array((0.0, 0.0, 1.0)))
    coordinates: tuple[int, ...] = ()
    function: Function = IDENTITY
    limits: tuple[float, float] | None = None
    effort: float | None = None
    velocity: float | None = None
    source: str = ""

    @property
    def coordinate(self) -> int | None:
        """The coordinate whose value is the joint's value, or None if there is no such coordinate."""
        return self.coordinates[0] if self.kind != "fixed" and self.function == IDENTITY else None

    def value(self, q: Array) -> float:
        """The joint's value (rad, m) at coordinate values q (n,) of the mechanism; 0 for a fixed joint."""
        return self.function.evaluate(q[list(self.coordinates)])[0] if self.coordinates else 0.0

    def across(self, value: float) -> Array:
        """The child link's frame in the parent link's (4, 4) at a joint value."""
        if self.kind == "fixed":
            return self.origin
        if self.kind == "revolute":
            return self.origin @ transform(rotation_about(self.axis, value))
        return self.origin @ transform(None, self.axis * value)


@dataclass(frozen=True, eq=False)
class Robot:
    """A tree of links from `WORLD`: links stand after those that carry them, joints in the order of their children."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[RobotJoint, ...]
    mechanism: Mechanism

    @cached_property
    def moving(self) -> tuple[RobotJoint, ...]:
        """The joints that are not fixed."""
        return tuple(joint for joint in self.joints if joint.kind != "fixed")

    @cached_property
    def link_of(self) -> dict[str, tuple[Link, Array]]:
        """By absolute path of each body (and ground), its link and the body's frame (4, 4) in the link's."""
        return {path: (link, frame) for link in self.links for path, frame in link.bodies.items()}

    @cached_property
    def joint_of(self) -> dict[int, RobotJoint]:
        """The joint whose value is the coordinate, by the coordinate's place in the mechanism, where there is one."""
        return {joint.coordinate: joint for joint in reversed(self.moving) if joint.coordinate is not None}

    def joint_values(self, q: Values) -> dict[str, float]:
        """Values (rad, m) of all moving joints by name, at coordinate values `q` of the mechanism."""
        values = self.mechanism.values(q)
        return {joint.name: joint.value(values) for joint in self.moving}

    def joint_jacobian(self, q: Values) -> Array:
        """Rates of the m moving joints per rates of the n coordinates (m, n), in the order of `moving`."""
        values = self.mechanism.values(q)
        jacobian = np.zeros((len(self.moving), len(values)))
        for row, joint in enumerate(self.moving):
            places = list(joint.coordinates)
            jacobian[row, places] = joint.function.evaluate(values[places])[1]
        return jacobian

    def link_transforms(self, q: Values) -> dict[str, Array]:
        """Transform (4, 4) of every link in the root link."""
        values = self.mechanism.values(q)
        placed = {self.links[0].name: np.eye(4)}
        for joint in self.joints:
            placed[joint.child] = placed[joint.parent] @ joint.across(joint.value(values))
        return placed


def build_robot(
    mechanism: Mechanism,
    *,
    locked: Literal["fixed", "joint"] | Collection[int] = "fixed",
    body_frames: bool = True,
    at: Values | None = None,
    visuals: Mapping[str, Sequence[Visual]] | None = None,
    collisions: Mapping[str, Sequence[Visual]] | None = None,
) -> Robot:
    """Spread a mechanism out into one-axis joints.

    Args:
        mechanism: what to spread out.
        locked: whether a locked coordinate becomes a fixed joint or stays a joint that moves; or which coordinates
            become fixed joints, by their places in the mechanism.
        body_frames: give every body a link whose frame is the body's own. Where the body's frame is off the axis of
            its joint, that takes a massless link at the axis and a fixed joint; without it the body's link has its
            frame at the joint, which saves a link, and `Link.bodies` tells where the body is.
        at: coordinate values at which locked coordinates are fixed; their defaults if left out.
        visuals: shapes by absolute path of the body (or ``"/ground"``), placed in the body's frame.
        collisions: what bodies touch others with, likewise.
    """
    values = mechanism.values({} if at is None else at)
    if isinstance(locked, str):
        locked = [k for k, info in enumerate(mechanism.coordinates) if info.locked and locked == "fixed"]
    return _Builder(mechanism, locked, body_frames, values).robot(visuals or {}, collisions or {})


class _Builder:
    def __init__(self, mechanism: Mechanism, still: Collection[int], body_frames: bool, values: Array) -> None:
        self.mechanism = mechanism
        self.body_frames = body_frames
        self.values = values
        self.still = frozenset(still)
        # Bodies and coordinates have the first call on their own names; what has to be invented steps aside.
        self.taken = {WORLD}
        self.body_names = [self._unique(body.name) for body in mechanism.bodies]
        self.coordinate_names = [
            None if k in self.still else self._unique(info.name) for k, info in enumerate(mechanism.coordinates)
        ]
        self.links: list[Link] = []
        self.joints: list[RobotJoint] = []

    def robot(self, visuals: Mapping[str, Sequence[Visual]], collisions: Mapping[str, Sequence[Visual]]) -> Robot:
        ground = "/ground"
        self.links.append(
            Link(
                WORLD,
                visuals=tuple(visuals.get(ground, ())),
                collisions=tuple(collisions.get(ground, ())),
                bodies={ground: np.eye(4)},
            )
        )
        # Link and frame in it, of ground (-1) and every body so far.
        placed: dict[int, tuple[str, Array]] = {-1: (WORLD, np.eye(4))}
        for index, body in enumerate(self.mechanism.bodies):
            name, frame = self._body(index, *placed[body.parent])
            placed[index] = name, frame
            self.links[-1] = replace(
                self.links[-1],
                visuals=_placed(visuals.get(body.path, ()), frame),
                collisions=_placed(collisions.get(body.path, ()), frame),
            )
        return Robot(self.mechanism.name, tuple(self.links), tuple(self.joints), self.mechanism)

    def _body(self, index: int, parent: str, start: Array) -> tuple[str, Array]:
        """Add the joints and links up to a body, its own link last; returns its name and the body's frame in it."""
        body = self.mechanism.bodies[index]
        mobilizer = body.mobilizer
        motions, frames = self._split(mobilizer, start)
        name = self.body_names[index]
        if motions and self.body_frames:
            _carry_back(motions, frames)
        last = frames.pop()
        off_axis = bool(motions) and self.body_frames and not np.array_equal(last, np.eye(4))
        for place, (motion, origin) in enumerate(zip(motions, frames, strict=True)):
            carries_body = place == len(motions) - 1 and not off_axis
            joint = self._joint(motion, mobilizer, origin, parent, "" if carries_body else None, name)
            if not carries_body:
                self.links.append(Link(joint.child))
            self.joints.append(joint)
            parent = joint.child
        if not motions or off_axis:
            suffix = "_frame" if off_axis else ""
            joint_name = self._unique(mobilizer.joint.rsplit("/", 1)[1] + suffix)
            self.joints.append(RobotJoint(joint_name, "fixed", parent, name, last, source=mobilizer.joint))
            last = np.eye(4)
        properties = body.mass_properties
        self.links.append(
            Link(
                name,
                properties.mass,
                last[:3, :3] @ properties.center + last[:3, 3],
                last[:3, :3] @ properties.inertia @ last[:3, :3].T,
                bodies={body.path: last},
            )
        )
        return name, last

    def _joint(
        self, motion: AxisMotion, mobilizer: Mobilizer, origin: Array, parent: str, child: str | None, body_name: str
    ) -> RobotJoint:
        places = tuple(mobilizer.coordinates[place] for place in motion.coordinates)
        name = self.coordinate_names[places[0]] if motion.coordinate is not None else None
        if name is not None:
            # A second joint driven by the same coordinate needs a name of its own.
            self.coordinate_names[places[0]] = None
        else:
            name = self._unique(f"{self.mechanism.coordinates[places[0]].name}_{_letter(motion)}")
        return RobotJoint(
            name=name,
            kind="revolute" if motion.kind == "rotate" else "prismatic",
            parent=parent,
            child=body_name if child is not None else self._unique(f"{body_name}_{name}"),
            origin=origin,
            axis=motion.axis,
            coordinates=places,
            function=motion.function,
            source=mobilizer.joint,
        )

    def _split(self, mobilizer: Mobilizer, start: Array) -> tuple[list[AxisMotion], list[Array]]:
        """The m motions on the way to the body, and the m + 1 fixed transforms before, between and after them."""
        own = list(mobilizer.coordinates)
        motions: list[AxisMotion] = []
        frames = [start]
        for part in mobilizer.elementary():
            for factor in self._simplified(part, own):
                if isinstance(factor, Fixed):
                    frames[-1] = frames[-1] @ factor.matrix
                else:
                    motions.append(factor)
                    frames.append(np.eye(4))
        return motions, frames

    def _simplified(self, part: Fixed | AxisMotion, own: Sequence[int]) -> Iterator[Fixed | AxisMotion]:
        """The same motion with what is constant in it taken out."""
        if isinstance(part, Fixed):
            yield part
        elif _is_constant(part.function) or all(own[place] in self.still for place in part.coordinates):
            values = self.values[own]
            yield Fixed(part.relative(values, np.zeros(len(own))).matrix)
        elif part.function == IDENTITY or (line := as_line(part.function)) is None:
            yield part
        else:
            slope = line.slope
            first = AxisMotion(part.kind, part.axis, (0,), Constant(line.start))
            yield Fixed(first.relative(np.zeros(1), np.zeros(1)).matrix)
            unit = abs(slope) == 1.0
            yield AxisMotion(
                part.kind,
                part.axis * slope if unit else part.axis,
                part.coordinates,
                IDENTITY if unit else Linear(slope),
            )

    def _unique(self, name: str) -> str:
        unique, count = name, 1
        while unique in self.taken:
            unique, count = f"{name}_{count}", count + 1
        self.taken.add(unique)
        return unique


def _carry_back(motions: list[AxisMotion], frames: list[Array]) -> None:
    """Move the last fixed transform in front of the last motion if that leaves the product unchanged.

    A translation lets any transform pass, a rotation one that does not leave its axis; the axis turns with it.
    """
    motion, last = motions[-1], frames[-1]
    turn, shift = last[:3, :3], last[:3, 3]
    along = np.linalg.norm(np.cross(motion.axis, shift)) <= _ALONG * float(np.linalg.norm(shift))
    if motion.kind == "translate" or along:
        motions[-1] = replace(motion, axis=turn.T @ motion.axis)
        frames[-2:] = [frames[-2] @ last, np.eye(4)]


def _placed(shapes: Sequence[Visual], frame: Array) -> tuple[Visual, ...]:
    return tuple(replace(shape, origin=frame @ shape.origin) for shape in shapes)


def _is_constant(function: Function) -> bool:
    if isinstance(function, Scaled):
        return function.scale == 0.0 or _is_constant(function.function)
    line = as_line(function)
    return isinstance(function, Constant) or (line is not None and line.slope == 0.0)


def _letter(motion: AxisMotion) -> str:
    """Name for a joint that is not its coordinate: the axis it is nearest to, ``rx`` or ``tz``."""
    return ("r" if motion.kind == "rotate" else "t") + "xyz"[int(np.argmax(np.abs(motion.axis)))]
