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
from osimlite.mechanics.kernels.functions import PIECES
from osimlite.mechanics.multibody.functions import Univariate
from osimlite.mechanics.multibody.spatial import Array

TOUCHING = 1e-9
"""Points that are closer than this part of their mean distance are one."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial(Univariate):
    """Polynomials in x - knots[k], `pieces` (k, degree + 1) from the constant up; the end pieces go on outside."""

    knots: Array
    pieces: Array

    @property
    def table(self) -> Sequence[float]:
        """The pieces."""
        head = PIECES, 1.0, len(self.knots), self.pieces.shape[1]
        numbers: list[float] = np.concatenate([head, self.knots, self.pieces.ravel()]).tolist()
        return numbers


def smoothing_spline(
    x: ArrayLike, y: ArrayLike, half_order: int, error_variance: float
) -> PiecewisePolynomial:
    """The natural spline of degree 2 `half_order` - 1 for n points (n,) that increase, n >= 2 `half_order`.

    Args:
        x: abscissae (n,).
        y: ordinates (n,).
        half_order: m.
        error_variance: of the ordinates; the smoothing is chosen to leave it in the residuals. Zero
            goes through the points, a negative number chooses the smoothing by generalized cross
            validation.
    """
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if error_variance != 0.0:
        values = _smooth_values(_unit_spacing(points)[0], values, half_order, error_variance)
    (spline,) = natural_splines(points, values[:, None], half_order)
    return spline


def natural_splines(x: ArrayLike, y: ArrayLike, half_order: int) -> list[PiecewisePolynomial]:
    """The natural splines of degree 2 `half_order` - 1 through the points of k columns.

    Args:
        x: abscissae (n,) that increase, n >= 2 `half_order`.
        y: ordinates (n, k).
        half_order: m.
    """
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    places, scale = _unit_spacing(points)
    pieces = (
        _compute_pieces(places, values, half_order) / scale ** np.arange(2.0 * half_order)[:, None]
    )
    # The piece before the first point counts from there too.
    knots = np.append(points[0], points)
    return [
        PiecewisePolynomial(knots, column)
        for column in np.ascontiguousarray(np.moveaxis(pieces, 2, 0))
    ]


def derivatives_of_samples(
    x: ArrayLike, y: ArrayLike, at: ArrayLike, orders: Sequence[int], half_order: int = 3
) -> tuple[Array, ...]:
    """Derivatives of some orders (k, m), at k places, of the natural splines through n points.

    Args:
        x: abscissae (n,), increasing.
        y: ordinates, in m columns (n, m).
        at: places (k,).
        orders: of the derivatives; 0 is the value.
        half_order: the splines are of degree 2 `half_order` - 1.
    """
    return SampledCurves(x, y, half_order).derivatives(at, orders)


class SampledCurves:
    """Natural splines through the points of several columns; as of :func:`derivatives_of_samples`."""

    def __init__(self, x: ArrayLike, y: ArrayLike, half_order: int = 3) -> None:
        points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
        places, self._scale = _unit_spacing(points)
        # What lies closer to the point before than rounding of the values would let a slope be
        # found, says nothing.
        kept = np.diff(places, prepend=-1.0) > TOUCHING
        self._start, self._places = points[0], places[kept]
        self._pieces = _compute_pieces(self._places, values[kept], half_order)

    def derivatives(self, at: ArrayLike, orders: Sequence[int]) -> tuple[Array, ...]:
        """Derivatives of some orders (k, m) at k places."""
        own = (np.asarray(at, dtype=float) - self._start) / self._scale
        found = (
            (order, _evaluate_derivative(self._places, self._pieces, own, order))
            for order in orders
        )
        return tuple(values / self._scale**order for order, values in found)


def _unit_spacing(points: Array) -> tuple[Array, float]:
    """The points with a spacing of 1 on average, which keeps the powers of the derivatives in bounds; their scale."""
    scale = float(points[-1] - points[0]) / (len(points) - 1)
    return (points - points[0]) / scale, scale


def _evaluate_derivative(points: Array, pieces: Array, at: Array, order: int) -> Array:
    """A derivative (j, k) at j places of the splines of `_compute_pieces`."""
    place = np.searchsorted(points, at, side="right")
    t, own = (at - points[np.maximum(place - 1, 0)])[:, None], pieces[place]
    result = np.zeros_like(own[:, 0])
    for power in range(pieces.shape[1] - 1, order - 1, -1):
        result = result * t + math.perm(power, order) * own[:, power]
    return result


def _compute_pieces(points: Array, values: Array, half_order: int) -> Array:
    """Coefficients (n + 1, 2 m, k) of natural splines through n points with values (n, k), from the constant up.

    Between two points they go with the distance from the first; before the first point and after
    the last, where the degree is m - 1, with that from there.
    """
    derivatives = _compute_knot_derivatives(points, values, half_order)
    powers = np.arange(2.0 * half_order)[:, None]
    width = np.diff(points)[:, None, None] ** powers
    # What the polynomials are over a unit interval by their values and derivatives at its ends; the
    # first value is 0.
    ends = np.concatenate([derivatives[:-1], derivatives[1:]], axis=1)
    ends[:, 0], ends[:, half_order] = 0.0, np.diff(values, axis=0)
    shapes, _ = _unit_interval(half_order)
    pieces = np.zeros((len(points) + 1, 2 * half_order, values.shape[1]))
    pieces[1:-1] = shapes @ (ends * np.tile(width[:, :half_order], (1, 2, 1))) / width
    pieces[1:, :half_order] = (
        derivatives / np.array([math.factorial(order) for order in range(half_order)])[:, None]
    )
    pieces[0, :half_order] = pieces[1, :half_order]
    return pieces


def _compute_knot_derivatives(points: Array, values: Array, half_order: int) -> Array:
    """Derivatives (n, m, k) of orders 0 .. m - 1 at the points of splines through them.

    They make the sum of the integrals of the squared m-th derivative a minimum: each interval is a
    beam with as many freedoms at both ends.
    """
    result = np.empty((len(points), half_order, values.shape[1]))
    result[:, 0] = values
    if half_order == 1:
        return result
    width, (_, bending) = np.diff(points), _unit_interval(half_order)
    powers = np.tile(width[:, None] ** np.arange(half_order), 2)
    stiffness = (
        bending
        * powers[:, :, None]
        * powers[:, None, :]
        * width[:, None, None] ** (1 - 2 * half_order)
    )
    one, two = slice(1, half_order), slice(half_order + 1, 2 * half_order)
    diagonal = np.zeros((len(points), half_order - 1, half_order - 1))
    diagonal[:-1] += stiffness[:, one, one]
    diagonal[1:] += stiffness[:, two, two]
    rise, right = (
        np.diff(values, axis=0)[:, None],
        np.zeros((len(points), half_order - 1, values.shape[1])),
    )
    right[:-1] -= stiffness[:, one, half_order, None] * rise
    right[1:] -= stiffness[:, two, half_order, None] * rise
    result[:, 1:] = _solve_block_tridiagonal(diagonal, stiffness[:, one, two], right)
    return result


@cache
def _unit_interval(half_order: int) -> tuple[Array, Array]:
    """Of the polynomial of degree 2 m - 1 by its derivatives up to m - 1 at 0 and, behind these, at 1.

    Returns:
        Its coefficients from the constant up (2 m, 2 m), and half the second derivatives of the
        integral of its squared m-th derivative (2 m, 2 m); all are fractions of whole numbers.
    """
    size, parts = 2 * half_order, math.factorial(half_order - 1)
    ends = np.zeros((size, size))
    for order in range(half_order):
        ends[order, order] = math.factorial(order)
        ends[half_order + order] = [math.perm(power, order) for power in range(size)]
    shapes = np.rint(np.linalg.inv(ends) * parts) / parts
    falling = np.array([float(math.perm(power, half_order)) for power in range(size)])
    sums = np.add.outer(np.arange(size), np.arange(size)) - size + 1
    bending = shapes.T @ (np.outer(falling, falling) / np.maximum(sums, 1)) @ shapes
    return shapes, np.rint(bending)


def _solve_block_tridiagonal(diagonal: Array, beside: Array, right: Array) -> Array:
    """The solution (n, p, k) of symmetric equations in which each of n unknowns (p, k) meets its neighbours only.

    Every other unknown is eliminated, all at once, until one is left: cyclic reduction (R. Hockney,
    J. ACM 12, 1965).

    Args:
        diagonal: blocks (n, p, p), positive definite all together.
        beside: blocks (n - 1, p, p) behind them.
        right: right sides (n, p, k).
    """
    if len(diagonal) == 1:
        return np.asarray(np.linalg.solve(diagonal, right), dtype=np.float64)
    size, before, behind = diagonal.shape[1], beside[::2], beside[1::2]
    count = len(behind)
    wide = np.zeros((len(before), size, 2 * size + right.shape[2]))
    wide[:, :, :size], wide[:count, :, size : 2 * size] = before.transpose(0, 2, 1), behind
    wide[:, :, 2 * size :] = right[1::2]
    from_before, from_behind, own = np.split(
        np.linalg.solve(diagonal[1::2], wide), [size, 2 * size], axis=2
    )
    kept, sides = diagonal[::2].copy(), right[::2].copy()
    kept[: len(before)] -= before @ from_before
    sides[: len(before)] -= before @ own
    back = behind.transpose(0, 2, 1)
    kept[1 : 1 + count] -= back @ from_behind[:count]
    sides[1 : 1 + count] -= back @ own[:count]
    result = np.empty_like(right)
    result[::2] = half = _solve_block_tridiagonal(
        kept, -before[:count] @ from_behind[:count], sides
    )
    own -= from_before @ half[: len(before)]
    own[:count] -= from_behind[:count] @ half[1 : 1 + count]
    result[1::2] = own
    return result


def _smooth_values(points: Array, values: Array, half_order: int, error_variance: float) -> Array:
    """Values at the points (n,) of the spline whose smoothing the criterion prefers."""
    n = len(values)
    # The penalty of the values s is sᵀ K s, by Gauss's rule, which is exact here; K's eigenvectors
    # make every choice of p cheap.
    nodes, weights = np.polynomial.legendre.leggauss(half_order)
    width, middle = np.diff(points) / 2.0, (points[1:] + points[:-1]) / 2.0
    places = (middle[:, None] + width[:, None] * nodes).ravel()
    bends = _evaluate_derivative(
        points, _compute_pieces(points, np.eye(n), half_order), places, half_order
    )
    roughness, vectors = np.linalg.eigh(
        bends.T @ ((width[:, None] * weights).ravel()[:, None] * bends)
    )
    roughness = np.maximum(roughness, 0.0)
    roughness[:half_order] = 0.0
    loads = vectors.T @ values

    def criterion(logarithm: float) -> float:
        left = 1.0 - 1.0 / (1.0 + math.exp(logarithm) * roughness)
        trace, error = float(left.sum()) / n, float(np.sum((left * loads) ** 2)) / n
        if error_variance < 0.0:
            return error / trace**2
        return error - error_variance * (2.0 * trace - 1.0)

    smoothing = math.exp(_find_minimum(criterion, -math.log(roughness[half_order:].mean())))
    return vectors @ (loads / (1.0 + smoothing * roughness))


def _find_minimum(function: Callable[[float], float], start: float) -> float:
    """Where a function of one number has a minimum: steps downhill from `start`, then golden sections."""
    step, limit = math.log(2.0), 60.0
    middle, right = start, start + step
    if function(right) < function(middle):
        while right < start + limit and function(right) < function(middle):
            middle, right = right, right + step
        left = middle - step
    else:
        left = middle - step
        while left > start - limit and function(left) <= function(middle):
            middle, left = left, left - step
        right = middle + step
    while right - left > 1e-9:
        first, second = right - _GOLDEN * (right - left), left + _GOLDEN * (right - left)
        if function(first) <= function(second):
            right = second
        else:
            left = first
    return 0.5 * (left + right)
