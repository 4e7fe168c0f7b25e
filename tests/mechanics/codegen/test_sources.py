"""Tests of the digest that decides when a law is compiled anew.

A law is compiled anew when its code, a function that it calls, or a number that it uses changes,
but not for comments and layout.
"""

from __future__ import annotations

import inspect
import linecache
from textwrap import dedent

import pytest

from osimlite.mechanics.codegen.sources import compute_digest
from osimlite.mechanics.kernels import constrained_dynamics, linear_algebra, pointers
from osimlite.mechanics.kernels.table import LAW_MODULES
from osimlite.simulation.elements.laws import find_function


def digests():
    compute_digest.cache_clear()
    return {name: compute_digest(find_function(name)) for name in LAW_MODULES}


@pytest.fixture
def changed(monkeypatch):
    """Yield a function that edits a module and returns the names of the laws whose digest changes."""
    before = digests()

    def edit(module, name, value):
        monkeypatch.setattr(module, name, value)
        after = digests()
        return {law for law in before if before[law] != after[law]}

    yield edit
    compute_digest.cache_clear()


def edited(function, old, new):
    """Return a copy of a function with one replacement in its text."""
    text = dedent(inspect.getsource(function))
    assert old in text
    text, file = text.replace(old, new), f"<edited {new}>"
    linecache.cache[file] = len(text), None, text.splitlines(keepends=True), file
    made = {}
    exec(compile(text, file, "exec"), function.__globals__, made)
    copy = made[function.__name__]
    copy.__module__ = function.__module__
    return copy


def test_an_edited_function_concerns_those_that_call_it(changed):
    reflect = linear_algebra.apply_reflection
    result = changed(linear_algebra, "apply_reflection", edited(reflect, "0.0", "0.5"))
    # The function `project` calls these laws by address.
    paths = {"cable_path", "geodesic_path"}
    searches = {"fit_frames", "assemble_poses"}
    assert result == {
        *paths,
        *searches,
        "factorise_law",
        "minimum_norm_law",
        "constrained_dynamics",
    }


def test_a_changed_number_concerns_those_that_use_it(changed):
    assert changed(constrained_dynamics, "SAFE_MASS", 2.0 * constrained_dynamics.SAFE_MASS) == {
        "constrained_dynamics"
    }


def test_words_and_layout_concern_nobody(changed):
    reflect = linear_algebra.apply_reflection
    document = reflect.__doc__
    moved = edited(
        reflect, f'"""{document}"""', '"""Other words."""\n    # A comment, and an empty line.\n'
    )
    assert not changed(linear_algebra, "apply_reflection", moved)


def test_the_settings_of_a_translator_concern_all():
    function = find_function("evaluate")
    assert compute_digest(function, "one") != compute_digest(function, "other")


def test_what_a_process_keeps_concerns_nobody(changed):
    assert not changed(pointers, "laws", {7: len})


def test_every_law_differs():
    assert len(set(digests().values())) == len(LAW_MODULES)
