"""Tags of older formats: what stands for them now. In a file of the current version OpenSim passes over them."""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from osimlite.schema.base import Object
from osimlite.schema.specs import field_specs


class Successor(NamedTuple):
    """The version that did away with a tag, the tag that says the same now (if one does), and what else is to do."""

    since: int
    tag: str | None
    hint: str = ""


_FRAMES: Final = "a PhysicalOffsetFrame in <frames>"
_OLD: Final[dict[str, dict[str, Successor]]] = {
    "Joint": {
        "parent_body": Successor(30505, "socket_parent_frame"),
        "socket_parent_body": Successor(30505, "socket_parent_frame"),
        "socket_child_body": Successor(30505, "socket_child_frame"),
        "CoordinateSet": Successor(30507, None, "write <coordinates>, without <objects>"),
        "reverse": Successor(30514, None, "swap the parent and the child"),
    }
    | {
        f"{what}{side}": Successor(30505, None, f"write {_FRAMES}")
        for what in ("location", "orientation")
        for side in ("_in_parent", "_in_child", "")
    },
    "Body": {f"inertia_{axes}": Successor(30500, "inertia") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")}
    | {
        "Joint": Successor(30501, None, "it belongs in the JointSet of the model"),
        "VisibleObject": Successor(30502, None, "write <attached_geometry>"),
    },
    "Marker": {"body": Successor(30501, "socket_parent_frame")},
    "AbstractPathPoint": {"body": Successor(30505, "socket_parent_frame")},
    "ConditionalPathPoint": {"coordinate": Successor(30505, "socket_coordinate")},
    "MovingPathPoint": {
        f"{axis}_coordinate": Successor(30505, f"socket_{axis}_coordinate") for axis in ("x", "y", "z")
    },
    "ContactGeometry": {
        "body_name": Successor(30505, "socket_frame"),
        "display_preference": Successor(30507, "Appearance"),
        "color": Successor(30507, "Appearance"),
    },
    "PrescribedForce": {"body": Successor(30506, "socket_frame")},
    "GeometryPath": {
        "VisibleObject": Successor(30516, "Appearance"),
        "display_preference": Successor(30516, "Appearance"),
    },
    "Force": {"isDisabled": Successor(30509, "appliesForce", "with the opposite value")},
    "Constraint": {"isDisabled": Successor(30509, "isEnforced", "with the opposite value")},
    "Controller": {
        "isDisabled": Successor(30509, "enabled", "with the opposite value"),
        "actuator_list": Successor(40600, "socket_actuators", "with the paths of the actuators"),
    },
    "Probe": {"isDisabled": Successor(30511, "enabled", "with the opposite value")},
    "PointConstraint": {f"body_{n}": Successor(30500, f"socket_body_{n}") for n in (1, 2)},
    "ConstantDistanceConstraint": {f"body_{n}": Successor(30500, f"socket_body_{n}") for n in (1, 2)},
    "PointToPointSpring": {f"body{n}": Successor(30500, f"socket_body{n}") for n in (1, 2)},
    "TwoFrameLinker": {f"body_{n}": Successor(30505, f"socket_frame{n}") for n in (1, 2)},
    "WeldConstraint": {f"body_{n}": Successor(30505, f"socket_frame{n}") for n in (1, 2)},
    "Component": {"connectors": Successor(30508, None, "write one <socket_...> element for each")},
}
_CONNECTEE = re.compile(r"(?:socket|connector)_(\w+?)(?:_connectee_name)?s?")


def successor(cls: type[Object], tag: str) -> Successor | None:
    """What stands for an old tag in objects of a class; None of a tag that no format had."""
    specs = field_specs(cls)
    for base in cls.__mro__:
        known = _OLD.get(base.__name__, {}).get(tag)
        if known is not None and (known.tag is None or known.tag in specs):
            return known
    match = _CONNECTEE.fullmatch(tag)
    if match is not None and f"socket_{match[1]}" in specs:
        return Successor(30517, f"socket_{match[1]}")
    return None
