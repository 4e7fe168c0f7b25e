"""The PyBullet engine: Bullet computes the accelerations, osimlite the forces and, if asked, the steps.

Two routes lead to the accelerations. "mass-matrix" takes M and the bias from Bullet's inverse dynamics and solves for
them; it is the quicker one for small mechanisms. "articulated-body" lets Bullet take a step of one second from the
state and reads the change of the speeds, which is exactly the acceleration, since Bullet's step is semi-implicit
Euler; it grows more slowly with the number of joints, and takes inertias that the other refuses. Coordinates that move
several axes, and constraints, take the engine of :mod:`osimlite.simulation.engines.bullet_reduced`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.errors import OsimliteError, SimulationError, UnsupportedError
from osimlite.multibody.constraints import Lock
from osimlite.multibody.dynamics import massless
from osimlite.multibody.mechanism import Mechanism
from osimlite.robot.build import build_robot
from osimlite.robot.merge_fixed import merge_fixed
from osimlite.robot.names import legal_names
from osimlite.robot.robot import Robot
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.bullet_file import require_masses
from osimlite.simulation.engines.bullet_stepper import BulletStepper
from osimlite.simulation.engines.bullet_world import World, bullet
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.field import ForceField, own_coordinates
from osimlite.simulation.integrators import RungeKuttaMerson
from osimlite.simulation.solver import SingularMassError, tree_solver
from osimlite.simulation.speeds import Speeds
from osimlite.simulation.stepper import Observer, Projection, Stepper

if TYPE_CHECKING:
    from osimlite.robot.visuals import Visuals

MASS_MATRIX, ARTICULATED_BODY, RECURSION = "mass-matrix", "articulated-body", "recursion"
ROUTES = ("auto", MASS_MATRIX, ARTICULATED_BODY, RECURSION)

FEW_JOINTS = 12
"""Up to here the mass matrix is quicker, on the machine it was measured on."""


def make(mechanism: Mechanism, forces: Forces, settings: Settings) -> BulletEngine:
    """Make the engine."""
    return engine_class(mechanism, settings.route)(
        mechanism, forces, route=settings.route, show=settings.show, visuals=settings.visuals
    )


def engine_class(mechanism: Mechanism, route: str) -> type[BulletEngine]:
    """The engine for a mechanism: the quick one where each coordinate moves one axis and nothing constrains it."""
    plain = all(isinstance(constraint, Lock) for constraint in mechanism.constraints) and route != RECURSION
    if plain and _moves_single_axes(mechanism):
        return BulletEngine
    from osimlite.simulation.engines.bullet_reduced import ReducedBulletEngine

    return ReducedBulletEngine


def _moves_single_axes(mechanism: Mechanism) -> bool:
    """Whether the value of each one-axis joint is a coordinate of its own, where the coordinate is not locked."""
    locked = [info.locked for info in mechanism.coordinates]
    for body in mechanism.bodies:
        of_joint = {locked[place] for place in body.mobilizer.coordinates}
        if not body.mobilizer.speeds_are_rates and len(of_joint) > 1:
            return False
    moving = build_robot(mechanism).moving
    places = [joint.coordinate for joint in moving]
    return None not in places and len(set(places)) == len(places)


class BulletEngine:
    """The accelerations of a mechanism by PyBullet; see the protocol for what it offers.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.
        route: "mass-matrix", "articulated-body", or "auto" for the better one.
        show: open Bullet's window.
        visuals: what the bodies look like.

    Raises:
        UnsupportedError: the inertias or the joints of the mechanism rule out the route asked for.
        SimulationError: a body at the end of a chain has no mass; or there is no screen to show the motion on.
    """

    EXACT_INERTIAS = True
    """Whether Bullet has to have inertias that it refuses to read; then it refuses mass matrices too."""

    name = "bullet"
    version = f"pybullet API {bullet.getAPIVersion()}"

    def __init__(
        self,
        mechanism: Mechanism,
        forces: Forces,
        *,
        route: str = "auto",
        show: bool = False,
        visuals: Visuals | None = None,
    ) -> None:
        if route not in ROUTES:
            raise OsimliteError(f"there is no route '{route}'; there are {', '.join(ROUTES)}")
        shapes = {} if visuals is None else visuals.by_body
        fixed = self._fixed(mechanism)
        robot = legal_names(merge_fixed(build_robot(mechanism, locked=fixed, body_frames=False, visuals=shapes)))
        self._check(robot)
        files = {} if visuals is None else visuals.files
        self._body = World(robot, mechanism.gravity.tolist(), show=show, files=files, exact=self.EXACT_INERTIAS)
        try:
            self._prepare(mechanism, forces, robot, route)
        except BaseException:
            self.close()
            raise

    @staticmethod
    def _fixed(mechanism: Mechanism) -> list[int]:
        """Places of the coordinates that are no joints in Bullet."""
        return [place for place, info in enumerate(mechanism.coordinates) if info.locked]

    @staticmethod
    def _check(robot: Robot) -> None:
        require_masses(robot)

    def _prepare(self, mechanism: Mechanism, forces: Forces, robot: Robot, route: str) -> None:
        body = self._body
        self.mechanism = mechanism
        places = own_coordinates(body.joints)
        if len(set(places)) < len(body.joints):
            raise ValueError(
                f"'{mechanism.name}' has coordinates that move several axes; engine_class() tells its engine"
            )
        plain = all(item.mobilizer.speeds_are_rates for item in mechanism.bodies)
        self.field = ForceField(robot, body.joints, forces.elements, None if plain else places)
        self.order = self.field.order
        self.state = self.field.state
        self.contacts = self.field.contacts
        self.columns = self.field.columns
        self.loads: list[Any] = [None] * len(self.contacts) + [0]
        self._speeds = Speeds(mechanism, self.order)
        self._count = len(self.order)
        self._forces = self.field.generalized
        if route == "auto":
            few = self._count <= FEW_JOINTS
            route = MASS_MATRIX if few and body.mass_matrix_works else ARTICULATED_BODY
        if route == MASS_MATRIX:
            self._require_mass_matrix()
        self.route = route
        if route == MASS_MATRIX:
            self._solve = tree_solver([self.field.chain.parent(joint) for joint in range(self._count)])
        if not self._count:
            self._motion = self._nothing_moves  # type: ignore[method-assign]
        elif self.field.separate:
            self._motion = self._motion_with_speeds  # type: ignore[method-assign]
        elif route == ARTICULATED_BODY:
            self._motion = self._motion_by_step  # type: ignore[method-assign]

    def _require_mass_matrix(self) -> None:
        if not self._body.mass_matrix_works:
            raise UnsupportedError(
                f"Bullet refuses a mass matrix with the inertia of '{self._body.impossible[0]}', which no real body "
                f"has (one principal moment exceeds the sum of the others); take the route {ARTICULATED_BODY}"
            )

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        self.state.require(y)
        return self._motion(t, y[: 2 * self._count]) + self.field.powers

    def _motion(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot) at (q, u); here where the speeds are the rates, by the mass matrix."""
        count, body = self._count, self._body
        q, u = y[:count], y[count:]
        try:
            return u + self._solve(
                bullet.calculateMassMatrix(body.id, q, 0, body.client),
                bullet.calculateInverseDynamics(body.id, q, u, body.zeros, 0, body.client),
                self._forces(t, q, u, self.loads),
            )
        except SingularMassError as error:
            raise self._singular(error, y) from None

    def _motion_by_step(self, t: float, y: list[float]) -> list[float]:
        q, u = y[: self._count], y[self._count :]
        return u + self._body.accelerations_by_step(q, u, self._forces(t, q, u, self.loads))

    def _motion_with_speeds(self, t: float, y: list[float]) -> list[float]:
        count, body = self._count, self._body
        q, u = y[:count], y[count:]
        rates = self._speeds.rates(q, u)
        forces = self._joint_forces(t, q, rates, u)
        if self.route == MASS_MATRIX:
            try:
                qddot = self._solve(body.mass_matrix(q), body.bias(q, rates), forces)
            except SingularMassError as error:
                raise self._singular(error, y) from None
        else:
            qddot = body.accelerations_by_step(q, rates, forces)
        return rates + self._speeds.accelerations(q, u, qddot)

    @staticmethod
    def _nothing_moves(t: float, y: list[float]) -> list[float]:
        return []

    def _joint_forces(self, t: float, q: list[float], rates: list[float], u: list[float]) -> Sequence[float]:
        """Forces on the one-axis joints; `rates` are theirs, `u` the generalized speeds."""
        if not self.field.separate:
            return self._forces(t, q, rates, self.loads)
        both, count = self._forces(t, q, rates, q, u, self.loads), self._count
        converted = self._speeds.joint_forces(q, both[count:])
        return [a + b for a, b in zip(both[:count], converted, strict=True)]

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[self._count : 2 * self._count]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    def _singular(self, error: SingularMassError, y: list[float]) -> SimulationError:
        wrong = [value for value in y if not np.isfinite(value)]
        if wrong:
            return SimulationError("the state of the motion is not finite any more; ask for more accuracy")
        return massless(self.mechanism.coordinates[self.order[error.joint]].name)

    # ---------------------------------------------------------------------------------------------- reports
    def touching(self, t: float, y: list[float]) -> int:
        """The bits of the contacts that touch; sets `loads`."""
        self.state.require(y)
        q, u = y[: self._count], y[self._count : 2 * self._count]
        self._joint_forces(t, q, self._speeds.rates(q, u), u)
        return int(self.loads[-1])

    def force_records(self, t: float, y: list[float]) -> list[float]:
        """One number for each of the columns."""
        return self.field.records(t, *self._joints(y))

    def energies(self, t: float, y: list[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J."""
        return self.field.energies(t, *self._joints(y))

    def _joints(self, y: list[float]) -> tuple[Sequence[float], ...]:
        """Values and rates of the joints, and the state where it is told apart from these."""
        self.state.require(y)
        q, u = y[: self._count], y[self._count : 2 * self._count]
        rates = self._speeds.rates(q, u)
        return (q, rates, q, u) if self.field.separate else (q, rates)

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: list[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or Bullet's own fixed steps."""
        if settings.fixed_step is not None:
            return BulletStepper(self, t, y, settings.fixed_step, observe, paced=settings.show)
        return self._merson(t, y, settings, observe, None)

    def _merson(
        self, t: float, y: list[float], settings: Settings, observe: Observer, projection: Projection | None
    ) -> RungeKuttaMerson:
        # Simbody counts locked coordinates too, and the fourth number that it keeps for three angles.
        spare = sum(not body.mobilizer.speeds_are_rates for body in self.mechanism.bodies)
        return RungeKuttaMerson(
            self.derivative,
            t,
            y,
            self._count,
            nu=self._count,
            accuracy=settings.accuracy,
            count_q=len(self.mechanism.coordinates) + spare,
            count_u=len(self.mechanism.coordinates),
            observe=observe,
            names=self.state.names,
            projection=projection,
        )

    def close(self) -> None:
        """Leave Bullet; any number of times."""
        self._body.close()

    def __enter__(self) -> BulletEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
