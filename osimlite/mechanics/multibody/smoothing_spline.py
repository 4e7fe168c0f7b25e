"""Natural splines of odd degree through or near points: OpenSim's GCVSpline.

The spline of degree 2m - 1 minimises the sum of squared residuals plus p times the integral of its
squared m-th derivative (Woltring, "A Fortran package for generalized, cross-validatory spline
smoothing and differentiation", Advances in Engineering Software 8, 1986). Outside the points it is
the polynomial of degree m - 1 that joins smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from osimlite.base.records import dataclass
from osimlite.mechanics.kernels.functions import FUNCTION_TYPE
from osimlite.mechanics.multibody.functions import Univariate
from osimlite.mechanics.multibody.spatial import Array

SAME_POINT_DISTANCE = 1e-9
"""Distance of points, relative to the mean distance, below which they count as one point."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Golden ratio of the sections of an interval."""


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial(Univariate):
    """Piecewise polynomial in x - knots[k]; the end pieces continue outside."""

    knots: Array  # first argument of each piece (k,)
    pieces: Array  # coefficients from the constant up (k, degree + 1)

    @property
    def table(self) -> Sequence[float]:
        """Table of the pieces, see `kernels.functions`."""
        header = FUNCTION_TYPE.PIECES, 1.0, len(self.knots), self.pieces.shape[1]
        numbers: list[float] = np.concatenate([header, self.knots, self.pieces.ravel()]).tolist()
        return numbers


def smoothing_spline(
    x: ArrayLike, y: ArrayLike, half_order: int, error_variance: float
) -> PiecewisePolynomial:
    """Return the natural spline of degree 2m - 1 through or near points.

    Args:
        x: abscissae (n,), which increase; n >= 2m.
        y: ordinates (n,).
        half_order: m, where the degree is 2m - 1.
        error_variance: variance of the ordinates; the smoothing is chosen so that the residuals
            have it. Zero gives a spline through the points; a negative number chooses the smoothing
            by generalized cross validation.
    """
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if error_variance != 0.0:
        values = _smooth_values(
            _scale_to_unit_spacing(points)[0], values, half_order, error_variance
        )
    (spline,) = natural_splines(points, values[:, None], half_order)
    return spline


def natural_splines(x: ArrayLike, y: ArrayLike, half_order: int) -> list[PiecewisePolynomial]:
    """Return the natural splines of degree 2m - 1 through the points of several columns.

    Args:
        x: abscissae (n,), which increase; n >= 2m.
        y: ordinates (n, k).
        half_order: m, where the degree is 2m - 1.

    Returns:
        One spline per column.
    """
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    scaled_points, scale = _scale_to_unit_spacing(points)
    pieces = (
        _compute_pieces(scaled_points, values, half_order)
        / scale ** np.arange(2.0 * half_order)[:, None]
    )
    # The piece before the first point is relative to that point, too.
    knots = np.append(points[0], points)
    return [
        PiecewisePolynomial(knots, column)
        for column in np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
    ]


def derivatives_of_samples(
    x: ArrayLike, y: ArrayLike, arguments: ArrayLike, orders: Sequence[int], half_order: int = 3
) -> tuple[Array, ...]:
    """Return derivatives of natural splines through sampled points.

    Args:
        x: abscissae (n,), which increase.
        y: ordinates (n, m), in m columns.
        arguments: arguments (k,).
        orders: orders of the derivatives; 0 is the value.
        half_order: half of the order of the splines, whose degree is 2 `half_order` - 1.

    Returns:
        One array (k, m) per order.
    """
    return SampledCurves(x, y, half_order).derivatives(arguments, orders)


class SampledCurves:
    """Natural splines through the points of several columns.

    Args:
        x: abscissae (n,), which increase.
        y: ordinates (n, m).
        half_order: half of the order of the splines, whose degree is 2 `half_order` - 1.
    """

    def __init__(self, x: ArrayLike, y: ArrayLike, half_order: int = 3) -> None:
        points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        scaled_points, self._scale = _scale_to_unit_spacing(points)
        # Points that are nearly equal determine no slope between them within rounding: drop the
        # later ones.
        is_distinct = np.diff(scaled_points, prepend=-1.0) > SAME_POINT_DISTANCE
        self._start, self._scaled_points = points[0], scaled_points[is_distinct]
        self._pieces = _compute_pieces(self._scaled_points, values[is_distinct], half_order)

    def derivatives(self, arguments: ArrayLike, orders: Sequence[int]) -> tuple[Array, ...]:
        """Return derivatives of the splines.

        Args:
            arguments: arguments (k,).
            orders: orders of the derivatives; 0 is the value.

        Returns:
            One array (k, m) per order.
        """
        scaled_arguments = (np.asarray(arguments, dtype=float) - self._start) / self._scale
        scaled_derivatives = (
            (
                order,
                _evaluate_derivative(self._scaled_points, self._pieces, scaled_arguments, order),
            )
            for order in orders
        )
        return tuple(values / self._scale**order for order, values in scaled_derivatives)


def _scale_to_unit_spacing(points: Array) -> tuple[Array, float]:
    """Scale points to a mean spacing of 1, which keeps powers of the widths in bounds.

    Args:
        points: abscissae (n,).

    Returns:
        Scaled points, and the scale.
    """
    scale = float(points[-1] - points[0]) / (len(points) - 1)
    return (points - points[0]) / scale, scale


def _evaluate_derivative(points: Array, pieces: Array, arguments: Array, order: int) -> Array:
    """Return a derivative (j, k) at j arguments of the splines of `_compute_pieces`.

    Args:
        points: abscissae (n,).
        pieces: coefficients (n + 1, 2m, k).
        arguments: arguments (j,).
        order: order of the derivative.
    """
    piece_indices = np.searchsorted(points, arguments, side="right")
    t = (arguments - points[np.maximum(piece_indices - 1, 0)])[:, None]
    coefficients = pieces[piece_indices]
    result = np.zeros_like(coefficients[:, 0])
    # Horner's rule with the factors of the derivative.
    for power in range(pieces.shape[1] - 1, order - 1, -1):
        result = result * t + math.perm(power, order) * coefficients[:, power]
    return result


def _compute_pieces(points: Array, values: Array, half_order: int) -> Array:
    """Return the coefficients of natural splines through points, from the constant up.

    Between two points they belong to powers of the distance from the first. Before the first point
    and after the last, where the degree is m - 1, they belong to powers of the distance from that
    point.

    Args:
        points: abscissae (n,).
        values: ordinates (n, k).
        half_order: m, where the degree is 2m - 1.

    Returns:
        Coefficients (n + 1, 2m, k).
    """
    derivatives = _compute_knot_derivatives(points, values, half_order)
    powers = np.arange(2.0 * half_order)[:, None]
    width = np.diff(points)[:, None, None] ** powers
    # Polynomials over a unit interval from values and derivatives at its ends. The first value is
    # set to 0, which keeps digits of small changes of large values.
    ends = np.concatenate([derivatives[:-1], derivatives[1:]], axis=1)
    ends[:, 0], ends[:, half_order] = 0.0, np.diff(values, axis=0)
    shapes, _ = _make_unit_interval_matrices(half_order)
    pieces = np.zeros((len(points) + 1, 2 * half_order, values.shape[1]))
    pieces[1:-1] = shapes @ (ends * np.tile(width[:, :half_order], (1, 2, 1))) / width
    pieces[1:, :half_order] = (
        derivatives / np.array([math.factorial(order) for order in range(half_order)])[:, None]
    )
    pieces[0, :half_order] = pieces[1, :half_order]
    return pieces


def _compute_knot_derivatives(points: Array, values: Array, half_order: int) -> Array:
    """Return derivatives (n, m, k) of orders 0 to m - 1 at the points of splines through them.

    They minimize the sum of the integrals of the squared m-th derivative: each interval is a beam
    element with m degrees of freedom at either end.

    Args:
        points: abscissae (n,).
        values: ordinates (n, k).
        half_order: m, where the degree is 2m - 1.
    """
    result = np.empty((len(points), half_order, values.shape[1]))
    result[:, 0] = values
    if half_order == 1:
        return result
    width, (_, bending) = np.diff(points), _make_unit_interval_matrices(half_order)
    powers = np.tile(width[:, None] ** np.arange(half_order), 2)
    stiffness = (
        bending
        * powers[:, :, None]
        * powers[:, None, :]
        * width[:, None, None] ** (1 - 2 * half_order)
    )
    # The values at the points are known; only derivatives are unknown.
    left_derivatives = slice(1, half_order)
    right_derivatives = slice(half_order + 1, 2 * half_order)
    diagonal = np.zeros((len(points), half_order - 1, half_order - 1))
    diagonal[:-1] += stiffness[:, left_derivatives, left_derivatives]
    diagonal[1:] += stiffness[:, right_derivatives, right_derivatives]
    rise = np.diff(values, axis=0)[:, None]
    rhs = np.zeros((len(points), half_order - 1, values.shape[1]))
    rhs[:-1] -= stiffness[:, left_derivatives, half_order, None] * rise
    rhs[1:] -= stiffness[:, right_derivatives, half_order, None] * rise
    result[:, 1:] = _solve_block_tridiagonal(
        diagonal, stiffness[:, left_derivatives, right_derivatives], rhs
    )
    return result


@cache
def _make_unit_interval_matrices(half_order: int) -> tuple[Array, Array]:
    """Return matrices of the polynomial of degree 2m - 1 over a unit interval.

    The polynomial is determined by its derivatives up to order m - 1 at 0, and then at 1.

    Returns:
        Coefficients of the polynomial from the constant up (2m, 2m), and half the second
        derivatives of the integral of the squared m-th derivative (2m, 2m). All entries are
        fractions of whole numbers.
    """
    size = 2 * half_order
    denominator = math.factorial(half_order - 1)
    ends = np.zeros((size, size))
    for order in range(half_order):
        ends[order, order] = math.factorial(order)
        ends[half_order + order] = [math.perm(power, order) for power in range(size)]
    # Rounding to fractions removes the error of the inverse.
    shapes = np.rint(np.linalg.inv(ends) * denominator) / denominator
    falling = np.array([float(math.perm(power, half_order)) for power in range(size)])
    sums = np.add.outer(np.arange(size), np.arange(size)) - size + 1
    bending = shapes.T @ (np.outer(falling, falling) / np.maximum(sums, 1)) @ shapes
    return shapes, np.rint(bending)


def _solve_block_tridiagonal(diagonal: Array, off_diagonal: Array, rhs: Array) -> Array:
    """Return the solution (n, p, k) of symmetric block-tridiagonal equations.

    Every other unknown is eliminated at once until one is left: cyclic reduction (R. Hockney, J.
    ACM 12, 1965). It needs log2(n) vectorized steps instead of n.

    Args:
        diagonal: blocks (n, p, p); the matrix is positive definite.
        off_diagonal: blocks (n - 1, p, p) to the right of them.
        rhs: right sides (n, p, k).
    """
    if len(diagonal) == 1:
        return np.asarray(np.linalg.solve(diagonal, rhs), dtype=np.float64)
    size = diagonal.shape[1]
    lower = off_diagonal[::2]
    upper = off_diagonal[1::2]
    count = len(upper)
    wide = np.zeros((len(lower), size, 2 * size + rhs.shape[2]))
    wide[:, :, :size], wide[:count, :, size : 2 * size] = lower.transpose(0, 2, 1), upper
    wide[:, :, 2 * size :] = rhs[1::2]
    from_lower, from_upper, solution = np.split(
        np.linalg.solve(diagonal[1::2], wide), [size, 2 * size], axis=2
    )
    reduced_diagonal, reduced_rhs = diagonal[::2].copy(), rhs[::2].copy()
    reduced_diagonal[: len(lower)] -= lower @ from_lower
    reduced_rhs[: len(lower)] -= lower @ solution
    upper_transposed = upper.transpose(0, 2, 1)
    reduced_diagonal[1 : 1 + count] -= upper_transposed @ from_upper[:count]
    reduced_rhs[1 : 1 + count] -= upper_transposed @ solution[:count]
    result = np.empty_like(rhs)
    result[::2] = half = _solve_block_tridiagonal(
        reduced_diagonal, -lower[:count] @ from_upper[:count], reduced_rhs
    )
    solution -= from_lower @ half[: len(lower)]
    solution[:count] -= from_upper[:count] @ half[1 : 1 + count]
    result[1::2] = solution
    return result


def _smooth_values(points: Array, values: Array, half_order: int, error_variance: float) -> Array:
    """Return the values at the points (n,) of the spline with the best smoothing.

    Args:
        points: abscissae (n,).
        values: ordinates (n,).
        half_order: m, where the degree is 2m - 1.
        error_variance: variance of the ordinates, or a negative number for cross validation.
    """
    n = len(values)
    # The penalty of the values s is sᵀ K s. Gauss quadrature of K is exact here, and its
    # eigenvectors make the evaluation for each smoothing parameter p cheap.
    nodes, weights = np.polynomial.legendre.leggauss(half_order)
    width = np.diff(points) / 2.0
    middle = (points[1:] + points[:-1]) / 2.0
    abscissae = (middle[:, None] + width[:, None] * nodes).ravel()
    basis_derivatives = _evaluate_derivative(
        points, _compute_pieces(points, np.eye(n), half_order), abscissae, half_order
    )
    roughness, vectors = np.linalg.eigh(
        basis_derivatives.T @ ((width[:, None] * weights).ravel()[:, None] * basis_derivatives)
    )
    roughness = np.maximum(roughness, 0.0)
    # Polynomials of degree m - 1 have no roughness; rounding must not give them any.
    roughness[:half_order] = 0.0
    loads = vectors.T @ values

    def criterion(logarithm: float) -> float:
        """Return the objective of the smoothing at its logarithm."""
        residual_factors = 1.0 - 1.0 / (1.0 + math.exp(logarithm) * roughness)
        trace = float(residual_factors.sum()) / n
        error = float(np.sum((residual_factors * loads) ** 2)) / n
        # Generalized cross validation (Woltring 1986), else the mean squared error for a known
        # variance.
        if error_variance < 0.0:
            return error / trace**2
        return error - error_variance * (2.0 * trace - 1.0)

    smoothing = math.exp(_find_minimum(criterion, -math.log(roughness[half_order:].mean())))
    return vectors @ (loads / (1.0 + smoothing * roughness))


def _find_minimum(function: Callable[[float], float], start: float) -> float:
    """Return an argument at which a function has a minimum.

    Steps downhill from `start` bracket it, and golden sections narrow the bracket.

    Args:
        function: function of one number.
        start: start of the search.
    """
    step = math.log(2.0)
    limit = 60.0
    middle = start
    right = start + step
    if function(right) < function(middle):
        while right < start + limit and function(right) < function(middle):
            middle = right
            right += step
        left = middle - step
    else:
        left = middle - step
        while left > start - limit and function(left) <= function(middle):
            middle = left
            left -= step
        right = middle + step
    while right - left > 1e-9:
        first = right - _GOLDEN * (right - left)
        second = left + _GOLDEN * (right - left)
        if function(first) <= function(second):
            right = second
        else:
            left = first
    return 0.5 * (left + right)
