"""When a law is compiled anew: when it, or what it calls, or a number that it uses has changed; not for words."""

from __future__ import annotations

from types import FunctionType

import pytest

from osimlite.codegen.sources import compute_digest
from osimlite.kernels import constrained_dynamics, least_squares, pointers
from osimlite.kernels.table import LAW_MODULES
from osimlite.simulation.elements.laws import law_function
from osimlite.simulation.engines import machine_code


def digests():
    compute_digest.cache_clear()
    return {name: machine_code.digest_of(law_function(name)) for name in LAW_MODULES}


@pytest.fixture
def changed(monkeypatch):
    """Names of the laws whose digest an edit changes."""
    before = digests()

    def edit(module, name, value):
        monkeypatch.setattr(module, name, value)
        after = digests()
        return {law for law in before if before[law] != after[law]}

    yield edit
    compute_digest.cache_clear()


def edited(function, **parts):
    code = function.__code__.replace(**parts)
    copy = FunctionType(code, function.__globals__, function.__name__, function.__defaults__)
    copy.__annotations__, copy.__module__ = function.__annotations__, function.__module__
    return copy


def test_an_edited_function_concerns_those_that_call_it(changed):
    reflect = least_squares.reflect
    constants = tuple(0.5 if item == 0.0 else item for item in reflect.__code__.co_consts)
    result = changed(least_squares, "reflect", edited(reflect, co_consts=constants))
    # `project` solves by the addresses of these laws.
    paths = {"cable_path", "geodesic_path"}
    searches = {"fit_frames", "assemble_poses"}
    assert result == {*paths, *searches, "factorise_law", "minimum_norm_law", "constrained_dynamics"}


def test_a_changed_number_concerns_those_that_use_it(changed):
    assert changed(constrained_dynamics, "SAFE_MASS", 2.0 * constrained_dynamics.SAFE_MASS) == {"constrained_dynamics"}


def test_words_and_places_concern_nobody(changed):
    reflect = least_squares.reflect
    words = ("Other words.", *reflect.__code__.co_consts[1:])
    moved = edited(reflect, co_consts=words, co_firstlineno=7)
    moved.__doc__ = words[0]
    assert not changed(least_squares, "reflect", moved)


def test_the_settings_of_the_compiler_concern_all(changed, monkeypatch):
    monkeypatch.setattr(machine_code, "read_settings", lambda: "other")
    assert changed(constrained_dynamics, "SAFE_MASS", constrained_dynamics.SAFE_MASS) == set(LAW_MODULES)


def test_what_a_process_keeps_concerns_nobody(changed):
    assert not changed(pointers, "laws", {7: len})


def test_every_law_differs():
    assert len(set(digests().values())) == len(LAW_MODULES)
