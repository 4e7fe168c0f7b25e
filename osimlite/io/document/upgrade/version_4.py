"""Steps of format 40000 to 40600. They leave every element in its position."""

from __future__ import annotations

from osimlite.io.document.lexical import split_words
from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    find_families,
    find_with_child,
    get_child_text,
    get_text,
    list_elements,
    list_members,
    make_path,
    parse_reals,
)


def complete_axis_functions(draft: Draft) -> None:
    """Give each axis of a custom joint a function.

    An axis with an empty function follows its coordinate, an axis without any function is fixed.
    """
    for axis in draft.find_tagged("TransformAxis"):
        # An axis with a function is complete.
        if any("Function" in find_families(child.tag) for child in list_elements(axis)):
            continue
        holder = axis.find("function")
        if holder is not None and list_elements(holder):
            continue
        coordinates = (
            (get_child_text(axis, "coordinates") or "").split() if holder is not None else []
        )
        if holder is None:
            holder = draft.add(axis, "function", source=axis)
        # The identity, which OpenSim assumes.
        if len(coordinates) == 1:
            draft.add(
                draft.add(holder, "LinearFunction", source=holder),
                "coefficients",
                "1 0",
                source=holder,
            )
        elif not coordinates:
            draft.add(draft.add(holder, "Constant", source=holder), "value", "0", source=holder)
        # An axis of several coordinates without a function has no meaning; the reader reports it.
        else:
            continue
        draft.record_change(axis)


MEANINGLESS: dict[str, dict[str, str]] = {
    "Body": {"Joint": ""},
    "Coordinate": {
        "initial_value": "",
        "keys": "",
        "max_restraint_function": "",
        "min_restraint_function": "",
        "restraint_active": "false",
        "restraint_function": "",
        "stiffness": "0",
    },
    "ForceSet": {"datafile": ""},
    "Joint": {"use_euler_angles": ""},
    "Model": {"angle_units": "radians"},
    "MovingPathPoint": {"location": ""},
    "SimmSpline": {f"{end}_{axis}": "" for end in ("max", "min") for axis in "xyz"},
    "TransformAxis": {"is_rotation": ""},
    "Schutte1993Muscle_Deprecated": {"force_velocity_curve": ""},
    "Thelen2003Muscle": {"Vmax": "10", "Vmax0": "5", "damping": "0.05", "muscle_model": ""},
}


"""Elements without a meaning in the current format, by their class, with their old default.

A value that differs from the old default had an effect once, so its removal counts as a loss. An
empty text means that the element never had an effect.
"""


def remove_meaningless(draft: Draft) -> None:
    """Remove elements without a meaning in the current format.

    In documents from before 10901, elements whose removal is a loss stay, and the reader refuses
    the document because of them.
    """
    for visible in draft.find_tagged("VisibleObject"):
        parent = visible.getparent()
        if parent is not None and find_families(parent.tag):
            draft.record_change(parent, location=visible)
            draft.remove(visible)
    for family, default in MEANINGLESS.items():
        for owner in draft.find_all(family):
            for child in list_elements(owner):
                if child.tag in default:
                    lost = _describe_loss(child, default[child.tag])
                    if lost is None or draft.version >= 10901:
                        draft.record_change(owner, location=child, lost=lost)
                        draft.remove(child)


def _describe_loss(child: Element, default: str) -> str | None:
    """Return the element and its value if that had an effect, else None."""
    text = get_text(child)
    # An empty default marks elements that never had an effect.
    if not default or text == default or not text:
        return None
    # Equal numbers may be written differently.
    count = len(default.split())
    values, expected = parse_reals(text, count), parse_reals(default, count)
    return None if values is not None and values == expected else f"{child.tag} {text}"


def name_paths(draft: Draft) -> None:
    """Give the <GeometryPath> of each force the name 'path'."""
    for path in draft.find_tagged("GeometryPath"):
        force = path.getparent()
        # Only the first path of a force is read.
        if force is not None and force.find("GeometryPath") is path and draft.is_a(force, "Force"):
            path.set("name", "path")
            draft.record_change(path)


def _is_stray(draft: Draft, member: Element) -> bool:
    """Return whether an element is in a list of objects that is not in a set."""
    objects = member.getparent()
    if objects is None or objects.tag != "objects":
        return False
    owner = objects.getparent()
    return owner is None or not (draft.is_a(owner, "Set") or draft.is_a(owner, "ModelComponentSet"))


def convert_controller_actuators(draft: Draft) -> None:
    """Turn the names in <actuator_list> into paths in <socket_actuators>.

    A name that no actuator has becomes a path to nothing, which is reported later. OpenSim drops it
    silently.
    """
    if next(draft.root.iter("actuator_list"), None) is None:
        return
    controllers = [*find_with_child(draft.find_all("Controller"), "actuator_list")]
    if not controllers:
        return
    # OpenSim does not read what is in a list that no set holds.
    actuators = [
        (make_path(actuator), actuator.get("name", ""))
        for actuator in draft.find_all("Actuator")
        if not _is_stray(draft, actuator)
    ]
    forces = [
        (make_path(force), force.get("name", ""))
        for force_set in draft.find_tagged("ForceSet")
        for force in list_members(force_set)
    ]
    # Actuators come before other forces of the same name.
    by_name: dict[str, str] = {}
    for path, name in (*actuators, *forces):
        by_name.setdefault(name, path)
    for controller, names in controllers:
        words = split_words(get_text(names))
        lost = None
        # "ALL" stands for every actuator, in any letter case.
        if any(word.lower() == "all" for word in words):
            paths = [path for path, _ in actuators]
            if draft.model is None:
                lost = "the control of all actuators, because a document without the model cannot name them"
        else:
            paths = [by_name.get(word, f"/forceset/{word}") for word in words]
            known_paths = [path for path in paths if path in {*by_name.values()}]
            # OpenSim fails over a repeated actuator.
            if len({*known_paths}) < len(known_paths):
                draft.record_refusal(controller, names, "a controller names an actuator twice")
        names.text = " ".join(dict.fromkeys(paths))
        draft.rename(names, "socket_actuators")
        draft.record_change(controller, lost=lost)
