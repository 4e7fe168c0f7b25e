"""Bullet's own fixed steps, as a stepper among others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from osimlite.errors import SimulationError
from osimlite.simulation.euler import burst
from osimlite.simulation.stepper import Observer, Stepper, straight_line

if TYPE_CHECKING:
    from osimlite.simulation.engines.bullet import BulletEngine


class BulletStepper(Stepper):
    """Bullet's own fixed steps: speeds by the accelerations at the start of the step, then values by the new speeds.

    That is what a PyBullet user expects of ``stepSimulation``: first order, one force evaluation a step.

    Args:
        engine: whose mechanism.
        t: initial time, s.
        y: initial state.
        h: step, s; a last one may be shorter.
        observe: called with (time, state) after each step; the loads are those at that state.
    """

    def __init__(self, engine: BulletEngine, t: float, y: Sequence[float], h: float, observe: Observer) -> None:
        if not 0.0 < h < inf:
            raise SimulationError(f"The fixed step must be positive and finite; {h} s is not.")
        self._engine, self._body = engine, engine._body
        self._h = h
        self._observe = observe
        self._origin, self._since = t, 0
        self.time, self.state = t, list(y)
        self.evaluations = self.taken = 0
        self._previous = t, self.state, []
        engine.state.require(y)
        q, u = engine.state.values(y), engine.state.speeds(y)
        places = self._places = engine.coordinates
        self._body.set_state([q[k] for k in places], engine.mechanism.coordinate_rates(q, u)[places].tolist())
        self._torques = self._evaluate_forces(y)

    def step(self, limit: float = inf) -> None:
        """Take one step of the fixed size, or up to the limit if that comes first."""
        self._require_room(limit)
        self._since += 1
        t, h = self._origin + self._h * self._since, self._h
        if t > limit - 1e-9 * h:
            if t > limit + 1e-9 * h:
                h = limit - self.time
            t = limit
            self._origin, self._since = limit, 0
        self._body.step(h, self._torques)
        y = self._state_there(h)
        # Bullet clips what would be faster, so that a motion that has burst may look finite.
        if not max(map(abs, y[: 2 * len(self._engine.order)]), default=0.0) < 0.5 * self._body.FASTEST:
            raise burst(self.time, self._h)
        self._previous = self.time, self.state, []
        self.time, self.state = t, y
        self.taken += 1
        self._torques = self._evaluate_forces(y)
        if self._observe is not None:
            self._observe(t, y)

    def interpolant(self) -> Callable[[float], list[float]]:
        """The straight line between the ends of the last step."""
        t0, y0, _ = self._previous
        t1, y1 = self.time, self.state
        return lambda t: straight_line(t0, y0, t1, y1, t)

    def _state_there(self, h: float) -> list[float]:
        """The state after a step of Bullet's of length h (s)."""
        layout, mechanism = self._engine.state, self._engine.mechanism
        q, rates = np.array(layout.values(self.state)), np.zeros(len(mechanism.coordinates))
        q[self._places], rates[self._places] = self._body.get_state()
        z = [x + h * rate for x, rate in zip(layout.auxiliary(self.state), self._auxiliary_rates, strict=True)]
        return layout.pack(q.tolist(), mechanism.speeds_from_rates(q, rates).tolist(), z)

    def _evaluate_forces(self, y: Sequence[float]) -> Sequence[float]:
        self.evaluations += 1
        count = len(self._engine.order)
        applied = self._engine.applied(self.time, y)
        self._auxiliary_rates = applied[2 * count :]
        return self._engine.joint_forces(y, np.array(applied[count : 2 * count]))
