"""Vectors of kernels: views, calls of laws by address, and plain operations on states.

`at` and `call` exist in machine code but not in Python; here is what they mean in Python. The
writers in :mod:`osimlite.mechanics.codegen` and :mod:`osimlite.simulation.engines.numba_laws`
replace these two by operations on pointers.
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
    # In Python: any sequence of numbers whose slices are views.
    Floats = Ints = Any

Law = Callable[[Ints, Floats, Floats, Floats, Floats, int], int]
"""Signature of a law: `model`, `reals`, `data`, a state y, its rates f, and the index of its subject.

:mod:`osimlite.mechanics.kernels.layout` describes the three vectors. The subject is the number of
an operation, or the offset of an item or a constraint in the model.
"""

Vector = TypeVar("Vector", "Floats", "Ints")

laws: dict[int, Law] = {}
"""Laws by the integers that stand for their addresses in Python."""


def register_law(law: Law) -> int:
    """Register a law for calls by address in Python.

    Returns:
        The integer that stands for its address.
    """
    laws[id(law)] = law
    return id(law)


def at(vector: Vector, offset: int) -> Vector:
    """Return the vector from an offset on, as a view.

    Args:
        vector: array of numbers.
        offset: offset of the first entry of the view.
    """
    return vector[offset:]


def call(
    address: int, model: Ints, reals: Floats, data: Floats, y: Floats, f: Floats, offset: int
) -> int:
    """Call the law at an address.

    Args:
        address: address in machine code, or the integer of `register_law` in Python.
        model: integers of the model.
        reals: numbers of the model.
        data: results of an evaluation.
        y: state.
        f: rates of the state.
        offset: number of the law's subject, such as an operation, or offset of an item or
            constraint.

    Returns:
        Outcome of the law, see `OUTCOME`.
    """
    return laws[address](model, reals, data, y, f, offset)


def copy_numbers(count: int, values: Floats, to: Floats) -> None:
    """Copy the first numbers of a vector to another one.

    Args:
        count: number of entries.
        values: vector to copy from.
        to: vector to copy to; changed.
    """
    for k in range(count):
        to[k] = values[k]


def is_finite(count: int, values: Floats) -> bool:
    """Return whether the first `count` numbers of a vector are all finite.

    Args:
        count: number of entries.
        values: vector.
    """
    # The sum is not finite if any entry is not. It may also overflow for huge finite numbers, which
    # are as useless here.
    total = 0.0
    for k in range(count):
        total += values[k]
    # Infinity less infinity is NaN, so the difference is 0 for finite sums only.
    return total - total == 0.0


def interpolate_cubic(
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
    """Evaluate the cubic Hermite polynomial through both ends of a step at the time t.

    Args:
        size: length of a state.
        t0: time at the start of the step (s).
        y0: state at the start.
        f0: rates of the state at the start.
        t1: time at the end of the step (s).
        y1: state at the end.
        f1: rates of the state at the end.
        t: time within the step (s).
        y: filled with the state at t.
    """
    h = t1 - t0
    z = (t - t0) / h
    # Hermite's basis functions; those of the rates contain the step length h.
    b1 = z * z * (3.0 - 2.0 * z)
    b0 = 1.0 - b1
    c = h * z * (z - 1.0)
    c1 = c * z
    c0 = c1 - c
    for k in range(size):
        y[k] = b0 * y0[k] + b1 * y1[k] + c0 * f0[k] + c1 * f1[k]
