"""Functions of coordinates with first and second derivatives, for joints and constraints.

They are OpenSim's functions of the same names. The kernels evaluate them by tables.
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
from osimlite.base.text import format_count
from osimlite.errors import ModelError
from osimlite.mechanics.kernels.functions import (
    FUNCTION_TYPE,
    evaluate_function,
    evaluate_monomials,
)

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.spatial import Array

    Arguments = Sequence[float] | Array
else:
    # The linter evaluates without arrays.
    Arguments = Sequence
FunctionDerivatives = tuple[float, list[float], list[list[float]]]
"""Value, gradient (k,) and Hessian (k, k) of a function of k numbers."""


class SmoothFunction(ABC):
    """Twice differentiable function of one or several numbers."""

    @abstractmethod
    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the gradient (k,) and the Hessian (k, k) at `arguments` (k,)."""

    @property
    def table(self) -> Sequence[float]:
        """Numbers by which the kernels evaluate the function; empty if they cannot.

        See :mod:`osimlite.mechanics.kernels.functions`.
        """
        return ()

    @property
    def slope(self) -> float | None:
        """Constant slope of a linear function of one argument, None for any other function."""
        return None


class Univariate(SmoothFunction):
    """Function of one number."""

    @property
    @abstractmethod
    def table(self) -> Sequence[float]:
        """Numbers by which the kernels evaluate the function."""

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the first and the second derivative at the one argument."""
        value, first, second = self.derivatives(float(arguments[0]))
        return value, [first], [[second]]

    def derivatives(self, x: float) -> tuple[float, float, float]:
        """Return the value and derivatives at a number.

        Returns:
            Value, first and second derivative as plain floats; NaN if `x` is not finite.
        """
        numbers: Any = memoryview(self._numbers)
        try:
            return evaluate_function(numbers, x) if math.isfinite(x) else _UNDEFINED_VALUE
        except ValueError:
            # Python's sine raises ValueError for infinite arguments, to which a factor may lead.
            return _UNDEFINED_VALUE

    @cached_property
    def _numbers(self) -> array[float]:
        return array("d", table_at_knots(self))


class Multivariate(SmoothFunction):
    """Sum of products of powers of several numbers."""

    @property
    @abstractmethod
    def table(self) -> Sequence[float]:
        """Numbers by which the kernels evaluate the function."""

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the gradient (k,) and the Hessian (k, k).

        The kernel gives second derivatives by time for rates of the arguments; each entry of the
        Hessian follows from the rates of one or two arguments.
        """
        size = len(arguments)
        indices: Any = range(size)
        values = make_floats(arguments)
        table = make_floats([*arguments, *self.table])
        gradient = make_floats([0.0] * size)

        def evaluate_at_rates(*moving: int) -> tuple[float, float]:
            """Return the value, and its second derivative while some arguments change by 1.

            Returns:
                Value and second derivative.
            """
            rates = make_floats([float(k in moving) for k in indices])
            value, _, curvature = evaluate_monomials(size, indices, table, values, rates, gradient)
            return value, curvature

        value = evaluate_at_rates()[0]
        hessian = make_zero_derivatives(size)[2]
        for k in indices:
            hessian[k][k] = evaluate_at_rates(k)[1]
        for row, column in combinations(indices, 2):
            # The mixed entry is half of what both rates give together beyond each alone.
            mixed = evaluate_at_rates(row, column)[1] - hessian[row][row] - hessian[column][column]
            hessian[row][column] = hessian[column][row] = 0.5 * mixed
        return value, list(gradient), hessian


def make_floats(numbers: Arguments | bytes) -> Any:
    """Return numbers in a buffer for kernels that run as Python.

    Single entries of it are read faster than those of an array.
    """
    return memoryview(array("d", numbers))


def make_zero_derivatives(size: int, value: float = 0.0) -> FunctionDerivatives:
    """Return the value and zero derivatives of a function of `size` constant arguments.

    Args:
        size: number k of arguments.
        value: value.

    Returns:
        Value, gradient (k,) and Hessian (k, k) of zeros.
    """
    return value, [0.0] * size, [[0.0] * size for _ in range(size)]


_UNDEFINED_VALUE = math.nan, math.nan, math.nan
"""Value and derivatives of a function where it is not defined."""


@dataclass(frozen=True)
class ConstantValue(SmoothFunction):
    """Function with the same value for any number of arguments."""

    value: float

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, and zeros for the derivatives."""
        return make_zero_derivatives(len(arguments), self.value)

    @property
    def table(self) -> Sequence[float]:
        """Table with one piece of degree 0."""
        return _tabulate_pieces((0.0,), ((self.value,),))


@dataclass(frozen=True)
class Linear(Univariate):
    """Linear function ``rate * x + start``."""

    rate: float = 1.0
    start: float = 0.0

    @property
    def table(self) -> Sequence[float]:
        """Table with one piece of degree 1."""
        return _tabulate_pieces((0.0,), ((self.start, self.rate),))

    @property
    def slope(self) -> float | None:
        """Slope of the function, which is the rate."""
        return self.rate


IDENTITY = Linear()
"""Function that returns its argument; a coordinate that drives an axis directly has it."""


@dataclass(frozen=True)
class Polynomial(Univariate):
    """Polynomial with `coefficients` from the highest power to the constant."""

    coefficients: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """Table with one piece, from the constant up."""
        return _tabulate_pieces((0.0,), (self.coefficients[::-1],))


@dataclass(frozen=True)
class SineWave(Univariate):
    """``amplitude * sin(omega * x + phase) + offset``."""

    amplitude: float
    omega: float
    phase: float
    offset: float

    @property
    def table(self) -> Sequence[float]:
        """Table of a sine: amplitude, angular frequency, phase and offset."""
        return FUNCTION_TYPE.SINE, 1.0, self.amplitude, self.omega, self.phase, self.offset


@dataclass(frozen=True)
class WeightedSum(Multivariate):
    """Sum of all arguments times their `weights`, plus `start`."""

    weights: tuple[float, ...]
    start: float = 0.0

    @property
    def table(self) -> Sequence[float]:
        """Table of monomials: one for each argument, and one for the constant."""
        size = len(self.weights)
        powers = (float(term == argument) for term in range(size + 1) for argument in range(size))
        return [FUNCTION_TYPE.MONOMIALS, 1.0, size + 1.0, *self.weights, self.start, *powers]


@dataclass(frozen=True)
class QuinticStep(Univariate):
    """Quintic step from `start_value` to `end_value`, twice differentiable.

    It is constant before `start` and after `end`.
    """

    start: float
    end: float
    start_value: float
    end_value: float

    @property
    def table(self) -> Sequence[float]:
        """Table of a step: arguments of both ends, then the values there."""
        return FUNCTION_TYPE.STEP, 1.0, self.start, self.end, self.start_value, self.end_value


@dataclass(frozen=True)
class MultivariatePolynomial(Multivariate):
    """Sum of `coefficients` times monomials of all arguments.

    OpenSim 4.6's Hessian of such a polynomial is wrong: it has the gradient in each column.
    """

    coefficients: tuple[float, ...]  # coefficients of the monomials
    powers: tuple[tuple[int, ...], ...]  # power of each argument in each monomial
    opensim_derivatives: bool = False  # whether the Hessian is OpenSim's

    @classmethod
    def complete(
        cls,
        coefficients: Sequence[float],
        dimension: int,
        order: int,
        *,
        opensim_derivatives: bool = False,
    ) -> MultivariatePolynomial:
        """Return the polynomial with all monomials up to an order.

        Monomials are sorted by the power of the first argument, then of the next, as in OpenSim.

        Args:
            coefficients: coefficient of each monomial.
            dimension: number of arguments.
            order: largest sum of powers.
            opensim_derivatives: whether to reproduce OpenSim's wrong Hessian.

        Raises:
            ModelError: the number of coefficients differs from that of the monomials.
        """
        powers = tuple(
            item for item in product(range(order + 1), repeat=dimension) if sum(item) <= order
        )
        if len(powers) != len(coefficients):
            raise ModelError(
                f"a polynomial of {format_count(dimension, 'variable')} up to order {order} has "
                f"{format_count(len(powers), 'coefficient')}; "
                f"got {len(coefficients)}"
            )
        return cls(tuple(coefficients), powers, opensim_derivatives)

    @property
    def table(self) -> Sequence[float]:
        """Table of all monomials with their powers."""
        function_type = (
            FUNCTION_TYPE.MONOMIALS_OF_OPENSIM
            if self.opensim_derivatives
            else FUNCTION_TYPE.MONOMIALS
        )
        powers = (float(power) for exponents in self.powers for power in exponents)
        return [function_type, 1.0, float(len(self.powers)), *self.coefficients, *powers]

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return the value, the gradient (k,) and the Hessian (k, k)."""
        value, gradient, hessian = super().evaluate(arguments)
        return (
            value,
            gradient,
            [[slope] * len(gradient) for slope in gradient]
            if self.opensim_derivatives
            else hessian,
        )


@dataclass(frozen=True)
class ScaledFunction(SmoothFunction):
    """Multiple of another function."""

    scale: float
    function: SmoothFunction

    def evaluate(self, arguments: Arguments) -> FunctionDerivatives:
        """Return `scale` times value, gradient and Hessian of the function."""
        value, gradient, hessian = self.function.evaluate(arguments)
        scale = self.scale
        return (
            scale * value,
            [scale * slope for slope in gradient],
            [[scale * bend for bend in row] for row in hessian],
        )

    @property
    def table(self) -> Sequence[float]:
        """Table of the function with another factor."""
        type_and_factor = self.function.table[:2]
        remainder = self.function.table[2:]
        return (
            [type_and_factor[0], self.scale * type_and_factor[1], *remainder]
            if type_and_factor
            else ()
        )


@dataclass(frozen=True)
class PiecewiseLinear(Univariate):
    """Straight lines between the points (`x`, `y`); the first and last line continue outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """Table of the lines; where two x are equal the value jumps to the later y."""
        ends = zip(pairwise(self.x), pairwise(self.y), strict=True)
        lines = [(x0, y0, (y1 - y0) / (x1 - x0)) for (x0, x1), (y0, y1) in ends if x1 > x0]
        return _tabulate_pieces([x0 for x0, _, _ in lines], [(y0, slope) for _, y0, slope in lines])


@dataclass(frozen=True)
class PiecewiseConstant(Univariate):
    """Steps: ``y[k]`` from ``x[k]`` up to the next abscissa, and the end values outside."""

    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def table(self) -> Sequence[float]:
        """Table with one constant piece per point."""
        return _tabulate_pieces(self.x, [(y,) for y in self.y])


class SimmCubicSpline(Univariate):
    """Cubic spline through (`x`, `y`), continued outside by lines with the end slopes.

    The ends have the third derivative of the cubic through the first (last) four points (Forsythe,
    Malcolm and Moler, Computer Methods for Mathematical Computations, 1977, chapter 4). Three
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
            (
                y,
                slope - width * (next_sigma + 2.0 * this_sigma),
                3.0 * this_sigma,
                (next_sigma - this_sigma) / width,
            )
            for y, slope, width, (this_sigma, next_sigma) in zip(
                self.y[:-1], slopes, widths, pairwise(sigma), strict=True
            )
        ]
        end = slopes[-1] + widths[-1] * (sigma[-2] + 2.0 * sigma[-1])
        self._pieces.append((self.y[-1], end, 3.0 * sigma[-1], 0.0))

    @property
    def pieces(self) -> tuple[tuple[float, float, float, float], ...]:
        """Coefficients of 1, t, t² and t³ of each piece, with t = argument - x[k].

        The last piece is the line beyond the last point, with two nonzero coefficients. The line
        before the first point has the first two coefficients of the first piece.

        Returns:
            Four coefficients of each piece, one piece per point.
        """
        return tuple(self._pieces)

    @property
    def table(self) -> Sequence[float]:
        """Table of the pieces, and of the lines outside."""
        first, *_, last = self._pieces
        # At the last point OpenSim evaluates the piece before it, hence the next larger float.
        knots = self.x[0], *self.x[:-1], math.nextafter(self.x[-1], math.inf)
        return _tabulate_pieces(knots, [first[:2], *self._pieces[:-1], last[:2]])


def _tabulate_pieces(knots: Sequence[float], pieces: Sequence[Sequence[float]]) -> list[float]:
    """Return the table of polynomials after each knot.

    Args:
        knots: first argument of each piece; the first piece also holds before its knot.
        pieces: coefficients of each piece, from the constant up.
    """
    width = max(map(len, pieces))
    rows = [(*piece, *[0.0] * (width - len(piece))) for piece in pieces]
    return [
        FUNCTION_TYPE.PIECES,
        1.0,
        float(len(knots)),
        float(width),
        *knots,
        *chain.from_iterable(rows),
    ]


def table_at_knots(function: SmoothFunction) -> list[float]:
    """Return the table of a function with OpenSim's choice of pieces at knots.

    Kernels evaluate the piece after a knot. Where OpenSim evaluates the piece before it, the knot
    is moved to the next larger float. This matters where slopes or values jump.
    """
    table = [*function.table]
    inner = function
    while isinstance(inner, ScaledFunction):
        inner = inner.function
    if isinstance(inner, PiecewiseLinear | PiecewiseConstant | SimmCubicSpline):
        # The table of a spline contains the first knot twice.
        first = 5 if isinstance(inner, SimmCubicSpline) else 4
        for k in range(1, len(inner.x) - 1):
            if _find_interval(inner.x, inner.x[k]) < k:
                table[first + k] = math.nextafter(inner.x[k], math.inf)
    return table


def _find_interval(knots: Sequence[float], x: float) -> int:
    """Return the index of the first point of the piece that OpenSim evaluates at a knot.

    OpenSim's search by bisection may meet the piece before the knot first.

    Args:
        knots: knots, which increase.
        x: one of the knots.
    """
    if x <= knots[0] or x >= knots[-1]:
        return 0 if x <= knots[0] else len(knots) - 2
    low = 0
    high = len(knots)
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
    """Return a sixth of the second derivative of a spline at each of n points.

    Inside, the second derivative is continuous; for the ends see `SimmCubicSpline`.

    Args:
        points: abscissae (n,).
        widths: widths of the intervals (n - 1,).
        slopes: slopes of the chords (n - 1,).
    """
    n = len(points)
    if n == 2:
        return [0.0, 0.0]
    # Tridiagonal equations: the diagonal, and the right sides; the entries off the diagonal are the
    # widths.
    diagonal = [
        -widths[0],
        *(2.0 * (left_width + right_width) for left_width, right_width in pairwise(widths)),
        -widths[-1],
    ]
    rhs = [0.0, *(next_slope - slope for slope, next_slope in pairwise(slopes)), 0.0]
    if n > 3:
        # With three coincident points no spline exists: NaN.
        second = [
            rhs[k + 1] / ((points[k + 2] - points[k]) or math.nan) for k in (0, 1, n - 4, n - 3)
        ]
        rhs[0] = (
            widths[0] * widths[0] * (second[1] - second[0]) / ((points[3] - points[0]) or math.nan)
        )
        rhs[-1] = (
            -widths[-1]
            * widths[-1]
            * (second[3] - second[2])
            / ((points[-1] - points[-4]) or math.nan)
        )
    # Gaussian elimination without pivoting, as the equations are diagonally dominant inside.
    for k in range(1, n):
        factor = widths[k - 1] / diagonal[k - 1]
        diagonal[k] -= factor * widths[k - 1]
        rhs[k] -= factor * rhs[k - 1]
    rhs[-1] /= diagonal[-1]
    for k in range(n - 2, -1, -1):
        rhs[k] = (rhs[k] - widths[k] * rhs[k + 1]) / diagonal[k]
    return rhs
