"""From functions of :mod:`osimlite.simulation.kernels` to machine code, kept in numba's cache.

The kernels know of no compiler. Each entry (the evaluation, the motion, a law) is compiled on its own, with the
functions that it calls within, and calls the others by their address: so what a model does not need is not compiled,
and nothing is compiled twice. All entries take addresses of arrays and numbers, hold no reference to any Python object,
and run without Python's lock.
"""

from __future__ import annotations

import ctypes
import dis
import hashlib
from collections.abc import Callable
from functools import cache
from inspect import signature
from pathlib import Path
from types import FunctionType
from typing import Any

from osimlite._require import require
from osimlite.simulation.kernels import pointers
from osimlite.simulation.kernels.table import law_function

numba = require("numba", extra="fast", purpose="the compiled engine")

from llvmlite import ir  # type: ignore[import-untyped]  # noqa: E402
from numba.core import types  # noqa: E402
from numba.extending import intrinsic  # noqa: E402

POINTERS: dict[str, Any] = {
    "Floats": types.CPointer(types.float64),  # type: ignore[no-untyped-call]
    "Ints": types.CPointer(types.int64),  # type: ignore[no-untyped-call]
}
NUMBERS: dict[str, Any] = {"float": types.float64, "int": types.int64}
LEAN = {"error_model": "numpy", "_nrt": False}
"""No exceptions where a number is divided by zero; nothing is allocated."""

_kept: list[Any] = []
"""Machine code stays where it is as long as this does."""


@intrinsic
def _at(context: Any, vector: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.gep(arguments[0], [arguments[1]])

    return vector(vector, types.int64), generate


@intrinsic
def _call(context: Any, address: Any, s: Any, x: Any, w: Any, y: Any, f: Any, place: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        parts = [context.get_value_type(part) for part in signature.args[1:]]
        function = ir.FunctionType(context.get_value_type(types.int64), parts)
        return builder.call(builder.inttoptr(arguments[0], function.as_pointer()), arguments[1:])

    return types.int64(types.int64, s, x, w, y, f, types.int64), generate


INSTRUCTIONS: dict[Any, Any] = {pointers.at: _at, pointers.call: _call}
"""What stands in the place of functions that Python has and machine code has not."""


@cache
def address_of(name: str) -> int:
    """Address of the code of a law, which is compiled if it is not in the cache."""
    entry = _entry(name)
    found: int = entry.address
    return found


@cache
def entry_point(name: str) -> Callable[..., int]:
    """The code of a law as a function of addresses and numbers; it runs without Python's lock."""
    parts = signature(law_function(name)).parameters.values()
    kinds = [ctypes.c_void_p if part.annotation in POINTERS else ctypes.c_int64 for part in parts]
    return ctypes.CFUNCTYPE(ctypes.c_int64, *kinds)(address_of(name))


def _entry(name: str) -> Any:
    function = law_function(name)
    parts = [{**POINTERS, **NUMBERS}[part.annotation] for part in signature(function).parameters.values()]
    # Numba looks at the time of one source file only; an entry depends on several.
    copy = _linked(function, f"{function.__qualname__}_{_digest()}")
    entry = numba.cfunc(types.int64(*parts), nopython=True, cache=True, **LEAN)(copy)
    _kept.append(entry)
    return entry


@cache
def _within(function: Any) -> Any:
    """A function that is called by compiled ones."""
    copy = _linked(function, function.__qualname__)
    return numba.njit(copy, no_cpython_wrapper=True, no_cfunc_wrapper=True, **LEAN)


def _linked(function: Any, name: str) -> Any:
    """A function that calls the compiled ones of ours in their place."""
    scope = dict(function.__globals__)
    for called in {item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"}:
        value = scope.get(called)
        if isinstance(value, FunctionType) and value.__module__.startswith("osimlite."):
            scope[called] = INSTRUCTIONS.get(value) or _within(value)
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, None)
    copy.__qualname__, copy.__module__ = name, function.__module__
    return copy


@cache
def _digest() -> str:
    """What tells whether any source of the compiled code has changed."""
    package = Path(__file__).parents[2]
    sources = [*sorted(package.glob("forces/*.py")), *sorted(package.glob("simulation/kernels/*.py"))]
    sources += [package / "simulation" / "integrators.py", Path(__file__)]
    return hashlib.sha256(b"\0".join(path.read_bytes() for path in sources)).hexdigest()[:12]
