"""Generalized forces as forces and torques on the bodies of joints, as OpenSim's InverseDynamicsTool reports them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.multibody.kinematics import Kinematics
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.schema_frames import Placements
from osimlite.multibody.spatial import Array
from osimlite.schema.joints import Joint, ScapulothoracicJoint
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
    carried = {body.path: index for index, body in enumerate(mechanism.bodies)}
    by_joint = {body.mobilizer.joint: index for index, body in enumerate(mechanism.bodies)}
    asked, labels = [], []
    for joint in joints:
        frame = placements.named(joint, "socket_child_frame")
        base, _ = placements.frame(frame)
        # OpenSim asks what carries the child, and besides what has the joint's coordinates: others if it closes a loop.
        asked.append((joint, {carried[base], by_joint[placements.path(joint)]}))
        root = f"{joint.name}_{placements.path(frame).rpartition('/')[2]}"
        labels += [f"{root}_{what}{axis}" for what in "FM" for axis in "XYZ"]
    rows = np.zeros((len(recorded.times), len(joints), 2, 3))
    for row, q, own in zip(rows, recorded.values, forces, strict=True):
        state = mechanism.at(q)
        for number, (joint, bodies) in enumerate(asked):
            for body in bodies:
                # OpenSim moves a scapula by two mobilizers: along the ellipsoid, and about the axis of winging.
                row[number] += _load(mechanism, state, body, own, isinstance(joint, ScapulothoracicJoint))
    title = "Inverse Dynamics Body Forces at Specified Joints"
    return StoTable(title, recorded.times, tuple(labels), rows.reshape(len(rows), -1))


def _load(mechanism: Mechanism, state: Kinematics, body: int, forces: Array, apart: bool) -> Array:
    """Force and torque (2, 3) in ground for the generalized forces (n,) of the mobilizer that carries a body.

    If `apart`, the sum of those that each of its motions has for itself.
    """
    mobilizer, own = mechanism.bodies[body].mobilizer, list(mechanism.bodies[body].mobilizer.coordinates)
    q, u, load = state.q[own], state.u[own], np.zeros((2, 3))
    inner = mobilizer.child_frame if mobilizer.reversed else mobilizer.parent_frame
    rotation = state.rotations[mechanism.bodies[body].parent] @ inner[:3, :3]
    across = [part.relative(q, u) for part in mobilizer.motions] if apart else [mobilizer.across_motion(q, u)]
    for motion in [one.inverse() for one in reversed(across)] if mobilizer.reversed else across:
        load += _of_hinge(motion.jacobian.T, forces[own]) @ rotation.T
        rotation = rotation @ motion.rotation
    return load


def _of_hinge(hinge: Array, wanted: Array) -> Array:
    """Force and torque (2, 3) for the generalized forces (k,) of a hinge whose motion has the Jacobian (k, 6)."""
    turning, moving = hinge[:, :3], hinge[:, 3:]
    force, torque = _shortest(moving, wanted), _shortest(turning, wanted)
    by_force, by_torque = moving @ force, turning @ torque
    size_by_force, size_by_torque = np.linalg.norm(by_force), np.linalg.norm(by_torque)
    if size_by_force > _SLIGHT and size_by_torque > _SLIGHT:
        if size_by_torque * np.linalg.norm(force) > size_by_force * np.linalg.norm(torque):
            force = _shortest(moving, wanted - by_torque)
        else:
            torque = _shortest(turning, wanted - by_force)
    return np.array((force, torque))


def _shortest(rows: Array, values: Array) -> Array:
    return np.asarray(np.linalg.lstsq(rows, values, rcond=1e-13)[0], dtype=np.float64)
