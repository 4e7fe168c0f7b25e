"""Coordinate ranges as hard limits of the joints, for programs that need limits."""

from __future__ import annotations

from dataclasses import replace

from osimlite.translate.robot import Robot, RobotJoint


def range_limits(robot: Robot) -> Robot:
    """The same robot, with every joint that is a multiple of one coordinate limited to the coordinate's range."""

    def limited(joint: RobotJoint) -> RobotJoint:
        slope = joint.function.slope
        if joint.kind == "fixed" or len(joint.coordinates) != 1 or slope is None:
            return joint
        low, high = (slope * end for end in robot.mechanism.coordinates[joint.coordinates[0]].range)
        return replace(joint, limits=(min(low, high), max(low, high)))

    return replace(robot, joints=tuple(limited(joint) for joint in robot.joints))
