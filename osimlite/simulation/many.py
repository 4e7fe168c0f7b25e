"""Many motions at once: walkers that differ in their starts or in their numbers, on all cores.

Every run has its own steps, and comes out the same whatever runs beside it and on however many threads.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from osimlite.errors import OsimliteError, SettingError
from osimlite.simulation.engines.batch import NO_LIMIT, Batch
from osimlite.simulation.engines.compiled import CompiledEngine
from osimlite.simulation.integrators import DEFAULT_ACCURACY
from osimlite.simulation.kernels import layout, merson
from osimlite.simulation.kernels.contacts import RADIUS
from osimlite.simulation.kernels.pointers import Floats, Ints
from osimlite.simulation.runs import Runs, Watch
from osimlite.text import did_you_mean

__all__ = ["ENDINGS", "Runs", "Watch", "run_many"]

AT_ONCE = 8
"""So many runs a thread takes at a time."""

ENDINGS = {
    merson.DONE: "done",
    merson.FAILED: "failed",
    merson.STOPPED: "stopped",
    merson.TOO_MANY: "too many steps",
}
"""How a run ended, in words."""


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
        states: where the runs start (W, y), in the engine's order.
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
        SettingError: a setting has no meaning.
        OsimliteError: the shapes do not fit, or a watch names nothing or a locked coordinate.
        ModelError: a watch names what does not exist.
    """
    starts = engine.state.table(states)
    _check_settings(to, accuracy, report_times, most_events, most_tries, threads)
    vectors, count = _rows(engine, numbers), len(starts)
    if vectors.shape not in ((1, len(engine.numbers)), (count, len(engine.numbers))):
        raise OsimliteError(
            f"the numbers are one row of {len(engine.numbers)} for each of the {count} runs; got {vectors.shape}"
        )
    kinds, levels = _watches(engine, watches)
    batch = Batch(
        engine,
        starts,
        to,
        accuracy,
        vectors=vectors,
        times=report_times,
        kinds=kinds,
        levels=levels,
        most_events=most_events,
        event_states=event_states,
        most_tries=most_tries,
    )

    def work(first: int) -> None:
        batch.run(first, min(first + AT_ONCE, count))

    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        list(pool.map(work, range(0, count, AT_ONCE)))
    names = [*engine.contacts, *(watch.name for watch in watches)]
    kept = [rows[:total] for rows, total in zip(batch.events, batch.counts[:, merson.EVENTS], strict=True)]
    named = [[(t, names[int(number)], begins > 0.0) for t, number, begins in rows[:, :3].tolist()] for rows in kept]
    at_events = [rows[:, 3:] for rows in kept] if event_states else []
    return Runs(
        batch.clocks[:, 0].copy(),
        batch.states,
        batch.endings,
        batch.counts[:, :3].copy(),
        batch.reports,
        named,
        batch.peaks,
        at_events,
    )


def _check_settings(
    to: float, accuracy: float, report_times: Sequence[float], most_events: int, most_tries: int, threads: int | None
) -> None:
    """SettingError for what has no meaning; the machine code might go on with it forever."""
    if not 0.0 < accuracy < 1.0:
        raise SettingError(f"the accuracy must lie between 0 and 1; {accuracy} does not")
    if not to >= 0.0:
        raise SettingError(f"the runs end at a time that is not negative, not at {to} s")
    if not all(one <= other for one, other in pairwise([0.0, *report_times])):
        raise SettingError("the report times do not increase from 0 on; sort them")
    for number, least, what in (
        (1 if threads is None else threads, 1, "threads"),
        (most_events, 0, "most_events"),
        (most_tries, 0, "most_tries"),
    ):
        if number < least:
            raise SettingError(f"{what} is at least {least}, not {number}")


def contact_places(
    engine: CompiledEngine, states: ArrayLike, numbers: ArrayLike | None = None, rows: ArrayLike | None = None
) -> Floats:
    """Where the surfaces of all contacts are: centre and normal of surface 1, centre of surface 2 (k, P, 9), in ground.

    Args:
        engine: of the model.
        states: (k, y).
        numbers: of models of the same structure (v, m); by default the engine's own.
        rows: which of them each state goes with (k,); by default the first.
    """
    vectors, given = _rows(engine, numbers), engine.state.table(states)
    which = np.zeros(len(given), dtype=np.int64) if rows is None else np.array(rows, dtype=np.int64)
    places = np.zeros((len(given), len(engine.contacts), 9))
    w, derivative = np.zeros(engine.structure[layout.WORK_SIZE]), np.zeros(engine.state.size)
    engine.program.code.entry("contact_places")(
        engine.program.ints,
        vectors,
        w,
        vectors.shape[1],
        which,
        given,
        derivative,
        places,
        len(given),
    )
    return places


def contact_radii(engine: CompiledEngine, numbers: ArrayLike | None = None) -> Floats:
    """Radius of surface 2 of each contact for each row of numbers (v, P), m."""
    s = engine.structure
    records = s[s[layout.CONTACT_AT] : s[layout.CONTACT_AT] + len(engine.contacts)]
    radii: Floats = _rows(engine, numbers)[:, s[records + layout.NUMBERS] + RADIUS]
    return radii


def _rows(engine: CompiledEngine, numbers: ArrayLike | None) -> Floats:
    vectors = np.array(engine.numbers if numbers is None else numbers, dtype=np.float64, order="C")
    return vectors.reshape(-1, vectors.shape[-1])


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
