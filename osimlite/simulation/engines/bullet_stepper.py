"""Bullet's own fixed steps, as a stepper among others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING

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

    def __init__(self, engine: BulletEngine, t: float, y: list[float], h: float, observe: Observer) -> None:
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
        count = engine._count
        self._body.set_state(y[:count], engine._speeds.rates(y[:count], y[count : 2 * count]))
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
        q, rates = self._body.get_state()
        y = q + self._engine._speeds.from_rates(q, rates)
        # Bullet clips what would be faster, so that a motion that has burst may look finite.
        if not max(map(abs, y), default=0.0) < 0.5 * self._body.FASTEST:
            raise burst(self.time, self._h)
        auxiliary = self._engine.state.auxiliary(self.state)
        y += [z + h * rate for z, rate in zip(auxiliary, self._auxiliary_rates, strict=True)]
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

    def _evaluate_forces(self, y: list[float]) -> Sequence[float]:
        self.evaluations += 1
        engine, count = self._engine, self._engine._count
        applied = engine.system.applied(self.time, y)
        self._auxiliary_rates = applied[2 * count :]
        return engine._speeds.joint_forces(y[:count], applied[count : 2 * count])
