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
    moving = {index for joint in draft.robot.moving for index in joint.coordinates}
    for index, coordinate in enumerate(draft.mechanism.coordinates):
        leader = draft.leads.get(index)
        result = (
            "locked: its value is part of the body's fixed position"
            if coordinate.locked
            else "the variable that its joints follow"
        )
        draft.fidelity.translated[coordinate.path] = (
            result if leader is None else f"joint {leader.joint}"
        )
        if leader is None and index not in moving and not coordinate.locked:
            note("coordinate", coordinate.path, "a coordinate that moves no body", "left out")
        if leader is not None:
            draft.fidelity.note_name(coordinate.path, "joint", coordinate.name, leader.joint)
        # A scaled joint would need a scaled range, which users would misread.
        if leader is not None and leader.line == (1.0, 0.0):
            element = elements[leader.joint]
            if (
                all(map(math.isfinite, coordinate.range))
                and coordinate.range[0] < coordinate.range[1]
            ):
                element.set("range", " ".join(map(repr, coordinate.range)))
                # A range of a coordinate does not stop a motion in OpenSim.
                element.set("limited", "false")
        if coordinate.clamped:
            note(
                "clamped",
                coordinate.path,
                "a clamped coordinate, which user interfaces keep in its range",
                "left out",
            )
        if coordinate.prescribed is not None and not coordinate.locked and leader is not None:
            start = coordinate.prescribed.evaluate(np.zeros(1))[0]
            # The driver evaluates the function of time at every step.
            joint_function = (
                Composition(Linear(*leader.line), coordinate.prescribed)
                if draft.options.driver
                else None
            )
            draft.add_follower(
                leader.joint,
                Follower(None, (leader.line.slope * start + leader.line.offset,), joint_function),
            )
            if joint_function is None:
                note(
                    "prescribed",
                    coordinate.path,
                    "a coordinate that follows a function of time",
                    "held at its value at time 0; write the function into eq_data at every step",
                    f"equality {leader.joint}",
                )
    for joint in draft.tree.components:
        if isinstance(joint, Joint) and not joint.speeds_are_rates:
            note(
                "speeds",
                draft.tree.path_of(joint) or "",
                "a joint with three rotations, whose speeds are the components of its angular velocity",
                "three hinges with the same coordinates; their speeds are the rates of the coordinates; "
                "singular in the same poses as in OpenSim",
            )
    for body in draft.mechanism.bodies:
        # The joint that OpenSim adds for a loose body is not a component of the model.
        if body.path in draft.tree.by_path and body.mobilizer.joint not in draft.tree.by_path:
            note(
                "loose-body",
                body.path,
                "a body without a joint",
                "free to move relative to ground, as in OpenSim; the speeds of its three hinges are the rates of the "
                "angles, and not the components of the angular velocity",
            )
