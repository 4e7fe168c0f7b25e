"""Forces and accelerations of a mechanism.

The equation of motion reads M udot + C = gravity + applied forces, where the generalized forces belong to the
generalized speeds. With the Jacobians of all mass centres at hand it is Newton's and Euler's equation of every body,
projected on the speeds (Kane's form); nothing is factored out of the tree, which suits arrays better than recursion.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from math import sqrt
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from osimlite.errors import SimulationError
from osimlite.kernels.constrained_dynamics import SAFE_MASS, SLIGHT
from osimlite.kernels.least_squares import ROUNDING
from osimlite.multibody.kinematics import Kinematics
from osimlite.multibody.linear import shortest, solutions, stacked
from osimlite.multibody.spatial import Array, skews
from osimlite.records import dataclass

if TYPE_CHECKING:
    from osimlite.multibody.constraints import Constraint
    from osimlite.multibody.mechanism import Mechanism


LARGEST = 1e100
"""Numbers beyond this, in SI units, are not computed with, nor inertias below its inverse: their squares overflow."""


class Wrench(NamedTuple):
    """A force (N) on a body at its origin and a torque (N·m) about it, both (3,) along ground's axes."""

    force: Sequence[float] | Array
    torque: Sequence[float] | Array


@dataclass(frozen=True, slots=True, eq=False)
class MassCentres:
    """The b bodies of a mechanism at one state, seen from their mass centres, along ground's axes."""

    state: Kinematics
    masses: Array  # (b,), kg
    inertias: Array  # about the mass centres (b, 3, 3), kg·m²
    arms: Array  # from the body origins to the mass centres (b, 3), m
    turning: Array  # from the n speeds to the angular velocities (b, 3, n)
    moving: Array  # from the n speeds to the velocities of the mass centres (b, 3, n)

    @classmethod
    def of(cls, state: Kinematics) -> MassCentres:
        """See a mechanism at `state` from its mass centres."""
        masses, centres, inertias = state.mechanism.inertial
        rotations, jacobians = state.rotations[:-1], state.jacobians[:-1]
        arms = (rotations @ centres[:, :, None])[:, :, 0]
        turning = jacobians[:, :3]
        moving = jacobians[:, 3:] - skews(arms) @ turning
        return cls(state, masses, rotations @ inertias @ rotations.transpose(0, 2, 1), arms, turning, moving)

    def mass_matrix(self) -> Array:
        """M (n, n) of the kinetic energy ½ uᵀ M u."""
        matrix = _projected(self.turning, self.inertias @ self.turning)
        matrix += _projected(self.moving, self.masses[:, None, None] * self.moving)
        return 0.5 * (matrix + matrix.T)

    def inertia_forces(self, body_accelerations: Array) -> Array:
        """Generalized forces (n,) that give the bodies these spatial accelerations (b + 1, 6)."""
        w = self.state.velocities[:-1, :3]
        alpha, a = body_accelerations[:-1, :3], body_accelerations[:-1, 3:]
        a_centre = a + np.cross(alpha, self.arms) + np.cross(w, np.cross(w, self.arms))
        torques = _times(self.inertias, alpha) + np.cross(w, _times(self.inertias, w))
        return _projected(self.turning, torques) + _projected(self.moving, self.masses[:, None] * a_centre)

    def gravity_forces(self) -> Array:
        """Generalized forces of gravity (n,)."""
        weights = self.masses[:, None] * self.state.mechanism.gravity
        return _projected(self.moving, weights)

    def velocities(self) -> Array:
        """The velocities of the mass centres in ground (b, 3)."""
        return self.moving @ self.state.u

    def positions(self) -> Array:
        """The mass centres in ground (b, 3)."""
        return self.state.origins[:-1] + self.arms

    def kinetic_energy(self) -> float:
        """Kinetic energy (J)."""
        w, v = self.turning @ self.state.u, self.velocities()
        return 0.5 * float(np.sum(w * _times(self.inertias, w)) + np.sum(self.masses[:, None] * v * v))

    def momentum(self) -> tuple[Array, Array]:
        """Linear momentum (3,) in kg·m/s, and angular momentum (3,) about ground's origin in kg·m²/s."""
        linear = self.masses[:, None] * self.velocities()
        own = _times(self.inertias, self.turning @ self.state.u)
        return linear.sum(axis=0), (own + np.cross(self.positions(), linear)).sum(axis=0)


def accelerations(state: Kinematics, applied: Array, constraints: Sequence[Constraint]) -> Array:
    """Derivatives of the speeds (n,) under gravity, `applied` generalized forces (n,) and constraints.

    See :func:`constrained_accelerations`.

    Raises:
        SimulationError: a motion that nothing forbids moves no mass.
    """
    bodies = MassCentres.of(state)
    matrix = bodies.mass_matrix()
    right = applied + bodies.gravity_forces() - bodies.inertia_forces(state.biases)
    equations = (
        stacked([constraint.acceleration_equations(state) for constraint in constraints]) if constraints else None
    )
    return constrained_accelerations(state.mechanism, matrix, right, equations)


def constrained_accelerations(
    mechanism: Mechanism, matrix: Array, right: Array, equations: tuple[Array, Array] | None
) -> Array:
    """Udot (n,) with M udot = f but for forces that make G udot = b.

    Equations that follow from others or contradict them are fulfilled in the sense of least squares. Where M cannot be
    divided by, the motion is solved for in the null space of G: constraints may drive what has no mass.

    Args:
        mechanism: whose motion.
        matrix: M (n, n).
        right: f (n,).
        equations: G (m, n) and b (m,), if there are any.

    Raises:
        SimulationError: a motion that nothing forbids moves no mass.
    """
    require_numbers(mechanism, matrix, right, *(equations or ()))
    if equations is None:
        return _solve(mechanism, matrix, right, None)
    rows, values = equations
    with suppress(np.linalg.LinAlgError):
        factor = np.linalg.cholesky(matrix)
        if np.min(factor.diagonal() ** 2 / matrix.diagonal()) > SAFE_MASS:
            udot = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
            # What moves nothing by more than rounding binds nothing.
            binding = np.where(np.abs(rows).max(axis=1, keepdims=True) > ROUNDING, rows, 0.0)
            weighted = np.linalg.solve(factor, binding.T).T
            # The second time mends the rounding of the first.
            for _ in range(2):
                push = shortest(weighted, values - rows @ udot, SLIGHT * sqrt(len(rows)))
                udot = udot + np.linalg.solve(factor.T, push)
            return udot
    particular, free = solutions(rows, values)
    reduced = _solve(mechanism, free.T @ matrix @ free, free.T @ (right - matrix @ particular), free)
    return particular + free @ reduced


def require_numbers(mechanism: Mechanism, *arrays: Array) -> None:
    """Check arrays of the equations of motion.

    Raises:
        SimulationError: an entry is not finite, or too large to be computed with.
    """
    if not all((np.abs(array) < LARGEST).all() for array in arrays):
        raise SimulationError(
            f"the equations of motion of '{mechanism.name}' are not finite; check the coordinate values and speeds, "
            "the applied forces, the masses and inertias of the bodies and the places of the frames"
        )


def _times(matrices: Array, vectors: Array) -> Array:
    """Each matrix (b, 3, 3) times its vector (b, 3)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _projected(jacobians: Array, loads: Array) -> Array:
    """Sum over the bodies of each Jacobian (b, 3, n), transposed, times its load (b, 3) or loads (b, 3, m)."""
    count, _, size = jacobians.shape
    flat = jacobians.reshape(3 * count, size)
    return flat.T @ loads.reshape(3 * count, *loads.shape[2:])


def _solve(mechanism: Mechanism, matrix: Array, right: Array, directions: Array | None) -> Array:
    """Solve with a positive definite matrix whose unknowns are motions along `directions` (n, f)."""
    if not len(right):
        return right
    try:
        pivots = np.linalg.cholesky(matrix).diagonal() ** 2
    except np.linalg.LinAlgError:
        raise massless(_name_of_massless(mechanism, matrix, directions)) from None
    if np.min(pivots / matrix.diagonal()) < 1e-13 or np.min(matrix.diagonal()) < 1.0 / LARGEST:
        raise massless(_name_of_massless(mechanism, matrix, directions))
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)


def massless(coordinate: str) -> SimulationError:
    """The error of a motion that can be as fast as it likes.

    Args:
        coordinate: name of the one that moves most in it.
    """
    return SimulationError(
        f"coordinate '{coordinate}' moves no mass, or a negative inertia, or its axis lies in this pose along another "
        "of the same joint; give the bodies beyond its joint mass and inertia, lock it, or start in another pose"
    )


def _name_of_massless(mechanism: Mechanism, matrix: Array, directions: Array | None) -> str:
    scale = np.sqrt(np.where(matrix.diagonal() > 0.0, matrix.diagonal(), 1.0))
    _, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    motion = vectors[:, 0] / scale
    if directions is not None:
        motion = directions @ motion
    return mechanism.coordinates[int(np.argmax(np.abs(motion)))].name
