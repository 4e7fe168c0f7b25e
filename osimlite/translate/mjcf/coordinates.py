"""Coordinates: their ranges, prescribed motions, and what each became."""

from __future__ import annotations

import math

import numpy as np

from osimlite.mechanics.multibody.functions import Linear
from osimlite.schema.joints import Joint
from osimlite.simulation.robot.couplings import Composition
from osimlite.translate.mjcf.draft import Follower, MjcfDraft


def add_coordinates(draft: MjcfDraft) -> None:
    """Add ranges of coordinates to their joints, without limits, and hold prescribed coordinates."""
    elements = {joint.get("name"): joint for joint in draft.get_section("worldbody").iter("joint")}
    note = draft.fidelity.add
    moving = {place for joint in draft.robot.moving for place in joint.coordinates}
    for place, info in enumerate(draft.mechanism.coordinates):
        lead = draft.leads.get(place)
        done = (
            "locked: a part of the body that carries it"
            if info.locked
            else "what its joints follow"
        )
        draft.fidelity.translated[info.path] = done if lead is None else f"joint {lead.joint}"
        if lead is None and place not in moving and not info.locked:
            note("coordinate", info.path, "a coordinate that moves nothing", "left out")
        if lead is not None:
            draft.fidelity.note_name(info.path, "joint", info.name, lead.joint)
        # A scaled joint would need a scaled range, which users would misread.
        if lead is not None and lead.line == (1.0, 0.0):
            element = elements[lead.joint]
            if all(map(math.isfinite, info.range)) and info.range[0] < info.range[1]:
                element.set("range", " ".join(map(repr, info.range)))
                # A range of a coordinate does not stop a motion in OpenSim.
                element.set("limited", "false")
        if info.clamped:
            note("clamped", info.path, "clamped range in user interfaces", "left out")
        if info.prescribed is not None and not info.locked and lead is not None:
            start = info.prescribed.evaluate(np.zeros(1))[0]
            # The driver evaluates the function of time at every step.
            exact = (
                Composition(Linear(*lead.line), info.prescribed) if draft.options.driver else None
            )
            draft.add_follower(
                lead.joint, Follower(None, (lead.line.slope * start + lead.line.start,), exact)
            )
            if exact is None:
                note(
                    "prescribed",
                    info.path,
                    "a coordinate that follows a function of time",
                    "held at its value at time 0; write the function into eq_data at every step",
                    f"equality {lead.joint}",
                )
    for joint in draft.tree.components:
        if isinstance(joint, Joint) and not joint.speeds_are_rates:
            note(
                "speeds",
                draft.tree.path_of(joint) or "",
                "three rotations at once, whose speeds are an angular velocity",
                "three hinges: the same coordinates, whose speeds are their rates; singular where OpenSim's are",
            )
