"""All that is measured of a model."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain

import numpy as np

from osimlite.lint.measures import LengthOnSurface, Measures, Pose
from osimlite.measuring.jumps import jumps
from osimlite.measuring.muscles import fibers_of, reach_of, start_of
from osimlite.measuring.points import moving_points
from osimlite.measuring.sweeps import Sweep, lengths, sweeps
from osimlite.measuring.wrapping import wrappings
from osimlite.multibody.spatial import Array
from osimlite.schema.model import Model
from osimlite.simulation.paths import Paths


def measured(model: Model) -> Measures:
    """Measure the paths and muscles of a model.

    Raises:
        UnsupportedError: a path, a joint or a constraint cannot be computed.
        ModelError: something makes no sense.
        SimulationError: the constraints allow no default pose.
    """
    paths = Paths(model)
    start = paths.mechanism.default_state()[0]
    looked_at = [*sweeps(paths, start)]
    default = lengths(paths, start)
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
        [*wrappings(model, paths, start, looked_at)],
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
        for name, on_surfaces in paths.lengths_on_surfaces(q).items():
            for surface, length in on_surfaces.items():
                if not length >= 0.0 and (name, surface) not in told:
                    told.add((name, surface))
                    yield LengthOnSurface(name, surface, length, pose)


def _ends(looked_at: list[Sweep], default: Array, place: int) -> tuple[tuple[float, Pose], tuple[float, Pose]]:
    """Where a path is shortest and where it is longest, of all that was looked at."""
    found = [(float(default[place]), Pose())]
    for sweep in looked_at:
        row = sweep.lengths[:, place]
        if not np.isnan(row).all():
            found += [(float(row[k]), sweep.pose(sweep.values[k])) for k in (np.nanargmin(row), np.nanargmax(row))]
    return min(found, key=lambda item: item[0]), max(found, key=lambda item: item[0])
