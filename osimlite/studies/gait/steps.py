"""Steps, scuffs and falls of walks, from the contact events of simulations.

A step is a touch-down of the other foot, far enough ahead along the slope and after long enough in
the air. Any other touch-down of a foot is a scuff. Ground contact of anything but a foot is a fall
and ends the walk.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.base.named_tuples import NamedTuple
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

MIN_STEP_LENGTH_M = 0.05
"""Shortest distance (m) by which a foot touches down ahead of the other in a step."""

MIN_AIR_TIME_S = 0.05
"""Shortest time (s) that a foot is in the air before a step; less is a bounce."""

FALL_PREFIX = "fall: "
"""Prefix of the names of the watches that end a walk, before the name of the contact."""

EVENTS_PER_SECOND = 60
"""Memory for contact events per second; a walk with more rattles on the ground."""


class GaitStep(NamedTuple):
    """Touch-down that counts as a step.

    Attributes:
        time: time of touch-down (s).
        foot: index of the foot.
        length: distance ahead of the other foot along the slope (m).
        air: time that the foot was in the air (s).
        state: state at touch-down, in the order of the engine (y,).
    """

    time: float
    foot: int
    length: float
    air: float
    state: Floats


class Scuff(NamedTuple):
    """Touch-down that does not count as a step.

    Attributes:
        time: time of touch-down (s).
        foot: index of the foot.
        length: distance ahead of the other foot along the slope (m).
        air: time that the foot was in the air (s).
    """

    time: float
    foot: int
    length: float
    air: float


@dataclass
class WalkerSteps:
    """Walk of one walker.

    Attributes:
        end: time at which the walk or the simulation ended (s).
        ending: "walking" without a fall, "fell", or why the simulation ended.
        fell_on: contact that ended the walk, or "".
        steps: steps in the order of time.
        scuffs: scuffs in the order of time.
        distance: distance along the slope from the first touch-down of all to the last step (m).
    """

    end: float = 0.0
    ending: str = "walking"
    fell_on: str = ""
    steps: list[GaitStep] = field(default_factory=list)
    scuffs: list[Scuff] = field(default_factory=list)
    distance: float = 0.0

    @property
    def walks(self) -> bool:
        """True if the walker was still walking at the end of the simulation."""
        return self.ending == "walking"

    @property
    def clean_steps(self) -> int:
        """Number of steps before the first scuff."""
        first_scuff_time = self.scuffs[0].time if self.scuffs else np.inf
        return sum(step.time < first_scuff_time for step in self.steps)


def make_fall_watches(footing: FootContacts) -> list[Watch]:
    """Return watches that stop a run at a fall."""
    return [
        Watch(f"{FALL_PREFIX}{contact}", contact=contact, stops=1)
        for contact in footing.fall_contacts
    ]


def estimate_event_count(to: float) -> int:
    """Return the number of events to reserve memory for in a walk of a duration (s)."""
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
) -> list[WalkerSteps]:
    """Simulate many walkers at once, and find their steps and falls.

    Args:
        engine: engine of the model.
        states: initial states (W, y), in the order of the engine.
        to: duration of walks without a fall (s).
        footing: contacts of the feet; found automatically by default.
        numbers: numbers of models of the same structure, one row per walker, see `run_many`; by
            default those of the engine.
        accuracy: accuracy of the integrator.
        most_tries: most steps of the integrator per walker.
        threads: number of threads; by default one per core.

    Returns:
        The walk of each walker.

    Raises:
        OsimliteError: the model does not have two feet, or the shape of the states does not fit.
    """
    feet = footing or find_footing(engine)
    runs = run_many(
        engine,
        states,
        to,
        numbers=numbers,
        accuracy=accuracy,
        watches=make_fall_watches(feet),
        most_events=estimate_event_count(to),
        event_states=True,
        most_tries=most_tries,
        threads=threads,
    )
    return extract_walks(
        engine, states, runs, feet, numbers=numbers, event_capacity=estimate_event_count(to)
    )


def extract_walks(
    engine: BatchEngine,
    states: ArrayLike,
    runs: Runs,
    footing: FootContacts,
    *,
    numbers: ArrayLike | None = None,
    event_capacity: int | None = None,
) -> list[WalkerSteps]:
    """Find the steps and the falls of runs that recorded the states at their events.

    Args:
        engine: engine of the model.
        states: initial states of the runs (W, y).
        runs: runs with the watches of `make_fall_watches`, and possibly others.
        footing: contacts of the feet.
        numbers: numbers of the models, see `run_many`; None for those of the engine.
        event_capacity: number of events for which the runs had memory; a walk with as many ends as "too many
            events".

    Returns:
        The walk of each run.
    """
    starts = np.array(states, dtype=np.float64, order="C")
    vectors = np.array(engine.numbers if numbers is None else numbers, dtype=np.float64, order="C")
    vectors = vectors.reshape(-1, vectors.shape[-1])
    row_of = np.arange(len(starts)) if len(vectors) > 1 else np.zeros(len(starts), dtype=np.int64)
    counts = [len(events) for events in runs.events]
    moments = np.concatenate([starts, *runs.event_states])
    rows = np.concatenate([row_of, np.repeat(row_of, counts)]).astype(np.int64)
    positions, depths = measure_along_slope(engine, moments, vectors, rows)
    fatal = np.array(
        [engine.contacts.index(contact) for contact in footing.fall_contacts], dtype=np.int64
    )
    # Events of all runs follow the initial states in one array, so that one call locates all
    # contacts.
    event_ends = np.cumsum([len(starts), *counts])
    result = []
    for k, events in enumerate(runs.events):
        events_of_run = slice(event_ends[k], event_ends[k + 1])
        # A contact that begins before the start raises no event.
        if (depths[k, fatal] > 0.0).any():
            contact = footing.fall_contacts[int(np.argmax(depths[k, fatal]))]
            result.append(WalkerSteps(0.0, "fell", contact))
            continue
        walk = follow_events(
            footing,
            engine.contacts,
            events,
            runs.event_states[k],
            positions[events_of_run],
            depths[k] > 0.0,
        )
        if walk.walks:
            ending = ENDINGS[int(runs.endings[k])]
            walk.end = float(runs.times[k])
            walk.ending = "walking" if ending == "done" else ending
            # With a full memory of events, later steps would be missing.
            if event_capacity is not None and counts[k] >= event_capacity:
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
) -> WalkerSteps:
    """Return the steps and the fall in the events of one run, which may come from any simulator.

    Args:
        footing: contacts of the feet.
        contacts: names of the contacts, in the order of the columns (P,).
        events: events in the order of time: time (s), contact, and whether contact begins.
        states: states at the events (e, any number of columns).
        reached: positions of the contacts along the slope at the events (e, P) (m).
        touching: whether each contact touches at the start (P,).
    """
    contact_indices = {name: index for index, name in enumerate(contacts)}
    feet = [np.array([contact_indices[contact] for contact in foot]) for foot in footing.feet]
    walk = WalkerSteps()
    foot_of = footing.foot_of
    touching_names = [
        {name for name in foot if touching[contact_indices[name]]} for foot in footing.feet
    ]
    lift_times = [0.0] * len(feet)
    last_foot, first_position = -1, None
    for (time, name, begins), state, contact_positions in zip(events, states, reached, strict=True):
        if name.startswith(FALL_PREFIX) or (begins and name in footing.fall_contacts):
            walk.end = time
            walk.ending = "fell"
            walk.fell_on = name.removeprefix(FALL_PREFIX)
            break
        if name not in foot_of:
            continue
        number = foot_of[name]
        # A foot is in the air from the end of its last contact.
        if not begins:
            touching_names[number].discard(name)
            if not touching_names[number]:
                lift_times[number] = time
            continue
        # Only the first contact of a foot is a touch-down; others roll onto the ground after it.
        was_down = bool(touching_names[number])
        touching_names[number].add(name)
        if was_down:
            continue
        position = float(contact_positions[contact_indices[name]])
        other_positions = [
            float(contact_positions[foot].max())
            for other_foot, foot in enumerate(feet)
            if other_foot != number and touching_names[other_foot]
        ]
        # In flight, the step is measured from the foot that made the last one.
        if other_positions:
            rear_position = max(other_positions)
        elif 0 <= last_foot != number:
            rear_position = float(contact_positions[feet[last_foot]].max())
        else:
            rear_position = position
        length = position - rear_position
        air_time = time - lift_times[number]
        if first_position is None:
            first_position = position
        if number != last_foot and length >= MIN_STEP_LENGTH_M and air_time >= MIN_AIR_TIME_S:
            walk.steps.append(GaitStep(time, number, length, air_time, state))
            walk.distance = position - first_position
            last_foot = number
        else:
            walk.scuffs.append(Scuff(time, number, length, air_time))
    return walk


def measure_along_slope(
    engine: BatchEngine,
    states: Floats,
    vectors: Floats | None = None,
    rows: ArrayLike | None = None,
) -> tuple[Floats, Floats]:
    """Measure positions of contacts along the slope, and their penetration.

    The direction is that of gravity's component along the plane, downhill; on level ground it is
    the x axis of ground.

    Args:
        engine: engine of the model.
        states: states (k, y).
        vectors: numbers of models of the same structure (v, m); by default those of the engine.
        rows: index of the numbers of each state (k,); by default 0.

    Returns:
        Positions of the sphere centres along the slope from the origin of ground (k, P) (m), and
        penetrations of the spheres (k, P) (m), negative above the ground.
    """
    table = np.array(engine.numbers if vectors is None else vectors, dtype=np.float64, order="C")
    table = table.reshape(-1, table.shape[-1])
    number_rows = (
        np.zeros(len(states), dtype=np.int64) if rows is None else np.array(rows, dtype=np.int64)
    )
    contact_geometry = engine.locate_contacts(states, table, number_rows)
    origin = contact_geometry[..., :3]
    normal = contact_geometry[..., 3:6]
    center = contact_geometry[..., 6:]
    gravity = table[:, :3]
    pull = (
        gravity[number_rows][:, None, :]
        - np.sum(gravity[number_rows][:, None, :] * normal, axis=2, keepdims=True) * normal
    )
    slope = np.linalg.norm(pull, axis=2)
    # On level ground gravity has no component along the plane but rounding errors.
    level = slope < 1e-6 * np.maximum(np.linalg.norm(gravity, axis=1)[number_rows], 1e-12)[:, None]
    forward = np.array((1.0, 0.0, 0.0)) - normal[..., :1] * normal
    slope_direction = np.where(level[..., None], forward, pull)
    slope_direction /= np.linalg.norm(slope_direction, axis=2, keepdims=True)
    radii = engine.get_contact_radii(table)[number_rows]
    return np.sum(center * slope_direction, axis=2), radii - np.sum(
        (center - origin) * normal, axis=2
    )
