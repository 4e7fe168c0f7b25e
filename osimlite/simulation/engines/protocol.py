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
class EngineSettings(IntegrationOptions):
    """Settings of an engine and of one motion that it computes.

    Attributes:
        fixed_step: length (s) of fixed steps, which replace error control.
        route: method that computes the accelerations, one of the engine's routes; "auto" lets the
            engine select it.
        show: whether a window shows the motion meanwhile.
        visuals: shapes of the bodies in the window.
        controller_runs: controllers of the runs.
    """

    fixed_step: float | None = None
    route: str = "auto"
    show: bool = False
    visuals: Visuals | None = None
    controller_runs: ControllerRuns | None = None


class Engine(Protocol):
    """Engine that computes the motion of one mechanism under its forces.

    Close it after use, or use it in a ``with`` statement. Methods that take a state raise an
    OsimliteError if its length differs from that of `state`.

    Attributes:
        name: name of the engine.
        version: version of the program that computes.
        route: method that computes the accelerations, one of the engine's routes.
        order: index in the mechanism of each coordinate of the state.
        state: layout of the state.
        contacts: names of the contacts, by index.
        columns: labels of the force records.
        probes: probes of the model.
        loads: contact forces of the last evaluation: entry i is the force (N, in ground) of contact
            i if it touches; the last entry has one bit for each contact that touches.
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

    def compute_derivative(self, t: float, y: list[float]) -> list[float]:
        """Return (qdot, udot, zdot) at a state.

        Args:
            t: time, s.
            y: state (y,).

        Raises:
            SimulationError: an admissible motion moves no mass, or speeds are not defined in a
                pose.
        """

    def compute_accelerations(
        self, t: float, q: Sequence[float], u: Sequence[float]
    ) -> list[float]:
        """Return the derivatives of the speeds of all coordinates.

        The auxiliary states have their initial values.

        Args:
            t: time, s.
            q: values (n,) in the mechanism's order.
            u: generalized speeds (n,).

        Returns:
            Accelerations (n,) in the mechanism's order; 0 for locked coordinates.
        """

    def equilibrate_muscles(
        self, t: float, y: Sequence[float], numbers: Floats | None = None
    ) -> list[float]:
        """Return a state with auxiliary states in equilibrium.

        Args:
            t: time, s.
            y: state (y,).
            numbers: numbers of a model of the same structure; by default the engine's.

        Returns:
            The state (y,).

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
        self, t: float, y: list[float], settings: EngineSettings, observe: Observer
    ) -> Stepper:
        """Return a stepper that continues from a state.

        Args:
            t: time, s.
            y: state (y,).
            settings: settings of the integration.
            observe: function that is called with time and state after each step.
        """

    def set_controls(self, controls: Controls) -> None:
        """Set the controls of the actuators for all later evaluations and motions.

        Args:
            controls: controls with the same names as those of the model.
        """

    def hold_window(self) -> None:
        """Keep the window, if there is one, until the user closes it."""

    def close(self) -> None:
        """Free the resources of the engine; may be called repeatedly."""


EngineFactory = Callable[[Mechanism, Forces, EngineSettings], Engine]
"""Function that makes an engine of a mechanism; it uses `route`, `show` and `visuals` of the settings."""
