"""Tests of derivative rules in C++ against those in Python, also at corners and at zeros of either sign."""

from __future__ import annotations

import ctypes
import inspect
import itertools
import linecache
import math
import operator
from math import copysign, floor, sqrt

import pytest

from osimlite.mechanics.codegen.cplusplus import write_library
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.laws.dual_numbers import (
    differentiate_root,
    is_exact_zero,
    strip_derivatives,
)
from osimlite.simulation.engines.dual_numbers import (
    ARITHMETIC_SLOPES,
    DUAL_REPLACEMENTS,
    FUNCTION_SLOPES,
    DualNumber,
    make_dual,
)
from tests.mechanics.codegen.compiled import are_same_bits, compile_text, needs_compiler

DIRECTIONS = 3
SIGNS = {
    operator.neg: "-{}", operator.mod: "{} % {}", operator.pow: "{} ** {}", operator.add: "{} + {}",
    operator.sub: "{} - {}", operator.mul: "{} * {}", operator.truediv: "{} / {}",
}  # fmt: skip
VALUES = 0.0, -0.0, 0.5, -0.5, 1.0, -1.0, 2.0, -3.25, 1e-200, math.nan
CHANGES = [(0.0, 1.0, -0.5), (2.0, -0.0, 0.25)]


def write_function(function, which):
    """Return a kernel that applies a function to the numbers in x.

    Args:
        function: function or operator.
        which: for each argument, whether it carries derivatives.
    """
    given = [
        f"x[{k}]" if carries else f"strip_derivatives(x[{k}])" for k, carries in enumerate(which)
    ]
    text = SIGNS.get(function, f"{function.__name__}({', '.join(['{}'] * len(which))})").format(
        *given
    )
    name = f"rule_{function.__name__}_{''.join('dp'[not carries] for carries in which)}"
    source = f"def {name}(s: 'Ints', x: 'Floats', out: 'Floats', count: 'int') -> 'int':\n"
    source += f"    out[0] = {text}\n    return count\n"
    file = f"<{name}>"
    linecache.cache[file] = (len(source), None, source.splitlines(keepends=True), file)
    scope = {
        **vars(math),
        "strip_derivatives": strip_derivatives,
        "Floats": Floats,
        "Ints": Ints,
        "__name__": "osimlite.rules",
    }
    exec(compile(source, file, "exec"), scope)
    return scope[name]


RULES = {**FUNCTION_SLOPES, **ARITHMETIC_SLOPES}
CASES = [
    (function, which)
    for function, slopes in RULES.items()
    for which in itertools.product((True, False), repeat=len(slopes))
    if any(which)
]


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """Compile all rules, for all combinations of arguments that carry derivatives.

    Returns:
        Library, and kernels by name.
    """
    kernels = [write_function(*case) for case in CASES]
    text = write_library({kernel.__name__: (kernel, DIRECTIONS) for kernel in kernels})
    return compile_text(tmp_path_factory.mktemp("rules"), text), {
        kernel.__name__: kernel for kernel in kernels
    }


def evaluate(library, name, numbers):
    """Return value and derivatives of a kernel.

    Args:
        library: loaded library.
        name: name of the kernel.
        numbers: value and derivatives of each argument.
    """
    size = 1 + DIRECTIONS
    x = (ctypes.c_double * (size * len(numbers)))(
        *itertools.chain.from_iterable((v, *c) for v, c in numbers)
    )
    out = (ctypes.c_double * size)()
    kernel = getattr(library, name)
    kernel.restype, kernel.argtypes = ctypes.c_int64, [*[ctypes.c_void_p] * 3, ctypes.c_int64]
    assert kernel(None, x, out, 7) == 7
    return [*out]


def name_case(case):
    function, which = case
    return f"{function.__name__}-{''.join('dp'[not carries] for carries in which)}"


@needs_compiler
@pytest.mark.parametrize("case", CASES, ids=name_case)
def test_each_rule_is_that_of_python(compiled, case):
    library, kernels = compiled
    function, which = case
    name = write_function(*case).__name__
    assert name in kernels
    tried = 0
    for values in itertools.product(VALUES, repeat=len(which)):
        numbers = list(zip(values, CHANGES[: len(which)], strict=True))
        given = [
            DualNumber(v, [*c]) if carries else v
            for (v, c), carries in zip(numbers, which, strict=True)
        ]
        try:
            expected = DUAL_REPLACEMENTS[function](*given)
        except (ValueError, ZeroDivisionError, OverflowError):
            continue
        if isinstance(expected.value, complex):
            continue
        result = evaluate(library, name, numbers)
        assert are_same_bits(result[0], expected.value), (values, result, expected.value)
        if function is operator.truediv:
            # C++ divides the sum of both terms; Python divides each term, which may overflow then.
            if not all(map(math.isfinite, expected.slopes)):
                continue
            assert result[1:] == pytest.approx(expected.slopes, rel=4e-16, abs=0.0, nan_ok=True), (
                values
            )
        else:
            assert are_same_bits(result[1:], expected.slopes), (values, result, expected.slopes)
        tried += 1
    assert tried >= (4 if len(which) == 1 else 16)


def corners(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Use branches that depend on values, and functions at their corners."""
    a, b = x[0], x[1]
    out[0] = abs(a)
    out[1] = copysign(a, b)
    out[2] = max(a, 0.0)
    out[3] = min(a, b, 1)
    out[4] = sqrt(a) if a >= 0.0 else -a
    out[5] = floor(b) + int(b) * a
    out[6] = a if a else b
    out[7] = (a and b) + (a or 2.0)
    out[8] = is_exact_zero(a) + 2.0 * is_exact_zero(b)
    out[9] = (
        differentiate_root(a, b - 1.0, 2.0)
        + differentiate_root(3.0, a, b * b)
        + differentiate_root(a, 1.0, b)
    )
    out[10] = strip_derivatives(b) * a
    total = 0.0
    for k in range(count):
        total += a * k
        total *= 0.5
        total -= b
        total /= 1.5
    out[11] = total
    pair = (a, 1.0) if a < b else (2, b)
    out[12], out[13] = pair
    return a > b


@needs_compiler
def test_corners_are_those_of_python(tmp_path):
    library = compile_text(tmp_path, write_library({"corners": (corners, DIRECTIONS)}))
    kernel = library.corners
    kernel.restype, kernel.argtypes = ctypes.c_int64, [*[ctypes.c_void_p] * 3, ctypes.c_int64]
    in_python = make_dual(corners)
    size, count = 1 + DIRECTIONS, 14
    for a, b in itertools.product((0.0, -0.0, 1.0, -0.75, 2.5), (0.5, -0.5, 1.0)):
        for changes in (CHANGES, [(0.0,) * 3, (1.0, 0.0, 0.0)]):
            numbers = list(zip((a, b), changes, strict=True))
            x = (ctypes.c_double * (2 * size))(
                *itertools.chain.from_iterable((v, *c) for v, c in numbers)
            )
            out = (ctypes.c_double * (count * size))()
            expected = [0.0] * count
            wanted = in_python([0], [DualNumber(v, [*c]) for v, c in numbers], expected, 3)
            assert kernel(None, x, out, 3) == wanted
            for k, number in enumerate(expected):
                row = (
                    [number.value, *number.slopes]
                    if isinstance(number, DualNumber)
                    else [float(number), 0.0, 0.0, 0.0]
                )
                assert out[k * size : (k + 1) * size] == pytest.approx(row, rel=1e-15, abs=1e-16), (
                    k,
                    a,
                    b,
                )


def test_every_rule_has_a_test():
    assert {function for function, _ in CASES} == {*FUNCTION_SLOPES, *ARITHMETIC_SLOPES}
    assert all(
        len(inspect.signature(rules[0]).parameters) == len(rules) + 1 for rules in RULES.values()
    )
