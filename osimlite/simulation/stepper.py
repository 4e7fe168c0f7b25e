"""Time steppers: the present state, the step to the next one, and states at times in between.

A state is one list y = (q, u, z): coordinates, generalized speeds, auxiliary states. Its derivative
is a function f(t, y) that returns (qdot, udot, zdot) as a new sequence of Python floats and does
not change y. Up to about 30 states, lists of floats are faster here than arrays.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import inf, isfinite
from typing import Any

from osimlite.errors import SimulationError

Derivative = Callable[[float, list[float]], Sequence[float]]
"""Function f(t, y) that returns the derivative of the state."""
Observer = Callable[[float, list[float]], object]
"""Function that is called with time (s) and state after each step."""
Progress = Callable[[float, float], object]
"""Function that is called occasionally with the simulated time and the present step length, both in s."""


class NoSolution(SimulationError, ArithmeticError):
    """Error of a force whose equations have no solution at a state.

    Within a step the integrator then tries a smaller step, as Simbody does.
    """


class IntegrationError(SimulationError):
    """Error of an integrator that cannot continue.

    Attributes:
        time: time at which it stopped, s.
        index: index of the state that caused it, if one did.
    """

    def __init__(self, message: str, time: float, index: int | None = None) -> None:
        super().__init__(message)
        self.time = time
        self.index = index


class Stepper(ABC):
    """Base class of the steppers: a present state, steps, and states at times in between.

    When `observe` is called for a step, the last call of f was at exactly that time and state, so
    that what f stored (contact forces, for example) belongs to the step. It is not called for the
    initial state.

    Attributes:
        time: present time, s.
        state: state y at this time; every step makes a new list.
        derivative: derivative f(time, state) of this state.
        evaluations: number of calls of f so far.
        accepted: number of accepted steps so far.
        ended: exception that ended a table before its last time: Ctrl-C, or an error of the motion.
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
        self.accepted = 0
        if len(self.derivative) != len(self.state):
            raise ValueError(
                f"f returns {len(self.derivative)} derivatives for {len(self.state)} states"
            )
        self.previous = t, self.state, self.derivative

    @property
    def name(self) -> str:
        """Class name of the integration method, as the summary shows it."""
        return type(self).__name__

    @property
    def attempted(self) -> int:
        """Number of attempted steps: more than accepted ones if steps are repeated with a smaller length."""
        return self.accepted

    def catch_up(self) -> None:  # noqa: B027
        """Make the outstanding calls of `observe`.

        A stepper that computes many steps in one call postpones them.
        """

    @abstractmethod
    def step(self, limit: float = inf) -> None:
        """Take one step that ends at `limit` (s) at the latest.

        Raises:
            IntegrationError: a derivative is not finite, or no step is small enough.
        """

    @abstractmethod
    def make_interpolant(self) -> Callable[[float], list[float]]:
        """Return an interpolation of the state within the last step.

        Returns:
            Function of time (s) that gives the state (y,). It stays valid after later steps.
        """

    def iterate_steps(self, until: float) -> Iterator[tuple[float, list[float]]]:
        """Yield time and state after each step.

        Args:
            until: end of the last step, s. It is shortened to end there, as with OpenSim's Manager.
        """
        while self.time < until:
            self.step(until)
            yield self.time, self.state

    def tabulate(self, times: Sequence[float], progress: Progress | None = None) -> Sequence[Any]:
        """Return the states at given times.

        Args:
            times: non-decreasing times of the rows, s.
            progress: function that is called with simulated time and step length (s) after every
                step, or after several that are fast; None for none.

        Returns:
            One state (y,) for each time, up to the time that was reached if the motion ended early.
            The exception that ended it is in `ended`.
        """
        rows: list[list[float]] = []
        try:
            for t in times:
                # Steps end at the last time only, so that rows do not shorten them.
                while self.time < t:
                    # Steps end at the last time only. Rows between are interpolated, so that the
                    # number of rows does not change the motion.
                    self.step(times[-1])
                    if progress is not None:
                        progress(self.time, self.time - self.previous[0])
                rows.append(self.interpolate(t))
        except (KeyboardInterrupt, SimulationError) as ended:
            self.ended = ended
            # Ctrl-C may have interrupted between a step and its rows.
            rows += [self.interpolate(t) for t in times[len(rows) : bisect_right(times, self.time)]]
        return rows

    def interpolate(self, t: float) -> list[float]:
        """Return the state at a time within the last step.

        Args:
            t: time, s.

        Raises:
            ValueError: the time is not within the last step.
        """
        if t == self.time:
            return self.state
        start = self.previous[0]
        if not start <= t < self.time:
            raise ValueError(
                f"t = {t:.9g} s is outside the last step, {start:.9g} to {self.time:.9g} s"
            )
        return self.make_interpolant()(t)

    def _accept_step(self, t: float, y: list[float]) -> None:
        """Make (t, y) the present state."""
        # The previous state is kept for interpolation.
        self.previous = self.time, self.state, self.derivative
        self.derivative = self._evaluate(t, y)
        self.time = t
        self.state = y
        self.evaluations += 1
        self.accepted += 1
        if self._observe is not None:
            self._observe(t, y)

    def _require_later(self, limit: float) -> None:
        """Check that the limit of a step (s) is after the present time.

        Raises:
            ValueError: the limit is not after the present time.
        """
        if not limit > self.time:
            raise ValueError(
                f"the limit {limit:.9g} s of the step is not after the present {self.time:.9g} s"
            )

    def _evaluate(self, t: float, y: list[float]) -> Sequence[float]:
        """Return the derivative at a state of the motion.

        Args:
            t: time, s.
            y: state.

        Raises:
            IntegrationError: the derivative cannot be computed or is not finite.
        """
        try:
            derivative = self._f(t, y)
        except (ArithmeticError, ValueError) as failure:
            raise IntegrationError(
                f"a force, a control function or another part of the model cannot be computed at t = {t:.9g} s: {failure}",
                t,
            ) from failure
        # x - x is 0 for finite x only, and one sum is faster than a test of each entry. A sum of
        # finite numbers may overflow, so the entries are then tested.
        total = sum(derivative)
        if total - total != 0.0:
            self._refuse_non_finite(t, derivative)
        return derivative

    def _refuse_non_finite(self, t: float, derivative: Sequence[float]) -> None:
        """Check that all entries of a derivative are finite.

        Args:
            t: time, s.
            derivative: derivative of the state.

        Raises:
            IntegrationError: an entry is infinite or NaN; the error names the first one.
        """
        for index, value in enumerate(derivative):
            if not isfinite(value):
                raise IntegrationError(
                    f"The derivative of {self._get_state_name(index)} is {value} at t = {t:.9g} s. Check the masses, inertias "
                    "and parameters of the forces that it depends on. If it depends on a muscle, start the muscle "
                    "in equilibrium, with a control above 0: near zero activation, the equations of an elastic "
                    "tendon can become infinitely stiff.",
                    t,
                    index,
                )

    def _get_state_name(self, index: int) -> str:
        """Return the name of a state in messages."""
        return f"state {index}" if self._names is None else self._names[index]


def interpolate_linearly(
    t0: float, y0: list[float], t1: float, y1: list[float], t: float
) -> list[float]:
    """Return the state on the straight line between two states.

    Args:
        t0: time of `y0`, s.
        y0: first state.
        t1: time of `y1`, s.
        y1: second state.
        t: time of the result, s.
    """
    s = (t - t0) / (t1 - t0)
    return [y + s * (z - y) for y, z in zip(y0, y1, strict=True)]
