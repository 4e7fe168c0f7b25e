"""From a packed model to something that runs: machine code where numba is installed, else the kernels as Python."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from inspect import signature
from typing import Any

import numpy as np

from osimlite.simulation.kernels import layout, pointers
from osimlite.simulation.kernels.pack import Packed
from osimlite.simulation.kernels.pointers import Ints
from osimlite.simulation.kernels.table import LAW_NUMBERS, law_function

KERNEL = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 5, ctypes.c_int64)
"""A kernel: takes the three vectors, a state, room for its derivative, and the place of an item."""


@cache
def has_compiler() -> bool:
    """Whether kernels are compiled; numba is not loaded to find out."""
    try:
        return find_spec("numba") is not None and find_spec("llvmlite") is not None
    except ValueError:
        return False


def version() -> str:
    """Of what runs the kernels."""
    if has_compiler():
        from osimlite.simulation.engines.machine_code import VERSION

        return VERSION
    import platform

    return f"Python {platform.python_version()}, without numba"


@cache
def entry_point(name: str) -> Callable[..., int]:
    """A function of the kernels, called with arrays and integers; machine code runs without Python's lock."""
    function = law_function(name)
    if not has_compiler():
        return function
    from osimlite.simulation.engines.machine_code import address_of

    kinds = [
        ctypes.c_void_p if part.annotation in ("Floats", "Ints") else ctypes.c_int64
        for part in signature(function).parameters.values()
    ]
    code = ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(address_of(name))
    return lambda *arguments: code(*(item.ctypes.data if isinstance(item, np.ndarray) else item for item in arguments))


def bound(name: str, *arrays: Any) -> Callable[[int], int]:
    """A function of the kernels with its arrays, which the caller keeps; what is left is one integer."""
    function = entry_point(name)
    if not has_compiler():
        return lambda number: function(*arrays, number)
    from osimlite.simulation.engines.machine_code import address_of

    code = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * len(arrays), ctypes.c_int64)(address_of(name))
    addresses = [item.ctypes.data for item in arrays]
    return lambda number: code(*addresses, number)


class Program:
    """The structure of a packed model with the addresses of all that it calls, good in this process only.

    Args:
        packed: the model.

    Attributes:
        ints: the structure and the addresses.
        failures: what the parts in Python have raised.
    """

    def __init__(self, packed: Packed) -> None:
        self.ints: Ints = packed.structure.copy()
        self.failures: list[Exception] = []
        self._sizes = len(packed.numbers), int(packed.structure[layout.WORK_SIZE]), packed.structure[layout.STATE_SIZE]
        self._kept: list[Any] = []
        for name in packed.laws:
            self.ints[layout.LAWS + LAW_NUMBERS[name]] = self._address(name)
        for place, kernel in packed.kernels.items():
            self.ints[place] = self._address(kernel) if isinstance(kernel, str) else self._callback(kernel)

    def _address(self, name: str) -> int:
        if not has_compiler():
            return pointers.address(law_function(name))
        from osimlite.simulation.engines.machine_code import address_of

        return address_of(name)

    def _callback(self, python: Callable[..., None]) -> int:
        """Address of a kernel that stays Python."""

        def kernel(*vectors: Any, item: int) -> int:
            try:
                python(*vectors, item)
            except Exception as error:
                # It cannot pass through machine code; whoever asked for the evaluation raises it.
                self.failures.append(error)
                return layout.FAILED
            return layout.FINE

        if not has_compiler():
            return pointers.address(lambda *arguments: kernel(*arguments[:-1], item=arguments[-1]))
        numbers, work, state = self._sizes

        def called(s: int, x: int, w: int, y: int, f: int, item: int) -> int:
            starts = (x, numbers), (w, work), (y, state), (f, state)
            views = (_view(start, ctypes.c_double, size) for start, size in starts)
            return kernel(_view(s, ctypes.c_int64, len(self.ints)), *views, item=item)

        callback = KERNEL(called)
        self._kept.append(callback)
        return int(ctypes.cast(callback, ctypes.c_void_p).value or 0)


def _view(address: int, kind: Any, count: int) -> Any:
    return np.ctypeslib.as_array((kind * int(count)).from_address(address))
