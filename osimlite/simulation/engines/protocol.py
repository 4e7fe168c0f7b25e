"""What an engine is.

An engine integrates only the coordinates that are free to move, in an order of its own: its `state` tells what the
numbers of a state y = (q, u, z) are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

from osimlite.multibody.mechanism import Mechanism
from osimlite.records import dataclass
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.probe import DeclaredProbe
from osimlite.simulation.integrators import DEFAULT_ACCURACY, MERSON, NO_BOUNDS
from osimlite.simulation.kernels.pointers import Floats
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import Observer, Stepper

if TYPE_CHECKING:
    from osimlite.robot.visuals import Visuals


@dataclass(frozen=True)
class Settings:
    """How to step.

    Attributes:
        accuracy: as OpenSim understands it.
        integrator: with error control, see :class:`osimlite.simulation.Options`.
        fixed_step: s; the engine's own steps of this length instead of error control.
        route: the way to the accelerations, in the engine's words; "auto" lets it choose.
        show: whether to show the motion in a window while it is computed.
        visuals: what bodies look like there.
        step_bounds: shortest and longest step (s) of Merson's method; the shortest is taken whatever its error.
    """

    accuracy: float = DEFAULT_ACCURACY
    integrator: str = MERSON
    fixed_step: float | None = None
    route: str = "auto"
    show: bool = False
    visuals: Visuals | None = None
    step_bounds: tuple[float, float] = NO_BOUNDS


class Engine(Protocol):
    """Computes the motion of one mechanism under its forces. Close it after use, or use it in a ``with`` statement.

    Every method that takes a state raises an OsimliteError where it has another length than `state` says.

    Attributes:
        name: of the engine.
        version: of the program behind it.
        route: how the accelerations are computed.
        order: place in the mechanism of each coordinate of the state.
        state: what the numbers of a state are.
        contacts: names of the contacts, by number.
        columns: labels of the force records.
        probes: of the model.
        loads: after an evaluation: the last entry has the bits of the contacts that touch; entry i is the force (N,
            in ground) of contact i if it does.
    """

    name: str
    version: str
    route: str
    order: tuple[int, ...]
    state: StateLayout
    contacts: tuple[str, ...]
    columns: tuple[str, ...]
    probes: tuple[DeclaredProbe, ...]
    loads: list[object]

    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot, zdot) at a state.

        Raises:
            SimulationError: a motion that nothing forbids moves no mass, or speeds are not defined in a pose.
        """

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates of the mechanism, in its order; zero if locked.

        The auxiliary states are where they start.
        """

    def equilibrated(self, t: float, y: Sequence[float], numbers: Floats | None = None) -> list[float]:
        """A state with the auxiliary states that have an equilibrium in it.

        Args:
            t: time, s.
            y: the state.
            numbers: of a model of the same structure; the engine's own by default.

        Raises:
            SimulationError: a force has no equilibrium there.
        """

    def touching(self, t: float, y: list[float]) -> int:
        """The bits of the contacts that touch at a state; sets `loads`. Works when the engine is closed."""

    def force_records(self, t: float, y: list[float]) -> list[float]:
        """One number for each of the columns. Works when the engine is closed."""

    def probe_results(self, t: float, y: Sequence[float]) -> list[list[float]]:
        """What each probe gives at a state, before its operation. Works when the engine is closed."""

    def energies(self, t: float, y: list[float]) -> tuple[float, float, float]:
        """Kinetic energy, potential energy of gravity, energy stored in forces, J. Works when the engine is closed."""

    def stepper(self, t: float, y: list[float], settings: Settings, observe: Observer) -> Stepper:
        """What integrates from a state on."""

    def drive(self, controls: Controls) -> None:
        """Have the actuators driven by other controls of the same names, in what is computed from now on."""

    def hold(self) -> None:
        """Keep the window, if there is one, until somebody closes it."""

    def close(self) -> None:
        """Free what the engine holds; any number of times."""


EngineFactory = Callable[[Mechanism, Forces, Settings], Engine]
"""Makes an engine for a mechanism; of the settings, `route`, `show` and `visuals` count."""
