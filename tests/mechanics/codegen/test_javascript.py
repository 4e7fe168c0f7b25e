"""Tests of the translation of kernels to JavaScript: results equal those of Python."""

from __future__ import annotations

import json
import math
from math import sqrt

import numpy as np
import pytest

from osimlite.mechanics.codegen.javascript import write_javascript
from osimlite.mechanics.codegen.reader import TranslationError
from osimlite.mechanics.kernels.paths import pull_path
from osimlite.mechanics.kernels.pointers import at
from osimlite.mechanics.kernels.table import LAW_MODULES
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.laws import find_function
from osimlite.simulation.elements.registry import FORCE_TYPES
from tests.mechanics.codegen import constructs
from tests.mechanics.codegen.compiled import are_same_bits, call_python

TABLE = 3, 4


def branches(a: float, b: float) -> float:
    """Use every kind of expression."""
    low, high = (a, b) if a <= b else (b, a)
    if not 0.0 < low < 10.0 or high == 7.0:
        return -low // 2 + low % 0.75 + 4.0 % -high + (high - 1.0) ** 2 / TABLE[1]
    elif low != high and (a > 1.0 or b > 1.0):
        low, high = high, low
        return sqrt(abs(low)) + max(low, 3.0 * high) - min(low, high, 0.5)
    return float(int(high * 3.7))


def loops(count: int, start: float) -> float:
    """Use every kind of loop; one loop changes its own variable."""
    total = start
    for k in range(count):
        k = 2 * k
        if k > 8:
            break
        total += k
    for k in range(count, 0, -1):
        for _ in (1.0, 2.0):
            if k == 2:
                continue
            total -= 0.25 * k
    while total > 3.0:
        total *= 0.5
    a = b = total
    a, b = b + 1.0, a * 2.0
    return spread(*(a, b))


def spread(new: float, case: float) -> float:
    """Use names that are reserved in JavaScript."""
    var = new - case
    return var


def pointers(v: np.ndarray, count: int) -> float:
    """Read and write items of a vector through an offset."""
    numbers = at(v, 1)
    numbers[count], numbers[0] = numbers[0] + 7.0, numbers[count]
    numbers[1] -= 1.5
    return 100.0 * numbers[0] + 10.0 * numbers[1] + numbers[count]


@pytest.fixture
def page(chromium):
    page = chromium.new_page()
    yield page
    page.close()


def test_functions_give_the_same(page):
    code = write_javascript([branches], [loops, spread])
    cases = [[a, b] for a in (-1.5, 0.5, 2.0, 12.0) for b in (0.5, 1.0, 7.0, 9.25)]
    result = page.evaluate(f"{json.dumps(cases)}.map(([a, b]) => ({code}).laws[1](a, b))")
    assert result == [branches(a, b) for a, b in cases]
    cases = [[count, start] for count in (0, 1, 3, 9) for start in (0.0, -2.5, 40.0)]
    result = page.evaluate(f"{json.dumps(cases)}.map(([a, b]) => ({code}).loops(a, b))")
    assert result == [loops(count, start) for count, start in cases]
    code = write_javascript([], [pointers])
    result = page.evaluate(
        f"[1, 2, 4].map((k) => ({code}).pointers(new Float64Array([0, 1, 2, 3, 4, 5]), k))"
    )
    assert result == [pointers(np.arange(6.0), k) for k in (1, 2, 4)]


def opens(a: float) -> float:
    """Use a statement that kernels may not contain."""
    with open("x"):
        return a


def asks(a: float) -> float:
    """Call a function that neither JavaScript nor the runtime provides."""
    return math.lgamma(a)


def masks(a: int) -> int:
    """Use bits that JavaScript takes for a sign."""
    return a & 0xFFFFFFFF


def shares(a: int) -> int:
    """Call a function with a keyword."""
    return max(a, 1, key=abs)


@pytest.mark.parametrize(
    "function", (opens, asks, masks, shares), ids=lambda function: function.__name__
)
def test_what_is_not_known_is_an_error(function):
    with pytest.raises(
        TranslationError, match=f"'test_javascript_{function.__name__}'.* JavaScript"
    ) as caught:
        write_javascript([], [function])
    assert caught.value.file == __file__


def test_all_kernels_are_translated_but_those_with_random_numbers():
    """Random noise of reflexes needs integers of 64 bits, which the translator refuses."""
    kernels = [*LAW_MODULES, *(kind.name for kind in FORCE_TYPES if isinstance(kind, ForceType))]
    translated = []
    for name in kernels:
        try:
            translated.append((name, write_javascript([find_function(name)], [pull_path])))
        except TranslationError as error:
            assert "the function 'reflexes_" in str(error) and "64 bits" in str(error), name
    assert {*kernels} - {name for name, _ in translated} == {"run_by_reflexes", "walk_several"}


@pytest.fixture(scope="module")
def results():
    """Return the results of the functions of the module `constructs` for all inputs, by name."""
    from tests.mechanics.codegen.node import NODE, call_javascript

    if NODE is None:
        pytest.skip("needs Node.js on the PATH")
    tested = [*constructs.EXACT, constructs.compute_series]
    calls = [(function.__name__, *given) for function in tested for given in constructs.INPUTS]
    found = iter(call_javascript(write_javascript([], tested), calls))
    return {function.__name__: [next(found) for _ in constructs.INPUTS] for function in tested}


def without_signs_of_zero(result):
    """Return a result without negative zeros, which integers of JavaScript can have."""
    return [x + 0 if not isinstance(x, list) else without_signs_of_zero(x) for x in result]


@pytest.mark.parametrize("function", constructs.EXACT, ids=lambda function: function.__name__)
def test_each_construct(results, function):
    for given, result in zip(constructs.INPUTS, results[function.__name__], strict=True):
        expected = call_python(function, *given)
        assert are_same_bits(without_signs_of_zero(result), without_signs_of_zero(expected)), given


def test_functions_of_mathematics(results):
    for given, result in zip(constructs.INPUTS, results["compute_series"], strict=True):
        expected = call_python(constructs.compute_series, *given)
        assert result[3] == pytest.approx(expected[3], rel=5e-15, abs=0.0), given
