"""Functions of coordinates with first and second derivatives, as joints and constraints need them.

They are OpenSim's functions of the same names, and the kernels evaluate them.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from array import array
from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import chain, combinations, pairwise, product
from typing import TYPE_CHECKING, Any

from osimlite.base.records import dataclass
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.functions import (
    MONOMIALS,
    MONOMIALS_OF_OPENSIM,
    PIECES,
    SINE,
    STEP,
    evaluate_function,
    evaluate_monomials,
)

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.spatial import Array

    Arguments = Sequence[float] | Array
else:
    # The linter evaluates without arrays.
    Arguments = Sequence
Evaluated = tuple[float, list[float], list[list[float]]]
"""Value, gradient (k,) and Hessian (k, k) of a function of k numbers."""


class Function(ABC):
    """A twice differentiable function of one or several numbers."""

    @abstractmethod
    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Return the value, the gradient (k,) and the Hessian (k, k) at `arguments` (k,)."""

    @property
    def table(self) -> Sequence[float]:
        """The numbers by which the kernels know it, see :mod:`osimlite.mechanics.kernels.functions`; empty if they do not."""
        return ()

    @property
    def slope(self) -> float | None:
        """The constant slope of a linear function of one argument, None for every other function."""
        return None


class Univariate(Function):
    """A function of one number."""

    @property
    @abstractmethod
    def table(self) -> Sequence[float]:
        """The numbers by which the kernels know it."""

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Value, first and second derivative at the one argument."""
        value, first, second = self.derivatives(float(arguments[0]))
        return value, [first], [[second]]

    def derivatives(self, x: float) -> tuple[float, float, float]:
        """Value, first and second derivative at `x`, all three as plain numbers; NaN where `x` is not finite."""
        numbers: Any = memoryview(self._numbers)
        try:
            return evaluate_function(numbers, x) if math.isfinite(x) else _NOTHING
        except ValueError:
            # The sine of what is too large for a float.
            return _NOTHING

    @cached_property
    def _numbers(self) -> array[float]:
        return array("d", table_at_knots(self))


class Multivariate(Function):
    """A sum of products of powers of several numbers."""

    @property
    @abstractmethod
    def table(self) -> Sequence[float]:
        """The numbers by which the kernels know it."""

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Value, gradient (k,) and Hessian (k, k)."""
        size = len(arguments)
        places: Any = range(size)
        given, table, gradient = (
            make_floats(arguments),
            make_floats([*arguments, *self.table]),
            make_floats([0.0] * size),
        )

        def at_rates(*moving: int) -> tuple[float, float]:
            """Value, and second derivative while some arguments change by 1."""
            rates = make_floats([float(k in moving) for k in places])
            value, _, curvature = evaluate_monomials(size, places, table, given, rates, gradient)
            return value, curvature

        value, hessian = at_rates()[0], make_zero_derivatives(size)[2]
        for k in places:
            hessian[k][k] = at_rates(k)[1]
        for one, two in combinations(places, 2):
            both = at_rates(one, two)[1] - hessian[one][one] - hessian[two][two]
            hessian[one][two] = hessian[two][one] = 0.5 * both
        return value, list(gradient), hessian


def make_floats(numbers: Arguments | bytes) -> Any:
    """Numbers in a row, for kernels that run as Python: they are read one by one sooner than those of an array."""
    return memoryview(array("d", numbers))


def make_zero_derivatives(size: int, value: float = 0.0) -> Evaluated:
    """What a function of `size` numbers evaluates to that does not change with them."""
    return value, [0.0] * size, [[0.0] * size for _ in range(size)]


_NOTHING = math.nan, math.nan, math.nan


@dataclass(frozen=True)
class Constant(Function):
    """The same value for any number of arguments."""

    value: float

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """The value, and zeros for the derivatives."""
        return make_zero_derivatives(len(arguments), self.value)

    @property
    def table(self) -> Sequence[float]:
        """One piece."""
        return _tabulate_pieces((0.0,), ((self.value,),))


@dataclass(frozen=True)
class Linear(Univariate):
    """``rate * x + start``."""

    rate: float = 1.0
    start: float = 0.0

    @property
    def table(self) -> Sequence[float]:
        """One piece."""
        return _tabulate_pieces((0.0,), ((self.start, self.rate),))

    @property
    def slope(self) -> float | None:
        """The rate."""
        return self.rate


IDENTITY = Linear()


@dataclass(frozen=True)
class Polynomial(Univariate):
    """Polynomial with `coefficients` from the highest power to the constant."""

    coefficients: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """One piece."""
        return _tabulate_pieces((0.0,), (self.coefficients[::-1],))


@dataclass(frozen=True)
class Sine(Univariate):
    """``amplitude * sin(omega * x + phase) + offset``."""

    amplitude: float
    omega: float
    phase: float
    offset: float

    @property
    def table(self) -> Sequence[float]:
        """A sine."""
        return SINE, 1.0, self.amplitude, self.omega, self.phase, self.offset


@dataclass(frozen=True)
class WeightedSum(Multivariate):
    """The sum of all arguments times their `weights`, plus `start`."""

    weights: tuple[float, ...]
    start: float = 0.0

    @property
    def table(self) -> Sequence[float]:
        """Each argument in a monomial, and none in the last."""
        size = len(self.weights)
        powers = (float(term == place) for term in range(size + 1) for place in range(size))
        return [MONOMIALS, 1.0, size + 1.0, *self.weights, self.start, *powers]


@dataclass(frozen=True)
class Step(Univariate):
    """A change from `start_value` to `end_value` between two arguments, smooth to the second derivative."""

    start: float
    end: float
    start_value: float
    end_value: float

    @property
    def table(self) -> Sequence[float]:
        """A step."""
        return STEP, 1.0, self.start, self.end, self.start_value, self.end_value


@dataclass(frozen=True)
class MultivariatePolynomial(Multivariate):
    """The sum of `coefficients` times monomials of all arguments."""

    coefficients: tuple[float, ...]  # one for each monomial
    powers: tuple[tuple[int, ...], ...]  # of each argument in each monomial
    # give for the Hessian what OpenSim 4.6 takes for it, which is the gradient in every column
    opensim_derivatives: bool = False

    @classmethod
    def complete(
        cls,
        coefficients: Sequence[float],
        dimension: int,
        order: int,
        *,
        opensim_derivatives: bool = False,
    ) -> MultivariatePolynomial:
        """With all monomials up to `order`, sorted by the power of the first argument, then of the next.

        Raises:
            ModelError: there are not as many coefficients as monomials.
        """
        powers = tuple(
            item for item in product(range(order + 1), repeat=dimension) if sum(item) <= order
        )
        if len(powers) != len(coefficients):
            raise ModelError(
                f"a polynomial of {dimension} variables up to order {order} has {len(powers)} coefficients; "
                f"got {len(coefficients)}"
            )
        return cls(tuple(coefficients), powers, opensim_derivatives)

    @property
    def table(self) -> Sequence[float]:
        """All monomials."""
        kind = MONOMIALS_OF_OPENSIM if self.opensim_derivatives else MONOMIALS
        powers = (float(power) for each in self.powers for power in each)
        return [kind, 1.0, float(len(self.powers)), *self.coefficients, *powers]

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """Value, gradient (k,) and Hessian (k, k)."""
        value, gradient, hessian = super().evaluate(arguments)
        return (
            value,
            gradient,
            [[slope] * len(gradient) for slope in gradient]
            if self.opensim_derivatives
            else hessian,
        )


@dataclass(frozen=True)
class Scaled(Function):
    """``scale`` times another function."""

    scale: float
    function: Function

    def evaluate(self, arguments: Arguments) -> Evaluated:
        """`scale` times value, gradient and Hessian of the function."""
        value, gradient, hessian = self.function.evaluate(arguments)
        scale = self.scale
        return (
            scale * value,
            [scale * slope for slope in gradient],
            [[scale * bend for bend in row] for row in hessian],
        )

    @property
    def table(self) -> Sequence[float]:
        """That of the function, with another factor."""
        head, rest = self.function.table[:2], self.function.table[2:]
        return [head[0], self.scale * head[1], *rest] if head else ()


@dataclass(frozen=True)
class PiecewiseLinear(Univariate):
    """Straight lines between the points (`x`, `y`); the first and the last line go on outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """The lines, without the last point; where two x are equal the value jumps to the later y."""
        ends = zip(pairwise(self.x), pairwise(self.y), strict=True)
        lines = [(x0, y0, (y1 - y0) / (x1 - x0)) for (x0, x1), (y0, y1) in ends if x1 > x0]
        return _tabulate_pieces([x0 for x0, _, _ in lines], [(y0, slope) for _, y0, slope in lines])


@dataclass(frozen=True)
class PiecewiseConstant(Univariate):
    """Steps: ``y[k]`` from ``x[k]`` up to the next abscissa, the end values outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """The steps."""
        return _tabulate_pieces(self.x, [(y,) for y in self.y])


class SimmSpline(Univariate):
    """Cubic spline through (`x`, `y`) with straight lines, of the end slopes, outside.

    The ends have the third derivative of the cubic through the first (last) four points (Forsythe,
    Malcolm and Moler, Computer Methods for Mathematical Computations, 1977, chapter 4); three
    points give a parabola, two a line. Intervals narrower than 1e-7 count as 1e-7 wide, as in
    OpenSim.
    """

    def __init__(self, x: Iterable[float], y: Iterable[float]) -> None:
        self.x, self.y = tuple(map(float, x)), tuple(map(float, y))
        widths = [max(right - left, 1e-7) for left, right in pairwise(self.x)]
        slopes = [
            (y1 - y0) / width for (y0, y1), width in zip(pairwise(self.y), widths, strict=True)
        ]
        # sigma: a sixth of the second derivative at every point.
        sigma = _spline_curvature(self.x, widths, slopes)
        self._pieces = [
            (y, slope - width * (after + 2.0 * here), 3.0 * here, (after - here) / width)
            for y, slope, width, (here, after) in zip(
                self.y[:-1], slopes, widths, pairwise(sigma), strict=True
            )
        ]
        end = slopes[-1] + widths[-1] * (sigma[-2] + 2.0 * sigma[-1])
        self._pieces.append((self.y[-1], end, 3.0 * sigma[-1], 0.0))

    @property
    def pieces(self) -> tuple[tuple[float, float, float, float], ...]:
        """For every point k the factors of 1, t, t² and t³ from it on, t = argument - x[k].

        Of the last point the first two count; they are the line beyond it. The line before the
        first point has the first two of that.
        """
        return tuple(self._pieces)

    @property
    def table(self) -> Sequence[float]:
        """The pieces, and the lines outside."""
        first, *_, last = self._pieces
        # At the last point it still is the piece before it.
        knots = self.x[0], *self.x[:-1], math.nextafter(self.x[-1], math.inf)
        return _tabulate_pieces(knots, [first[:2], *self._pieces[:-1], last[:2]])


def _tabulate_pieces(knots: Sequence[float], pieces: Sequence[Sequence[float]]) -> list[float]:
    """The table of the polynomials after each knot, from the constant up; the first one goes on before its knot."""
    width = max(map(len, pieces))
    rows = [(*piece, *[0.0] * (width - len(piece))) for piece in pieces]
    return [PIECES, 1.0, float(len(knots)), float(width), *knots, *chain.from_iterable(rows)]


def table_at_knots(function: Function) -> list[float]:
    """The table of a function, by which the kernels take at a knot the piece that OpenSim takes there.

    They take the one after it; where OpenSim takes that before it, the knot is moved by its last
    digit. It shows where slopes or values jump.
    """
    table, inner = [*function.table], function
    while isinstance(inner, Scaled):
        inner = inner.function
    if isinstance(inner, PiecewiseLinear | PiecewiseConstant | SimmSpline):
        # That of a spline has the first knot twice.
        first = 5 if isinstance(inner, SimmSpline) else 4
        for k in range(1, len(inner.x) - 1):
            if _find_interval(inner.x, inner.x[k]) < k:
                table[first + k] = math.nextafter(inner.x[k], math.inf)
    return table


def _find_interval(knots: Sequence[float], x: float) -> int:
    """The index of the first point of the piece that OpenSim takes at a knot: a search by halves meets it first."""
    if x <= knots[0] or x >= knots[-1]:
        return 0 if x <= knots[0] else len(knots) - 2
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


def _spline_curvature(
    points: Sequence[float], widths: Sequence[float], slopes: Sequence[float]
) -> list[float]:
    """A sixth of the second derivative at each of n points: smooth inside, end conditions as above."""
    n = len(points)
    if n == 2:
        return [0.0, 0.0]
    # The equations of the points: the diagonal, what is right of them; beside the diagonal are the
    # widths.
    diagonal = [-widths[0], *(2.0 * (one + two) for one, two in pairwise(widths)), -widths[-1]]
    right = [0.0, *(after - before for before, after in pairwise(slopes)), 0.0]
    if n > 3:
        # Where three points lie on each other there is no spline.
        second = [
            right[k + 1] / ((points[k + 2] - points[k]) or math.nan) for k in (0, 1, n - 4, n - 3)
        ]
        right[0] = (
            widths[0] * widths[0] * (second[1] - second[0]) / ((points[3] - points[0]) or math.nan)
        )
        right[-1] = (
            -widths[-1]
            * widths[-1]
            * (second[3] - second[2])
            / ((points[-1] - points[-4]) or math.nan)
        )
    for k in range(1, n):
        share = widths[k - 1] / diagonal[k - 1]
        diagonal[k] -= share * widths[k - 1]
        right[k] -= share * right[k - 1]
    right[-1] /= diagonal[-1]
    for k in range(n - 2, -1, -1):
        right[k] = (right[k] - widths[k] * right[k + 1]) / diagonal[k]
    return right
