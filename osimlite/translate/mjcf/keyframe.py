"""Default pose as a keyframe."""

from __future__ import annotations

from lxml.etree import Comment
from numpy.polynomial.polynomial import polyder, polyval

from osimlite.errors import SimulationError
from osimlite.translate.mjcf.draft import MjcfDraft, add_element


def add_keyframe(draft: MjcfDraft) -> None:
    """Add the default pose and speeds, which fulfil the constraints.

    Followers are where their leaders put them.
    """
    q, u = draft.default_state
    try:
        draft.mechanism.acceleration(q, u)
    except SimulationError as error:
        consequence = "written unchanged: poses are correct, but simulated motions are meaningless"
        draft.fidelity.add(
            "singular",
            "/",
            "a coordinate that moves no mass, for which OpenSim cannot compute the acceleration",
            consequence,
            error.message,
        )
    qdot = draft.mechanism.coordinate_rates(q, u)
    values = draft.robot.joint_values(q)
    rates = dict(zip(values, (draft.robot.joint_jacobian(q) @ qdot).tolist(), strict=True))
    for index, (joint, line) in draft.leads.items():
        values[joint], rates[joint] = line.slope * q[index] + line.offset, line.slope * qdot[index]
    # Joints of helper bodies are not part of the robot.
    values |= draft.starts
    # Followers last: their leaders have values by now.
    for joint, follower in draft.followers.items():
        value = values.get(follower.leader or "", 0.0)
        rate = rates.get(follower.leader or "", 0.0)
        values[joint] = float(polyval(value, follower.polynomial))
        rates.setdefault(joint, float(rate * polyval(value, polyder(follower.polynomial))))
    if any(values.values()) and len(draft.get_section("equality")):
        draft.start_note = (
            "start simulations from the keyframe 'default', with mj_resetDataKeyframe(model, data, 0): at qpos0, where "
            "a new MjData starts, the equality constraints do not hold, and their forces can throw the model apart"
        )
        # The first comment names the program.
        draft.root.insert(1, Comment(f" {draft.start_note[0].upper()}{draft.start_note[1:]}. "))
    names = [joint.get("name", "") for joint in draft.get_section("worldbody").iter("joint")]
    actuators = [actuator.get("name", "") for actuator in draft.get_section("actuator")]
    add_element(
        draft.get_section("keyframe"),
        "key",
        name="default",
        qpos=[values[name] for name in names],
        qvel=[rates.get(name, 0.0) for name in names],
        act=[draft.activations[name] for name in actuators if name in draft.activations] or None,
    )
