"""Tests of the translation of kernels to C++: results equal those of Python to the last bit."""

from __future__ import annotations

import ctypes
import math
import os

import pytest

from osimlite.mechanics.codegen.cplusplus import write_library, write_units
from osimlite.mechanics.codegen.reader import TranslationError
from osimlite.mechanics.kernels.pointers import Floats, Ints
from osimlite.mechanics.laws.formulas import power
from tests.mechanics.codegen import constructs, refused
from tests.mechanics.codegen.compiled import (
    are_same_bits,
    call_library,
    call_python,
    compile_text,
    needs_compiler,
)


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    """Compile all functions of the module `constructs` without warnings."""
    functions = (*constructs.EXACT, constructs.use_bits, constructs.compute_series)
    text = write_library({function.__name__: (function, 0) for function in functions})
    return compile_text(tmp_path_factory.mktemp("constructs"), text)


@needs_compiler
@pytest.mark.parametrize(
    "function", (*constructs.EXACT, constructs.use_bits), ids=lambda function: function.__name__
)
def test_each_construct(library, function):
    for given in constructs.INPUTS:
        expected = call_python(function, *given)
        result = call_library(library, function.__name__, *given)
        assert are_same_bits(result, expected), given


@needs_compiler
def test_functions_of_mathematics(library):
    for given in constructs.INPUTS:
        expected = call_python(constructs.compute_series, *given)
        result = call_library(library, "compute_series", *given)
        # Both call the same C library, but a compiler may evaluate constants itself.
        assert result[3] == pytest.approx(expected[3], rel=1e-15, abs=0.0), given


def convert(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Convert floats that do not fit into integers."""
    for k in range(4):
        s[k] = int(x[k])
    return math.floor(x[count])


@needs_compiler
def test_floats_beyond_integers_saturate(tmp_path):
    library = compile_text(tmp_path, write_library({"convert": (convert, 0)}))
    largest, least = 2**63 - 1, -(2**63)
    result = call_library(library, "convert", [0] * 4, [math.nan, math.inf, -1e300, -(2.0**63)], 1)
    assert result[:2] == [largest, [0, largest, least, least]]
    result = call_library(library, "convert", [0] * 4, [2.0**62, -1.5, 9.99, -0.0], 0)
    assert result[:2] == [2**62, [2**62, -1, 9, 0]]


@needs_compiler
def test_powers_by_floats_beyond_integers(tmp_path):
    library = compile_text(tmp_path, write_library({"power": (power, 0)}))
    library.power.restype, library.power.argtypes = ctypes.c_double, [ctypes.c_double] * 2
    for a, b in (
        (-0.5, 1e300),
        (-1.0, 1e19),
        (-2.0, 3.0),
        (-2.0, 2.5),
        (-3.0, -2.0),
        (2.0, math.inf),
    ):
        assert are_same_bits(library.power(a, b), power(a, b)), (a, b)


def divide(s: Ints, x: Floats, out: Floats, count: int) -> int:
    """Divide by zero, where Python raises an error."""
    out[0], out[1], out[2] = x[0] / x[3], x[1] / x[3], x[3] / x[3]
    out[3] = s[0] / s[3]
    return s[0] // s[3] + s[0] % s[3]


@needs_compiler
def test_division_by_zero_ends_nothing(tmp_path):
    library = compile_text(tmp_path, write_library({"divide": (divide, 0)}))
    value, _, _, out = call_library(library, "divide", [5, 0, 0, 0], [1.0, -1.0, 0.0, 0.0], 0)
    assert (
        value == 0
        and out[:2] == [math.inf, -math.inf]
        and math.isnan(out[2])
        and out[3] == math.inf
    )


# ----------------------------------------------------------------------------------- text of the translation
def branch(a: float, b: float) -> float:
    """Return the larger of two numbers, plus 3."""
    # This comment must not appear in the code.
    larger = a
    if b > a:
        larger = b
    for k in range(3):
        larger += k
    return larger


def test_the_text_has_the_names_and_lines_of_python():
    text = write_library({"branch": (branch, 0)})
    assert (
        """\
double test_cplusplus_branch(double a, double b) {
    // larger = a
    double larger = a;
    // if b > a:
    if (b > a) {
        // larger = b
        larger = b;
    }
    // for k in range(3):
    for (int64_t k = 0; k < 3; ++k) {
        // larger += k
        larger += k;
    }
    // return larger
    return larger;
}"""
        in text
    )
    assert "OSIMLITE_EXPORT double branch(double a, double b)" in text


def test_the_text_is_the_same_each_time():
    kernels = {function.__name__: (function, 0) for function in constructs.EXACT}
    text = write_library(kernels)
    assert write_library(kernels) == text
    assert os.sep + "tests" not in text


def twice(a: float) -> float:
    """Return the double of a number; this kernel shares nothing with another."""
    return 2.0 * a


def test_units_share_the_kernels():
    units = write_units({"one": (branch, 0), "two": (twice, 4)}, 3)
    assert [unit.count("OSIMLITE_EXPORT") for unit in units] == [1, 1]
    assert "Dual<4> two(Dual<4> a)" in units[1]


# ---------------------------------------------------------------------------------------------------- errors
@pytest.mark.parametrize("function", refused.REFUSED, ids=lambda function: function.__name__)
def test_what_cannot_be_translated_is_named(function):
    words, directions = refused.REFUSED[function]
    with pytest.raises(TranslationError, match=words) as caught:
        write_library({"symbol": (function, directions)})
    assert "kernel 'symbol'" in str(caught.value)
    where = refused.twice if function is refused.call_wrongly else function
    assert f"'refused_{where.__name__}'" in str(caught.value)
    assert caught.value.file == refused.__file__
    first = where.__code__.co_firstlineno
    assert first <= caught.value.line <= first + 4
