"""Natural splines of odd degree through or near points: OpenSim's GCVSpline.

The spline of degree 2m - 1 minimises the sum of squared residuals plus p times the integral of its squared m-th
derivative (Woltring, "A Fortran package for generalized, cross-validatory spline smoothing and differentiation",
Advances in Engineering Software 8, 1986). Outside the points it is the polynomial of degree m - 1 that joins
smoothly.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from osimlite.multibody.functions import Univariate
from osimlite.multibody.spatial import Array

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
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    # Unit spacing on average keeps the powers of the derivatives in bounds.
    scale = (points[-1] - points[0]) / (len(points) - 1)
    basis = _NaturalBasis((points - points[0]) / scale, half_order)
    if error_variance == 0.0:
        coefficients = np.linalg.solve(basis.derivatives(basis.points, 0), values)
    else:
        coefficients = _smoothed(basis, values, error_variance)
    return basis.spline(coefficients, points, scale)


def rates_of_samples(x: ArrayLike, y: ArrayLike, half_order: int = 3) -> tuple[Array, Array]:
    """First and second derivatives, at n points (n,) that increase, of the natural splines through k columns (n, k).

    The points are taken in blocks, each with enough neighbours that those further away do not show.
    """
    points, values = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    count, block, margin = len(points), 192, 64
    first, second = np.empty_like(values), np.empty_like(values)
    for start in range(0, count, block):
        own = slice(start, min(start + block, count))
        window = slice(max(0, start - margin), min(own.stop + margin, count))
        near = points[window]
        scale = (near[-1] - near[0]) / (len(near) - 1)
        basis = _NaturalBasis((near - near[0]) / scale, half_order)
        coefficients = np.linalg.solve(basis.derivatives(basis.points, 0), values[window])
        inside = slice(own.start - window.start, own.stop - window.start)
        first[own] = basis.derivatives(basis.points[inside], 1) @ coefficients / scale
        second[own] = basis.derivatives(basis.points[inside], 2) @ coefficients / scale**2
    return first, second


def _smoothed(basis: _NaturalBasis, values: Array, error_variance: float) -> Array:
    """Coefficients of the spline whose smoothing the criterion prefers."""
    matrix, penalty, n = basis.derivatives(basis.points, 0), basis.penalty(), len(values)
    # With s the values at the points, the penalty is sᵀ K s; its eigenvectors make every choice of p cheap.
    inverse = np.linalg.inv(matrix)
    roughness, vectors = np.linalg.eigh(inverse.T @ penalty @ inverse)
    roughness = np.maximum(roughness, 0.0)
    roughness[: basis.half_order] = 0.0
    loads = vectors.T @ values

    def criterion(logarithm: float) -> float:
        left = 1.0 - 1.0 / (1.0 + math.exp(logarithm) * roughness)
        trace, error = float(left.sum()) / n, float(np.sum((left * loads) ** 2)) / n
        if error_variance < 0.0:
            return error / trace**2
        return error - error_variance * (2.0 * trace - 1.0)

    smoothing = math.exp(_minimum(criterion, -math.log(roughness[basis.half_order :].mean())))
    smooth: Array = inverse @ (vectors @ (loads / (1.0 + smoothing * roughness)))
    return smooth


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


class _NaturalBasis:
    """The n natural splines of degree 2m - 1 on n points, as combinations of B-splines."""

    def __init__(self, points: Array, half_order: int) -> None:
        self.points, self.half_order, self.degree = points, half_order, 2 * half_order - 1
        self.knots = np.concatenate([[points[0]] * self.degree, points, [points[-1]] * self.degree])
        count, ends = len(points), points[[0, -1]]
        full = count + self.degree - 1
        combination = np.eye(full)
        if half_order > 1:
            # At both ends the derivatives m .. 2m - 2 vanish: that fixes m - 1 of the coefficients there.
            near = half_order - 1
            for place, inner, outer in (
                (0, slice(near, self.degree), slice(0, near)),
                (1, slice(full - self.degree, full - near), slice(full - near, full)),
            ):
                rows = np.concatenate(
                    [self._b_splines(ends[[place]], order) for order in range(half_order, self.degree)]
                )
                combination[outer, inner] = -np.linalg.solve(rows[:, outer], rows[:, inner])
            combination = combination[:, near : full - near]
        self.combination = combination

    def derivatives(self, x: Array, order: int) -> Array:
        """The derivatives of one order of all n splines at k points (k, n)."""
        result: Array = self._b_splines(x, order) @ self.combination
        return result

    def penalty(self) -> Array:
        """The integrals of products of m-th derivatives (n, n), by Gauss's rule, which is exact here."""
        nodes, weights = np.polynomial.legendre.leggauss(self.half_order)
        width, middle = np.diff(self.points) / 2.0, (self.points[1:] + self.points[:-1]) / 2.0
        at = (middle[:, None] + width[:, None] * nodes).ravel()
        rows = self.derivatives(at, self.half_order)
        result: Array = rows.T @ ((width[:, None] * weights).ravel()[:, None] * rows)
        return result

    def spline(self, coefficients: Array, points: Array, scale: float) -> PiecewisePolynomial:
        """The combination of the n splines as polynomials between (and beyond) the original points."""
        orders = range(self.degree + 1)
        pieces = np.array(
            [
                self.derivatives(self.points, order) @ coefficients / (math.factorial(order) * scale**order)
                for order in orders
            ]
        ).T
        before = pieces[:1].copy()
        for piece in (before, pieces[-1:]):
            piece[:, self.half_order :] = 0.0
        # The piece before the first point counts from there too.
        return PiecewisePolynomial(np.append(points[0], points), np.concatenate([before, pieces]))

    def _b_splines(self, x: Array, order: int) -> Array:
        """Derivatives of all n + 2m - 2 B-splines at k points, seen from the right (k, n + 2m - 2)."""
        knots, last = self.knots, len(self.points) - 2
        intervals = np.clip(np.searchsorted(self.points, x, side="right") - 1, 0, last) + self.degree
        table = np.zeros((len(x), len(knots) - 1))
        table[np.arange(len(x)), intervals] = 1.0
        for degree in range(1, self.degree + 1):
            spans = knots[degree:] - knots[:-degree]
            inverse = np.divide(1.0, spans, out=np.zeros_like(spans), where=spans > 0.0)
            lower, upper = table[:, :-1] * inverse[:-1], table[:, 1:] * inverse[1:]
            if degree > self.degree - order:
                table = degree * (lower - upper)
            else:
                table = (x[:, None] - knots[: -degree - 1]) * lower + (knots[degree + 1 :] - x[:, None]) * upper
        return table
