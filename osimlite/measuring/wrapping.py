"""Paths around surfaces in OpenSim's way beside the same along geodesics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from osimlite.errors import SimulationError
from osimlite.lint.measures import Pose, Wrapping
from osimlite.measuring.sweeps import STILL, Sweep, lengths
from osimlite.multibody.spatial import Array
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.paths import Paths

TOGETHER = 64
"""Poses with values of all coordinates within their ranges, at random but always the same."""


def wrappings(geodesic: Paths, paths: Paths, start: Array, looked_at: Sequence[Sweep]) -> Iterator[Wrapping]:
    """Each path around surfaces: by how much it is longer than along geodesics by default, and where by most."""
    default = _excess(geodesic, paths, start)
    swept = [sweep.lengths - [_lengths(geodesic, q) for q in sweep.poses] for sweep in looked_at]
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
            found = [(float(default[k]), Pose())]
            for sweep, rows in zip(looked_at, swept, strict=True):
                found += [(float(row[k]), sweep.pose(value)) for value, row in zip(sweep.values, rows, strict=True)]
            moved = [sweep for sweep in free if np.ptp(sweep.lengths[:, k]) > STILL]
            for q, row in zip(together, excesses, strict=True):
                found.append((float(row[k]), Pose(tuple(sweep.value(q[sweep.place]) for sweep in moved))))
            worst, pose = max(found, key=lambda item: np.nan_to_num(abs(item[0])))
            yield Wrapping(name, around, float(default[k]), worst, pose)


def _excess(geodesic: Paths, paths: Paths, q: Array) -> Array:
    return lengths(paths, q) - _lengths(geodesic, q)


def _lengths(paths: Paths, q: Array) -> Array:
    try:
        return lengths(paths, q)
    except SimulationError:
        return np.full(len(paths.names), np.nan)
