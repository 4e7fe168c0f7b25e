"""Jumps of path lengths, at conditional points and where routes around surfaces change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.lint.measures import PathJump
from osimlite.lint.measuring.sweeps import Sweep
from osimlite.mechanics.kernels.paths import NODE_TYPE
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.paths import Paths

MIN_JUMP_M = 1e-3
"""Smallest jump that is reported, m."""
SIDE_OFFSET = 1e-4
"""Distance (rad or m) from a jump at which lengths on both sides are compared.

OpenSim's conditional points become active 1e-5 before their range and inactive 1e-5 after it, so at
this distance each is either active or not.
"""


class JumpSuspect(NamedTuple):
    """Interval of a sweep in which the length of a path may jump.

    Attributes:
        excess: change of the length that differs from that in neighbouring intervals, m; infinite at a
            conditional point.
        usual: change that neighbouring intervals predict, m.
        sweep: sweep of a coordinate.
        path: index of the path.
        pose: index of the pose before the interval.
        ends: values of the coordinate at both ends.
    """

    # Change of the length that differs from that in neighbouring intervals, m; infinite at a
    # conditional point.
    excess: float
    usual: float  # change that neighbouring intervals predict, m
    sweep: Sweep  # sweep of a coordinate
    path: int  # index of the path
    pose: int  # index of the pose before the interval
    ends: tuple[float, float]  # values of the coordinate at both ends


def find_jumps(paths: Paths, sweeps: Sequence[Sweep]) -> Iterator[PathJump]:
    """Yield the largest jump of each path that has one.

    Candidates are the ends of the ranges of conditional points, and intervals in which a length changes
    by more than neighbouring intervals predict. A jump is hardly larger than that difference.

    Args:
        paths: paths of the model.
        sweeps: sweeps of the coordinates.
    """
    suspects = [suspect for sweep in sweeps for suspect in _find_suspects(paths, sweep)]
    if not suspects:
        return
    values = _bisect_suspects(paths, suspects)
    sides = np.array(
        [
            _compute_side_poses(candidate, value)
            for candidate, value in zip(suspects, values, strict=True)
        ]
    )
    sides = sides.reshape(2 * len(suspects), -1)
    side_lengths = paths.system.measure_one_path(
        [candidate.path for candidate in suspects for _ in range(2)], sides
    )
    sizes = np.abs(np.diff(side_lengths.reshape(-1, 2), axis=1))[:, 0].tolist()
    greatest: dict[int, int] = {}
    # Suspects are sorted by their excess, so a jump already found makes those with a smaller excess
    # unnecessary.
    for k in sorted(range(len(suspects)), key=lambda k: (suspects[k].path, -suspects[k].excess)):
        suspect = suspects[k]
        values_of = suspects[k].sweep.values
        least_size = sizes[greatest[suspect.path]] if suspect.path in greatest else MIN_JUMP_M
        is_inside = values_of[0] + SIDE_OFFSET < values[k] < values_of[-1] - SIDE_OFFSET
        if is_inside and sizes[k] > least_size and not suspect.excess < least_size:
            greatest[suspect.path] = k
    names = [*paths.routes]
    for path, k in greatest.items():
        sweep = suspects[k].sweep
        name = names[path]
        yield PathJump(
            name,
            sizes[k],
            sweep.pose(values[k]),
            _find_changed_parts(paths, name, sides[2 * k : 2 * k + 2]),
        )


def _find_suspects(paths: Paths, sweep: Sweep) -> Iterator[JumpSuspect]:
    """Yield the intervals of a sweep in which the length of a path may jump."""
    changes = np.diff(sweep.lengths, axis=0)
    usual = np.full_like(changes, np.nan)
    if len(changes) > 2:
        usual[1:-1] = 0.5 * changes[:-2] + 0.5 * changes[2:]
        usual[0], usual[-1] = 2.0 * changes[1] - changes[2], 2.0 * changes[-2] - changes[-3]
    excess = np.abs(changes - usual)
    values = sweep.values
    for path, route in enumerate(paths.routes.values()):
        if not isinstance(route, ThroughPoints):
            continue
        for point in route.points:
            if point.kind == NODE_TYPE.CONDITIONAL and point.coordinate == sweep.coordinate_index:
                for end in point.range:
                    yield JumpSuspect(inf, 0.0, sweep, path, 0, (end, end))
        for k in np.flatnonzero(excess[:, path] > MIN_JUMP_M) if route.surfaces else ():
            ends = float(values[k]), float(values[k + 1])
            yield JumpSuspect(
                float(excess[k, path]), float(usual[k, path]), sweep, path, int(k), ends
            )


def _bisect_suspects(paths: Paths, suspects: Sequence[JumpSuspect]) -> list[float]:
    """Return the value in each interval at which the length changes most beyond the usual change."""
    low, high = np.array([suspect.ends for suspect in suspects]).T
    start = low
    stop = high
    active = high - low > SIDE_OFFSET
    begin, end = (
        np.array([suspect.sweep.poses[suspect.pose + k] for suspect in suspects]) for k in (0, 1)
    )
    rate = np.array([suspect.usual for suspect in suspects]) / np.where(active, high - low, 1.0)
    low_lengths, high_lengths = (
        np.array([suspect.sweep.lengths[suspect.pose + k, suspect.path] for suspect in suspects])
        for k in (0, 1)
    )
    # Bisect all intervals at once: keep the half in which the length deviates more from the linear
    # change that neighbouring intervals predict.
    while active_indices := np.flatnonzero(active).tolist():
        middle = 0.5 * (low + high)
        fraction = (middle - start) / (stop - start)
        poses = (begin + fraction[:, None] * (end - begin))[active_indices]
        middle_lengths = np.full(len(suspects), np.nan)
        middle_lengths[active_indices] = paths.system.measure_one_path(
            [suspects[k].path for k in active_indices], poses
        )
        smooth = rate * (middle - low)
        is_before = np.abs(middle_lengths - low_lengths - smooth) > np.abs(
            high_lengths - middle_lengths - smooth
        )
        is_replaced = active & is_before
        high = np.where(is_replaced, middle, high)
        high_lengths = np.where(is_replaced, middle_lengths, high_lengths)
        is_replaced = active & ~is_before
        low = np.where(is_replaced, middle, low)
        low_lengths = np.where(is_replaced, middle_lengths, low_lengths)
        active = high - low > SIDE_OFFSET
    return np.where(
        [suspect.excess < inf for suspect in suspects], 0.5 * (low + high), low
    ).tolist()


def _compute_side_poses(suspect: JumpSuspect, value: float) -> Array:
    """Return the poses (2, n) on both sides of a value."""
    side_values = np.array([value - SIDE_OFFSET, value + SIDE_OFFSET])
    return suspect.sweep.interpolate_poses(
        side_values, suspect.sweep.find_poses_before(side_values)
    )


def _find_changed_parts(paths: Paths, name: str, sides: Array) -> tuple[str, ...]:
    """Return the names of the points and surfaces that a path touches on one side only."""
    route = paths.routes[name]
    assert isinstance(route, ThroughPoints)
    before, after = ({number for number, _ in paths.points(q)[name]} for q in sides)
    count = len(route.points)
    names = [
        route.points[k].name or f"point {k + 1}"
        if k < count
        else route.surfaces[(k - count) // 2].tangent.name
        for k in sorted(before ^ after)
    ]
    return tuple(dict.fromkeys(names))
