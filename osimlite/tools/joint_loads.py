"""Generalized forces as forces and torques on the bodies of joints, as OpenSim's InverseDynamicsTool reports them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.multibody.kinematics import Kinematics
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.schema_frames import Placements
from osimlite.multibody.spatial import Array
from osimlite.schema.joints import Joint
from osimlite.schema.model import Model
from osimlite.simulation.files.recorded import RecordedMotion
from osimlite.simulation.files.storage import StoTable

_SLIGHT = 2.0**-45.5
"""Simbody's SignificantReal: forces of this size are none."""


def loads_at_joints(model: Model, joints: Sequence[Joint], recorded: RecordedMotion, forces: Array) -> StoTable:
    """Force (N) and torque (N m) on the child of each joint at its frame, in ground, that do what its forces do.

    Where either does some of it, that counts which does more with less; the other one does the rest, and each is the
    shortest that does.

    Args:
        model: whose joints.
        joints: those that are asked for.
        recorded: the motion.
        forces: generalized forces (t, n) in the order of the mechanism.
    """
    mechanism, placements = recorded.mechanism, Placements(model.tree())
    carried = {body.path: place for place, body in enumerate(mechanism.bodies)}
    by_joint = {body.mobilizer.joint: place for place, body in enumerate(mechanism.bodies)}
    asked, labels = [], []
    for joint in joints:
        frame = placements.named(joint, "socket_child_frame")
        base, _ = placements.frame(frame)
        # OpenSim asks what carries the child, and besides what has the joint's coordinates: others if it closes a loop.
        asked.append({carried[base], by_joint[placements.path(joint)]})
        root = f"{joint.name}_{placements.path(frame).rpartition('/')[2]}"
        labels += [f"{root}_{what}{axis}" for what in "FM" for axis in "XYZ"]
    rows = np.zeros((len(recorded.times), len(joints), 2, 3))
    for row, q, own in zip(rows, recorded.values, forces, strict=True):
        state = mechanism.at(q)
        for number, bodies in enumerate(asked):
            for body in bodies:
                row[number] += _load(mechanism, state, body, own)
    title = "Inverse Dynamics Body Forces at Specified Joints"
    return StoTable(title, recorded.times, tuple(labels), rows.reshape(len(rows), -1))


def _load(mechanism: Mechanism, state: Kinematics, body: int, forces: Array) -> Array:
    """Force and torque (2, 3) in ground for the generalized forces (n,) of the mobilizer that carries a body."""
    mobilizer, own = mechanism.bodies[body].mobilizer, list(mechanism.bodies[body].mobilizer.coordinates)
    if not own:
        return np.zeros((2, 3))
    across = mobilizer.across_motion(state.q[own], state.u[own])
    inner = mobilizer.child_frame if mobilizer.reversed else mobilizer.parent_frame
    hinge = (across.inverse() if mobilizer.reversed else across).jacobian.T
    turning, moving, wanted = hinge[:, :3], hinge[:, 3:], forces[own]
    force, torque = _shortest(moving, wanted), _shortest(turning, wanted)
    by_force, by_torque = moving @ force, turning @ torque
    size_by_force, size_by_torque = np.linalg.norm(by_force), np.linalg.norm(by_torque)
    if size_by_force > _SLIGHT and size_by_torque > _SLIGHT:
        if size_by_torque * np.linalg.norm(force) > size_by_force * np.linalg.norm(torque):
            force = _shortest(moving, wanted - by_torque)
        else:
            torque = _shortest(turning, wanted - by_force)
    rotation = state.rotations[mechanism.bodies[body].parent] @ inner[:3, :3]
    return np.array((rotation @ force, rotation @ torque))


def _shortest(rows: Array, values: Array) -> Array:
    return np.asarray(np.linalg.lstsq(rows, values, rcond=1e-13)[0], dtype=np.float64)
