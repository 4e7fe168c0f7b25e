"""Random poses of a model, and samples of its paths in them, to which tendons are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from osimlite.base.records import dataclass
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.simulation.paths import Paths
from osimlite.translate.fidelity import Error

Indices = NDArray[np.int64]
"""Array of indices."""

EXACT_TOLERANCE_M = 1e-9
"""Errors of lengths and moment arms (m) up to which a tendon counts as exact."""


@dataclass(frozen=True, eq=False)
class Poses:
    """P poses of a mechanism of b bodies and n coordinates; m coordinates are free.

    Ground is the last body.

    Attributes:
        q: values of the coordinates (P, n).
        moving: indices of the free coordinates (m,): neither locked, prescribed nor coupled.
        rotations: orientations of the bodies in ground (b + 1, P, 3, 3).
        origins: positions of the body origins in ground (b + 1, P, 3) (m).
        jacobians: Jacobians (b + 1, P, 6, m) from the speeds of the free coordinates, with all
            coordinates that move along, to the angular velocity of each body and the velocity of
            its origin.
        rates: rates of all coordinates by these speeds (P, n, m).
    """

    q: Array
    moving: Array
    rotations: Array
    origins: Array
    jacobians: Array
    rates: Array

    def select_coordinates(self, columns: Sequence[int]) -> Poses:
        """Return the poses with some of the free coordinates, by their indices in `moving`."""
        selected = list(columns)
        return Poses(
            self.q,
            self.moving[selected],
            self.rotations,
            self.origins,
            self.jacobians[..., selected],
            self.rates[..., selected],
        )

    def locate(self, body: int, station: Array) -> Array:
        """Return positions in ground (P, 3) or (k, P, 3) of a station of a body.

        Args:
            body: index of the body.
            station: station (3,) (m), or one for each pose (P, 3) or (k, P, 3).
        """
        return self.origins[body] + multiply_each_pose(station, self.rotations[body].swapaxes(1, 2))

    def express(self, body: int, positions: Array) -> Array:
        """Return positions in the frame of a body (k, P, 3).

        Args:
            body: index of the body.
            positions: positions in ground (k, P, 3) (m).
        """
        return multiply_each_pose(positions - self.origins[body], self.rotations[body])

    def locate_at(self, body: int, stations: Array, pose_indices: Indices) -> Array:
        """Return positions in ground (k, 3) of stations, each in one of the poses.

        Args:
            body: index of the body.
            stations: stations in the body (k, 3) (m).
            pose_indices: indices of the poses (k,).
        """
        return self.origins[body][pose_indices] + np.einsum(
            "pij,pj->pi", self.rotations[body][pose_indices], stations
        )


@dataclass(frozen=True, eq=False)
class PathSamples:
    """Path in P poses.

    Attributes:
        lengths: lengths (P,) (m).
        arms: moment arms about the free coordinates (P, m) (m for rotations, 1 for translations).
        nodes: numbers of the nodes of the path and their positions in ground (3,), m, for each
            pose; see `Paths.points`.
    """

    lengths: Array
    arms: Array
    nodes: Sequence[Sequence[tuple[int, Array]]]


def multiply_each_pose(rows: Array, matrices: Array) -> Array:
    """Multiply rows by the matrix of each pose; many times as fast as `einsum`.

    Args:
        rows: rows (k, P, i), (P, i) or (i,).
        matrices: matrices (P, i, j).

    Returns:
        Products (k, P, j), or (P, j) if `rows` has no axis k.
    """
    if rows.ndim < 3:
        return np.asarray((rows[..., None, :] @ matrices)[..., 0, :])
    # `@` multiplies stacks of matrices, whose stacked axis, the poses, must come first.
    return np.asarray((rows.swapaxes(0, 1) @ matrices).swapaxes(0, 1))


def measure_arm_errors(mechanism: Mechanism, arms: Array, samples: PathSamples) -> dict[int, Error]:
    """Measure errors of moment arms.

    Args:
        mechanism: mechanism of the model.
        arms: moment arms of a tendon about the free coordinates (P, m).
        samples: path in the same poses.

    Returns:
        Error by the index of the coordinate, for coordinates about which path or tendon has a
        moment arm.
    """
    result = {}
    for index, arm_errors, model_arms in zip(
        list_free_coordinates(mechanism), (arms - samples.arms).T, samples.arms.T, strict=True
    ):
        # A path crosses few coordinates; about the others there is nothing to compare.
        if (
            np.abs(arm_errors).max() > EXACT_TOLERANCE_M
            or np.abs(model_arms).max() > EXACT_TOLERANCE_M
        ):
            rotational = mechanism.coordinates[index].motion_type == "rotational"
            result[index] = Error.measure(arm_errors, "m" if rotational else "1")
    return result


def draw_values(mechanism: Mechanism, count: int, seed: int) -> Array:
    """Return random values (count, n) of the coordinates, uniform over the ranges of the free ones.

    Without a valid range, they are within 1 (rad or m) of the default value.

    Args:
        mechanism: mechanism of the model.
        count: number of poses.
        seed: seed of the random numbers.
    """
    couplers = [coupler for coupler in mechanism.constraints if isinstance(coupler, Coupler)]
    values = np.tile(mechanism.values({}), (count, 1))
    for index in list_free_coordinates(mechanism):
        coordinate = mechanism.coordinates[index]
        lower, upper = coordinate.range
        if not 0.0 <= upper - lower < np.inf:
            lower = coordinate.default_value - 1.0
            upper = coordinate.default_value + 1.0
        # A generator per coordinate: locking another coordinate does not change these values.
        values[:, index] = np.random.default_rng((seed, index)).uniform(lower, upper, count)
    for coupler in couplers:
        values[:, coupler.dependent] = [
            coupler.function.evaluate(row[list(coupler.independent)])[0] for row in values
        ]
    return values


def list_free_coordinates(mechanism: Mechanism) -> list[int]:
    """Return the indices of coordinates that are not locked, prescribed or coupled."""
    dependent_indices = {
        constraint.dependent
        for constraint in mechanism.constraints
        if isinstance(constraint, Coupler)
    }
    return [
        index
        for index, coordinate in enumerate(mechanism.coordinates)
        if not coordinate.locked
        and coordinate.prescribed is None
        and index not in dependent_indices
    ]


def draw_poses(paths: Paths, count: int, seed: int = 0) -> tuple[Poses, Mapping[str, PathSamples]]:
    """Draw random poses, and sample the paths in them.

    Args:
        paths: paths of the model.
        count: number of poses.
        seed: seed of the random numbers.

    Returns:
        Poses, and the samples of each path by its absolute path.
    """
    mechanism = paths.mechanism
    values = draw_values(mechanism, count, seed)
    moving = np.array(list_free_coordinates(mechanism), dtype=int)
    states = [mechanism.at(row) for row in values]
    couplings = [paths.compute_free_coupling(state) for state in states]
    # A coordinate that constraints block has no rate (NaN).
    rates = np.nan_to_num(np.stack([coupling[:, moving] for coupling in couplings]))
    poses = Poses(
        values,
        moving,
        np.stack([state.rotations for state in states], axis=1),
        np.stack([state.origins for state in states], axis=1),
        np.stack(
            [state.jacobians @ free_rates for state, free_rates in zip(states, rates, strict=True)],
            axis=1,
        ),
        rates,
    )
    # A copy makes the values of one path contiguous.
    lengths = paths.system.measure_poses(values).T.copy()
    arms = (
        np.nan_to_num(paths.compute_moment_arms(values, couplings)[:, :, moving])
        .swapaxes(0, 1)
        .copy()
    )
    nodes = [paths.points(row) for row in values]
    samples = {
        path: PathSamples(lengths[k], arms[k], [row.get(path, ()) for row in nodes])
        for k, path in enumerate(paths.names)
    }
    return poses, samples
