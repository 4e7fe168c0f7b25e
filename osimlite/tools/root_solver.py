"""OpenSim's RootSolver: roots of independent functions, all at once.

Brent's method brackets each root, and takes steps of inverse quadratic interpolation or bisection
(R. P. Brent, Algorithms for Minimization without Derivatives, 1973, chapter 4). The result differs
from the exact root by up to the tolerance, so the steps here are those of OpenSim.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from osimlite.mechanics.multibody.spatial import Array

ROUNDING = 2.0 * float(np.finfo(float).eps)
"""Relative rounding error of a double, times two."""


def find_roots(
    function: Callable[[Array], Array], lower: Array, upper: Array, tolerance: float
) -> Array:
    """Return roots (n,) of n functions, each of its own argument.

    Args:
        function: function that returns n values (n,) for n arguments (n,).
        lower: lower bounds of the arguments (n,).
        upper: upper bounds of the arguments (n,).
        tolerance: tolerance of the arguments.

    Returns:
        Roots (n,); one of the bounds for a function without a root between them.
    """
    a, b = lower.astype(float), upper.astype(float)
    fa, fb = function(a), function(b)
    c, fc = a.copy(), fa.copy()
    is_open = np.ones(len(a), dtype=bool)
    while True:
        step = np.zeros(len(a))
        # All functions are evaluated at once, because one evaluation of the model gives all of
        # them.
        for i in np.flatnonzero(is_open).tolist():
            if (fb[i] > 0.0 and fc[i] > 0.0) or (fb[i] < 0.0 and fc[i] < 0.0):
                c[i], fc[i] = a[i], fa[i]
            previous_step = b[i] - a[i]
            # Brent's convention: b is the best estimate, c the other end of the bracket.
            if abs(fc[i]) < abs(fb[i]):
                a[i], b[i] = b[i], c[i]
                c[i] = a[i]
                fa[i], fb[i] = fb[i], fc[i]
                fc[i] = fa[i]
            step_tolerance = ROUNDING * abs(b[i]) + 0.5 * tolerance
            new_step = 0.5 * (c[i] - b[i])
            if abs(new_step) <= step_tolerance or fb[i] == 0.0:
                is_open[i] = False
                continue
            if abs(previous_step) >= step_tolerance and abs(fa[i]) > abs(fb[i]):
                new_step = _interpolate_step(
                    a[i], b[i], c[i], fa[i], fb[i], fc[i], previous_step, step_tolerance, new_step
                )
            # A step below the tolerance would make no progress.
            if abs(new_step) < step_tolerance:
                new_step = step_tolerance if new_step > 0.0 else -step_tolerance
            a[i], fa[i] = b[i], fb[i]
            step[i] = new_step
        if not is_open.any():
            return b
        b = b + step
        fb = function(b)


def _interpolate_step(
    a: float,
    b: float,
    c: float,
    fa: float,
    fb: float,
    fc: float,
    previous_step: float,
    step_tolerance: float,
    half_bracket: float,
) -> float:
    """Return a step of linear or inverse quadratic interpolation, or half the bracket.

    The interpolated step is taken only if it is short enough.
    """
    width = c - b
    if a == c:
        ratio = fb / fa
        p = width * ratio
        q = 1.0 - ratio
    else:
        q, t1, t2 = fa / fc, fb / fc, fb / fa
        p = t2 * (width * q * (q - t1) - (b - a) * (t1 - 1.0))
        q = (q - 1.0) * (t1 - 1.0) * (t2 - 1.0)
    p, q = (p, -q) if p > 0.0 else (-p, q)
    return (
        p / q
        if p < 0.75 * width * q - 0.5 * abs(step_tolerance * q) and p < abs(0.5 * previous_step * q)
        else half_bracket
    )
