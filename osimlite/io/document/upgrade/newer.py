"""Content that is newer than the version a document states.

OpenSim trusts the number and reads such a document by the rules of the old format. To bring it up
to date by these rules would add what is there already in its new form: a second inertia, other
frames.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from lxml import etree

from osimlite.io.document.names import as_written
from osimlite.io.document.upgrade.draft import Element


class NewerContent(NamedTuple):
    """An element that came after the version of its document."""

    element: Element
    parent: str  # tag of the object that it stands in
    since: int  # version that introduced it


_MARKS = (
    (re.compile("Body"), {"inertia": 30500, "attached_geometry": 30502}),
    (re.compile("Model"), {"JointSet": 30501, "Ground": 30501}),
    (
        re.compile(r"\w+Joint"),
        {
            "frames": 30505,
            "coordinates": 30507,
            "socket_parent_frame": 30505,
            "socket_child_frame": 30505,
        },
    ),
    (re.compile(r"\w*PathPoint|Marker|Station"), {"socket_parent_frame": 30505}),
    (re.compile(r"PhysicalOffsetFrame"), {"socket_parent": 30505}),
    (re.compile(r"Contact\w+"), {"socket_frame": 30505}),
    (
        re.compile(r"\w+(?:Force|Muscle|Actuator|Spring|Ligament|Muscle_Deprecated)"),
        {"appliesForce": 30509},
    ),
    (re.compile(r"\w+Constraint"), {"isEnforced": 30509}),
)
"""Properties that no older document has, by the class that they stand in, with the version that brought them."""


def find_newer_content(root: Element, version: int) -> NewerContent | None:
    """Return the first element of a document that is newer than its version, or None."""
    for element in root.iter(etree.Element):
        for tags in _marks_of(element.tag):
            for child in element.iterchildren(etree.Element):
                since = tags.get(as_written(child.tag), 0)
                if version < since and (len(child) or (child.text or "").strip()):
                    return NewerContent(child, as_written(element.tag), since)
    return None


@lru_cache(maxsize=1000)
def _marks_of(tag: str) -> list[dict[str, int]]:
    """Return the properties to look for in elements of a tag; documents have thousands of elements of few tags."""
    return [tags for pattern, tags in _MARKS if pattern.fullmatch(as_written(tag))]
