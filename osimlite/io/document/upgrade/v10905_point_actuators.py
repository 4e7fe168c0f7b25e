"""To 10905: a force or torque actuator names the body it acts on, not the one it reacts from."""

from __future__ import annotations

from osimlite.io.document.upgrade.draft import Draft, Element, elements, plain, step

_RENAMED = {
    "PointActuator": {"body_B": "body", "point_B": "point", "direction_A": "direction"},
    "TorqueActuator": {"body_A": "bodyB", "body_B": "bodyA", "direction_A": "axis"},
}


_VECTOR = {"PointActuator": ("direction", "1 0 0"), "TorqueActuator": ("axis", "0 0 1")}
"""The vector of each and its default, in the direction of which the one pushes and about which the other turns."""


@step(below=10905)
def actuator_bodies(draft: Draft) -> None:
    """Point and torque actuators say where they act, with the opposite direction.

    The direction was one in the frame of the body reacted from, which is ground unless the document
    says otherwise. OpenSim sets force_is_global for that too, but leaves it out when it prints the
    model. It turns the direction round by the version alone, also where the tags are the later
    ones: a set of actuators without a version pushes backwards.
    """
    for actuator in draft.tagged(*_RENAMED):
        for child in elements(actuator):
            if child.tag in _RENAMED[actuator.tag]:
                draft.rename(child, _RENAMED[actuator.tag][child.tag])
        tag, default = _VECTOR[actuator.tag]
        vector = actuator.find(tag)
        if vector is None:
            vector = draft.add(actuator, tag, default, source=actuator)
        vector.text = _opposite(vector)
        lost = None
        if actuator.tag == "PointActuator":
            reacting = actuator.find("body_A")
            if reacting is not None:
                name = plain(reacting)
                lost = None if name in ("", "ground") else f"that the force reacts on '{name}'"
                draft.remove(reacting)
            if actuator.find("force_is_global") is None:
                draft.add(actuator, "force_is_global", "true", source=actuator)
        draft.changed(actuator, lost=lost)


def _opposite(element: Element) -> str:
    """A vector's text with every sign turned round."""
    return " ".join(
        word[1:] if word.startswith("-") else "-" + word.lstrip("+")
        for word in plain(element).split()
    )
