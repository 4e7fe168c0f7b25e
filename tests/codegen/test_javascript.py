"""Functions as JavaScript do what they do in Python."""

from __future__ import annotations

import json
import math
import re
from math import sqrt

import numpy as np
import pytest

from osimlite.codegen.javascript import as_javascript
from osimlite.kernels.paths import pull_path
from osimlite.kernels.pointers import at
from osimlite.kernels.table import LAW_MODULES
from osimlite.simulation.elements.kind import Kind, kinds
from osimlite.simulation.elements.laws import law_function

TABLE = 3, 4


def branches(a: float, b: float) -> float:
    """Every kind of expression."""
    low, high = (a, b) if a <= b else (b, a)
    if not 0.0 < low < 10.0 or high == 7.0:
        return -low // 2 + low % 0.75 + 4.0 % -high + (high - 1.0) ** 2 / TABLE[1]
    elif low != high and (a > 1.0 or b > 1.0):
        low, high = high, low
        return sqrt(abs(low)) + max(low, 3.0 * high) - min(low, high, 0.5)
    return float(int(high * 3.7))


def loops(count: int, start: float) -> float:
    """Every kind of loop, one of which changes its own variable."""
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
    """Names that JavaScript keeps for itself."""
    var = new - case
    return var


def pointers(v: np.ndarray, count: int) -> float:
    """Places in vectors."""
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
    code = as_javascript([branches], [loops, spread])
    cases = [[a, b] for a in (-1.5, 0.5, 2.0, 12.0) for b in (0.5, 1.0, 7.0, 9.25)]
    result = page.evaluate(f"{json.dumps(cases)}.map(([a, b]) => ({code}).laws[1](a, b))")
    assert result == [branches(a, b) for a, b in cases]
    cases = [[count, start] for count in (0, 1, 3, 9) for start in (0.0, -2.5, 40.0)]
    result = page.evaluate(f"{json.dumps(cases)}.map(([a, b]) => ({code}).loops(a, b))")
    assert result == [loops(count, start) for count, start in cases]
    code = as_javascript([], [pointers])
    result = page.evaluate(f"[1, 2, 4].map((k) => ({code}).pointers(new Float64Array([0, 1, 2, 3, 4, 5]), k))")
    assert result == [pointers(np.arange(6.0), k) for k in (1, 2, 4)]


def test_what_is_not_known_is_an_error():
    def held(a: float) -> float:
        with open("x"):
            return a

    def called(a: float) -> float:
        return math.sqrt(a)

    for function in (held, called):
        with pytest.raises(NotImplementedError, match=function.__name__):
            as_javascript([], [function])


def test_all_kernels_are_translated_but_those_with_named_tuples():
    """Pages compute paths; muscles and the engine's own loops are told apart by the tuples that they are given."""
    named = re.compile(r": (MuscleInputs|Motion|Fit|Assembly|Walk)\(|: [am]\.")
    translated = set()
    for name in [*LAW_MODULES, *(kind.name for kind in kinds() if isinstance(kind, Kind))]:
        try:
            as_javascript([law_function(name)], [pull_path])
            translated.add(name)
        except NotImplementedError as error:
            assert named.search(str(error)), name
    assert {
        "wrapped_path",
        "geodesic_path",
        "cable_path",
        "pull_points",
        "evaluate",
        "path_spring",
    } <= translated
