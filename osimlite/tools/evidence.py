"""Motion of a run and measured data, from which a report is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.errors import OsimliteError
from osimlite.io.document.cache import read_object
from osimlite.io.tables.storage import StoTable
from osimlite.mechanics.multibody.mechanism import GROUND, Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.model import Model

STANCE_FORCE_N = 20.0
"""Vertical force above which a foot stands on the ground, N."""
MIN_PHASE_S = 0.1
"""Duration below which a stance or a swing is noise of the force plate, s."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Motion of a run, and the measurements behind it."""

    model: Model  # model that moves
    file: Path  # file of the model
    times: Array  # times (t,), s
    coordinates: Sequence[str]  # names of the n coordinates
    values: Array  # values of the coordinates (t, n), rad and m
    turning: Sequence[bool]  # whether each coordinate is an angle (n,)
    markers: Sequence[str] = ()  # names of the m fitted markers
    measured: Array | None = None  # measured positions (t, m, 3), m; NaN if unseen
    positions: Array | None = None  # positions in the model (t, m, 3), m
    loads: Path | None = None  # file of measured loads
    sensors: Sequence[str] = ()  # names of the k fitted sensors
    # Rotation angles of the sensors from their measurements (t, k), rad; NaN if not measured.
    angles: Array | None = None
    # Of a motion that is driven by muscles and contacts: generalized speeds (t, n), other states
    # by path, and controls, NaN where unknown.
    speeds: Array | None = None
    states: Mapping[str, Array] = field(default_factory=dict)
    controls: StoTable | None = None

    @classmethod
    def from_values(
        cls,
        model: Model,
        file: Path,
        mechanism: Mechanism,
        times: Array,
        values: Array,
        **more: Any,
    ) -> Evidence:
        """Return the evidence of values in the order of a mechanism's coordinates.

        Args:
            model: model that moves.
            file: file of the model.
            mechanism: mechanism of the model.
            times: times (t,), s.
            values: values (t, n), rad and m.
            more: other fields of the class.
        """
        infos = mechanism.coordinates
        turning = [info.motion_type == "rotational" for info in infos]
        return cls(model, file, times, [info.name for info in infos], values, turning, **more)


class Steps(NamedTuple):
    """Times at which a foot touches the ground and leaves it, s."""

    strikes: tuple[float, ...]
    offs: tuple[float, ...]

    @property
    def cycles(self) -> list[tuple[float, float]]:
        """Gait cycles: from each strike to the next, s."""
        return list(pairwise(self.strikes))


def find_steps(loads: Path, up_axis: int) -> dict[str, Steps]:
    """Find the steps of the right ("r") and the left foot ("l") from vertical forces on bodies.

    The name of a body says its side, as in ``calcn_r``.

    Args:
        loads: file of ExternalLoads.
        up_axis: axis of ground that points up (0, 1, 2).

    Returns:
        Steps by side.

    Raises:
        OsimliteError: osimlite cannot read the file or its data.
    """
    # Most tools run without measured loads.
    from osimlite.schema.prescribed import ExternalLoads
    from osimlite.simulation.elements.external_loads import read_loads_table

    document = read_object(loads, ExternalLoads)
    table = read_loads_table(document, loads.parent, str(loads))
    result: dict[str, Array] = {}
    for force in document.objects:
        side = split_side(str(force.applied_to_body))[1]
        label = f"{(force.force_identifier or '').strip()}{'xyz'[up_axis]}"
        # Several forces, for example of two plates, may act on one foot.
        if side and label in table.columns:
            result[side] = result.get(side, 0.0) + table[label]
    return {
        side: _detect_steps(table.times, column > STANCE_FORCE_N) for side, column in result.items()
    }


def _detect_steps(times: Array, is_stance: Any) -> Steps:
    """Return strikes and toe-offs; merge phases that are shorter than `MIN_PHASE_S`."""
    # Phases of stance and swing between the changes.
    changes = [0, *(np.flatnonzero(np.diff(is_stance)) + 1).tolist(), len(is_stance)]
    spans = [(first, last) for first, last in pairwise(changes) if last > first]
    phases: list[list[int]] = []
    for first, last in spans:
        is_brief = times[min(last, len(times) - 1)] - times[first] < MIN_PHASE_S
        # A brief phase joins the one before, and so does the next of the same kind.
        if phases and (is_brief or is_stance[phases[-1][0]] == is_stance[first]):
            phases[-1][1] = last
        else:
            phases.append([first, last])
    # The first phase begins before the data, so it gives no event.
    strikes = tuple(float(times[first]) for first, _ in phases if is_stance[first] and first > 0)
    offs = tuple(float(times[first]) for first, _ in phases if not is_stance[first] and first > 0)
    return Steps(strikes, offs)


def split_side(name: str) -> tuple[str, str]:
    """Split a name into its stem and its side.

    Returns:
        Name without the side, and the side: "r", "l" or "".
    """
    name = name.strip()
    for side in "rl":
        if name.endswith(f"_{side}"):
            return name[:-2], side
        if name.startswith(f"{side}_"):
            return name[2:], side
    return name, ""


def find_root_coordinates(mechanism: Mechanism) -> tuple[int, ...]:
    """Find the coordinates by which a model moves in ground.

    Returns:
        Indices of the coordinates; none if several joints connect the model to ground, or if the
        only one has fewer than three coordinates.
    """
    roots = [body.mobilizer.coordinates for body in mechanism.bodies if body.parent == GROUND]
    moving_roots = [coordinates for coordinates in roots if coordinates]
    # A model that a hinge connects to ground does not move freely.
    return moving_roots[0] if len(moving_roots) == 1 and len(moving_roots[0]) >= 3 else ()


def try_find_steps(evidence: Evidence) -> dict[str, Steps]:
    """Find the steps of a motion with measured loads.

    Returns:
        Steps by side; none if osimlite cannot read the loads.
    """
    if evidence.loads is None:
        return {}
    try:
        return find_steps(evidence.loads, int(np.argmax(np.abs(evidence.model.gravity))))
    except OsimliteError:
        return {}
