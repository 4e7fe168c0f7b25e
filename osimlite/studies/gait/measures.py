"""Measures of sweeps for walkers, and a start with the feet on the ground.

The measures are steps, scuffs, the time of the fall, and progress.

The names of the public functions are the names that users write in a sweep. A fall ends the run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from osimlite.errors import SettingError
from osimlite.studies.gait.foot_contacts import FootContacts, find_footing
from osimlite.studies.gait.starts import lift_to_depth, plant_feet
from osimlite.studies.gait.steps import (
    MIN_STEP_LENGTH_M,
    WalkerSteps,
    estimate_event_count,
    extract_walks,
    make_fall_watches,
    measure_along_slope,
)
from osimlite.studies.sweep import registry
from osimlite.studies.sweep.measures import Batch, RunMeasure
from osimlite.studies.sweep.variables import Floats

PLANTED_DEPTH_M = 8e-4
"""Penetration (m) of the foot of a planted walker: enough for a contact, too little for a large force."""


@registry.register_measure(is_maximized=True)
def steps(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure of the number of steps.

    Args:
        engine: engine of the model.
        feet: contacts of each foot; found from the structure of the model by default.
    """
    return _make_walk_measure("steps", engine, feet, lambda walk: len(walk.steps))


@registry.register_measure()
def scuffs(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure of the number of touch-downs that are not steps.

    Args:
        engine: engine of the model.
        feet: contacts of each foot; found from the structure of the model by default.
    """
    return _make_walk_measure("scuffs", engine, feet, lambda walk: len(walk.scuffs))


@registry.register_measure(is_maximized=True)
def time_to_fall(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure of the time of the fall (s).

    For walkers that do not fall it is the end of the run.

    Args:
        engine: engine of the model.
        feet: contacts of each foot; found from the structure of the model by default.
    """
    return _make_walk_measure("time_to_fall", engine, feet, lambda walk: walk.end)


@registry.register_measure(is_maximized=True)
def progress(engine: Any, feet: Sequence[str] | None = None) -> RunMeasure:
    """Return the measure of progress, which a search can climb.

    It is the number of steps before the first scuff, plus a fraction for how near the next step
    was.

    The fraction after the decimal point is the mean of two numbers below 1. The first is m / (m +
    d), where m is the shortest length of a step and d is what the foot lacked to it when it scuffed
    or the run ended. The second is t / (t + 1 s) for the time t until then.

    Args:
        engine: engine of the model.
        feet: contacts of each foot; found from the structure of the model by default.
    """
    footing = _find_footing("progress", engine, feet)
    contacts = [[engine.contacts.index(name) for name in foot] for foot in footing.feet]

    def numbers(batch: Batch) -> Floats:
        rows = None if batch.numbers is None else np.arange(len(batch.starts))
        along = measure_along_slope(batch.engine, batch.runs.states, batch.numbers, rows)[0]
        # A foot is as far as its foremost contact.
        foot_positions = np.stack([along[:, foot].max(axis=1) for foot in contacts], axis=1)
        result = zip(_list_walks(footing, batch), foot_positions.tolist(), strict=True)
        return np.array([_compute_progress(walk, ends) for walk, ends in result])

    return _make_measure("progress", footing, numbers)


@registry.register_start
def planted(engine: Any, feet: Sequence[str] | None) -> registry.StartFunction:
    """Return the start in which the deeper foot is on the ground, and at rest there.

    Args:
        engine: engine of the model.
        feet: contacts of each foot; found from the structure of the model by default.

    Raises:
        SettingError: the engine is not the compiled one.
    """
    if engine.name != "compiled":
        raise SettingError("a planted start needs the compiled engine")
    footing = find_footing(engine, feet)

    def plant(
        states: Floats, numbers: Floats | None, started: Callable[[Floats], Floats]
    ) -> Floats:
        resting = plant_feet(engine, footing, states, numbers=numbers)
        return started(
            lift_to_depth(engine, footing, resting, PLANTED_DEPTH_M, -1, numbers=numbers)
        )

    return plant


def _compute_progress(walk: WalkerSteps, foot_positions: Sequence[float]) -> float:
    """Return the progress of a walk with feet at some positions along the slope at its end (m)."""
    if walk.scuffs:
        end_time = walk.scuffs[0].time
        foot_lead = walk.scuffs[0].length
    else:
        end_time = walk.end
        last_foot = walk.steps[-1].foot if walk.steps else int(np.argmax(foot_positions))
        # How far the swing foot is ahead of the foot of the last step.
        foot_lead = (
            max(position for foot, position in enumerate(foot_positions) if foot != last_foot)
            - foot_positions[last_foot]
        )
    # The fraction stays below 1, so that another step always counts more.
    closeness = MIN_STEP_LENGTH_M / (MIN_STEP_LENGTH_M + max(MIN_STEP_LENGTH_M - foot_lead, 0.0))
    return walk.clean_steps + 0.5 * (closeness + end_time / (end_time + 1.0))


def _make_walk_measure(
    name: str, engine: Any, feet: Sequence[str] | None, number: Callable[[WalkerSteps], float]
) -> RunMeasure:
    """Return a measure that is a number of a walk."""
    footing = _find_footing(name, engine, feet)
    return _make_measure(
        name,
        footing,
        lambda batch: np.array([number(walk) for walk in _list_walks(footing, batch)], float),
    )


def _find_footing(name: str, engine: Any, feet: Sequence[str] | None) -> FootContacts:
    """Return the feet for a measure that needs the compiled engine.

    Raises:
        SettingError: the engine is not the compiled one.
    """
    if engine.name != "compiled":
        raise SettingError(f"the measure '{name}' needs the compiled engine")
    return find_footing(engine, feet)


def _make_measure(
    name: str, footing: FootContacts, numbers: Callable[[Batch], Floats]
) -> RunMeasure:
    """Return a measure whose runs end with a fall."""
    return RunMeasure(name, numbers, tuple(make_fall_watches(footing)), estimate_event_count, True)


def _list_walks(footing: FootContacts, batch: Batch) -> list[WalkerSteps]:
    """Return the walks of a batch; they are shared by all measures of the batch."""
    walks: list[WalkerSteps] | None = batch.memory.get("walks")
    if walks is None:
        walks = extract_walks(
            batch.engine, batch.starts, batch.runs, footing, numbers=batch.numbers
        )
        batch.memory["walks"] = walks
    return walks
