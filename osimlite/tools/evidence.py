"""What a report shows of a run beside its tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.io.document.cache import read_object
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.schema.prescribed import ExternalLoads
from osimlite.simulation.elements.external_loads import loads_table

ON_GROUND = 20.0
"""A foot that is pushed up by more stands, N."""
BRIEF = 0.1
"""What stands, or does not, for less than this (s) is noise of the force plate."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """The motion of a run, and what was measured."""

    model: Model  # what moves
    file: Path  # of the model
    times: Array  # (t,), s
    coordinates: Sequence[str]  # names of the n coordinates
    values: Array  # (t, n), rad and m
    turning: Sequence[bool]  # which of them are angles
    markers: Sequence[str] = ()  # names of the m markers that were fitted
    measured: Array | None = None  # where they were (t, m, 3), m; NaN where one was not seen
    places: Array | None = None  # where they are in the model (t, m, 3), m
    loads: Path | None = None  # the file of measured loads
    sensors: Sequence[str] = ()  # names of the k sensors that were fitted
    # how far they are turned from where they were measured (t, k), rad; NaN where one was not
    angles: Array | None = None
    # of a motion that goes by its own muscles and contacts: the generalized speeds (t, n), other
    # states by their paths, and the controls, with NaN where there are none
    speeds: Array | None = None
    states: Mapping[str, Array] = field(default_factory=dict)
    controls: StoTable | None = None

    @classmethod
    def of(
        cls,
        model: Model,
        file: Path,
        mechanism: Mechanism,
        times: Array,
        values: Array,
        **more: Any,
    ) -> Evidence:
        """Of values in the order of a mechanism's coordinates."""
        infos = mechanism.coordinates
        turning = [info.motion_type == "rotational" for info in infos]
        return cls(model, file, times, [info.name for info in infos], values, turning, **more)


class Steps(NamedTuple):
    """When a foot touches the ground, and leaves it (s)."""

    strikes: tuple[float, ...]
    offs: tuple[float, ...]

    @property
    def cycles(self) -> list[tuple[float, float]]:
        """From each strike to the next."""
        return list(pairwise(self.strikes))


def steps_of(loads: Path, up: int) -> dict[str, Steps]:
    """The steps of the right ("r") and the left foot ("l"), by the vertical force on bodies with such endings.

    Args:
        loads: a file of ExternalLoads.
        up: which axis of ground points up.

    Raises:
        OsimliteError: it, or its data, cannot be read.
    """
    document = read_object(loads, ExternalLoads)
    table = loads_table(document, loads.parent, str(loads))
    result: dict[str, Array] = {}
    for force in document.objects:
        side, label = (
            side_of(str(force.applied_to_body))[1],
            f"{(force.force_identifier or '').strip()}{'xyz'[up]}",
        )
        if side and label in table.columns:
            result[side] = result.get(side, 0.0) + table[label]
    return {side: _steps(table.times, column > ON_GROUND) for side, column in result.items()}


def _steps(times: Array, stands: Any) -> Steps:
    changes = [0, *(np.flatnonzero(np.diff(stands)) + 1).tolist(), len(stands)]
    spans = [(first, last) for first, last in pairwise(changes) if last > first]
    kept: list[list[int]] = []
    for first, last in spans:
        is_brief = times[min(last, len(times) - 1)] - times[first] < BRIEF
        if kept and (is_brief or stands[kept[-1][0]] == stands[first]):
            kept[-1][1] = last
        else:
            kept.append([first, last])
    strikes = tuple(float(times[first]) for first, _ in kept if stands[first] and first > 0)
    offs = tuple(float(times[first]) for first, _ in kept if not stands[first] and first > 0)
    return Steps(strikes, offs)


def side_of(name: str) -> tuple[str, str]:
    """A name without its side, and the side: "r", "l" or ""."""
    name = name.strip()
    for side in "rl":
        if name.endswith(f"_{side}"):
            return name[:-2], side
        if name.startswith(f"{side}_"):
            return name[2:], side
    return name, ""


def root_of(mechanism: Mechanism) -> tuple[int, ...]:
    """The coordinates of the joint by which a model moves in ground: none if several do, or if it is just a hinge."""
    roots = [body.mobilizer.coordinates for body in mechanism.bodies if body.parent == GROUND]
    moving = [own for own in roots if own]
    return moving[0] if len(moving) == 1 and len(moving[0]) >= 3 else ()


def quietly_steps(evidence: Evidence) -> dict[str, Steps]:
    """The steps of a motion with measured loads; none where these cannot be read."""
    if evidence.loads is None:
        return {}
    try:
        return steps_of(evidence.loads, int(np.argmax(np.abs(evidence.model.gravity))))
    except OsimliteError:
        return {}
