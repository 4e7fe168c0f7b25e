"""PyBullet engine: Bullet computes mass matrix and bias, or takes the steps; the kernels compute the rest.

Bullet simulates the expanded chain, in which each axis of a joint is a joint. Two routes lead to
the accelerations. "mass-matrix" uses the matrix and the bias of Bullet's inverse dynamics.
"articulated-body" lets Bullet take a step of one second from the state and reads the change of the
speeds. That is exactly the acceleration, because Bullet's step is semi-implicit Euler. This route
is for models without constraints whose coordinates move one axis each.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from struct import Struct
from typing import TYPE_CHECKING, Any

import numpy as np

from osimlite.errors import OsimliteError, SimulationError, UnsupportedError
from osimlite.mechanics.kernels.layout import CHAIN, MODEL
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.constrained import find_free_coordinates
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.base import KernelEngine
from osimlite.simulation.engines.bullet.world import (
    World,
    bullet,
    compute_inertia_excess,
    require_masses,
)
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.euler import SemiImplicitEuler, make_divergence_error
from osimlite.simulation.pack_chain import Chain
from osimlite.simulation.robot.build import build_robot
from osimlite.simulation.robot.merge_fixed import merge_fixed
from osimlite.simulation.robot.names import legal_names
from osimlite.simulation.robot.robot import Robot
from osimlite.simulation.stepper import Observer, Stepper

if TYPE_CHECKING:
    from osimlite.simulation.engines.bullet.window import Window
    from osimlite.simulation.robot.visuals import Visuals


MASS_MATRIX = "mass-matrix"
"""Route by Bullet's mass matrix and bias."""

ARTICULATED_BODY = "articulated-body"
"""Route by Bullet's articulated-body algorithm."""

ROUTES = ("auto", MASS_MATRIX, ARTICULATED_BODY)
"""Accepted routes; "auto" selects one of the others."""


def make_engine(mechanism: Mechanism, forces: Forces, settings: EngineSettings) -> BulletEngine:
    """Return a Bullet engine.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.
        settings: settings; `route`, `show` and `visuals` are used.

    Raises:
        UnsupportedError: the joints or constraints do not allow the requested route.
        SimulationError: a body at the end of a chain has no mass, or there is no screen.
    """
    return BulletEngine(
        mechanism, forces, route=settings.route, show=settings.show, visuals=settings.visuals
    )


class BulletEngine(KernelEngine):
    """Engine that computes accelerations by PyBullet.

    Its methods are those of :class:`osimlite.simulation.engines.protocol.Engine`.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.
        route: "mass-matrix" or "articulated-body"; "auto" selects "mass-matrix", but
            "articulated-body" for a model that allows it and has an impossible inertia.
        show: whether Bullet's window opens.
        visuals: shapes of the bodies; None for none.

    Raises:
        UnsupportedError: the joints or constraints do not allow the requested route.
        SimulationError: a body at the end of a chain has no mass, or there is no screen.
    """

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
            raise OsimliteError(f"unknown route '{route}'; expected one of {', '.join(ROUTES)}")
        free = find_free_coordinates(mechanism)
        fixed = [index for index in range(len(mechanism.coordinates)) if index not in free]
        shapes = {} if visuals is None else visuals.by_body
        robot = legal_names(
            merge_fixed(build_robot(mechanism, locked=fixed, body_frames=False, visuals=shapes))
        )
        is_plain = _has_one_coordinate_per_joint(mechanism, robot)
        # Adding moments to invalid inertias and subtracting them again loses digits.
        is_exact = is_plain and any(compute_inertia_excess(link) > 0.0 for link in robot.links)
        self.route = (ARTICULATED_BODY if is_exact else MASS_MATRIX) if route == "auto" else route
        if is_plain:
            # With constraints, a chain may end with a massless body.
            require_masses(robot)
        elif route == ARTICULATED_BODY:
            raise UnsupportedError(
                f"the route {ARTICULATED_BODY} needs a model without constraints, in which each coordinate moves only one axis; "
                f"use {MASS_MATRIX} for '{mechanism.name}'"
            )
        files = {} if visuals is None else visuals.files
        self.window: Window | None = None
        if show:
            from osimlite.simulation.engines.bullet.window import Window

            self.window = Window(
                robot, mechanism.gravity.tolist(), files, self._compute_joint_values
            )
        is_exact = self.route == ARTICULATED_BODY
        self.world = body = World(robot, mechanism.gravity.tolist(), files=files, exact=is_exact)
        try:
            indices = {item.path: index for index, item in enumerate(mechanism.bodies)}
            added = [
                (indices[next(iter(link.bodies))], compute_inertia_excess(link))
                for link in robot.links
                if link.name in body.impossible
            ]
            supply = self._supply_by_step if is_exact else self._supply_matrix
            super().__init__(
                mechanism, forces, Chain(body.joints, [] if is_exact else added, supply)
            )
        except BaseException:
            self.close()
            raise
        # Bullet accepts invalid inertias, but not for mass matrices.
        self._steps_itself = is_plain and (is_exact or not added)
        count = len(body.joints)
        self._motion_offset = (
            self.structure[self.structure[MODEL.CHAIN] + CHAIN.WORK_JOINTS] if count else 0
        )
        self._forces = self._motion_offset + 3 * count
        self._pack_forces: Any = Struct(f"{count}d").pack_into
        self._pack_matrix: Any = Struct(f"{count * count}d").pack_into
        self.coordinates = [joint.coordinates[0] for joint in body.joints]

    # ---------------------------------------------------------------------------------------- accelerations
    def _supply_matrix(
        self, model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int
    ) -> None:
        """Write mass matrix and bias; see :class:`osimlite.simulation.pack_chain.Chain`.

        Raises:
            SimulationError: Bullet refuses the inertias of the model, which are invalid after its
                rounding.
        """
        robot, client, first = self.world.id, self.world.client, self._forces
        values, rates, accelerations = data[self._motion_offset : first].reshape(3, -1).tolist()
        try:
            forces = bullet.calculateInverseDynamics(robot, values, rates, accelerations, 0, client)
        except SystemError:
            raise SimulationError(
                f"Bullet refuses the inertias of '{self.mechanism.name}', which are invalid after its rounding; check "
                "masses and mass centers, or use the compiled engine"
            ) from None
        self._pack_forces(data, 8 * first, *forces)
        # numpy reads tuples at half the speed.
        matrix = chain.from_iterable(bullet.calculateMassMatrix(robot, values, 0, client))
        self._pack_matrix(data, 8 * (first + len(forces)), *matrix)

    def _supply_by_step(
        self, model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, unused: int
    ) -> None:
        """Write an identity mass matrix, and forces that give the joints Bullet's accelerations.

        The kernels solve Pᵀ (M P udot + f) = applied forces, where the forces f are those that the
        bias b of the joints needs. With M = 1, f = b - a and no applied forces, the joints get the
        accelerations a of Bullet's step.
        """
        first = self._forces
        size = len(self.order)
        values, rates, biases = data[self._motion_offset : first].reshape(3, -1)
        count = len(values)
        applied = f[size : 2 * size]
        forces = self.compute_joint_forces(y.tolist(), applied)
        result = self.world.accelerations_by_step(values.tolist(), rates.tolist(), forces)
        applied[:] = 0.0
        data[first : first + count] = biases - result
        data[first + count : first + count + count * count] = np.eye(count).ravel()

    def compute_joint_forces(self, y: Sequence[float], forces: Array) -> list[float]:
        """Return forces on joints that equal coordinates, equivalent to generalized forces.

        With qdot = N u, power is equal if f_u = Nᵀ f_q.

        Args:
            y: state (y,).
            forces: forces along the generalized speeds in the state's order.

        Returns:
            Forces (N or N m) in the order of Bullet's joints.
        """
        rates = self.mechanism.rate_matrix(self.state.values(y))
        spread = self.state.spread_to_all(forces.tolist(), [0.0] * len(rates))
        return np.linalg.solve(rates.T, spread)[self.coordinates].tolist()

    # ---------------------------------------------------------------------------------------------- motion
    def make_stepper(
        self, t: float, y: Sequence[float], settings: EngineSettings, observe: Observer
    ) -> Stepper:
        """Return a stepper that continues from a state.

        Args:
            t: time, s.
            y: state (y,).
            settings: settings of the integration; Bullet itself takes fixed steps if its joints are
                coordinates.
            observe: function that is called with time and state after each step.
        """
        window = self.window
        if window is not None:
            observe_step = observe

            def observe(t: float, y: list[float]) -> None:
                observe_step(t, y)
                window.show(t, y)

        if settings.fixed_step is not None and self._steps_itself:
            return BulletStepper(self, t, y, settings.fixed_step, observe)
        return super().make_stepper(t, y, settings, observe)

    def _compute_joint_values(self, y: Sequence[float]) -> list[float]:
        q = np.array(self.state.values(y))
        return [joint.value(q) for joint in self.world.joints]

    def close(self) -> None:
        """Close the worlds of Bullet; may be called repeatedly."""
        self.world.close()
        if self.window is not None:
            self.window.close()

    def hold_window(self) -> None:
        """Keep the window, if there is one, until the user closes it."""
        if self.window is not None:
            self.window.hold()


def _has_one_coordinate_per_joint(mechanism: Mechanism, robot: Robot) -> bool:
    """Return whether each joint of the robot equals a coordinate of its own, without constraints.

    Args:
        mechanism: the mechanism.
        robot: robot form of the mechanism.
    """
    indices = [joint.coordinates[0] for joint in robot.moving]
    return (
        all(joint.coordinate is not None for joint in robot.moving)
        and len(set(indices)) == len(indices)
        and all(isinstance(item, Lock) for item in mechanism.constraints)
        and not any(mechanism.coordinates[index].locked for index in indices)
    )


class BulletStepper(SemiImplicitEuler):
    """Stepper with Bullet's fixed steps.

    New speeds follow from the accelerations at the start of the step, then values from the new
    speeds. This is what ``stepSimulation`` of PyBullet does: a first-order method with one
    evaluation of the forces per step. The derivative contains forces in place of the accelerations.

    Args:
        engine: engine in which each of Bullet's joints is a coordinate.
        t: initial time, s.
        y: initial state.
        h: step, s; the last one may be shorter.
        observe: function that is called with time and state after each step; the loads belong to
            that state.
    """

    def __init__(
        self, engine: BulletEngine, t: float, y: Sequence[float], h: float, observe: Observer
    ) -> None:
        super().__init__(
            engine.compute_applied_forces,
            t,
            y,
            len(engine.order),
            h,
            observe=observe,
            names=engine.state.names,
        )
        self._engine, self.world, self._coordinate_indices = (
            engine,
            engine.world,
            engine.coordinates,
        )
        q, u = engine.state.values(y), engine.state.speeds(y)
        # Bullet's joints have rates of coordinates, the state has generalized speeds.
        rates = engine.mechanism.coordinate_rates(q, u)[self._coordinate_indices]
        self.world.set_state([q[index] for index in self._coordinate_indices], rates.tolist())

    def _take_step(self, h: float) -> list[float]:
        layout, mechanism, count = self._engine.state, self._engine.mechanism, self._nq
        forces = np.array(self.derivative[count : 2 * count])
        self.world.step(h, self._engine.compute_joint_forces(self.state, forces))
        q = np.array(layout.values(self.state))
        rates = np.zeros(len(mechanism.coordinates))
        q[self._coordinate_indices], rates[self._coordinate_indices] = self.world.get_state()
        z = [
            x + h * rate
            for x, rate in zip(self.state[2 * count :], self.derivative[2 * count :], strict=True)
        ]
        y = layout.pack(q.tolist(), mechanism.speeds_from_rates(q, rates).tolist(), z)
        # Bullet limits joint speeds, so that a diverged motion may look finite.
        if not max(map(abs, y[: 2 * count]), default=0.0) < 0.5 * self.world.FASTEST:
            raise make_divergence_error(self.time, self._h)
        return y
