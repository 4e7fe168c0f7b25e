"""Neutral robot: links and one-axis joints, between the mechanism and every target format.

How it corresponds to the mechanism from which it was built:

- The root link, "world", is ground. Every body has one link; `Link.bodies` lists by absolute path
  which bodies a link carries and where their frames are in the link's frame (identity unless
  `body_frames` was off or links were merged).
- A joint of the model is a chain of joints here: one per single-axis motion of its mobilizer, in
  their order, with massless links (mass and inertia zero) between them. Nothing depends on names:
  `RobotJoint.coordinates` are indices in `Mechanism.coordinates`, and the joint's value is
  `RobotJoint.function` of them. Most often that function is the identity. Then
  `RobotJoint.coordinate` is the one index, and the joint is named after the coordinate.
- `Robot.joint_values(q)` gives the values of all moving joints by name, for joints driven by any
  function.
- A locked coordinate is a fixed joint at its value unless requested otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import permutations
from typing import Literal

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.mechanics.multibody.functions import IDENTITY, SmoothFunction
from osimlite.mechanics.multibody.mechanism import Mechanism, Values
from osimlite.mechanics.multibody.spatial import Array, make_transform, rotation_about

WORLD = "world"
"""Name of the root link; URDF readers that let robots float recognize a fixed robot by it."""

JointKind = Literal["fixed", "revolute", "prismatic"]
"""Types of joints, with the names of URDF."""


@dataclass(frozen=True, eq=False)
class RobotLink:
    """Rigid body of the robot.

    Attributes:
        name: name, unique among links and joints.
        mass: mass, kg; 0 for a link that only connects two joints.
        center: mass centre (3,) in the link frame, m.
        inertia: inertia (3, 3) about the mass centre along the axes of the link frame, kg·m².
        visuals: shapes for drawing.
        collisions: shapes for contact; their colours mean nothing.
        bodies: frame (4, 4) in the link frame of each body that it carries, by the body's path.
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
    """Joint that moves along or about one axis, or not at all.

    The child link's frame in the parent link's frame is `origin`, then the motion by the joint's
    value along or about `axis`.

    Attributes:
        name: name, unique among links and joints.
        kind: type of the joint: "fixed", "revolute" or "prismatic".
        parent: name of the parent link.
        child: name of the child link.
        origin: frame of the joint in the parent link (4, 4).
        axis: unit vector (3,) in the joint's frame.
        coordinates: indices in the mechanism of the coordinates that determine the value; empty for
            a fixed joint.
        function: the joint's value (rad, m) as a function of these coordinates.
        limits: hard limits of the value (rad, m), or None.
        effort: largest force (N, N·m) that a program may apply to it, or None.
        velocity: largest rate (m/s, rad/s) that a program may request, or None.
        source: absolute path of the model's joint that it is a part of.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    origin: Array
    axis: Array = field(default_factory=lambda: np.array((0.0, 0.0, 1.0)))
    coordinates: tuple[int, ...] = ()
    function: SmoothFunction = IDENTITY
    limits: tuple[float, float] | None = None
    effort: float | None = None
    velocity: float | None = None
    source: str = ""

    @property
    def coordinate(self) -> int | None:
        """Index of the coordinate whose value is the joint's value; None without such a coordinate."""
        return self.coordinates[0] if self.kind != "fixed" and self.function == IDENTITY else None

    def value(self, q: Array) -> float:
        """Return the joint's value.

        Args:
            q: values of all coordinates (n,) of the mechanism.

        Returns:
            Value, rad or m; 0 for a fixed joint.
        """
        return self.function.evaluate(q[list(self.coordinates)])[0] if self.coordinates else 0.0

    def compute_transform(self, value: float) -> Array:
        """Return the child link's frame in the parent link's at a joint value.

        Args:
            value: value of the joint, rad or m.

        Returns:
            Transform (4, 4).
        """
        if self.kind == "fixed":
            return self.origin
        if self.kind == "revolute":
            return self.origin @ make_transform(rotation_about(self.axis, value))
        return self.origin @ make_transform(None, self.axis * value)


@dataclass(frozen=True, eq=False)
class Robot:
    """Tree of links from `WORLD`.

    Attributes:
        name: name of the robot.
        links: links, each after the link that carries it.
        joints: joints, in the order of their child links.
        mechanism: mechanism from which the robot was built.
    """

    name: str
    links: tuple[RobotLink, ...]
    joints: tuple[RobotJoint, ...]
    mechanism: Mechanism

    @cached_property
    def moving(self) -> tuple[RobotJoint, ...]:
        """Joints that are not fixed.

        Returns:
            Joints in the order of `joints`.
        """
        return tuple(joint for joint in self.joints if joint.kind != "fixed")

    @cached_property
    def link_of(self) -> dict[str, tuple[RobotLink, Array]]:
        """Link of each body (and ground) and the body's frame (4, 4) in it, by the body's absolute path.

        Returns:
            Link and frame by path.
        """
        return {path: (link, frame) for link in self.links for path, frame in link.bodies.items()}

    @cached_property
    def joint_of(self) -> dict[int, RobotJoint]:
        """Joint whose value is a coordinate, by the index of the coordinate, where there is one.

        Returns:
            Joints by index of the coordinate.
        """
        return {
            joint.coordinate: joint
            # Reversed, so that of several joints of one coordinate the first one stays.
            for joint in reversed(self.moving)
            if joint.coordinate is not None
        }

    def joint_values(self, q: Values) -> dict[str, float]:
        """Return the values of all moving joints.

        Args:
            q: coordinate values of the mechanism.

        Returns:
            Values (rad, m) by the names of the joints.
        """
        values = self.mechanism.values(q)
        return {joint.name: joint.value(values) for joint in self.moving}

    def joint_jacobian(self, q: Values) -> Array:
        """Return the derivatives of the values of the m moving joints by the n coordinates.

        Args:
            q: coordinate values of the mechanism.

        Returns:
            Matrix (m, n), rows in the order of `moving`.
        """
        values = self.mechanism.values(q)
        jacobian = np.zeros((len(self.moving), len(values)))
        for row, joint in enumerate(self.moving):
            columns = list(joint.coordinates)
            jacobian[row, columns] = joint.function.evaluate(values[columns])[1]
        return jacobian

    def link_transforms(self, q: Values) -> dict[str, Array]:
        """Return the frames of all links in the root link.

        Args:
            q: coordinate values of the mechanism.

        Returns:
            Transforms (4, 4) by the names of the links.
        """
        values = self.mechanism.values(q)
        # The root is first, and joints come in the order from it.
        transforms = {self.links[0].name: np.eye(4)}
        for joint in self.joints:
            transforms[joint.child] = transforms[joint.parent] @ joint.compute_transform(
                joint.value(values)
            )
        return transforms


class Box(NamedTuple):
    """Box centred on its origin.

    Attributes:
        size: complete edge lengths, m.
    """

    size: tuple[float, float, float]


class Ball(NamedTuple):
    """Sphere centred on its origin.

    Attributes:
        radius: radius, m.
    """

    radius: float


class Tube(NamedTuple):
    """Cylinder along the Z axis, centred on its origin.

    Attributes:
        radius: radius, m.
        length: complete length, m.
    """

    radius: float
    length: float


class MeshFile(NamedTuple):
    """Surface in a file.

    Attributes:
        file: path relative to the file of the robot.
        scale: factors of its coordinates.
    """

    file: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


Shape = Box | Ball | Tube | MeshFile


@dataclass(frozen=True, eq=False)
class Visual:
    """Shape of a link.

    Attributes:
        shape: the shape.
        origin: frame of the shape (4, 4) in the frame of the link or body that it belongs to.
        color: red, green, blue and opacity, 0 to 1.
        source: absolute path of the model's geometry.
    """

    shape: Shape
    origin: Array
    color: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    source: str = ""


def principal_axes(inertia: Array) -> tuple[Array, Array]:
    """Return the principal moments and axes of an inertia tensor.

    A tensor that is diagonal already keeps its axes; otherwise they are numbered so that they turn
    least.

    Args:
        inertia: symmetric tensor (3, 3), kg·m².

    Returns:
        Moments (3,), and axes (3, 3) as columns of a rotation matrix, with axes @ diag(moments) @
        axes.T = inertia.
    """
    # Diagonal inertias keep their exact numbers and their order.
    if not np.any(inertia - np.diag(np.diag(inertia))):
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    weights = np.abs(axes).tolist()
    # eigh() sorts by size. Axes in the order nearest to the link's own give small rotations in the
    # file.
    order = list(
        max(
            permutations(range(3)),
            key=lambda p: sum(weights[row][column] for row, column in enumerate(p)),
        )
    )
    moments = moments[order]
    axes = axes[:, order]
    axes = axes * np.where(np.diag(axes) < 0.0, -1.0, 1.0)
    # A reflection becomes a rotation by turning the axis that is least determined.
    if np.linalg.det(axes) < 0.0:
        weakest = int(np.argmin(np.abs(np.diag(axes))))
        axes[:, weakest] *= -1.0
    return moments, axes


def breaks_triangle_rule(moments: Array) -> bool:
    """Return whether no body has these principal moments.

    One moment then exceeds the sum of the others, or is negative. Programs react differently
    (Bullet takes zero instead). A thin rod or plate, for which the rule holds with equality, passes
    up to rounding.

    Args:
        moments: principal moments (3,), kg·m².
    """
    small, middle, large = np.sort(moments).tolist()
    # A rod fulfils the rule with equality, up to rounding.
    return bool(small < 0.0 or large > (small + middle) * (1.0 + 1e-12))
