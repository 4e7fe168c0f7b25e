"""What a robot file cannot say about coordinates, as JSON beside it: enough to compute every joint from them.

The value of joint j is ``function(values of its coordinates)``, whatever the function; the frame of a body in ground is
the frame of its link times ``frame``. docs/urdf.md tells the whole format.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

from osimlite.multibody.functions import IDENTITY
from osimlite.robot.mimics import couplers, mimics
from osimlite.robot.robot import Robot
from osimlite.translate.function_data import as_data

FORMAT, VERSION = "osimlite-coordinates", 1


def coordinates_json(robot: Robot, file: str) -> str:
    """The text of the sidecar.

    Args:
        robot: as it was written, with its final names.
        file: name of the robot's file.
    """
    paths = [info.path for info in robot.mechanism.coordinates]
    drives: dict[int, list[str]] = {}
    for joint in robot.moving:
        for place in joint.coordinates:
            drives.setdefault(place, []).append(joint.name)
    following = mimics(robot)
    sections: Mapping[str, Iterable[Mapping[str, Any]]] = {
        "coordinates": [
            {
                "path": info.path,
                "name": info.name,
                "unit": {"rotational": "rad", "translational": "m"}.get(info.motion_type),
                "joint": robot.joint_of[place].name if place in robot.joint_of else None,
                "drives": drives.get(place, []),
                "default_value": info.default_value,
                "default_speed": info.default_speed,
                "range": info.range,
                "clamped": info.clamped,
                "locked": info.locked,
                "prescribed": None if info.prescribed is None else as_data(info.prescribed),
            }
            for place, info in enumerate(robot.mechanism.coordinates)
        ],
        "joints": [
            {
                "name": joint.name,
                "of": joint.source,
                "kind": joint.kind,
                "coordinates": [paths[place] for place in joint.coordinates],
                "function": as_data(joint.function),
                **({"identity": True} if joint.function == IDENTITY else {}),
                **(
                    {"mimics": mimic.leader, "multiplier": mimic.line.slope, "offset": mimic.line.start}
                    if (mimic := following.get(joint.name))
                    else {}
                ),
            }
            for joint in robot.moving
        ],
        "couplers": [
            {
                "path": coupler.name,
                "dependent": paths[coupler.dependent],
                "independent": [paths[place] for place in coupler.independent],
                "function": as_data(coupler.function),
            }
            for coupler in couplers(robot)
        ],
        "bodies": [
            {"path": path, "link": link.name, "frame": frame.tolist()} for path, (link, frame) in robot.link_of.items()
        ],
        "shapes": [
            {"path": shape.source, "link": link.name, "as": kind}
            for link in robot.links
            for kind, shapes in (("visual", link.visuals), ("collision", link.collisions))
            for shape in shapes
            if shape.source
        ],
    }
    head = {"format": FORMAT, "version": VERSION, "model": robot.mechanism.name, "robot": robot.name, "file": file}
    lines = [f'  "{name}": {_text(value)}' for name, value in head.items()]
    for name, items in sections.items():
        rows = ",\n".join(f"    {_text(item)}" for item in items)
        lines.append(f'  "{name}": [\n{rows}\n  ]' if rows else f'  "{name}": []')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _text(value: Any) -> str:
    return json.dumps(finite(value), ensure_ascii=False, allow_nan=False)


def finite(value: Any) -> Any:
    """Plain data with null for numbers that JSON has no word for."""
    match value:
        case float():
            return value if math.isfinite(value) else None
        case dict():
            return {key: finite(item) for key, item in value.items()}
        case list() | tuple():
            return [finite(item) for item in value]
    return value
