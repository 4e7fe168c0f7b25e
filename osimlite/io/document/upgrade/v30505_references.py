"""To 30500, 30501, 30505 and 30506: a component names another by its path."""

from __future__ import annotations

from typing import cast

from lxml import etree

from osimlite.base.text import unused
from osimlite.io.document.upgrade.draft import Draft, Element, body_path, members, plain, step

_CONSTRAINTS = {
    "PointConstraint": ("body_1", "body_2"),
    "ConstantDistanceConstraint": ("body_1", "body_2"),
    "PointOnLineConstraint": ("line_body", "follower_body"),
    "RollingOnSurfaceConstraint": ("rolling_body", "surface_body"),
    "PointToPointSpring": ("body1", "body2"),
}


@step(below=30500)
def constraint_bodies(draft: Draft) -> None:
    """Constraints and springs between two bodies name them by path."""
    for constraint in draft.tagged(*_CONSTRAINTS):
        result = [
            _to_body(draft, constraint, tag, f"socket_{tag}")
            for tag in _CONSTRAINTS[constraint.tag]
        ]
        if any(result):
            draft.changed(constraint)


def _naming(name: str, below: int, whose: str, family: str, tag: str, socket: str) -> None:
    """Register the step `name`: the body that a tag of a class names is named by its path, in a socket."""

    def named(draft: Draft) -> None:
        for component in draft.every(family):
            if _to_body(draft, component, tag, socket):
                draft.changed(component)

    named.__name__, named.__doc__ = name, f"{whose} body by path."
    step(below=below)(named)


_naming("marker_frames", 30501, "A marker names its", "Marker", "body", "socket_parent_frame")
_naming(
    "point_bodies",
    30505,
    "Path points name their",
    "AbstractPathPoint",
    "body",
    "socket_parent_frame",
)
_naming(
    "contact_bodies",
    30505,
    "Contact geometry names its",
    "ContactGeometry",
    "body_name",
    "socket_frame",
)
_naming(
    "force_frames", 30506, "A prescribed force names its", "PrescribedForce", "body", "socket_frame"
)


@step(below=30505)
def point_coordinates(draft: Draft) -> None:
    """Conditional and moving path points name their coordinates by path.

    OpenSim takes the first object of that name for the coordinate, whatever it is; here only
    coordinates count.
    """
    paths: dict[str, str] | None = None
    taken: dict[str, str] = {}
    for point in draft.tagged("ConditionalPathPoint", "MovingPathPoint"):
        axes = ("",) if point.tag == "ConditionalPathPoint" else ("x_", "y_", "z_")
        result = [child for axis in axes if (child := point.find(f"{axis}coordinate")) is not None]
        for child in result:
            if paths is None:
                paths = _coordinate_paths(draft)
            name = plain(child)
            child.text = paths.get(name, name)
            if name in paths and name not in taken:
                taken[name] = _path_by_opensim(draft, name)
            if name in paths and taken[name] != paths[name]:
                draft.refuse(
                    point,
                    child,
                    f"coordinate '{name}' is '{taken[name]}' for OpenSim, by the first element of that name, and not "
                    f"'{paths[name]}'",
                )
            draft.rename(child, f"socket_{child.tag}")
        if result:
            draft.changed(point)


def _to_body(draft: Draft, owner: Element, tag: str, socket: str) -> bool:
    child = owner.find(tag)
    if child is None:
        return False
    child.text = body_path(plain(child))
    draft.rename(child, socket)
    return True


def _path_by_opensim(draft: Draft, name: str) -> str:
    """What OpenSim takes for the path of a coordinate: it looks for any element with that name, and two levels up.

    It has put the joints behind the bodies then, and what held the axes of a joint before the
    element in front of it.
    """

    def order(element: Element) -> tuple[int, bool, float, int]:
        number, top = float(draft.numbers[element]), element
        while (above := top.getparent()) is not None and above is not draft.model:
            if top.tag == "SpatialTransform":
                before = [
                    child
                    for child in top.itersiblings(etree.Element, preceding=True)
                    if child.tag != "reverse"
                ]
                if before and before[0].tag == "CoordinateSet":
                    number = draft.numbers[before[0]] - 0.5
            top = above
        return draft.numbers[top], top.tag == "JointSet", number, draft.numbers[element]

    result = cast("list[Element]", draft.root.xpath("//*[@name=$name]", name=name))
    wrapper = min(result, key=order).getparent() if result else None
    above = None if wrapper is None else wrapper.getparent()
    if above is not None and above.tag == "CoordinateSet":
        above = above.getparent()
    return name if above is None else f"/jointset/{above.get('name') or above.tag.lower()}/{name}"


def _coordinate_paths(draft: Draft) -> dict[str, str]:
    """The path of the first coordinate of each name; joints of the same name are told apart as OpenSim does."""
    paths: dict[str, str] = {}
    taken: set[str] = set()
    for joint in (
        joint for _, joint_set in draft.of_model("JointSet") for joint in members(joint_set)
    ):
        name = joint.get("name") or joint.tag.lower()
        free = unused(name, taken, 0)
        taken.add(free)
        for coordinate in joint.iter("Coordinate"):
            paths.setdefault(
                coordinate.get("name", ""), f"/jointset/{free}/{coordinate.get('name')}"
            )
    return paths
