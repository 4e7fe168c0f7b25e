"""Tags of older formats, which OpenSim ignores in current files, and their replacements."""

from __future__ import annotations

from typing import Final

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.schema.base import Object
from osimlite.schema.specs import get_field_specs


class Successor(NamedTuple):
    """Version that removed a tag, the tag that replaces it (if any), and a hint."""

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
    "Body": {
        f"inertia_{axes}": Successor(30500, "inertia")
        for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    }
    | {
        "Joint": Successor(30501, None, "it belongs in the JointSet of the model"),
        "VisibleObject": Successor(30502, None, "write <attached_geometry>"),
    },
    "Marker": {"body": Successor(30501, "socket_parent_frame")},
    "AbstractPathPoint": {"body": Successor(30505, "socket_parent_frame")},
    "ConditionalPathPoint": {"coordinate": Successor(30505, "socket_coordinate")},
    "MovingPathPoint": {
        f"{axis}_coordinate": Successor(30505, f"socket_{axis}_coordinate")
        for axis in ("x", "y", "z")
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
    "ConstantDistanceConstraint": {
        f"body_{n}": Successor(30500, f"socket_body_{n}") for n in (1, 2)
    },
    "PointToPointSpring": {f"body{n}": Successor(30500, f"socket_body{n}") for n in (1, 2)},
    "TwoFrameLinker": {f"body_{n}": Successor(30505, f"socket_frame{n}") for n in (1, 2)},
    "WeldConstraint": {f"body_{n}": Successor(30505, f"socket_frame{n}") for n in (1, 2)},
    "Component": {"connectors": Successor(30508, None, "write one <socket_...> element for each")},
}
_UNUSED: Final[dict[str, dict[str, str]]] = {
    "MovingPathPoint": {
        "location": "its functions <x_location>, <y_location> and <z_location> give the location"
    },
    "Component": {"VisibleObject": "OpenSim 4 draws by attached_geometry and Appearance"},
    "Thelen2003Muscle": {
        tag: "this class of muscles has never had this property"
        for tag in ("Vmax", "Vmax0", "damping", "muscle_model")
    },
    "Millard2012EquilibriumMuscle": {
        tag: "this class of muscles has no such property"
        for tag in (
            "MuscleFirstOrderActivationDynamicModel",
            "MuscleSecondOrderActivationDynamicModel",
            "ForceVelocityInverseCurve",
        )
    },
    "ForceSet": {"datafile": "ExternalLoads name the file with the forces"},
    "Joint": {"use_euler_angles": "a CustomJoint or GimbalJoint uses angles anyway"},
    "Schutte1993Muscle_Deprecated": {
        "force_velocity_curve": "this class of muscles has no such curve"
    },
    "Coordinate": {
        tag: "use a spring or a CoordinateLimitForce instead"
        for tag in (
            "stiffness",
            "restraint_function",
            "restraint_active",
            "min_restraint_function",
            "max_restraint_function",
            "keys",
        )
    },
    "SmoothSphereHalfSpaceForce": {
        "derivative_smoothing": "no release of OpenSim has ever read this element"
    },
    # OpenSim 2 wrote these into its setups.
    "Tool": {"input_directory": "write the folder into the names of the files"},
    "InverseKinematicsTool": {
        "coordinates_in_degrees": "the header of the coordinate_file says inDegrees"
    },
}
"""Tags of real files that OpenSim 4.6 reads in no version of a document, with replacements."""
_COMMENTS: Final = frozenset(
    (
        "annotation",
        "annotations",
        "comment",
        "comments",
        "note",
        "notes",
        "remark",
        "remarks",
        "todo",
    )
)
"""Tags, in small letters, of elements that programs write for comments."""
_CONNECTEE = compile_later(r"(?:socket|connector)_(\w+?)(?:_connectee_name)?s?")


def successor(cls: type[Object], tag: str) -> Successor | None:
    """Return the replacement of an old tag in objects of a class; None for an unknown tag."""
    specs = get_field_specs(cls)
    for base in cls.__mro__:
        candidate = _OLD.get(base.__name__, {}).get(tag)
        # The successor must be a property of this class: derived classes may lack it.
        if candidate is not None and (candidate.tag is None or candidate.tag in specs):
            return candidate
    # Connectors were renamed to sockets in version 30517.
    match = _CONNECTEE.fullmatch(tag)
    if match is not None and f"socket_{match[1]}" in specs:
        return Successor(30517, f"socket_{match[1]}")
    return None


def reason_unused(cls: type[Object], tag: str) -> str | None:
    """Return the replacement of a tag that no version of OpenSim reads in a class, or None."""
    for base in cls.__mro__:
        reason = _UNUSED.get(base.__name__, {}).get(tag)
        if reason is not None:
            return reason
    return None


def is_comment(tag: str) -> bool:
    """Return whether an element with this tag is a comment that a program wrote as an element."""
    return tag.lower() in _COMMENTS
