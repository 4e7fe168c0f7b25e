"""Many motions in one call: the interface of engines that compute batches, and their results.

A batch has W runs of models of one structure. Each run starts from a state in the engine's order
(:class:`osimlite.simulation.states.StateLayout`), and may have its own numbers of the model. Every
run takes its own steps, and its result depends neither on the other runs nor on the number of
threads. It ends at its time, where a watch stops it, or where it cannot continue (`ENDINGS`). It
records states at the report times, events (contacts that begin and end, levels that are passed) and
the largest forces: `Runs`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.records import dataclass, field
from osimlite.errors import SettingError
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.schema.base import Component
from osimlite.schema.model import Model
from osimlite.simulation.elements import Forces
from osimlite.simulation.elements.builder import OPENSIM
from osimlite.simulation.engines.protocol import Engine
from osimlite.simulation.options import IntegrationOptions

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import KernelController


__all__ = [
    "ENDINGS",
    "BatchEngine",
    "BatchOptions",
    "ModelUpdater",
    "Runs",
    "UpdatedModel",
    "Watch",
    "run_many",
]

UNLIMITED_TRIES = 2**62
"""Number of attempted steps that no run reaches."""

ENDINGS = {0: "done", 1: "failed", 3: "stopped", 4: "too many steps"}
"""Descriptions of how a run ended: at its time, without a possible next step, at a watch, or after
the allowed number of attempted steps.
"""


@dataclass(frozen=True, kw_only=True)
class BatchOptions(IntegrationOptions):
    """Options of a batch, besides those of its integration."""

    to: float = 2.0  # end of the runs unless a watch stops them, s
    report_times: Sequence[float] = ()  # increasing times at which states are recorded, s
    watches: Sequence[Watch] = ()  # events besides the begin and end of contacts
    most_events: int = 0  # largest number of recorded events of a run; later ones are dropped
    event_states: bool = False  # whether states at events are recorded
    most_tries: int = UNLIMITED_TRIES  # largest number of attempted steps of a run
    threads: int | None = None  # number of threads; by default one for each core
    # controllers of the runs; the last function of each of their controls is a constant
    held: Sequence[KernelController] = ()

    def check(self) -> None:
        """Check the values, since machine code might never end with wrong ones.

        Raises:
            SettingError: a value has no meaning.
        """
        self.check_integration()
        if not self.to >= 0.0:
            raise SettingError(f"the runs end at a time that is not negative, not at {self.to} s")
        if not all(one <= other for one, other in pairwise([0.0, *self.report_times])):
            raise SettingError("the report times do not increase from 0 on; sort them")
        for number, least, what in (
            (1 if self.threads is None else self.threads, 1, "threads"),
            (self.most_events, 0, "most_events"),
            (self.most_tries, 0, "most_tries"),
        ):
            if number < least:
                raise SettingError(f"{what} is at least {least}, not {number}")


class BatchEngine(Engine, Protocol):
    """An engine that computes many motions in one call."""

    mechanism: Mechanism  # mechanism of the model
    forces: Forces  # forces of the model
    # integers that describe topology; equal for models that differ in numbers only
    structure: Ints
    numbers: Floats  # all numbers of the model (m,)

    def run_many(
        self, states: ArrayLike, options: BatchOptions, numbers: ArrayLike | None = None
    ) -> Runs:
        """Compute a batch; see :func:`run_many`."""

    def locate_contacts(
        self, states: ArrayLike, numbers: ArrayLike | None = None, rows: ArrayLike | None = None
    ) -> Floats:
        """Return the surfaces of all contacts: centre and normal of surface 1, and centre of surface 2, in ground (k, P, 9), m.

        Args:
            states: states (k, y).
            numbers: numbers of models of the same structure (v, m); by default the engine's.
            rows: row of `numbers` for each state (k,); by default the first.
        """

    def get_contact_radii(self, numbers: ArrayLike | None = None) -> Floats:
        """Return the radius of surface 2 of each contact for each row of numbers (v, P), m."""

    def make_updater(self, model: Model, folder: Path, wrapping: str = OPENSIM) -> ModelUpdater:
        """Return an object that updates the engine after numbers of its model have changed.

        Args:
            model: the engine's model, whose numbers will change.
            folder: folder of its file.
            wrapping: how paths wrap, see :class:`osimlite.simulation.Options`.
        """


@dataclass(frozen=True)
class UpdatedModel:
    """A model of which only numbers have changed."""

    mechanism: Mechanism  # mechanism of the model
    forces: Forces  # forces of the model
    numbers: Floats  # numbers of the model, see `BatchEngine.numbers` (m,)
    given: Any  # engine of the model before the change

    def make_engine(self) -> Any:
        """Return an engine with these numbers."""
        return self.given.copy_with_numbers(self.mechanism, self.forces, self.numbers)


class ModelUpdater(Protocol):
    """Updater of the parts of a model that forces, masses and gravity affect."""

    def update(self, owners: Sequence[Component]) -> UpdatedModel | None:
        """Return the model with the present properties of its forces and bodies; None if more than numbers changed.

        Args:
            owners: forces, controllers, bodies and the model itself, if one of their properties has
                changed.
        """


def run_many(
    engine: BatchEngine,
    states: ArrayLike,
    to: float = 2.0,
    *,
    numbers: ArrayLike | None = None,
    **choices: Any,
) -> Runs:
    """Simulate from many states.

    Args:
        engine: engine of the model.
        states: initial states (W, y) in the engine's order.
        to: end of the runs unless a watch stops them, s.
        numbers: `engine.numbers` of models of the same structure, one row for each run; by default
            the engine's.
        choices: attributes of :class:`BatchOptions`.

    Raises:
        SettingError: a value has no meaning.
        OsimliteError: shapes do not fit, or a watch names nothing or a locked coordinate.
        ModelError: a watch names something that does not exist.
    """
    return engine.run_many(states, BatchOptions(to=to, **choices), numbers)


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Watch(NamedTuple):
    """Event at which a coordinate, a point of a body or a contact passes a level."""

    name: str  # name of the event
    # Exactly one of coordinate, body and contact is set.
    coordinate: str = ""  # name or path of a coordinate
    body: str = ""  # name or path of a body or frame with a point
    station: tuple[float, float, float] = (0.0, 0.0, 0.0)  # the point in the frame, m
    # direction in ground along which the position of the point is measured
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)
    level: float = 0.0  # level, rad or m
    stops: int = 0  # -1 if falling below ends the run, 1 if rising above does, 0 if neither
    # name of a contact, one of the engine's `contacts`; it is above its level while it touches
    contact: str = ""


@dataclass(frozen=True)
class Runs:
    """Results of W runs whose states have y entries."""

    times: Floats  # times at which the runs ended (W,), s
    states: Floats  # states at the end (W, y), in the engine's order
    endings: Ints  # how each run ended, see `ENDINGS` (W,)
    counts: Ints  # accepted steps, attempted steps, evaluations (W, 3)
    reports: Floats  # states at the report times (W, r, y); NaN after the end of a run
    # events of each run in order of time: time (s), name, whether it begins or rises
    events: list[list[tuple[float, str, bool]]]
    peaks: (
        Floats  # largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2)
    )
    # states at the events of each run (as many as events, y), if recorded
    event_states: list[Floats] = field(default_factory=list)

    def select(self, places: Sequence[int] | Ints) -> Runs:
        """Return some of the runs, by their indices."""
        chosen: dict[str, Any] = {}
        for name, rows in vars(self).items():
            chosen[name] = (
                rows[places]
                if isinstance(rows, np.ndarray)
                else [rows[place] for place in places if rows]
            )
        return Runs(**chosen)
