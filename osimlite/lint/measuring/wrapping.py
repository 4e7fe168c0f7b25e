"""Comparison of OpenSim's path lengths around surfaces with geodesics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random

import numpy as np

from osimlite.lint.measures import MeasuringPose, WrappingError
from osimlite.lint.measuring.sweeps import Sweep
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.paths import Paths

RANDOM_POSES = 64
"""Number of poses with random values of all coordinates within their ranges, the same in every check."""


REPEAT_OFFSET = 1e-7
"""Distance (rad or m) from a pose at which a length is computed again, to detect rounding errors."""
MAX_REPEAT_DIFFERENCE_M = 1e-4
"""Largest difference of the excess length between neighbouring poses that is not due to rounding, m."""


def compare_wrappings(
    geodesic: Paths, paths: Paths, start: Array, sweeps: Sequence[Sweep]
) -> Iterator[WrappingError]:
    """Yield the excess length of each path around surfaces over geodesics, in the default and the worst pose.

    Args:
        geodesic: those paths that have surfaces, along geodesics.
        paths: all paths, wrapped as by OpenSim.
        start: default pose (n,).
        sweeps: sweeps of the coordinates.
    """
    free_sweeps = [sweep for sweep in sweeps if not sweep.is_tied]
    random_poses = _sample_poses(start, free_sweeps)
    poses = np.concatenate([start[None], *(sweep.poses for sweep in sweeps), random_poses])
    columns = [paths.names.index(name) for name in geodesic.names]
    swept = [sweep.lengths[:, columns] for sweep in sweeps]
    ends = np.split(
        paths.system.measure_poses(np.concatenate([start[None], random_poses]))[:, columns], [1]
    )
    excesses = np.concatenate([ends[0], *swept, ends[1]]) - geodesic.system.measure_poses(poses)
    for geodesic_index, (name, path) in enumerate(zip(geodesic.names, columns, strict=True)):
        route = paths.routes[name]
        excess = excesses[:, geodesic_index]
        surface_names = tuple(
            surface.tangent.name for surface in getattr(route, "surfaces", ()) if surface.law
        )
        if not surface_names:
            continue
        moving_sweeps = [sweep for sweep in free_sweeps if sweep.is_moving[path]]

        def describe_pose(
            k: int, moving_sweeps: Sequence[Sweep] = moving_sweeps
        ) -> tuple[MeasuringPose, Array]:
            """Describe pose k for messages, with irrelevant coordinates at their defaults.

            Returns:
                The pose in words, and the values of all coordinates (n,).
            """
            if k == 0:
                return MeasuringPose(), start
            for sweep in sweeps:
                if k <= len(sweep.poses):
                    return sweep.pose(sweep.values[k - 1]), sweep.poses[k - 1]
                k -= len(sweep.poses)
            q = start.copy()
            indices = [sweep.coordinate_index for sweep in moving_sweeps]
            q[indices] = random_poses[k - 1][indices]
            return MeasuringPose(
                tuple(sweep.value(q[sweep.coordinate_index]) for sweep in moving_sweeps)
            ), q

        # Try the poses from the largest excess downwards until one is not a rounding error.
        order = np.argsort(-np.nan_to_num(np.abs(excess)), kind="stable").tolist()
        certain_poses = (
            k
            for k in order
            if _is_certain(geodesic, paths, geodesic_index, path, excess[k], describe_pose(k)[1])
        )
        worst = next(certain_poses, order[-1])
        yield WrappingError(
            name, surface_names, float(excess[0]), float(excess[worst]), describe_pose(worst)[0]
        )


def _sample_poses(start: Array, free: Sequence[Sweep]) -> Array:
    """Return poses (k, n) with random values of all free coordinates within their ranges."""
    # Use Python's generator, which pydantic has imported already: importing `numpy.random` takes
    # five milliseconds.
    generator = Random(0)
    parts = np.array([[generator.random() for _ in free] for _ in range(RANDOM_POSES)]).reshape(
        RANDOM_POSES, len(free)
    )
    values = [
        low + parts[:, k] * (high - low)
        for k, (low, high) in enumerate(sweep.info.range for sweep in free)
    ]
    poses = np.tile(start, (RANDOM_POSES, 1))
    poses[:, [sweep.coordinate_index for sweep in free]] = (
        np.array(values).reshape(len(free), RANDOM_POSES).T
    )
    return poses


def _is_certain(
    geodesic: Paths, paths: Paths, geodesic_index: int, path: int, excess: float, q: Array
) -> bool:
    """Return whether a path has the same excess next to a pose; otherwise rounding caused it."""
    nearby_poses = np.array([q - REPEAT_OFFSET, q + REPEAT_OFFSET])
    nearby_excesses = paths.system.measure_one_path(
        [path] * 2, nearby_poses
    ) - geodesic.system.measure_one_path([geodesic_index] * 2, nearby_poses)
    return bool((np.abs(nearby_excesses - excess) < MAX_REPEAT_DIFFERENCE_M).all())
