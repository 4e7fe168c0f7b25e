"""Polynomials of the coordinates in the places of paths, fitted to lengths and moment arms over the ranges of motion.

As OpenSim's PolynomialPathFitter: of rising order, until both are met. The moment arms are the
derivatives of the length, so that a path that slips, whose moment arms are not, is met as well as
both can be.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from osimlite.mechanics.kernels.paths import LENGTH
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.functions import MultivariatePolynomialFunction
from osimlite.schema.model import Model
from osimlite.schema.paths import FunctionBasedPath
from osimlite.simulation.paths import Paths, paths

TOLERANCE = 1e-4
"""Root mean square of what is off in lengths, and in moment arms, at which no higher order is tried, m."""
COUNTS = 1e-4
"""A coordinate about which the moment arm is nowhere larger means nothing to a path, m."""
ORDERS = range(2, 7)
POSES = 700
WIDEST = math.pi
"""Coordinates without bounds are varied so far, rad or m."""


class Fitted(NamedTuple):
    """A path as a polynomial.

    Attributes:
        path: with the path of its force as its name.
        order: of the polynomial.
        length, arm: root mean squares of what is off, m.
        worst_length, worst_arm: the largest, m.
    """

    path: FunctionBasedPath
    order: int
    length: float
    arm: float
    worst_length: float
    worst_arm: float


def fit_paths(model: Model, tolerance: float = TOLERANCE, poses: int = POSES) -> list[Fitted]:
    """Polynomials for all paths of forces of a model; see the module.

    Args:
        model: whose paths; those that are functions already are left as they are.
        tolerance: root mean squares that are good enough, m.
        poses: how many are tried, over the ranges of the coordinates.
    """
    known = paths(model)
    mechanism = known.mechanism
    q, free = _poses(mechanism, poses)
    still = np.zeros(len(mechanism.coordinates))
    lengths = np.array([known.system.measured(row, still, LENGTH) for row in q])
    arms = known.all_moment_arms(q)
    tree, result = model.tree(), []
    for place, name in enumerate(known.names):
        if isinstance(getattr(tree.at(name), "geometry_path", None), FunctionBasedPath):
            continue
        result.append(
            _fitted(known, mechanism, name, q, free, lengths[:, place], arms[:, place], tolerance)
        )
    return result


def _poses(mechanism: Mechanism, count: int) -> tuple[Array, list[int]]:
    """Poses (k, n) where the constraints hold, and the coordinates that are varied."""
    infos = mechanism.coordinates
    dependent = {item.dependent for item in mechanism.constraints if isinstance(item, Coupler)}
    free = [
        k
        for k, info in enumerate(infos)
        if k not in dependent and not info.locked and info.prescribed is None
    ]
    bounds = np.array([_range(infos[k].range) for k in free]).reshape(-1, 2)
    rng = np.random.default_rng(0)
    # One in each of as many equal parts of every range.
    parts = np.array([rng.permutation(count) for _ in free]).T.reshape(
        count, len(free)
    ) + rng.random((count, len(free)))
    q = np.tile([info.default_value for info in infos], (count, 1))
    q[:, free] = bounds[:, 0] + parts / count * (bounds[:, 1] - bounds[:, 0])
    if any(not hasattr(item, "locked") for item in mechanism.constraints) and mechanism.constraints:
        q = np.array([mechanism.assemble(row) for row in q])
    return q, free


def _range(given: tuple[float, float]) -> tuple[float, float]:
    low, high = given
    return (low, high) if low < high and high - low <= 2.0 * WIDEST else (-WIDEST, WIDEST)


def _fitted(
    known: Paths,
    mechanism: Mechanism,
    name: str,
    q: Array,
    free: list[int],
    lengths: Array,
    arms: Array,
    tolerance: float,
) -> Fitted:
    own = [k for k in free if np.nanmax(np.abs(arms[:, k])) > COUNTS] or free[:1]
    good = np.isfinite(lengths) & np.isfinite(arms[:, own]).all(axis=1)
    x, wanted, pulls = q[good][:, own], lengths[good], arms[good][:, own]
    best: Fitted | None = None
    for order in ORDERS:
        powers = np.array(
            [item for item in product(range(order + 1), repeat=len(own)) if sum(item) <= order]
        )
        if len(powers) > 0.5 * len(wanted) * (1 + len(own)):
            break
        values, slopes = _monomials(x, powers)
        matrix = np.vstack([values, *(-slope for slope in slopes)])
        right = np.concatenate([wanted, *pulls.T])
        sizes = np.linalg.norm(matrix, axis=0)
        coefficients = np.linalg.lstsq(matrix / sizes, right, 1e-12)[0] / sizes
        off = matrix @ coefficients - right
        length, arm = off[: len(wanted)], off[len(wanted) :]
        polynomial = MultivariatePolynomialFunction(
            dimension=len(own), order=order, coefficients=tuple(coefficients.tolist())
        )
        places = tuple(mechanism.coordinates[k].path for k in own)
        path = FunctionBasedPath(name=name, coordinate_paths=places, length_function=polynomial)
        best = Fitted(
            path,
            order,
            *(float(np.sqrt(np.mean(each**2))) for each in (length, arm)),
            *(float(np.abs(each).max()) for each in (length, arm)),
        )
        if best.length <= tolerance and best.arm <= tolerance:
            break
    assert best is not None
    return best


def _monomials(x: Array, powers: Array) -> tuple[Array, list[Array]]:
    """All monomials (k, m) at some arguments (k, n), and their derivatives by each argument."""
    highest = int(powers.max(initial=0))
    table = np.stack([x**power for power in range(highest + 1)])
    columns = range(x.shape[1])
    values = np.prod([table[powers[:, c], :, c] for c in columns], axis=0).T
    slopes = []
    for by in columns:
        lower = np.maximum(powers[:, by] - 1, 0)
        parts = [table[lower if c == by else powers[:, c], :, c] for c in columns]
        slopes.append((np.prod(parts, axis=0) * powers[:, by, None]).T)
    return values, slopes
