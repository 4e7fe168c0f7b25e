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
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.named_tuples import NamedTuple
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

# It fits the 64-bit integers of the machine code.
UNLIMITED_TRIES = 2**62
"""Number of attempted steps that no run reaches."""

ENDINGS = {0: "done", 1: "failed", 3: "stopped", 4: "too many steps"}
"""Descriptions of how a run ended: at its time, without a possible next step, at a watch, or after
the allowed number of attempted steps.
"""


@dataclass(frozen=True, kw_only=True)
class BatchOptions(IntegrationOptions):
    """Options of a batch, besides those of its integration.

    Attributes:
        to: end of the runs unless a watch stops them, s.
        report_times: increasing times at which states are recorded, s.
        watches: events besides the begin and end of contacts.
        most_events: largest number of recorded events of a run; later ones are dropped.
        event_states: whether states at events are recorded.
        most_tries: largest number of attempted steps of a run.
        threads: number of threads; by default one for each core.
        controllers: controllers of the runs; the last function of each of their controls is a constant.
    """

    to: float = 2.0
    report_times: Sequence[float] = ()
    watches: Sequence[Watch] = ()
    most_events: int = 0
    event_states: bool = False
    most_tries: int = UNLIMITED_TRIES
    threads: int | None = None
    controllers: Sequence[KernelController] = ()

    def check(self) -> None:
        """Check the values, since machine code might never end with wrong ones.

        Raises:
            SettingError: a value has no meaning.
        """
        self.check_integration()
        # Written so that NaN is refused too.
        if not self.to >= 0.0:
            raise SettingError(f"the runs must end at 0 s or later, not at {self.to} s")
        # The pairs begin at 0 s, since no report is before the start.
        if not all(earlier <= later for earlier, later in pairwise([0.0, *self.report_times])):
            raise SettingError(
                "the report times must not decrease, and must begin at 0 s or later; sort or correct them"
            )
        for number, least, option in (
            (1 if self.threads is None else self.threads, 1, "threads"),
            (self.most_events, 0, "most_events"),
            (self.most_tries, 0, "most_tries"),
        ):
            if number < least:
                raise SettingError(f"{option} must be at least {least}, not {number}")


class BatchEngine(Engine, Protocol):
    """Engine that computes many motions in one call.

    Attributes:
        mechanism: mechanism of the model.
        forces: forces of the model.
        structure: integers that describe topology; equal for models that differ in numbers only.
        numbers: all numbers of the model (m,).
    """

    mechanism: Mechanism
    forces: Forces
    structure: Ints
    numbers: Floats

    def run_many(
        self, states: ArrayLike, options: BatchOptions, numbers: ArrayLike | None = None
    ) -> Runs:
        """Compute a batch; see :func:`run_many`."""

    def locate_contacts(
        self, states: ArrayLike, numbers: ArrayLike | None = None, rows: ArrayLike | None = None
    ) -> Floats:
        """Return the surfaces of all contacts.

        Args:
            states: states (k, y).
            numbers: numbers of models of the same structure (v, m); by default the engine's.
            rows: row of `numbers` for each state (k,); by default the first.

        Returns:
            Centre and normal of surface 1 and centre of surface 2, in ground (k, P, 9), m.
        """

    def get_contact_radii(self, numbers: ArrayLike | None = None) -> Floats:
        """Return the radius of surface 2 of each contact.

        Args:
            numbers: numbers of models of the same structure (v, m); by default the engine's.

        Returns:
            Radii (v, P), m.
        """

    def make_updater(self, model: Model, folder: Path, wrapping: str = OPENSIM) -> ModelUpdater:
        """Return an object that updates the engine after numbers of its model have changed.

        Args:
            model: the engine's model, whose numbers will change.
            folder: folder of the model's file.
            wrapping: method of wrapping, see :class:`osimlite.simulation.Options`.
        """


@dataclass(frozen=True)
class UpdatedModel:
    """Model that differs from another one in numbers only.

    Attributes:
        mechanism: mechanism of the model.
        forces: forces of the model.
        numbers: numbers of the model, see `BatchEngine.numbers` (m,).
        engine: engine of the model before the change.
    """

    mechanism: Mechanism
    forces: Forces
    numbers: Floats
    engine: Any

    def make_engine(self) -> Any:
        """Return an engine with these numbers."""
        return self.engine.copy_with_numbers(self.mechanism, self.forces, self.numbers)


class ModelUpdater(Protocol):
    """Updater of the parts of a model that forces, masses and gravity affect."""

    def update(self, owners: Sequence[Component]) -> UpdatedModel | None:
        """Return the model with the present properties of its forces and bodies.

        Args:
            owners: forces, controllers, bodies and the model itself, if one of their properties has
                changed.

        Returns:
            The changed model; None if more than numbers changed, so that it must be prepared anew.
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

    Returns:
        The results of all runs, in the order of the states.

    Raises:
        SettingError: a value has no meaning.
        OsimliteError: shapes do not fit, or a watch names nothing or a locked coordinate.
        ModelError: a watch names something that does not exist.
    """
    return engine.run_many(states, BatchOptions(to=to, **choices), numbers)


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Watch(NamedTuple):
    """Event at which a coordinate, a point of a body or a contact passes a level.

    Exactly one of `coordinate`, `body` and `contact` is set.

    Attributes:
        name: name of the event.
        coordinate: name or path of a coordinate.
        body: name or path of a body or frame with a point.
        station: the point in the frame, m.
        direction: direction in ground along which the position of the point is measured.
        level: level, rad or m.
        stops: -1 if falling below ends the run, 1 if rising above does, 0 if neither.
        contact: name of a contact, one of the engine's `contacts`; it is above its level while it
            touches.
    """

    name: str
    coordinate: str = ""
    body: str = ""
    station: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)
    level: float = 0.0
    stops: int = 0
    contact: str = ""


@dataclass(frozen=True)
class Runs:
    """Results of W runs whose states have y entries.

    Attributes:
        times: times at which the runs ended (W,), s.
        states: states at the end (W, y), in the engine's order.
        endings: reason why each run ended (W,), one of `ENDINGS`.
        counts: accepted steps, attempted steps, evaluations (W, 3).
        reports: states at the report times (W, r, y); NaN after the end of a run.
        events: events of each run in order of time: time (s), name, and whether a contact begins or
            a level is passed upwards.
        peaks: largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2).
        event_states: states at the events of each run, one row for each event (e, y); empty unless
            they are recorded.
    """

    times: Floats
    states: Floats
    endings: Ints
    counts: Ints
    reports: Floats
    events: list[list[tuple[float, str, bool]]]
    peaks: Floats
    event_states: list[Floats] = field(default_factory=list)

    def select(self, indices: Sequence[int] | Ints) -> Runs:
        """Return some of the runs, by their indices."""
        selected: dict[str, Any] = {}
        for name, rows in vars(self).items():
            selected[name] = (
                rows[indices]
                if isinstance(rows, np.ndarray)
                # Lists that are empty were not requested.
                else [rows[index] for index in indices if rows]
            )
        return Runs(**selected)
