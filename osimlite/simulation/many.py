"""Many motions at once: walkers that differ in their starts or in their numbers, on all cores.

Every run has its own steps, and comes out the same whatever runs beside it and on however many threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import OsimliteError
from osimlite.simulation.engines.compiled import NO_LIMIT, CompiledEngine, compiled
from osimlite.simulation.integrators import DEFAULT_ACCURACY, INITIAL_STEP
from osimlite.simulation.kernels import merson
from osimlite.simulation.kernels.arrays import Floats, Ints
from osimlite.text import did_you_mean

AT_ONCE = 8
"""So many runs a thread takes at a time."""

ENDINGS = {
    merson.DONE: "done",
    merson.FAILED: "failed",
    merson.STOPPED: "stopped",
    merson.TOO_MANY: "too many steps",
}
"""How a run ended, in words."""


class Watch(NamedTuple):
    """A level that a run is watched for passing.

    Attributes:
        name: what the event is called.
        coordinate: name or path of the coordinate that is watched, or
        contact: name of the contact (of the engine's `contacts`) that is, which is above its level while it pushes, or
        body: name or path of the body (or frame) of which a point is watched, with
        station: the point in it (m), and
        direction: along which in ground its position counts.
        level: what is passed, rad or m.
        stops: -1 if falling below ends the run, 1 if rising above does, 0 if neither.
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
    """W runs of n degrees of freedom.

    Attributes:
        times: at which the runs ended (W,), s.
        states: in which (W, 2n), in the engine's order.
        endings: how, see `ENDINGS` (W,).
        counts: steps taken, steps tried, evaluations (W, 3).
        reports: states at the report times (W, r, 2n); not a number after the end of a run.
        events: of each run its events in the order of time: time (s), name, whether it begins or rises.
        peaks: largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2).
        event_states: of each run the states at its events (as many as events, 2n), if they were asked for.
    """

    times: Floats
    states: Floats
    endings: Ints
    counts: Ints
    reports: Floats
    events: list[list[tuple[float, str, bool]]]
    peaks: Floats
    event_states: list[Floats] = field(default_factory=list)


def run_many(
    engine: CompiledEngine,
    states: ArrayLike,
    to: float = 2.0,
    *,
    numbers: ArrayLike | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    report_times: Sequence[float] = (),
    watches: Sequence[Watch] = (),
    most_events: int = 0,
    event_states: bool = False,
    most_tries: int = NO_LIMIT,
    threads: int | None = None,
) -> Runs:
    """Simulate from many states.

    Args:
        engine: of the model.
        states: where the runs start (W, 2n), in the engine's order.
        to: when they end unless a watch stops them, s.
        numbers: `engine.numbers` of models of the same structure, one row for each run; by default the engine's own.
        accuracy: of the integrator.
        report_times: increasing, s.
        watches: what else is an event, besides contacts that begin and end.
        most_events: room for the events of a run; those beyond it are lost.
        event_states: keep the states at the events.
        most_tries: steps that a run may try.
        threads: how many work; by default one for each core.

    Raises:
        OsimliteError: the shapes do not fit, or a watch names nothing or a locked coordinate.
        ModelError: a watch names what does not exist.
    """
    starts = np.array(states, dtype=np.float64, order="C")
    size = 2 * len(engine.order)
    if starts.ndim != 2 or starts.shape[1] != size:
        raise OsimliteError(f"the states are one row of {size} numbers for each run; got {starts.shape}")
    vectors = np.array(engine.numbers if numbers is None else numbers, dtype=np.float64, order="C")
    vectors = vectors.reshape(-1, vectors.shape[-1])
    count = len(starts)
    if vectors.shape not in ((1, len(engine.numbers)), (count, len(engine.numbers))):
        raise OsimliteError(
            f"the numbers are one row of {len(engine.numbers)} for each of the {count} runs; got {vectors.shape}"
        )
    kinds, levels = _watches(engine, watches)
    pairs = len(engine.contacts)
    moments = np.array(report_times, dtype=np.float64)
    clocks = np.tile((0.0, INITIAL_STEP), (count, 1))
    counts, endings = np.zeros((count, 6), dtype=np.int64), np.zeros(count, dtype=np.int64)
    reports = np.full((count, len(moments), size), np.nan)
    events = np.zeros((count, most_events, 3 + size * event_states))
    peaks, control = np.zeros((count, pairs, 2)), engine.control(to, accuracy, most_tries)
    run_several, no_log, no_forces = compiled(merson.run_several), np.zeros((1, 0, 0)), np.zeros((1, 0, pairs, 3))

    def work(first: int) -> None:
        run_several(
            engine.structure, vectors, clocks, counts, starts, control, moments, reports, events, peaks, kinds,
            levels, no_log, no_forces, endings, first, min(first + AT_ONCE, count),
        )  # fmt: skip

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        list(pool.map(work, range(0, count, AT_ONCE)))
    names = [*engine.contacts, *(watch.name for watch in watches)]
    kept = [rows[:total] for rows, total in zip(events, counts[:, merson.EVENTS], strict=True)]
    named = [[(t, names[int(number)], begins > 0.0) for t, number, begins in rows[:, :3].tolist()] for rows in kept]
    at_events = [rows[:, 3:] for rows in kept] if event_states else []
    return Runs(clocks[:, 0].copy(), starts, endings, counts[:, :3].copy(), reports, named, peaks, at_events)


def _watches(engine: CompiledEngine, watches: Sequence[Watch]) -> tuple[Ints, Floats]:
    kinds, levels = np.zeros((len(watches), 3), dtype=np.int64), np.zeros((len(watches), 7))
    mechanism = engine.mechanism
    for row, watch in enumerate(watches):
        if bool(watch.coordinate) + bool(watch.body) + bool(watch.contact) != 1:
            raise OsimliteError(f"the watch '{watch.name}' is on a coordinate, a body or a contact; name one of them")
        if watch.coordinate:
            place = mechanism.coordinate_index(watch.coordinate)
            if place not in engine.order:
                raise OsimliteError(f"the watch '{watch.name}' looks at '{watch.coordinate}', which is locked")
            kinds[row] = merson.COORDINATE, engine.order.index(place), watch.stops
            levels[row, 6] = watch.level
        elif watch.contact:
            if watch.contact not in engine.contacts:
                near = did_you_mean(watch.contact, engine.contacts)
                raise OsimliteError(f"the model has no contact '{watch.contact}'{near}")
            kinds[row] = merson.TOUCH, engine.contacts.index(watch.contact), watch.stops
        else:
            body, frame = mechanism.placement(watch.body)
            link, placed = (-1, np.eye(4)) if body < 0 else engine.placements[body]
            station = (placed @ frame @ np.array((*watch.station, 1.0)))[:3]
            kinds[row] = merson.HEIGHT, link, watch.stops
            levels[row] = (*station, *watch.direction, watch.level)
    return kinds, levels
