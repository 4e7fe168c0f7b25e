"""Runs samples of a plan: what every thread and every process of a sweep does."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.run import report_times
from osimlite.simulation.runs import Runs, Watch
from osimlite.sweep.measures import Batch, Measure, State, measure, measure_name
from osimlite.sweep.plan import MOST_TRIES, Plan
from osimlite.sweep.renewal import Variant
from osimlite.sweep.variables import Floats
from osimlite.sweep.variants import Variants

DONE, STOPPED, FAILED = "done", "stopped", "failed"

Endings = list[tuple[str, str | None]]
"""How each run ended, and why."""


@dataclass(frozen=True)
class Block:
    """What came of some samples, in their order.

    Attributes:
        status: of each, `DONE`, `STOPPED` (by what the plan watches) or `FAILED`.
        reasons: why it stopped or failed, else None.
        times: at which it ended, s.
        measures: by name (k,); not a number where there is none.
        seconds: that the work took.
    """

    status: list[str]
    reasons: list[str | None]
    times: Floats
    measures: dict[str, Floats]
    seconds: float


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
        self.measures = [measure(spec, self.variants.given.engine) for spec in plan.measures]
        stops = [
            Watch(stop.words, coordinate=stop.coordinate, level=stop.level, stops=-1 if stop.is_below else 1)
            for stop in plan.stops
        ]
        self._watches = list({item.name: item for made in self.measures for item in made.watches}.values()) + stops
        if self._watches and plan.engine != "compiled":
            raise SettingError("what stops a run needs --engine compiled")
        # Without room for events, none is looked for.
        rooms = [made.room(plan.to) for made in self.measures]
        self._most_events = max([*rooms, 1 if self._watches else 0])
        moments = [] if plan.report_interval is None else report_times(plan.to, plan.report_interval)
        self._report_times = np.array(moments)

    def run(self, values: Floats) -> Block:
        """Run samples (k, d); a run that fails is told of, not raised."""
        started = time.perf_counter()
        count = len(values)
        status, times = [FAILED] * count, np.full(count, np.nan)
        reasons: list[str | None] = [None] * count
        measures = {measure_name(spec): np.full(count, np.nan) for spec in self.plan.measures}
        groups: dict[bytes, list[tuple[int, Variant]]] = {}
        for place, row in enumerate(values.tolist()):
            try:
                variant = self.variants.variant(row)
            except OsimliteError as error:
                reasons[place] = str(error)
            else:
                groups.setdefault(variant.structure, []).append((place, variant))
        for group in groups.values():
            places = [place for place, _ in group]
            starts = np.stack([self.variants.start(variant, values[place]) for place, variant in group])
            # Any of the same structure will do, and making one takes time.
            given = self.variants.given
            leading = given if group[0][1].structure == given.structure else group[0][1]
            runs, why = self._simulate(leading.engine, [variant for _, variant in group], starts)
            for number, place in enumerate(places):
                status[place], reasons[place] = why[number]
                times[place] = runs.times[number]
            good = np.array([number for number, place in enumerate(places) if status[place] != FAILED], dtype=int)
            if len(good) == 0:
                continue
            chosen = [group[number][1] for number in good]
            batch = Batch(
                leading.engine,
                partial(_engine, chosen),
                self._numbers(chosen),
                starts[good],
                _chosen(runs, good),
                values[places][good],
                [item.name for item in self.plan.variables],
                self._report_times,
            )
            rows = np.array(places)[good]
            for made in self.measures:
                self._measure(made, batch, rows, measures[made.name], status, reasons)
        # A measure may have failed after others had been taken.
        failed = [place for place in range(count) if status[place] == FAILED]
        for column in measures.values():
            column[failed] = np.nan
        return Block(status, reasons, times, measures, time.perf_counter() - started)

    def _measure(
        self,
        made: Measure,
        batch: Batch,
        rows: Any,
        column: Floats,
        status: list[str],
        reasons: list[str | None],
    ) -> None:
        """Fill in a measure of some runs; a function of a user may raise anything, which is told of."""
        try:
            column[rows] = made.of(batch)
        except Exception as error:
            if len(rows) > 1:
                # One by one, to find which run it is.
                for number, row in enumerate(rows):
                    self._measure(made, _part(batch, number), np.array([row]), column, status, reasons)
            else:
                status[rows[0]] = FAILED
                reasons[rows[0]] = f"the measure '{made.name}' failed with {type(error).__name__}: {error}"

    # --------------------------------------------------------------------------------------------- motions
    def _simulate(self, engine: Any, variants: Sequence[Variant], starts: Floats) -> tuple[Runs, Endings]:
        if self.plan.engine != "compiled":
            return self._one_by_one(engine, variants, starts)
        from osimlite.simulation.many import ENDINGS, run_many

        runs = run_many(
            engine,
            starts,
            self.plan.to,
            numbers=self._numbers(variants),
            accuracy=self.plan.accuracy,
            report_times=self._report_times.tolist(),
            watches=self._watches,
            most_events=self._most_events,
            event_states=any(made.event_states for made in self.measures),
            most_tries=MOST_TRIES,
            threads=1,
        )
        finite = [bool(np.isfinite(state).all()) for state in runs.states]
        why = [
            self._ending(ENDINGS[int(runs.endings[number])], runs, number, finite[number])
            for number in range(len(starts))
        ]
        return runs, why

    def _numbers(self, variants: Sequence[Variant]) -> Floats | None:
        return None if self.variants.is_fixed else np.stack([variant.numbers for variant in variants])

    def _ending(self, ending: str, runs: Runs, number: int, is_finite: bool) -> tuple[str, str | None]:
        t = runs.times[number]
        if ending == "done" and is_finite:
            return DONE, None
        if ending == "stopped":
            return STOPPED, self._what_stopped(runs.events[number], runs.states[number])
        if ending == "too many steps":
            return FAILED, f"{MOST_TRIES} steps came no further than t = {t:.9g} s; ask for less accuracy"
        return FAILED, f"the motion cannot be computed beyond t = {t:.9g} s; ask for more accuracy"

    def _what_stopped(self, events: Sequence[tuple[float, str, bool]], state: Floats) -> str:
        """The watch that ended a run: the last event, if there was room for it, or the level that the state is at."""
        last = events[-1][1] if events else ""
        if any(watch.stops and watch.name == last for watch in self._watches):
            return last
        y = State(self.variants.given.engine, state)
        names = {stop.words: abs(y[stop.coordinate] - stop.level) for stop in self.plan.stops}
        return min(names, key=lambda name: names[name])

    def _one_by_one(self, engine: Any, variants: Sequence[Variant], starts: Floats) -> tuple[Runs, Endings]:
        """With an engine that computes one motion at a time."""
        plan = self.plan
        why: Endings = []
        order, contacts = engine.order, engine.contacts
        count, size = len(order), len(starts)
        times, states = np.zeros(size), starts.copy()
        reports = np.full((size, len(self._report_times), 2 * count), np.nan)
        events: list[list[tuple[float, str, bool]]] = [[] for _ in range(size)]
        peaks = np.zeros((size, len(contacts), 2))
        for number, variant in enumerate(variants):
            simulation = variant.simulation
            assert simulation is not None
            paths = [simulation.mechanism.coordinates[place].path for place in order]
            row = starts[number].tolist()
            try:
                trajectory = simulation.run(
                    plan.to,
                    accuracy=plan.accuracy,
                    report_interval=plan.report_interval or plan.to,
                    initial=dict(zip(paths, row[:count], strict=True)),
                    initial_speeds=dict(zip(paths, row[count:], strict=True)),
                )
            except OsimliteError as error:
                why.append((FAILED, str(error)))
                continue
            why.append((DONE, None))
            history = np.concatenate((trajectory.values[:, list(order)], trajectory.speeds[:, list(order)]), axis=1)
            times[number], states[number] = trajectory.times[-1], history[-1]
            if len(self._report_times):
                reports[number] = history
            summary = trajectory.summary
            events[number] = [
                (event["time_s"], event["contact"], event["event"] == "begin") for event in summary["contact_events"]
            ]
            for name, largest in summary["largest_contact_forces"].items():
                peaks[number, contacts.index(name)] = largest["force_N"], largest["time_s"]
        still = np.zeros(size, dtype=np.int64)
        return Runs(times, states, still, np.zeros((size, 3), dtype=np.int64), reports, events, peaks), why


def _engine(variants: Sequence[Variant], place: int) -> Any:
    return variants[place].engine


def _chosen(runs: Runs, places: Any) -> Runs:
    return Runs(
        runs.times[places],
        runs.states[places],
        runs.endings[places],
        runs.counts[places],
        runs.reports[places],
        [runs.events[place] for place in places],
        runs.peaks[places],
        [runs.event_states[place] for place in places] if runs.event_states else [],
    )


def _part(batch: Batch, place: int) -> Batch:
    """One run of several."""
    places = np.array([place])
    return Batch(
        batch.engine,
        lambda number: batch.engine_of(place),
        None if batch.numbers is None else batch.numbers[places],
        batch.starts[places],
        _chosen(batch.runs, places),
        batch.values[places],
        batch.names,
        batch.report_times,
    )
