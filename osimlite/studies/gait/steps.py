"""Steps, scuffs and falls of a walk.

A step is the other foot touching down far enough ahead along the slope after long enough in the
air. Any other touch-down is a scuff. Anything but a foot on the ground ends the walk.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.records import dataclass, field
from osimlite.simulation.batches import (
    ENDINGS,
    UNLIMITED_TRIES,
    BatchEngine,
    Floats,
    Runs,
    Watch,
    run_many,
)
from osimlite.simulation.options import DEFAULT_ACCURACY
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing

SHORTEST = 0.05
"""How far ahead of the other a foot touches down in a step, at least, m."""

QUICKEST = 0.05
"""How long it has been in the air before, at least, s."""

FALL = "fall: "
"""What the events that end a walk are called, before the name of the contact."""

EVENTS_PER_SECOND = 60
"""Room for events; a walk that has more rattles on the ground."""


class Step(NamedTuple):
    """One step."""

    time: float  # of touch-down, s
    foot: int  # that touches down
    length: float  # how far ahead of the other foot, along the slope, m
    air: float  # how long it was in the air, s
    state: Floats  # at touch-down, in the engine's order (y,)


class Scuff(NamedTuple):
    """A touch-down that is no step; fields as those of `Step`."""

    time: float
    foot: int
    length: float
    air: float


@dataclass
class Walk:
    """What became of a walker."""

    end: float = 0.0  # when the walk or the simulation ended, s
    # "walking" if it was still on its feet, "fell", or why the simulation ended
    ending: str = "walking"
    fell_on: str = ""  # contact that ended the walk
    steps: list[Step] = field(default_factory=list)  # in the order of time
    scuffs: list[Scuff] = field(default_factory=list)  # likewise
    distance: float = 0.0  # from the first touch-down of all to the last step, along the slope, m

    @property
    def walks(self) -> bool:
        """Whether it never fell."""
        return self.ending == "walking"

    @property
    def clean_steps(self) -> int:
        """How many steps were made before the first scuff."""
        first = self.scuffs[0].time if self.scuffs else np.inf
        return sum(step.time < first for step in self.steps)


def make_fall_watches(footing: FootContacts) -> list[Watch]:
    """Watches that stop a run where the walk ends."""
    return [Watch(f"{FALL}{contact}", contact=contact, stops=1) for contact in footing.falls]


def room_for(to: float) -> int:
    """How many events to leave room for in a walk of so many seconds."""
    return 40 + round(EVENTS_PER_SECOND * to)


def walk_many(
    engine: BatchEngine,
    states: ArrayLike,
    to: float,
    *,
    footing: FootContacts | None = None,
    numbers: ArrayLike | None = None,
    accuracy: float = DEFAULT_ACCURACY,
    most_tries: int = UNLIMITED_TRIES,
    threads: int | None = None,
) -> list[Walk]:
    """Let many walkers walk.

    Args:
        engine: of the model.
        states: where they start (W, y), in the engine's order.
        to: how long they walk, s, if they do not fall.
        footing: their feet; looked for if left out.
        numbers: of models of the same structure, one row for each walker, see `run_many`.
        accuracy: of the integrator.
        most_tries: steps of the integrator that a walker may try.
        threads: how many work; by default one for each core.

    Raises:
        OsimliteError: the model has no two feet, or the states do not fit.
    """
    feet = footing or find_footing(engine)
    runs = run_many(
        engine,
        states,
        to,
        numbers=numbers,
        accuracy=accuracy,
        watches=make_fall_watches(feet),
        most_events=room_for(to),
        event_states=True,
        most_tries=most_tries,
        threads=threads,
    )
    return walks_of(engine, states, runs, feet, numbers=numbers, room=room_for(to))


def walks_of(
    engine: BatchEngine,
    states: ArrayLike,
    runs: Runs,
    footing: FootContacts,
    *,
    numbers: ArrayLike | None = None,
    room: int | None = None,
) -> list[Walk]:
    """Find the steps and the falls of runs that kept the states at their events.

    Args:
        engine: of the model.
        states: where the runs started (W, y).
        runs: made with the watches of `make_fall_watches`, among others.
        footing: their feet.
        numbers: as given to `run_many`.
        room: for events that the runs had; with as many events a walk is given up as too restless.
    """
    starts = np.array(states, dtype=np.float64, order="C")
    vectors = np.array(engine.numbers if numbers is None else numbers, dtype=np.float64, order="C")
    vectors = vectors.reshape(-1, vectors.shape[-1])
    row_of = np.arange(len(starts)) if len(vectors) > 1 else np.zeros(len(starts), dtype=np.int64)
    counts = [len(events) for events in runs.events]
    moments = np.concatenate([starts, *runs.event_states])
    rows = np.concatenate([row_of, np.repeat(row_of, counts)]).astype(np.int64)
    reached, depths = measure_along_slope(engine, moments, vectors, rows)
    fatal = np.array([engine.contacts.index(contact) for contact in footing.falls], dtype=np.int64)
    ends = np.cumsum([len(starts), *counts])
    result = []
    for k, events in enumerate(runs.events):
        part = slice(ends[k], ends[k + 1])
        if (depths[k, fatal] > 0.0).any():
            contact = footing.falls[int(np.argmax(depths[k, fatal]))]
            result.append(Walk(0.0, "fell", contact))
            continue
        walk = follow_events(
            footing, engine.contacts, events, runs.event_states[k], reached[part], depths[k] > 0.0
        )
        if walk.walks:
            ending = ENDINGS[int(runs.endings[k])]
            walk.end = float(runs.times[k])
            walk.ending = "walking" if ending == "done" else ending
            if room is not None and counts[k] >= room:
                walk.ending = "too many events"
        result.append(walk)
    return result


def follow_events(
    footing: FootContacts,
    contacts: Sequence[str],
    events: Sequence[tuple[float, str, bool]],
    states: Floats,
    reached: Floats,
    touching: NDArray[np.bool_],
) -> Walk:
    """Go through the events of one run, which may come from any simulation.

    Args:
        footing: the feet.
        contacts: names of the columns (P).
        events: in the order of time: time (s), contact, whether it begins.
        states: at the events (as many, any number of columns).
        reached: how far down the slope each contact is at the events (as many, P), m.
        touching: which contacts push at the start (P,).
    """
    places = {name: index for index, name in enumerate(contacts)}
    feet = [np.array([places[contact] for contact in foot]) for foot in footing.feet]
    walk, foot_of = Walk(), footing.foot_of
    down = [{name for name in foot if touching[places[name]]} for foot in footing.feet]
    lifted = [0.0] * len(feet)
    last, first_place = -1, None
    for (time, name, begins), state, along in zip(events, states, reached, strict=True):
        if name.startswith(FALL) or (begins and name in footing.falls):
            walk.end, walk.ending, walk.fell_on = time, "fell", name.removeprefix(FALL)
            break
        if name not in foot_of:
            continue
        number = foot_of[name]
        if not begins:
            down[number].discard(name)
            if not down[number]:
                lifted[number] = time
            continue
        was_down = bool(down[number])
        down[number].add(name)
        if was_down:
            continue
        here = float(along[places[name]])
        others = [
            float(along[foot].max())
            for other, foot in enumerate(feet)
            if other != number and down[other]
        ]
        # With no foot on the ground, the one that made the last step is what the step is measured
        # from.
        behind = (
            max(others)
            if others
            else float(along[feet[last]].max())
            if 0 <= last != number
            else here
        )
        length, air = here - behind, time - lifted[number]
        if first_place is None:
            first_place = here
        if number != last and length >= SHORTEST and air >= QUICKEST:
            walk.steps.append(Step(time, number, length, air, state))
            walk.distance = here - first_place
            last = number
        else:
            walk.scuffs.append(Scuff(time, number, length, air))
    return walk


def measure_along_slope(
    engine: BatchEngine,
    states: Floats,
    vectors: Floats | None = None,
    rows: ArrayLike | None = None,
) -> tuple[Floats, Floats]:
    """How far down the slope the spheres of the contacts are, and how deep in the ground.

    Down the slope is where gravity pulls along the plane; on level ground it is along +x of ground.

    Args:
        engine: of the model.
        states: (k, y).
        vectors: numbers of models of the same structure (v, m); by default the engine's own.
        rows: which of them each state goes with (k,).

    Returns:
        Positions of the centres (k, P) from ground's origin, m, and depths (k, P), m.
    """
    table = np.array(engine.numbers if vectors is None else vectors, dtype=np.float64, order="C")
    table = table.reshape(-1, table.shape[-1])
    which = (
        np.zeros(len(states), dtype=np.int64) if rows is None else np.array(rows, dtype=np.int64)
    )
    places = engine.locate_contacts(states, table, which)
    origin, normal, center = places[..., :3], places[..., 3:6], places[..., 6:]
    gravity = table[:, :3]
    pull = (
        gravity[which][:, None, :]
        - np.sum(gravity[which][:, None, :] * normal, axis=2, keepdims=True) * normal
    )
    slope = np.linalg.norm(pull, axis=2)
    level = slope < 1e-6 * np.maximum(np.linalg.norm(gravity, axis=1)[which], 1e-12)[:, None]
    forward = np.array((1.0, 0.0, 0.0)) - normal[..., :1] * normal
    along = np.where(level[..., None], forward, pull)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    radii = engine.get_contact_radii(table)[which]
    return np.sum(center * along, axis=2), radii - np.sum((center - origin) * normal, axis=2)
