"""What makes the laws fit to be interpreted and compiled from the same source."""

from __future__ import annotations

import dis
import inspect
import math
from importlib import import_module
from pkgutil import iter_modules
from typing import get_type_hints

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


BUILT_IN = {"ValueError", "abs", "bool", "float", "max", "min", "range"}


def is_tuple_of_numbers(value):
    return inspect.isclass(value) and issubclass(value, tuple) and value.__module__.startswith(forces.__name__)


@pytest.mark.parametrize("law", LAWS)
def test_stands_alone(law):
    """A function that closes over nothing, and that calls none but laws and those of `math`, can be compiled."""
    for name in {item.argval for item in dis.get_instructions(law) if item.opname == "LOAD_GLOBAL"} - BUILT_IN:
        value = law.__globals__[name]
        if inspect.isfunction(value):
            assert value.__module__.startswith(forces.__name__)
        else:
            assert vars(math).get(name) is value or isinstance(value, (float, int)) or is_tuple_of_numbers(value)
    assert not law.__code__.co_freevars and not law.__code__.co_cellvars


@pytest.mark.parametrize("law", LAWS)
def test_takes_and_gives_scalars(law):
    """Or named tuples of them."""
    tuples = {name for name, value in law.__globals__.items() if is_tuple_of_numbers(value)}
    for name in tuples:
        assert set(get_type_hints(law.__globals__[name]).values()) <= {float, bool}
    assert {p.annotation for p in inspect.signature(law).parameters.values()} <= {"float", "bool", *tuples}
    returned = inspect.signature(law).return_annotation
    assert set(returned.removeprefix("tuple[").removesuffix("]").split(", ")) <= {"float", "bool", *tuples}
