"""Where every body of a mechanism is and how it moves, in one pass from the root outwards.

Arrays over bodies have one row more than there are bodies: the last is ground, which -1, the parent index of a
body that ground carries, picks out. All vectors are along the axes of ground; spatial velocities and accelerations
stack the angular part over the linear part of the body's origin.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from osimlite.multibody.spatial import Array, carried, cross, skew, transform, turned
from osimlite.records import dataclass

if TYPE_CHECKING:
    from osimlite.multibody.mechanism import Mechanism


@dataclass(frozen=True, slots=True, eq=False)
class Kinematics:
    """A mechanism of b bodies and n coordinates at one state."""

    mechanism: Mechanism
    q: Array  # coordinate values (n,)
    u: Array  # generalized speeds (n,)
    rotations: Array  # of each body in ground (b + 1, 3, 3)
    origins: Array  # of each body in ground (b + 1, 3), m
    jacobians: Array  # from the n speeds to the velocity of each body (b + 1, 6, n)
    velocities: Array  # of each body in ground (b + 1, 6)
    biases: Array  # the accelerations (b + 1, 6) that the bodies have while all udot are zero
    time: float = 0.0  # what prescribed motions go by (s)

    def transform(self, body: int) -> Array:
        """The body in ground (4, 4)."""
        return transform(self.rotations[body], self.origins[body])

    def point(self, body: int, station: Array) -> Array:
        """Position in ground (3,) of a `station` (3,) given in the body's frame."""
        return self.origins[body] + self.rotations[body] @ station

    def point_velocity(self, body: int, station: Array) -> Array:
        """Velocity in ground (3,) of a `station` (3,) given in the body's frame."""
        velocity: Array = self.velocities[body]
        return velocity[3:] + cross(velocity[:3], self.rotations[body] @ station)

    def point_bias(self, body: int, station: Array) -> Array:
        """Acceleration in ground (3,) of a `station` (3,) of the body while all udot are zero."""
        arm, w = self.rotations[body] @ station, self.velocities[body][:3]
        bias: Array = self.biases[body]
        return bias[3:] + cross(bias[:3], arm) + cross(w, cross(w, arm))

    def point_jacobian(self, body: int, station: Array) -> Array:
        """Matrix (6, n) from the speeds to the body's angular velocity and the velocity of its `station`."""
        matrix: Array = self.jacobians[body].copy()
        matrix[3:] -= skew(self.rotations[body] @ station) @ matrix[:3]
        return matrix

    def accelerations(self, udot: Array) -> Array:
        """Spatial accelerations of all bodies (b + 1, 6) for the derivatives `udot` (n,) of the speeds."""
        return self.biases + self.jacobians @ udot


def kinematics(
    mechanism: Mechanism, q: Array, u: Array, time: float = 0.0, *, bodies: Iterable[int] | None = None
) -> Kinematics:
    """Poses, Jacobians, velocities and velocity-dependent accelerations at `q` (n,), `u` (n,) and `time` (s).

    With `bodies`, the rows of all others that do not carry one of them mean nothing.
    """
    count, size = len(mechanism.bodies), len(q)
    rotations, origins = np.empty((count + 1, 3, 3)), np.zeros((count + 1, 3))
    # The columns of RelativeMotion, for each body in ground.
    blocks = np.zeros((count + 1, 6, size + 2))
    rotations[-1] = np.eye(3)
    for index in range(count) if bodies is None else sorted(_with_carriers(mechanism, bodies)):
        body = mechanism.bodies[index]
        parent, own = body.parent, list(body.mobilizer.coordinates)
        motion = body.mobilizer.relative(q[own], u[own])
        arm = rotations[parent] @ motion.translation
        moved = turned(rotations[parent], motion.block)
        rotations[index] = rotations[parent] @ motion.rotation
        origins[index] = origins[parent] + arm
        blocks[index] = carried(blocks[parent], arm, moved[:, -2])
        blocks[index][:, [*own, size, size + 1]] += moved
    return Kinematics(
        mechanism, q, u, rotations, origins, blocks[:, :, :size], blocks[:, :, size], blocks[:, :, size + 1], time
    )


def _with_carriers(mechanism: Mechanism, bodies: Iterable[int]) -> set[int]:
    result: set[int] = set()
    for body in bodies:
        while body >= 0 and body not in result:
            result.add(body)
            body = mechanism.bodies[body].parent
    return result
