"""Semi-implicit Euler steps of fixed length."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from math import inf, isfinite

from osimlite.errors import SettingError
from osimlite.simulation.stepper import (
    Derivative,
    IntegrationError,
    Observer,
    Stepper,
    interpolate_linearly,
)

Projection = Callable[[float, list[float], float], list[float] | None]
"""Function of time, state and tolerance that returns the nearest state that fulfils the constraints, or None."""
FIXED_STEP_TOLERANCE = 1e-9
"""Largest error of the constraints after a fixed step before the state is projected onto them."""


def make_divergence_error(t: float, h: float) -> IntegrationError:
    """Return the error for fixed steps that diverge.

    Args:
        t: time at the end of the step that is not finite, s.
        h: length of the steps, s.
    """
    return IntegrationError(
        f"the motion diverges at t = {t:.9g} s; use a shorter fixed step than {h:g} s, "
        "or control the error (--accuracy, accuracy=)",
        t,
    )


class SemiImplicitEuler(Stepper):
    """Stepper with fixed steps of the semi-implicit Euler method.

    With y = (q, u, z), a step is u1 = u0 + h udot(t0, y0), q1 = q0 + h qdot(q0, u1), z1 = z0 + h
    zdot(t0, y0). The method is of first order; PyBullet uses it too.

    Args:
        f: derivative of the state; its part qdot is not used.
        t: initial time, s.
        y: initial state.
        nq: number of coordinates in the state, which as many speeds follow; the rest are auxiliary
            states.
        h: step, s. Only a step that would pass the limit is shortened.
        rates: qdot as a function of (q, u); by default qdot = u.
        observe: function that is called with time and state after each step.
        names: names of the entries of y in messages.
        projected: projection of states onto the constraints; None without constraints.
    """

    def __init__(
        self,
        f: Derivative,
        t: float,
        y: Iterable[float],
        nq: int,
        h: float,
        *,
        rates: Callable[[list[float], list[float]], Sequence[float]] | None = None,
        observe: Observer | None = None,
        names: Sequence[str] | None = None,
        projected: Projection | None = None,
    ) -> None:
        if not 0.0 < h < inf:
            raise SettingError(f"The fixed step must be positive and finite; {h} s is not.")
        super().__init__(f, t, y, observe, names)
        if len(self.state) < 2 * nq:
            raise ValueError(
                f"{nq} coordinates and as many speeds do not fit into {len(self.state)} states"
            )
        self._nq = nq
        self._h = h
        self._rates = rates
        self._projected = projected
        self._origin, self._since = t, 0

    def step(self, limit: float = inf) -> None:
        """Take one step of the fixed length, or up to the limit if that comes first.

        Args:
            limit: latest end of the step, s.

        Raises:
            IntegrationError: the state is not finite, a derivative cannot be computed, or no state
            near the end of the step fulfils the constraints.
        """  # noqa: DOC501 - a function makes the IntegrationError
        self._require_later(limit)
        h = self._h
        # Steps are counted from an origin, so that rounding errors of the time do not accumulate.
        self._since += 1
        t = self._origin + h * self._since
        # A step that ends within rounding of the limit ends at the limit, so that no tiny step
        # follows.
        if t > limit - 1e-9 * h:
            if t > limit + 1e-9 * h:
                h = limit - self.time
            t = limit
            self._origin, self._since = limit, 0
        y = self._take_step(h)
        if self._projected is not None:
            result = self._projected(t, y, FIXED_STEP_TOLERANCE)
            if result is None:
                raise IntegrationError(
                    f"the constraints cannot be enforced at t = {t:.9g} s; use a shorter fixed step than {h:g} s, "
                    "or control the error (--accuracy, accuracy=)",
                    t,
                )
            y = result
        # One sum instead of a test of each entry: a NaN or an infinity survives addition.
        if not isfinite(sum(y)):
            raise make_divergence_error(t, self._h)
        try:
            self._accept_step(t, y)
        except IntegrationError as error:
            raise IntegrationError(
                f"{error} If all of these are correct, use a shorter fixed step than {self._h:g} s, or control the error "
                "(--accuracy, accuracy=).",
                t,
                error.index,
            ) from error

    def _take_step(self, h: float) -> list[float]:
        """Return the state after a step of length h (s), before constraints are enforced."""
        q = self.state[: self._nq]
        speeds_and_auxiliary = [
            x + h * a
            for x, a in zip(self.state[self._nq :], self.derivative[self._nq :], strict=True)
        ]
        # The new speeds move the coordinates. That makes the method semi-implicit: it keeps the
        # energy of oscillators bounded, which explicit Euler steps do not.
        u = speeds_and_auxiliary[: self._nq]
        rates = u if self._rates is None else self._rates(q, u)
        return [x + h * v for x, v in zip(q, rates, strict=True)] + speeds_and_auxiliary

    def make_interpolant(self) -> Callable[[float], list[float]]:
        """Return the linear interpolation between the ends of the last step."""
        return partial(interpolate_linearly, *self.previous[:2], self.time, self.state)
