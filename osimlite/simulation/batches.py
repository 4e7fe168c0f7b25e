"""Many motions at once, on all cores: what is asked of an engine that computes them, and what comes of it.

A batch has W runs of models of one structure. Each starts from a row of numbers, its state in the
engine's order (:class:`osimlite.simulation.states.StateLayout`), and may have a row of the model's
numbers of its own. Every run has its own steps, and comes out the same whatever runs beside it and
on however many threads. It ends at a time, or where a watch stops it, or cannot go on (`ENDINGS`).
On its way it leaves states at the report times, events (contacts that begin and end, levels that
are passed) and the largest forces: `Runs`.
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
from osimlite.simulation.options import DEFAULT_ACCURACY, MERSON, NO_BOUNDS, check_integrator

if TYPE_CHECKING:
    from osimlite.simulation.control_steps import Held


__all__ = [
    "ENDINGS",
    "BatchEngine",
    "BatchOptions",
    "Renewal",
    "Renewed",
    "Runs",
    "Watch",
    "run_many",
]

NO_LIMIT = 2**62

ENDINGS = {0: "done", 1: "failed", 3: "stopped", 4: "too many steps"}
"""How a run ended, in words: at its time, at a state beyond which there is no step, at a watch,
after as many tried steps as were allowed.
"""


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """How the runs of a batch go."""

    to: float = 2.0  # when they end unless a watch stops them, s
    accuracy: float = DEFAULT_ACCURACY  # of the integrator
    integrator: str = MERSON  # see `Options`
    report_times: Sequence[float] = ()  # at which states are kept, increasing, s
    watches: Sequence[Watch] = ()  # what else is an event, besides contacts that begin and end
    most_events: int = 0  # room for the events of a run; those beyond it are lost
    event_states: bool = False  # keep the states at the events
    most_tries: int = NO_LIMIT  # steps that a run may try
    threads: int | None = None  # how many work; by default one for each core
    step_bounds: tuple[float, float] = NO_BOUNDS  # of the steps, see `Settings`
    # of a controller of each run; the last function of each of its controls is a constant
    held: Sequence[Held] = ()

    def check(self) -> None:
        """SettingError for what has no meaning; machine code might go on with it forever."""
        if not 0.0 < self.accuracy < 1.0:
            raise SettingError(f"the accuracy must lie between 0 and 1; {self.accuracy} does not")
        check_integrator(self.integrator)
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
    """An engine that computes many motions at once."""

    mechanism: Mechanism  # of the model
    forces: Forces  # of the model
    # what is connected to what, integers; equal for models that differ in numbers only
    structure: Ints
    numbers: Floats  # all numbers of the model (m,)

    def run_many(
        self, states: ArrayLike, options: BatchOptions, numbers: ArrayLike | None = None
    ) -> Runs:
        """Compute a batch; see :func:`run_many`."""

    def contact_places(
        self, states: ArrayLike, numbers: ArrayLike | None = None, rows: ArrayLike | None = None
    ) -> Floats:
        """Where the surfaces of all contacts are: centre and normal of surface 1, centre of surface 2 (k, P, 9).

        All are in ground.

        Args:
            states: (k, y).
            numbers: of models of the same structure (v, m); by default the engine's own.
            rows: which of them each state goes with (k,); by default the first.
        """

    def contact_radii(self, numbers: ArrayLike | None = None) -> Floats:
        """Radius of surface 2 of each contact for each row of numbers (v, P), m."""

    def renewal(self, model: Model, folder: Path, wrapping: str = OPENSIM) -> Renewal:
        """What makes parts of the model anew, which is that of the engine.

        Args:
            model: of which numbers will be others.
            folder: of its file.
            wrapping: how its paths bend around surfaces, see :class:`osimlite.simulation.Options`.
        """


@dataclass(frozen=True)
class Renewed:
    """A model of which only numbers have changed."""

    mechanism: Mechanism  # of it
    forces: Forces  # of it
    numbers: Floats  # as `BatchEngine.numbers` (m,)
    given: Any  # engine of the model before

    def engine(self) -> Any:
        """The engine of this very model."""
        return self.given.renumbered(self.mechanism, self.forces, self.numbers)


class Renewal(Protocol):
    """Makes those parts of a model anew that its forces, masses and gravity have a part in."""

    def renewed(self, owners: Sequence[Component]) -> Renewed | None:
        """The model with what its forces and bodies are now; None if more has changed than numbers.

        Args: owners: forces, controllers, bodies and the model itself, if a property of theirs has
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

    Args: engine: of the model. states: where the runs start (W, y), in the engine's order. to: when
        they end unless a watch stops them, s. numbers: `engine.numbers` of models of the same
        structure, one row for each run; by default the engine's own. choices: attributes of
        :class:`BatchOptions`.

    Raises:
        SettingError: a setting has no meaning.
        OsimliteError: the shapes do not fit, or a watch names nothing or a locked coordinate.
        ModelError: a watch names what does not exist.
    """
    return engine.run_many(states, BatchOptions(to=to, **choices), numbers)


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Watch(NamedTuple):
    """A level that a run is watched for passing."""

    name: str  # what the event is called
    coordinate: str = ""  # name or path of the coordinate that is watched, or
    body: str = ""  # name or path of the body (or frame) of which a point is watched, with
    station: tuple[float, float, float] = (0.0, 0.0, 0.0)  # the point in it (m), and
    # along which in ground its position counts
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)
    level: float = 0.0  # what is passed, rad or m
    stops: int = 0  # -1 if falling below ends the run, 1 if rising above does, 0 if neither
    # name of the contact (of the engine's `contacts`) that is, which is above its level while it
    # pushes, or
    contact: str = ""


@dataclass(frozen=True)
class Runs:
    """W runs, whose states have y numbers."""

    times: Floats  # at which the runs ended (W,), s
    states: Floats  # in which (W, y), in the engine's order
    endings: Ints  # how, see `ENDINGS` (W,)
    counts: Ints  # steps taken, steps tried, evaluations (W, 3)
    reports: Floats  # states at the report times (W, r, y); not a number after the end of a run
    # of each run its events in the order of time: time (s), name, whether it begins or rises
    events: list[list[tuple[float, str, bool]]]
    peaks: (
        Floats  # largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2)
    )
    # of each run the states at its events (as many as events, y), if they were asked for
    event_states: list[Floats] = field(default_factory=list)

    def of(self, places: Sequence[int] | Ints) -> Runs:
        """Some of the runs."""
        chosen: dict[str, Any] = {}
        for name, rows in vars(self).items():
            chosen[name] = (
                rows[places]
                if isinstance(rows, np.ndarray)
                else [rows[place] for place in places if rows]
            )
        return Runs(**chosen)
