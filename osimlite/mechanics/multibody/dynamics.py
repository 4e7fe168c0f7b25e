"""Forces and accelerations of a mechanism.

The equation of motion reads M udot + C = gravity + applied forces, where the generalized forces
belong to the generalized speeds. The kernels compute it, see
:mod:`osimlite.mechanics.kernels.dynamics`.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.errors import SimulationError
from osimlite.mechanics.kernels.constrained_dynamics import constrained_dynamics
from osimlite.mechanics.kernels.dynamics import (
    add_accelerations,
    add_generalized_forces,
    composite_rigid_body,
    solve_accelerations,
    spatial_inertias_and_bias,
)
from osimlite.mechanics.kernels.layout import LINK_WORK, MODEL, OUTCOME
from osimlite.mechanics.kernels.pointers import Floats, at
from osimlite.mechanics.kernels.points import link_work
from osimlite.mechanics.multibody.functions import make_floats
from osimlite.mechanics.multibody.kinematics import MechanismKinematics, check_finite
from osimlite.mechanics.multibody.linear import solve_with_null_space
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism


MAX_NUMBER = 1e100
"""Largest number, in SI units, in the equations of motion; the squares of larger ones overflow.

The inverse of it bounds inertias from below.
"""


class Wrench(NamedTuple):
    """Force on a body at its origin and torque about it, both (3,) along the axes of ground."""

    force: Sequence[float] | Array  # N
    torque: Sequence[float] | Array  # N m


@dataclass(frozen=True, slots=True, eq=False)
class MassCentres:
    """Mass centres of the b bodies of a mechanism at one state, along the axes of ground."""

    state: MechanismKinematics
    masses: Array  # masses (b,), kg
    arms: Array  # vectors from the body origins to the mass centres (b, 3), m

    @classmethod
    def compute(cls, state: MechanismKinematics) -> MassCentres:
        """Return the mass centres of a state."""
        masses, centres, _ = state.mechanism.inertial
        return cls(state, masses, (state.rotations[:-1] @ centres[:, :, None])[:, :, 0])

    def positions(self) -> Array:
        """Return the positions of the mass centres in ground (b, 3), in m."""
        return self.state.origins[:-1] + self.arms

    def velocities(self) -> Array:
        """Return the velocities of the mass centres in ground (b, 3), in m/s."""
        w, v = np.split(self.state.velocities[:-1], 2, axis=1)
        return v + np.cross(w, self.arms)

    def kinetic_energy(self) -> float:
        """Return the kinetic energy (J), of translation and rotation of all bodies."""
        w = self.state.velocities[:-1, :3]
        v = self.velocities()
        return 0.5 * float(np.sum(w * self._spins()) + np.sum(self.masses[:, None] * v * v))

    def momentum(self) -> tuple[Array, Array]:
        """Return the momentum of all bodies.

        Returns:
            Linear momentum (3,) in kg m/s, and angular momentum (3,) about the origin of ground in
            kg m²/s.
        """
        linear = self.masses[:, None] * self.velocities()
        return linear.sum(axis=0), (self._spins() + np.cross(self.positions(), linear)).sum(axis=0)

    def _spins(self) -> Array:
        """Return the angular momenta of the bodies about their mass centres (b, 3), in kg m²/s."""
        rotations = self.state.rotations[:-1]
        # Inertias are stored along body axes: R I Rᵀ along those of ground.
        inertias = rotations @ self.state.mechanism.inertial[2] @ rotations.transpose(0, 2, 1)
        return (inertias @ self.state.velocities[:-1, :3, None])[:, :, 0]


def mass_matrix(state: MechanismKinematics) -> Array:
    """Return the mass matrix M (n, n) of the kinetic energy uᵀ M u / 2."""
    program = state.program
    data = _load_inertias(state, np.zeros(3))
    with check_finite(data):
        composite_rigid_body(program.model, data, make_floats([0.0] * len(state.q)))
    return program.mass_matrix(data)


def missing_forces(state: MechanismKinematics, udot: Array, gravity: Array) -> Array:
    """Return the generalized forces (n,) that give the speeds the derivatives `udot`.

    Args:
        state: state.
        udot: derivatives of the speeds (n,).
        gravity: acceleration of gravity in ground (3,), m/s².
    """
    program = state.program
    model = program.model
    udots = make_floats(udot[program.order].tolist())
    data = _load_inertias(state, gravity, udots)
    missing = make_floats([0.0] * len(udot))
    with check_finite(data):
        add_generalized_forces(model, data, missing)
    # The wrenches in `data` are those of inertia, minus what the accelerations need.
    return -np.array(missing)[program.freedoms]


def _load_inertias(
    state: MechanismKinematics, gravity: Array, udot: Floats | None = None
) -> Floats:
    """Return the work vector with inertias of the links and the inertial wrenches.

    Args:
        state: state.
        gravity: acceleration of gravity in ground (3,), m/s².
        udot: derivatives of the speeds, by degrees of freedom; None for zero.
    """
    model = state.program.model
    reals = state.program.reals
    data = make_floats(state.vectors[0].tobytes())
    with check_finite(data):
        for link in range(model[MODEL.LINKS]):
            acceleration = link_work(model, data, link)[LINK_WORK.ACCELERATION + 3 :]
            # An upward acceleration of all links has the same effect as gravity.
            for k, component in enumerate(gravity.tolist()):
                acceleration[k] -= component
        if udot is not None:
            add_accelerations(model, data, udot)
        spatial_inertias_and_bias(model, reals, data)
    return data


def accelerations(state: MechanismKinematics, applied: Array) -> Array:
    """Return the derivatives of the speeds (n,) under gravity, forces and constraints.

    Redundant and contradictory equations are fulfilled in the least-squares sense. Where the mass
    matrix is singular, the motion is solved for in the null space of the constraints, since these
    may drive a coordinate that moves no mass.

    Args:
        state: state.
        applied: applied generalized forces (n,).

    Raises:
        SimulationError: a motion that the constraints allow moves no mass, or a number is not
            finite.
    """  # noqa: DOC501 - a function makes the SimulationError
    program = state.program
    mechanism = state.mechanism
    size = len(state.q)
    model = program.model
    data = _load_inertias(state, mechanism.gravity)
    _, y, f = state.vectors
    derivative = make_floats([*f[:size], *applied[program.order].tolist()])
    right = at(derivative, size)
    with check_finite(data):
        composite_rigid_body(model, data, right)
    matrix = program.mass_matrix(data)
    require_numbers(mechanism, matrix, np.array(right))
    require_numbers(mechanism, *state.all_equations[1:])
    status = OUTCOME.SINGULAR_MASS
    with suppress(ArithmeticError, ValueError):
        if not size or not program.constraints:
            status = (
                OUTCOME.OK if solve_accelerations(model, data, right) < 0 else OUTCOME.SINGULAR_MASS
            )
        else:
            status = constrained_dynamics(model, program.heavy, data, y, derivative, 0)
    udot: Array = np.array(right)[program.freedoms]
    if status != OUTCOME.OK or (size and not np.isfinite(udot).all()):
        raise describe_massless_motion(
            _name_of_massless(mechanism, matrix, state.all_equations.rows)
        )
    return udot


def require_numbers(mechanism: Mechanism, *arrays: Array) -> None:
    """Check arrays of the equations of motion.

    Args:
        mechanism: mechanism, for the message.
        arrays: arrays to check.

    Raises:
        SimulationError: an entry is not finite, or larger than MAX_NUMBER.
    """
    if not all((np.abs(array) < MAX_NUMBER).all() for array in arrays):
        raise SimulationError(
            f"the equations of motion of '{mechanism.name}' are not finite; check the coordinate values and speeds, "
            "the applied forces, the masses and inertias of the bodies and the positions of the frames"
        )


def describe_massless_motion(coordinate: str) -> SimulationError:
    """Return the error of a motion that moves no mass.

    Args:
        coordinate: name of the coordinate that moves most in it.
    """
    return SimulationError(
        f"coordinate '{coordinate}' moves no mass, or moves a negative inertia, or its axis is parallel to another axis "
        "of its joint in this pose; give mass and inertia to the bodies beyond the joint, lock the coordinate, or start "
        "in another pose"
    )


def _name_of_massless(mechanism: Mechanism, matrix: Array, rows: Array) -> str:
    """Return the name of the coordinate that moves most in the motion with the least inertia.

    Args:
        mechanism: mechanism.
        matrix: mass matrix (n, n).
        rows: matrix G of the constraint equations (m, n); only motions with G u = 0 count.
    """
    _, free = solve_with_null_space(rows, np.zeros(len(rows)))
    matrix = free.T @ matrix @ free
    # Scale the matrix, so that metres and radians are comparable.
    scale = np.sqrt(np.where(matrix.diagonal() > 0.0, matrix.diagonal(), 1.0))
    _, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    motion = free @ (vectors[:, 0] / scale)
    return mechanism.coordinates[int(np.argmax(np.abs(motion)))].name
