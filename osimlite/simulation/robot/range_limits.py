"""Coordinate ranges as hard limits of the joints, for programs that need limits."""

from __future__ import annotations

from osimlite.base.records import replace
from osimlite.simulation.robot.lines import as_line
from osimlite.simulation.robot.robot import Robot, RobotJoint


def range_limits(robot: Robot) -> Robot:
    """The same robot, with every joint that is a straight line of one coordinate limited to the coordinate's range."""

    def limited(joint: RobotJoint) -> RobotJoint:
        line = as_line(joint.function)
        if joint.kind == "fixed" or len(joint.coordinates) != 1 or line is None:
            return joint
        low, high = (
            line.slope * end + line.start
            for end in robot.mechanism.coordinates[joint.coordinates[0]].range
        )
        return replace(joint, limits=(min(low, high), max(low, high)))

    return replace(robot, joints=tuple(limited(joint) for joint in robot.joints))
