"""What makes the laws fit to be interpreted and compiled from the same source."""

from __future__ import annotations

import inspect

import pytest

from osimlite.forces import coordinate_limit, hunt_crossley

ITERATES_OVER_A_LAW = {"contact_forces", "simbody_pair_order"}
LAWS = [
    pytest.param(function, id=name)
    for module in (hunt_crossley, coordinate_limit)
    for name, function in inspect.getmembers(module, inspect.isfunction)
    if function.__module__ == module.__name__ and name not in ITERATES_OVER_A_LAW
]


def test_all_laws_are_here():
    assert len(LAWS) == 10


@pytest.mark.parametrize("law", LAWS)
def test_stands_alone(law):
    """A function that calls no other one and closes over nothing can be compiled by itself."""
    assert set(law.__code__.co_names) <= {"sqrt", "pi", "ValueError"}
    assert not law.__code__.co_freevars and not law.__code__.co_cellvars


@pytest.mark.parametrize("law", LAWS)
def test_takes_and_gives_scalars(law):
    allowed = {"float", "bool"}
    assert {p.annotation for p in inspect.signature(law).parameters.values()} <= allowed
    returned = inspect.signature(law).return_annotation
    assert set(returned.removeprefix("tuple[").removesuffix("]").split(", ")) == {"float"}
