"""Measures of runs: one number for each run of a sweep or a search.

A measure of your own is a function of a :class:`Run` that returns a number, named as
``module:function`` or ``file.py:function``::

    def drop(run):
        return run.start["Pelvis_ty"] - run.end["Pelvis_ty"]

or an expression of :mod:`osimlite.studies.sweep.expressions`: ``start(Pelvis_ty) -
end(Pelvis_ty)``. The names of the public functions here that are registered are the names that
users write.
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
from osimlite.studies.sweep.expressions import ExpressionMeasure, Quantity, list_quantities
from osimlite.studies.sweep.variables import Floats


@dataclass(frozen=True)
class Batch:
    """Runs of models of one structure, from which measures are computed.

    Attributes:
        engine: engine of a model of this structure.
        engine_of: function that returns the engine of the model of a run, by its index.
        numbers: numbers of the compiled engines (W, m); None if all are those of `engine`.
        starts: initial states (W, y), in the order of the engine.
        runs: results of the runs.
        values: values of the variables (W, d).
        names: names of the variables.
        report_times: times at which states were saved (s).
        memory: intermediate results that measures share.
    """

    engine: Any
    engine_of: Callable[[int], Any]
    numbers: Floats | None
    starts: Floats
    runs: Runs
    values: Floats
    names: Sequence[str]
    report_times: Floats
    memory: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def quantities(self) -> Mapping[str, Quantity]:
        """Quantities of the runs by name, for expressions."""
        return list_quantities(self.engine)

    def select_run(self, run_index: int) -> Batch:
        """Return a batch with one of the runs."""
        # A list of one index keeps the axis of the runs.
        rows = [run_index]
        return replace(
            self,
            engine_of=lambda _: self.engine_of(run_index),
            numbers=None if self.numbers is None else self.numbers[rows],
            starts=self.starts[rows],
            runs=self.runs.select(rows),
            values=self.values[rows],
            # The shared results are those of all runs.
            memory={},
        )


@dataclass(frozen=True)
class RunMeasure:
    """Measure: one number for each run.

    Attributes:
        name: name of the column in the table of results.
        compute: function that computes the numbers (W,) of a batch; NaN for runs without one.
        watches: events that the runs must record.
        event_count: function that returns the number of events to record in a run of a duration
            (s).
        event_states: whether `compute` needs the states at events.
    """

    name: str
    compute: Callable[[Batch], Any]
    watches: tuple[Watch, ...] = ()
    event_count: Callable[[float], int] = lambda to: 0
    event_states: bool = False


class State(Mapping[str, float]):
    """State by name: `state["RHip_rz"]`, `state["RHip_rz/speed"]`, or by a path in `states.sto`."""

    def __init__(self, engine: Any, y: Floats) -> None:
        self._engine, self._y = engine, y

    def __getitem__(self, name: str) -> float:
        offset, locked = _find_state(self._engine, name)
        return locked if offset is None else float(self._y[offset])

    def __iter__(self) -> Iterator[str]:
        names = [info.name for info in self._engine.mechanism.coordinates]
        return iter([*names, *(f"{name}/speed" for name in names), *self._engine.state.paths])

    def __len__(self) -> int:
        return 2 * len(self._engine.mechanism.coordinates) + len(self._engine.state.paths)


@dataclass(frozen=True)
class Run:
    """Run of one sample, as the argument of a measure of your own.

    Attributes:
        values: values of the variables by name (rad, m).
        start: initial state.
        end: last state.
        time: time at which the run ended (s).
        times: times until then at which states were saved (s); empty without a report interval.
        events: time (s), name of a contact or a watch, and whether it begins.
        largest_forces: largest force of each contact (N).
        engine: engine that computed the run, with its `mechanism`.
        states: states at the times (t, y).
        quantities: quantities by name, see :meth:`history`.
    """

    values: Mapping[str, float]
    start: State
    end: State
    time: float
    times: Floats
    events: Sequence[tuple[float, str, bool]]
    largest_forces: Mapping[str, float]
    engine: Any = field(repr=False)
    states: Floats = field(repr=False)
    quantities: Mapping[str, Quantity] = field(repr=False)

    def history(self, name: str) -> Floats:
        """Return a quantity of expressions at the saved times (t,).

        Raises:
            SettingError: the name is unknown.
        """
        if name not in self.quantities:
            raise SettingError(f"a run has no '{name}'{suggest_name(name, self.quantities)}")
        return self.quantities[name](
            self.engine, list(zip(self.times, self.states.tolist(), strict=True))
        )

    @cached_property
    def mechanism(self) -> Any:
        """Mechanism of the model of this run."""
        return self.engine.mechanism


def make_measure(spec: Any, engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure that a user has selected.

    Args:
        spec: registered name, `NAME/value` or `NAME/speed` (at the end of the run), expression,
            `module:function`, or a function.
        engine: engine of the model.
        feet: contacts of each foot for measures of a walker; found from the structure of the model
            by default.

    Raises:
        SettingError: the name is unknown, or the model lacks what the measure needs.
    """
    name = get_measure_name(spec)
    if callable(spec):
        return RunMeasure(
            name, partial(_call_for_each_run, spec), event_count=_estimate_event_count
        )
    if (registered := registry.find_measure(name)) is not None:
        return registered.make(engine, feet)
    # Expressions contain no colon, paths of Python functions do.
    if ":" in name:
        return RunMeasure(
            name,
            partial(_call_for_each_run, _import_function(name)),
            event_count=_estimate_event_count,
        )
    if is_expression(name):
        return RunMeasure(name, partial(_measure_expression, ExpressionMeasure(name, engine)))
    if "/" in name:
        try:
            offset, locked = _find_state(engine, name)
        except ModelError as error:
            raise SettingError(f"there is no measure '{name}': {error.message}") from None
        return RunMeasure(name, partial(_read_end_states, offset, locked))
    raise SettingError(
        f"there is no measure '{name}'{suggest_or_list(name, registry.list_measure_names(), 'module:function')}"
    )


def is_expression(spec: Any) -> bool:
    """Return whether a measure is an expression, which needs the states of a run."""
    return isinstance(spec, str) and "(" in spec and ":" not in spec


EVENTS_PER_SECOND = 100
"""Number of events per second that a function of the user can see."""


def _estimate_event_count(to: float) -> int:
    """Return the number of events to record in a run of a duration (s)."""
    return 40 + round(EVENTS_PER_SECOND * to)


def get_measure_name(spec: Any) -> str:
    """Return the name of a measure, which is the name of its column."""
    if callable(spec):
        return f"{getattr(spec, '__module__', '?')}:{getattr(spec, '__qualname__', type(spec).__name__)}"
    return str(spec)


@registry.register_measure(is_maximized=True)
def distance(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure `distance`: displacement of the first free translational coordinate (m).

    Args:
        engine: engine of the model.
        feet: contacts of each foot, an argument of all functions that make measures; not used here.

    Raises:
        SettingError: the model has no such coordinate.
    """
    coordinates = engine.mechanism.coordinates
    # The state begins with the values of the free coordinates, in the order of the engine.
    offset = next(
        (
            state_offset
            for state_offset, coordinate_index in enumerate(engine.order)
            if coordinates[coordinate_index].motion_type == "translational"
        ),
        None,
    )
    if offset is None:
        raise SettingError(
            "the model has no translational coordinate, so it covers no distance; choose another measure"
        )
    return RunMeasure(
        "distance", lambda batch: batch.runs.states[:, offset] - batch.starts[:, offset]
    )


@registry.register_measure()
def largest_force(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure `largest_force`: largest force of any contact at the ends of steps (N).

    Args:
        engine: engine of the model.
        feet: contacts of each foot, an argument of all functions that make measures; not used here.
    """
    return RunMeasure(
        "largest_force",
        # A model without contacts has no peaks, hence the initial 0.
        lambda batch: batch.runs.peaks[:, :, 0].max(axis=1, initial=0.0),
    )


@registry.register_measure()
def energy(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure `energy`: change of mechanical energy (J); contact and damping reduce it.

    Args:
        engine: engine of the model.
        feet: contacts of each foot, an argument of all functions that make measures; not used here.
    """

    def compute_change(batch: Batch) -> Floats:
        runs = batch.runs
        end_points = zip(
            runs.times.tolist(), batch.starts.tolist(), runs.states.tolist(), strict=True
        )
        result = []
        for run_index, (t, start, end) in enumerate(end_points):
            # Each run has its own masses and springs.
            engine = batch.engine_of(run_index)
            result.append(
                sum(engine.compute_energies(t, end)) - sum(engine.compute_energies(0.0, start))
            )
        return np.array(result)

    return RunMeasure("energy", compute_change)


def _read_end_states(offset: int | None, locked: float, batch: Batch) -> Floats:
    """Return an entry of the last states (W,), or the value of a locked coordinate."""
    return np.full(len(batch.starts), locked) if offset is None else batch.runs.states[:, offset]


def _measure_expression(expression: ExpressionMeasure, batch: Batch) -> list[float]:
    """Return the value of an expression for each run, from its saved states and its last one."""
    result = []
    runs, times = batch.runs, batch.report_times
    for run_index, (end, state) in enumerate(
        zip(runs.times.tolist(), runs.states.tolist(), strict=True)
    ):
        # The state at the end is appended, so that a report at the same time is left out.
        report_count = int(np.searchsorted(times, end))
        moments = [
            *zip(
                times[:report_count].tolist(),
                runs.reports[run_index, :report_count].tolist(),
                strict=True,
            ),
            (end, state),
        ]
        result.append(expression.evaluate(batch.engine_of(run_index), moments))
    return result


def _call_for_each_run(function: Callable[[Run], float], batch: Batch) -> list[float]:
    """Return the value of a function of the user for each run."""
    result = []
    names, contacts = batch.names, batch.engine.contacts
    for run_index in range(len(batch.starts)):
        engine = batch.engine_of(run_index)
        report_count = int(
            np.searchsorted(batch.report_times, batch.runs.times[run_index], side="right")
        )
        run = Run(
            dict(zip(names, batch.values[run_index].tolist(), strict=True)),
            State(engine, batch.starts[run_index]),
            State(engine, batch.runs.states[run_index]),
            float(batch.runs.times[run_index]),
            batch.report_times[:report_count],
            batch.runs.events[run_index],
            dict(zip(contacts, batch.runs.peaks[run_index, :, 0].tolist(), strict=True)),
            engine,
            batch.runs.reports[run_index, :report_count],
            batch.quantities,
        )
        # numpy would turn None, of a function without a return, into NaN; float() raises.
        result.append(float(function(run)))
    return result


def _find_state(engine: Any, name: str) -> tuple[int | None, float]:
    """Find a state variable by name.

    Args:
        engine: engine of the model.
        name: path of a state, or coordinate with or without `/value` or `/speed`.

    Returns:
        Offset in the state and 0; for a locked coordinate None and its value, or 0 for its speed.
    """
    # Other states, such as activations, come after the values and speeds of the coordinates.
    if name in engine.state.paths:
        return 2 * len(engine.order) + engine.state.paths.index(name), 0.0
    coordinate_name, _, quantity = name.rpartition("/")
    if quantity not in ("value", "speed"):
        # The name of a coordinate alone means its value.
        coordinate_name, quantity = name, "value"
    coordinate_index = engine.mechanism.coordinate_index(coordinate_name)
    count = len(engine.order)
    if coordinate_index not in engine.order:
        return None, 0.0 if quantity == "speed" else engine.mechanism.coordinates[
            coordinate_index
        ].default_value
    return engine.order.index(coordinate_index) + (count if quantity == "speed" else 0), 0.0


def _import_function(name: str) -> Callable[[Run], float]:
    """Return the function that `module:function` or `file.py:function` names.

    Raises:
        SettingError: the module has no function of this name.
    """
    module_name, _, function = name.rpartition(":")
    module = (
        run_python_file(Path(module_name))
        if module_name.endswith(".py")
        else import_user_module(module_name)
    )
    result = getattr(module, function, None)
    if not callable(result):
        raise SettingError(
            f"'{module_name}' has no function '{function}'{suggest_name(function, vars(module))}"
        )
    return result
