"""Time steppers, and the one that is usual: Runge-Kutta-Merson with Simbody's error control.

A state is one list y = (q, u) or (q, u, z): coordinates, generalized speeds, auxiliary states. Its derivative
comes from a function f(t, y) that returns (qdot, udot) or (qdot, udot, zdot) as a fresh sequence of Python floats
and leaves y alone. Lists of floats are quicker than arrays here up to some 30 states.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from math import inf, isfinite, sqrt
from typing import Any, Protocol

from osimlite.errors import SettingError, SimulationError

Derivative = Callable[[float, list[float]], Sequence[float]]
Observer = Callable[[float, list[float]], object]


class Projection(Protocol):
    """Moves states to where constraints hold."""

    def project(
        self, t: float, y: list[float], errors: list[float] | None, tolerance: float, limit: float = inf
    ) -> tuple[list[float], list[float] | None] | None:
        """The nearest state that fulfils the constraints, if it is near.

        Args:
            t: time, s.
            y: a state.
            errors: how far off each entry of it may be, or None.
            tolerance: what the constraints may be off.
            limit: what they may be off at most in y.

        Returns:
            The state, and the errors without what lies across the constraints; None if no such state is near.
        """


DEFAULT_ACCURACY = 1e-3
"""What OpenSim's Manager uses where no accuracy was set."""

INITIAL_STEP = 0.01
"""First step tried, s: a tenth of Simbody's default time scale."""

_ROUNDING = 2.0**-52


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

    When `observe` is called for a step, the last call of f was the one at exactly that time and state; whatever f
    kept of it (contact forces, say) belongs to the step. It is not called for the initial state.

    Attributes:
        time: s.
        state: y at that time; a new list after every step, not changed later.
        derivative: f(time, state).
        evaluations: calls of f so far.
        taken: steps taken so far.
    """

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
            raise ValueError(f"f gives {len(self.derivative)} derivatives of {len(self.state)} states")
        self._previous = t, self.state, self.derivative

    @property
    def name(self) -> str:
        """Of the method."""
        return type(self).__name__

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

    def interpolate(self, t: float) -> list[float]:
        """State at a time within the last step, s."""
        return self.interpolant()(t)

    def steps(self, until: float) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) after each step; the last one ends at `until` (s), as with OpenSim's Manager."""
        while self.time < until:
            self.step(until)
            yield self.time, self.state

    def reports(self, times: Sequence[float]) -> Iterator[tuple[float, list[float]]]:
        """Yield (time, state) at times that do not decrease, s.

        They do not shorten the steps: within a step, the state is interpolated. The last step ends at the last
        time, so that the steps are those of `steps` up to it.
        """
        for t in times:
            while self.time < t:
                self.step(times[-1])
            yield t, self.at(t)

    def table(self, times: Sequence[float], progress: Callable[[float], object] | None = None) -> Sequence[Any]:
        """The states at times that do not decrease (s), one row for each; `progress` is called with every time."""
        rows = []
        for t, state in self.reports(times):
            rows.append(state)
            if progress is not None:
                progress(t)
        return rows

    def at(self, t: float) -> list[float]:
        """State at a time not before the start of the last step nor after its end, s."""
        if t == self.time:
            return self.state
        start = self._previous[0]
        if not start <= t < self.time:
            raise ValueError(f"t = {t:.9g} s is outside the last step, {start:.9g} to {self.time:.9g} s")
        return self.interpolate(t)

    def _advance(self, t: float, y: list[float]) -> None:
        """Make (t, y) the present state."""
        self._previous = self.time, self.state, self.derivative
        self.derivative = self._evaluate(t, y)
        self.time = t
        self.state = y
        self.evaluations += 1
        self.taken += 1
        if self._observe is not None:
            self._observe(t, y)

    def _require_room(self, limit: float) -> None:
        if not limit > self.time:
            raise ValueError(f"the limit {limit:.9g} s of the step is not after the present {self.time:.9g} s")

    def _evaluate(self, t: float, y: list[float]) -> Sequence[float]:
        """The derivative at a state that is part of the motion, where it must exist."""
        try:
            derivative = self._f(t, y)
        except ArithmeticError as failure:
            raise IntegrationError(f"The derivative cannot be computed at t = {t:.9g} s: {failure}.", t) from failure
        total = sum(derivative)
        if total - total != 0.0:
            self._refuse_non_finite(t, derivative)
        return derivative

    def _refuse_non_finite(self, t: float, derivative: Sequence[float]) -> None:
        """Raise an error that names the first entry that is not finite, if there is one."""
        for index, value in enumerate(derivative):
            if not isfinite(value):
                raise IntegrationError(
                    f"The derivative of {self._name(index)} is {value} at t = {t:.9g} s; check the masses, "
                    "inertias and force parameters that it depends on.",
                    t,
                    index,
                )

    def _name(self, index: int) -> str:
        return f"state {index}" if self._names is None else self._names[index]


class RungeKuttaMerson(Stepper):
    """Simbody's RungeKuttaMerson, the default integrator of OpenSim: `accuracy` means what it means there.

    Merson's method propagates a fourth-order solution and estimates its error from an embedded third-order one
    (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, table 4.1). A step is taken
    if the norm of the error, as `_error` forms it, is at most `accuracy`, and repeated smaller if not. With the
    same f, the steps are OpenSim's to the last bit.

    Args:
        f: derivative of the state. An ArithmeticError that it raises within a step makes the step smaller.
        t: initial time, s.
        y: initial state.
        nq: number of coordinates in it.
        nu: number of speeds after them; the rest are auxiliary states. By default all the rest are speeds.
        accuracy: as OpenSim's Manager and ForwardTool understand it, 1.
        maximum_step: s.
        minimum_step: s. The integrator refuses to go on where it needs a smaller one; Simbody takes the step
            then, whatever its error. Rounding sets a bound of about 1e-15 s in any case; OpenSim's tools use 1e-8.
        count_q: what the sum of the squared errors of q is divided by. Simbody counts all coordinates of a model,
            also locked and prescribed ones (their error is 0), and one more for each ball, free or ellipsoid
            joint: give that number where y leaves them out.
        count_u: the same for u, without the one more.
        observe: called with (time, state) after each step taken.
        names: what the entries of y are called in messages.
        projection: what moves the end of a step to where the constraints hold, to a tenth of the accuracy.

    Attributes:
        attempted: steps tried so far, of which `taken` were accepted.
    """

    def __init__(
        self,
        f: Derivative,
        t: float,
        y: Iterable[float],
        nq: int,
        *,
        nu: int | None = None,
        accuracy: float = DEFAULT_ACCURACY,
        maximum_step: float = inf,
        minimum_step: float = 0.0,
        count_q: int | None = None,
        count_u: int | None = None,
        observe: Observer | None = None,
        names: Sequence[str] | None = None,
        projection: Projection | None = None,
    ) -> None:
        if not 0.0 < accuracy < 1.0:
            raise SettingError(f"The accuracy must lie between 0 and 1; {accuracy} does not.")
        if not 0.0 <= minimum_step <= maximum_step or maximum_step == 0.0:
            raise SimulationError(
                f"The smallest step ({minimum_step} s) must not be negative nor exceed the largest ({maximum_step} s)."
            )
        super().__init__(f, t, y, observe, names)
        n = len(self.state)
        nu = n - nq if nu is None else nu
        if not 0 <= nq <= nq + nu <= n:
            raise ValueError(f"{nq} coordinates and {nu} speeds do not fit into {n} states")
        self._end_q = nq
        self._end_u = nq + nu
        self._count_q = nq if count_q is None else count_q
        self._count_u = nu if count_u is None else count_u
        self._accuracy = accuracy
        self._projection = projection
        self._maximum_step = maximum_step
        self._minimum_step = minimum_step
        self._next_step = min(max(INITIAL_STEP, minimum_step), maximum_step)
        self.attempted = 0

    @property
    def rejected(self) -> int:
        """Steps tried and not taken."""
        return self.attempted - self.taken

    def step(self, limit: float = inf) -> None:
        """Take one step of the size that the error allows, and choose the next one."""
        self._require_room(limit)
        f, t0, y0, f0 = self._f, self.time, self.state, self.derivative
        # Errors of speeds and auxiliary states count relative to their value at the start where that exceeds 1.
        weights = [1.0 / abs(x) if abs(x) > 1.0 else 1.0 for x in y0[self._end_q :]]
        smallest = max(self._minimum_step, 4.0 * _ROUNDING * max(1.0, abs(t0)))
        while True:
            h = self._next_step
            # A step that all but reaches the limit goes there. One cut much shorter tells nothing about the next.
            t1 = limit if limit <= t0 + 1.001 * h else t0 + h
            cut = limit < t0 + 0.95 * h
            self.attempted += 1
            self.evaluations += 4
            cause: ArithmeticError | None = None
            try:
                y1, companion = merson_step(f, t0, y0, f0, t1)
                # The fifth is taken of each entry, not of the norm: so every rounding is Simbody's, and its steps too.
                errors = [0.2 * (y - z) for y, z in zip(y1, companion, strict=True)]
                error = self._norm(errors, weights)
                # As in Simbody: what half a step would not mend, neither does the projection.
                if self._projection is not None and error <= 16.0 * self._accuracy:
                    y1, error = self._projected(t1, y1, errors, weights)
            except ArithmeticError as failure:
                error, cause = inf, failure
            self._next_step = min(next_step_size(h, error, self._accuracy, cut), self._maximum_step)
            if error <= self._accuracy:
                self._advance(t1, y1)
                return
            if h <= smallest:
                self._give_up(t1, error, weights, cause)
            self._next_step = max(self._next_step, smallest)

    def interpolant(self) -> Callable[[float], list[float]]:
        """The cubic Hermite polynomial through the ends of the last step, to where the constraints hold."""
        cubic = partial(_cubic, *self._previous, self.time, self.state, self.derivative)
        projection, tolerance = self._projection, self._accuracy / 10.0
        if projection is None:
            return cubic

        def held(t: float) -> list[float]:
            y = cubic(t)
            found = projection.project(t, y, None, tolerance)
            return y if found is None else found[0]

        return held

    def _projected(
        self, t1: float, y1: list[float], errors: list[float], weights: list[float]
    ) -> tuple[list[float], float]:
        """The end of the step where the constraints hold, and the norm of the error there."""
        assert self._projection is not None
        tolerance = self._accuracy / 10.0
        limit = max(2.0 * tolerance, sqrt(tolerance))
        found = self._projection.project(t1, y1, [abs(e) for e in errors], tolerance, limit)
        if found is None:
            return y1, inf
        y, rest = found
        assert rest is not None
        return y, self._norm(rest, weights)

    def _norm(self, error: list[float], weights: list[float]) -> float:
        """Largest of three root mean squares: errors of q as they are, of u and of z weighted."""
        nq, nu = self._end_q, self._end_u - self._end_q
        of_q = sum([e * e for e in error[:nq]]) / max(self._count_q, 1)
        weighted = [w * e for w, e in zip(weights, error[nq:], strict=True)]
        of_u = sum([e * e for e in weighted[:nu]]) / max(self._count_u, 1)
        of_z = sum([e * e for e in weighted[nu:]]) / max(len(weighted) - nu, 1)
        # The sum carries what is not a number; a comparison could lose it.
        return sqrt(max(of_q, of_u, of_z)) if isfinite(of_q + of_u + of_z) else inf

    def _give_up(self, t1: float, error: float, weights: list[float], cause: ArithmeticError | None) -> None:
        """Raise the error that tells why the smallest step fails."""
        t0, y0, f0 = self.time, self.state, self.derivative

        def finite(t: float, y: list[float]) -> Sequence[float]:
            derivative = self._f(t, y)
            self._refuse_non_finite(t, derivative)
            return derivative

        index = None
        if cause is None:
            y1, companion = merson_step(finite, t0, y0, f0, t1)
            weighted = [w * abs(y - z) for w, y, z in zip([1.0] * self._end_q + weights, y1, companion, strict=True)]
            index = max(range(len(weighted)), key=lambda i: weighted[i] if isfinite(weighted[i]) else inf)
            what = (
                f"misses the accuracy {error / self._accuracy:.3g} times, most of all in {self._name(index)}"
                if isfinite(weighted[index])
                else f"leaves the range of numbers in {self._name(index)}"
            )
        else:
            what = f"fails ({cause})"
        raise IntegrationError(
            f"The integrator cannot go on at t = {t0:.9g} s: even its smallest step of {t1 - t0:.3g} s {what}. "
            "Something changes too abruptly there, such as a very stiff contact or a sharp limit: soften it, or "
            "ask for less accuracy.",
            t0,
            index,
        ) from cause


def merson_step(
    f: Derivative, t0: float, y0: list[float], f0: Sequence[float], t1: float
) -> tuple[list[float], list[float]]:
    """One step of Merson's method from (t0, y0), where f0 = f(t0, y0), to t1 with four more calls of f.

    Returns:
        y1, of fourth order, and its companion: the estimated error is a fifth of their difference.
    """
    h = t1 - t0
    c = h / 3.0
    fa = f(t0 + c, [y + c * a for y, a in zip(y0, f0, strict=True)])
    c = h / 6.0
    fa = f(t0 + h / 3.0, [y + c * (a + b) for y, a, b in zip(y0, f0, fa, strict=True)])
    c = h / 8.0
    fb = f(t0 + h / 2.0, [y + c * (a + 3.0 * b) for y, a, b in zip(y0, f0, fa, strict=True)])
    c = h / 2.0
    companion = [y + c * (a - 3.0 * b + 4.0 * d) for y, a, b, d in zip(y0, f0, fa, fb, strict=True)]
    fa = f(t1, companion)
    c = h / 6.0
    return [y + c * (a + 4.0 * b + d) for y, a, b, d in zip(y0, f0, fb, fa, strict=True)], companion


def _cubic(
    t0: float, y0: list[float], f0: Sequence[float], t1: float, y1: list[float], f1: Sequence[float], t: float
) -> list[float]:
    h = t1 - t0
    s = (t - t0) / h
    b1 = s * s * (3.0 - 2.0 * s)
    b0 = 1.0 - b1
    c = h * s * (s - 1.0)
    c1 = c * s
    c0 = c1 - c
    return [b0 * y + b1 * z + c0 * f + c1 * g for y, z, f, g in zip(y0, y1, f0, f1, strict=True)]


def straight_line(t0: float, y0: list[float], t1: float, y1: list[float], t: float) -> list[float]:
    """State at time t on the straight line from y0 at t0 to y1 at t1."""
    s = (t - t0) / (t1 - t0)
    return [y + s * (z - y) for y, z in zip(y0, y1, strict=True)]


def next_step_size(h: float, error: float, accuracy: float, cut: bool = False) -> float:
    """Step to try after one of size h, as Simbody chooses it; less than h if and only if error > accuracy.

    The estimated error goes with h^4, so 0.9 h (accuracy / error)^(1/4) should just do. That is taken if it is at
    least a fifth more or, after a failure, a tenth less; never more than five times nor less than a tenth of h.

    Args:
        h: step just tried, s.
        error: norm of its estimated error; infinite or not a number after a failed evaluation.
        accuracy: what the error may be.
        cut: whether the step was cut short by a limit, so that it is no ground for a larger one.
    """
    if not isfinite(error):
        return 0.1 * h
    if error > accuracy:
        wanted: float = 0.9 * h * (accuracy / error) ** 0.25
        return max(min(wanted, 0.9 * h), 0.1 * h)
    wanted = 0.9 * h * (accuracy / error) ** 0.25 if error > 0.0 else inf
    return h if cut or wanted < 1.2 * h else min(wanted, 5.0 * h)
