"""What an engine is.

An engine integrates only the coordinates that are free to move: a state is one list y = (q, u), first their values,
then their generalized speeds, in an order of its own, `order`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from osimlite.multibody.mechanism import Mechanism
from osimlite.simulation.elements import Forces
from osimlite.simulation.integrators import DEFAULT_ACCURACY
from osimlite.simulation.stepper import Observer, Stepper

if TYPE_CHECKING:
    from osimlite.robot.visuals import Visuals


@dataclass(frozen=True)
class Settings:
    """How to step.

    Attributes:
        accuracy: as OpenSim understands it.
        fixed_step: s; the engine's own steps of this length instead of error control.
        route: the way to the accelerations, in the engine's words; "auto" lets it choose.
        show: whether to show the motion in a window while it is computed.
        visuals: what bodies look like there.
    """

    accuracy: float = DEFAULT_ACCURACY
    fixed_step: float | None = None
    route: str = "auto"
    show: bool = False
    visuals: Visuals | None = None


class Engine(Protocol):
    """Computes the motion of one mechanism under its forces. Close it after use, or use it in a ``with`` statement.

    Attributes:
        name: of the engine.
        version: of the program behind it.
        route: how the accelerations are computed.
        order: place in the mechanism of each coordinate of the state.
        contacts: names of the contacts, by number.
        columns: labels of the force records.
        loads: after an evaluation: the last entry has the bits of the contacts that touch; entry i is the force (N,
            in ground) of contact i if it does.
    """

    name: str
    version: str
    route: str
    order: tuple[int, ...]
    contacts: tuple[str, ...]
    columns: tuple[str, ...]
    loads: list[object]

    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot) at a state.

        Raises:
            SimulationError: a motion that nothing forbids moves no mass, or speeds are not defined in a pose.
        """

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates of the mechanism, in its order; zero if locked."""

    def touching(self, t: float, y: list[float]) -> int:
        """The bits of the contacts that touch at a state; sets `loads`. Works when the engine is closed."""

    def force_records(self, t: float, y: list[float]) -> list[float]:
        """One number for each of the columns. Works when the engine is closed."""

    def energies(self, t: float, y: list[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J. Works when the engine is closed."""

    def stepper(self, t: float, y: list[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on."""

    def close(self) -> None:
        """Free what the engine holds; any number of times."""


EngineFactory = Callable[[Mechanism, Forces, Settings], Engine]
"""Makes an engine for a mechanism; of the settings, `route`, `show` and `visuals` count."""


class FreeState:
    """The part of a mechanism's state that an engine integrates: y = (q, u), which auxiliary states may follow.

    Args:
        mechanism: whose state.
        order: place in the mechanism of each coordinate that is not locked.
    """

    def __init__(self, mechanism: Mechanism, order: Sequence[int]) -> None:
        self.order = tuple(order)
        self._q = [info.default_value for info in mechanism.coordinates]

    def pack(self, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """y = (q, u) of the free coordinates, from all coordinates."""
        return [float(q[place]) for place in self.order] + [float(u[place]) for place in self.order]

    def spread(self, values: Sequence[float], still: Sequence[float]) -> list[float]:
        """Numbers of the free coordinates put at their places among those of all, the rest from `still`."""
        row = list(still)
        for place, value in zip(self.order, values, strict=True):
            row[place] = value
        return row

    def values(self, y: Sequence[float]) -> list[float]:
        """Values of all coordinates, in the mechanism's order."""
        return self.spread(y[: len(self.order)], self._q)

    def histories(self, states: Sequence[Sequence[float]]) -> tuple[Any, Any]:
        """Values and speeds (k, n) of all coordinates at k states."""
        rows, count = np.array(states, dtype=float).reshape(len(states), -1), len(self.order)
        values, speeds = np.empty((len(states), len(self._q))), np.zeros((len(states), len(self._q)))
        values[:] = self._q
        values[:, self.order], speeds[:, self.order] = rows[:, :count], rows[:, count : 2 * count]
        return values, speeds

    def speeds(self, y: Sequence[float]) -> list[float]:
        """Generalized speeds of all coordinates, in the mechanism's order."""
        count = len(self.order)
        return self.spread(y[count : 2 * count], [0.0] * len(self._q))
