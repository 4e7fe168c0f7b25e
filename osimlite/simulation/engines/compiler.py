"""From functions of :mod:`osimlite.simulation.kernels` to the intermediate language of LLVM, by numba.

The kernels know of no compiler. An entry is compiled with the functions that it calls within. It takes addresses of
arrays and numbers, holds no reference to any Python object, and runs without Python's lock.
"""

from __future__ import annotations

import dis
from functools import cache
from inspect import signature
from types import FunctionType
from typing import Any

from osimlite._require import require
from osimlite.simulation.kernels import pointers

numba = require("numba", extra="sim", purpose="the compiled engine")

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


def compiled(function: Any) -> tuple[str, str]:
    """Text and symbol of an entry."""
    parts = [{**POINTERS, **NUMBERS}[part.annotation] for part in signature(function).parameters.values()]
    entry = numba.cfunc(types.int64(*parts), nopython=True, **LEAN)(_linked(function))
    return entry.inspect_llvm(), entry.native_name


@cache
def _within(function: Any) -> Any:
    """A function that is called by compiled ones."""
    return numba.njit(_linked(function), no_cpython_wrapper=True, no_cfunc_wrapper=True, **LEAN)


def _linked(function: Any) -> Any:
    """A function that calls the compiled ones of ours in their place."""
    scope = dict(function.__globals__)
    for called in {item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"}:
        value = scope.get(called)
        if isinstance(value, FunctionType) and value.__module__.startswith("osimlite."):
            scope[called] = INSTRUCTIONS.get(value) or _within(value)
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__, None)
    copy.__qualname__, copy.__module__ = function.__qualname__, function.__module__
    return copy
