"""Values and integrals of functions of one argument."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from osimlite.mechanics.multibody.functions import SmoothFunction


def evaluate_function(function: SmoothFunction, argument: float) -> float:
    """Return the value of a function of one argument."""
    value, _, _ = function.evaluate(np.array((argument,)))
    return float(value)


def integrate_function(function: SmoothFunction, start: float, end: float) -> float:
    """Return the integral of a function of one argument.

    Gauss-Legendre quadrature with five nodes from knot to knot, or in sixteen intervals for
    functions without knots. It is exact for piecewise polynomials up to degree nine.

    Args:
        function: the function.
        start: lower limit.
        end: upper limit; the sign changes if it is below the lower one.

    Returns:
        The integral.
    """
    inner = [
        knot for knot in getattr(function, "x", ()) if min(start, end) < knot < max(start, end)
    ]
    knots = np.unique([start, end, *inner]) if inner else np.linspace(start, end, 17)
    knots = knots if knots[0] == start else knots[::-1]
    nodes, weights = np.polynomial.legendre.leggauss(5)
    total = 0.0
    for left, right in pairwise(knots.tolist()):
        half = 0.5 * (right - left)
        values = [evaluate_function(function, left + half * (1.0 + node)) for node in nodes]
        total += half * float(weights @ values)
    return total
