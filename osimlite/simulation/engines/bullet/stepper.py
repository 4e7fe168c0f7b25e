"""Bullet's own fixed steps, as a stepper among others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from osimlite.simulation.euler import SemiImplicitEuler, burst
from osimlite.simulation.stepper import Observer

if TYPE_CHECKING:
    from osimlite.simulation.engines.bullet.engine import BulletEngine


class BulletStepper(SemiImplicitEuler):
    """Bullet's own fixed steps: speeds by the accelerations at the start of the step, then values by the new speeds.

    That is what a PyBullet user expects of ``stepSimulation``: first order, one force evaluation a
    step. In the place of the accelerations, the derivative has the forces.

    Args:
        engine: whose mechanism; each joint of Bullet's is a coordinate.
        t: initial time, s.
        y: initial state.
        h: step, s; a last one may be shorter.
        observe: called with (time, state) after each step; the loads are those at that state.
    """

    def __init__(
        self, engine: BulletEngine, t: float, y: Sequence[float], h: float, observe: Observer
    ) -> None:
        super().__init__(
            engine.applied, t, y, len(engine.order), h, observe=observe, names=engine.state.names
        )
        self._engine, self.world, self._places = engine, engine.world, engine.coordinates
        q, u = engine.state.values(y), engine.state.speeds(y)
        rates = engine.mechanism.coordinate_rates(q, u)[self._places]
        self.world.set_state([q[place] for place in self._places], rates.tolist())

    def _moved(self, h: float) -> list[float]:
        layout, mechanism, count = self._engine.state, self._engine.mechanism, self._nq
        forces = np.array(self.derivative[count : 2 * count])
        self.world.step(h, self._engine.joint_forces(self.state, forces))
        q, rates = np.array(layout.values(self.state)), np.zeros(len(mechanism.coordinates))
        q[self._places], rates[self._places] = self.world.get_state()
        z = [
            x + h * rate
            for x, rate in zip(self.state[2 * count :], self.derivative[2 * count :], strict=True)
        ]
        y = layout.pack(q.tolist(), mechanism.speeds_from_rates(q, rates).tolist(), z)
        # Bullet clips what would be faster, so that a motion that has burst may look finite.
        if not max(map(abs, y[: 2 * count]), default=0.0) < 0.5 * self.world.FASTEST:
            raise burst(self.time, self._h)
        return y
