"""What sweeps can ask of walkers: steps, scuffs, the time until the fall, which ends the run; a start on their feet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from osimlite.errors import SettingError
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.starts import lift_to_depth
from osimlite.studies.gait.starts import plant_feet as at_rest
from osimlite.studies.gait.steps import (
    SHORTEST,
    Walk,
    make_fall_watches,
    measure_along_slope,
    room_for,
    walks_of,
)
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.measures import Batch, Measure
from osimlite.studies.sweep.variables import Floats

PRESSED = 8e-4
"""So deep (m) in the ground is the foot of a walker that is planted: it touches beyond doubt, and little presses it."""


@registry.measure(is_maximized=True)
def steps(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """How many steps were made."""
    return _measure("steps", engine, feet, lambda walk: len(walk.steps))


@registry.measure()
def scuffs(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """How many touch-downs were no steps."""
    return _measure("scuffs", engine, feet, lambda walk: len(walk.scuffs))


@registry.measure(is_maximized=True)
def time_to_fall(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """When the walk ended, s; the end of the run for those that did not fall."""
    return _measure("time_to_fall", engine, feet, lambda walk: walk.end)


@registry.measure(is_maximized=True)
def progress(engine: Any, feet: Sequence[str] | None = None) -> Measure:
    """How many steps were made before the first scuff, and how near the next one was: what a search can climb.

    The part after the point is the mean of two numbers below one. One is how near the foot came to
    where its step would have counted, when it scuffed or the run ended: 1/2 if it lacked as much
    again as the shortest step. The other is how long it had gone on by then: 1/2 for a second.
    """
    footing = _footing("progress", engine, feet)
    contacts = [[engine.contacts.index(name) for name in foot] for foot in footing.feet]

    def numbers(batch: Batch) -> Floats:
        rows = None if batch.numbers is None else np.arange(len(batch.starts))
        along = measure_along_slope(batch.engine, batch.runs.states, batch.numbers, rows)[0]
        places = np.stack([along[:, foot].max(axis=1) for foot in contacts], axis=1)
        result = zip(_walks(footing, batch), places.tolist(), strict=True)
        return np.array([_progress(walk, ends) for walk, ends in result])

    return _made("progress", footing, numbers)


@registry.start
def planted(engine: Any, feet: Sequence[str] | None) -> registry.Place:
    """On the ground with the deeper foot, at rest there."""
    if engine.name != "compiled":
        raise SettingError("a walker is planted with --engine compiled only")
    footing = find_footing(engine, feet)

    def place(
        states: Floats, numbers: Floats | None, started: Callable[[Floats], Floats]
    ) -> Floats:
        resting = at_rest(engine, footing, states, numbers=numbers)
        return started(lift_to_depth(engine, footing, resting, PRESSED, -1, numbers=numbers))

    return place


def _progress(walk: Walk, places: Sequence[float]) -> float:
    if walk.scuffs:
        until, lead = walk.scuffs[0].time, walk.scuffs[0].length
    else:
        until, last = walk.end, walk.steps[-1].foot if walk.steps else int(np.argmax(places))
        lead = max(place for foot, place in enumerate(places) if foot != last) - places[last]
    near = SHORTEST / (SHORTEST + max(SHORTEST - lead, 0.0))
    return walk.clean_steps + 0.5 * (near + until / (until + 1.0))


def _measure(
    name: str, engine: Any, feet: Sequence[str] | None, number: Callable[[Walk], float]
) -> Measure:
    footing = _footing(name, engine, feet)
    return _made(
        name,
        footing,
        lambda batch: np.array([number(walk) for walk in _walks(footing, batch)], float),
    )


def _footing(name: str, engine: Any, feet: Sequence[str] | None) -> FootContacts:
    if engine.name != "compiled":
        raise SettingError(f"the measure '{name}' needs --engine compiled")
    return find_footing(engine, feet)


def _made(name: str, footing: FootContacts, numbers: Callable[[Batch], Floats]) -> Measure:
    return Measure(name, numbers, tuple(make_fall_watches(footing)), room_for, True)


def _walks(footing: FootContacts, batch: Batch) -> list[Walk]:
    walks: list[Walk] | None = batch.memory.get("walks")
    if walks is None:
        walks = walks_of(batch.engine, batch.starts, batch.runs, footing, numbers=batch.numbers)
        batch.memory["walks"] = walks
    return walks
