"""The neutral robot: links and one-axis joints, between the mechanism and every target format.

How it corresponds to the mechanism it was built from:

- The root link, "world", is ground. Every body has one link; `Link.bodies` says by absolute path
  which bodies a link carries and where their frames are in the link's frame (identity unless
  `body_frames` was off or links were merged).
- A joint of the model is a chain of joints here: one per single-axis motion of its mobilizer, in
  their order, with massless links (mass and inertia zero) between them. Nothing depends on names:
  `RobotJoint.coordinates` are places in `Mechanism.coordinates`, and the joint's value is
  `RobotJoint.function` of them. Most often that function is the identity, and then
  `RobotJoint.coordinate` is the one place, and the joint is named after the coordinate.
- `Robot.joint_values(q)` gives the values of all moving joints by name, for joints driven by any
  function.
- A locked coordinate is a fixed joint at its value unless asked otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import permutations
from typing import Literal, NamedTuple

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.functions import IDENTITY, Function
from osimlite.mechanics.multibody.mechanism import Mechanism, Values
from osimlite.mechanics.multibody.spatial import Array, make_transform, rotation_about

WORLD = "world"
"""Name of the root link, which URDF readers that let robots float take as the sign that it is fixed."""

JointKind = Literal["fixed", "revolute", "prismatic"]


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body of the robot."""

    name: str  # unique among links and joints
    mass: float = 0.0  # kg; 0 for a link that only stands between two joints
    center: Array = field(
        default_factory=lambda: np.zeros(3)
    )  # mass centre (3,) in the link frame, m
    # (3, 3) about the mass centre along the axes of the link frame, kg·m²
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    visuals: tuple[Visual, ...] = ()  # what it looks like
    collisions: tuple[Visual, ...] = ()  # what it touches others with; their colours mean nothing
    # frame (4, 4) in the link frame of each body it carries, by the body's absolute path
    bodies: Mapping[str, Array] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class RobotJoint:
    """A joint that moves along or about one axis, or not at all.

    The child link's frame in the parent link's frame is `origin`, then the motion by the joint's
    value along or about `axis`.
    """

    name: str  # unique among links and joints
    kind: JointKind  # how it moves
    parent: str  # name of the link it starts from
    child: str  # name of the link it moves
    origin: Array  # (4, 4), the joint in the parent link
    axis: Array = field(
        default_factory=lambda: np.array((0.0, 0.0, 1.0))
    )  # unit vector (3,) in the joint's frame
    # places in the mechanism of the coordinates that decide the value; empty for a fixed joint
    coordinates: tuple[int, ...] = ()
    function: Function = IDENTITY  # the joint's value (rad, m) as a function of these coordinates
    limits: tuple[float, float] | None = None  # hard limits of the value, or None
    effort: float | None = None  # greatest force (N, N·m) that a program may put on it, or None
    # greatest rate (m/s, rad/s) that a program may ask of it, or None
    velocity: float | None = None
    source: str = ""  # absolute path of the model's joint that it is a part of

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
            return self.origin @ make_transform(rotation_about(self.axis, value))
        return self.origin @ make_transform(None, self.axis * value)


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
        return {
            joint.coordinate: joint
            for joint in reversed(self.moving)
            if joint.coordinate is not None
        }

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


class Box(NamedTuple):
    """A box centred on its origin, by whole edge lengths (m)."""

    size: tuple[float, float, float]


class Ball(NamedTuple):
    """A sphere centred on its origin, by radius (m)."""

    radius: float


class Tube(NamedTuple):
    """A cylinder along the Z axis, centred on its origin, by radius and whole length (m)."""

    radius: float
    length: float


class MeshFile(NamedTuple):
    """A surface in a file; `file` is relative to the file of the robot, `scale` multiplies its coordinates."""

    file: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Ball | Tube | MeshFile


@dataclass(frozen=True, eq=False)
class Visual:
    """A shape at `origin` (4, 4) in the frame of what it belongs to.

    `source` is the absolute path of the model's geometry, `color` red, green, blue and opacity from
    0 to 1.
    """

    shape: Shape
    origin: Array
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    source: str = ""


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Moments (3,) and axes (3, 3), as columns of a rotation matrix, with axes @ diag(moments) @ axes.T = inertia.

    A tensor that is diagonal already keeps its axes; otherwise they are numbered so that they turn
    least.
    """
    if not np.any(inertia - np.diag(np.diag(inertia))):
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    weights = np.abs(axes).tolist()
    order = list(
        max(
            permutations(range(3)),
            key=lambda p: sum(weights[row][place] for row, place in enumerate(p)),
        )
    )
    moments, axes = moments[order], axes[:, order]
    axes = axes * np.where(np.diag(axes) < 0.0, -1.0, 1.0)
    if np.linalg.det(axes) < 0.0:
        weakest = int(np.argmin(np.abs(np.diag(axes))))
        axes[:, weakest] *= -1.0
    return moments, axes


def breaks_triangle_rule(moments: Array) -> bool:
    """Whether one principal moment exceeds the sum of the others, or is negative: no body has such an inertia.

    Readers react differently (Bullet takes zero instead). A thin rod or plate, for which the rule
    holds with equality, passes up to rounding.
    """
    small, middle, large = np.sort(moments).tolist()
    return bool(small < 0.0 or large > (small + middle) * (1.0 + 1e-12))
