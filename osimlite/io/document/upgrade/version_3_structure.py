"""Steps of format 30500 to 30514: bodies, joints, coordinates, names and switches."""

from __future__ import annotations

from osimlite.base.text import make_unique_name
from osimlite.io.document.lexical import ABSENT, UncleanText, make_converter
from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    find_families,
    find_with_child,
    get_text,
    is_true,
    list_elements,
    list_members,
    parse_reals,
)
from osimlite.schema.fields import Value

TEXT_TAGS = {
    "credits",
    "publications",
    "data_file",
    "datafile",
    "file_name",
    "filename",
    "geometry_file",
    "mesh_file",
}


"""Elements whose text is never the name of a component."""


NAME_LIST_TAGS = {
    "actuator_list",
    "coordinates",
    "geometry",
    "independent_coordinate_names",
    "members",
    "muscle_list",
}


"""Elements whose text may be several names."""


def remove_white_space(draft: Draft) -> None:
    """Remove white space from names, and from the references to them.

    OpenSim changes the names but not the references.
    """
    renamed: dict[str, str] = {}
    for component in draft.find_all("Component"):
        name = component.get("name")
        parent = component.getparent()
        # OpenSim gives such a component the name of its class in lower case.
        if name is None:
            if parent is not None and not find_families(parent.tag):
                component.set("name", component.tag.lower())
                draft.record_change(component)
        elif any(space in name for space in " \t\n\r"):
            stripped_name = "".join(name.split())
            siblings = (
                () if parent is None else (child for child in parent if child is not component)
            )
            # Two names may become equal without their blanks.
            sibling_names = {sibling.get("name") for sibling in siblings}
            unique_name = make_unique_name(stripped_name, sibling_names, 0)
            component.set("name", unique_name)
            # Texts are compared with white space collapsed.
            renamed.setdefault(" ".join(name.split()), unique_name)
            draft.record_change(component)
    if renamed:
        _rename_references(draft, renamed)


def _rename_references(draft: Draft, renamed: dict[str, str]) -> None:
    """Replace old names by new ones in texts and in names of objects that refer to components."""
    for element in draft.root.iter("*"):
        if len(element) == 0:
            text = get_text(element)
            if " " in text and element.tag not in TEXT_TAGS:
                new = renamed.get(text) or (
                    _rename_in_list(text, renamed) if element.tag in NAME_LIST_TAGS else text
                )
                if new != text:
                    element.text = new
                    draft.record_change(_get_owner(element), location=element)
        name = element.get("name")
        if name is not None and " ".join(name.split()) in renamed and find_families(element.tag):
            # An object that is no component can be named after the component it describes.
            element.set("name", renamed[" ".join(name.split())])


def _rename_in_list(text: str, renamed: dict[str, str]) -> str:
    """Return a list of names, as text, with the old names replaced."""
    for old, new in sorted(renamed.items(), key=lambda pair: -len(pair[0])):
        # The longest first: a name may be a part of another one.
        text = f" {text} ".replace(f" {old} ", f" {new} ").strip()
    return text


def _get_owner(element: Element) -> Element:
    """Return the parent of an element, or the element if it is the root."""
    parent = element.getparent()
    return element if parent is None else parent


_INERTIA = {"xx": "1", "yy": "1", "zz": "1", "xy": "0", "xz": "0", "yz": "0"}


def combine_inertia(draft: Draft) -> None:
    """Combine the six numbers of inertia into one <inertia>."""
    for body in draft.find_tagged("Body"):
        # Ground has no inertia in the new format.
        if body.get("name") == "ground":
            continue
        parts = {axes: body.find(f"inertia_{axes}") for axes in _INERTIA}
        present_elements = [part for part in parts.values() if part is not None]
        words = [
            default if (part := parts[axes]) is None else get_text(part)
            for axes, default in _INERTIA.items()
        ]
        # The source is an unreadable number if there is one, so that messages point to it.
        source = next(
            (part for part in present_elements if parse_reals(get_text(part), 1) is None),
            present_elements[0] if present_elements else body,
        )
        draft.add(body, "inertia", " ".join(words), source=source)
        for part in present_elements:
            draft.remove(part)
        draft.record_change(body, location=present_elements[0] if present_elements else body)


_GROUND_TAGS = {"VisibleObject", "WrapObjectSet", "attached_geometry", "components", "geometry"}


def convert_ground(draft: Draft) -> None:
    """Turn the body called ground into the model's <Ground>."""
    for model, bodies in draft.find_in_model("BodySet"):
        body = next(
            (
                body
                for body in list_members(bodies)
                if body.tag == "Body" and body.get("name") == "ground"
            ),
            None,
        )
        if body is not None:
            for child in list_elements(body):
                # Ground keeps what is drawn or wrapped; mass and joint have no meaning.
                if child.tag not in _GROUND_TAGS:
                    draft.remove(child)
            draft.rename(body, "Ground")
            draft.move(body, model)
            draft.record_change(body)


def move_joints(draft: Draft) -> None:
    """Move joints from the bodies to the model's <JointSet>, and name both frames."""
    for model, bodies in draft.find_in_model("BodySet"):
        joint_set = draft.get_list(model, "JointSet", source=bodies)
        objects = draft.get_list(joint_set, "objects", source=joint_set)
        for body, wrapper in find_with_child(list_members(bodies), "Joint"):
            result = list_elements(wrapper)
            if result:
                # A body had one joint; more are malformed, and OpenSim takes the first.
                _convert_joint(draft, result[0], body, objects)
            for surplus_joint in result[1:]:
                draft.record_change(
                    body,
                    location=surplus_joint,
                    lost=f"a second joint of the body, <{surplus_joint.tag}>",
                )
            draft.remove(wrapper)


def _convert_joint(draft: Draft, joint: Element, body: Element, objects: Element) -> None:
    """Name the frames of a joint and move it to the objects of the <JointSet>."""
    parent = next(
        (
            child
            for child in list_elements(joint)
            if child.tag in ("parent_body", "socket_parent_body")
        ),
        None,
    )
    if parent is not None:
        parent.text = get_text(parent)
        draft.rename(parent, "socket_parent_frame")
    # Development versions wrote the socket of the child already.
    if joint.find("socket_child_body") is None:
        draft.add(joint, "socket_child_frame", body.get("name", ""), source=body)
    draft.move(joint, objects)
    draft.record_change(joint)


def list_joint_coordinates(draft: Draft) -> None:
    """Turn the <CoordinateSet> of a joint into its <coordinates>."""
    for joint, coordinate_set in find_with_child(draft.find_all("Joint"), "CoordinateSet"):
        # Members of other classes move too, so that the reader can report them.
        coordinates = list(list_members(coordinate_set))
        if coordinates:
            coordinate_list = draft.add(joint, "coordinates", source=coordinate_set)
            for coordinate in coordinates:
                draft.move(coordinate, coordinate_list)
        groups = coordinate_set.find("groups")
        lost = "groups of coordinates" if groups is not None and len(groups) else None
        draft.record_change(joint, location=coordinate_set, lost=lost)
        draft.remove(coordinate_set)


def invert_switches(draft: Draft) -> None:
    """Replace <isDisabled> by its opposite: appliesForce, isEnforced or enabled."""
    for family, new in (
        ("Force", "appliesForce"),
        ("Constraint", "isEnforced"),
        ("Controller", "enabled"),
    ):
        _invert_switch(draft, family, new)


def invert_probe_switches(draft: Draft) -> None:
    """Replace <isDisabled> of a probe by its opposite, enabled."""
    _invert_switch(draft, "Probe", "enabled")


def _invert_switch(draft: Draft, family: str, new: str) -> None:
    """Replace <isDisabled> of all components of a class by its opposite with the tag `new`."""
    for component, switch in find_with_child(draft.find_all(family), "isDisabled"):
        switch.text = "false" if is_true(get_text(switch)) else "true"
        draft.rename(switch, new)
        draft.record_change(component)


def move_frame_set(draft: Draft) -> None:
    """Move the members of <FrameSet> to the model's <components>."""
    for model, frame_set in draft.find_in_model("FrameSet"):
        components = draft.get_list(model, "components", source=frame_set)
        for frame in list(list_members(frame_set)):
            draft.move(frame, components)
        draft.record_change(model, location=frame_set)
        draft.remove(frame_set)


_DEFAULT_BOUNDS = {"min_control": 0.0, "max_control": 1.0}


_parse_double = make_converter(Value("double"))


def _parse_beginning(text: str) -> float | None:
    """Return the number that OpenSim reads: of several the first, of a word its beginning."""
    try:
        return float(_parse_double(text))
    except UncleanText as unclean:
        return None if unclean.value is ABSENT else float(unclean.value)


def remove_usual_bounds(draft: Draft) -> None:
    """Remove control bounds of 0 and 1, so that those of the muscle's class apply."""
    for muscle in draft.find_all("Muscle"):
        is_changed = False
        for tag, usual in _DEFAULT_BOUNDS.items():
            bound = muscle.find(tag)
            value = None if bound is None else _parse_beginning(get_text(bound))
            # The former defaults of all actuators; each muscle class has its own now.
            if bound is not None and value is not None and abs(value - usual) < 1e-14:
                draft.remove(bound)
                is_changed = True
        if is_changed:
            draft.record_change(muscle)


def apply_reverse(draft: Draft) -> None:
    """Exchange the frames of a joint with <reverse>."""
    for joint, switch in find_with_child(draft.find_all("Joint"), "reverse"):
        parent, child = joint.find("socket_parent_frame"), joint.find("socket_child_frame")
        # Reversing a joint and swapping its frames is the same.
        if is_true(get_text(switch)) and parent is not None and child is not None:
            parent.text, child.text = child.text, parent.text
            draft.record_change(joint)
        draft.remove(switch)


def remove_motion_type(draft: Draft) -> None:
    """Remove the motion type of a coordinate, which follows from the joint."""
    for coordinate, kind in find_with_child(draft.find_tagged("Coordinate"), "motion_type"):
        draft.remove(kind)
        draft.record_change(coordinate)


def rename_joint_child_locations(draft: Draft) -> None:
    """Rename <location> and <orientation> of a joint to <location_in_child> and <orientation_in_child>."""
    draft.rename_properties(
        "Joint", {"location": "location_in_child", "orientation": "orientation_in_child"}
    )
