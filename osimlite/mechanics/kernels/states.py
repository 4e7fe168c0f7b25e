"""States of a motion."""

from __future__ import annotations

from osimlite.mechanics.kernels.pointers import Floats


def copy(count: int, values: Floats, to: Floats) -> None:
    """Copy numbers."""
    for k in range(count):
        to[k] = values[k]


def is_finite(count: int, values: Floats) -> bool:
    """Whether all of so many numbers are finite."""
    total = 0.0
    for k in range(count):
        total += values[k]
    return total - total == 0.0


def cubic(
    size: int,
    t0: float,
    y0: Floats,
    f0: Floats,
    t1: float,
    y1: Floats,
    f1: Floats,
    t: float,
    y: Floats,
) -> None:
    """State y at a time within a step, on the cubic Hermite polynomial through its ends."""
    h = t1 - t0
    z = (t - t0) / h
    b1 = z * z * (3.0 - 2.0 * z)
    b0 = 1.0 - b1
    c = h * z * (z - 1.0)
    c1 = c * z
    c0 = c1 - c
    for k in range(size):
        y[k] = b0 * y0[k] + b1 * y1[k] + c0 * f0[k] + c1 * f1[k]
