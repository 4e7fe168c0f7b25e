"""Natural splines of odd degree through or near points: OpenSim's GCVSpline.

The spline of degree 2m - 1 minimises the sum of squared residuals plus p times the integral of its squared m-th
derivative (Woltring, "A Fortran package for generalized, cross-validatory spline smoothing and differentiation",
Advances in Engineering Software 8, 1986). Outside the points it is the polynomial of degree m - 1 that joins
smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from osimlite._require import require
from osimlite.multibody.functions import Univariate
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass

TOUCHING = 1e-9
"""Points that are closer than this part of their mean distance are one."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class PiecewisePolynomial(Univariate):
    """Polynomials in x - knots[k], `pieces` (k, degree + 1) from the constant up; the end pieces go on outside."""

    knots: Array
    pieces: Array

    def _at(self, x: float) -> tuple[float, float, float]:
        k = max(0, int(np.searchsorted(self.knots, x, side="right")) - 1)
        t = x - float(self.knots[k])
        value = first = half_second = 0.0
        for coefficient in self.pieces[k, ::-1].tolist():
            half_second = half_second * t + first
            first = first * t + value
            value = value * t + coefficient
        return value, first, 2.0 * half_second


def smoothing_spline(x: ArrayLike, y: ArrayLike, half_order: int, error_variance: float) -> PiecewisePolynomial:
    """The natural spline of degree 2 `half_order` - 1 for n points (n,) that increase, n >= 2 `half_order`.

    Args:
        x: abscissae (n,).
        y: ordinates (n,).
        half_order: m.
        error_variance: of the ordinates; the smoothing is chosen to leave it in the residuals. Zero goes through the
            points, a negative number chooses the smoothing by generalized cross validation.
    """
    points, values, degree = np.asarray(x, dtype=float), np.asarray(y, dtype=float), 2 * half_order - 1
    places, scale = _unit_spacing(points)
    if error_variance != 0.0:
        values = _smoothed(places, values, half_order, error_variance)
    spline = _through(places, values, half_order)
    pieces = np.stack([spline(places, k) / (math.factorial(k) * scale**k) for k in range(degree + 1)], axis=1)
    before = pieces[:1].copy()
    for piece in (before, pieces[-1:]):
        piece[:, half_order:] = 0.0
    # The piece before the first point counts from there too.
    return PiecewisePolynomial(np.append(points[0], points), np.concatenate([before, pieces]))


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
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    places, scale = _unit_spacing(points)
    # What lies closer to the point before than rounding of the values would let a slope be found, says nothing.
    kept = np.diff(places, prepend=-1.0) > TOUCHING
    spline = _through(places[kept], values[kept], half_order)
    own = (np.asarray(at, dtype=float) - points[0]) / scale
    return tuple(spline(own, order) / scale**order for order in orders)


def _unit_spacing(points: Array) -> tuple[Array, float]:
    """The points with a spacing of 1 on average, which keeps the powers of the derivatives in bounds; their scale."""
    scale = float(points[-1] - points[0]) / (len(points) - 1)
    return (points - points[0]) / scale, scale


def _through(points: Array, values: Array, half_order: int) -> Any:
    """SciPy's spline through n points with values (n,) or (n, k): at both ends the derivatives m .. 2m - 2 vanish."""
    interpolate = require("scipy.interpolate", extra="sim", purpose="a spline")
    degree, orders = 2 * half_order - 1, range(half_order, 2 * half_order - 1)
    spline, missing = None, values
    # The second time mends the rounding of the first, which uneven points make large: SciPy does not scale equations.
    for _ in range(2):
        ends = [
            [(order, np.zeros(values.shape[1:]) if spline is None else -spline(end, order)) for order in orders]
            for end in points[[0, -1]]
        ]
        found = interpolate.make_interp_spline(
            points, missing, degree, bc_type=ends if orders else None, check_finite=False
        )
        spline = found if spline is None else interpolate.BSpline(found.t, spline.c + found.c, degree)
        missing = values - spline(points)
    return spline


def _smoothed(points: Array, values: Array, half_order: int, error_variance: float) -> Array:
    """Values at the points (n,) of the spline whose smoothing the criterion prefers."""
    n = len(values)
    # The penalty of the values s is sᵀ K s, by Gauss's rule, which is exact here; K's eigenvectors make every choice of
    # p cheap.
    nodes, weights = np.polynomial.legendre.leggauss(half_order)
    width, middle = np.diff(points) / 2.0, (points[1:] + points[:-1]) / 2.0
    bends = _through(points, np.eye(n), half_order)((middle[:, None] + width[:, None] * nodes).ravel(), half_order)
    roughness, vectors = np.linalg.eigh(bends.T @ ((width[:, None] * weights).ravel()[:, None] * bends))
    roughness = np.maximum(roughness, 0.0)
    roughness[:half_order] = 0.0
    loads = vectors.T @ values

    def criterion(logarithm: float) -> float:
        left = 1.0 - 1.0 / (1.0 + math.exp(logarithm) * roughness)
        trace, error = float(left.sum()) / n, float(np.sum((left * loads) ** 2)) / n
        if error_variance < 0.0:
            return error / trace**2
        return error - error_variance * (2.0 * trace - 1.0)

    smoothing = math.exp(_minimum(criterion, -math.log(roughness[half_order:].mean())))
    return vectors @ (loads / (1.0 + smoothing * roughness))


def _minimum(function: Callable[[float], float], start: float) -> float:
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
