"""Poses, velocities and constraint equations of a mechanism at one state.

The kernels compute them, run as Python. Arrays over bodies have one row more than there are bodies:
the last row is ground, so that the index -1 selects it. All vectors are along the axes of ground;
spatial velocities and accelerations stack the angular part over the linear part of the body's
origin.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.mechanics.kernels.constrained_dynamics import evaluate_constraints
from osimlite.mechanics.kernels.layout import LINK_WORK, MODEL, WORK
from osimlite.mechanics.kernels.motion import move_links, place_links
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.constraints import ConstraintEquations, Equations
from osimlite.mechanics.multibody.program import PackedMechanism
from osimlite.mechanics.multibody.spatial import (
    Array,
    cross,
    make_transform,
    skew_matrices,
    skew_matrix,
)

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism


Vectors = tuple[Floats, Floats, Floats]
"""Work vector, state and rates."""


@contextmanager
def check_finite(data: Floats) -> Iterator[None]:
    """Set a work vector to NaN if the arithmetic in the context raises an error.

    Python raises errors where machine code gives numbers that are not finite, for example for the
    sine of an infinite angle.
    """
    try:
        yield
    except (ArithmeticError, ValueError):
        np.frombuffer(data)[WORK.SIZE :] = np.nan


class MechanismKinematics:
    """State of a mechanism of b bodies and n coordinates.

    Args:
        mechanism: mechanism.
        q: coordinate values (n,).
        u: generalized speeds (n,).
        time: time of prescribed motions (s).
    """

    def __init__(self, mechanism: Mechanism, q: Array, u: Array, time: float = 0.0) -> None:
        # Results are computed when they are requested, so later changes of the arguments must not
        # matter.
        self.mechanism, self.q, self.u, self.time = mechanism, q.copy(), u.copy(), time

    def __reduce__(self) -> tuple[Any, ...]:
        # Neither the vectors nor the program can be pickled, but both can be computed again.
        return MechanismKinematics, (self.mechanism, self.q, self.u, self.time)

    @cached_property
    def program(self) -> PackedMechanism:
        """Program of the mechanism: its integers and numbers for the kernels."""
        return self.mechanism.program

    @cached_property
    def _initial_vectors(self) -> Vectors:
        data, y, f = self.program.state(self.q, self.u)
        data[WORK.TIME] = self.time
        return data, y, f

    @cached_property
    def vectors(self) -> Vectors:
        """Work vector, state and rates after the links have been moved; NaN where that fails."""
        model, reals, (data, y, f) = self.program.model, self.program.reals, self._initial_vectors
        with check_finite(data):
            place_links(model, reals, data, y, f)
            move_links(model, reals, data, y, f)
        return data, y, f

    def equations(self, constraint: ConstraintEquations) -> Equations:
        """Return the equations of a constraint, which need not be one of the mechanism."""
        program = self.program.find_program(constraint)
        if program is self.program:
            errors, rows, rates, drifts = self.all_equations
            first, end, end_position = program.equations_of(constraint)
            return Equations(
                errors[first:end_position], rows[first:end], rates[first:end], drifts[first:end]
            )
        # A foreign constraint needs a program of its own, and so another evaluation.
        copied_state = MechanismKinematics(self.mechanism, self.q, self.u, self.time)
        copied_state.program = program
        return copied_state.equations(constraint)

    @cached_property
    def all_equations(self) -> Equations:
        """Equations of all constraints; those that constrain speeds only have undefined errors."""
        program = self.program
        balls = [
            item
            for item in self.mechanism.turning
            if not program.bound.isdisjoint(item.coordinates)
        ]
        for ball in balls:
            # Raises an error where the rates of its coordinates are not defined.
            ball.rate_matrix(self.q[list(ball.coordinates)])
        # Constraints on coordinates only do not need the links.
        data, y, f = self.vectors if balls or program.on_bodies else self._initial_vectors
        if program.constraints:
            with check_finite(data):
                evaluate_constraints(program.model, program.reals, data, y, f)
        return program.equations(data)

    @cached_property
    def rotations(self) -> Array:
        """Rotation of each body in ground (b + 1, 3, 3)."""
        return self._links[:, :9].reshape(-1, 3, 3) @ self.program.frames[:, :3, :3]

    @cached_property
    def origins(self) -> Array:
        """Origin of each body in ground (b + 1, 3), m."""
        rows = self._links
        rotated_offsets = rows[:, :9].reshape(-1, 3, 3) @ self.program.frames[:, :3, 3:]
        return rows[:, LINK_WORK.POSITION : LINK_WORK.POSITION + 3] + rotated_offsets[:, :, 0]

    @cached_property
    def jacobians(self) -> Array:
        """Jacobian of each body, from the n speeds to its velocity (b + 1, 6, n)."""
        program = self.program
        size = len(self.q)
        first = program.model[MODEL.WORK_COLUMN]
        columns = (
            np.frombuffer(self.vectors[0])[first : first + 6 * size]
            .reshape(size, 6)[program.freedoms]
            .T
        )
        # From the common origin of the spatial vectors to the origins of the bodies.
        result = np.empty((len(program.links), 6, size))
        result[:, :3], result[:, 3:] = (
            columns[:3],
            columns[3:] - skew_matrices(self._arms) @ columns[:3],
        )
        result.swapaxes(1, 2)[program.still] = 0.0
        return result

    @cached_property
    def velocities(self) -> Array:
        """Velocity of each body in ground (b + 1, 6), rad/s and m/s."""
        result = self._links[:, LINK_WORK.VELOCITY : LINK_WORK.VELOCITY + 6].copy()
        result[:, 3:] += np.cross(result[:, :3], self._arms)
        return result

    @cached_property
    def biases(self) -> Array:
        """Acceleration of each body while all udot are zero (b + 1, 6), rad/s² and m/s²."""
        result = self._links[:, LINK_WORK.ACCELERATION : LINK_WORK.ACCELERATION + 6].copy()
        # Accelerations of links are spatial: those of the points that pass a fixed origin. Add w x v
        # for the material point.
        w, v = np.split(self.velocities, 2, axis=1)
        result[:, 3:] += np.cross(result[:, :3], self._arms) + np.cross(w, v)
        return result

    @cached_property
    def _links(self) -> Array:
        """Results of the link of each body, and of ground as the last (b + 1, LINK_WORK.SIZE)."""
        model = self.program.model
        first = model[MODEL.WORK_LINK]
        count = model[MODEL.LINKS]
        size = LINK_WORK.SIZE
        result = np.zeros((count + 1, size))
        result[:-1] = np.frombuffer(self.vectors[0])[first : first + size * count].reshape(
            count, size
        )
        result[-1, [0, 4, 8]] = 1.0
        return result[self.program.links]

    @cached_property
    def _arms(self) -> Array:
        """Vector from the origin of the spatial vectors to that of each body (b + 1, 3), m."""
        return self.origins - self._links[:, LINK_WORK.ORIGIN : LINK_WORK.ORIGIN + 3]

    def transform(self, body: int) -> Array:
        """Return the transform of a body in ground (4, 4)."""
        return make_transform(self.rotations[body], self.origins[body])

    def point(self, body: int, station: Array) -> Array:
        """Return the position in ground of a point of a body (3,), m.

        Args:
            body: index of the body, -1 for ground.
            station: point in the frame of the body (3,), m.
        """
        return self.origins[body] + self.rotations[body] @ station

    def point_velocity(self, body: int, station: Array) -> Array:
        """Return the velocity in ground of a point of a body (3,), m/s.

        Args:
            body: index of the body, -1 for ground.
            station: point in the frame of the body (3,), m.
        """
        velocity: Array = self.velocities[body]
        return velocity[3:] + cross(velocity[:3], self.rotations[body] @ station)

    def point_bias(self, body: int, station: Array) -> Array:
        """Return the acceleration of a point of a body in ground while all udot are zero.

        It has the shape (3,), in m/s².

        Args:
            body: index of the body, -1 for ground.
            station: point in the frame of the body (3,), m.
        """
        arm = self.rotations[body] @ station
        w = self.velocities[body][:3]
        bias: Array = self.biases[body]
        return bias[3:] + cross(bias[:3], arm) + cross(w, cross(w, arm))

    def point_jacobian(self, body: int, station: Array) -> Array:
        """Return the matrix (6, n) from the speeds to angular velocity and a point's velocity.

        Args:
            body: index of the body, -1 for ground.
            station: point in the frame of the body (3,), m.
        """
        matrix: Array = self.jacobians[body].copy()
        matrix[3:] -= skew_matrix(self.rotations[body] @ station) @ matrix[:3]
        return matrix

    def accelerations(self, udot: Array) -> Array:
        """Return the accelerations of all bodies (b + 1, 6) for derivatives of the speeds (n,)."""
        return self.biases + self.jacobians @ udot
