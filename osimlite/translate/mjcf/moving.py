"""Functions of a coordinate as quartics of a quartic.

MuJoCo's joints follow others by quartics. Two in a row follow a spline several times as closely as
one, above all in its slope, which determines moment arms.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from osimlite.base.require import require
from osimlite.mechanics.multibody.functions import SmoothFunction
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf.polynomials import DEGREE, find_polynomial, sample_function

HELPER_RANGE_RAD = 0.02
"""Rotation (rad) of a helper joint to either side: small, so that its inertia hardly loads the
coordinate.
"""
SAMPLE_COUNT = 80
"""Number of samples of a function."""
UNIT_POINTS = np.cos(np.linspace(0.0, np.pi, SAMPLE_COUNT))
"""Chebyshev points from -1 to 1, at which functions are sampled."""
INITIAL_BENDS = ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.0, -0.3, 0.0))
"""Initial guesses of the coefficients of powers 2, 3 and 4 of the inner quartic, beside a slope of
1.
"""


def fit_composition(
    functions: Sequence[SmoothFunction], interval: tuple[float, float]
) -> tuple[Array, Array]:
    """Fit quartics of a common quartic to functions of a coordinate.

    Functions that are polynomials of degree 4 at most are exact, with the identity as inner
    quartic.

    Args:
        functions: functions of the coordinate (k).
        interval: range of the coordinate (rad or m).

    Returns:
        Inner quartic (5,), whose values are within `HELPER_RANGE_RAD`, and outer quartics (k, 5);
        constant first.
    """
    exact = [find_polynomial(function) for function in functions]
    polynomials = [
        each_function
        for each_function in exact
        if each_function is not None and each_function.degree() <= DEGREE
    ]
    if len(polynomials) == len(exact):
        return np.eye(DEGREE + 1)[1], np.array(
            [_pad_coefficients(each_function) for each_function in polynomials]
        )
    lower, upper = interval
    # Chebyshev points keep the error even over the range.
    points = 0.5 * (lower + upper) + 0.5 * (upper - lower) * UNIT_POINTS
    values = np.stack(
        [sample_function(each_function, points) for each_function in functions], axis=1
    )
    # The left and right sides have equal or opposite functions, and share the cached fit.
    signs = np.where(values[0] < 0.0, -1.0, 1.0)
    inner, rows = fit_quartics((values * signs).tobytes())
    # Maps the range of the coordinate to [-1, 1].
    normal = Polynomial((-(lower + upper) / (upper - lower), 2.0 / (upper - lower)))
    outers = np.array(
        [_pad_coefficients(Chebyshev(row).convert(kind=Polynomial)) for row in (rows * signs).T]
    )
    return HELPER_RANGE_RAD * _pad_coefficients(
        Polynomial(inner)(normal)
    ), outers / HELPER_RANGE_RAD ** np.arange(DEGREE + 1)


@cache
def fit_quartics(data: bytes) -> tuple[Array, Array]:
    """Fit the quartics to samples of functions.

    Results are cached, because both sides of a body have the same functions.

    Args:
        data: bytes of the samples (SAMPLE_COUNT, k).

    Returns:
        Inner quartic (5,), constant first, and outer quartics (5, k) in Chebyshev polynomials.
    """
    values = np.frombuffer(data).reshape(SAMPLE_COUNT, -1)
    monomials = np.vander(UNIT_POINTS, DEGREE + 1, increasing=True)

    # The inner quartic is scaled so that it reaches -1 and 1, and the outer one uses its complete
    # range. This determines its coefficients of order 0 and 1; the others are the variables.
    def make_inner(variables: Array) -> Array:
        coefficients = np.array((0.0, 1.0, *variables))
        reached = monomials @ coefficients
        middle = 0.5 * (reached.max() + reached.min())
        half = 0.5 * (reached.max() - reached.min())
        coefficients[0] -= middle
        return coefficients / half

    def fit_outer(variables: Array) -> tuple[Array, Array]:
        # For a given inner quartic the outer ones follow by linear least squares (variable
        # projection).
        basis = np.polynomial.chebyshev.chebvander(monomials @ make_inner(variables), DEGREE)
        result: Array = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], dtype=np.float64)
        return result, (basis @ result - values).ravel()

    search = require("scipy.optimize", extra="sim", purpose="fits of moving points").least_squares
    # 1e3 lets the search end at a sensible relative change.
    best = min(
        (search(lambda variables: 1e3 * fit_outer(variables)[1], start) for start in INITIAL_BENDS),
        key=lambda search_result: search_result.cost,
    )
    return make_inner(best.x), fit_outer(best.x)[0]


def _pad_coefficients(polynomial: Polynomial) -> Array:
    """Return the coefficients (5,) of a polynomial, constant first."""
    return np.pad(polynomial.coef, (0, DEGREE + 1 - len(polynomial.coef)))
