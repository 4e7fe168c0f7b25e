"""Tests of parsing Python while finalizers and other threads parse as well."""

from __future__ import annotations

import ast
import gc
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from osimlite.base.syntax_trees import parse_expression, parse_module
from tests.suite import choose

LONG = "\n".join(f"x{k} = (a + b) * [c for c in d if c]" for k in range(2000))


class Cycle:
    """Reference cycle whose finalizer parses Python when the garbage collector runs."""

    def __init__(self) -> None:
        self.itself = self

    def __del__(self) -> None:
        ast.parse("a + b")


def test_a_finalizer_that_parses_disturbs_nothing():
    thresholds = gc.get_threshold()
    gc.set_threshold(50)
    try:
        for _ in range(choose(2, 5)):
            for _ in range(30):
                Cycle()
            assert len(parse_module(LONG).body) == 2000
    finally:
        gc.set_threshold(*thresholds)


def test_threads_that_are_interrupted_while_they_parse_do_not_disturb_each_other():
    text = Path(__file__).read_text() * 5

    def interrupt(phase, info):
        time.sleep(1e-5)

    thresholds = gc.get_threshold()
    gc.callbacks.append(interrupt)
    gc.set_threshold(50)
    try:
        with ThreadPoolExecutor(4) as pool:
            trees = list(pool.map(lambda _: parse_module(text), range(24)))
    finally:
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(interrupt)
    assert len({ast.dump(tree) for tree in trees}) == 1


def test_faults_of_the_text_are_raised():
    assert isinstance(parse_expression("a + 1").body, ast.BinOp)
    with pytest.raises(SyntaxError):
        parse_expression("a = 1")
    with pytest.raises(SyntaxError):
        parse_expression("a" + " + a" * 20000)
    with pytest.raises(SyntaxError):
        parse_module("def f(:")
