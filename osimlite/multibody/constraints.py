"""Constraints: what forbids some of the motions that the joints allow.

Here are those that speak of coordinates; those between bodies are in :mod:`osimlite.multibody.body_constraints`.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

import numpy as np

from osimlite.multibody.functions import Function
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass

if TYPE_CHECKING:
    from osimlite.multibody.kinematics import Kinematics


class Constraint(Protocol):
    """Equations that the coordinates, the generalized speeds and their derivatives fulfil."""

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the bodies that it speaks of; if there are none, states without bodies will do for it."""

    @property
    def name(self) -> str:
        """What the constraint is called in messages."""

    def position_errors(self, state: Kinematics) -> Array:
        """Return e (p,), which is zero where the constraint holds; its rate is G u - b of the first p rows below."""

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G u = b; m > p if some equations bind only the speeds."""

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G udot = b."""


class Bond(NamedTuple):
    """m equations at one state: `errors` e (m,) with edot = `rows` u - `rates` and eddot = `rows` udot - `drifts`."""

    errors: Array
    rows: Array
    rates: Array
    drifts: Array


class Bonded(Constraint):
    """A constraint that is one bond; unless `position_errors` says otherwise, all its equations bind positions."""

    @abstractmethod
    def bond(self, state: Kinematics) -> Bond:
        """The equations at one state."""

    def position_errors(self, state: Kinematics) -> Array:
        """How far the positions are off."""
        return self.bond(state).errors

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The errors do not change."""
        bond = self.bond(state)
        return bond.rows, bond.rates

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The rates of the errors do not change."""
        bond = self.bond(state)
        return bond.rows, bond.drifts


@dataclass(frozen=True)
class Lock:
    """Holds one coordinate where it is.

    It acts on the value of the coordinate, not on its speed: a locked angle of a ball joint stands still,
    whichever angular velocities that takes.
    """

    bodies: ClassVar[tuple[int, ...]] = ()
    coordinate: int
    name: str = "lock"

    def position_errors(self, state: Kinematics) -> Array:
        """Nothing: every value is right, as long as it stays."""
        return np.zeros(0)

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The rate of the coordinate is zero."""
        return self._row(state), np.zeros(1)

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The second derivative of the coordinate is zero."""
        return self._row(state), -state.mechanism.rate_bias(state.q, state.u)[[self.coordinate]]

    def _row(self, state: Kinematics) -> Array:
        return state.mechanism.rate_matrix(state.q)[[self.coordinate]]


@dataclass(frozen=True)
class Prescribed(Bonded):
    """Makes one coordinate follow a function of time (s)."""

    bodies: ClassVar[tuple[int, ...]] = ()
    coordinate: int
    function: Function
    name: str = "prescribed coordinate"

    def bond(self, state: Kinematics) -> Bond:
        """The coordinate minus the function."""
        value, first, second = self.function.evaluate(np.array((state.time,)))
        mechanism, own = state.mechanism, [self.coordinate]
        return Bond(
            state.q[own] - value,
            mechanism.rate_matrix(state.q)[own],
            first,
            second[0] - mechanism.rate_bias(state.q, state.u)[own],
        )


@dataclass(frozen=True)
class Coupler(Bonded):
    """Makes one coordinate a function of others."""

    bodies: ClassVar[tuple[int, ...]] = ()
    dependent: int
    independent: tuple[int, ...]
    function: Function
    name: str = "coupler"

    def bond(self, state: Kinematics) -> Bond:
        """The function minus the dependent coordinate."""
        mechanism, others = state.mechanism, list(self.independent)
        value, gradient, hessian = self.function.evaluate(state.q[others])
        rates = mechanism.coordinate_rates(state.q, state.u)[others]
        row = np.zeros((1, len(state.q)))
        np.add.at(row[0], others, gradient)
        row[0, self.dependent] -= 1.0
        return Bond(
            np.array((value - state.q[self.dependent],)),
            row @ mechanism.rate_matrix(state.q),
            np.zeros(1),
            -(row @ mechanism.rate_bias(state.q, state.u)) - rates @ hessian @ rates,
        )
