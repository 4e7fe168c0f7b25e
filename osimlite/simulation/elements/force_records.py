"""What a force element is to the kernels: items, each with a kernel, integers, numbers and a record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.links import Places
from osimlite.simulation.states import StateVariable


class Response(NamedTuple):
    """How a force along one displacement changes with that: the kernel that finds its derivatives,
    the place among the item's integers of the first of those that say where its states are, their
    count, and -1 if it pulls, else 1.
    """

    kernel: str
    first_state: int
    states: int
    sense: int


CONTROLS = ""


@dataclass(frozen=True)
class ForceRecord:
    """One item."""

    # name of what computes it, see `law_function`; "" for one that only tells how another one
    # changes
    kernel: str = ""
    ints: tuple[int, ...] = ()  # of its own
    numbers: tuple[float, ...] = ()  # of its own
    room: int = 0  # length of its record, if it is not that of a contact
    is_contact: bool = False  # whether its record is that of a contact
    is_part: bool = False  # whether another item of the element calls its kernel
    # places among its integers where those of its element's states in y are put, in their order
    states: tuple[int, ...] = ()
    # which of its integers are places in the record of another element, which comes before, and the
    # path of that; or CONTROLS for the record of the controls
    looks_at: tuple[tuple[int, str], ...] = ()
    # name of the kernel that brings its states into equilibrium, if they have one
    equilibrium: str = ""
    response: Response | None = None  # of a force along one displacement
    abreast: str = (
        ""  # name of the kernel that computes several that follow one another, if there is one
    )
    # what computes it in place of a kernel, called with (model, reals, data, y, f, place of the
    # item) as arrays
    python: Callable[..., None] | None = None


class ForceElement(Protocol):
    """Anything that pushes bodies or coordinates."""

    @property
    def path(self) -> str:
        """Absolute path of the component."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Its auxiliary states."""

    def items(self, places: Places) -> list[ForceRecord]:
        """What the kernels compute."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of what :meth:`report` gives, as OpenSim's ForceReporter has them."""

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """One row of the columns.

        Args:
            records: of its items after an evaluation.
            origins: origin of each body in ground, m; ground's own last.
        """

    def energy(self, records: Sequence[Sequence[float]]) -> float:
        """Potential energy, J."""


class Silent:
    """An element that has no forces to report, and stores no energy."""

    columns: tuple[str, ...] = ()

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Nothing."""
        return []

    def energy(self, records: Sequence[Sequence[float]]) -> float:
        """None, J."""
        return 0.0
