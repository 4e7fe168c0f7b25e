"""To 30501: ground is no body, and joints are no part of bodies."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import (
    Draft,
    Element,
    elements,
    having,
    members,
    plain,
    step,
)

_KEPT_BY_GROUND = {"VisibleObject", "WrapObjectSet", "attached_geometry", "components", "geometry"}


@step(below=30501)
def ground(draft: Draft) -> None:
    """The body called ground becomes the model's <Ground>."""
    for model, bodies in draft.of_model("BodySet"):
        body = next(
            (
                body
                for body in members(bodies)
                if body.tag == "Body" and body.get("name") == "ground"
            ),
            None,
        )
        if body is not None:
            for child in elements(body):
                if child.tag not in _KEPT_BY_GROUND:
                    draft.remove(child)
            draft.rename(body, "Ground")
            draft.move(body, model)
            draft.changed(body)


@step(below=30501)
def joints(draft: Draft) -> None:
    """Joints leave their bodies for a <JointSet> of the model and name both frames."""
    for model, bodies in draft.of_model("BodySet"):
        joint_set = draft.list_in(model, "JointSet", source=bodies)
        objects = draft.list_in(joint_set, "objects", source=joint_set)
        for body, wrapper in having(members(bodies), "Joint"):
            result = elements(wrapper)
            if result:
                _settle(draft, result[0], body, objects)
            for extra in result[1:]:
                draft.changed(body, at=extra, lost=f"a second joint of the body, <{extra.tag}>")
            draft.remove(wrapper)


def _settle(draft: Draft, joint: Element, body: Element, objects: Element) -> None:
    parent = next(
        (child for child in elements(joint) if child.tag in ("parent_body", "socket_parent_body")),
        None,
    )
    if parent is not None:
        parent.text = plain(parent)
        draft.rename(parent, "socket_parent_frame")
    if joint.find("socket_child_body") is None:
        draft.add(joint, "socket_child_frame", body.get("name", ""), source=body)
    draft.move(joint, objects)
    draft.changed(joint)
