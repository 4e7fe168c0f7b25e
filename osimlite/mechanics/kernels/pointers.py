"""Two operations on vectors that machine code has and Python has not, each with what it means in Python.

:mod:`osimlite.simulation.engines.compiler` puts instructions in the place of these functions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]
else:
    # As Python, whatever has numbers in a row and slices that are views of them.
    Floats = Ints = Any

Law = Callable[[Ints, Floats, Floats, Floats, Floats, int], int]
"""Takes the three vectors of :mod:`osimlite.mechanics.kernels.layout`, a state, room for its
derivative, and the number of an operation or the place of an item, which the law is about.
"""

Vector = TypeVar("Vector", "Floats", "Ints")

laws: dict[int, Law] = {}
"""The laws by address, as Python knows them."""


def address(law: Law) -> int:
    """What stands for the address of a law in Python."""
    laws[id(law)] = law
    return id(law)


def at(vector: Vector, place: int) -> Vector:
    """The vector from a place on."""
    return vector[place:]


def call(
    address: int, model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, place: int
) -> int:
    """Call the law at an address."""
    return laws[address](model, reals, data, y, f, place)


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
