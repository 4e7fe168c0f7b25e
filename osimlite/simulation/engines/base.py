"""What all engines have in common: forces, constraints and steps are those of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

from osimlite.multibody.mechanism import Mechanism
from osimlite.simulation.constrained import Constrained
from osimlite.simulation.elements import Forces
from osimlite.simulation.engines.motion import CompiledMerson
from osimlite.simulation.engines.protocol import Settings
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.kernels import layout
from osimlite.simulation.kernels.pack_chain import Chain
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

    entries = ("evaluate", "run_several")

    def __init__(self, mechanism: Mechanism, forces: Forces, chain: Chain | None = None) -> None:
        super().__init__(mechanism, forces, chain)
        self.constrained = Constrained(mechanism, self.order)

    # ---------------------------------------------------------------------------------------- accelerations
    def derivative(self, t: float, y: Sequence[float]) -> list[float]:
        """(qdot, udot, zdot) at a state."""
        status = self.realize(t, y, layout.ACCELERATION_STAGE)
        if status != layout.OK:
            raise self.refusal(status, t, y)
        self.note_loads(self._pairs[:, :3])
        return self.found()

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates, in the mechanism's order; zero if locked."""
        udot = self.derivative(t, self.state.pack(q, u))[len(self.order) : 2 * len(self.order)]
        return self.state.spread(udot, [0.0] * len(self.mechanism.coordinates))

    # ---------------------------------------------------------------------------------------------- motion
    def stepper(self, t: float, y: Sequence[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on: Runge-Kutta-Merson, or fixed steps of semi-implicit Euler."""
        if settings.fixed_step is not None:
            rates = None if all(body.mobilizer.speeds_are_rates for body in self.mechanism.bodies) else self._rates
            return SemiImplicitEuler(
                self.derivative,
                t,
                y,
                len(self.order),
                settings.fixed_step,
                rates=rates,
                observe=observe,
                names=self.state.names,
                projection=self.constrained,
            )
        return CompiledMerson(self, t, y, settings.accuracy, observe, self.state.names)

    def _rates(self, q: list[float], u: list[float]) -> list[float]:
        # They depend on nothing else.
        return self.derivative(0.0, q + u + [0.0] * len(self.state.variables))[: len(self.order)]

    def hold(self) -> None:
        """There is no window."""

    def close(self) -> None:
        """Nothing is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
