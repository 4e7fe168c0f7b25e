"""The poses that are looked at: the default one, and each coordinate alone over its range."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

from osimlite.errors import SimulationError
from osimlite.lint.measures import Pose, Value
from osimlite.multibody.linear import stacked
from osimlite.multibody.parts import CoordinateInfo
from osimlite.multibody.spatial import Array
from osimlite.simulation.paths import Paths

VALUES, TIED_VALUES, TIED_POSES = 9, 5, 40
"""Of each coordinate; of each that constraints tie to others, whose poses take long to find; and how many of these
poses are found at most."""
WIDEST = 4.0 * pi
"""A wider range (rad or m) stands for none."""
STILL = 1e-9
"""A length that changes by less (m) does not."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """A coordinate over its range, the others as in the default pose, or as near to it as constraints let them be.

    Attributes:
        paths: whose lengths change.
        place: of the coordinate in the mechanism.
        poses: values of all coordinates (k, n), those of this one increasing; as far as constraints allow.
        lengths: of all paths there (k, p), m.
        is_tied: whether a constraint moves others with the coordinate.
    """

    paths: Paths
    place: int
    poses: Array
    lengths: Array
    is_tied: bool

    @property
    def values(self) -> Array:
        """Values (k,) of the coordinate, rad or m."""
        values: Array = self.poses[:, self.place]
        return values

    @property
    def info(self) -> CoordinateInfo:
        """The coordinate."""
        return self.paths.mechanism.coordinates[self.place]

    def value(self, value: float) -> Value:
        """A value of the coordinate, with its name."""
        return Value(self.info.name, float(value), self.info.unit)

    def pose(self, value: float) -> Pose:
        """What people call the pose at a value of the coordinate."""
        return Pose((self.value(value),))

    def at(self, value: float) -> Array:
        """Values (n,) of all coordinates at one of this, along straight lines between the poses."""
        k = min(max(int(np.searchsorted(self.values, value)), 1), len(self.values) - 1)
        before, after = self.poses[k - 1 : k + 1]
        part = (value - before[self.place]) / (after[self.place] - before[self.place])
        between: Array = before + part * (after - before)
        return between


def lengths(paths: Paths, q: Array) -> Array:
    """Lengths (p,) of all paths, m; NaN where they cannot be computed."""
    try:
        return np.array(list(paths.lengths(q).values()))
    except SimulationError:
        return np.full(len(paths.names), np.nan)


def sweeps(paths: Paths, start: Array) -> Iterator[Sweep]:
    """A sweep of each coordinate that changes the length of a path."""
    are_tied, left = tied(paths, start), TIED_POSES
    for place, info in enumerate(paths.mechanism.coordinates):
        low, high = info.range
        if info.locked or info.prescribed is not None or info.yielding or not 0.0 < high - low <= WIDEST:
            continue
        is_tied = bool(are_tied[place])
        if is_tied and left < TIED_VALUES:
            continue
        left -= is_tied * TIED_VALUES
        poses = _poses(paths, start, place, np.linspace(low, high, TIED_VALUES if is_tied else VALUES), is_tied)
        rows = np.array([lengths(paths, q) for q in poses])
        if len(rows) > 1 and np.nan_to_num(np.ptp(rows, axis=0)).max(initial=0.0) > STILL:
            yield Sweep(paths, place, np.array(poses), rows, is_tied)


def _poses(paths: Paths, start: Array, place: int, values: Array, is_tied: bool) -> list[Array]:
    """The poses with these values of a coordinate, from the default one to where constraints let it go no further."""
    above = values >= start[place]
    poses: list[Array] = []
    for away in (values[above], values[~above][::-1]):
        for value in away:
            q = start.copy()
            q[place] = value
            try:
                q = paths.mechanism.assemble(q, kept=(place,)) if is_tied else q
            except SimulationError:
                break
            poses.append(q)
    return sorted(poses, key=lambda q: float(q[place]))


def tied(paths: Paths, start: Array) -> Array:
    """Whether each coordinate (n,) is in the equations of a constraint."""
    constraints = paths.mechanism.constraints
    if not constraints:
        return np.zeros(len(start), dtype=bool)
    state = paths.mechanism.at(start)
    rows, _ = stacked([item.velocity_equations(state) for item in constraints])
    found: Array = np.abs(rows).max(axis=0) > 0.0
    return found
