"""Coordinates: their ranges, prescribed motions, and what each became."""

from __future__ import annotations

import math

import numpy as np

from osimlite.mechanics.multibody.functions import Linear, SmoothFunction
from osimlite.schema.joints import Joint
from osimlite.simulation.robot.couplings import Composition, StraightLine
from osimlite.translate.fidelity import LEFT_OUT
from osimlite.translate.mjcf.draft import Follower, Lead, MjcfDraft


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
            _prescribe(draft, coordinate.path, coordinate.prescribed, leader)
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


def _prescribe(draft: MjcfDraft, path: str, function: SmoothFunction, lead: Lead) -> None:
    """Let the joint of a prescribed coordinate follow time, or the joint that it follows itself.

    Args:
        draft: MJCF under construction.
        path: absolute path of the coordinate.
        function: prescribed value (rad or m) as a function of time (s).
        lead: joint of the coordinate.
    """
    joint, line = lead
    is_driven = draft.options.driver
    follower = draft.followers.get(joint)
    if follower is not None:
        dependence = _find_line(draft, follower)
        if follower.leader is None or (dependence and follower.leader in draft.followers):
            # Something else moves the joint already, by the same values if the model is consistent.
            return
        if dependence is not None:
            # A joint has one equality: the inverse function moves the joint that leads this one.
            joint, line = follower.leader, dependence.inverse().compose(line)
        elif is_driven:
            draft.fidelity.add(
                "prescribed",
                path,
                "a prescribed coordinate that a coupler also makes a nonlinear function of another one",
                f"{LEFT_OUT}: only the coupler moves it",
            )
            return
    start = function.evaluate(np.zeros(1))[0]
    # The driver evaluates the function of time at every step.
    joint_function = Composition(Linear(*line), function) if is_driven else None
    draft.add_follower(joint, Follower(None, (line.slope * start + line.offset,), joint_function))
    if joint_function is None:
        draft.fidelity.add(
            "prescribed",
            path,
            "a coordinate that follows a function of time",
            "held at its value at time 0; write the function into eq_data at every step",
            f"equality {joint}",
        )


def _find_line(draft: MjcfDraft, follower: Follower) -> StraightLine | None:
    """Return the dependence of a joint on a joint of the model if it is linear and not constant."""
    if follower.function is not None or follower.leader in (None, *draft.helpers):
        return None
    offset, slope, *higher = (*follower.polynomial, 0.0, 0.0)
    return StraightLine(slope, offset) if slope and not any(higher) else None
