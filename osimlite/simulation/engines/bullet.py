"""The PyBullet engine: Bullet computes the accelerations, osimlite the forces and, if asked, the steps.

Two routes lead to the accelerations. "mass-matrix" takes M and the bias from Bullet's inverse dynamics and solves for
them; it is the quicker one for small mechanisms. "articulated-body" lets Bullet take a step of one second from the
state and reads the change of the speeds, which is exactly the acceleration, since Bullet's step is semi-implicit
Euler; it grows more slowly with the number of joints, and takes inertias that the other refuses. Coordinates that move
several axes, and constraints, take the engine of :mod:`osimlite.simulation.engines.bullet_reduced`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from osimlite.errors import OsimliteError, SimulationError, UnsupportedError
from osimlite.multibody.constraints import Lock
from osimlite.multibody.dynamics import massless
from osimlite.multibody.mechanism import Mechanism
from osimlite.robot.build import build_robot
from osimlite.robot.merge_fixed import merge_fixed
from osimlite.robot.names import legal_names
from osimlite.robot.robot import Robot, RobotJoint
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.bullet_file import require_masses
from osimlite.simulation.engines.bullet_stepper import BulletStepper
from osimlite.simulation.engines.bullet_world import World, bullet
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.integrators import RungeKuttaMerson
from osimlite.simulation.kernels.pointers import Floats
from osimlite.simulation.solver import SingularMassError, tree_solver
from osimlite.simulation.speeds import Speeds
from osimlite.simulation.stepper import Observer, Projection, Stepper
from osimlite.simulation.system import System

if TYPE_CHECKING:
    from osimlite.robot.visuals import Visuals
    from osimlite.simulation.engines.bullet_window import Window

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
        self._window: Window | None = None
        if show:
            from osimlite.simulation.engines.bullet_window import Window

            self._window = Window(robot, mechanism.gravity.tolist(), files)
        self._body = World(robot, mechanism.gravity.tolist(), files=files, exact=self.EXACT_INERTIAS)
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
        self._speeds = Speeds(mechanism, places)
        self._take(System(mechanism, forces, places))
        self._count = len(self.order)
        if route == "auto":
            few = self._count <= FEW_JOINTS
            route = MASS_MATRIX if few and body.mass_matrix_works else ARTICULATED_BODY
        if route == MASS_MATRIX:
            self._require_mass_matrix()
        self.route = route
        if route == MASS_MATRIX:
            self._solve = tree_solver(carriers(body.joints))
        if not self._count:
            self._motion = self._nothing_moves  # type: ignore[method-assign]
        elif not all(item.mobilizer.speeds_are_rates for item in mechanism.bodies):
            self._motion = self._motion_with_speeds  # type: ignore[method-assign]
        elif route == ARTICULATED_BODY:
            self._motion = self._motion_by_step  # type: ignore[method-assign]

    def _take(self, system: System) -> None:
        """Have the forces from a system."""
        self.system = system
        self.order, self.state = system.order, system.state
        self.contacts, self.columns, self.loads = system.contacts, system.columns, system.loads
        self._count = len(self.order)

    def _require_mass_matrix(self) -> None:
        if not self._body.mass_matrix_works:
            raise UnsupportedError(
                f"Bullet refuses a mass matrix with the inertia of '{self._body.impossible[0]}', which no real body "
                f"has (one principal moment exceeds the sum of the others); take the route {ARTICULATED_BODY}"
            )

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        applied, count = self.system.applied(t, y), self._count
        q, u = y[:count], y[count : 2 * count]
        return self._motion(q, u, applied[count : 2 * count]) + applied[2 * count :]

    def _motion(self, q: list[float], u: list[float], forces: list[float]) -> list[float]:
        """(qdot, udot) under generalized forces; here where the speeds are the rates, by the mass matrix."""
        body = self._body
        try:
            return u + self._solve(
                bullet.calculateMassMatrix(body.id, q, 0, body.client),
                bullet.calculateInverseDynamics(body.id, q, u, body.zeros, 0, body.client),
                forces,
            )
        except SingularMassError as error:
            raise self._singular(error, q + u) from None

    def _motion_by_step(self, q: list[float], u: list[float], forces: list[float]) -> list[float]:
        return u + self._body.accelerations_by_step(q, u, forces)

    def _motion_with_speeds(self, q: list[float], u: list[float], forces: list[float]) -> list[float]:
        body, rates = self._body, self._speeds.rates(q, u)
        forces = self._speeds.joint_forces(q, forces)
        if self.route == MASS_MATRIX:
            try:
                qddot = self._solve(body.mass_matrix(q), body.bias(q, rates), forces)
            except SingularMassError as error:
                raise self._singular(error, q + u) from None
        else:
            qddot = body.accelerations_by_step(q, rates, forces)
        return rates + self._speeds.accelerations(q, u, qddot)

    @staticmethod
    def _nothing_moves(q: list[float], u: list[float], forces: list[float]) -> list[float]:
        return []

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
    def equilibrated(self, t: float, y: Sequence[float], numbers: Floats | None = None) -> list[float]:
        """A state with the auxiliary states that have an equilibrium in it."""
        return self.system.equilibrated(t, y, numbers)

    def touching(self, t: float, y: list[float]) -> int:
        """The bits of the contacts that touch; sets `loads`."""
        return self.system.touching(t, y)

    def force_records(self, t: float, y: list[float]) -> list[float]:
        """One number for each of the columns."""
        return self.system.force_records(t, y)

    def energies(self, t: float, y: list[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J."""
        return self.system.energies(t, y)

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: list[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or Bullet's own fixed steps."""
        observe = self._watched(observe)
        if settings.fixed_step is not None:
            return BulletStepper(self, t, y, settings.fixed_step, observe)
        return self._merson(t, y, settings, observe, None)

    def _joint_values(self, y: list[float]) -> list[float]:
        """Values of Bullet's joints at a state."""
        return y[: self._count]

    def _watched(self, observe: Observer) -> Observer:
        """The same observer, and a look at the window, if there is one."""
        window = self._window
        if window is None:
            return observe

        def watched(t: float, y: list[float]) -> None:
            observe(t, y)
            window.show(t, self._joint_values(y))

        return watched

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
        if self._window is not None:
            self._window.close()

    def hold(self) -> None:
        """Keep the window, if there is one, until somebody closes it."""
        if self._window is not None:
            self._window.hold()

    def __enter__(self) -> BulletEngine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def own_coordinates(joints: Sequence[RobotJoint]) -> list[int]:
    """The coordinate that the value of each joint is; fewer than joints if one is another function."""
    return [joint.coordinate for joint in joints if joint.coordinate is not None]


def carriers(joints: Sequence[RobotJoint]) -> list[int]:
    """The joint that carries each joint, -1 if ground does."""
    above = {joint.child: place for place, joint in enumerate(joints)}
    return [above.get(joint.parent, -1) for joint in joints]
