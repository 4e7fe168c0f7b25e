"""Polynomials of coordinates that replace muscle paths, fitted to lengths and moment arms.

As in OpenSim's PolynomialPathFitter, the order rises until both are within a tolerance. Moment arms
are derivatives of the length. A path that slips has other moment arms; its polynomial is the best
compromise.
"""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from osimlite.base.named_tuples import NamedTuple
from osimlite.mechanics.kernels.paths import PATH_WORK
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.function_types import MultivariatePolynomialFunction
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
        path: fitted path, named by the path of its force.
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
        model: model with the paths; function-based paths are skipped.
        tolerance: root mean square error at which the order stops rising, m.
        poses: number of poses, spread over the ranges of the coordinates.

    Returns:
        Fits of all paths that are not function-based, in the order of the paths of the model.
    """
    model_paths = paths(model)
    mechanism = model_paths.mechanism
    q, free_coordinates = _sample_poses(mechanism, poses)
    zero_speeds = np.zeros(len(mechanism.coordinates))
    lengths = np.array(
        [model_paths.system.measure_paths(row, zero_speeds, PATH_WORK.LENGTH) for row in q]
    )
    arms = model_paths.compute_moment_arms(q)
    tree = model.tree()
    result = []
    for index, name in enumerate(model_paths.names):
        if isinstance(getattr(tree.find(name), "geometry_path", None), FunctionBasedPath):
            continue
        result.append(
            _fit_path(
                model_paths,
                mechanism,
                name,
                q,
                free_coordinates,
                lengths[:, index],
                arms[:, index],
                tolerance,
            )
        )
    return result


def _sample_poses(mechanism: Mechanism, count: int) -> tuple[Array, list[int]]:
    """Sample poses that satisfy the constraints.

    Returns:
        Poses (k, n), and the indices of the sampled coordinates.
    """
    infos = mechanism.coordinates
    dependent = {
        constraint.dependent
        for constraint in mechanism.constraints
        if isinstance(constraint, Coupler)
    }
    free_coordinates = [
        k
        for k, info in enumerate(infos)
        if k not in dependent and not info.locked and info.prescribed is None
    ]
    bounds = np.array([_limit_range(infos[k].range) for k in free_coordinates]).reshape(-1, 2)
    rng = np.random.default_rng(0)
    # Latin hypercube: one sample in each of `count` equal parts of every range.
    samples = np.array([rng.permutation(count) for _ in free_coordinates]).T.reshape(
        count, len(free_coordinates)
    ) + rng.random((count, len(free_coordinates)))
    q = np.tile([info.default_value for info in infos], (count, 1))
    q[:, free_coordinates] = bounds[:, 0] + samples / count * (bounds[:, 1] - bounds[:, 0])
    if (
        any(not hasattr(constraint, "locked") for constraint in mechanism.constraints)
        and mechanism.constraints
    ):
        q = np.array([mechanism.assemble(row) for row in q])
    return q, free_coordinates


def _limit_range(value_range: tuple[float, float]) -> tuple[float, float]:
    """Return a range, or the default range if it is empty or too wide."""
    lower, upper = value_range
    return (
        (lower, upper)
        if lower < upper and upper - lower <= 2.0 * UNBOUNDED_RANGE
        else (-UNBOUNDED_RANGE, UNBOUNDED_RANGE)
    )


def _fit_path(
    model_paths: Paths,
    mechanism: Mechanism,
    name: str,
    q: Array,
    free_coordinates: list[int],
    lengths: Array,
    arms: Array,
    tolerance: float,
) -> PathFit:
    """Fit the polynomial of one path.

    Returns:
        Fit of the lowest order whose root mean square errors are within `tolerance`, or else of the
        highest order that the poses determine.
    """
    varied_coordinates = [
        k for k in free_coordinates if np.nanmax(np.abs(arms[:, k])) > MIN_MOMENT_ARM_M
    ] or free_coordinates[:1]
    is_finite = np.isfinite(lengths) & np.isfinite(arms[:, varied_coordinates]).all(axis=1)
    x = q[is_finite][:, varied_coordinates]
    targets = lengths[is_finite]
    target_arms = arms[is_finite][:, varied_coordinates]
    result: PathFit | None = None
    for order in ORDERS:
        powers = np.array(
            [
                exponents
                for exponents in product(range(order + 1), repeat=len(varied_coordinates))
                if sum(exponents) <= order
            ]
        )
        # Twice as many equations as coefficients avoid overfitting.
        if len(powers) > 0.5 * len(targets) * (1 + len(varied_coordinates)):
            break
        values, slopes = _compute_monomials(x, powers)
        # Moment arms are the negative derivatives of the length.
        matrix = np.vstack([values, *(-slope for slope in slopes)])
        right_side = np.concatenate([targets, *target_arms.T])
        # Scaled columns make the least-squares problem well conditioned.
        sizes = np.linalg.norm(matrix, axis=0)
        coefficients = np.linalg.lstsq(matrix / sizes, right_side, 1e-12)[0] / sizes
        residuals = matrix @ coefficients - right_side
        length_residuals = residuals[: len(targets)]
        arm_residuals = residuals[len(targets) :]
        polynomial = MultivariatePolynomialFunction(
            dimension=len(varied_coordinates),
            order=order,
            coefficients=tuple(coefficients.tolist()),
        )
        coordinate_paths = tuple(mechanism.coordinates[k].path for k in varied_coordinates)
        path = FunctionBasedPath(
            name=name, coordinate_paths=coordinate_paths, length_function=polynomial
        )
        result = PathFit(
            path,
            order,
            *(
                float(np.sqrt(np.mean(residual**2)))
                for residual in (length_residuals, arm_residuals)
            ),
            *(float(np.abs(residual).max()) for residual in (length_residuals, arm_residuals)),
        )
        if result.length <= tolerance and result.arm <= tolerance:
            break
    assert result is not None
    return result


def _compute_monomials(x: Array, powers: Array) -> tuple[Array, list[Array]]:
    """Return all monomials (k, m) at arguments (k, n), and their derivatives by each argument."""
    highest = int(powers.max(initial=0))
    table = np.stack([x**power for power in range(highest + 1)])
    columns = range(x.shape[1])
    values = np.prod([table[powers[:, c], :, c] for c in columns], axis=0).T
    slopes = []
    for argument in columns:
        lowered_powers = np.maximum(powers[:, argument] - 1, 0)
        factors = [table[lowered_powers if c == argument else powers[:, c], :, c] for c in columns]
        slopes.append((np.prod(factors, axis=0) * powers[:, argument, None]).T)
    return values, slopes
