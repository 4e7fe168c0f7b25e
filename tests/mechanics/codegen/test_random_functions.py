"""Tests of translation by random functions: Python, C++ and JavaScript give the same bits."""

from __future__ import annotations

import pytest

from osimlite.mechanics.codegen.cplusplus import write_library
from osimlite.mechanics.codegen.javascript import write_javascript
from tests.mechanics.codegen.compiled import (
    are_same_bits,
    call_library,
    call_python,
    compile_text,
    needs_compiler,
)
from tests.mechanics.codegen.node import call_javascript, needs_node
from tests.mechanics.codegen.random_functions import make_function, make_inputs
from tests.suite import choose

SEEDS = range(1, 1 + choose(12, 200))
INPUTS = 12


@pytest.fixture(scope="module")
def cases():
    """Return, by function, the inputs for which Python raises no error, and the results."""
    found = {}
    for seed in SEEDS:
        function, results = make_function(seed), []
        for given in make_inputs(seed, INPUTS):
            try:
                results.append((given, call_python(function, *given)))
            except (ArithmeticError, ValueError):
                continue
        found[function] = results
    # If Python raised an error for most inputs, nothing would be compared.
    assert sum(map(len, found.values())) > 0.9 * INPUTS * len(SEEDS)
    return found


def test_functions_differ(cases):
    """Most functions depend on their inputs."""
    varied = [
        results
        for results in cases.values()
        if len({repr(result) for _, result in results}) > INPUTS // 2
    ]
    assert len(varied) > 0.8 * len(cases)


@needs_compiler
def test_cplusplus_gives_the_same_bits(cases, tmp_path):
    text = write_library({function.__name__: (function, 0) for function in cases})
    library = compile_text(tmp_path, text, "-O1", "-w")
    for function, results in cases.items():
        for given, expected in results:
            result = call_library(library, function.__name__, *given)
            assert are_same_bits(result, expected), (function.__name__, given)


@needs_node
def test_javascript_gives_the_same_numbers(cases):
    calls = [
        (function.__name__, *given) for function, results in cases.items() for given, _ in results
    ]
    results = iter(call_javascript(write_javascript([], [*cases]), calls))
    for function, rows in cases.items():
        for given, expected in rows:
            assert are_same_bits(
                ignore_sign_of_zero(next(results)), ignore_sign_of_zero(expected)
            ), (
                function.__name__,
                given,
            )


def ignore_sign_of_zero(result):
    """Return a result without negative zeros, which integers of JavaScript can have."""
    return [ignore_sign_of_zero(x) if isinstance(x, list) else x + 0 for x in result]
