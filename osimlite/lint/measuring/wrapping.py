"""Compare OpenSim's path lengths around surfaces with geodesics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random

import numpy as np

from osimlite.lint.measures import Pose, WrappingError
from osimlite.lint.measuring.sweeps import Sweep
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.paths import Paths

RANDOM_POSES = 64
"""Poses with values of all coordinates within their ranges, at random but always the same."""


ASIDE = 1e-7
"""Distance (rad or m) from a pose at which a length is computed again."""
NEAR = 1e-4
"""Largest difference (m) of the excess length at that distance."""


def compare_wrappings(
    geodesic: Paths, paths: Paths, start: Array, looked_at: Sequence[Sweep]
) -> Iterator[WrappingError]:
    """Yield for each path around surfaces its excess length over geodesics, by default and at worst.

    Args:
        geodesic: those of the paths that have surfaces, along geodesics.
        paths: all of them in OpenSim's way.
        start: the default pose (n,).
        looked_at: the sweeps.
    """
    free = [sweep for sweep in looked_at if not sweep.is_tied]
    together = _sample_poses(start, free)
    poses = np.concatenate([start[None], *(sweep.poses for sweep in looked_at), together])
    columns = [paths.names.index(name) for name in geodesic.names]
    swept = [sweep.lengths[:, columns] for sweep in looked_at]
    ends = np.split(
        paths.system.measure_poses(np.concatenate([start[None], together]))[:, columns], [1]
    )
    excesses = np.concatenate([ends[0], *swept, ends[1]]) - geodesic.system.measure_poses(poses)
    for own, (name, path) in enumerate(zip(geodesic.names, columns, strict=True)):
        route, excess = paths.routes[name], excesses[:, own]
        around = tuple(
            surface.tangent.name for surface in getattr(route, "surfaces", ()) if surface.law
        )
        if not around:
            continue
        moved = [sweep for sweep in free if sweep.moved[path]]

        def describe_pose(k: int, moved: Sequence[Sweep] = moved) -> tuple[Pose, Array]:
            """Return pose k for the message, with irrelevant coordinates at their defaults."""
            if k == 0:
                return Pose(), start
            for sweep in looked_at:
                if k <= len(sweep.poses):
                    return sweep.pose(sweep.values[k - 1]), sweep.poses[k - 1]
                k -= len(sweep.poses)
            q, places = start.copy(), [sweep.place for sweep in moved]
            q[places] = together[k - 1][places]
            return Pose(tuple(sweep.value(q[sweep.place]) for sweep in moved)), q

        order = np.argsort(-np.nan_to_num(np.abs(excess)), kind="stable").tolist()
        certain = (
            k
            for k in order
            if _is_certain(geodesic, paths, own, path, excess[k], describe_pose(k)[1])
        )
        worst = next(certain, order[-1])
        yield WrappingError(
            name, around, float(excess[0]), float(excess[worst]), describe_pose(worst)[0]
        )


def _sample_poses(start: Array, free: Sequence[Sweep]) -> Array:
    """Return poses (k, n) with random values of all free coordinates within their ranges."""
    # Python's own generator, since pydantic has loaded it: `numpy.random` would take five
    # milliseconds more.
    generator = Random(0)
    parts = np.array([[generator.random() for _ in free] for _ in range(RANDOM_POSES)]).reshape(
        RANDOM_POSES, len(free)
    )
    values = [
        low + parts[:, k] * (high - low)
        for k, (low, high) in enumerate(sweep.info.range for sweep in free)
    ]
    together = np.tile(start, (RANDOM_POSES, 1))
    together[:, [sweep.place for sweep in free]] = (
        np.array(values).reshape(len(free), RANDOM_POSES).T
    )
    return together


def _is_certain(
    geodesic: Paths, paths: Paths, own: int, path: int, excess: float, q: Array
) -> bool:
    """Return whether a path has the same excess right beside a pose; otherwise it is due to rounding."""
    beside = np.array([q - ASIDE, q + ASIDE])
    there = paths.system.measure_one_path([path] * 2, beside) - geodesic.system.measure_one_path(
        [own] * 2, beside
    )
    return bool((np.abs(there - excess) < NEAR).all())
