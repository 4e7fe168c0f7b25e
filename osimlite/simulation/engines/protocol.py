"""Protocol of the engines.

An engine integrates only the coordinates that are free to move, in its own order; its `state`
describes the entries of a state y = (q, u, z).
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
from osimlite.simulation.options import IntegrationOptions
from osimlite.simulation.states import StateLayout
from osimlite.simulation.stepper import Observer, Stepper

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import ControllerRuns
    from osimlite.simulation.robot.visuals import Visuals


@dataclass(frozen=True, kw_only=True)
class Settings(IntegrationOptions):
    """Settings of an engine and of one motion that it computes."""

    # length (s) of fixed steps, which replace error control
    fixed_step: float | None = None
    # how the accelerations are computed, in the engine's terms; "auto" lets it choose
    route: str = "auto"
    show: bool = False  # whether a window shows the motion meanwhile
    visuals: Visuals | None = None  # shapes of the bodies in the window
    held: ControllerRuns | None = None  # controllers of the runs


class Engine(Protocol):
    """Engine that computes the motion of one mechanism under its forces.

    Close it after use, or use it in a ``with`` statement. Methods that take a state raise an
    OsimliteError if its length differs from that of `state`.
    """

    name: str  # name of the engine
    version: str  # version of the program that computes
    route: str  # how the accelerations are computed
    order: tuple[int, ...]  # index in the mechanism of each coordinate of the state
    state: StateLayout  # layout of the state
    contacts: tuple[str, ...]  # names of the contacts, by index
    columns: tuple[str, ...]  # labels of the force records
    probes: tuple[DeclaredProbe, ...]  # probes of the model
    # contact forces of the last evaluation: entry i is the force (N, in ground) of contact i if it
    # touches; the last entry has one bit for each contact that touches
    loads: list[object]

    def compute_derivative(self, t: float, y: list[float]) -> list[float]:
        """Return (qdot, udot, zdot) at a state.

        Raises:
            SimulationError: an admissible motion moves no mass, or speeds are not defined in a
                pose.
        """

    def compute_accelerations(
        self, t: float, q: Sequence[float], u: Sequence[float]
    ) -> list[float]:
        """Return the derivatives of the speeds of all coordinates, in the mechanism's order; 0 if locked.

        The auxiliary states have their initial values.
        """

    def equilibrate_muscles(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> list[float]:
        """Return the state with auxiliary states in equilibrium.

        Args:
            t: time, s.
            y: state.
            numbers: numbers of a model of the same structure; by default the engine's.

        Raises:
            SimulationError: a force has no equilibrium there.
        """

    def find_touching_contacts(self, t: float, y: list[float]) -> int:
        """Return one bit for each contact that touches at a state, and set `loads`. Works after `close`."""

    def force_records(self, t: float, y: list[float]) -> list[float]:
        """Return one number for each of `columns`. Works after `close`."""

    def force_table(self, times: Sequence[float], states: Sequence[Sequence[float]]) -> Floats:
        """Return one row of `columns` for each state (k, c). Works after `close`."""

    def evaluate_probes(self, t: float, y: Sequence[float]) -> list[list[float]]:
        """Return the inputs of each probe at a state, before its operation. Works after `close`."""

    def compute_energies(self, t: float, y: Sequence[float]) -> tuple[float, float, float]:
        """Return the energies at a state. Works after `close`.

        Returns:
            Kinetic energy, potential energy of gravity, and energy stored in forces, J.
        """

    def make_stepper(
        self, t: float, y: list[float], settings: Settings, observe: Observer
    ) -> Stepper:
        """Return a stepper from a state on."""

    def set_controls(self, controls: Controls) -> None:
        """Set the controls of the actuators for all later evaluations and motions."""

    def hold_window(self) -> None:
        """Keep the window, if there is one, until the user closes it."""

    def close(self) -> None:
        """Free the resources of the engine; may be called repeatedly."""


EngineFactory = Callable[[Mechanism, Forces, Settings], Engine]
"""Function that makes an engine of a mechanism; it uses `route`, `show` and `visuals` of the settings."""
