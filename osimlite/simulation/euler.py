"""Semi-implicit Euler with a fixed step."""

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
    straight_line,
)

Projected = Callable[[float, list[float], float], list[float] | None]
FIXED_STEP_TOLERANCE = 1e-9
"""What constraints may be off after a fixed step, before they are mended."""


def burst(t: float, h: float) -> IntegrationError:
    """Why fixed steps of length h (s) cannot go on at time t (s)."""
    return IntegrationError(
        f"the motion bursts at t = {t:.9g} s; take a shorter fixed step than {h:g} s, "
        "or control the error (--accuracy)",
        t,
    )


class SemiImplicitEuler(Stepper):
    """Fixed steps u1 = u0 + h udot(t0, y0), q1 = q0 + h qdot(q0, u1), z1 = z0 + h zdot(t0, y0), with y = (q, u, z).

    That is of first order; PyBullet steps like that.

    Args: f: derivative of the state; the part of q is not used. t: initial time, s. y: initial
        state. nq: number of coordinates in it, and of speeds after them; the rest are auxiliary
        states. h: step, s. Only a step that would pass the limit is shortened. rates: qdot as a
        function of (q, u); by default qdot = u. observe: called with (time, state) after each step
        taken. names: what the entries of y are called in messages. projected: gives the state
        nearest to one where the constraints hold to a tolerance, if there is one.
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
        projected: Projected | None = None,
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
        """Take one step of the fixed size, or up to the limit if that comes first."""
        self._require_room(limit)
        h = self._h
        # Counted from an origin, so that rounding does not pile up in the time.
        self._since += 1
        t = self._origin + h * self._since
        if t > limit - 1e-9 * h:
            if t > limit + 1e-9 * h:
                h = limit - self.time
            t = limit
            self._origin, self._since = limit, 0
        y = self._moved(h)
        if self._projected is not None:
            result = self._projected(t, y, FIXED_STEP_TOLERANCE)
            if result is None:
                raise IntegrationError(
                    f"the constraints cannot be kept up at t = {t:.9g} s; take a shorter fixed step than {h:g} s, "
                    "or control the error (--accuracy)",
                    t,
                )
            y = result
        if not isfinite(sum(y)):
            raise burst(t, self._h)
        try:
            self._advance(t, y)
        except IntegrationError as error:
            raise IntegrationError(
                f"{error} If they are right, take a shorter fixed step than {self._h:g} s, or control the error "
                "(--accuracy).",
                t,
                error.index,
            ) from error

    def _moved(self, h: float) -> list[float]:
        """The state after a step of length h (s), wherever constraints hold."""
        q = self.state[: self._nq]
        rest = [
            x + h * a
            for x, a in zip(self.state[self._nq :], self.derivative[self._nq :], strict=True)
        ]
        u = rest[: self._nq]
        rates = u if self._rates is None else self._rates(q, u)
        return [x + h * v for x, v in zip(q, rates, strict=True)] + rest

    def interpolant(self) -> Callable[[float], list[float]]:
        """The straight line between the ends of the last step."""
        return partial(straight_line, *self.previous[:2], self.time, self.state)
