"""All that is measured of a model."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from osimlite.errors import SimulationError
from osimlite.lint.measures import LengthOnSurface, Measures, Pose
from osimlite.measuring.jumps import jumps
from osimlite.measuring.muscles import fibers_of, reach_of, start_of
from osimlite.measuring.points import moving_points
from osimlite.measuring.sweeps import Sweep, sweeps
from osimlite.measuring.wrapping import wrappings
from osimlite.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.elements.geometries.paths.geometry_path import ThroughPoints
from osimlite.simulation.engines.linking import AT_HAND
from osimlite.simulation.paths import Paths

MIDDLE = 0.5
"""Part of a range in which fibers are looked at: at the ends, few muscles have not reached a limit."""


@np.errstate(all="ignore")
def measured(model: Model, *, compiles: bool) -> Measures:
    """Measure the paths and muscles of a model.

    Args:
        model: what is measured.
        compiles: whether machine code is made that is in no file yet, which takes longer than to do without for a
            model that has few surfaces.

    Raises:
        UnsupportedError: a path, a joint or a constraint cannot be computed.
        ModelError: something makes no sense.
        SimulationError: the constraints allow no default pose, or there are no lengths in it.
    """
    code = None if compiles else AT_HAND
    paths = Paths(model, code=code)
    start = paths.mechanism.assemble({})
    default = np.array(list(paths.lengths(start).values()))
    looked_at = [*sweeps(paths, start)]
    has_surfaces = any(isinstance(route, ThroughPoints) and route.surfaces for route in paths.routes.values())
    starts, reaches = [], []
    places = {name: place for place, name in enumerate(paths.names)}
    for fibers in fibers_of(model, paths.mechanism):
        place = places[fibers.path]
        begun = start_of(fibers, default[place])
        starts += [begun] if begun is not None else []
        (shortest, short), (longest, long) = _ends(looked_at, default, place)
        reaches += [reach_of(fibers, shortest, True, short), reach_of(fibers, longest, False, long)]
    return Measures(
        1 + sum(len(sweep.poses) for sweep in looked_at),
        [*wrappings(Paths(model, "geodesic", code), paths, start, looked_at)] if has_surfaces else [],
        [*jumps(paths, looked_at)],
        [*_on_surfaces(paths, start, looked_at)],
        [*moving_points(paths)],
        starts,
        reaches,
    )


def _on_surfaces(paths: Paths, start: Array, looked_at: list[Sweep]) -> Iterator[LengthOnSurface]:
    """The lengths on surfaces that are no lengths, of each path on each surface the first that is found."""
    told = set()
    swept = ((sweep.pose(value), q) for sweep in looked_at for value, q in zip(sweep.values, sweep.poses, strict=True))
    for pose, q in chain([(Pose(), start)], swept):
        try:
            found = paths.lengths_on_surfaces(q)
        except SimulationError:
            continue
        for name, on_surfaces in found.items():
            for surface, length in on_surfaces.items():
                if not length >= 0.0 and (name, surface) not in told:
                    told.add((name, surface))
                    yield LengthOnSurface(name, surface, length, pose)


def _ends(looked_at: list[Sweep], default: Array, place: int) -> tuple[tuple[float, Pose], tuple[float, Pose]]:
    """Where a path is shortest and where it is longest, by default and in the middle of the ranges."""
    found = [(float(default[place]), Pose())]
    for sweep in looked_at:
        low, high = sweep.info.range
        for value, length in zip(sweep.values, sweep.lengths[:, place], strict=True):
            if length == length and round(abs((value - low) / (high - low) - 0.5), 9) <= 0.5 * MIDDLE:
                found.append((float(length), sweep.pose(value)))
    return min(found, key=lambda item: item[0]), max(found, key=lambda item: item[0])
