"""Joints of a model as nimblephysics reads them; AddBiomechanics and SKEL are based on it.

Nimble's reader replaces a CustomJoint by a simpler joint where the functions allow it, and ignores
slopes, offsets and constants then. It leaves out the patellae, and reads only the largest tree of
bodies. The rules are those of ``dart/biomechanics/OpenSimParser.cpp`` of nimblephysics 0.10.52.
"""

from __future__ import annotations

from enum import Enum

from osimlite.errors import ModelError
from osimlite.schema.base import Component, Object
from osimlite.schema.coordinates import Coordinate
from osimlite.schema.custom_joint import CustomJoint, TransformAxis
from osimlite.schema.frames import PhysicalOffsetFrame
from osimlite.schema.functions import Constant, Function, LinearFunction, MultiplierFunction
from osimlite.schema.joint_types import (
    ConstantCurvatureJoint,
    EllipsoidJoint,
    ScapulothoracicJoint,
    UniversalJoint,
)
from osimlite.schema.joints import Joint, PinJoint, WeldJoint
from osimlite.schema.model import Model
from osimlite.schema.tree import Tree

OMITTED_JOINTS = ("patellofemoral_r", "patellofemoral_l")
"""Joints that Nimble leaves out, by their names."""

OMITTED_BODIES = ("patella_r", "patella_l")
"""Bodies that Nimble leaves out, by their names."""

JOINT_SET_VERSION = 30501
"""Version of a document from which joints are no longer parts of their bodies."""

JOINT_CLASSES = (
    CustomJoint,
    WeldJoint,
    PinJoint,
    UniversalJoint,
    EllipsoidJoint,
    ScapulothoracicJoint,
    ConstantCurvatureJoint,
)
"""Classes of joints that Nimble reads; it refuses a model with others."""


SCAPULA_WORDS = ("abduction", "elevation", "upward")
"""Words in the names of the coordinates of a shoulder blade, in the order that Nimble's rotations have."""

MODEL_NAMES = ("optimized_scale_and_markers",)
"""Names of models that AddBiomechanics writes."""

ROTATED_FRAME_SUFFIX = "_nimble"
"""Ending of the names of frames that turn an EllipsoidJoint of Nimble into one of OpenSim."""


class NimbleJoint(Enum):
    """Joint that Nimble makes of a CustomJoint."""

    WELD = "a weld"
    EULER_FREE = "three rotations and three translations"
    EULER = "three rotations"
    REVOLUTE = "one rotation"
    PRISMATIC = "one translation"
    UNIVERSAL = "two rotations"
    CUSTOM = "six functions"


DOF_COUNTS = {
    NimbleJoint.WELD: 0,
    NimbleJoint.EULER_FREE: 6,
    NimbleJoint.EULER: 3,
    NimbleJoint.REVOLUTE: 1,
    NimbleJoint.PRISMATIC: 1,
    NimbleJoint.UNIVERSAL: 2,
}
"""Number of degrees of freedom of each joint but CUSTOM, which has one for each coordinate."""


def unwrap_function(axis: TransformAxis) -> tuple[Function | None, float]:
    """Separate the function of an axis from its factor.

    Returns:
        The function without its MultiplierFunction, and the factor (1 without one).
    """
    function = axis.function
    if isinstance(function, MultiplierFunction):
        return function.function, float(function.scale)
    return function, 1.0


def classify_custom_joint(joint: CustomJoint) -> NimbleJoint:
    """Return which joint Nimble makes of a CustomJoint."""
    kinds, constants = [], []
    for axis in joint.spatial_transform.axes().values():
        function, scale = unwrap_function(axis)
        if isinstance(function, Constant):
            kinds.append("constant")
            constants.append(float(function.value) * scale)
        else:
            kinds.append("linear" if isinstance(function, LinearFunction) else "curve")
    # The decisions follow the order of the tests in Nimble's parser.
    linear = [index for index, kind in enumerate(kinds) if kind == "linear"]
    count = len(joint.coordinates)
    # All functions are zero.
    if len(constants) == 6 and not any(constants):
        return NimbleJoint.WELD
    if "curve" in kinds:
        return NimbleJoint.CUSTOM
    if len(linear) == 6 and count == 6:
        return NimbleJoint.EULER_FREE
    # Nimble reads the first three axes only, if they rotate.
    if linear[:3] == [0, 1, 2] and count in (3, 6):
        return NimbleJoint.EULER
    if len(linear) == 1:
        return NimbleJoint.REVOLUTE if linear[0] < 3 else NimbleJoint.PRISMATIC
    # Two rotations; a rotation with a translation is CUSTOM.
    if len(linear) == 2 and linear[1] < 3:
        return NimbleJoint.UNIVERSAL
    return NimbleJoint.CUSTOM


def has_rotated_frames(joint: EllipsoidJoint) -> bool:
    """Return whether the frames of an EllipsoidJoint of Nimble were turned for OpenSim."""
    frame = joint.socket_child_frame
    return str(getattr(frame, "name", frame)).endswith(ROTATED_FRAME_SUFFIX)


def is_nimble_ellipsoid(joint: EllipsoidJoint, model_name: str) -> bool:
    """Return whether an EllipsoidJoint was probably made for Nimble, and not yet rewritten for OpenSim.

    Args:
        joint: joint of a model.
        model_name: name of the model.
    """
    # A file that was rewritten must not be rewritten again.
    if has_rotated_frames(joint):
        return False
    names = [coordinate.name.lower() for coordinate in joint.coordinates]
    is_scapula = len(names) == len(SCAPULA_WORDS) and all(
        word in name for word, name in zip(SCAPULA_WORDS, names, strict=True)
    )
    return is_scapula or model_name in MODEL_NAMES


def count_dofs(joint: Joint) -> int:
    """Return the number of degrees of freedom of a joint in Nimble."""
    count = len(joint.coordinates)
    if isinstance(joint, CustomJoint):
        return min(count, DOF_COUNTS.get(classify_custom_joint(joint), count))
    return count


def list_coordinates(model: Model) -> list[Coordinate]:
    """Return the coordinates of a model in the order of Nimble's degrees of freedom.

    The bodies are visited depth-first, the children of a body in the order of their joints in the
    file. In files of OpenSim 3, where joints are parts of bodies, the order is that of the file.
    Within a joint the coordinates have the order of the file.
    """
    tree = model.tree()
    children: dict[str, list[tuple[Joint, str]]] = {}
    bodies = {path for body in model.body_set.objects if (path := tree.path_of(body)) is not None}
    bodies = {path for path in bodies if path.rpartition("/")[2] not in OMITTED_BODIES}
    roots: list[tuple[Joint, str]] = []
    # An object of an unknown class is not a Joint.
    joint_objects: list[Object] = [*model.joint_set.objects]
    for joint in joint_objects:
        if not isinstance(joint, Joint):
            continue
        child = _find_body(tree, joint, "socket_child_frame")
        if joint.name in OMITTED_JOINTS or child is None or child not in bodies:
            continue
        parent = _find_body(tree, joint, "socket_parent_frame")
        edges = children.setdefault(parent, []) if parent in bodies and parent else roots
        edges.append((joint, child))
    # Nimble keeps the largest tree.
    joints = max((_list_tree_joints(children, root) for root in roots), key=len, default=[])
    if model.document_version < JOINT_SET_VERSION:
        selected = {id(joint) for joint in joints}
        joints = [
            member
            for member in joint_objects
            if isinstance(member, Joint) and id(member) in selected
        ]
    return [
        coordinate
        for joint in joints
        for coordinate in list(joint.coordinates)[: count_dofs(joint)]
    ]


def _list_tree_joints(
    children: dict[str, list[tuple[Joint, str]]], root: tuple[Joint, str]
) -> list[Joint]:
    """Return the joints of a tree depth-first."""
    result: list[Joint] = []
    waiting = [root]
    visited = set[str]()
    while waiting:
        joint, child = waiting.pop()
        if child in visited:
            # A body with two joints closes a loop, which Nimble cannot read.
            continue
        visited.add(child)
        result.append(joint)
        waiting += reversed(children.get(child, ()))
    return result


def _find_body(tree: Tree, owner: Component, socket: str) -> str | None:
    """Return the path of the body or ground that a socket leads to; None if it leads nowhere."""
    visited: set[int] = set()
    while True:
        try:
            target = tree.target(owner, socket, getattr(owner, socket))
        except ModelError:
            return None
        # Offset frames lead to the body or ground, unless they form a circle.
        if not isinstance(target, PhysicalOffsetFrame):
            return tree.path_of(target)
        if id(target) in visited:
            return None
        visited.add(id(target))
        owner, socket = target, "socket_parent"
