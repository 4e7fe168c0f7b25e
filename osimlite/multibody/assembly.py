"""States that fulfil the constraints: the nearest pose, the nearest speeds.

OpenSim assembles a model by minimising half the sum of squared changes of the coordinates under the constraints;
coordinates that depend on others and those free to satisfy constraints do not count, locked ones keep their values,
and clamped ones stay in their range. The minimum is sought here by Newton's method on the constraints, each step
going as near to the wanted values as it can.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from osimlite.errors import SimulationError
from osimlite.multibody.kinematics import Kinematics, kinematics
from osimlite.multibody.linear import solutions, stacked
from osimlite.multibody.spatial import Array
from osimlite.text import listed

if TYPE_CHECKING:
    from osimlite.multibody.mechanism import Mechanism

_TOLERANCE = 1e-10
"""What a constraint may be off (m or rad): what OpenSim's default assembly accuracy allows."""


def assembled(mechanism: Mechanism, q: Array, time: float) -> Array:
    """The coordinate values (n,) nearest to `q` (n,) that fulfil the constraints at `time` (s).

    Raises:
        SimulationError: there are none, or they are too far to be found.
    """
    infos = mechanism.coordinates
    held = {place: float(q[place]) for place, info in enumerate(infos) if info.locked}
    while True:
        found = _nearest(mechanism, q, time, held)
        outside = {
            place: float(np.clip(found[place], *info.range))
            for place, info in enumerate(infos)
            if info.clamped and place not in held and not info.range[0] - 1e-12 <= found[place] <= info.range[1] + 1e-12
        }
        if not outside:
            return found
        # Whichever would leave its range furthest stays at the end of it; then the others may fit.
        worst = max(outside, key=lambda place: abs(outside[place] - found[place]))
        held[worst] = outside[worst]


def projected(state: Kinematics) -> Array:
    """The generalized speeds (n,) nearest to those of `state` that fulfil the constraints."""
    constraints = state.mechanism.constraints
    if not constraints:
        return state.u
    rows, wanted = stacked([item.velocity_equations(state) for item in constraints])
    change, _ = solutions(rows, wanted - rows @ state.u)
    u: Array = state.u + change
    return u


def _nearest(mechanism: Mechanism, wanted: Array, time: float, held: Mapping[int, float]) -> Array:
    counted = np.array([0.0 if info.yielding else 1.0 for info in mechanism.coordinates])
    places, targets = list(held), np.array(list(held.values()))
    q = wanted.copy()
    q[places] = targets
    state = kinematics(mechanism, q, np.zeros(len(q)), time)
    errors = _errors(state)
    for _ in range(200):
        turning = mechanism.rate_matrix(q)
        rows = np.concatenate([_rows(state), turning[places]])
        step, free = solutions(rows, np.concatenate([-errors, targets - q[places]]))
        left = counted * (wanted - q - turning @ step)
        step = step + free @ np.linalg.lstsq(counted[:, None] * (turning @ free), left, rcond=1e-9)[0]
        size = 1.0
        while True:
            trial = q + size * (turning @ step)
            state = kinematics(mechanism, trial, np.zeros(len(q)), time)
            new = _errors(state)
            better = np.linalg.norm(new) <= (1.0 - 0.1 * size) * np.linalg.norm(errors)
            if better or size < 1e-3 or np.abs(new).max(initial=0.0) < _TOLERANCE:
                break
            size *= 0.5
        moved = float(np.abs(trial - q).max(initial=0.0))
        q, errors = trial, new
        if moved < 1e-13 * (1.0 + float(np.abs(q).max(initial=0.0))):
            break
    if not np.abs(errors).max(initial=0.0) < _TOLERANCE:
        broken = [
            item.name
            for item in mechanism.constraints
            if not np.abs(item.position_errors(state)).max(initial=0) < 1e-10
        ]
        raise SimulationError(
            f"no pose of '{mechanism.name}' near the given one fulfils {listed(broken)}; change the coordinate values, "
            "unlock or unclamp coordinates, or set isEnforced of a constraint to false"
        )
    return q


def _errors(state: Kinematics) -> Array:
    parts = [item.position_errors(state) for item in state.mechanism.constraints]
    return np.concatenate([np.zeros(0), *parts])


def _rows(state: Kinematics) -> Array:
    """Matrix (p, n) from the speeds to the rates of all position errors."""
    rows = [np.zeros((0, len(state.q)))]
    for item in state.mechanism.constraints:
        count = len(item.position_errors(state))
        if count:
            rows.append(item.velocity_equations(state)[0][:count])
    return np.concatenate(rows)
