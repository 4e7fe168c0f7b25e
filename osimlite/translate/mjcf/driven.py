"""Elements for the driver: controls of the model, and memory for the states of its forces."""

from __future__ import annotations

from osimlite.base.text import add_article
from osimlite.schema.base import ModelComponent
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.sets import Controller
from osimlite.schema.wrapping import WrapObject
from osimlite.simulation.elements import force_elements
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import MjcfDraft, add_element

STATES_ACTUATOR = "osimlite.states"
"""Name of the actuator whose activations are the auxiliary states of all forces."""

COMPUTED_NOTE = "computed by osimlite.mjcf.Driver"
"""Entry of the account for components that the driver computes."""


def add_driven(draft: MjcfDraft) -> None:
    """Add actuators without force: one for each control, and one that stores the auxiliary states."""
    forces = force_elements(
        draft.model, draft.mechanism, skip_unsupported=True, folder=draft.folder
    )
    for skipped in forces.skipped:
        path, _, force_class = skipped.partition(" (")
        draft.fidelity.add(
            "force",
            path.strip("'"),
            add_article(force_class.rstrip(")")),
            f"{LEFT_OUT}: osimlite cannot compute it",
        )
    for element in forces.elements:
        draft.record_result(element.path, COMPUTED_NOTE)
    for component, path in draft.iterate_components(ModelComponent):
        if isinstance(component, ContactGeometry | WrapObject | Controller):
            draft.record_result(path, COMPUTED_NOTE)
    joint = draft.get_section("worldbody").find(".//joint")
    # MuJoCo's actuators need a joint; a model without one has no motion.
    if joint is None:
        return
    # With gear and gain 0, MuJoCo applies no force; controls are read by the driver.
    states = draft.make_name("actuator", STATES_ACTUATOR)
    idle = {"joint": joint.get("name"), "gainprm": 0, "gear": 0}
    for path in forces.controls.names:
        add_element(
            draft.get_section("actuator"), "general", name=draft.make_name("actuator", path), **idle
        )
    count = sum(len(element.states) for element in forces.elements)
    if count:
        add_element(
            draft.get_section("actuator"),
            "general",
            name=states,
            dyntype="user",
            actdim=count,
            **idle,
        )
