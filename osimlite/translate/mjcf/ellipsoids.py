"""Ellipsoid joints: a mechanism with linear couplings that keeps a body on an ellipsoid.

The origin of the body is p = diag(r) n with the radii r (m) and the body's own z axis n. A point
ahead of it by h (m) along n is s = diag(r + h) n. A small body on three slides that is connected to
this point has the coordinates s, and each component of p is r / (r + h) times that of s: a linear
coupling.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from osimlite.mechanics.multibody.motions import EllipsoidPoint
from osimlite.simulation.robot.robot import RobotJoint
from osimlite.translate.mjcf.draft import (
    SPECK_MASS_KG,
    Follower,
    MjcfDraft,
    add_element,
    format_pose,
)


def add_ellipsoids(draft: MjcfDraft) -> None:
    """Add the mechanism for every joint whose body stays on an ellipsoid."""
    joints = draft.robot.joints
    slide_indices = [
        index for index, joint in enumerate(joints) if isinstance(joint.function, EllipsoidPoint)
    ]
    for _, group in groupby(slide_indices, key=lambda index: joints[index].source):
        indices = list(group)
        _add_ellipsoid_follower(
            draft, [joints[index] for index in indices], joints[indices[-1] + 1 : indices[-1] + 4]
        )


def _add_ellipsoid_follower(
    draft: MjcfDraft, slides: list[RobotJoint], rotations: tuple[RobotJoint, ...]
) -> None:
    """Add the small body that holds the body of one EllipsoidJoint on its ellipsoid.

    MuJoCo has no such joint. The small body slides along the axes of the ellipsoid and is connected
    to a point ahead of the body, at the distance L along its normal n. Its slides then have the values
    (r + L) n, and the body's own slides follow them with the fixed fractions r / (r + L).

    Args:
        draft: MJCF under construction; changed.
        slides: translations of the joint along the axes of the ellipsoid.
        rotations: joints after the slides. A joint of another structure is left to the general
            treatment of functions.
    """
    radii = {}
    for joint in slides:
        assert isinstance(joint.function, EllipsoidPoint)
        axis = np.eye(3)[joint.function.component]
        if np.array_equal(joint.axis, axis):
            radii[joint.function.component] = joint.function.radius
    base = draft.frames.get(slides[0].parent)
    end = draft.frames.get(rotations[-1].child) if rotations else None
    same_coordinates = {index for joint in rotations for index in joint.coordinates} == set(
        slides[0].coordinates
    )
    # Another arrangement of axes is left to the general treatment of functions.
    if len(radii) < len(slides) or base is None or end is None or not same_coordinates:
        return
    # Any distance is exact; the largest radius makes ratios of about one half.
    lead_distance = max(radii.values())
    path = slides[0].source
    name = draft.make_name("ellipsoid", path)
    element, frame = base
    carrier = draft.add_speck(name, element, frame @ slides[0].origin)
    state = draft.default_state[0]
    for component, axis in enumerate(np.eye(3)):
        carrier_joint = draft.make_name("joint", f"{name}_{'xyz'[component]}")
        add_element(carrier, "joint", name=carrier_joint, type="slide", axis=axis)
        radius = radii.get(component, 0.0)
        normal = EllipsoidPoint(component, 1.0).evaluate(state[list(slides[0].coordinates)])[0]
        draft.starts[carrier_joint] = (radius + lead_distance) * normal
        for slide in slides:
            if slide.function == EllipsoidPoint(component, radius):
                draft.add_follower(
                    slide.name, Follower(carrier_joint, (0.0, radius / (radius + lead_distance)))
                )
    element, frame = end
    point = frame.copy()
    point[:3, 3] += lead_distance * frame[:3, 2]
    sites = [draft.make_name("site", f"{name}_{suffix}") for suffix in ("ahead", "speck")]
    add_element(element, "site", name=sites[0], **format_pose(point))
    add_element(carrier, "site", name=sites[1])
    equality = draft.make_name("equality", path)
    add_element(
        draft.get_section("equality"), "connect", name=equality, site1=sites[0], site2=sites[1]
    )
    draft.fidelity.add(
        "ellipsoid",
        path,
        "a body that stays on an ellipsoid",
        f"slide joints that follow a helper body of {SPECK_MASS_KG:g} kg; the helper is connected to a point "
        "on the body's z axis",
        f"equality {equality}",
    )
