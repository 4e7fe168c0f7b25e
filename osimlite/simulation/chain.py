"""Where the links of a robot are and how its joints move them, written as straight-line code.

Joints stand in the order in which an engine numbers its degrees of freedom; in the code, `q0` is the value of the
first and `r0` its rate. All vectors are along the axes of ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from osimlite.multibody.mechanism import GROUND
from osimlite.robot.robot import Robot, RobotJoint
from osimlite.simulation.script import ZERO, Matrix, Scalar, Script, Vector, matrix, vector


class Pose(NamedTuple):
    """A frame in ground."""

    rotation: Matrix
    origin: Vector


class JacobianColumn(NamedTuple):
    """What a unit rate of one joint gives: angular velocity of a body, and velocity of a point of it."""

    joint: int
    turning: Vector
    moving: Vector


class Chain:
    """The joints of a robot between ground and its links.

    Args:
        robot: without fixed joints.
        joints: its joints in the order of the degrees of freedom.
    """

    def __init__(self, robot: Robot, joints: Sequence[RobotJoint]) -> None:
        self.robot = robot
        self.joints = tuple(joints)
        self._above = {joint.child: place for place, joint in enumerate(self.joints)}
        bodies = robot.mechanism.bodies
        self._links = {index: robot.link_of[body.path] for index, body in enumerate(bodies)}

    def parent(self, joint: int) -> int:
        """The joint that carries a joint, -1 if none does."""
        return self._above.get(self.joints[joint].parent, -1)

    def path(self, body: int) -> tuple[int, ...]:
        """The joints from ground to a body."""
        joint = -1 if body == GROUND else self._above.get(self._links[body][0].name, -1)
        found: list[int] = []
        while joint >= 0:
            found.append(joint)
            joint = self.parent(joint)
        return tuple(reversed(found))

    def body(self, script: Script, body: int) -> Pose:
        """Frame of a body, or of ground."""
        if body == GROUND:
            return Pose(matrix(((1, 0, 0), (0, 1, 0), (0, 0, 1))), ZERO)
        link, frame = self._links[body]

        def place() -> Pose:
            return self._moved(script, self._link(script, self._above.get(link.name, -1)), frame)

        placed: Pose = script.once(("body", body), place)
        return placed

    def point(self, script: Script, body: int, station: Vector) -> Vector:
        """Position of a station of a body."""
        placed = self.body(script, body)
        position: Vector = script.once(
            ("point", body, station),
            lambda: script.combine((1.0, placed.origin), (1.0, script.apply(placed.rotation, station))),
        )
        return position

    def direction(self, script: Script, body: int, along: Vector) -> Vector:
        """A direction fixed in a body."""
        return script.apply(self.body(script, body).rotation, along)

    def columns(self, script: Script, base: int, body: int, point: Vector) -> list[JacobianColumn]:
        """Motion of `body` relative to `base`, the point taken as one of either, by each joint between them."""
        inner, outer = self.path(base), self.path(body)
        found = []
        for sign, joints, others in ((-1.0, inner, outer), (1.0, outer, inner)):
            for joint in joints:
                if joint in others:
                    continue
                axis, anchor = self.axis(script, joint)
                axis = script.combine((sign, axis))
                if self.joints[joint].kind == "prismatic":
                    found.append(JacobianColumn(joint, ZERO, axis))
                else:
                    arm = script.combine((1.0, point), (-1.0, anchor))
                    found.append(JacobianColumn(joint, axis, script.cross(axis, arm)))
        return found

    def velocity(self, script: Script, columns: Sequence[JacobianColumn], *, turning: bool = False) -> Vector:
        """Velocity of the point of some columns, or the angular velocity."""
        return script.combine(
            *((f"r{column.joint}", column.turning if turning else column.moving) for column in columns)
        )

    def axis(self, script: Script, joint: int) -> tuple[Vector, Vector]:
        """Axis of a joint, and where its motion starts from."""

        def make() -> tuple[Vector, Vector]:
            placed = self._origin(script, joint)
            return script.apply(placed.rotation, vector(self.joints[joint].axis)), placed.origin

        found: tuple[Vector, Vector] = script.once(("axis", joint), make)
        return found

    # --------------------------------------------------------------------------------------------- helpers
    def _origin(self, script: Script, joint: int) -> Pose:
        """Frame of a joint before its own motion."""
        placed: Pose = script.once(
            ("joint", joint),
            lambda: self._moved(script, self._link(script, self.parent(joint)), self.joints[joint].origin),
        )
        return placed

    def _link(self, script: Script, joint: int) -> Pose:
        """Frame of the link that a joint moves, or of ground."""
        if joint < 0:
            return self.body(script, GROUND)

        def make() -> Pose:
            start = self._origin(script, joint)
            if self.joints[joint].kind == "prismatic":
                axis, _ = self.axis(script, joint)
                return Pose(start.rotation, script.combine((1.0, start.origin), (f"q{joint}", axis)))
            turn = _turn(script, vector(self.joints[joint].axis), f"q{joint}")
            return Pose(script.multiply(start.rotation, turn), start.origin)

        placed: Pose = script.once(("link", joint), make)
        return placed

    @staticmethod
    def _moved(script: Script, start: Pose, frame: object) -> Pose:
        rows = [list(row) for row in frame]  # type: ignore[attr-defined]
        turn, shift = matrix(row[:3] for row in rows[:3]), vector(row[3] for row in rows[:3])
        return Pose(
            script.multiply(start.rotation, turn),
            script.combine((1.0, start.origin), (1.0, script.apply(start.rotation, shift))),
        )


def _turn(script: Script, axis: Vector, angle: str) -> Matrix:
    """Rotation about a known unit axis (Rodrigues' formula)."""
    s, c = script.assign(f"sin({angle})"), script.assign(f"cos({angle})")
    x, y, z = (float(part) for part in axis)
    skew = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    unit = (x, y, z)

    def entry(i: int, k: int) -> Scalar:
        both = unit[i] * unit[k]
        return script.sum((both,), ((1.0 if i == k else 0.0) - both, c), (skew[i][k], s))

    first, second, third = ((entry(i, 0), entry(i, 1), entry(i, 2)) for i in range(3))
    return first, second, third
