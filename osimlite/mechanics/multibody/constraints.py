"""Constraints on coordinates, and the interface of all constraints.

A constraint forbids some of the motions that the joints allow. Constraints between bodies are in
:mod:`osimlite.mechanics.multibody.body_constraints`. The kernels compute the equations, see
:mod:`osimlite.mechanics.multibody.constraint_records`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Protocol

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.spatial import Array

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.kinematics import MechanismKinematics


class Equations(NamedTuple):
    """System of m equations at one state; the first p constrain positions.

    Speeds fulfil G u = b, and their derivatives G udot = c.
    """

    errors: Array  # errors of the positions (p,), whose rates are G u - b
    rows: Array  # G (m, n)
    rates: Array  # b (m,)
    drifts: Array  # c (m,)


class ConstraintEquations(Protocol):
    """Equations that coordinates, generalized speeds and their derivatives fulfil."""

    @property
    def bodies(self) -> tuple[int, ...]:
        """Indices of the bodies in the equations.

        Returns:
            Indices in the mechanism, -1 for ground.
        """

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Indices of the coordinates in the equations.

        Returns:
            Indices in the mechanism.
        """
        return ()

    @property
    def name(self) -> str:
        """Name of the constraint in messages."""

    def position_errors(self, state: MechanismKinematics) -> Array:
        """Return the errors of the positions (p,), which are zero where the constraint holds."""
        return state.equations(self).errors

    def velocity_equations(self, state: MechanismKinematics) -> tuple[Array, Array]:
        """Return the equations of the speeds.

        Returns:
            G (m, n) and b (m,) with G u = b; m > p if some equations constrain only the speeds.
        """
        equations = state.equations(self)
        return equations.rows, equations.rates

    def acceleration_equations(self, state: MechanismKinematics) -> tuple[Array, Array]:
        """Return the equations of the accelerations.

        Returns:
            G (m, n) and c (m,) with G udot = c.
        """
        equations = state.equations(self)
        return equations.rows, equations.drifts


@dataclass(frozen=True)
class CoordinateConstraint(ConstraintEquations):
    """Constraint on one coordinate, which involves no body directly."""

    bodies: ClassVar[tuple[int, ...]] = ()
    coordinate: int

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Index of the coordinate.

        Returns:
            Indices in the mechanism.
        """
        return (self.coordinate,)


@dataclass(frozen=True)
class Lock(CoordinateConstraint):
    """Constraint that keeps the value of one coordinate constant.

    It acts on the value of the coordinate, not on its speed: a locked angle of a ball joint does
    not change, whatever angular velocity this requires. Any value is accepted as long as it stays
    constant.
    """

    name: str = "lock"


@dataclass(frozen=True)
class PrescribedCoordinate(CoordinateConstraint):
    """Constraint that makes one coordinate follow a function of time (s).

    The error is the coordinate minus the function.
    """

    function: SmoothFunction
    name: str = "prescribed coordinate"


@dataclass(frozen=True)
class Coupler(ConstraintEquations):
    """Constraint that makes one coordinate a function of others.

    The error is the function minus the dependent coordinate.
    """

    bodies: ClassVar[tuple[int, ...]] = ()
    dependent: int
    independent: tuple[int, ...]
    function: SmoothFunction
    name: str = "coupler"

    @property
    def coordinates(self) -> tuple[int, ...]:
        """Indices of the independent coordinates, then of the dependent one.

        Returns:
            Indices in the mechanism.
        """
        return (*self.independent, self.dependent)
