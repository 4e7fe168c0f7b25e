"""What is watched in many motions, and what is known of them afterwards; needs no engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass, field

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Watch(NamedTuple):
    """A level that a run is watched for passing."""

    name: str  # what the event is called
    coordinate: str = ""  # name or path of the coordinate that is watched, or
    body: str = ""  # name or path of the body (or frame) of which a point is watched, with
    station: tuple[float, float, float] = (0.0, 0.0, 0.0)  # the point in it (m), and
    # along which in ground its position counts
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)
    level: float = 0.0  # what is passed, rad or m
    stops: int = 0  # -1 if falling below ends the run, 1 if rising above does, 0 if neither
    # name of the contact (of the engine's `contacts`) that is, which is above its level while it
    # pushes, or
    contact: str = ""


@dataclass(frozen=True)
class Runs:
    """W runs, whose states have y numbers."""

    times: Floats  # at which the runs ended (W,), s
    states: Floats  # in which (W, y), in the engine's order
    endings: Ints  # how, see `ENDINGS` (W,)
    counts: Ints  # steps taken, steps tried, evaluations (W, 3)
    reports: Floats  # states at the report times (W, r, y); not a number after the end of a run
    # of each run its events in the order of time: time (s), name, whether it begins or rises
    events: list[list[tuple[float, str, bool]]]
    peaks: (
        Floats  # largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2)
    )
    # of each run the states at its events (as many as events, y), if they were asked for
    event_states: list[Floats] = field(default_factory=list)

    def of(self, places: Sequence[int] | Ints) -> Runs:
        """Some of the runs."""
        chosen: dict[str, Any] = {}
        for name, rows in vars(self).items():
            chosen[name] = (
                rows[places]
                if isinstance(rows, np.ndarray)
                else [rows[place] for place in places if rows]
            )
        return Runs(**chosen)
