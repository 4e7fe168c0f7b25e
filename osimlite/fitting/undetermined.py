"""Coordinates of a fitted pose that the measurements say nothing about."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from osimlite.fitting.pose_layout import Goal, Marker, Sensor
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array

MOST_FRAMES = 5
"""Frames in which the fit is examined; a coordinate is reported if all of them leave it open."""
LEAST_LEVER = 1e-5
"""Motions that move all measured points by less than this (m or rad, for 1 rad or m) are not measured."""
LEAST_PART = 1e-3
"""Part of such a motion (rad or m) that a coordinate has at least, if it is to be reported."""


def find_undetermined(
    mechanism: Mechanism,
    values: Array,
    seen: NDArray[np.bool_],
    markers: Sequence[Marker],
    sensors: Sequence[Sensor],
    goals: Sequence[Goal],
    *,
    constraints: bool,
) -> tuple[str, ...]:
    """Return the names of coordinates that can move without moving anything that is measured.

    The null space of the Jacobian of all measured points and frames, of the constraints, and of
    what is held or has a goal, is computed in a few frames by a singular value decomposition.

    Args:
        mechanism: that was fitted.
        values: of all coordinates in the fitted poses (t, n).
        seen: whether each marker was seen in each frame (t, m).
        markers: m of them, with their weights.
        sensors: frames whose rotation was measured.
        goals: coordinates that were kept near values.
        constraints: whether those of the model hold.

    Returns:
        Names in the order of the mechanism.
    """
    count = len(mechanism.coordinates)
    held = [
        k
        for k, info in enumerate(mechanism.coordinates)
        if info.locked or info.prescribed is not None
    ]
    held += [goal.coordinate for goal in goals if goal.weight > 0.0]
    open_everywhere = np.ones(count, dtype=bool)
    frames = np.linspace(0, len(values) - 1, min(len(values), MOST_FRAMES)).astype(int)
    # `np.unique` would import `numpy.ma`, which takes ten milliseconds.
    for frame in sorted(set(frames.tolist())):
        state = mechanism.at(values[frame])
        rows = [np.eye(count)[held]]
        for marker, is_seen in zip(markers, seen[frame].tolist(), strict=True):
            body, point = marker.station
            if is_seen and marker.weight > 0.0 and body != GROUND:
                rows.append(state.point_jacobian(body, point)[3:])
        for sensor in sensors:
            body, _ = sensor.frame
            if sensor.weight > 0.0 and body != GROUND:
                rows.append(state.jacobians[body][:3])
        if constraints:
            rows += [item.acceleration_equations(state)[0] for item in mechanism.constraints]
        _, sizes, directions = np.linalg.svd(np.vstack(rows))
        rank = int(np.sum(sizes > LEAST_LEVER))
        open_everywhere &= np.linalg.norm(directions[rank:], axis=0) > LEAST_PART
    infos = zip(mechanism.coordinates, open_everywhere.tolist(), strict=True)
    return tuple(info.name for info, is_open in infos if is_open)
