"""Generalized forces as forces and torques on the bodies of joints, as OpenSim's InverseDynamicsTool reports them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.records import replace
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.kinematics import Kinematics
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.schema_frames import Placements
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.joints import Joint, ScapulothoracicJoint
from osimlite.schema.model import Model
from osimlite.simulation.recorded_motion import RecordedMotion

_SLIGHT = 2.0**-45.5
"""Simbody's SignificantReal: forces of this size are none."""


def loads_at_joints(
    model: Model, joints: Sequence[Joint], recorded: RecordedMotion, forces: Array
) -> StoTable:
    """Force (N) and torque (N m) on the child of each joint at its frame, in ground, that do what its forces do.

    Where either does some of it, that counts which does more with less; the other one does the
    rest, and each is the shortest that does.

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
        # OpenSim asks what carries the child, and besides what has the joint's coordinates: others
        # if it closes a loop.
        asked.append((joint, {carried[base], by_joint[placements.path(joint)]}))
        root = f"{joint.name}_{placements.path(frame).rpartition('/')[2]}"
        labels += [f"{root}_{what}{axis}" for what in "FM" for axis in "XYZ"]
    # OpenSim moves a scapula by two mobilizers: along the ellipsoid, and about the axis of winging.
    hinges = [
        [_hinges(mechanism, body, apart=isinstance(joint, ScapulothoracicJoint)) for body in bodies]
        for joint, bodies in asked
    ]
    rows = np.zeros((len(recorded.times), len(joints), 2, 3))
    for row, q, own in zip(rows, recorded.values, forces, strict=True):
        state = mechanism.at(q)
        for number, each in enumerate(hinges):
            row[number] = sum(_load(state, *hinge, own) for hinge in each)
    title = "Inverse Dynamics Body Forces at Specified Joints"
    return StoTable(title, recorded.times, tuple(labels), rows.reshape(len(rows), -1))


_Hinge = tuple[list[int], Mechanism]
"""Coordinates, and the mechanism of one body that they move in ground."""


def _hinges(mechanism: Mechanism, body: int, *, apart: bool) -> tuple[int, Array, list[_Hinge]]:
    """What the mobilizer of a body does: the body that carries it, where in that, and the hinges one after another.

    If `apart`, each of its motions is a hinge of its own.
    """
    mobilizer = mechanism.bodies[body].mobilizer
    groups = [[motion] for motion in mobilizer.motions] if apart else [[*mobilizer.motions]]
    hinges: list[_Hinge] = []
    for motions in groups[::-1] if mobilizer.reversed else groups:
        used = sorted({place for motion in motions for place in motion.coordinates})
        renumbered: Any = [
            replace(m, coordinates=tuple(map(used.index, m.coordinates))) for m in motions
        ]
        places = [mobilizer.coordinates[place] for place in used]
        still, count = np.eye(4), tuple(range(len(used)))
        alone = replace(
            mobilizer, motions=renumbered, coordinates=count, parent_frame=still, child_frame=still
        )
        carried = replace(mechanism.bodies[body], parent=GROUND, mobilizer=alone)
        infos = tuple(
            replace(mechanism.coordinates[place], locked=False, prescribed=None) for place in places
        )
        hinges.append((places, Mechanism(mobilizer.joint, (carried,), infos)))
    inner = mobilizer.child_frame if mobilizer.reversed else mobilizer.parent_frame
    return mechanism.bodies[body].parent, inner[:3, :3], hinges


def _load(
    state: Kinematics, parent: int, inner: Array, hinges: Sequence[_Hinge], forces: Array
) -> Array:
    """Force and torque (2, 3) in ground for the generalized forces (n,) at hinges one after another."""
    rotation, load = state.rotations[parent] @ inner, np.zeros((2, 3))
    for places, hinge in hinges:
        across = hinge.at(state.q[places])
        load += _of_hinge(across.jacobians[0].T, forces[places]) @ rotation.T
        rotation = rotation @ across.rotations[0]
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
