"""Bodies and joints: every body of the model is one element, with the joints that carry it.

Several joints in one element of MuJoCo move it one after the other, each about an anchor and an
axis that the previous ones carry along. A chain of one-axis joints therefore needs no massless
bodies between: the anchors and axes are those of the chain at zero, seen from its end.
"""

from __future__ import annotations

import numpy as np
from lxml.etree import _Element

from osimlite.mechanics.multibody.spatial import Array, invert_transform, quaternion_of
from osimlite.schema.frames import PhysicalFrame
from osimlite.schema.joints import Joint
from osimlite.simulation.robot.robot import (
    RobotJoint,
    RobotLink,
    breaks_triangle_rule,
    principal_axes,
)
from osimlite.translate.fidelity import Error
from osimlite.translate.mjcf.draft import MjcfDraft, add_element, clear_rounding, format_pose
from osimlite.translate.mjcf.scenery import FRAME_GROUP

MIN_MASS = 1e-14
"""Mass (kg) and principal moments (kg·m²) of a moving body that has none: MuJoCo requires
more than 1e-15.
"""

MAX_JOINTS_PER_BODY = 6
"""Most joints that MuJoCo allows in one body."""


def add_bodies(draft: MjcfDraft) -> None:
    """Add all bodies with their inertias and joints."""
    robot = draft.robot
    joint_by_child = {joint.child: joint for joint in robot.joints}
    bodies = {
        path: index for index, path in enumerate(body.path for body in draft.mechanism.bodies)
    } | {"/ground": -1}
    for link in robot.links:
        if not link.bodies:
            continue
        # Bodies are not merged for MJCF: each link has at most one.
        (path,) = link.bodies
        if path == "/ground":
            element = draft.get_section("worldbody")
            draft.frames[link.name] = element, np.eye(4)
            draft.fidelity.translated[path] = "worldbody"
        else:
            chain: list[RobotJoint] = []
            while not chain or chain[0].parent not in draft.frames:
                chain.insert(0, joint_by_child[chain[0].parent if chain else link.name])
            element = _add_chain(draft, chain, link.name)
            _add_inertia(
                draft,
                element,
                link,
                path,
                is_moving=any(robot_joint.kind != "fixed" for robot_joint in chain),
            )
            if path in draft.tree.by_path:
                draft.fidelity.translated[path] = f"body {link.name}"
                draft.fidelity.note_name(path, "body", path.rpartition("/")[2], link.name)
        draft.bodies[bodies[path]] = element
    for component, path in draft.iterate_components(Joint):
        names = [robot_joint.name for robot_joint in robot.moving if robot_joint.source == path]
        draft.fidelity.translated[path] = f"joints {' '.join(names)}" if names else "welded"
        for frame in component.frames:
            draft.fidelity.translated[draft.tree.path_of(frame) or ""] = "anchors of joints"


def add_frames(draft: MjcfDraft) -> None:
    """Add a site for every frame that is not a body, so that programs can read its pose."""
    for _, path in draft.iterate_components(PhysicalFrame):
        if path in draft.mechanism.frames:
            draft.fidelity.translated[path] = (
                f"site {draft.add_site(path, *draft.mechanism.frames[path], group=FRAME_GROUP)}"
            )


def _add_chain(draft: MjcfDraft, chain: list[RobotJoint], name: str) -> _Element:
    """Add the element of the body at the end of a chain of joints to the body that carries it.

    Returns:
        Element of the body at the end of the chain.
    """
    parent, start = draft.frames[chain[0].parent]
    moving_indices = [index for index, joint in enumerate(chain) if joint.kind != "fixed"]
    # A longer chain is cut: a carrier body with negligible inertia has the first joints.
    if len(moving_indices) > MAX_JOINTS_PER_BODY:
        split_index = moving_indices[MAX_JOINTS_PER_BODY]
        carrier = _add_chain(draft, chain[:split_index], draft.make_name("body", f"{name}_carrier"))
        add_element(
            carrier,
            "inertial",
            pos=np.zeros(3),
            mass=MIN_MASS,
            diaginertia=np.full(3, MIN_MASS),
        )
        return _add_chain(draft, chain[split_index:], name)
    # From the end of the chain, `to_body` is the transform from a joint to the body at zero.
    to_body = np.eye(4)
    joints: list[tuple[RobotJoint, Array, Array]] = []
    frames_in_body: dict[str, Array] = {}
    for joint in reversed(chain):
        if not joints:
            frames_in_body[joint.child] = invert_transform(to_body)
        if joint.kind != "fixed":
            joints.append((joint, to_body[:3, :3].T @ joint.axis, invert_transform(to_body)[:3, 3]))
        to_body = joint.origin @ to_body
    element = add_element(parent, "body", name=name, **format_pose(start @ to_body))
    draft.frames |= {link: (element, frame) for link, frame in frames_in_body.items()}
    for joint, axis, anchor in reversed(joints):
        is_hinge = joint.kind == "revolute"
        index = clear_rounding(anchor)
        # The anchor of a slide has no effect.
        anchored = index if is_hinge and index.any() else None
        add_element(
            element,
            "joint",
            name=joint.name,
            type="hinge" if is_hinge else "slide",
            axis=clear_rounding(axis),
            pos=anchored,
        )
    return element


def _add_inertia(
    draft: MjcfDraft, element: _Element, link: RobotLink, path: str, *, is_moving: bool
) -> None:
    """Add mass and inertia of a body, repaired where MuJoCo rejects them."""
    original, axes = principal_axes(link.inertia)
    mass = link.mass
    # Bodies that are welded to the world need no mass.
    least = MIN_MASS if is_moving else 0.0
    moments = _repair_moments(original, least)
    if breaks_triangle_rule(original):
        draft.fidelity.add(
            "inertia",
            path,
            "an inertia that no body can have (one principal moment exceeds the sum of the others): MuJoCo stops with "
            "'inertia must satisfy A + B >= C'",
            "the smaller moments are raised until the inertia is possible (MuJoCo's option balanceinertia "
            "would set all three to their mean); for the original inertia, set body_inertia of the compiled model",
            "moments " + ", ".join(f"{moment:g}" for moment in original) + " kg m^2",
            {"moment": Error.measure(moments - original, "kg m^2")},
        )
    if mass < least:
        draft.fidelity.add(
            "massless",
            path,
            "a moving body without mass: MuJoCo stops with 'mass and inertia of moving bodies must be larger than "
            "mjMINVAL'",
            f"a mass of {MIN_MASS:g} kg",
        )
        mass = least
    if mass > 0.0:
        quaternion = clear_rounding(quaternion_of(axes))
        add_element(
            element,
            "inertial",
            pos=clear_rounding(link.center),
            quat=quaternion,
            mass=mass,
            diaginertia=moments,
        )


def _repair_moments(moments: Array, least: float) -> Array:
    """Raise principal moments until MuJoCo accepts them.

    Moments below `least` are raised to it; then the smallest is raised until none exceeds the sum
    of the others, also in floating point.

    Args:
        moments: principal moments (3,), kg·m², of any sign.
        least: least moment (kg·m²), not negative.

    Returns:
        Repaired principal moments (3,), kg·m².
    """
    # Negative moments come first: the rule for the sums holds for the numbers that are written.
    repaired = np.maximum(moments, least)
    smallest, middle, largest = np.argsort(repaired)
    repaired[smallest] = max(repaired[smallest], repaired[largest] - repaired[middle])
    # MuJoCo compares the sum without tolerance, so that rounding must not leave it too small.
    while repaired[smallest] + repaired[middle] < repaired[largest]:
        repaired[smallest] = np.nextafter(repaired[smallest], np.inf)
    return repaired
