"""Kernels that call the pure numerical functions of kernels and laws with arguments from vectors.

As a program, it calls the functions of a library many times, for builds that stop at undefined
behaviour.
"""

from __future__ import annotations

import ctypes
import linecache
import math
import random
import sys
from array import array
from collections.abc import Callable, Iterator
from typing import Any

from osimlite.mechanics.codegen.cplusplus.library import make_library
from osimlite.mechanics.codegen.cplusplus.types import FLOAT, INTEGER, Tuple, Type, is_plain_number
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.simulation.elements.laws import find_law, get_symbol, list_library_laws

SIZE = 160
"""Length of each vector."""
# Floats for which functions have corners, overflow, underflow or no result.
SPECIAL = math.nan, math.inf, -math.inf, 0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, -1e300, 5e-324


def all_kernels(directions: int) -> dict[str, tuple[Callable[..., Any], int]]:
    """Return the kernels that the library of osimlite exports.

    Args:
        directions: number of derivative directions; 0 for plain numbers.

    Returns:
        Function and number of directions, by exported symbol.
    """
    return {get_symbol(name): find_law(name) for name in list_library_laws(directions)}


def is_of_numbers(kind: Type | None) -> bool:
    """Return whether a type is a number or a tuple of such types."""
    return is_plain_number(kind) or (
        isinstance(kind, Tuple) and all(map(is_of_numbers, kind.parts))
    )


def wrap_functions() -> dict[Callable[..., Any], Callable[..., int]]:
    """Return, for each pure numerical function, a kernel that calls it."""
    library = make_library(all_kernels(0))
    wrapped: dict[Callable[..., Any], Callable[..., int]] = {}
    for part in library.specialisations:
        if (
            not part.effects
            and all(map(is_of_numbers, part.arguments))
            and is_of_numbers(part.result)
        ):
            wrapped[part.function] = _wrap(part.function, part.name, part.arguments, part.result)
    return wrapped


def _wrap(
    function: Callable[..., Any], name: str, kinds: tuple[Type, ...], result: Any
) -> Callable[..., int]:
    scope = {"function": function, "Ints": Ints, "Floats": Floats, "__name__": "osimlite.pure"}
    counters = iter(range(SIZE)), iter(range(SIZE))
    given = ", ".join(_argument(kind, counters, scope) for kind in kinds)
    lines = [f"def pure_{name}(s: 'Ints', x: 'Floats', out: 'Floats', count: 'int') -> 'int':"]
    lines += [f"    result = function({given})"]
    lines += [f"    out[{k}] = {text}" for k, text in enumerate(_items("result", result))]
    lines += ["    return count"]
    source = "\n".join(lines) + "\n"
    file = f"<pure {name}>"
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    exec(compile(source, file, "exec", dont_inherit=True), scope)
    wrapper: Any = scope[f"pure_{name}"]
    return wrapper


def _argument(kind: Type, counters: tuple[Iterator[int], ...], scope: dict[str, Any]) -> str:
    if isinstance(kind, Tuple):
        inner = ", ".join(_argument(part, counters, scope) for part in kind.parts)
        if kind.record is None:
            return f"({inner},)" if inner else "()"
        scope[kind.record.__name__] = kind.record
        return f"{kind.record.__name__}({inner})"
    index = next(counters[kind is FLOAT])
    if kind is FLOAT:
        return f"x[{index}]"
    return f"s[{index}]" if kind is INTEGER else f"(s[{index}] > 0)"


def _items(text: str, kind: Any) -> list[str]:
    if isinstance(kind, Tuple):
        return [item for k, part in enumerate(kind.parts) for item in _items(f"{text}[{k}]", part)]
    return [text]


def make_arguments(symbol: str, seed: int, hard: float) -> tuple[array[int], array[float]]:
    """Return random integers and floats for a wrapped function.

    Args:
        symbol: name of the kernel.
        seed: seed of the random numbers.
        hard: fraction of the floats that are special, such as zeros, infinity or NaN.

    Returns:
        Integers and floats, each a vector of SIZE numbers.
    """
    rng = random.Random(seed)
    floats = (
        rng.choice(SPECIAL)
        if rng.random() < hard
        else rng.choice((rng.gauss(0.0, 1.0), rng.random(), 10 ** rng.uniform(-6.0, 3.0)))
        for _ in range(SIZE)
    )
    integers = [rng.randint(-3, 6) for _ in range(SIZE)]
    if symbol.startswith("pure_bezier_"):
        # These functions take indices of coefficients: the first index, a stride, and a number of
        # iterations.
        integers[:3] = 0, 1, 3
    return array("q", integers), array("d", floats)


def call_compiled(
    library: ctypes.CDLL, symbol: str, ints: array[int], floats: array[float]
) -> list[float]:
    """Return the results of a wrapped function in a library."""
    kernel = getattr(library, symbol)
    kernel.restype, kernel.argtypes = ctypes.c_int64, [*[ctypes.c_void_p] * 3, ctypes.c_int64]
    out = array("d", [0.0] * SIZE)
    kernel(*(vector.buffer_info()[0] for vector in (ints, floats, out)), 0)
    return out.tolist()


if __name__ == "__main__":
    loaded, calls = ctypes.CDLL(sys.argv[1]), 0
    for symbol in sys.argv[3:]:
        for number in range(int(sys.argv[2])):
            call_compiled(loaded, symbol, *make_arguments(symbol, number, 0.3 * (number % 2)))
            calls += 1
    print(calls)
