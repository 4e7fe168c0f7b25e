"""Functions of coordinates with first and second derivatives, as joints and constraints need them.

The formulas are those of OpenSim's functions of the same names.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from osimlite.errors import ModelError
from osimlite.multibody.spatial import Array
from osimlite.records import dataclass


class Function(ABC):
    """A twice differentiable function of one or several numbers."""

    @abstractmethod
    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """Return the value, the gradient (k,) and the Hessian (k, k) at `arguments` (k,)."""

    @property
    def slope(self) -> float | None:
        """The constant slope of a linear function of one argument, None for every other function."""
        return None


class Univariate(Function):
    """A function of one number."""

    @abstractmethod
    def _at(self, x: float) -> tuple[float, float, float]:
        """Return the value and the first two derivatives at `x`."""

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """Value, first and second derivative at the one argument."""
        value, first, second = self.derivatives(float(arguments[0]))
        return value, np.array((first,)), np.array(((second,),))

    def derivatives(self, x: float) -> tuple[float, float, float]:
        """Value, first and second derivative at `x`, all three as plain numbers; NaN where `x` is not finite."""
        return self._at(x) if math.isfinite(x) else (math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Constant(Function):
    """The same value for any number of arguments."""

    value: float

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """The value, and zeros for the derivatives."""
        size = len(arguments)
        return self.value, np.zeros(size), np.zeros((size, size))


@dataclass(frozen=True)
class Linear(Univariate):
    """``rate * x + start``."""

    rate: float = 1.0
    start: float = 0.0

    def _at(self, x: float) -> tuple[float, float, float]:
        return self.rate * x + self.start, self.rate, 0.0

    @property
    def slope(self) -> float | None:
        """The rate."""
        return self.rate


IDENTITY = Linear()


@dataclass(frozen=True)
class Polynomial(Univariate):
    """Polynomial with `coefficients` from the highest power to the constant."""

    coefficients: tuple[float, ...]

    def _at(self, x: float) -> tuple[float, float, float]:
        value = first = half_second = 0.0
        for coefficient in self.coefficients:
            half_second = half_second * x + first
            first = first * x + value
            value = value * x + coefficient
        return value, first, 2.0 * half_second


@dataclass(frozen=True)
class Sine(Univariate):
    """``amplitude * sin(omega * x + phase) + offset``."""

    amplitude: float
    omega: float
    phase: float
    offset: float

    def _at(self, x: float) -> tuple[float, float, float]:
        angle = self.omega * x + self.phase
        if not math.isfinite(angle):
            return math.nan, math.nan, math.nan
        wave = self.amplitude * math.sin(angle)
        return wave + self.offset, self.amplitude * self.omega * math.cos(angle), -self.omega * self.omega * wave


@dataclass(frozen=True)
class WeightedSum(Function):
    """The sum of all arguments times their `weights`, plus `start`."""

    weights: tuple[float, ...]
    start: float = 0.0

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """The sum, the weights, and zeros."""
        weights, size = np.array(self.weights), len(arguments)
        return float(weights @ arguments) + self.start, weights, np.zeros((size, size))


@dataclass(frozen=True)
class Step(Univariate):
    """A change from `start_value` to `end_value` between two arguments, smooth to the second derivative."""

    start: float
    end: float
    start_value: float
    end_value: float

    def _at(self, x: float) -> tuple[float, float, float]:
        rate = 1.0 / (self.end - self.start)
        t, rise = (x - self.start) * rate, self.end_value - self.start_value
        if t <= 0.0 or t >= 1.0:
            return (self.start_value if t <= 0.0 else self.end_value), 0.0, 0.0
        first = 30.0 * t * t * (1.0 - t) ** 2
        second = 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t)
        value = self.start_value + rise * t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
        return value, rise * first * rate, rise * second * rate * rate


@dataclass(frozen=True)
class MultivariatePolynomial(Function):
    """The sum of `coefficients` times monomials of all arguments."""

    coefficients: tuple[float, ...]  # one for each monomial
    powers: tuple[tuple[int, ...], ...]  # of each argument in each monomial
    # give for the Hessian what OpenSim 4.6 takes for it, which is the gradient in every column
    opensim_derivatives: bool = False

    @classmethod
    def complete(
        cls, coefficients: Sequence[float], dimension: int, order: int, *, opensim_derivatives: bool = False
    ) -> MultivariatePolynomial:
        """With all monomials up to `order`, sorted by the power of the first argument, then of the next.

        Raises:
            ModelError: there are not as many coefficients as monomials.
        """
        powers = tuple(item for item in product(range(order + 1), repeat=dimension) if sum(item) <= order)
        if len(powers) != len(coefficients):
            raise ModelError(
                f"a polynomial of {dimension} variables up to order {order} has {len(powers)} coefficients; "
                f"got {len(coefficients)}"
            )
        return cls(tuple(coefficients), powers, opensim_derivatives)

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """Value, gradient (k,) and Hessian (k, k)."""
        size = len(arguments)
        powers = np.array(self.powers, dtype=int).reshape(-1, size)
        value, gradient = self._derivative(arguments, powers, ()), np.zeros(size)
        hessian = np.zeros((size, size))
        for i in range(size):
            gradient[i] = self._derivative(arguments, powers, (i,))
            for j in range(size):
                hessian[i, j] = gradient[i] if self.opensim_derivatives else self._derivative(arguments, powers, (i, j))
        return value, gradient, hessian

    def _derivative(self, arguments: Array, powers: NDArray[np.int_], by: tuple[int, ...]) -> float:
        factors, left = np.array(self.coefficients), powers.copy()
        for place in by:
            factors = factors * left[:, place]
            left[:, place] = np.maximum(left[:, place] - 1, 0)
        return float(factors @ np.prod(arguments**left, axis=1))


@dataclass(frozen=True)
class Scaled(Function):
    """``scale`` times another function."""

    scale: float
    function: Function

    def evaluate(self, arguments: Array) -> tuple[float, Array, Array]:
        """`scale` times value, gradient and Hessian of the function."""
        value, gradient, hessian = self.function.evaluate(arguments)
        return self.scale * value, self.scale * gradient, self.scale * hessian


@dataclass(frozen=True)
class PiecewiseLinear(Univariate):
    """Straight lines between the points (`x`, `y`); the first and the last line go on outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    def _at(self, x: float) -> tuple[float, float, float]:
        k = _interval(self.x, x)
        slope = (self.y[k + 1] - self.y[k]) / (self.x[k + 1] - self.x[k])
        return self.y[k] + slope * (x - self.x[k]), slope, 0.0


@dataclass(frozen=True)
class PiecewiseConstant(Univariate):
    """Steps: ``y[k]`` from ``x[k]`` up to the next abscissa, the end values outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    def _at(self, x: float) -> tuple[float, float, float]:
        return self.y[-1 if x >= self.x[-1] else _interval(self.x, x)], 0.0, 0.0


class SimmSpline(Univariate):
    """Cubic spline through (`x`, `y`) with straight lines, of the end slopes, outside.

    The ends have the third derivative of the cubic through the first (last) four points (Forsythe, Malcolm
    and Moler, Computer Methods for Mathematical Computations, 1977, chapter 4); three points give a parabola,
    two a line. Intervals narrower than 1e-7 count as 1e-7 wide, as in OpenSim.
    """

    def __init__(self, x: ArrayLike, y: ArrayLike) -> None:
        self.x: tuple[float, ...] = tuple(np.asarray(x, dtype=float).tolist())
        self.y: tuple[float, ...] = tuple(np.asarray(y, dtype=float).tolist())
        points = np.array(self.x)
        widths = np.maximum(np.diff(points), 1e-7)
        slopes = np.diff(self.y) / widths
        # sigma: a sixth of the second derivative at every point.
        sigma = _spline_curvature(points, widths, slopes)
        left = slopes - widths * (sigma[1:] + 2.0 * sigma[:-1])
        last = slopes[-1] + widths[-1] * (sigma[-2] + 2.0 * sigma[-1])
        cubic = np.append(np.diff(sigma) / widths, 0.0)
        self._pieces = list(
            zip(self.y, np.append(left, last).tolist(), (3.0 * sigma).tolist(), cubic.tolist(), strict=True)
        )

    @property
    def pieces(self) -> tuple[tuple[float, float, float, float], ...]:
        """For every point k the factors of 1, t, t² and t³ from it on, t = argument - x[k].

        Of the last point the first two count; they are the line beyond it. The line before the first point has the
        first two of that.
        """
        return tuple(self._pieces)

    def _at(self, x: float) -> tuple[float, float, float]:
        last = len(self.x) - 1
        if x < self.x[0] or x > self.x[last]:
            k = 0 if x < self.x[0] else last
            y, slope, _, _ = self._pieces[k]
            return y + slope * (x - self.x[k]), slope, 0.0
        k = _interval(self.x, x)
        y, b, c, d = self._pieces[k]
        t = x - self.x[k]
        return y + t * (b + t * (c + t * d)), b + t * (2.0 * c + 3.0 * t * d), 2.0 * c + 6.0 * t * d


def _interval(knots: Sequence[float], x: float) -> int:
    """The index of the knot before `x`, of the first or last but one for `x` outside.

    At a knot both neighbours would do. OpenSim takes the one that this search by halves meets first, which shows
    where slopes or values jump.
    """
    if x <= knots[0]:
        return 0
    if x >= knots[-1]:
        return len(knots) - 2
    low, high = 0, len(knots)
    while high - low > 1:
        middle = (low + high) // 2
        if x < knots[middle]:
            high = middle
        elif x > knots[middle + 1]:
            low = middle
        else:
            return middle
    return low


def _spline_curvature(points: Array, widths: Array, slopes: Array) -> Array:
    """A sixth of the second derivative at each of n points (n,): smooth inside, end conditions as above."""
    n = len(points)
    if n == 2:
        return np.zeros(2)
    matrix = np.zeros((n, n))
    right = np.zeros(n)
    for k in range(1, n - 1):
        matrix[k, k - 1 : k + 2] = widths[k - 1], 2.0 * (widths[k - 1] + widths[k]), widths[k]
        right[k] = slopes[k] - slopes[k - 1]
    matrix[0, :2] = -widths[0], widths[0]
    matrix[-1, -2:] = widths[-1], -widths[-1]
    if n > 3:
        second = np.diff(slopes) / (points[2:] - points[:-2])
        right[0] = widths[0] ** 2 * (second[1] - second[0]) / (points[3] - points[0])
        right[-1] = -(widths[-1] ** 2) * (second[-1] - second[-2]) / (points[-1] - points[-4])
    return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
