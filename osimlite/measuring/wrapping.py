"""Paths around surfaces in OpenSim's way beside the same along geodesics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from osimlite.lint.measures import Pose, Wrapping
from osimlite.measuring.sweeps import STILL, Sweep, lengths
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.paths import Paths

TOGETHER = 64
"""Poses with values of all coordinates within their ranges, at random but always the same."""


ASIDE, NEAR = 1e-7, 1e-4
"""How far (rad or m) beside a pose a length is computed again, and by how much (m) it may differ there."""


def wrappings(geodesic: Paths, paths: Paths, start: Array, looked_at: Sequence[Sweep]) -> Iterator[Wrapping]:
    """Each path around surfaces: by how much it is longer than along geodesics by default, and where by most."""
    default = _excess(geodesic, paths, start)
    swept = [sweep.lengths - [lengths(geodesic, q) for q in sweep.poses] for sweep in looked_at]
    free = [sweep for sweep in looked_at if not sweep.is_tied]
    parts = np.random.default_rng(0).random((TOGETHER, len(free)))
    values = [low + parts[:, k] * (high - low) for k, (low, high) in enumerate(sweep.info.range for sweep in free)]
    together = np.tile(start, (TOGETHER, 1))
    together[:, [sweep.place for sweep in free]] = np.array(values).reshape(len(free), TOGETHER).T
    excesses = np.array([_excess(geodesic, paths, q) for q in together])
    for k, (name, route) in enumerate(paths.routes.items()):
        surfaces = route.surfaces if isinstance(route, ThroughPoints) else ()
        around = tuple(surface.tangent.name for surface in surfaces if surface.law)
        if around:
            found = [(float(default[k]), Pose(), start)]
            for sweep, rows in zip(looked_at, swept, strict=True):
                poses = map(sweep.pose, sweep.values)
                found += [(float(row[k]), pose, q) for row, pose, q in zip(rows, poses, sweep.poses, strict=True)]
            moved = [sweep for sweep in free if np.ptp(sweep.lengths[:, k]) > STILL]
            for q, row in zip(together, excesses, strict=True):
                told, pose = start.copy(), Pose(tuple(sweep.value(q[sweep.place]) for sweep in moved))
                told[[sweep.place for sweep in moved]] = [value.value for value in pose.values]
                found.append((float(row[k]), pose, told))
            found.sort(key=lambda item: -np.nan_to_num(abs(item[0])))
            certain = (item for item in found if _is_certain(geodesic, paths, k, item[0], item[2]))
            worst, pose, _ = next(certain, found[-1])
            yield Wrapping(name, around, float(default[k]), worst, pose)


def _is_certain(geodesic: Paths, paths: Paths, path: int, excess: float, q: Array) -> bool:
    """Whether a path is as much too long right beside a pose; if not, rounding decides, or what nobody is told of."""
    return all(abs(_excess(geodesic, paths, q + aside)[path] - excess) < NEAR for aside in (-ASIDE, ASIDE))


def _excess(geodesic: Paths, paths: Paths, q: Array) -> Array:
    return lengths(paths, q) - lengths(geodesic, q)
