"""What is watched in many motions, and what is known of them afterwards; needs no engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from osimlite.records import dataclass, field

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
    """W runs, whose states have y numbers.

    Attributes:
        times: at which the runs ended (W,), s.
        states: in which (W, y), in the engine's order.
        endings: how, see `ENDINGS` (W,).
        counts: steps taken, steps tried, evaluations (W, 3).
        reports: states at the report times (W, r, y); not a number after the end of a run.
        events: of each run its events in the order of time: time (s), name, whether it begins or rises.
        peaks: largest force (N) of each contact at the end of a step, and its time (s) (W, P, 2).
        event_states: of each run the states at its events (as many as events, y), if they were asked for.
    """

    times: Floats
    states: Floats
    endings: Ints
    counts: Ints
    reports: Floats
    events: list[list[tuple[float, str, bool]]]
    peaks: Floats
    event_states: list[Floats] = field(default_factory=list)

    def of(self, places: Sequence[int] | Ints) -> Runs:
        """Some of the runs."""
        chosen: dict[str, Any] = {}
        for name, rows in vars(self).items():
            chosen[name] = rows[places] if isinstance(rows, np.ndarray) else [rows[place] for place in places if rows]
        return Runs(**chosen)
