"""Constraints: what forbids some of the motions that the joints allow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from osimlite.multibody.kinematics import Kinematics
from osimlite.multibody.spatial import Array


class Constraint(Protocol):
    """Equations that the generalized speeds and their derivatives fulfil."""

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G u = b."""

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """Return G (m, n) and b (m,) with G udot = b."""


@dataclass(frozen=True)
class Lock:
    """Holds one coordinate where it is.

    It acts on the value of the coordinate, not on its speed: a locked angle of a ball joint stands still,
    whichever angular velocities that takes.
    """

    coordinate: int

    def velocity_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The rate of the coordinate is zero."""
        return self._row(state), np.zeros(1)

    def acceleration_equations(self, state: Kinematics) -> tuple[Array, Array]:
        """The second derivative of the coordinate is zero."""
        return self._row(state), -state.mechanism.rate_bias(state.q, state.u)[[self.coordinate]]

    def _row(self, state: Kinematics) -> Array:
        return state.mechanism.rate_matrix(state.q)[[self.coordinate]]
