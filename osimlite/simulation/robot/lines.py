"""Functions that are straight lines, whatever their class: formats for robots can say these."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from osimlite.mechanics.multibody import functions as f


class Line(NamedTuple):
    """``slope * x + start``."""

    slope: float
    start: float

    def after(self, inner: Line) -> Line:
        """This line of the inner one."""
        return Line(self.slope * inner.slope, self.slope * inner.start + self.start)

    def inverse(self) -> Line:
        """The line that gives x for its value; the slope must not be zero."""
        return self if self == (1.0, 0.0) else Line(1.0 / self.slope, -self.start / self.slope)


def as_line(function: f.Function) -> Line | None:
    """The straight line that a function of one argument is, or None.

    Splines count if they are straight to the last digit, as one through two points is, or one
    through points of equal height.
    """
    match function:
        case f.Linear(rate, start):
            return Line(rate, start)
        case f.WeightedSum((weight,), start):
            return Line(weight, start)
        case f.Polynomial((*high, slope, start)) if not any(high):
            return Line(slope, start)
        case f.MultivariatePolynomial(coefficients, powers) if all(
            len(item) == 1 for item in powers
        ):
            factors = {
                power: coefficient
                for coefficient, (power,) in zip(coefficients, powers, strict=True)
            }
            if not any(factor for power, factor in factors.items() if power > 1):
                return Line(factors.get(1, 0.0), factors.get(0, 0.0))
        case f.Scaled(scale, inner):
            line = as_line(inner)
            return None if line is None else Line(scale, 0.0).after(line)
        case f.PiecewiseLinear((_, _)) | f.SimmSpline() if _is_straight(function):
            start, slopes, _ = function.evaluate(np.zeros(1))
            return Line(float(slopes[0]), start)
    return None


def _is_straight(function: f.Function) -> bool:
    if not isinstance(function, f.SimmSpline):
        return True
    # Where points lie on each other, the curve may jump.
    if any(right - left <= 1e-7 for left, right in pairwise(function.x)):
        return False
    return len({slope for _, slope, _, _ in function.pieces}) == 1 and not any(
        bend for piece in function.pieces[:-1] for bend in piece[2:]
    )
