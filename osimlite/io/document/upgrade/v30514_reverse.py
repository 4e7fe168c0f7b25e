"""To 30514: a joint runs from parent to child, and a coordinate knows its kind of motion from the joint."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, having, is_true, plain, step


@step(below=30514)
def reverse(draft: Draft) -> None:
    """A joint with <reverse> exchanges its frames."""
    for joint, switch in having(draft.every("Joint"), "reverse"):
        parent, child = joint.find("socket_parent_frame"), joint.find("socket_child_frame")
        if is_true(plain(switch)) and parent is not None and child is not None:
            parent.text, child.text = child.text, parent.text
            draft.changed(joint)
        draft.remove(switch)


@step(below=30514)
def motion_type(draft: Draft) -> None:
    """A coordinate says its motion type no longer: it follows from the joint."""
    for coordinate, kind in having(draft.tagged("Coordinate"), "motion_type"):
        draft.remove(kind)
        draft.changed(coordinate)
