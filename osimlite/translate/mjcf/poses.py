"""Random poses of a model, and what its paths do in them: what tendons are chosen by, fitted to and measured with."""

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

EXACT_TOLERANCE_M = 1e-9
"""Errors of lengths and moment arms (m) up to which a tendon does what the path does."""


@dataclass(frozen=True, eq=False)
class Poses:
    """P poses of a mechanism of b bodies and n coordinates, of which m move; arrays over bodies end with ground."""

    q: Array  # values of the coordinates (P, n)
    # places (m,) of the coordinates that move by themselves: neither locked nor coupled
    moving: Array
    rotations: Array  # of the bodies in ground (b + 1, P, 3, 3)
    origins: Array  # of the bodies in ground (b + 1, P, 3), m
    # (b + 1, P, 6, m) from the speeds of those coordinates, all that must move with them included,
    # to the angular velocity and the velocity of the origin of each body
    jacobians: Array
    rates: Array  # of all coordinates (P, n, m) by these speeds

    def select_coordinates(self, columns: Sequence[int]) -> Poses:
        """The same with some of the moving coordinates, by their places in `moving`."""
        own = list(columns)
        return Poses(
            self.q,
            self.moving[own],
            self.rotations,
            self.origins,
            self.jacobians[..., own],
            self.rates[..., own],
        )

    def locate(self, body: int, station: Array) -> Array:
        """Places in ground (P, 3) or (k, P, 3) of a station of a body, (3,) or one for each pose."""
        return self.origins[body] + multiply_each_pose(station, self.rotations[body].swapaxes(1, 2))

    def express(self, body: int, places: Array) -> Array:
        """Stations of a body (k, P, 3) at places in ground (k, P, 3)."""
        return multiply_each_pose(places - self.origins[body], self.rotations[body])

    def locate_at(self, body: int, stations: Array, at: Indices) -> Array:
        """Places in ground (k, 3) of stations of a body (k, 3), each in one of the poses, by their places (k,)."""
        return self.origins[body][at] + np.einsum("pij,pj->pi", self.rotations[body][at], stations)


@dataclass(frozen=True, eq=False)
class PathSamples:
    """What a path does in P poses."""

    lengths: Array  # (P,), m
    arms: Array  # moment arms (P, m) about the coordinates that move by themselves, m or 1
    # numbers and places (3,) in ground of what the path runs through, see `points`
    nodes: Sequence[Sequence[tuple[int, Array]]]


def multiply_each_pose(rows: Array, matrices: Array) -> Array:
    """Rows (k, P, i), (P, i) or (i,) times the matrix of each pose (P, i, j). Many times as fast as `einsum`."""
    if rows.ndim < 3:
        return np.asarray((rows[..., None, :] @ matrices)[..., 0, :])
    return np.asarray((rows.swapaxes(0, 1) @ matrices).swapaxes(0, 1))


def measure_arm_errors(mechanism: Mechanism, arms: Array, truth: PathSamples) -> dict[int, Error]:
    """How far moment arms (P, m) are off, by the place of the coordinate, where a path or its stand-in has one."""
    result = {}
    for place, off, wanted in zip(
        list_free_coordinates(mechanism), (arms - truth.arms).T, truth.arms.T, strict=True
    ):
        if np.abs(off).max() > EXACT_TOLERANCE_M or np.abs(wanted).max() > EXACT_TOLERANCE_M:
            rotational = mechanism.coordinates[place].motion_type == "rotational"
            result[place] = Error.measure(off, "m" if rotational else "1")
    return result


def draw_values(mechanism: Mechanism, count: int, seed: int) -> Array:
    """Values (count, n) of the coordinates, spread evenly over the ranges of those that move by themselves.

    Where a range is none, they are within 1 of the default.
    """
    coupled = [item for item in mechanism.constraints if isinstance(item, Coupler)]
    values = np.tile(mechanism.values({}), (count, 1))
    for place in list_free_coordinates(mechanism):
        info = mechanism.coordinates[place]
        low, high = info.range
        if not 0.0 <= high - low < np.inf:
            low, high = info.default_value - 1.0, info.default_value + 1.0
        values[:, place] = np.random.default_rng((seed, place)).uniform(low, high, count)
    for item in coupled:
        values[:, item.dependent] = [
            item.function.evaluate(row[list(item.independent)])[0] for row in values
        ]
    return values


def list_free_coordinates(mechanism: Mechanism) -> list[int]:
    """Places of the coordinates that are neither locked, prescribed nor coupled to others."""
    coupled = {item.dependent for item in mechanism.constraints if isinstance(item, Coupler)}
    return [
        index
        for index, info in enumerate(mechanism.coordinates)
        if not info.locked and info.prescribed is None and index not in coupled
    ]


def draw_poses(paths: Paths, count: int, seed: int = 0) -> tuple[Poses, Mapping[str, PathSamples]]:
    """Random poses, and what each path does in them."""
    mechanism = paths.mechanism
    values, moving = (
        draw_values(mechanism, count, seed),
        np.array(list_free_coordinates(mechanism), dtype=int),
    )
    states = [mechanism.at(row) for row in values]
    couplings = [paths.compute_free_coupling(state) for state in states]
    rates = np.nan_to_num(np.stack([coupling[:, moving] for coupling in couplings]))
    poses = Poses(
        values,
        moving,
        np.stack([state.rotations for state in states], axis=1),
        np.stack([state.origins for state in states], axis=1),
        np.stack([state.jacobians @ own for state, own in zip(states, rates, strict=True)], axis=1),
        rates,
    )
    lengths = paths.system.measure_poses(values).T.copy()
    arms = (
        np.nan_to_num(paths.compute_moment_arms(values, couplings)[:, :, moving])
        .swapaxes(0, 1)
        .copy()
    )
    nodes = [paths.points(row) for row in values]
    truth = {
        path: PathSamples(lengths[k], arms[k], [row.get(path, ()) for row in nodes])
        for k, path in enumerate(paths.names)
    }
    return poses, truth
