"""What the driver computes: a control for each of the model's, and room for the states of its forces."""

from __future__ import annotations

from osimlite.schema.base import ModelComponent
from osimlite.schema.contact import ContactGeometry
from osimlite.schema.sets import Controller
from osimlite.schema.wrapping import WrapObject
from osimlite.simulation.elements import force_elements
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import Draft, add

STATES = "osimlite.states"
"""Name of the actuator whose activations are the auxiliary states of all forces."""

COMPUTED = "computed by osimlite.mjcf.Driver"


def add_driven(draft: Draft) -> None:
    """Add actuators that push nothing: one for each control, and one that has the auxiliary states."""
    forces = force_elements(
        draft.model, draft.mechanism, skip_unsupported=True, folder=draft.folder
    )
    for words in forces.skipped:
        path, _, kind = words.partition(" (")
        draft.fidelity.add(
            "force",
            path.strip("'"),
            f"a {kind.rstrip(')')}",
            f"{LEFT_OUT}: osimlite cannot compute it",
        )
    for element in forces.elements:
        draft.account(element.path, COMPUTED)
    for component, path in draft.components(ModelComponent):
        if isinstance(component, ContactGeometry | WrapObject | Controller):
            draft.account(path, COMPUTED)
    joint = draft.section("worldbody").find(".//joint")
    if joint is None:
        return
    states, idle = (
        draft.name("actuator", STATES),
        {"joint": joint.get("name"), "gainprm": 0, "gear": 0},
    )
    for path in forces.controls.names:
        add(draft.section("actuator"), "general", name=draft.name("actuator", path), **idle)
    count = sum(len(element.states) for element in forces.elements)
    if count:
        add(draft.section("actuator"), "general", name=states, dyntype="user", actdim=count, **idle)
