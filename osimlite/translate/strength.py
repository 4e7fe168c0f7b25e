"""Limits of effort and velocity of joints: from coordinate actuators, and from the user."""

from __future__ import annotations

import math

from osimlite.base.records import replace
from osimlite.errors import ModelError
from osimlite.schema.actuators import CoordinateActuator
from osimlite.schema.model import Model
from osimlite.simulation.robot.robot import Robot, RobotJoint
from osimlite.translate.fidelity import Fidelity


def add_strength_limits(
    robot: Robot,
    model: Model,
    fidelity: Fidelity,
    *,
    effort: float | None = None,
    velocity: float | None = None,
) -> Robot:
    """Return the robot with limits of effort and velocity.

    The effort limit of a joint that is a coordinate is the sum of the largest forces of the
    coordinate's actuators (`optimal_force` times the largest absolute control), if all are finite.

    Args:
        robot: robot of the model.
        model: model with the actuators.
        fidelity: account that gets a record for each actuator which became a limit.
        effort: limit (N or N·m) of all other joints; None for no limit.
        velocity: limit (m/s or rad/s) of all joints, which OpenSim does not have; None for no
            limit.
    """
    tree = model.tree()
    index_by_path = {info.path: index for index, info in enumerate(robot.mechanism.coordinates)}
    result: dict[int, list[tuple[str, float]]] = {}
    for actuator in tree.components:
        if (
            not isinstance(actuator, CoordinateActuator)
            or not actuator.coordinate
            or not actuator.appliesForce
        ):
            continue
        try:
            index = index_by_path.get(
                tree.path_of(tree.target(actuator, "coordinate", actuator.coordinate)) or ""
            )
        except ModelError:
            continue
        # URDF's effort limit is symmetric.
        max_control = max(abs(actuator.min_control), abs(actuator.max_control))
        force = abs(actuator.optimal_force) * max_control if actuator.optimal_force else 0.0
        if index is not None:
            result.setdefault(index, []).append((tree.path_of(actuator) or "", force))
    limits: dict[str, float] = {}
    for index, actuators in result.items():
        total = sum(force for _, force in actuators)
        joint = robot.joint_of.get(index)
        # An actuator without bounds of its control has no largest force.
        if joint is None or not math.isfinite(total):
            continue
        limits[joint.name] = total
        unit = "N" if joint.kind == "prismatic" else "N m"
        for path, force in actuators:
            done = "left out; only its maximum force is written, as the effort limit of the joint"
            fidelity.add(
                "actuator",
                path,
                "an actuator of a coordinate",
                done,
                f"{force:g} {unit} of joint {joint.name}",
            )

    def limit_joint(joint: RobotJoint) -> RobotJoint:
        if joint.kind == "fixed":
            return joint
        return replace(joint, effort=limits.get(joint.name, effort), velocity=velocity)

    return replace(robot, joints=tuple(limit_joint(joint) for joint in robot.joints))
