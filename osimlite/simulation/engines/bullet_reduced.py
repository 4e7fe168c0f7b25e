"""The PyBullet engine for what joints of one axis cannot say: axes that follow functions, and constraints.

Bullet carries the expanded chain, each axis a joint of its own, and gives its mass matrix and bias; these are projected
on the coordinates of the model, and the constraints are kept up by :mod:`osimlite.simulation.constrained`. On the route
"recursion", osimlite's own kinematics and dynamics take Bullet's place.
"""

from __future__ import annotations

import numpy as np

from osimlite.errors import UnsupportedError
from osimlite.multibody.dynamics import MassCentres
from osimlite.multibody.kinematics import Kinematics, kinematics
from osimlite.multibody.mechanism import Mechanism
from osimlite.multibody.spatial import Array
from osimlite.robot.robot import Robot
from osimlite.simulation.constrained import Constrained, free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.bullet import ARTICULATED_BODY, MASS_MATRIX, RECURSION, BulletEngine
from osimlite.simulation.engines.bullet_file import excess
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.kernels import layout
from osimlite.simulation.reduction import Reduction
from osimlite.simulation.stepper import Observer, Stepper
from osimlite.simulation.system import System


class ReducedBulletEngine(BulletEngine):
    """The accelerations of any mechanism; see :class:`BulletEngine` for arguments and errors."""

    # Bullet gets inertias it can read; what that adds to the mass matrix is taken off again.
    EXACT_INERTIAS = False

    @staticmethod
    def _fixed(mechanism: Mechanism) -> list[int]:
        free = set(free_coordinates(mechanism))
        return [place for place in range(len(mechanism.coordinates)) if place not in free]

    @staticmethod
    def _check(robot: Robot) -> None:
        """Bodies without mass may do at the end of a chain: a constraint may decide how they move."""

    def _prepare(self, mechanism: Mechanism, forces: Forces, robot: Robot, route: str) -> None:
        body = self._body
        self.mechanism = mechanism
        self._take(System(mechanism, forces, free_coordinates(mechanism)))
        self._places = np.array(self.order, dtype=int)
        self._still = np.array([info.default_value for info in mechanism.coordinates])
        self.reduction = Reduction(mechanism, body.joints, self.order)
        self.constrained = Constrained(mechanism, self.order, self._state)
        indices = {item.path: index for index, item in enumerate(mechanism.bodies)}
        self._added = [
            (indices[next(iter(link.bodies))], excess(link)) for link in robot.links if link.name in body.impossible
        ]
        self._looked_at = bool(self._added or self.constrained.names)
        self._watched_bodies = [*dict.fromkeys([*self.constrained.bodies, *(index for index, _ in self._added)])]
        if route == ARTICULATED_BODY:
            raise UnsupportedError(
                f"the route {ARTICULATED_BODY} is for models without constraints whose coordinates move one axis each; "
                f"take {MASS_MATRIX} for '{mechanism.name}'"
            )
        self.route = MASS_MATRIX if route == "auto" else route

    # ---------------------------------------------------------------------------------------- accelerations
    def equations(self, t: float, x: Array, u: Array, forces: Array) -> tuple[Array, Array, Array, Kinematics | None]:
        """M (n, n) and f (n,) of the motion M udot = f without constraints, xdot (n,), and what bodies do, if known.

        Args:
            t: time, s.
            x: coordinates (n,).
            u: generalized speeds (n,).
            forces: that are applied (n,).
        """
        joints = self.reduction.at(x, u)
        jacobian = joints.jacobian
        q, rates = joints.values.tolist(), joints.rates.tolist()
        if self.route == RECURSION:
            state = kinematics(self.mechanism, *self.constrained.spread(x, u), t)
            bodies = MassCentres.of(state)
            matrix = bodies.mass_matrix()[np.ix_(self._places, self._places)]
            inner = bodies.gravity_forces() - bodies.inertia_forces(state.biases)
            return matrix, forces + inner[self._places], joints.coordinate_rates, state
        body = self._body
        matrix = jacobian.T @ np.array(body.mass_matrix(q)) @ jacobian
        right = forces - np.array(body.joint_forces(q, rates, joints.bias.tolist())) @ jacobian
        if not self._looked_at:
            return matrix, right, joints.coordinate_rates, None
        state = self.system.bodies(self._watched_bodies, t, *self.constrained.spread(x, u))
        for index, added in self._added:
            # The same inertia about every axis: no speed alone makes it resist.
            turning = state.jacobians[index][:3, self._places]
            matrix -= added * turning.T @ turning
            right += added * state.biases[index][:3] @ turning
        return matrix, right, joints.coordinate_rates, state

    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        applied, count = self.system.applied(t, y), self._count
        if not count:
            return applied
        x, u = np.array(y[:count]), np.array(y[count : 2 * count])
        matrix, right, rates, state = self.equations(t, x, u, np.array(applied[count : 2 * count]))
        found = self.constrained.accelerations(t, x, u, matrix, right, state)
        return [*rates.tolist(), *found.tolist(), *applied[2 * count :]]

    def _state(self, t: float, x: Array, u: Array) -> Kinematics:
        """What the bodies do that constraints look at."""
        y = [*x.tolist(), *u.tolist(), *[0.0] * len(self.state.variables)]
        status = self.system.realize(t, y, layout.VELOCITY_STAGE)
        if status != layout.OK:
            raise self.system.refusal(status, t, y)
        return self.system.bodies(self._watched_bodies, t, *self.constrained.spread(x, u))

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: list[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or fixed steps as Bullet takes them."""
        observe = self._watched(observe)
        if settings.fixed_step is None:
            return self._merson(t, y, settings, observe, self.constrained)
        return SemiImplicitEuler(
            self.derivative,
            t,
            y,
            self._count,
            settings.fixed_step,
            rates=self._rates,
            observe=observe,
            names=self.state.names,
            projection=self.constrained,
        )

    def _joint_values(self, y: list[float]) -> list[float]:
        x, u = np.array(y[: self._count]), np.array(y[self._count : 2 * self._count])
        values: list[float] = self.reduction.at(x, u).values.tolist()
        return values

    def _rates(self, x: list[float], u: list[float]) -> list[float]:
        rates: list[float] = self.reduction.coordinate_rates(np.array(x), np.array(u)).tolist()
        return rates
