"""Paths around surfaces in OpenSim's way beside the same along geodesics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from osimlite.errors import SimulationError
from osimlite.lint.measures import Pose, Wrapping
from osimlite.measuring.sweeps import Sweep, lengths
from osimlite.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.paths import Paths


def wrappings(model: Model, paths: Paths, start: Array, looked_at: Sequence[Sweep]) -> Iterator[Wrapping]:
    """Each path around surfaces: by how much it is longer than along geodesics by default, and where by most."""
    routes = {k: route for k, route in enumerate(paths.routes.values()) if isinstance(route, ThroughPoints)}
    wrapped = [k for k, route in routes.items() if any(surface.law for surface in route.surfaces)]
    if not wrapped:
        return
    geodesic = Paths(model, "geodesic")
    default = lengths(paths, start) - _lengths(geodesic, start)
    errors = [sweep.lengths - [_lengths(geodesic, q) for q in sweep.poses] for sweep in looked_at]
    for k in wrapped:
        worst, pose = float(default[k]), Pose()
        for sweep, rows in zip(looked_at, errors, strict=True):
            value = int(np.argmax(np.nan_to_num(np.abs(rows[:, k]))))
            if abs(rows[value, k]) > abs(worst):
                worst, pose = float(rows[value, k]), sweep.pose(sweep.values[value])
        surfaces = tuple(surface.tangent.name for surface in routes[k].surfaces if surface.law)
        yield Wrapping(paths.names[k], surfaces, float(default[k]), worst, pose)


def _lengths(paths: Paths, q: Array) -> Array:
    try:
        return lengths(paths, q)
    except SimulationError:
        return np.full(len(paths.names), np.nan)
