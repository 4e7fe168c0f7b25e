"""Engines: programs that compute accelerations, one module each, behind the protocol of :mod:`.protocol`."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import TYPE_CHECKING

from osimlite.base.require import require
from osimlite.base.text import suggest_or_list
from osimlite.errors import DeprecatedWarning, OsimliteError

if TYPE_CHECKING:
    from osimlite.simulation.engines.protocol import EngineFactory

require("numpy", extra="sim", purpose="a simulation")

ENGINES = {
    "bullet": "osimlite.simulation.engines.bullet.engine",
    "compiled": "osimlite.simulation.engines.compiled",
}
"""Module of each engine, whose `make_engine` makes one."""


DEFAULT_ENGINE = "compiled"
"""Engine that is used if none is selected, whatever packages are installed."""

DEPRECATED_NAME = "auto"
"""Earlier name of the default: PyBullet where it was installed, so that results depended on that."""


def engine_name(name: str | None = None) -> str:
    """Return the name of an engine: the default for None and, with a warning, for the deprecated "auto".

    Raises:
        OsimliteError: there is no engine of that name.
    """
    if name is None:
        return DEFAULT_ENGINE
    if name == DEPRECATED_NAME:
        warnings.warn(
            f"engine '{DEPRECATED_NAME}' is deprecated: it means '{DEFAULT_ENGINE}', the default; "
            "leave it out, or select 'bullet'",
            DeprecatedWarning,
            stacklevel=3,
        )
        return DEFAULT_ENGINE
    if name not in ENGINES:
        raise OsimliteError(f"there is no engine '{name}'{suggest_or_list(name, [*ENGINES])}")
    return name


def engine_factory(name: str | None = None) -> EngineFactory:
    """Return the function that makes an engine, the default one for None.

    Raises:
        OsimliteError: there is no engine of that name.
        MissingDependency: the package it works with is not installed.
    """
    return import_module(ENGINES[engine_name(name)]).make_engine
