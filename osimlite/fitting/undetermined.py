"""Coordinates of a fitted pose that no measurement determines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from osimlite.fitting.pose_layout import CoordinateTarget, MarkerTarget, SensorTarget
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.parts import GROUND
from osimlite.mechanics.multibody.spatial import Array

MAX_FRAMES = 5
"""Number of frames in which the fit is examined.

A coordinate is reported if it is undetermined in all of them.
"""
MIN_SINGULAR_VALUE = 1e-5
"""Largest displacement (m or rad, for 1 rad or m) of measured points that counts as none."""
MIN_COMPONENT = 1e-3
"""Smallest component (rad or m) of an undetermined motion along a coordinate that is reported."""


def find_undetermined(
    mechanism: Mechanism,
    values: Array,
    visibility: NDArray[np.bool_],
    markers: Sequence[MarkerTarget],
    sensors: Sequence[SensorTarget],
    goals: Sequence[CoordinateTarget],
    *,
    constraints: bool,
) -> tuple[str, ...]:
    """Return the names of coordinates that can move without moving any measured point or frame.

    The null space of the Jacobian of measurements, constraints, and locked or targeted coordinates
    is computed in a few frames by a singular value decomposition.

    Args:
        mechanism: mechanism of the model.
        values: values of all coordinates in the fitted poses (t, n).
        visibility: whether each marker was seen in each frame (t, m).
        markers: m markers with their weights.
        sensors: frames with measured orientations.
        goals: coordinates with target values.
        constraints: whether the constraints of the model hold.

    Returns:
        Names in the order of the mechanism.
    """
    count = len(mechanism.coordinates)
    fixed_coordinates = [
        k
        for k, info in enumerate(mechanism.coordinates)
        if info.locked or info.prescribed is not None
    ]
    # A target determines its coordinate, however small its weight.
    fixed_coordinates += [goal.coordinate for goal in goals if goal.weight > 0.0]
    open_everywhere = np.ones(count, dtype=bool)
    frames = np.linspace(0, len(values) - 1, min(len(values), MAX_FRAMES)).astype(int)
    # `np.unique` would import `numpy.ma`, which takes ten milliseconds.
    for frame in sorted(set(frames.tolist())):
        state = mechanism.at(values[frame])
        rows = [np.eye(count)[fixed_coordinates]]
        for marker, is_visible in zip(markers, visibility[frame].tolist(), strict=True):
            body, point = marker.station
            if is_visible and marker.weight > 0.0 and body != GROUND:
                # The first three rows are the angular velocity of the body, which a point does not
                # show.
                rows.append(state.point_jacobian(body, point)[3:])
        for sensor in sensors:
            body, _ = sensor.frame
            if sensor.weight > 0.0 and body != GROUND:
                # A sensor shows only the angular velocity, which comes first.
                rows.append(state.jacobians[body][:3])
        if constraints:
            rows += [
                constraint.acceleration_equations(state)[0] for constraint in mechanism.constraints
            ]
        _, sizes, directions = np.linalg.svd(np.vstack(rows))
        # The remaining right singular vectors span the motions that nothing measures.
        rank = int(np.sum(sizes > MIN_SINGULAR_VALUE))
        open_everywhere &= np.linalg.norm(directions[rank:], axis=0) > MIN_COMPONENT
    infos = zip(mechanism.coordinates, open_everywhere.tolist(), strict=True)
    return tuple(info.name for info, is_open in infos if is_open)
