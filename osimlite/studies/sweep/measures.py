"""What is kept of a run: one number for each measure.

A measure of your own is a function of a :class:`Run` that returns a number, named as
``module:function`` or ``file.py:function``::

    def drop(run):
        return run.start["Pelvis_ty"] - run.end["Pelvis_ty"]

or an expression, as :mod:`osimlite.studies.sweep.expressions` has them: ``start(Pelvis_ty) -
end(Pelvis_ty)``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.load import import_user_module, run_python_file
from osimlite.base.records import dataclass, field, replace
from osimlite.base.text import suggest_name, suggest_or_list
from osimlite.errors import ModelError, SettingError
from osimlite.simulation.batches import Runs, Watch
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.expressions import Expression, Quantity, list_quantities
from osimlite.studies.sweep.variables import Floats


@dataclass(frozen=True)
class Batch:
    """Runs of models of one structure."""

    engine: Any  # of a model of the same structure
    engine_of: Callable[[int], Any]  # the engine of the model of a run, by its place
    numbers: Floats | None  # of the compiled engines (W, m); None if all are those of `engine`
    starts: Floats  # initial states (W, y), in the engine's order
    runs: Runs  # what came of them
    values: Floats  # of the variables (W, d)
    names: Sequence[str]  # of the variables
    report_times: Floats  # at which states were kept, s
    # where measures leave for each other what they have found
    memory: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """What can be looked at during the runs."""
        return list_quantities(self.engine)

    def part(self, place: int) -> Batch:
        """One of the runs."""
        rows = [place]
        return replace(
            self,
            engine_of=lambda _: self.engine_of(place),
            numbers=None if self.numbers is None else self.numbers[rows],
            starts=self.starts[rows],
            runs=self.runs.select(rows),
            values=self.values[rows],
            memory={},
        )


@dataclass(frozen=True)
class Measure:
    """One number for each run."""

    name: str  # of the column
    of: Callable[[Batch], Any]  # computes them (W,); not a number where there is none
    watches: tuple[Watch, ...] = ()  # what it needs to have watched
    # how many events of a run of so many seconds it looks at
    room: Callable[[float], int] = lambda to: 0
    event_states: bool = False  # whether it looks at the states there


class State(Mapping[str, float]):
    """States by name: ``state["RHip_rz"]``, ``state["RHip_rz/speed"]``, and any by its path in ``states.sto``."""

    def __init__(self, engine: Any, y: Floats) -> None:
        self._engine, self._y = engine, y

    def __getitem__(self, name: str) -> float:
        place, locked = _state_place(self._engine, name)
        return locked if place is None else float(self._y[place])

    def __iter__(self) -> Iterator[str]:
        names = [info.name for info in self._engine.mechanism.coordinates]
        return iter([*names, *(f"{name}/speed" for name in names), *self._engine.state.paths])

    def __len__(self) -> int:
        return 2 * len(self._engine.mechanism.coordinates) + len(self._engine.state.paths)


@dataclass(frozen=True)
class Run:
    """One run, for a measure of your own."""

    values: Mapping[str, float]  # of the variables, by name (rad, m)
    start: State  # initial state
    end: State  # last state
    time: float  # at which it ended, s
    # moments up to the end at which the state was kept, if a report interval was asked for, s
    times: Floats
    # time (s), name of a contact or of what was watched, whether it begins
    events: Sequence[tuple[float, str, bool]]
    largest_forces: Mapping[str, float]  # N, by contact
    engine: Any = field(repr=False)  # that computed it, with its `mechanism`
    states: Floats = field(repr=False)
    quantities: Mapping[str, Quantity] = field(repr=False)

    def history(self, name: str) -> Floats:
        """What a name in an expression stands for, at the times."""
        if name not in self.quantities:
            raise SettingError(f"a run has no '{name}'{suggest_name(name, self.quantities)}")
        return self.quantities[name](
            self.engine, list(zip(self.times, self.states.tolist(), strict=True))
        )

    @cached_property
    def mechanism(self) -> Any:
        """The mechanism that moved."""
        return self.engine.mechanism


def measure(spec: Any, engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """The measure that is meant by a name, ``NAME/value`` or ``NAME/speed`` at the end, an expression or a function.

    Args:
        spec: what is meant.
        engine: of the model.
        feet: contacts of each foot, for the measures of a walker; found by the structure of the
            model if left out.

    Raises:
        SettingError: there is none of that name, or the model has nothing of the kind.
    """
    name = measure_name(spec)
    if callable(spec):
        return Measure(name, partial(_each, spec), room=_reserve_rows)
    if (known := registry.measure_named(name)) is not None:
        return known.make(engine, feet)
    if ":" in name:
        return Measure(name, partial(_each, _function(name)), room=_reserve_rows)
    if is_expression(name):
        return Measure(name, partial(_measure_expression, Expression(name, engine)))
    if "/" in name:
        try:
            place, locked = _state_place(engine, name)
        except ModelError as error:
            raise SettingError(f"there is no measure '{name}': {error.message}") from None
        return Measure(name, partial(_find_ends, place, locked))
    raise SettingError(
        f"there is no measure '{name}'{suggest_or_list(name, registry.measure_names(), 'module:function')}"
    )


def is_expression(spec: Any) -> bool:
    """Whether it is an expression, which looks at the states of a run."""
    return isinstance(spec, str) and "(" in spec and ":" not in spec


EVENTS_PER_SECOND = 100
"""So many events of a run a function can see."""


def _reserve_rows(to: float) -> int:
    return 40 + round(EVENTS_PER_SECOND * to)


def measure_name(spec: Any) -> str:
    """What a measure is called."""
    if callable(spec):
        return f"{getattr(spec, '__module__', '?')}:{getattr(spec, '__qualname__', type(spec).__name__)}"
    return str(spec)


@registry.measure(is_maximized=True)
def distance(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """How far the first free coordinate that slides has come, m."""
    infos = engine.mechanism.coordinates
    place = next(
        (k for k, j in enumerate(engine.order) if infos[j].motion_type == "translational"), None
    )
    if place is None:
        raise SettingError(
            "no coordinate of the model slides, so that it has no distance; take another measure"
        )
    return Measure("distance", lambda batch: batch.runs.states[:, place] - batch.starts[:, place])


@registry.measure()
def largest_force(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """The largest force of any contact at the end of a step, N."""
    return Measure(
        "largest_force", lambda batch: batch.runs.peaks[:, :, 0].max(axis=1, initial=0.0)
    )


@registry.measure()
def energy(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """Mechanical energy at the end less that at the start, J; contact and damping take it away."""

    def gained(batch: Batch) -> Floats:
        runs = batch.runs
        ends = zip(runs.times.tolist(), batch.starts.tolist(), runs.states.tolist(), strict=True)
        result = []
        for number, (t, start, end) in enumerate(ends):
            one = batch.engine_of(number)
            result.append(sum(one.compute_energies(t, end)) - sum(one.compute_energies(0.0, start)))
        return np.array(result)

    return Measure("energy", gained)


def _find_ends(place: int | None, locked: float, batch: Batch) -> Floats:
    return np.full(len(batch.starts), locked) if place is None else batch.runs.states[:, place]


def _measure_expression(expression: Expression, batch: Batch) -> list[float]:
    result = []
    runs, times = batch.runs, batch.report_times
    for k, (end, state) in enumerate(zip(runs.times.tolist(), runs.states.tolist(), strict=True)):
        kept = int(np.searchsorted(times, end))
        moments = [
            *zip(times[:kept].tolist(), runs.reports[k, :kept].tolist(), strict=True),
            (end, state),
        ]
        result.append(expression.of(batch.engine_of(k), moments))
    return result


def _each(function: Callable[[Run], float], batch: Batch) -> list[float]:
    result = []
    names, contacts = batch.names, batch.engine.contacts
    for k in range(len(batch.starts)):
        engine = batch.engine_of(k)
        kept = int(np.searchsorted(batch.report_times, batch.runs.times[k], side="right"))
        run = Run(
            dict(zip(names, batch.values[k].tolist(), strict=True)),
            State(engine, batch.starts[k]),
            State(engine, batch.runs.states[k]),
            float(batch.runs.times[k]),
            batch.report_times[:kept],
            batch.runs.events[k],
            dict(zip(contacts, batch.runs.peaks[k, :, 0].tolist(), strict=True)),
            engine,
            batch.runs.reports[k, :kept],
            batch.quantities,
        )
        # What a function forgets to return would become no number, silently.
        result.append(float(function(run)))
    return result


def _state_place(engine: Any, name: str) -> tuple[int | None, float]:
    """Where in a state ``NAME``, ``NAME/value`` or ``NAME/speed`` is, or a path; None and its value if it is locked."""
    if name in engine.state.paths:
        return 2 * len(engine.order) + engine.state.paths.index(name), 0.0
    front, _, last = name.rpartition("/")
    if last not in ("value", "speed"):
        front, last = name, "value"
    place, count = engine.mechanism.coordinate_index(front), len(engine.order)
    if place not in engine.order:
        return None, 0.0 if last == "speed" else engine.mechanism.coordinates[place].default_value
    return engine.order.index(place) + (count if last == "speed" else 0), 0.0


def _function(name: str) -> Callable[[Run], float]:
    place, _, function = name.rpartition(":")
    module = run_python_file(Path(place)) if place.endswith(".py") else import_user_module(place)
    result = getattr(module, function, None)
    if not callable(result):
        raise SettingError(
            f"'{place}' has no function '{function}'{suggest_name(function, vars(module))}"
        )
    return result
