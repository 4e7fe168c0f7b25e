"""Moving points: a quartic of the coordinate, of which the three places are quartics again.

MuJoCo's joints follow others by quartics. Two in a row follow a spline several times as closely as
one, above all in its slope, which is what a moment arm is made of.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.polynomial import Chebyshev, Polynomial

from osimlite.base.require import require
from osimlite.mechanics.multibody.functions import Function
from osimlite.mechanics.multibody.spatial import Array
from osimlite.translate.mjcf.polynomials import DEGREE, find_polynomial, sample_function

HELPER_RANGE_RAD = 0.02
"""How far (rad) a helper turns: little, so that its inertia hardly weighs on the coordinate that drives it."""
SAMPLE_COUNT = 80
UNIT_POINTS = np.cos(np.linspace(0.0, np.pi, SAMPLE_COUNT))
"""Where functions are looked at, of a span from -1 to 1."""
INITIAL_BENDS = ((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (-0.5, 0.0, 0.0), (0.0, -0.3, 0.0))
"""Bends of the first quartic, as powers 2, 3 and 4 beside a slope of 1, from which the best is sought."""


def fit_composition(
    functions: Sequence[Function], span: tuple[float, float]
) -> tuple[Array, Array]:
    """The quartic (5,) of a coordinate, and the quartics (k, 5) of its value that are nearest to k functions on a span.

    All are written from the constant on, the first one within -REACH and REACH. Polynomials of up
    to degree 4 are written as they are.
    """
    exact = [find_polynomial(function) for function in functions]
    known = [item for item in exact if item is not None and item.degree() <= DEGREE]
    if len(known) == len(exact):
        return np.eye(DEGREE + 1)[1], np.array([_pad_coefficients(item) for item in known])
    low, high = span
    at = 0.5 * (low + high) + 0.5 * (high - low) * UNIT_POINTS
    values = np.stack([sample_function(item, at) for item in functions], axis=1)
    # The two sides of a body have the same functions, or their negatives.
    signs = np.where(values[0] < 0.0, -1.0, 1.0)
    bent, rows = fit_quartics((values * signs).tobytes())
    normal = Polynomial((-(low + high) / (high - low), 2.0 / (high - low)))
    slides = np.array(
        [_pad_coefficients(Chebyshev(row).convert(kind=Polynomial)) for row in (rows * signs).T]
    )
    return HELPER_RANGE_RAD * _pad_coefficients(
        Polynomial(bent)(normal)
    ), slides / HELPER_RANGE_RAD ** np.arange(DEGREE + 1)


@cache
def fit_quartics(data: bytes) -> tuple[Array, Array]:
    """The quartic (5,), and by Chebyshev polynomials the quartics (5, k) of it, nearest to values (SAMPLES, k)."""
    values = np.frombuffer(data).reshape(SAMPLE_COUNT, -1)
    powers = np.vander(UNIT_POINTS, DEGREE + 1, increasing=True)

    def first(bends: Array) -> Array:
        bent = np.array((0.0, 1.0, *bends))
        reached = powers @ bent
        middle, half = 0.5 * (reached.max() + reached.min()), 0.5 * (reached.max() - reached.min())
        bent[0] -= middle
        return bent / half

    def second(bends: Array) -> tuple[Array, Array]:
        basis = np.polynomial.chebyshev.chebvander(powers @ first(bends), DEGREE)
        result: Array = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], dtype=np.float64)
        return result, (basis @ result - values).ravel()

    search = require("scipy.optimize", extra="sim", purpose="fits of moving points").least_squares
    best = min(
        (search(lambda bends: 1e3 * second(bends)[1], start) for start in INITIAL_BENDS),
        key=lambda each: each.cost,
    )
    return first(best.x), second(best.x)[0]


def _pad_coefficients(polynomial: Polynomial) -> Array:
    return np.pad(polynomial.coef, (0, DEGREE + 1 - len(polynomial.coef)))
