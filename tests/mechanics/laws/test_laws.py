"""Tests that laws can be interpreted and compiled from the same source."""

from __future__ import annotations

import dis
import inspect
import math
from collections.abc import Sequence
from importlib import import_module
from pkgutil import iter_modules
from typing import get_type_hints

from osimlite.mechanics import kernels
from osimlite.mechanics import laws as forces
from osimlite.simulation.elements.force_type import ForceType
from osimlite.simulation.elements.registry import FORCE_TYPES
from tests.cases import of_each

BUILT_IN = {"abs", "bool", "float", "int", "max", "min", "range"}
SCALARS = {"bool", "float", "int"}
TRIPLES = {"Vector", "Axes"}
TABLES = {"Sequence[float]", "Numbers"}


def is_of_forces(value):
    return getattr(value, "__module__", "").startswith(f"{forces.__name__}.")


def globals_of(function):
    """Return the objects that a function uses by name, except built-in ones."""
    names = {
        item.argval for item in dis.get_instructions(function) if item.opname == "LOAD_GLOBAL"
    } - BUILT_IN
    return {name: function.__globals__[name] for name in names if name in function.__globals__}


def laws():
    """Return the functions that kernels and force types call; other functions prepare numbers or report errors."""
    modules = [
        import_module(f"{kernels.__name__}.{item.name}") for item in iter_modules(kernels.__path__)
    ]
    pending = [
        function
        for module in modules
        for _, function in inspect.getmembers(module, inspect.isfunction)
    ]
    for kind in (kind for kind in FORCE_TYPES if isinstance(kind, ForceType)):
        own = kind.law, kind.equilibrium, *kind.geometry.called_functions
        pending += [law for law in own if law is not None]
    result = set()
    while pending:
        function = pending.pop()
        if function not in result:
            result.add(function)
            # Names of attributes are among these, but no function has such a name; disassembling
            # all kernels takes a hundred times as long.
            pending += [
                value
                for value in map(function.__globals__.get, function.__code__.co_names)
                if inspect.isfunction(value) and value.__module__.startswith("osimlite.")
            ]
    return sorted(filter(is_of_forces, result), key=lambda law: (law.__module__, law.__name__))


LAWS = laws()


def test_all_laws_are_here():
    assert len(LAWS) >= 40


@of_each(LAWS, lambda law: f"{law.__module__}.{law.__name__}")
def test_stands_alone(law):
    """A function without closure that calls only laws and functions of `math` can be compiled."""
    for name, value in globals_of(law).items():
        assert (
            is_of_forces(value)
            or vars(math).get(name) is value
            or isinstance(value, float | int | tuple)
        ), name
    assert not law.__code__.co_freevars and not law.__code__.co_cellvars


@of_each(LAWS, lambda law: f"{law.__module__}.{law.__name__}")
def test_takes_and_gives_scalars(law):
    """Types are scalars, triples, tables of numbers, and named tuples of scalars or of tables."""
    named = {
        name: value
        for name, value in law.__globals__.items()
        if inspect.isclass(value) and is_of_forces(value)
    }
    for value in named.values():
        assert set(get_type_hints(value).values()) in ({float}, {bool, float}, {Sequence[float]})
    known = {*SCALARS, *TRIPLES, *named}
    assert {p.annotation for p in inspect.signature(law).parameters.values()} <= {*known, *TABLES}
    returned = inspect.signature(law).return_annotation
    assert set(returned.removeprefix("tuple[").removesuffix("]").split(", ")) <= {*known, "None"}
