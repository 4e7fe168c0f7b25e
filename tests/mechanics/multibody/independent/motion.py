"""Kinematics of mechanisms in one pass outwards: transforms, Jacobians, velocities and accelerations of bodies."""

from __future__ import annotations

from functools import reduce

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.joints import Mobilizer
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.motions import (
    AxisMotion,
    FixedTransform,
    JointMotion,
    SimbodyAccelerationError,
    SphericalMotion,
)
from osimlite.mechanics.multibody.spatial import (
    Array,
    cross,
    invert_transform,
    make_transform,
    rotation_about,
    rotation_xyz,
    skew_matrix,
)


@dataclass(frozen=True, eq=False)
class Moved:
    """Kinematics of b bodies and n coordinates at one state, with the fields of `MechanismKinematics`."""

    mechanism: Mechanism
    q: Array
    u: Array
    time: float
    rotations: Array
    origins: Array
    jacobians: Array
    velocities: Array
    biases: Array

    def point(self, body: int, station: Array) -> Array:
        """Return the position in ground (3,) of a `station` (3,) in the body's frame."""
        return self.origins[body] + self.rotations[body] @ station

    def point_velocity(self, body: int, station: Array) -> Array:
        """Return the velocity in ground (3,) of a `station` (3,) in the body's frame."""
        velocity: Array = self.velocities[body]
        return velocity[3:] + cross(velocity[:3], self.rotations[body] @ station)

    def point_bias(self, body: int, station: Array) -> Array:
        """Return the acceleration in ground (3,) of a `station` (3,) of the body while all udot are zero."""
        arm, w = self.rotations[body] @ station, self.velocities[body][:3]
        bias: Array = self.biases[body]
        return bias[3:] + cross(bias[:3], arm) + cross(w, cross(w, arm))

    def point_jacobian(self, body: int, station: Array) -> Array:
        """Return the matrix (6, n) from the speeds to the body's angular velocity and the velocity of its `station`."""
        matrix: Array = self.jacobians[body].copy()
        matrix[3:] -= skew_matrix(self.rotations[body] @ station) @ matrix[:3]
        return matrix


def kinematics(mechanism: Mechanism, q: Array, u: Array, time: float = 0.0) -> Moved:
    """Compute poses, Jacobians, velocities and velocity-dependent accelerations at `q` (n,) and `u` (n,)."""
    count, size = len(mechanism.bodies), len(q)
    rotations, origins = np.empty((count + 1, 3, 3)), np.zeros((count + 1, 3))
    # Columns as in RelativeMotion.block, for each body relative to ground.
    blocks = np.zeros((count + 1, 6, size + 2))
    rotations[-1] = np.eye(3)
    for index, body in enumerate(mechanism.bodies):
        parent, own = body.parent, list(body.mobilizer.coordinates)
        motion = carrying(body.mobilizer, q[own], u[own])
        arm = rotations[parent] @ motion.translation
        moved = turned(rotations[parent], motion.block)
        rotations[index] = rotations[parent] @ motion.rotation
        origins[index] = origins[parent] + arm
        blocks[index] = carried(blocks[parent], arm, moved[:, -2])
        blocks[index][:, [*own, size, size + 1]] += moved
    parts = blocks[:, :, :size], blocks[:, :, size], blocks[:, :, size + 1]
    return Moved(mechanism, q, u, time, rotations, origins, *parts)


def carrying(mobilizer: Mobilizer, q: Array, u: Array) -> RelativeMotion:
    """Return the motion of the carried body relative to the carrying body, at the joint's `q` and `u` (k,)."""
    ends = (
        FixedTransform(mobilizer.parent_frame),
        *mobilizer.motions,
        FixedTransform(invert_transform(mobilizer.child_frame)),
    )
    motion = reduce(RelativeMotion.then, (relative(part, q, u) for part in ends))
    return motion.inverse() if mobilizer.reversed else motion


def relative(motion: JointMotion, q: Array, u: Array) -> RelativeMotion:
    """Return the motion of the outgoing frame relative to the incoming frame, at the joint's `q` and `u` (k,)."""
    own, block = list(motion.coordinates), np.zeros((6, len(q) + 2))
    match motion:
        case FixedTransform(matrix):
            return RelativeMotion(matrix[:3, :3], matrix[:3, 3], block)
        case AxisMotion(kind, axis, _, function):
            amount, gradient, hessian = function.evaluate(q[own])
            along = np.zeros(len(q) + 2)
            along[own] = gradient
            along[-2:] = (
                u[own] @ gradient,
                u[own] @ np.reshape(hessian, (len(own), len(own))) @ u[own],
            )
            block[slice(0, 3) if kind == "rotate" else slice(3, 6)] = np.outer(axis, along)
            if kind == "rotate":
                return RelativeMotion(rotation_about(axis, amount), np.zeros(3), block)
            return RelativeMotion(np.eye(3), axis * amount, block)
        case SphericalMotion(_, radii):
            rotation = rotation_xyz(q[own])
            normal, w = rotation[:, 2], u[own]
            drift = cross(w, normal)
            block[:3, own], block[3:, own] = np.eye(3), -radii[:, None] * skew_matrix(normal)
            block[:3, -2], block[3:, -2] = w, radii * drift
            block[3:, -1] = radii * cross(w, drift)
            return RelativeMotion(rotation, radii * normal, block)
        case SimbodyAccelerationError():
            block[:3, -1] = np.einsum("iab,a,b->i", curvature(motion, q), u, u)
            return RelativeMotion(np.eye(3), np.zeros(3), block)
    raise AssertionError(motion)


def curvature(error: SimbodyAccelerationError, q: Array) -> Array:
    """Return H (3, k, k) of Simbody's acceleration error, whose component i is uᵀ H[i] u."""
    count = len(q)
    # Column k: derivatives of the angles by coordinate k.
    axes, shares, rotation = [], np.zeros((3, count)), np.eye(3)
    for row, turn in enumerate(error.rotations):
        own = list(turn.coordinates)
        amount, gradient, _ = turn.function.evaluate(q[own])
        shares[row, own] = gradient
        axes.append(rotation @ turn.axis)
        rotation = rotation @ rotation_about(turn.axis, amount)
    along, curvature = np.array(axes).T, np.zeros((3, count, count))
    for row in (1, 2):
        # Rate of this axis (3, k) by the rates that Simbody uses for the preceding angles, minus
        # the correct one.
        theirs = np.zeros((3, count))
        theirs[:, :row] = along @ shares[:, :row]
        wrong = -skew_matrix(axes[row]) @ (theirs - along[:, :row] @ shares[:row])
        curvature += wrong[:, :, None] * shares[row]
    return curvature


def turned(rotation: Array, block: Array) -> Array:
    """Rotate spatial vectors, the columns of `block` (6, c), by `rotation` (3, 3)."""
    return (rotation @ block.reshape(2, 3, -1)).reshape(6, -1)


@dataclass(frozen=True, slots=True, eq=False)
class RelativeMotion:
    """Pose and motion of frame B relative to frame A under k generalized speeds, expressed in A.

    The columns of `block` (6, k + 2) are spatial vectors: the Jacobian of the k speeds, the
    velocity, and the part of the acceleration that does not depend on the derivatives of the
    speeds. Composition of motions treats all of them nearly alike, so they share one array.
    """

    rotation: Array
    translation: Array
    block: Array

    @classmethod
    def fixed(cls, matrix: Array, speeds: int) -> RelativeMotion:
        """Return the motion of a frame that is fixed in A, for `speeds` generalized speeds."""
        return cls(matrix[:3, :3], matrix[:3, 3], np.zeros((6, speeds + 2)))

    @property
    def matrix(self) -> Array:
        """Homogeneous matrix (4, 4) of B in A."""
        return make_transform(self.rotation, self.translation)

    @property
    def jacobian(self) -> Array:
        """Matrix (6, k) from the speeds to the velocity of B in A."""
        return self.block[:, :-2]

    @property
    def velocity(self) -> Array:
        """Spatial velocity (6,) of B in A."""
        return self.block[:, -2]

    @property
    def bias(self) -> Array:
        """Spatial acceleration (6,) of B in A, as seen in A, while the derivatives of the speeds are zero."""
        return self.block[:, -1]

    def then(self, other: RelativeMotion) -> RelativeMotion:
        """Return the motion of C in A, where `self` is that of B in A and `other` that of C in B."""
        arm = self.rotation @ other.translation
        moved = turned(self.rotation, other.block)
        block = carried(self.block, arm, moved[:, -2])
        block += moved
        return RelativeMotion(self.rotation @ other.rotation, self.translation + arm, block)

    def inverse(self) -> RelativeMotion:
        """Return the motion of A in B for the same generalized speeds."""
        back, p = self.rotation.T, self.translation
        w, v = self.block[:3, -2], self.block[3:, -2]
        block = self.block.copy()
        block[3:] += skew_matrix(p) @ self.block[:3]
        block[3:, -1] += cross(w, cross(w, p) - 2.0 * v)
        return RelativeMotion(back, -back @ p, -turned(back, block))


def carried(block: Array, arm: Array, relative_velocity: Array) -> Array:
    """Return the contribution of the motion of B in A to the motion of a frame C that moves in B.

    The motion of C in B, rotated into A, must be added.

    Args:
        block: columns of :class:`RelativeMotion` of B in A (6, c).
        arm: vector from B's origin to C's origin, in A (3,).
        relative_velocity: spatial velocity of C in B, in A (6,), for the Coriolis acceleration.
    """
    result = block.copy()
    result[3:] -= skew_matrix(arm) @ block[:3]
    w = block[:3, -2]
    if w.any():
        result[:3, -1] += cross(w, relative_velocity[:3])
        result[3:, -1] += cross(w, cross(w, arm) + 2.0 * relative_velocity[3:])
    return result
