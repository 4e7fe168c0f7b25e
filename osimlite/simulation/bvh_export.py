"""The bodies of a mechanism and their motion as a BVH skeleton."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.text import make_unique_name
from osimlite.io.bvh import POSITIONS, ROTATIONS, BvhJoint, BvhMotion, find_angles
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array

CENTIMETRES = 100.0
"""Numbers of the file per metre that most programs expect."""

MIN_TRANSLATION_M = 1e-9
"""Motion of a joint's centre above which it gets position channels."""

MIN_BONE_M = 0.02
"""Length of the bone of a body without further bodies, if its mass centre is in the joint."""

UNIFORM_STEP = 1e-6
"""Largest relative difference of time steps that count as equal."""


class BvhSkeleton(NamedTuple):
    """A motion as BVH, with facts about the conversion.

    Attributes:
        motion: skeleton and motion.
        names: name of the joint of each body.
        translating: names of the joints besides the root that have position channels.
        is_resampled: whether the frames are at other times than those of the motion.
    """

    motion: BvhMotion
    names: tuple[str, ...]
    translating: tuple[str, ...]
    is_resampled: bool


def make_bvh(
    mechanism: Mechanism, times: Array, values: Array, *, scale: float = CENTIMETRES
) -> BvhSkeleton:
    """Return the motion of a mechanism as BVH.

    Each body is a joint with the axes of the body, at the centre of the body's joint. Position
    channels are written for the root, and for joints whose centre moves in the parent. So the
    poses of all bodies are exact. The Y axis of the file is up.

    Args:
        mechanism: the mechanism.
        times: times (n,), s.
        values: coordinate values (n, c) in the order of the mechanism (rad, m).
        scale: numbers of the file per metre.
    """
    times, values, is_resampled = _make_uniform(times, values)
    bodies = mechanism.bodies
    upright = _make_upright(mechanism)
    centers = []
    for body in bodies:
        mobilizer = body.mobilizer
        # A reversed mobilizer has its joint at the frame of the parent.
        frame = mobilizer.parent_frame if mobilizer.reversed else mobilizer.child_frame
        centers.append(frame[:3, 3])
    rotations = np.empty((len(times), len(bodies), 3, 3))
    positions = np.empty((len(times), len(bodies), 3))
    for row, q in enumerate(values):
        state = mechanism.at(q)
        for index, center in enumerate(centers):
            rotations[row, index] = upright @ state.rotations[index]
            positions[row, index] = upright @ state.point(index, center)
    rest_state = mechanism.at(mechanism.default_state()[0])
    # The skeleton of the file is the default pose.
    rest_positions = np.array(
        [upright @ rest_state.point(index, center) for index, center in enumerate(centers)]
    )
    roots = [index for index, body in enumerate(bodies) if body.parent == GROUND]
    used_names: set[str] = set()
    joints: list[BvhJoint] = []
    columns: list[Array] = []
    names = [""] * len(bodies)
    joint_of_body: dict[int, int] = {}
    translating: list[str] = []
    # Several roots hang on a joint of their own, because most programs read one root only.
    base = int(len(roots) != 1)
    if base:
        used_names.add("ground")
        joints.append(BvhJoint("ground", -1, np.zeros(3), (*POSITIONS, *ROTATIONS)))
        columns.append(np.zeros((len(times), 6)))
    parent_bodies = {body.parent for body in bodies}
    # Numbers of a frame have the order of the joints in the file, which is depth-first.
    for index in _list_depth_first(mechanism):
        body = bodies[index]
        name = make_unique_name(
            "_".join(body.name.rpartition("/")[2].split()) or "body", used_names
        )
        used_names.add(name)
        names[index] = name
        is_root = not base and index == roots[0]
        parent_body = body.parent
        if parent_body == GROUND:
            local_rotations, local_positions = rotations[:, index], positions[:, index]
            offset = np.zeros(3) if is_root else rest_positions[index]
        else:
            parent_inverses = rotations[:, parent_body].transpose(0, 2, 1)
            local_rotations = parent_inverses @ rotations[:, index]
            # Poses relative to the body above, in its axes.
            local_positions = np.einsum(
                "nij,nj->ni", parent_inverses, positions[:, index] - positions[:, parent_body]
            )
            offset = (
                rest_state.rotations[parent_body].T
                @ upright.T
                @ (rest_positions[index] - rest_positions[parent_body])
            )
        # A joint whose centre stays in the body above needs no positions.
        is_translating = (
            float(np.ptp(np.vstack([local_positions, offset]), axis=0).max()) > MIN_TRANSLATION_M
        )
        if is_root or is_translating:
            columns.append(scale * local_positions)
            if not is_root:
                translating.append(name)
        columns.append(find_angles(local_rotations))
        channels = (*POSITIONS, *ROTATIONS) if is_root or is_translating else ROTATIONS
        end = None
        # The last bone points to the mass centre, and twice as far: about to the end of the
        # segment.
        if index not in parent_bodies:
            end = 2.0 * (body.mass_properties.center - centers[index])
            end = scale * (
                end if np.linalg.norm(end) > MIN_BONE_M else np.array([0.0, -MIN_BONE_M, 0.0])
            )
        parent = -1 if is_root else 0 if parent_body == GROUND else joint_of_body[parent_body]
        joint_of_body[index] = len(joints)
        joints.append(BvhJoint(name, parent, scale * offset, channels, end))
    # A motion of one row has no step; 60 frames a second is usual.
    step = float(times[1] - times[0]) if len(times) > 1 else 1.0 / 60.0
    motion = BvhMotion(tuple(joints), step, np.hstack(columns))
    return BvhSkeleton(motion, tuple(names), tuple(translating), is_resampled)


def _list_depth_first(mechanism: Mechanism) -> list[int]:
    """Return the indices of the bodies, each followed by all bodies that it carries."""
    children: dict[int, list[int]] = {}
    for index, body in enumerate(mechanism.bodies):
        children.setdefault(body.parent, []).append(index)
    result: list[int] = []
    waiting = children.get(GROUND, [])[::-1]
    while waiting:
        index = waiting.pop()
        result.append(index)
        waiting += children.get(index, [])[::-1]
    return result


def _make_uniform(times: Array, values: Array) -> tuple[Array, Array, bool]:
    """Return times with one step, values there, and whether they differ from those of the motion."""
    steps = np.diff(times)
    # Steps that are equal up to rounding are not changed.
    if not len(steps) or np.ptp(steps) <= UNIFORM_STEP * float(np.mean(steps)):
        return times, values, False
    count = max(2, round(float(times[-1] - times[0]) / float(np.median(steps))) + 1)
    uniform = np.linspace(times[0], times[-1], count)
    columns = [np.interp(uniform, times, column) for column in values.T]
    return uniform, np.array(columns).T.reshape(count, values.shape[1]), True


def _make_upright(mechanism: Mechanism) -> Array:
    """Return the rotation (3, 3) that turns the direction against gravity to +Y."""
    gravity = np.asarray(mechanism.gravity, dtype=float)
    size = float(np.linalg.norm(gravity))
    if not size:
        return np.eye(3)
    up: Array = -gravity / size
    axis = np.cross(up, (0.0, 1.0, 0.0))
    cosine = float(up[1])
    # Gravity points up: half a turn about X.
    if cosine < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    # Rodrigues' formula with 1 / (1 + cos) for (1 - cos) / sin^2.
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + cosine), dtype=float)


def order_values(mechanism: Mechanism, names: Sequence[str], columns: Array) -> Array:
    """Return columns of coordinates in the order of a mechanism, with defaults for missing ones.

    Args:
        mechanism: the mechanism.
        names: names of k coordinates.
        columns: values (n, k).
    """
    result = np.tile(np.asarray(mechanism.default_state()[0], dtype=float), (len(columns), 1))
    for index, name in enumerate(names):
        result[:, mechanism.coordinate_index(name)] = columns[:, index]
    return result
