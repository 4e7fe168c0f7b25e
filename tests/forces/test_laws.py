"""What makes the laws fit to be interpreted and compiled from the same source."""

from __future__ import annotations

import inspect
import math
from importlib import import_module
from pkgutil import iter_modules

import pytest

from osimlite import forces

ITERATES_OVER_A_LAW = {"contact_forces", "simbody_pair_order"}
MODULES = [import_module(f"osimlite.forces.{item.name}") for item in iter_modules(forces.__path__)]
LAWS = [
    pytest.param(function, id=f"{module.__name__.rpartition('.')[2]}.{name}")
    for module in MODULES
    for name, function in inspect.getmembers(module, inspect.isfunction)
    if function.__module__ == module.__name__ and name not in ITERATES_OVER_A_LAW
]


def test_all_laws_are_here():
    assert len(MODULES) >= 3 and len(LAWS) >= 19


@pytest.mark.parametrize("law", LAWS)
def test_stands_alone(law):
    """A function that calls none but those of its module and closes over nothing can be compiled with them."""
    beside = {name for name, _ in inspect.getmembers(inspect.getmodule(law), inspect.isfunction)}
    assert set(law.__code__.co_names) <= {*vars(math), *beside, "ValueError", "abs"}
    assert not law.__code__.co_freevars and not law.__code__.co_cellvars


@pytest.mark.parametrize("law", LAWS)
def test_takes_and_gives_scalars(law):
    allowed = {"float", "bool"}
    assert {p.annotation for p in inspect.signature(law).parameters.values()} <= allowed
    returned = inspect.signature(law).return_annotation
    assert set(returned.removeprefix("tuple[").removesuffix("]").split(", ")) == {"float"}
