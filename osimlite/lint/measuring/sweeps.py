"""Poses for measurements: the default pose, and each coordinate alone over its range."""

from __future__ import annotations

from collections.abc import Container
from math import pi

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.errors import SimulationError
from osimlite.lint.measures import CoordinateSetting, MeasuringPose
from osimlite.mechanics.multibody.linear import stack_equations
from osimlite.mechanics.multibody.parts import CoordinateInfo
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.paths import Paths

UNTIED_VALUES = 9
"""Number of values of each free coordinate."""
TIED_VALUES = 5
"""Number of values of a coordinate that constraints tie to others, each of which needs an assembly."""
TIED_POSES = 40
"""Largest number of assembled poses of a model, which limits the time of a check."""
MAX_RANGE = 4.0 * pi
"""Widest range (rad or m) that is measured; authors who do not want a limit write wider ones."""
MIN_CHANGE_M = 1e-9
"""Change of a length (m) below which a coordinate does not move a path; larger than rounding errors."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """Sweep of a coordinate over its range, the others at their defaults or as near as constraints allow.

    Attributes:
        paths: paths of the model.
        coordinate_index: index of the swept coordinate in the mechanism.
        poses: values of all coordinates (k, n), ascending in this one, as far as constraints allow.
        is_tied: whether a constraint moves others with the coordinate.
        lengths: lengths of all paths in the poses (k, p), m.
    """

    paths: Paths
    coordinate_index: int

    poses: Array
    is_tied: bool
    lengths: Array

    @property
    def values(self) -> Array:
        """Values (k,) of the coordinate, rad or m."""
        return self.poses[:, self.coordinate_index]

    @property
    def is_moving(self) -> NDArray[np.bool_]:
        """Flags (p,) of the paths whose length changes."""
        # `nan_to_num`: a path without a length at some value counts as not moved.
        return np.nan_to_num(np.ptp(self.lengths, axis=0)) > MIN_CHANGE_M

    @property
    def info(self) -> CoordinateInfo:
        """Name, range and unit of the coordinate."""
        return self.paths.mechanism.coordinates[self.coordinate_index]

    def value(self, value: float) -> CoordinateSetting:
        """Return a value of the coordinate with its name and unit."""
        return CoordinateSetting(self.info.name, float(value), self.info.unit)

    def pose(self, value: float) -> MeasuringPose:
        """Return the pose at a value of the coordinate, for messages."""
        return MeasuringPose((self.value(value),))

    def interpolate_poses(self, values: Array, indices: NDArray[np.intp]) -> Array:
        """Return all coordinates (k, n) at values of this one, by linear interpolation between the poses.

        Args:
            values: values of the coordinate (k,), rad or m.
            indices: indices (k,) of the poses before the values.
        """
        lower_poses = self.poses[indices]
        upper_poses = self.poses[indices + 1]
        fraction = (values - lower_poses[:, self.coordinate_index]) / (
            upper_poses[:, self.coordinate_index] - lower_poses[:, self.coordinate_index]
        )
        return lower_poses + fraction[:, None] * (upper_poses - lower_poses)

    def find_poses_before(self, values: Array) -> NDArray[np.intp]:
        """Return the indices (k,) of the poses before values of the coordinate."""
        # The last interval also serves values at the upper end.
        return np.clip(np.searchsorted(self.values, values), 1, len(self.values) - 1) - 1


def sweep_coordinates(
    paths: Paths, start: Array, required_coordinates: Container[int] = ()
) -> list[Sweep]:
    """Return a sweep of each coordinate that changes the length of a path.

    Args:
        paths: paths of the model.
        start: default pose (n,).
        required_coordinates: indices of coordinates that are swept in any case, because they change
            the length of a path that is not in `paths`.
    """
    are_tied = find_tied_coordinates(paths, start)
    remaining_poses = TIED_POSES
    result: list[tuple[int, Array, bool]] = []
    for index, info in enumerate(paths.mechanism.coordinates):
        low, high = info.range
        if (
            info.locked
            or info.prescribed is not None
            or info.yielding
            or not 0.0 < high - low <= MAX_RANGE
        ):
            continue
        is_tied = bool(are_tied[index])
        # Each value of a tied coordinate needs an assembly; a check can afford only a few.
        if is_tied and remaining_poses < TIED_VALUES:
            continue
        remaining_poses -= is_tied * TIED_VALUES
        poses = _find_poses(
            paths,
            start,
            index,
            np.linspace(low, high, TIED_VALUES if is_tied else UNTIED_VALUES),
            is_tied,
        )
        if len(poses) > 1:
            result.append((index, poses, is_tied))
    # All poses are measured in one call, which costs less than one call for each coordinate.
    lengths = paths.system.measure_poses(
        np.concatenate([np.empty((0, len(start))), *(poses for _, poses, _ in result)])
    )
    swept = []
    for index, poses, is_tied in result:
        sweep_lengths, lengths = np.split(lengths, [len(poses)])
        swept.append(Sweep(paths, index, poses, is_tied, sweep_lengths))
    return [
        sweep
        for sweep in swept
        if sweep.coordinate_index in required_coordinates or sweep.is_moving.any()
    ]


def _find_poses(paths: Paths, start: Array, index: int, values: Array, is_tied: bool) -> Array:
    """Return poses with these values of a coordinate, from the default outwards as far as constraints allow."""
    poses = np.tile(start, (len(values), 1))
    poses[:, index] = values
    if not is_tied:
        return poses
    result: list[Array] = []
    above = values >= start[index]
    # From the default outwards, each pose is the guess of the next.
    for away in (poses[above], poses[~above][::-1]):
        for q in away:
            try:
                result.append(paths.mechanism.assemble(q, kept=(index,)))
            except SimulationError:
                # Constraints allow no pose here, so poses farther out are not tried.
                break
    return np.array(sorted(result, key=lambda q: float(q[index]))).reshape(-1, len(start))


def find_tied_coordinates(paths: Paths, start: Array) -> Array:
    """Return whether each coordinate (n,) is in the equations of a constraint.

    Args:
        paths: paths of the model.
        start: default pose (n,).
    """
    constraints = paths.mechanism.constraints
    if not constraints:
        return np.zeros(len(start), dtype=bool)
    state = paths.mechanism.at(start)
    # A coordinate is tied if it is in the velocity equation of some constraint.
    rows, _ = stack_equations([item.velocity_equations(state) for item in constraints])
    return np.abs(rows).max(axis=0) > 0.0
