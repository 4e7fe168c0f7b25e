"""Runge-Kutta-Merson with Simbody's error control, the usual way to follow a motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import inf, isfinite, sqrt

from osimlite.errors import SettingError, SimulationError
from osimlite.simulation.stepper import Derivative, IntegrationError, Observer, Projection, Stepper

DEFAULT_ACCURACY = 1e-3
"""What OpenSim's Manager uses where no accuracy was set."""

INITIAL_STEP = 0.01
"""First step tried, s: a tenth of Simbody's default time scale."""


class RungeKuttaMerson(Stepper):
    """Simbody's RungeKuttaMerson, the default integrator of OpenSim: `accuracy` means what it means there.

    Merson's method propagates a fourth-order solution and estimates its error from an embedded third-order one
    (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, table 4.1). A step is taken
    if the norm of the error, as `_norm` forms it, is at most `accuracy`, and repeated smaller if not. With the
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
            then, whatever its error. OpenSim's tools use 1e-8.
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

    def step(self, limit: float = inf) -> None:
        """Take one step of the size that the error allows, and choose the next one."""
        self._require_room(limit)
        f, t0, y0, f0 = self._f, self.time, self.state, self.derivative
        # Errors of speeds and auxiliary states count relative to their value at the start where that exceeds 1.
        weights = [1.0 / abs(x) if abs(x) > 1.0 else 1.0 for x in y0[self._end_q :]]
        smallest = max(self._minimum_step, shortest_step(t0))
        while True:
            h = self._next_step
            # A step that all but reaches the limit goes there. One cut much shorter tells nothing about the next.
            t1 = limit if limit <= t0 + 1.001 * h else t0 + h
            cut = limit < t0 + 0.95 * h
            self.attempted += 1
            self.evaluations += 4
            cause: Exception | None = None
            try:
                y1, companion = merson_step(f, t0, y0, f0, t1)
                # The fifth is taken of each entry, not of the norm: so every rounding is Simbody's, and its steps too.
                errors = [0.2 * (y - z) for y, z in zip(y1, companion, strict=True)]
                error = self._norm(errors, weights)
                # As in Simbody: what half a step would not mend, neither does the projection.
                if self._projection is not None and error <= 16.0 * self._accuracy:
                    y1, error = self._projected(t1, y1, errors, weights)
            except (ArithmeticError, ValueError) as failure:
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

    def _give_up(self, t1: float, error: float, weights: list[float], cause: Exception | None) -> None:
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


def shortest_step(t: float) -> float:
    """The shortest step that moves the time t; as in Simbody, from 0 it may be of any length."""
    return max(2.0**-52 * abs(t), 1e-300)


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
