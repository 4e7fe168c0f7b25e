"""Account of a translation for biorbd: joints, coordinates, and what is left out."""

from __future__ import annotations

import math

from osimlite.schema.coordinates import Coordinate
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree
from osimlite.simulation.robot.robot import Robot
from osimlite.translate.fidelity import LEFT_OUT, Fidelity
from osimlite.translate.survey import record_dropped_components


def has_limits(limits: tuple[float, float]) -> bool:
    """Return whether the range of a coordinate can be written: finite, with the lower end first."""
    lower, upper = limits
    return -math.inf < lower < upper < math.inf


def record_biomod_losses(model: Model, robot: Robot, fidelity: Fidelity) -> None:
    """Record what became of every component of a model for biorbd.

    Args:
        model: model that was translated.
        robot: robot form of the model, whose links are the segments.
        fidelity: account, which already has the bodies, constraints, markers and forces.
    """
    tree = model.tree()
    fidelity.translated["/"] = f"model {robot.name}"
    fidelity.translated["/ground"] = f"segment {robot.links[0].name}"
    _record_bodies(tree, robot, fidelity)
    for joint in tree.components:
        if isinstance(joint, Joint):
            _record_joint(joint, tree, robot, fidelity)
    for index, info in enumerate(robot.mechanism.coordinates):
        coordinate = tree.by_path.get(info.path)
        # Coordinates of a joint that OpenSim adds below a loose body are not components.
        if isinstance(coordinate, Coordinate):
            unit = "m" if info.motion_type == "translational" else "rad"
            _record_coordinate(index, coordinate, info.path, unit, robot, fidelity)
    # Parts of a translated component, such as the points of a path, need no record.
    for path in list(fidelity.translated):
        if path not in ("/", "/ground") and not isinstance(tree.by_path[path], PhysicalFrame):
            for below in tree.by_path:
                if below.startswith(f"{path}/"):
                    fidelity.translated.setdefault(below, fidelity.translated[path])
    record_dropped_components(tree, fidelity)


def _record_bodies(tree: Tree, robot: Robot, fidelity: Fidelity) -> None:
    """Record bodies without a joint, and bodies in closed loops."""
    for body in robot.mechanism.bodies:
        segment = robot.link_of[body.path][0].name
        joint_path = body.mobilizer.joint
        if body.path not in tree.by_path:
            fidelity.add(
                "loop",
                joint_path,
                "a closed loop of joints",
                "cut: a second part of the body, with a part of its mass, is at this joint; nothing holds the parts together",
                f"segment {segment}",
            )
            continue
        fidelity.translated[body.path] = f"segment {segment}"
        fidelity.note_name(body.path, "segment", body.name, segment)
        if joint_path not in tree.by_path:
            fidelity.add(
                "loose-body",
                body.path,
                "a body without a joint",
                "free to move relative to ground, as in OpenSim",
                joint_path,
            )


def _record_joint(joint: Joint, tree: Tree, robot: Robot, fidelity: Fidelity) -> None:
    """Record the segments that a joint moves, and speeds that have another meaning."""
    path = tree.path_of(joint) or ""
    segments = [moving.child for moving in robot.moving if moving.source == path]
    fidelity.translated[path] = f"segments {' '.join(segments)}" if segments else "fixed"
    if segments and not joint.speeds_are_rates:
        fidelity.add(
            "speeds",
            path,
            "a joint with three rotations, whose speeds are the components of its angular velocity",
            "three degrees of freedom with the same coordinates; their speeds are the rates of the coordinates",
        )


def _record_coordinate(
    index: int, coordinate: Coordinate, path: str, unit: str, robot: Robot, fidelity: Fidelity
) -> None:
    """Record the degree of freedom of a coordinate, and what biorbd has no property for.

    Args:
        index: index of the coordinate in the mechanism.
        coordinate: coordinate of the model.
        path: absolute path of the coordinate.
        unit: unit of its values.
        robot: robot form of the model.
        fidelity: account of the translation.
    """
    segments = [moving.child for moving in robot.moving if index in moving.coordinates]
    if not segments:
        fidelity.translated[path] = "fixed: its value is part of the pose of its segment"
        return
    fidelity.translated[path] = f"degree of freedom of segment {' '.join(segments)}"
    note = fidelity.add
    if coordinate.prescribed and coordinate.prescribed_function is not None:
        note(
            "prescribed",
            path,
            "a prescribed coordinate, which follows a function of time",
            "a degree of freedom that moves: drive it in your program",
        )
    if coordinate.default_value != 0.0:
        value = f"{coordinate.default_value:g} {unit}"
        note("default-pose", path, "a default value", f"{LEFT_OUT}: set it in your program", value)
    if coordinate.default_speed_value != 0.0:
        speed = f"{coordinate.default_speed_value:g} {unit}/s"
        note("default-speed", path, "a default speed", f"{LEFT_OUT}: set it in your program", speed)
    if not has_limits(coordinate.range):
        lower, upper = coordinate.range
        note(
            "coordinate-range",
            path,
            "a range that is not finite, or whose lower end is not below the upper one",
            f"{LEFT_OUT}: biorbd uses its own default",
            f"{lower:g} to {upper:g} {unit}",
        )
