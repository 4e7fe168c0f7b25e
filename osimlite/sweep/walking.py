"""Measures of walking: steps, scuffs and the time until the fall, which ends the run."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from osimlite.errors import SettingError
from osimlite.gait.footing import Footing, find_footing
from osimlite.gait.steps import Walk, falls, room_for, walks_of
from osimlite.sweep.measures import Batch, Measure
from osimlite.sweep.variables import Floats


def steps(engine: Any) -> Measure:
    """How many steps were made."""
    return _measure("steps", engine, lambda walk: len(walk.steps))


def scuffs(engine: Any) -> Measure:
    """How many touch-downs were no steps."""
    return _measure("scuffs", engine, lambda walk: len(walk.scuffs))


def time_to_fall(engine: Any) -> Measure:
    """When the walk ended, s; the end of the run for those that did not fall."""
    return _measure("time_to_fall", engine, lambda walk: walk.end)


def _measure(name: str, engine: Any, number: Callable[[Walk], float]) -> Measure:
    if engine.name != "compiled":
        raise SettingError(f"the measure '{name}' needs --engine compiled")
    footing = find_footing(engine)
    return Measure(name, partial(_of, footing, number), tuple(falls(footing)), room_for, True)


def _of(footing: Footing, number: Callable[[Walk], float], batch: Batch) -> Floats:
    walks = batch.memory.get("walks")
    if walks is None:
        walks = walks_of(batch.engine, batch.starts, batch.runs, footing, numbers=batch.numbers)
        batch.memory["walks"] = walks
    return np.array([number(walk) for walk in walks], dtype=float)
