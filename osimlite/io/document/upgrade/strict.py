"""What OpenSim's own upgrade of an old document insists on: where it is missing or unreadable, OpenSim loads nothing.

Each entry was read in OpenSim's sources and tried. What remains a property of the current format is
read leniently later; it is not here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from math import isfinite, isinf

from osimlite.io.document.lexical import Unclean, real, split
from osimlite.io.document.upgrade.draft import Draft, Element, elements, plain

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_SHOWN = "VisibleObject/GeometrySet/objects/DisplayGeometry"


def check(draft: Draft) -> None:
    """Note everything in a document, as it was, over which OpenSim fails when it brings it up to date."""
    for family, since, below, paths, kind in _READ:
        if since <= draft.version < below:
            reads, words = _KINDS[kind]
            for owner in draft.every(family):
                if family == "Body" and owner.get("name") == "ground":
                    # OpenSim reads of it only what is drawn, and what wraps.
                    continue
                for path in paths.split():
                    for place in _at(owner, path):
                        if not _is_value(place):
                            draft.refuse(
                                owner,
                                place,
                                f"<{place.tag}> must be {words} and holds elements or comments",
                            )
                        elif not reads(plain(place)):
                            draft.refuse(
                                owner, place, f"<{place.tag}> is '{plain(place)[:60]}', not {words}"
                            )
    if draft.version < 30501:
        _bodies(draft)
    if draft.version < 30508:
        for component in draft.every("Component"):
            _connectors(draft, component)
    if draft.version < 30505:
        for joint in draft.every("Joint"):
            _joint(draft, joint)
    if draft.version < 30502:
        for frame in draft.every("PhysicalFrame"):
            visible = frame.find("VisibleObject")
            named = draft.version < 20101 or (
                visible is not None and visible.find("GeometrySet") is not None
            )
            if visible is not None and named and "name" not in frame.attrib:
                draft.refuse(frame, frame, f"<{frame.tag}> has geometry and no name")


def _bodies(draft: Draft) -> None:
    """Every body but ground has a <Joint>, which may be empty; a joint in it names its <parent_body>."""
    if draft.model is None:
        return
    objects = draft.model.find("BodySet/objects")
    if objects is None:
        draft.refuse(
            draft.model,
            draft.model,
            "the model has no <BodySet> with <objects>, not even one with ground",
        )
        return
    bodies = objects.findall("Body")
    ground = next((body for body in bodies if body.get("name") == "ground"), None)
    for body in bodies:
        if body is ground:
            continue
        wrapper = body.find("Joint")
        inside = [] if wrapper is None else elements(wrapper)
        if wrapper is None:
            draft.refuse(body, body, "a body has no <Joint>, not even an empty one")
        elif inside:
            parent = inside[0].find("parent_body")
            if parent is None:
                draft.refuse(body, inside[0], f"<{inside[0].tag}> has no <parent_body>")
            elif not _is_value(parent):
                draft.refuse(
                    body, parent, "<parent_body> must be a name and holds elements or comments"
                )


def _connectors(draft: Draft, component: Element) -> None:
    """Every entry of <connectors> has a name and a <connectee_name>."""
    listed = component.find("connectors")
    for connector in [] if listed is None else elements(listed):
        connectee = connector.find("connectee_name")
        if "name" not in connector.attrib:
            draft.refuse(component, connector, f"<{connector.tag}> in <connectors> has no name")
        elif connectee is None or not _is_value(connectee):
            draft.refuse(
                component, connector, f"<{connector.tag}> has no <connectee_name> with a name in it"
            )


def _joint(draft: Draft, joint: Element) -> None:
    """A joint that stands in no body says in <connectors> what it joins."""
    wrapper = joint.getparent()
    body = None if wrapper is None or wrapper.tag != "Joint" else wrapper.getparent()
    if draft.version < 30501 and body is not None and body.tag == "Body":
        return
    listed = joint.find("connectors")
    entries = [] if listed is None else listed.findall("Connector_PhysicalFrame_")
    names = {entry.get("name") for entry in entries}
    for side in ("parent", "child"):
        if not names & {f"{side}_frame", f"{side}_body"}:
            draft.refuse(
                joint,
                joint,
                f"<{joint.tag}> has no <Connector_PhysicalFrame_ name='{side}_frame'> in <connectors>",
            )
            return


def _at(owner: Element, path: str) -> Iterator[Element]:
    """The first element of each step of a path, as OpenSim takes it; every <DisplayGeometry> there is."""
    first, _, rest = path.partition("/")
    result = owner.findall(first)
    for child in result if first == "DisplayGeometry" else result[:1]:
        if rest:
            yield from _at(child, rest)
        else:
            yield child


def _is_value(element: Element) -> bool:
    """Whether an element is nothing but one text."""
    if elements(element):
        return False
    return (
        sum(
            1
            for piece in (element.text, *(node.tail for node in element))
            if piece and piece.strip()
        )
        <= 1
    )


def _is_number(text: str) -> bool:
    word, *others = split(text) or [""]
    try:
        value = real(word)
    except Unclean as unclean:
        return unclean.trouble == "cut"
    return not others or isfinite(value)


def _is_whole(text: str) -> bool:
    return re.fullmatch(r"[+-]?[0-9]+", text) is not None and -(2**31) <= int(text) < 2**31


def _is_vector(size: int) -> Callable[[str], bool]:
    def reads(text: str) -> bool:
        result = _vector_pattern(size).fullmatch(text)
        return result is not None and not any(
            number and isinf(float(number)) for number in result.groups()
        )

    return reads


@cache
def _vector_pattern(size: int) -> re.Pattern[str]:
    """Return the pattern of a vector; compiled at first use, since few documents need it and it takes a millisecond."""
    numbers = r"\s*,?\s*".join([f"({_NUMBER})"] * size).replace(r"\s*,?\s*", r"(?:\s*,\s*|\s+)")
    return re.compile(rf"{numbers}|~?\s*\[\s*{numbers}\s*\]|~?\s*\(\s*{numbers}\s*\)")


_KINDS: dict[str, tuple[Callable[[str], bool], str]] = {
    "text": (lambda text: True, "one text"),
    "number": (_is_number, "a number"),
    "whole": (_is_whole, "a whole number"),
    "three": (_is_vector(3), "three finite numbers"),
    "six": (_is_vector(6), "six finite numbers"),
}

_PLACES = "location_in_parent orientation_in_parent location_in_child orientation_in_child"

_READ: tuple[tuple[str, int, int, str, str], ...] = (
    (
        "Body",
        0,
        30500,
        "inertia_xx inertia_yy inertia_zz inertia_xy inertia_xz inertia_yz",
        "number",
    ),
    ("PhysicalFrame", 0, 30502, "VisibleObject/scale_factors", "three"),
    ("PhysicalFrame", 0, 30502, "VisibleObject/transform", "six"),
    ("PhysicalFrame", 0, 20101, "VisibleObject/geometry_files", "text"),
    ("PhysicalFrame", 20101, 30502, f"{_SHOWN}/geometry_file", "text"),
    ("PhysicalFrame", 20101, 30502, f"{_SHOWN}/transform", "six"),
    ("PhysicalFrame", 20101, 30502, f"{_SHOWN}/scale_factors", "three"),
    ("PhysicalFrame", 20101, 30502, f"{_SHOWN}/display_preference", "whole"),
    ("Appearance", 0, 30505, "representation", "whole"),
    ("Joint", 0, 30505, _PLACES, "three"),
    ("Joint", 0, 30500, "location orientation", "three"),
    ("Joint", 0, 30514, "reverse", "text"),
    ("Coordinate", 0, 30514, "motion_type", "text"),
    (
        "TwoFrameLinker",
        0,
        30505,
        "location_body_1 orientation_body_1 location_body_2 orientation_body_2",
        "three",
    ),
    (
        "WeldConstraint",
        0,
        30505,
        "location_body_1 orientation_body_1 location_body_2 orientation_body_2",
        "three",
    ),
    ("ContactGeometry", 0, 30507, "display_preference", "text"),
    ("Muscle", 0, 30513, "min_control max_control", "number"),
    ("GeometryPath", 0, 30516, "VisibleObject/display_preference", "whole"),
    ("GeometryPath", 0, 30516, "default_color", "text"),
    ("WrapObject", 0, 30515, "display_preference VisibleObject/display_preference", "whole"),
    ("WrapObject", 0, 30515, "color", "text"),
)
"""What is read strictly: in which class, in documents from which version and below which, where, and as what."""
