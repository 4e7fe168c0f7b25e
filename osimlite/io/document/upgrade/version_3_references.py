"""Steps of format 30500 to 30517: sockets, offset frames, and references by path."""

from __future__ import annotations

import re
from typing import cast

from lxml import etree

from osimlite.base.patterns import compile_later
from osimlite.base.text import make_unique_name
from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    find_with_child,
    get_text,
    list_elements,
    list_members,
    make_body_path,
    make_path,
    parse_reals,
)

_SUFFIX = compile_later(r"((?:socket|input)_.*)_connectee_names?")


def convert_connectors(draft: Draft) -> None:
    """Turn each entry of <connectors> into an element <socket_...>."""
    for component, old in find_with_child(draft.find_all("Component"), "connectors"):
        # OpenSim leaves connectors with other names alone.
        if not all(
            re.fullmatch(r"\w+", connector.get("name", "")) for connector in list_elements(old)
        ):
            continue
        # OpenSim puts each new element before the others: of two for one socket, the last counts.
        for connector in reversed(list_elements(old)):
            connectee = connector.find("connectee_name")
            text = "" if connectee is None else get_text(connectee)
            draft.add(component, f"socket_{connector.get('name', '')}", text, source=connector)
        draft.record_change(component, location=old)
        draft.remove(old)


def rename_connectors(draft: Draft) -> None:
    """Rename elements <connector_...> to <socket_...>."""
    for component in draft.find_all("Component"):
        for child in list_elements(component):
            if child.tag.startswith("connector_"):
                draft.rename(child, child.tag.replace("connector", "socket", 1))
                draft.record_change(component, location=child)


def shorten_connectee_names(draft: Draft) -> None:
    """Remove the ending _connectee_name of sockets and inputs."""
    for component in draft.find_all("Component"):
        for child in list_elements(component):
            match = _SUFFIX.fullmatch(child.tag)
            if match is not None:
                draft.rename(child, match[1])
                draft.record_change(component, location=child)


def complete_body_paths(draft: Draft) -> None:
    """Add the sets that relative paths to bodies leave out.

    Development versions of OpenSim 4 wrote such paths; OpenSim 4.6 finds nothing there.
    """
    paths = {"ground": "/ground"}
    for _, bodies in draft.find_in_model("BodySet"):
        paths.update(
            (name, f"/bodyset/{name}")
            for body in list_members(bodies)
            if (name := body.get("name"))
        )
    for component in draft.find_all("Component"):
        for child in list_elements(component):
            # A second element for a socket is not read.
            if not child.tag.startswith("socket_") or component.find(child.tag) is not child:
                continue
            text = get_text(child)
            last = text.rpartition("/")[2]
            if (
                last in paths
                and not text.startswith("/")
                and not _leads_to_body(component, text, paths)
            ):
                child.text = paths[last]
                draft.record_change(component, location=child)


def _leads_to_body(component: Element, text: str, paths: dict[str, str]) -> bool:
    """Return whether a relative path leads to a body, or to a frame that the component contains."""
    path_parts = make_path(component).split("/")[1:]
    # ".." leads to the parent, as in paths of files.
    for part in text.split("/"):
        if part != "..":
            path_parts.append(part)
        elif path_parts:
            path_parts.pop()
    if "/" + "/".join(path_parts) in paths.values():
        return True
    frames = (
        frame for tag in ("frames", "components") for frame in _list_children(component.find(tag))
    )
    # Relative names of frames inside the component are valid.
    return any(frame.get("name") == text for frame in frames)


def _list_children(parent: Element | None) -> list[Element]:
    """Return the child elements of an element; none for None."""
    return [] if parent is None else list_elements(parent)


_ZERO = "0 0 0"


_LINKERS = (
    "BushingForce",
    "FunctionBasedBushingForce",
    "ExpressionBasedBushingForce",
    "WeldConstraint",
)


def add_joint_frames(draft: Draft) -> None:
    """Turn the locations and orientations of a joint into two offset frames.

    Both frames are added even where they coincide with the bodies, because OpenSim does so and
    component paths contain them.
    """
    for joint in draft.find_all("Joint"):
        for side in ("parent", "child"):
            draft.rename_child(joint, f"socket_{side}_body", f"socket_{side}_frame")
            socket = joint.find(f"socket_{side}_frame")
            if socket is None:
                continue
            # Old sockets have names or paths; the last word is the name.
            body = get_text(socket).rpartition("/")[2]
            pose = [joint.find(f"{quantity}_in_{side}") for quantity in ("location", "orientation")]
            socket.text = _add_frame(draft, joint, body, socket, pose)
        draft.record_change(joint)


def add_linker_frames(draft: Draft) -> None:
    """Turn locations and orientations of bushings and welds into offset frames unless they are zero."""
    for linker in draft.find_tagged(*_LINKERS):
        is_changed = False
        for side in ("1", "2"):
            socket = linker.find(f"body_{side}")
            pose = [
                linker.find(f"{quantity}_body_{side}") for quantity in ("location", "orientation")
            ]
            if socket is None:
                continue
            is_changed = True
            body = get_text(socket)
            draft.rename(socket, f"socket_frame{side}")
            values = [parse_reals(get_text(part), 3) for part in pose if part is not None]
            # Unreadable values go into a frame, so that the reader can report them.
            if any(numbers is None or any(numbers) for numbers in values):
                socket.text = _add_frame(draft, linker, body, socket, pose)
            else:
                socket.text = make_body_path(body)
                _remove_parts(draft, pose)
        if is_changed:
            draft.record_change(linker)


def _add_frame(
    draft: Draft, owner: Element, body: str, socket: Element, pose: list[Element | None]
) -> str:
    """Add an offset frame of `body` to the owner's list.

    OpenSim gives both frames of one body the same name, and then uses the first for either side.

    Returns:
        Name of the new frame.
    """
    location, orientation = pose
    source = next((part for part in pose if part is not None), socket)
    frames = draft.get_list(owner, "frames", source=source)
    used_names = {frame.get("name") for frame in frames}
    # Names of frames must be unique in their list.
    name = make_unique_name(f"{body}_offset", used_names, 0)
    frame = draft.add(frames, "PhysicalOffsetFrame", source=source, name=name)
    draft.add(frame, "socket_parent", make_body_path(body), source=socket)
    for tag, part in (("translation", location), ("orientation", orientation)):
        text = _ZERO if part is None else get_text(part)
        draft.add(frame, tag, text, source=source if part is None else part)
    _remove_parts(draft, pose)
    return name


def _remove_parts(draft: Draft, parts: list[Element | None]) -> None:
    """Remove the elements that exist."""
    for part in parts:
        if part is not None:
            draft.remove(part)


_CONSTRAINTS = {
    "PointConstraint": ("body_1", "body_2"),
    "ConstantDistanceConstraint": ("body_1", "body_2"),
    "PointOnLineConstraint": ("line_body", "follower_body"),
    "RollingOnSurfaceConstraint": ("rolling_body", "surface_body"),
    "PointToPointSpring": ("body1", "body2"),
}


def convert_constraint_bodies(draft: Draft) -> None:
    """Name the bodies of constraints and springs by their paths."""
    for constraint in draft.find_tagged(*_CONSTRAINTS):
        result = [
            _convert_body(draft, constraint, tag, f"socket_{tag}")
            for tag in _CONSTRAINTS[constraint.tag]
        ]
        if any(result):
            draft.record_change(constraint)


def _convert_bodies(draft: Draft, family: str, tag: str, socket: str) -> None:
    """Turn the body name in `tag` of all components of a class into its path in `socket`."""
    for component in draft.find_all(family):
        if _convert_body(draft, component, tag, socket):
            draft.record_change(component)


def convert_marker_frames(draft: Draft) -> None:
    """Name the body of a marker by its path."""
    _convert_bodies(draft, "Marker", "body", "socket_parent_frame")


def convert_point_bodies(draft: Draft) -> None:
    """Name the body of a path point by its path."""
    _convert_bodies(draft, "AbstractPathPoint", "body", "socket_parent_frame")


def convert_contact_bodies(draft: Draft) -> None:
    """Name the body of contact geometry by its path."""
    _convert_bodies(draft, "ContactGeometry", "body_name", "socket_frame")


def convert_force_frames(draft: Draft) -> None:
    """Name the body of a prescribed force by its path."""
    _convert_bodies(draft, "PrescribedForce", "body", "socket_frame")


def convert_point_coordinates(draft: Draft) -> None:
    """Name the coordinates of conditional and moving path points by their paths.

    OpenSim takes the first object of that name for the coordinate, of any class. Here only
    coordinates count.
    """
    paths: dict[str, str] | None = None
    opensim_paths: dict[str, str] = {}
    for point in draft.find_tagged("ConditionalPathPoint", "MovingPathPoint"):
        axes = ("",) if point.tag == "ConditionalPathPoint" else ("x_", "y_", "z_")
        result = [child for axis in axes if (child := point.find(f"{axis}coordinate")) is not None]
        for child in result:
            if paths is None:
                paths = _list_coordinate_paths(draft)
            name = get_text(child)
            # An unknown name stays, so that the reader reports it.
            child.text = paths.get(name, name)
            if name in paths and name not in opensim_paths:
                opensim_paths[name] = _find_opensim_path(draft, name)
            if name in paths and opensim_paths[name] != paths[name]:
                draft.record_refusal(
                    point,
                    child,
                    f"OpenSim understands coordinate '{name}' as '{opensim_paths[name]}', the "
                    f"first element of that name, and not as '{paths[name]}'",
                )
            draft.rename(child, f"socket_{child.tag}")
        if result:
            draft.record_change(point)


def _convert_body(draft: Draft, owner: Element, tag: str, socket: str) -> bool:
    """Turn the body name in `tag` into its path in `socket`.

    Returns:
        Whether the owner has an element with this tag.
    """
    child = owner.find(tag)
    if child is None:
        return False
    child.text = make_body_path(get_text(child))
    draft.rename(child, socket)
    return True


def _find_opensim_path(draft: Draft, name: str) -> str:
    """Return the path that OpenSim computes for a coordinate.

    OpenSim searches any element with that name and takes the name of the element two levels above.
    At that time it has moved the joints behind the bodies, and the axes of each joint before the
    coordinates.
    """

    def order(element: Element) -> tuple[int, bool, float, int]:
        number = float(draft.numbers[element])
        top = element
        # OpenSim's order at that point of its upgrade: joints behind bodies, axes before
        # coordinates.
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


def _list_coordinate_paths(draft: Draft) -> dict[str, str]:
    """Return the path of the first coordinate of each name, by name.

    Joints of the same name get the suffixes that OpenSim gives them.
    """
    paths: dict[str, str] = {}
    used_names: set[str] = set()
    for joint in (
        joint
        for _, joint_set in draft.find_in_model("JointSet")
        for joint in list_members(joint_set)
    ):
        name = joint.get("name") or joint.tag.lower()
        # Joints of one name get "_0", "_1", as in OpenSim.
        joint_name = make_unique_name(name, used_names, 0)
        used_names.add(joint_name)
        for coordinate in joint.iter("Coordinate"):
            paths.setdefault(
                coordinate.get("name", ""), f"/jointset/{joint_name}/{coordinate.get('name')}"
            )
    return paths
