"""Runner of samples, one for each thread and process of a sweep."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.batches import Runs, Watch
from osimlite.simulation.options import compute_report_times
from osimlite.studies.sweep.expressions import ExpressionMeasure, list_driven_names
from osimlite.studies.sweep.measures import (
    Batch,
    RunMeasure,
    State,
    get_measure_name,
    is_expression,
    make_measure,
)
from osimlite.studies.sweep.plan import MAX_INTEGRATOR_STEPS, Plan
from osimlite.studies.sweep.variables import Floats
from osimlite.studies.sweep.variants import CACHED_VARIANTS, Variant, Variants

DONE = "done"
"""Status of a run that reached its end."""
STOPPED = "stopped"
"""Status of a run that a level or a fall has ended."""
FAILED = "failed"
"""Status of a run without a result."""

Endings = list[tuple[str, str | None]]
"""Status of each run, and its reason or None."""


@dataclass(frozen=True)
class Block:
    """Results of some samples, in the order of the samples.

    Attributes:
        status: `DONE`, `STOPPED` (by a watch of the plan) or `FAILED`.
        reasons: why a run stopped or failed, else None.
        times: times at which the runs ended (s).
        measures: values of each measure by name (k,); NaN for failed runs.
        seconds: duration of the work (s).
    """

    status: list[str]
    reasons: list[str | None]
    times: Floats
    measures: dict[str, Floats]
    seconds: float = 0.0

    @classmethod
    def join(cls, blocks: Sequence[Block]) -> Block:
        """Return several blocks as one."""
        return cls(
            [run_status for block in blocks for run_status in block.status],
            [reason for block in blocks for reason in block.reasons],
            np.concatenate([block.times for block in blocks]),
            {
                name: np.concatenate([block.measures[name] for block in blocks])
                for name in blocks[0].measures
            },
        )

    @property
    def columns(self) -> list[Any]:
        """Columns of a table of results after the values of the variables."""
        return [self.status, self.reasons, self.times, *self.measures.values()]


class _Sample(NamedTuple):
    """Sample with its model and its initial state.

    Attributes:
        row: index of the sample in the block.
        variant: model of the sample.
        start: initial state (y,).
    """

    row: int
    variant: Variant
    start: Floats


class _Observers:
    """Measures and watches for the runs of models of one structure.

    Args:
        plan: plan of the runs.
        engine: engine of a model of this structure.

    Raises:
        OsimliteError: the model lacks what a measure needs.
    """

    def __init__(self, plan: Plan, engine: Any) -> None:
        self.measures = [make_measure(spec, engine, plan.feet) for spec in plan.measures]
        expressions = [
            spec for spec in plan.measures if plan.controller is not None and is_expression(spec)
        ]
        for spec in expressions:
            for name in sorted(ExpressionMeasure(spec, engine).names & list_driven_names(engine)):
                raise SettingError(
                    f"the measure '{spec}' needs '{name}', which depends on the controller; in runs with a "
                    "controller, measures can use states only"
                )
        # Levels of the plan act on all runs, besides the watches of measures.
        stops = [
            Watch(
                stop.words,
                coordinate=stop.coordinate,
                level=stop.level,
                stops=-1 if stop.is_below else 1,
            )
            for stop in plan.stops
        ]
        self.watches = (
            list(
                {
                    watch.name: watch for measure in self.measures for watch in measure.watches
                }.values()
            )
            + stops
        )
        # Only the compiled engine stops runs at events.
        if self.watches and plan.engine != "compiled":
            raise SettingError("levels that end runs need the compiled engine")
        # The engine detects no events unless it may record at least one.
        event_counts = [measure.event_count(plan.to) for measure in self.measures]
        self.most_events = max([*event_counts, 1 if self.watches else 0])


class Runner:
    """Runner of samples, for one thread.

    Args:
        plan: plan of the runs.

    Raises:
        OsimliteError: the model cannot be simulated, or lacks what a measure needs.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.variants = Variants(plan)
        base_variant = self.variants.base_variant
        self._cached_observers: dict[bytes, _Observers] = {
            base_variant.structure: _Observers(plan, base_variant.engine)
        }
        moments = [] if plan.interval is None else compute_report_times(plan.to, plan.interval)
        self._report_times = np.array(moments)

    def run(self, values: Floats) -> Block:
        """Run samples (k, d).

        Returns:
            Results of the samples. A run that fails is reported there, and raises nothing.
        """
        started = time.perf_counter()
        count = len(values)
        block = Block(
            [FAILED] * count,
            [None] * count,
            np.full(count, np.nan),
            {get_measure_name(spec): np.full(count, np.nan) for spec in self.plan.measures},
        )
        # Models of one structure run in one call; their engines differ in numbers only.
        groups: dict[bytes, list[_Sample]] = {}
        for index, row in enumerate(values.tolist()):
            try:
                variant = self.variants.make_variant(row)
                start = self.variants.make_start(variant, row)
            except OsimliteError as error:
                block.reasons[index] = str(error)
            else:
                groups.setdefault(variant.structure, []).append(_Sample(index, variant, start))
        for group in groups.values():
            try:
                self._run_group(group, values, block)
            except OsimliteError as error:
                # A measure may need something that models of another structure lack.
                for sample in group:
                    block.status[sample.row], block.reasons[sample.row] = FAILED, str(error)
        # A run whose measure fails counts as failed, so that its other measures are dropped.
        failed = [index for index in range(count) if block.status[index] == FAILED]
        for column in block.measures.values():
            column[failed] = np.nan
        return replace(block, seconds=time.perf_counter() - started)

    def _run_group(self, group: Sequence[_Sample], values: Floats, block: Block) -> None:
        """Run samples whose models have one structure, in one call of the engine."""
        # Any engine of the same structure works, and making one takes time.
        base_variant, first_variant = self.variants.base_variant, group[0].variant
        engine = (
            base_variant if first_variant.structure == base_variant.structure else first_variant
        ).engine
        observers = self._get_observers(first_variant.structure, engine)
        variants = [sample.variant for sample in group]
        starts = self.variants.make_initial_states(
            engine, variants, np.stack([sample.start for sample in group])
        )
        runs, endings = self._simulate_batch(engine, observers, variants, starts)
        for number, sample in enumerate(group):
            block.status[sample.row], block.reasons[sample.row] = endings[number]
            block.times[sample.row] = runs.times[number]
        successful = np.array(
            [number for number, (status, _) in enumerate(endings) if status != FAILED], dtype=int
        )
        if len(successful) == 0:
            return
        selected = [group[number].variant for number in successful]
        rows = np.array([group[number].row for number in successful])
        batch = Batch(
            engine,
            lambda number: selected[number].engine,
            self._stack_numbers(selected),
            starts[successful],
            runs.select(successful),
            values[rows],
            [variable.name for variable in self.plan.variables],
            self._report_times,
        )
        for measure in observers.measures:
            self._apply_measure(measure, batch, rows, block)

    def _get_observers(self, structure: bytes, engine: Any) -> _Observers:
        """Return the measures and watches for a structure of the model, from a cache."""
        result = self._cached_observers.get(structure)
        if result is None:
            # Parameters of a function may give every sample a structure of its own.
            if len(self._cached_observers) >= CACHED_VARIANTS:
                self._cached_observers = {}
            result = self._cached_observers[structure] = _Observers(self.plan, engine)
        return result

    def _apply_measure(self, measure: RunMeasure, batch: Batch, rows: Any, block: Block) -> None:
        """Compute a measure of some runs.

        An exception of a user's function becomes the reason of a failed run.
        """
        try:
            block.measures[measure.name][rows] = measure.compute(batch)
        except Exception as error:
            if len(rows) > 1:
                # Repeat run by run, to find the one that fails.
                for number, row in enumerate(rows):
                    self._apply_measure(measure, batch.select_run(number), np.array([row]), block)
            else:
                block.status[rows[0]] = FAILED
                block.reasons[rows[0]] = (
                    f"the measure '{measure.name}' failed with {type(error).__name__}: {error}"
                )

    # --------------------------------------------------------------------------------------------- motions
    def _simulate_batch(
        self, engine: Any, observers: _Observers, variants: Sequence[Variant], starts: Floats
    ) -> tuple[Runs, Endings]:
        """Simulate a batch of models of one structure from their initial states (W, y).

        Returns:
            Results of the runs; and for each run its status, with the reason or None.
        """
        if self.plan.engine != "compiled":
            return self._simulate_one_by_one(engine, variants, starts)
        from osimlite.simulation.batches import ENDINGS, run_many

        runs = run_many(
            engine,
            starts,
            self.plan.to,
            numbers=self._stack_numbers(variants),
            **self.plan.integration_choices(),
            report_times=self._report_times.tolist(),
            watches=observers.watches,
            most_events=observers.most_events,
            # States at events take memory; they are recorded only if a measure needs them.
            event_states=any(measure.event_states for measure in observers.measures),
            most_tries=MAX_INTEGRATOR_STEPS,
            threads=1,
            controllers=[
                variant.kernel_controller
                for variant in variants
                if variant.kernel_controller is not None
            ],
        )
        endings: Endings = []
        for number, (ending, state) in enumerate(
            zip(runs.endings.tolist(), runs.states, strict=True)
        ):
            # An integrator that ends normally may still have overflowed.
            ending_name, t = ENDINGS[ending], runs.times[number]
            if ending_name == "done" and np.isfinite(state).all():
                endings.append((DONE, None))
            elif ending_name == "stopped":
                endings.append(
                    (STOPPED, self._find_stop(engine, observers, runs.events[number], state))
                )
            elif ending_name == "too many steps":
                endings.append(
                    (
                        FAILED,
                        f"{MAX_INTEGRATOR_STEPS} integrator steps reach only t = {t:.9g} s; use a larger accuracy value",
                    )
                )
            else:
                endings.append(
                    (
                        FAILED,
                        f"the motion cannot be computed beyond t = {t:.9g} s; use a smaller accuracy value",
                    )
                )
        return runs, endings

    def _stack_numbers(self, variants: Sequence[Variant]) -> Floats | None:
        """Return the numbers of the compiled engines (W, m); None if no number varies."""
        return (
            None if self.variants.is_fixed else np.stack([variant.numbers for variant in variants])
        )

    def _find_stop(
        self,
        engine: Any,
        observers: _Observers,
        events: Sequence[tuple[float, str, bool]],
        state: Floats,
    ) -> str:
        """Return the name of the watch that ended a run.

        It is the last event if this was recorded, else the level nearest to the state.
        """
        last_event = events[-1][1] if events else ""
        if any(watch.stops and watch.name == last_event for watch in observers.watches):
            return last_event
        end_state = State(engine, state)
        names = {
            stop.words: abs(end_state[stop.coordinate] - stop.level) for stop in self.plan.stops
        }
        return min(names, key=lambda name: names[name])

    def _simulate_one_by_one(
        self, engine: Any, variants: Sequence[Variant], starts: Floats
    ) -> tuple[Runs, Endings]:
        """Run samples with an engine that simulates one motion at a time.

        Returns:
            Results of the runs; and for each run its status, with the reason or None.
        """
        plan = self.plan
        endings: Endings = []
        order, contacts = engine.order, engine.contacts
        count, size = len(order), len(starts)
        times = np.zeros(size)
        states = starts.copy()
        reports = np.full((size, len(self._report_times), starts.shape[1]), np.nan)
        events: list[list[tuple[float, str, bool]]] = [[] for _ in range(size)]
        peaks = np.zeros((size, len(contacts), 2))
        for number, variant in enumerate(variants):
            simulation = variant.simulation
            assert simulation is not None
            infos = [
                simulation.mechanism.coordinates[coordinate_index] for coordinate_index in order
            ]
            free_indices = [
                k for k, info in enumerate(infos) if info.prescribed is None and not info.locked
            ]
            row = starts[number].tolist()
            auxiliary = dict(
                zip(simulation.state.paths, simulation.state.auxiliary(row), strict=True)
            )
            try:
                trajectory = simulation.run(
                    plan.to,
                    **plan.integration_choices(),
                    report_interval=plan.interval or plan.to,
                    controller=variant.controller,
                    # Locked and prescribed coordinates have their values from the model.
                    initial={infos[k].path: row[k] for k in free_indices} | auxiliary,
                    initial_speeds={infos[k].path: row[count + k] for k in free_indices},
                )
            except OsimliteError as error:
                endings.append((FAILED, str(error)))
                continue
            endings.append((DONE, None))
            history = simulation.state.pack_rows(
                trajectory.values, trajectory.speeds, trajectory.auxiliary
            )
            times[number], states[number] = trajectory.times[-1], history[-1]
            if len(self._report_times):
                reports[number] = history
            summary = trajectory.summary
            events[number] = [
                (event["time_s"], event["contact"], event["event"] == "begin")
                for event in summary["contact_events"]
            ]
            for name, largest in summary["largest_contact_forces"].items():
                peaks[number, contacts.index(name)] = largest["force_N"], largest["time_s"]
        zero_codes = np.zeros(size, dtype=np.int64)
        return Runs(
            times, states, zero_codes, np.zeros((size, 3), dtype=np.int64), reports, events, peaks
        ), endings
