"""Engines: programs that compute accelerations, each behind the same protocol, each in a module of its own."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from osimlite._require import require
from osimlite.errors import OsimliteError
from osimlite.text import or_known

if TYPE_CHECKING:
    from osimlite.simulation.engines.protocol import EngineFactory

require("numpy", extra="sim", purpose="a simulation")

ENGINES = {
    "bullet": "osimlite.simulation.engines.bullet.engine",
    "compiled": "osimlite.simulation.engines.compiled",
}
"""Module of each engine, whose `make` makes one."""


AUTO = "auto"
"""Stands for bullet where pybullet is installed, for compiled elsewhere."""


def engine_name(name: str) -> str:
    """The engine of that name, or the one that "auto" stands for here.

    Raises:
        OsimliteError: there is no engine of that name.
    """
    if name == AUTO:
        return "bullet" if find_spec("pybullet") is not None else "compiled"
    if name not in ENGINES:
        raise OsimliteError(f"there is no engine '{name}'{or_known(name, [*ENGINES, AUTO])}")
    return name


def engine_factory(name: str) -> EngineFactory:
    """The function that makes an engine.

    Raises:
        OsimliteError: there is no engine of that name.
        MissingDependency: the package it works with is not installed.
    """
    return import_module(ENGINES[engine_name(name)]).make
