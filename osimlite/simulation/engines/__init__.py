"""Engines: programs that compute accelerations, each behind the same protocol, each in a module of its own."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from osimlite.errors import OsimliteError
from osimlite.text import or_known

if TYPE_CHECKING:
    from osimlite.simulation.engines.protocol import EngineFactory

ENGINES = {
    "bullet": "osimlite.simulation.engines.bullet",
    "compiled": "osimlite.simulation.engines.compiled",
}
"""Module of each engine, whose `make` makes one."""


def engine_factory(name: str) -> EngineFactory:
    """The function that makes an engine.

    Raises:
        OsimliteError: there is no engine of that name.
        MissingDependency: the package it works with is not installed.
    """
    if name not in ENGINES:
        raise OsimliteError(f"there is no engine '{name}'{or_known(name, ENGINES)}")
    make: EngineFactory = import_module(ENGINES[name]).make
    return make
