"""Runs samples of a plan: what every thread and every process of a sweep does."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.records import dataclass, replace
from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.batches import Runs, Watch
from osimlite.simulation.options import compute_report_times
from osimlite.studies.sweep.expressions import Expression, list_driven_names
from osimlite.studies.sweep.measures import (
    Batch,
    Measure,
    State,
    is_expression,
    measure,
    measure_name,
)
from osimlite.studies.sweep.plan import MOST_TRIES, Plan
from osimlite.studies.sweep.variables import Floats
from osimlite.studies.sweep.variants import MOST_KEPT, Variant, Variants

DONE, STOPPED, FAILED = "done", "stopped", "failed"

Endings = list[tuple[str, str | None]]
"""How each run ended, and why."""


@dataclass(frozen=True)
class Block:
    """What came of some samples, in their order."""

    status: list[str]  # of each, `DONE`, `STOPPED` (by what the plan watches) or `FAILED`
    reasons: list[str | None]  # why it stopped or failed, else None
    times: Floats  # at which it ended, s
    measures: dict[str, Floats]  # by name (k,); not a number where there is none
    seconds: float = 0.0  # that the work took

    @classmethod
    def join(cls, blocks: Sequence[Block]) -> Block:
        """Several of them in one."""
        return cls(
            [word for block in blocks for word in block.status],
            [words for block in blocks for words in block.reasons],
            np.concatenate([block.times for block in blocks]),
            {
                name: np.concatenate([block.measures[name] for block in blocks])
                for name in blocks[0].measures
            },
        )

    @property
    def columns(self) -> list[Any]:
        """What stands behind the values of the variables in a table of results."""
        return [self.status, self.reasons, self.times, *self.measures.values()]


class _Sample(NamedTuple):
    """A row of the samples, with its model and its initial state (y,)."""

    place: int
    variant: Variant
    start: Floats


class _Look:
    """What is looked at in the runs of models of one structure.

    Args:
        plan: that asks for it.
        engine: of a model of that structure.

    Raises:
        OsimliteError: the model has nothing of the kind.
    """

    def __init__(self, plan: Plan, engine: Any) -> None:
        self.measures = [measure(spec, engine, plan.feet) for spec in plan.measures]
        expressions = [
            spec for spec in plan.measures if plan.controller is not None and is_expression(spec)
        ]
        for spec in expressions:
            for name in sorted(Expression(spec, engine).names & list_driven_names(engine)):
                raise SettingError(
                    f"the measure '{spec}' looks at '{name}', which the controller has a part in; of runs with a "
                    "controller a sweep keeps states alone"
                )
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
            list({item.name: item for made in self.measures for item in made.watches}.values())
            + stops
        )
        if self.watches and plan.engine != "compiled":
            raise SettingError("what stops a run needs --engine compiled")
        # Without room for events, none is looked for.
        rooms = [made.room(plan.to) for made in self.measures]
        self.most_events = max([*rooms, 1 if self.watches else 0])


class Runner:
    """Runs samples; for one thread.

    Args:
        plan: whose.

    Raises:
        OsimliteError: the model cannot be simulated, or has no such measure.
    """

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.variants = Variants(plan)
        given = self.variants.given
        self._looks: dict[bytes, _Look] = {given.structure: _Look(plan, given.engine)}
        moments = [] if plan.interval is None else compute_report_times(plan.to, plan.interval)
        self._report_times = np.array(moments)

    def run(self, values: Floats) -> Block:
        """Run samples (k, d); a run that fails is told of, not raised."""
        started = time.perf_counter()
        count = len(values)
        block = Block(
            [FAILED] * count,
            [None] * count,
            np.full(count, np.nan),
            {measure_name(spec): np.full(count, np.nan) for spec in self.plan.measures},
        )
        groups: dict[bytes, list[_Sample]] = {}
        for index, row in enumerate(values.tolist()):
            try:
                variant = self.variants.variant(row)
                start = self.variants.start(variant, row)
            except OsimliteError as error:
                block.reasons[index] = str(error)
            else:
                groups.setdefault(variant.structure, []).append(_Sample(index, variant, start))
        for group in groups.values():
            try:
                self._run(group, values, block)
            except OsimliteError as error:
                # What is asked for may mean nothing in a model of another structure.
                for sample in group:
                    block.status[sample.place], block.reasons[sample.place] = FAILED, str(error)
        # A measure may have failed after others had been taken.
        failed = [index for index in range(count) if block.status[index] == FAILED]
        for column in block.measures.values():
            column[failed] = np.nan
        return replace(block, seconds=time.perf_counter() - started)

    def _run(self, group: Sequence[_Sample], values: Floats, block: Block) -> None:
        """Run samples whose models have one structure."""
        # Any of the same structure will do, and making one takes time.
        given, first = self.variants.given, group[0].variant
        engine = (given if first.structure == given.structure else first).engine
        look = self._look(first.structure, engine)
        variants = [sample.variant for sample in group]
        starts = self.variants.place_states(
            engine, variants, np.stack([sample.start for sample in group])
        )
        runs, why = self._simulate(engine, look, variants, starts)
        for number, sample in enumerate(group):
            block.status[sample.place], block.reasons[sample.place] = why[number]
            block.times[sample.place] = runs.times[number]
        good = np.array(
            [number for number, (status, _) in enumerate(why) if status != FAILED], dtype=int
        )
        if len(good) == 0:
            return
        chosen = [group[number].variant for number in good]
        rows = np.array([group[number].place for number in good])
        batch = Batch(
            engine,
            lambda number: chosen[number].engine,
            self._numbers(chosen),
            starts[good],
            runs.select(good),
            values[rows],
            [item.name for item in self.plan.variables],
            self._report_times,
        )
        for made in look.measures:
            self._measure(made, batch, rows, block)

    def _look(self, structure: bytes, engine: Any) -> _Look:
        result = self._looks.get(structure)
        if result is None:
            if len(self._looks) >= MOST_KEPT:
                self._looks = {}
            result = self._looks[structure] = _Look(self.plan, engine)
        return result

    def _measure(self, made: Measure, batch: Batch, rows: Any, block: Block) -> None:
        """Fill in a measure of some runs; a function of a user may raise anything, which is told of."""
        try:
            block.measures[made.name][rows] = made.of(batch)
        except Exception as error:
            if len(rows) > 1:
                # One by one, to find which run it is.
                for number, row in enumerate(rows):
                    self._measure(made, batch.part(number), np.array([row]), block)
            else:
                block.status[rows[0]] = FAILED
                block.reasons[rows[0]] = (
                    f"the measure '{made.name}' failed with {type(error).__name__}: {error}"
                )

    # --------------------------------------------------------------------------------------------- motions
    def _simulate(
        self, engine: Any, look: _Look, variants: Sequence[Variant], starts: Floats
    ) -> tuple[Runs, Endings]:
        if self.plan.engine != "compiled":
            return self._one_by_one(engine, variants, starts)
        from osimlite.simulation.batches import ENDINGS, run_many

        runs = run_many(
            engine,
            starts,
            self.plan.to,
            numbers=self._numbers(variants),
            **self.plan.integration_choices(),
            report_times=self._report_times.tolist(),
            watches=look.watches,
            most_events=look.most_events,
            event_states=any(made.event_states for made in look.measures),
            most_tries=MOST_TRIES,
            threads=1,
            held=[variant.held for variant in variants if variant.held is not None],
        )
        why: Endings = []
        for number, (ending, state) in enumerate(
            zip(runs.endings.tolist(), runs.states, strict=True)
        ):
            words, t = ENDINGS[ending], runs.times[number]
            if words == "done" and np.isfinite(state).all():
                why.append((DONE, None))
            elif words == "stopped":
                why.append((STOPPED, self._find_stop(engine, look, runs.events[number], state)))
            elif words == "too many steps":
                why.append(
                    (
                        FAILED,
                        f"{MOST_TRIES} steps came no further than t = {t:.9g} s; ask for less accuracy",
                    )
                )
            else:
                why.append(
                    (
                        FAILED,
                        f"the motion cannot be computed beyond t = {t:.9g} s; ask for more accuracy",
                    )
                )
        return runs, why

    def _numbers(self, variants: Sequence[Variant]) -> Floats | None:
        return (
            None if self.variants.is_fixed else np.stack([variant.numbers for variant in variants])
        )

    def _find_stop(
        self, engine: Any, look: _Look, events: Sequence[tuple[float, str, bool]], state: Floats
    ) -> str:
        """The watch that ended a run: the last event, if there was room for it, or the level that the state is at."""
        last = events[-1][1] if events else ""
        if any(watch.stops and watch.name == last for watch in look.watches):
            return last
        y = State(engine, state)
        names = {stop.words: abs(y[stop.coordinate] - stop.level) for stop in self.plan.stops}
        return min(names, key=lambda name: names[name])

    def _one_by_one(
        self, engine: Any, variants: Sequence[Variant], starts: Floats
    ) -> tuple[Runs, Endings]:
        """With an engine that computes one motion at a time."""
        plan = self.plan
        why: Endings = []
        order, contacts = engine.order, engine.contacts
        count, size = len(order), len(starts)
        times, states = np.zeros(size), starts.copy()
        reports = np.full((size, len(self._report_times), starts.shape[1]), np.nan)
        events: list[list[tuple[float, str, bool]]] = [[] for _ in range(size)]
        peaks = np.zeros((size, len(contacts), 2))
        for number, variant in enumerate(variants):
            simulation = variant.simulation
            assert simulation is not None
            infos = [simulation.mechanism.coordinates[place] for place in order]
            may = [k for k, info in enumerate(infos) if info.prescribed is None and not info.locked]
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
                    initial={infos[k].path: row[k] for k in may} | auxiliary,
                    initial_speeds={infos[k].path: row[count + k] for k in may},
                )
            except OsimliteError as error:
                why.append((FAILED, str(error)))
                continue
            why.append((DONE, None))
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
        still = np.zeros(size, dtype=np.int64)
        return Runs(
            times, states, still, np.zeros((size, 3), dtype=np.int64), reports, events, peaks
        ), why
