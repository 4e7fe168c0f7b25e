"""Sampled poses of a compiled model, in which paths are compared with tendons."""

from __future__ import annotations

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf_import.joints import BALL, FREE, HINGE
from osimlite.translate.mjcf_import.source import MjcfSource

UNLIMITED = {"hinge": 1.5, "slide": 0.1}
"""Distance from the default (rad, m) within which joints without a range are sampled."""
EQUALITY_ROUNDS = 4
"""Rounds in which dependent joints are set: one that follows another dependent joint needs two."""


@dataclass(frozen=True, eq=False)
class SampledPoses:
    """P poses of a compiled model.

    Attributes:
        qpos: positions (P, nq).
        sites: places (P, nsite, 3) of the sites, m.
        geoms: positions (P, ngeom, 3) of the geoms, m.
        rotations: orientations (P, ngeom, 3, 3) of the geoms.
    """

    qpos: Array
    sites: Array
    geoms: Array
    rotations: Array


def sample_qpos(source: MjcfSource, count: int, seed: int) -> Array:
    """Return positions (P, nq) that are spread evenly over the joint ranges and obey equalities.

    Free joints keep their default pose, because no tendon depends on it unless it is tied to the
    world; the angle of ball joints is up to 1 rad.
    """
    model = source.model
    generator = np.random.default_rng(seed)
    qpos = np.tile(model.qpos0, (count, 1))
    for joint in range(model.njnt):
        joint_type, address = int(model.jnt_type[joint]), int(model.jnt_qposadr[joint])
        if joint_type == FREE:
            continue
        if joint_type == BALL:
            axes = generator.normal(size=(count, 3))
            axes /= np.linalg.norm(axes, axis=1, keepdims=True)
            half_angle = 0.5 * generator.uniform(0.0, 1.0, (count, 1))
            qpos[:, address : address + 4] = np.hstack(
                (np.cos(half_angle), np.sin(half_angle) * axes)
            )
            continue
        lower, upper = map(float, model.jnt_range[joint])
        if not lower < upper:
            half_range = UNLIMITED["hinge" if joint_type == HINGE else "slide"]
            lower, upper = (float(model.qpos0[address]) + sign * half_range for sign in (-1.0, 1.0))
        qpos[:, address] = generator.uniform(lower, upper, count)
    satisfy_equalities(source, qpos)
    return qpos


def satisfy_equalities(source: MjcfSource, qpos: Array) -> None:
    """Set the joints that active equalities determine, in positions (P, nq)."""
    model, equality_types = source.model, source.mujoco.mjtEq
    followers = [
        number
        for number in range(model.neq)
        if int(model.eq_type[number]) == int(equality_types.mjEQ_JOINT) and model.eq_active0[number]
    ]
    for _ in range(EQUALITY_ROUNDS if followers else 0):
        for number in followers:
            first_joint, second_joint = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            address = int(model.jnt_qposadr[first_joint])
            argument = np.zeros(len(qpos))
            if second_joint >= 0:
                leader = int(model.jnt_qposadr[second_joint])
                argument = qpos[:, leader] - model.qpos0[leader]
            value = np.polynomial.polynomial.polyval(argument, model.eq_data[number, :5])
            qpos[:, address] = model.qpos0[address] + value


def compute_poses(source: MjcfSource, qpos: Array) -> SampledPoses:
    """Return the poses of positions (P, nq)."""
    model, mujoco = source.model, source.mujoco
    data = mujoco.MjData(model)
    count = len(qpos)
    sites = np.empty((count, model.nsite, 3))
    geoms = np.empty((count, model.ngeom, 3))
    rotations = np.empty((count, model.ngeom, 3, 3))
    for row, values in enumerate(qpos):
        data.qpos[:] = values
        mujoco.mj_kinematics(model, data)
        sites[row], geoms[row] = data.site_xpos, data.geom_xpos
        rotations[row] = data.geom_xmat.reshape(-1, 3, 3)
    return SampledPoses(qpos, sites, geoms, rotations)
