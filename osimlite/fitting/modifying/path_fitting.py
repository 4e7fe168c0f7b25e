"""Polynomials of coordinates that replace muscle paths, fitted to lengths and moment arms.

As in OpenSim's PolynomialPathFitter, the order rises until both are within a tolerance. Moment arms
are derivatives of the length. A path that slips has other moment arms; its polynomial is the best
compromise.
"""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np

from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.functions import MultivariatePolynomialFunction
from osimlite.schema.model import Model
from osimlite.schema.paths import FunctionBasedPath
from osimlite.simulation.paths import Paths, paths

TOLERANCE_M = 1e-4
"""Root mean square error of lengths and moment arms at which the order stops rising, m."""
MIN_MOMENT_ARM_M = 1e-4
"""Largest moment arm of a coordinate that has no influence on a path, m."""
ORDERS = range(2, 7)
"""Orders of the polynomials."""
POSE_COUNT = 700
"""Default number of poses."""
UNBOUNDED_RANGE = math.pi
"""Range, on each side of zero, of coordinates without bounds, rad or m."""


class PathFit(NamedTuple):
    """Path as a polynomial.

    Attributes:
        path: the path, named by the path of its force.
        order: order of the polynomial.
        length: root mean square error of the length, m.
        arm: root mean square error of the moment arms, m.
        worst_length: largest error of the length, m.
        worst_arm: largest error of the moment arms, m.
    """

    path: FunctionBasedPath
    order: int
    length: float
    arm: float
    worst_length: float
    worst_arm: float


def fit_paths(
    model: Model, tolerance: float = TOLERANCE_M, poses: int = POSE_COUNT
) -> list[PathFit]:
    """Fit polynomials to all paths of forces of a model.

    Args:
        model: the model; function-based paths are skipped.
        tolerance: root mean square error at which the order stops rising, m.
        poses: number of poses, spread over the ranges of the coordinates.
    """
    known = paths(model)
    mechanism = known.mechanism
    q, free = _sample_poses(mechanism, poses)
    still = np.zeros(len(mechanism.coordinates))
    lengths = np.array([known.system.measure_paths(row, still, PATH_WORK.LENGTH) for row in q])
    arms = known.compute_moment_arms(q)
    tree = model.tree()
    result = []
    for index, name in enumerate(known.names):
        if isinstance(getattr(tree.find(name), "geometry_path", None), FunctionBasedPath):
            continue
        result.append(
            _fit_path(known, mechanism, name, q, free, lengths[:, index], arms[:, index], tolerance)
        )
    return result


def _sample_poses(mechanism: Mechanism, count: int) -> tuple[Array, list[int]]:
    """Sample poses that satisfy the constraints.

    Returns:
        Poses (k, n), and the indices of the sampled coordinates.
    """
    infos = mechanism.coordinates
    dependent = {item.dependent for item in mechanism.constraints if isinstance(item, Coupler)}
    free = [
        k
        for k, info in enumerate(infos)
        if k not in dependent and not info.locked and info.prescribed is None
    ]
    bounds = np.array([_limit_range(infos[k].range) for k in free]).reshape(-1, 2)
    rng = np.random.default_rng(0)
    # Latin hypercube: one sample in each of `count` equal parts of every range.
    parts = np.array([rng.permutation(count) for _ in free]).T.reshape(
        count, len(free)
    ) + rng.random((count, len(free)))
    q = np.tile([info.default_value for info in infos], (count, 1))
    q[:, free] = bounds[:, 0] + parts / count * (bounds[:, 1] - bounds[:, 0])
    if any(not hasattr(item, "locked") for item in mechanism.constraints) and mechanism.constraints:
        q = np.array([mechanism.assemble(row) for row in q])
    return q, free


def _limit_range(given: tuple[float, float]) -> tuple[float, float]:
    """Return a range, or the default range if it is empty or too wide."""
    low, high = given
    return (
        (low, high)
        if low < high and high - low <= 2.0 * UNBOUNDED_RANGE
        else (-UNBOUNDED_RANGE, UNBOUNDED_RANGE)
    )


def _fit_path(
    known: Paths,
    mechanism: Mechanism,
    name: str,
    q: Array,
    free: list[int],
    lengths: Array,
    arms: Array,
    tolerance: float,
) -> PathFit:
    """Fit the polynomial of one path."""
    varied = [k for k in free if np.nanmax(np.abs(arms[:, k])) > MIN_MOMENT_ARM_M] or free[:1]
    good = np.isfinite(lengths) & np.isfinite(arms[:, varied]).all(axis=1)
    x = q[good][:, varied]
    targets = lengths[good]
    pulls = arms[good][:, varied]
    best: PathFit | None = None
    for order in ORDERS:
        powers = np.array(
            [item for item in product(range(order + 1), repeat=len(varied)) if sum(item) <= order]
        )
        # Twice as many equations as coefficients avoid overfitting.
        if len(powers) > 0.5 * len(targets) * (1 + len(varied)):
            break
        values, slopes = _compute_monomials(x, powers)
        # Moment arms are the negative derivatives of the length.
        matrix = np.vstack([values, *(-slope for slope in slopes)])
        right = np.concatenate([targets, *pulls.T])
        # Scaled columns make the least-squares problem well conditioned.
        sizes = np.linalg.norm(matrix, axis=0)
        coefficients = np.linalg.lstsq(matrix / sizes, right, 1e-12)[0] / sizes
        off = matrix @ coefficients - right
        length = off[: len(targets)]
        arm = off[len(targets) :]
        polynomial = MultivariatePolynomialFunction(
            dimension=len(varied), order=order, coefficients=tuple(coefficients.tolist())
        )
        coordinate_paths = tuple(mechanism.coordinates[k].path for k in varied)
        path = FunctionBasedPath(
            name=name, coordinate_paths=coordinate_paths, length_function=polynomial
        )
        best = PathFit(
            path,
            order,
            *(float(np.sqrt(np.mean(each**2))) for each in (length, arm)),
            *(float(np.abs(each).max()) for each in (length, arm)),
        )
        if best.length <= tolerance and best.arm <= tolerance:
            break
    assert best is not None
    return best


def _compute_monomials(x: Array, powers: Array) -> tuple[Array, list[Array]]:
    """Return all monomials (k, m) at arguments (k, n), and their derivatives by each argument."""
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
