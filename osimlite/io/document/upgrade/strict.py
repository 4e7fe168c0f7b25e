"""Checks of what OpenSim's upgrade of old documents requires; without it, OpenSim loads nothing.

Each entry was read in OpenSim's sources and tried with OpenSim 4.6. Properties that the current
format still has are absent: OpenSim reads them leniently after the upgrade.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from math import isfinite, isinf

from osimlite.base.patterns import compile_later
from osimlite.io.document.lexical import UncleanText, parse_real, split_words
from osimlite.io.document.upgrade.draft import Draft, Element, get_text, list_elements

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_DISPLAY_GEOMETRY = "VisibleObject/GeometrySet/objects/DisplayGeometry"


def check_strict_reading(draft: Draft) -> None:
    """Record every element of an old document over which OpenSim's upgrade fails."""
    _check_values(draft)
    if draft.version < 30501:
        _check_bodies(draft)
        for marker in draft.find_all("Marker"):
            if marker.find("body") is None:
                draft.record_refusal(marker, marker, f"<{marker.tag}> has no <body>")
    if draft.version < 30508:
        for component in draft.find_all("Component"):
            _check_connectors(draft, component)
    if draft.version < 30505:
        for joint in draft.find_all("Joint"):
            _check_joint(draft, joint)
    if draft.version < 30502:
        for frame in draft.find_all("PhysicalFrame"):
            visible = frame.find("VisibleObject")
            # Before version 20101 all geometry needs a named frame, later only a GeometrySet does.
            named = draft.version < 20101 or (
                visible is not None and visible.find("GeometrySet") is not None
            )
            if visible is not None and named and "name" not in frame.attrib:
                draft.record_refusal(frame, frame, f"<{frame.tag}> has geometry and no name")


def _check_values(draft: Draft) -> None:
    """Record every element of `_STRICT_VALUES` that OpenSim cannot read."""
    for family, since, below, paths, value_type in _STRICT_VALUES:
        if since <= draft.version < below:
            is_readable, words = _VALUE_TYPES[value_type]
            for owner in draft.find_all(family):
                if family == "Body" and owner.get("name") == "ground":
                    # Of ground OpenSim reads only geometry and wrap objects.
                    # Each row holds for a range of versions.
                    continue
                for path in paths.split():
                    for element in _find_elements(owner, path):
                        if not _is_value(element):
                            draft.record_refusal(
                                owner,
                                element,
                                f"<{element.tag}> must contain {words} only, but contains elements or comments",
                            )
                        elif not is_readable(get_text(element)):
                            draft.record_refusal(
                                owner,
                                element,
                                f"<{element.tag}> is '{get_text(element)[:60]}', not {words}",
                            )


def _check_bodies(draft: Draft) -> None:
    """Check that every body but ground has a <Joint>, and that a joint in it names its <parent_body>."""
    if draft.model is None:
        return
    objects = draft.model.find("BodySet/objects")
    if objects is None:
        draft.record_refusal(
            draft.model,
            draft.model,
            "the model has no <BodySet> with <objects> (one that contains only ground is enough)",
        )
        return
    bodies = objects.findall("Body")
    ground = next((body for body in bodies if body.get("name") == "ground"), None)
    for body in bodies:
        if body is ground:
            continue
        wrapper = body.find("Joint")
        children = [] if wrapper is None else list_elements(wrapper)
        if wrapper is None:
            draft.record_refusal(body, body, "a body has no <Joint>, not even an empty one")
        elif children:
            parent = children[0].find("parent_body")
            if parent is None:
                draft.record_refusal(body, children[0], f"<{children[0].tag}> has no <parent_body>")
            elif not _is_value(parent):
                draft.record_refusal(
                    body,
                    parent,
                    "<parent_body> must contain a name only, but contains elements or comments",
                )


def _check_connectors(draft: Draft, component: Element) -> None:
    """Check that every entry of <connectors> has a name and a <connectee_name>."""
    connectors = component.find("connectors")
    for connector in [] if connectors is None else list_elements(connectors):
        connectee = connector.find("connectee_name")
        if "name" not in connector.attrib:
            draft.record_refusal(
                component, connector, f"<{connector.tag}> in <connectors> has no name"
            )
        elif connectee is None or not _is_value(connectee):
            draft.record_refusal(
                component,
                connector,
                f"<{connector.tag}> has no <connectee_name> that contains a name",
            )


def _check_joint(draft: Draft, joint: Element) -> None:
    """Check that a joint outside a body names its frames in <connectors>."""
    wrapper = joint.getparent()
    body = None if wrapper is None or wrapper.tag != "Joint" else wrapper.getparent()
    # Joints in bodies are checked with their bodies.
    if draft.version < 30501 and body is not None and body.tag == "Body":
        return
    connectors = joint.find("connectors")
    entries = [] if connectors is None else connectors.findall("Connector_PhysicalFrame_")
    names = {entry.get("name") for entry in entries}
    for side in ("parent", "child"):
        if not names & {f"{side}_frame", f"{side}_body"}:
            draft.record_refusal(
                joint,
                joint,
                f"<{joint.tag}> has no <Connector_PhysicalFrame_ name='{side}_frame'> in <connectors>",
            )
            return


def _find_elements(owner: Element, path: str) -> Iterator[Element]:
    """Yield the elements at a path as OpenSim finds them: the first of each tag, but every <DisplayGeometry>."""
    tag, _, remaining_path = path.partition("/")
    result = owner.findall(tag)
    for child in result if tag == "DisplayGeometry" else result[:1]:
        if remaining_path:
            yield from _find_elements(child, remaining_path)
        else:
            yield child


def _is_value(element: Element) -> bool:
    """Return whether an element has one text and no child elements."""
    if list_elements(element):
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
    """Return whether OpenSim reads a number from a text."""
    word, *trailing_words = split_words(text) or [""]
    try:
        value = parse_real(word)
    except UncleanText as unclean:
        # OpenSim reads a number with trailing characters, if it is cut.
        return unclean.trouble == "cut"
    return not trailing_words or isfinite(value)


def _is_integer(text: str) -> bool:
    """Return whether a text is an integer of 32 bits."""
    return re.fullmatch(r"[+-]?[0-9]+", text) is not None and -(2**31) <= int(text) < 2**31


def _is_vector(size: int) -> Callable[[str], bool]:
    """Return the predicate for texts that OpenSim reads as a vector of finite numbers."""

    def is_vector_text(text: str) -> bool:
        # Nearly all vectors have one space between their numbers, and need no pattern.
        words = text.split(" ")
        if len(words) == size and all(map(_is_real, words)):
            return not any(isinf(float(word)) for word in words)
        result = _vector_pattern(size).fullmatch(text)
        return result is not None and not any(
            number and isinf(float(number)) for number in result.groups()
        )

    return is_vector_text


_is_real = compile_later(_NUMBER).fullmatch
"""Match of a number without spaces, or None."""


@cache
def _vector_pattern(size: int) -> re.Pattern[str]:
    """Return the pattern of a vector."""
    # Compiled at first use: few documents need it, and it takes a millisecond.
    # Commas between numbers are optional, brackets need not be there.
    numbers = r"\s*,?\s*".join([f"({_NUMBER})"] * size).replace(r"\s*,?\s*", r"(?:\s*,\s*|\s+)")
    return re.compile(rf"{numbers}|~?\s*\[\s*{numbers}\s*\]|~?\s*\(\s*{numbers}\s*\)")


_VALUE_TYPES: dict[str, tuple[Callable[[str], bool], str]] = {
    "text": (lambda text: True, "one text"),
    "number": (_is_number, "a number"),
    "integer": (_is_integer, "an integer"),
    "three": (_is_vector(3), "three finite numbers"),
    "six": (_is_vector(6), "six finite numbers"),
}
"""Predicate and description of each type of value."""

_JOINT_TRANSFORMS = (
    "location_in_parent orientation_in_parent location_in_child orientation_in_child"
)

_STRICT_VALUES: tuple[tuple[str, int, int, str, str], ...] = (
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
    ("PhysicalFrame", 20101, 30502, f"{_DISPLAY_GEOMETRY}/geometry_file", "text"),
    ("PhysicalFrame", 20101, 30502, f"{_DISPLAY_GEOMETRY}/transform", "six"),
    ("PhysicalFrame", 20101, 30502, f"{_DISPLAY_GEOMETRY}/scale_factors", "three"),
    ("PhysicalFrame", 20101, 30502, f"{_DISPLAY_GEOMETRY}/display_preference", "integer"),
    ("Appearance", 0, 30505, "representation", "integer"),
    ("Joint", 0, 30505, _JOINT_TRANSFORMS, "three"),
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
    ("Marker", 0, 30501, "body", "text"),
    ("ContactGeometry", 0, 30507, "display_preference", "text"),
    ("Muscle", 0, 30513, "min_control max_control", "number"),
    ("GeometryPath", 0, 30516, "VisibleObject/display_preference", "integer"),
    ("GeometryPath", 0, 30516, "default_color", "text"),
    ("WrapObject", 0, 30515, "display_preference VisibleObject/display_preference", "integer"),
    ("WrapObject", 0, 30515, "color", "text"),
)
"""Values that OpenSim's upgrade reads strictly.

Each row has the class, the first version and the version after the last to which it applies, paths
of elements separated by blanks, and a key of `_VALUE_TYPES`.
"""
