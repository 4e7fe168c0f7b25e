"""To 30514: a joint runs from parent to child, and a coordinate knows its kind of motion from the joint."""

from __future__ import annotations

from osimlite.document.upgrade.draft import Draft, is_true, plain, step


@step(below=30514)
def reverse(draft: Draft) -> None:
    """A joint with <reverse> exchanges its frames."""
    for joint in draft.every("Joint"):
        switch = joint.find("reverse")
        if switch is None:
            continue
        parent, child = joint.find("socket_parent_frame"), joint.find("socket_child_frame")
        if is_true(plain(switch)) and parent is not None and child is not None:
            parent.text, child.text = child.text, parent.text
            draft.changed(joint)
        draft.remove(switch)


@step(below=30514)
def motion_type(draft: Draft) -> None:
    """A coordinate says its motion type no longer: it follows from the joint."""
    for coordinate in draft.tagged("Coordinate"):
        kind = coordinate.find("motion_type")
        if kind is not None:
            draft.remove(kind)
            draft.changed(coordinate)
