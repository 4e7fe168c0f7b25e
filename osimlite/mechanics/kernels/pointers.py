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
