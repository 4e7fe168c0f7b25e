"""What all engines have in common: forces, constraints and steps are those of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Self

from osimlite.mechanics.kernels.layout import MODEL, OUTCOME, STAGE, WORK
from osimlite.simulation.engines.controlled_steps import ControlledSteps
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.options import MERSON
from osimlite.simulation.stepper import Observer, Stepper
from osimlite.simulation.system import System


class KernelEngine(System):
    """Motion by the kernels; see the protocol for what it offers.

    Args:
        mechanism: what moves.
        forces: what pushes it, besides gravity.
        chain: of joints whose mass matrix another program computes; the kernels do without one.

    Raises:
        UnsupportedError: a joint, a function, a constraint or a force that the kernels do not know.
    """

    entries = ("evaluate", "run_several", MERSON)

    @property
    def counted(self) -> tuple[int, int]:
        """What the sums of the squared errors of values and of speeds are divided by.

        Simbody counts locked coordinates too, and the fourth number that it keeps for three angles.
        """
        count = len(self.mechanism.coordinates)
        return count + sum(
            not body.mobilizer.speeds_are_rates for body in self.mechanism.bodies
        ), count

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        status = self.realize(t, y, STAGE.ACCELERATION)
        if status != OUTCOME.OK:
            raise self.refusal(status, t, y)
        self.note_loads(self._pairs[:, :3])
        return self.found()

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[len(self.order) : 2 * len(self.order)]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(
        self, t: float, y: Sequence[float], settings: Settings, observe: Observer
    ) -> Stepper:
        """What integrates from a state on: steps whose error is controlled, or fixed steps of semi-implicit Euler."""
        if settings.fixed_step is not None:
            rates = (
                None
                if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies)
                else self._rates
            )
            return SemiImplicitEuler(
                self.derivative,
                t,
                y,
                len(self.order),
                settings.fixed_step,
                rates=rates,
                observe=observe,
                names=self.state.names,
                projected=self.projected,
            )
        bounds, held = settings.step_bounds, settings.held
        return ControlledSteps(
            self,
            t,
            y,
            settings.accuracy,
            observe,
            settings.integrator,
            step_bounds=bounds,
            held=held,
        )

    def projected(self, t: float, y: Sequence[float], tolerance: float) -> list[float] | None:
        """The state (y,) nearest to one where the constraints hold to a tolerance; None if none is near."""
        if not self.structure[MODEL.CONSTRAINED]:
            return list(y)
        self._set(t, y)
        self._w[WORK.SCRATCH : WORK.SCRATCH + 2] = tolerance, inf
        entry = self.program.code.entry("project")
        status = entry(self.program.ints, self.numbers, self._w, self._y, self._f, 0)
        return self._y.tolist() if status == OUTCOME.OK else None

    def _rates(self, q: list[float], u: list[float]) -> list[float]:
        y = q + u + [0.0] * len(self.state.variables)
        status = self.realize(0.0, y, STAGE.VELOCITY)
        if status != OUTCOME.OK:
            raise self.refusal(status, 0.0, y)
        return self.found()[: len(self.order)]

    def hold(self) -> None:
        """There is no window."""

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
