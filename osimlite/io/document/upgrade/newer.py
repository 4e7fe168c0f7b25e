"""Search for content that is newer than the version a document states.

OpenSim trusts the number and reads such a document by the rules of the old format. An upgrade by
these rules would add content a second time that exists already in the new form, such as the inertia
or the frames.
"""

from __future__ import annotations

from functools import lru_cache

from lxml import etree

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.io.document.names import decode_name
from osimlite.io.document.upgrade.draft import Element


class NewerContent(NamedTuple):
    """An element that is newer than the version of its document.

    Attributes:
        element: element of the document.
        parent: tag of the object that contains it.
        since: version that introduced it.
    """

    element: Element
    parent: str
    since: int


_MARKS = (
    (compile_later("Body"), {"inertia": 30500, "attached_geometry": 30502}),
    (compile_later("Model"), {"JointSet": 30501, "Ground": 30501}),
    (
        compile_later(r"\w+Joint"),
        {
            "frames": 30505,
            "coordinates": 30507,
            "socket_parent_frame": 30505,
            "socket_child_frame": 30505,
        },
    ),
    (compile_later(r"\w*PathPoint|Marker|Station"), {"socket_parent_frame": 30505}),
    (compile_later(r"PhysicalOffsetFrame"), {"socket_parent": 30505}),
    (compile_later(r"Contact\w+"), {"socket_frame": 30505}),
    (
        compile_later(r"\w+(?:Force|Muscle|Actuator|Spring|Ligament|Muscle_Deprecated)"),
        {"appliesForce": 30509},
    ),
    (compile_later(r"\w+Constraint"), {"isEnforced": 30509}),
)
"""Properties of some classes, with the version that introduced each."""


def find_newer_content(root: Element, version: int) -> NewerContent | None:
    """Return the first element of a document that is newer than its version, or None.

    Args:
        root: root element.
        version: version that the document states.
    """
    for element in root.iter(etree.Element):
        for tags in _get_marks(element.tag):
            for child in element.iterchildren(etree.Element):
                since = tags.get(decode_name(child.tag), 0)
                if version < since and (len(child) or (child.text or "").strip()):
                    return NewerContent(child, decode_name(element.tag), since)
    return None


@lru_cache(maxsize=1000)
def _get_marks(tag: str) -> list[dict[str, int]]:
    """Return the properties to search in elements of a tag.

    The result is cached, because documents have thousands of elements of few tags.
    """
    return [tags for pattern, tags in _MARKS if pattern.fullmatch(decode_name(tag))]
