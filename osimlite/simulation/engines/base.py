"""Base class of the engines: forces, constraints and steps by the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Self

from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.simulation.engines.controlled_steps import ControlledSteps
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.options import MERSON
from osimlite.simulation.stepper import Observer, Stepper
from osimlite.simulation.system import System


class KernelEngine(System):
    """Engine that computes motions by the kernels.

    Its methods are those of :class:`osimlite.simulation.engines.protocol.Engine`.

    Args:
        mechanism: the mechanism.
        forces: forces on it besides gravity.
        chain: joints whose mass matrix another program computes; None if the kernels compute it.

    Raises:
        UnsupportedError: the kernels do not support a joint, function, constraint or force.
    """

    entries = ("evaluate", "run_several", MERSON)

    @property
    def error_counts(self) -> tuple[int, int]:
        """Divisors of the sums of squared errors of values and of speeds, in the norm of the integrator.

        Simbody's norm is a root mean square. It counts locked coordinates too, and the fourth
        number of a quaternion for each joint with three angles.

        Returns:
            Divisor for the values, and divisor for the speeds.
        """
        count = len(self.mechanism.coordinates)
        return count + sum(
            not body.mobilizer.speeds_are_rates for body in self.mechanism.bodies
        ), count

    # ---------------------------------------------------------------------------------------- accelerations
    def compute_derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """Return (qdot, udot, zdot) at a state, and set `loads`.

        Args:
            t: time, s.
            y: state (y,).

        Raises:
            SimulationError: an admissible motion moves no mass, or speeds are not defined in the
                pose.
        """
        status = self.realize(t, y, STAGE.ACCELERATION)
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, t, y)
        self.store_contact_loads(self._pairs[:, :3])
        return self.get_derivative()

    def compute_accelerations(
        self, t: float, q: Sequence[float], u: Sequence[float]
    ) -> list[float]:
        """Return the derivatives of the speeds of all coordinates.

        Args:
            t: time, s.
            q: values (n,) of all coordinates, in the mechanism's order.
            u: generalized speeds (n,).

        Returns:
            Accelerations (n,) in the mechanism's order; 0 for locked coordinates.
        """
        udot = self.compute_derivative(t, self.state.pack(q, u))[
            len(self.order) : 2 * len(self.order)
        ]
        return self.state.spread_to_all(udot, [0.0] * len(self.mechanism.coordinates))

    # ---------------------------------------------------------------------------------------------- motion
    def make_stepper(
        self, t: float, y: Sequence[float], settings: EngineSettings, observe: Observer
    ) -> Stepper:
        """Return a stepper that continues from a state.

        Args:
            t: time, s.
            y: state (y,).
            settings: settings of the integration: error control, or fixed steps of semi-implicit
                Euler.
            observe: function that is called with time and state after each step.
        """
        if settings.fixed_step is not None:
            # Speeds of ball joints are angular velocities, from which the kernels compute the rates
            # of the angles.
            rates = (
                None
                if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies)
                else self._compute_rates
            )
            return SemiImplicitEuler(
                self.compute_derivative,
                t,
                y,
                len(self.order),
                settings.fixed_step,
                rates=rates,
                observe=observe,
                names=self.state.names,
                projected=self.project_state,
            )
        return ControlledSteps(
            self, t, y, settings, observe, controller_runs=settings.controller_runs
        )

    def project_state(self, t: float, y: Sequence[float], tolerance: float) -> list[float] | None:
        """Return the nearest state that fulfils the constraints.

        Args:
            t: time, s.
            y: state (y,).
            tolerance: largest accepted error of a constraint, in its unit.

        Returns:
            The state (y,); None if none is near.
        """
        if not self.structure[MODEL.CONSTRAINED]:
            return list(y)
        self._set_state(t, y)
        # The kernel reads its tolerance and the largest accepted correction from the scratch
        # numbers.
        self._w[WORK.SCRATCH : WORK.SCRATCH + 2] = tolerance, inf
        entry = self.program.code.get_entry("project")
        status = entry(self.program.ints, self.numbers, self._w, self._y, self._f, 0)
        return self._y.tolist() if status == OUTCOME.OK else None

    def _compute_rates(self, q: list[float], u: list[float]) -> list[float]:
        """Return the rates of the coordinates.

        Args:
            q: values of the coordinates in the state.
            u: generalized speeds in the state.
        """
        y = q + u + [0.0] * len(self.state.variables)
        status = self.realize(0.0, y, STAGE.VELOCITY)
        if status != OUTCOME.OK:
            raise self.make_evaluation_error(status, 0.0, y)
        return self.get_derivative()[: len(self.order)]

    def hold_window(self) -> None:
        """Do nothing: this engine has no window."""

    def close(self) -> None:
        """Do nothing: this engine holds no resources."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
