"""Polynomials of several coordinates, fitted to lengths of tendons."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.function_types import MultivariatePolynomialFunction

MAX_TERMS = 330
"""Largest number of terms: order 4 of seven coordinates, order 6 of four."""
MAX_ORDER = 8
SAMPLES_PER_TERM = 4
CLOSE_M = 1e-6
"""Error in poses that were not fitted (rms, m) at which the order is high enough."""
SINGULAR_TOLERANCE = 1e-13
"""Relative size of a part of the terms that counts as zero."""
MAX_ERROR_RATIO = 0.8
"""Factor by which a higher order must reduce the error to be preferred."""


def list_exponents(count: int, order: int) -> NDArray[np.int64]:
    """Return the exponents (k, n) of all terms, in the order of OpenSim's coefficients.

    The last exponent changes first: 1, y, y^2, x, x y, x^2 for two arguments and order 2.
    """

    def rows(remaining: int, max_order: int) -> Iterator[tuple[int, ...]]:
        if not remaining:
            yield ()
            return
        for power in range(max_order + 1):
            for other_exponents in rows(remaining - 1, max_order - power):
                yield (power, *other_exponents)

    return np.array(list(rows(count, order)), dtype=np.int64).reshape(-1, count)


def evaluate_terms(values: Array, exponents: NDArray[np.int64]) -> Array:
    """Return the terms (P, k) at values (P, n)."""
    order = int(exponents.max(initial=0))
    # Powers are computed once, and multiplied for all terms.
    value_powers = values[:, None, :] ** np.arange(order + 1)[None, :, None]
    result = np.ones((len(values), len(exponents)))
    for column in range(values.shape[1]):
        result *= value_powers[:, exponents[:, column], column]
    return result


def possible_orders(count: int) -> list[int]:
    """Return the orders whose number of terms is not too large, for `count` coordinates."""
    return [
        order
        for order in range(1, MAX_ORDER + 1)
        if order == 1 or math.comb(count + order, order) <= MAX_TERMS
    ]


def samples_for(count: int) -> int:
    """Return the number of poses that the highest possible order needs."""
    return SAMPLES_PER_TERM * math.comb(count + possible_orders(count)[-1], count)


def fit_polynomial(
    values: Array, lengths: Array, checks: Array, check_lengths: Array
) -> tuple[MultivariatePolynomialFunction, Array]:
    """Return the polynomial of the lowest order that is near the best in other poses.

    Args:
        values: values of the coordinates (P, n) in the poses of the fit.
        lengths: lengths (P,) in these poses, m.
        checks: values (Q, n) in other poses.
        check_lengths: lengths (Q,) in these.

    Returns:
        The function, and its errors (Q,) in the other poses, m.
    """
    count = values.shape[1]
    orders = [
        order
        for order in possible_orders(count)
        if order == 1 or SAMPLES_PER_TERM * math.comb(count + order, order) <= len(values)
    ]
    # One decomposition serves all orders, if the terms of lower orders come first.
    exponents = list_exponents(count, orders[-1])
    exponents = exponents[np.argsort(exponents.sum(1), kind="stable")]
    terms = evaluate_terms(values, exponents)
    scale = np.abs(terms).max(0)
    # A term that is zero in all samples is not scaled.
    scale[scale == 0.0] = 1.0
    q, r = np.linalg.qr(terms / scale)
    projected = q.T @ lengths
    check_terms = evaluate_terms(checks, exponents)
    best: tuple[float, int, Array, Array] | None = None
    for order in orders:
        size = math.comb(count + order, order)
        # Terms that depend on each other (a coordinate that does not move) end the search.
        diagonal = np.abs(np.diag(r)[:size])
        if diagonal.min() < SINGULAR_TOLERANCE * diagonal.max() and best is not None:
            break
        solution = np.linalg.lstsq(r[:size, :size], projected[:size], rcond=SINGULAR_TOLERANCE)[0]
        solution = solution / scale[:size]
        errors = check_terms[:, :size] @ solution - check_lengths
        rms = float(np.sqrt(np.mean(errors**2)))
        # A higher order must be clearly better, since it swings between the samples.
        if best is None or rms < MAX_ERROR_RATIO * best[0]:
            best = rms, order, solution, errors
        if best[0] < CLOSE_M:
            break
    assert best is not None
    _, order, solution, errors = best
    # OpenSim has another order of terms.
    coefficients = dict(zip(map(tuple, exponents[: len(solution)].tolist()), solution, strict=True))
    function = MultivariatePolynomialFunction(
        name="length_function",
        coefficients=tuple(
            float(coefficients[tuple(row)]) for row in list_exponents(count, order).tolist()
        ),
        dimension=count,
        order=order,
    )
    return function, errors
