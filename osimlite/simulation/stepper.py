"""What follows a motion in steps: the present state, the step to the next one, and states at times in between.

A state is one list y = (q, u, z): coordinates, generalized speeds, auxiliary states. Its derivative
comes from a function f(t, y) that returns (qdot, udot, zdot) as a fresh sequence of Python floats
and leaves y alone. Lists of floats are quicker than arrays here up to some 30 states.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import inf, isfinite
from typing import Any

from osimlite.errors import SimulationError

Derivative = Callable[[float, list[float]], Sequence[float]]
Observer = Callable[[float, list[float]], object]
Progress = Callable[[float, float], object]
"""Called now and then with the simulated time reached and the present length of the steps, both in s."""


class NoSolution(SimulationError, ArithmeticError):
    """The law of a force has no solution at a state; within a step, a smaller one is tried, as in Simbody."""


class IntegrationError(SimulationError):
    """The integrator cannot go on.

    Attributes:
        time: where, s.
        index: the entry of the state that is to blame, if one is.
    """

    def __init__(self, message: str, time: float, index: int | None = None) -> None:
        super().__init__(message)
        self.time = time
        self.index = index


class Stepper(ABC):
    """Common face of the steppers: a present state, steps, and states at times in between.

    When `observe` is called for a step, the last call of f was the one at exactly that time and
    state; whatever f kept of it (contact forces, say) belongs to the step. It is not called for the
    initial state.

    Attributes:
        time: s.
        state: y at that time; a new list after every step, not changed later.
        derivative: f(time, state).
        evaluations: calls of f so far.
        taken: steps taken so far.
        ended: what ended a table before its last time, Ctrl-C or an error of the motion.
    """

    ended: KeyboardInterrupt | SimulationError | None = None

    def __init__(
        self,
        f: Derivative,
        t: float,
        y: Iterable[float],
        observe: Observer | None,
        names: Sequence[str] | None,
    ) -> None:
        self._f = f
        self._observe = observe
        self._names = names
        self.time = t
        self.state = list(y)
        self.derivative = self._evaluate(t, self.state)
        self.evaluations = 1
        self.taken = 0
        if len(self.derivative) != len(self.state):
            raise ValueError(
                f"f gives {len(self.derivative)} derivatives of {len(self.state)} states"
            )
        self.previous = t, self.state, self.derivative

    @property
    def name(self) -> str:
        """Of the method."""
        return type(self).__name__

    @property
    def attempted(self) -> int:
        """Steps tried so far: more than were taken if steps are repeated smaller."""
        return self.taken

    def catch_up(self) -> None:  # noqa: B027
        """Make the calls of `observe` that were put off, as a stepper may that computes many steps at once."""

    @abstractmethod
    def step(self, limit: float = inf) -> None:
        """Take one step, which ends at `limit` (s) at the latest.

        Raises:
            IntegrationError: a derivative is not a finite number, or no step is small enough.
        """

    @abstractmethod
    def interpolant(self) -> Callable[[float], list[float]]:
        """The function that gives the state at any time within the last step, s; it stays good for that step."""

    def steps(self, until: float) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) after each step; the last one ends at `until` (s), as with OpenSim's Manager."""
        while self.time < until:
            self.step(until)
            yield self.time, self.state

    def table(self, times: Sequence[float], progress: Progress | None = None) -> Sequence[Any]:
        """The states at times that do not decrease (s), one row for each, or for those reached when it was `ended`.

        Args:
            times: of the rows, s.
            progress: called after every step, or after several that are quick.
        """
        rows: list[list[float]] = []
        try:
            for t in times:
                while self.time < t:
                    self.step(times[-1])
                    if progress is not None:
                        progress(self.time, self.time - self.previous[0])
                rows.append(self.at(t))
        except (KeyboardInterrupt, SimulationError) as ended:
            self.ended = ended
            # Ctrl-C may have come after a step and before its rows.
            rows += [self.at(t) for t in times[len(rows) : bisect_right(times, self.time)]]
        return rows

    def at(self, t: float) -> list[float]:
        """State at a time not before the start of the last step nor after its end, s."""
        if t == self.time:
            return self.state
        start = self.previous[0]
        if not start <= t < self.time:
            raise ValueError(
                f"t = {t:.9g} s is outside the last step, {start:.9g} to {self.time:.9g} s"
            )
        return self.interpolant()(t)

    def _advance(self, t: float, y: list[float]) -> None:
        """Make (t, y) the present state."""
        self.previous = self.time, self.state, self.derivative
        self.derivative = self._evaluate(t, y)
        self.time = t
        self.state = y
        self.evaluations += 1
        self.taken += 1
        if self._observe is not None:
            self._observe(t, y)

    def _require_room(self, limit: float) -> None:
        if not limit > self.time:
            raise ValueError(
                f"the limit {limit:.9g} s of the step is not after the present {self.time:.9g} s"
            )

    def _evaluate(self, t: float, y: list[float]) -> Sequence[float]:
        """The derivative at a state that is part of the motion, where it must exist."""
        try:
            derivative = self._f(t, y)
        except (ArithmeticError, ValueError) as failure:
            raise IntegrationError(
                f"The derivative cannot be computed at t = {t:.9g} s: {failure}.", t
            ) from failure
        total = sum(derivative)
        if total - total != 0.0:
            self._refuse_non_finite(t, derivative)
        return derivative

    def _refuse_non_finite(self, t: float, derivative: Sequence[float]) -> None:
        """Raise an error that names the first entry that is not finite, if there is one."""
        for index, value in enumerate(derivative):
            if not isfinite(value):
                raise IntegrationError(
                    f"The derivative of {self._name(index)} is {value} at t = {t:.9g} s; check the masses, inertias "
                    "and parameters of forces that it depends on, of a muscle also whether it starts in equilibrium, "
                    "and whether its control is above 0: near rest, an elastic tendon can be stiff without bound.",
                    t,
                    index,
                )

    def _name(self, index: int) -> str:
        return f"state {index}" if self._names is None else self._names[index]


def straight_line(t0: float, y0: list[float], t1: float, y1: list[float], t: float) -> list[float]:
    """State at time t on the straight line from y0 at t0 to y1 at t1."""
    s = (t - t0) / (t1 - t0)
    return [y + s * (z - y) for y, z in zip(y0, y1, strict=True)]
