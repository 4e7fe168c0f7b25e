"""JSON file beside a robot file, with what the robot file cannot express about coordinates.

It suffices to compute every joint from the coordinates: the value of a joint is `function(values of
its coordinates)`, and the frame of a body in ground is the frame of its link times `frame`.
docs/urdf.md defines the format.
"""

from __future__ import annotations

import json
import math
from typing import Any

from osimlite.mechanics.multibody.functions import IDENTITY
from osimlite.simulation.robot.couplings import find_mimics, list_couplers
from osimlite.simulation.robot.robot import Robot
from osimlite.translate.function_data import describe_function

FORMAT = "osimlite-coordinates"
"""Name of the format, so that a reader can recognize the file."""
VERSION = 1
"""Version of the format; it increases with incompatible changes."""


def format_coordinates(robot: Robot, file: str) -> str:
    """Return the text of the JSON file.

    Args:
        robot: robot with its final names.
        file: name of the robot file.

    Raises:
        UnsupportedError: a function is of a class that the format does not have.
    """
    sections = {
        "coordinates": _list_coordinates(robot),
        "joints": _list_joints(robot),
        "couplers": _list_couplers(robot),
        # Several bodies may share a link, and a body's frame may differ from that of its link.
        "bodies": [
            {"path": path, "link": link.name, "frame": frame.tolist()}
            for path, (link, frame) in robot.link_of.items()
        ],
        "shapes": [
            {"path": shape.source, "link": link.name, "as": shape_type}
            for link in robot.links
            for shape_type, shapes in (("visual", link.visuals), ("collision", link.collisions))
            for shape in shapes
            if shape.source
        ],
    }
    header = {
        "format": FORMAT,
        "version": VERSION,
        "model": robot.mechanism.name,
        "robot": robot.name,
        "file": file,
    }
    lines = [f'  "{name}": {_format_json(value)}' for name, value in header.items()]
    for name, items in sections.items():
        rows = ",\n".join(f"    {_format_json(item)}" for item in items)
        lines.append(f'  "{name}": [\n{rows}\n  ]' if rows else f'  "{name}": []')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _list_coordinates(robot: Robot) -> list[dict[str, Any]]:
    """Return an entry for each coordinate: its path, unit, default values and joints."""
    driven_joints: dict[int, list[str]] = {}
    for joint in robot.moving:
        for index in joint.coordinates:
            # A coordinate may drive several joints, and a joint may depend on several coordinates.
            driven_joints.setdefault(index, []).append(joint.name)
    return [
        {
            "path": info.path,
            "name": info.name,
            "unit": info.unit or None,
            "joint": robot.joint_of[index].name if index in robot.joint_of else None,
            "drives": driven_joints.get(index, []),
            "default_value": info.default_value,
            "default_speed": info.default_speed,
            "range": info.range,
            "clamped": info.clamped,
            "locked": info.locked,
            "prescribed": None if info.prescribed is None else describe_function(info.prescribed),
        }
        for index, info in enumerate(robot.mechanism.coordinates)
    ]


def _list_joints(robot: Robot) -> list[dict[str, Any]]:
    """Return an entry for each moving joint: its coordinates and its function of them."""
    mimics_by_joint = find_mimics(robot)
    coordinates = robot.mechanism.coordinates
    result: list[dict[str, Any]] = []
    for joint in robot.moving:
        entry: dict[str, Any] = {
            "name": joint.name,
            "of": joint.source,
            "kind": joint.kind,
            "coordinates": [coordinates[index].path for index in joint.coordinates],
            "function": describe_function(joint.function),
        }
        # Readers can use such a joint without evaluating a function.
        if joint.function == IDENTITY:
            entry["identity"] = True
        if (mimic := mimics_by_joint.get(joint.name)) is not None:
            entry |= {
                "mimics": mimic.leader,
                "multiplier": mimic.line.slope,
                "offset": mimic.line.offset,
            }
        result.append(entry)
    return result


def _list_couplers(robot: Robot) -> list[dict[str, Any]]:
    """Return an entry for each coupler: its coordinates and its function."""
    coordinates = robot.mechanism.coordinates
    return [
        {
            "path": coupler.name,
            "dependent": coordinates[coupler.dependent].path,
            "independent": [coordinates[index].path for index in coupler.independent],
            "function": describe_function(coupler.function),
        }
        for coupler in list_couplers(robot)
    ]


def _format_json(value: Any) -> str:
    """Return a value as JSON text, without NaN and infinity, which JSON lacks."""
    return json.dumps(replace_non_finite(value), allow_nan=False)


def replace_non_finite(value: Any) -> Any:
    """Return plain data in which numbers that JSON cannot express are null."""
    match value:
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {key: replace_non_finite(member) for key, member in value.items()}
        case list() | tuple():
            return [replace_non_finite(member) for member in value]
    return value
