"""Constraints: what forbids some of the motions that the joints allow.

Here are those that speak of coordinates; those between bodies are in
:mod:`osimlite.mechanics.multibody.body_constraints`. The kernels have their equations, see
:mod:`osimlite.mechanics.multibody.constraint_records`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.kinematics import Kinematics


class Equations(NamedTuple):
    """m equations at one state, of which the first p bind positions: G u = b for speeds, G udot = c for their rates."""

    errors: Array  # of positions (p,); their rates are G u - b
    rows: Array  # G (m, n)
    rates: Array  # b (m,)
    drifts: Array  # c (m,)


class Constraint(Protocol):
    """Equations that the coordinates, the generalized speeds and their derivatives fulfil."""

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the bodies that it speaks of."""

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Indices of the coordinates that it speaks of."""
        return ()

    @property
    def name(self) -> str:
        """What the constraint is called in messages."""

    def position_errors(self, state: Kinematics) -> Array:
        """Return e (p,), which is zero where the constraint holds; its rate is G u - b of the first p rows below."""
        return state.equations(self).errors

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G u = b; m > p if some equations bind only the speeds."""
        equations = state.equations(self)
        return equations.rows, equations.rates

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G udot = b."""
        equations = state.equations(self)
        return equations.rows, equations.drifts


@dataclass(frozen=True)
class Lock(Constraint):
    """Holds one coordinate where it is.

    It acts on the value of the coordinate, not on its speed: a locked angle of a ball joint stands
    still, whichever angular velocities that takes. Every value is right, as long as it stays.
    """

    bodies: ClassVar[tuple[int, ...]] = ()
    coordinate: int
    name: str = "lock"

    @property
    def coordinates(self) -> tuple[int, ...]:
        """The one that is locked."""
        return (self.coordinate,)


@dataclass(frozen=True)
class Prescribed(Constraint):
    """Makes one coordinate follow a function of time (s): the error is the coordinate minus the function."""

    bodies: ClassVar[tuple[int, ...]] = ()
    coordinate: int
    function: Function
    name: str = "prescribed coordinate"

    @property
    def coordinates(self) -> tuple[int, ...]:
        """The one that is prescribed."""
        return (self.coordinate,)


@dataclass(frozen=True)
class Coupler(Constraint):
    """Makes one coordinate a function of others: the error is the function minus the dependent coordinate."""

    bodies: ClassVar[tuple[int, ...]] = ()
    dependent: int
    independent: tuple[int, ...]
    function: Function
    name: str = "coupler"

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Those that others follow, and the one that follows."""
        return (*self.independent, self.dependent)
