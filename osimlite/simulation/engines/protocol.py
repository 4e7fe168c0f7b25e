"""What an engine is.

An engine integrates only the coordinates that are free to move, in an order of its own: its `state`
tells what the numbers of a state y = (q, u, z) are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.pointers import Floats
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.controls import Controls
from osimlite.simulation.elements.probe_type import DeclaredProbe
from osimlite.simulation.options import DEFAULT_ACCURACY, MERSON, NO_BOUNDS
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import Observer, Stepper

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import HeldRuns
    from osimlite.simulation.robot.visuals import Visuals


@dataclass(frozen=True)
class Settings:
    """How to step."""

    accuracy: float = DEFAULT_ACCURACY  # as OpenSim understands it
    integrator: str = MERSON  # with error control, see `Options`
    # s; the engine's own steps of this length instead of error control
    fixed_step: float | None = None
    # the way to the accelerations, in the engine's words; "auto" lets it choose
    route: str = "auto"
    show: bool = False  # whether to show the motion in a window while it is computed
    visuals: Visuals | None = None  # what bodies look like there
    # shortest and longest step (s) of Merson's method; the shortest is taken whatever its error
    step_bounds: tuple[float, float] = NO_BOUNDS
    held: HeldRuns | None = None  # of a controller


class Engine(Protocol):
    """Computes the motion of one mechanism under its forces. Close it after use, or use it in a ``with`` statement.

    Every method that takes a state raises an OsimliteError where it has another length than `state`
    says.
    """

    name: str  # of the engine
    version: str  # of the program behind it
    route: str  # how the accelerations are computed
    order: tuple[int, ...]  # place in the mechanism of each coordinate of the state
    state: StateLayout  # what the numbers of a state are
    contacts: tuple[str, ...]  # names of the contacts, by number
    columns: tuple[str, ...]  # labels of the force records
    probes: tuple[DeclaredProbe, ...]  # of the model
    # after an evaluation: the last entry has the bits of the contacts that touch; entry i is the
    # force (N, in ground) of contact i if it does
    loads: list[object]

    def derivative(self, t: float, y: list[float]) -> list[float]:
        """(qdot, udot, zdot) at a state.

        Raises: SimulationError: a motion that nothing forbids moves no mass, or speeds are not
            defined in a pose.
        """

    def acceleration(self, t: float, q: Sequence[float], u: Sequence[float]) -> list[float]:
        """Derivatives of the speeds of all coordinates of the mechanism, in its order; zero if locked.

        The auxiliary states are where they start.
        """

    def equilibrated(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> list[float]:
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

    def force_table(self, times: Sequence[float], states: Sequence[Sequence[float]]) -> Floats:
        """Return one row of the columns for each moment (k, c). Works when the engine is closed."""

    def probe_results(self, t: float, y: Sequence[float]) -> list[list[float]]:
        """What each probe gives at a state, before its operation. Works when the engine is closed."""

    def energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
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
