"""Records of force elements: the kernel, integers, numbers and output record of each computation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.links import LinkMap
from osimlite.simulation.states import StateVariable


class Response(NamedTuple):
    """Derivatives of a force along one displacement with respect to that displacement.

    Attributes:
        kernel: name of the kernel that computes the derivatives.
        first_state: index, among the record's integers, of the first offset of a state.
        states: number of states.
        sense: 1 if a positive force pushes along the displacement, -1 if it pulls against it.
    """

    kernel: str
    first_state: int
    states: int
    sense: int


CONTROLS = ""
"""Stands for the record of the controls in `ForceRecord.record_references`."""


@dataclass(frozen=True)
class ForceRecord:
    """One computation of an element, as the kernels see it.

    Attributes:
        kernel: name of the kernel, see `find_function`; "" for a record that only has a response.
        ints: integers behind those that every record has.
        numbers: parameters.
        record_size: size of the output record, unless it is a contact.
        is_contact: whether the output record is that of a contact.
        is_part: whether the kernel of another record calls its kernel.
        states: indices among its integers that receive the offsets of the element's states in y, in
            order.
        record_references: indices of integers that are offsets in the output record of an earlier
            element, with the path of that element, or CONTROLS for the record of the controls.
        equilibrium: name of the kernel that sets its states to equilibrium; "" without one.
        response: derivatives of a force along one displacement.
        batched: name of the kernel that computes several consecutive records; "" without one.
        python: Python function that replaces the kernel, with arguments (model, reals, data, y, f,
            offset of the record) as arrays.
    """

    kernel: str = ""
    ints: tuple[int, ...] = ()
    numbers: tuple[float, ...] = ()
    record_size: int = 0
    is_contact: bool = False
    is_part: bool = False
    states: tuple[int, ...] = ()
    record_references: tuple[tuple[int, str], ...] = ()
    equilibrium: str = ""
    response: Response | None = None
    batched: str = ""
    python: Callable[..., None] | None = None


class ForceElement(Protocol):
    """Element of a model with states and records of the kernels: a force or a probe."""

    @property
    def path(self) -> str:
        """Absolute path of the component."""

    @property
    def name(self) -> str:
        """Name of the component, without its parents."""

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Auxiliary states of the element, in the order of their offsets.

        Returns:
            One entry for each state.
        """

    def make_records(self, link_map: LinkMap) -> list[ForceRecord]:
        """Return the records that the kernels compute.

        Args:
            link_map: placement of the bodies in the links of the tree.
        """

    @property
    def columns(self) -> tuple[str, ...]:
        """Labels of the values of :meth:`report`, as OpenSim's ForceReporter writes them.

        Returns:
            One label for each value.
        """

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return one row of the columns.

        Args:
            records: output records of the force after an evaluation.
            origins: origin of each body in ground, m; the last one is that of ground.

        Returns:
            One number for each of `columns`, SI units.
        """

    def find_copied_offsets(self) -> Sequence[int] | None:
        """Return the offsets in the last record that :meth:`report` copies.

        With them, tables copy complete columns.

        Returns:
            One offset for each of `columns`; None if `report` computes numbers.
        """

    def compute_energy(self, records: Sequence[Sequence[float]]) -> float:
        """Return the potential energy of the force.

        Args:
            records: output records of the force after an evaluation.

        Returns:
            Energy, J.
        """


class Silent:
    """Base of elements that report no forces and store no energy."""

    columns: tuple[str, ...] = ()

    def report(
        self, records: Sequence[Sequence[float]], origins: Sequence[Sequence[float]]
    ) -> list[float]:
        """Return an empty row, since there are no columns."""
        return []

    def find_copied_offsets(self) -> Sequence[int] | None:
        """Return no offsets, since there are no columns."""
        return ()

    def compute_energy(self, records: Sequence[Sequence[float]]) -> float:
        """Return 0 J, since nothing is stored."""
        return 0.0
