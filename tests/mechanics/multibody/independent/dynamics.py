"""Forces and accelerations by the Newton-Euler equations of all bodies, projected on the speeds (Kane's method)."""

from __future__ import annotations

from contextlib import suppress
from math import sqrt

import numpy as np

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.constrained_dynamics import INDEPENDENCE, SAFE_MASS
from osimlite.mechanics.kernels.linear_algebra import ROUNDING
from osimlite.mechanics.multibody.linear import solve_least_norm, solve_with_null_space
from osimlite.mechanics.multibody.spatial import Array, skew_matrices
from tests.mechanics.multibody.independent.constraints import bond
from tests.mechanics.multibody.independent.motion import Moved


@dataclass(frozen=True, eq=False)
class MassCentres:
    """Inertial properties and Jacobians of the b bodies of a mechanism at one state, at their mass centres.

    All vectors are along ground's axes.
    """

    state: Moved
    masses: Array  # (b,), kg
    inertias: Array  # about the mass centres (b, 3, 3), kg·m²
    arms: Array  # from the body origins to the mass centres (b, 3), m
    turning: Array  # from the n speeds to the angular velocities (b, 3, n)
    moving: Array  # from the n speeds to the velocities of the mass centres (b, 3, n)

    @classmethod
    def compute(cls, state: Moved) -> MassCentres:
        """Compute inertias and Jacobians at the mass centres."""
        masses, centres, inertias = state.mechanism.inertial
        rotations, jacobians = state.rotations[:-1], state.jacobians[:-1]
        arms = (rotations @ centres[:, :, None])[:, :, 0]
        turning = jacobians[:, :3]
        moving = jacobians[:, 3:] - skew_matrices(arms) @ turning
        return cls(
            state,
            masses,
            rotations @ inertias @ rotations.transpose(0, 2, 1),
            arms,
            turning,
            moving,
        )

    def mass_matrix(self) -> Array:
        """Return the mass matrix M (n, n) of the kinetic energy ½ uᵀ M u."""
        matrix = _projected(self.turning, self.inertias @ self.turning)
        matrix += _projected(self.moving, self.masses[:, None, None] * self.moving)
        return 0.5 * (matrix + matrix.T)

    def inertia_forces(self, body_accelerations: Array) -> Array:
        """Return the generalized forces (n,) that give the bodies these spatial accelerations (b + 1, 6)."""
        w = self.state.velocities[:-1, :3]
        alpha, a = body_accelerations[:-1, :3], body_accelerations[:-1, 3:]
        a_centre = a + np.cross(alpha, self.arms) + np.cross(w, np.cross(w, self.arms))
        torques = _times(self.inertias, alpha) + np.cross(w, _times(self.inertias, w))
        return _projected(self.turning, torques) + _projected(
            self.moving, self.masses[:, None] * a_centre
        )

    def gravity_forces(self) -> Array:
        """Return the generalized forces of gravity (n,)."""
        weights = self.masses[:, None] * self.state.mechanism.gravity
        return _projected(self.moving, weights)


def acceleration(state: Moved, applied: Array) -> Array:
    """Solve M udot = f with constraint forces for G udot = d.

    Use the null space of G if the mass matrix is nearly singular.

    Args:
        state: kinematics of the mechanism.
        applied: applied generalized forces (n,).

    Returns:
        Accelerations udot (n,).
    """
    bodies, constraints = MassCentres.compute(state), state.mechanism.constraints
    matrix = bodies.mass_matrix()
    right = applied + bodies.gravity_forces() - bodies.inertia_forces(state.biases)
    if not constraints:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    bonds = [bond(item, state) for item in constraints]
    rows, values = (
        np.concatenate([each.rows for each in bonds]),
        np.concatenate([each.drifts for each in bonds]),
    )
    with suppress(np.linalg.LinAlgError):
        factor = np.linalg.cholesky(matrix)
        if np.min(factor.diagonal() ** 2 / matrix.diagonal()) > SAFE_MASS:
            udot = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
            # Rows that are zero up to rounding restrict nothing.
            binding = np.where(np.abs(rows).max(axis=1, keepdims=True) > ROUNDING, rows, 0.0)
            weighted = np.linalg.solve(factor, binding.T).T
            # The second iteration corrects rounding errors of the first.
            for _ in range(2):
                push = solve_least_norm(
                    weighted, values - rows @ udot, INDEPENDENCE * sqrt(len(rows))
                )
                udot = udot + np.linalg.solve(factor.T, push)
            return udot
    particular, free = solve_with_null_space(rows, values)
    reduced = np.linalg.solve(free.T @ matrix @ free, free.T @ (right - matrix @ particular))
    return particular + free @ reduced


def _times(matrices: Array, vectors: Array) -> Array:
    """Multiply each matrix (b, 3, 3) by its vector (b, 3)."""
    return (matrices @ vectors[:, :, None])[:, :, 0]


def _projected(jacobians: Array, loads: Array) -> Array:
    """Sum over the bodies the transpose of each Jacobian (b, 3, n) times its load (b, 3) or loads (b, 3, m)."""
    count, _, size = jacobians.shape
    flat = jacobians.reshape(3 * count, size)
    return flat.T @ loads.reshape(3 * count, *loads.shape[2:])
