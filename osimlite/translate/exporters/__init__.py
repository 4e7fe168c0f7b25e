"""What a model can be written as, for other programs and for people: one module each, which is found by being here.

A module declares `EXPORTER` and imports what it works with in its function: all of them are loaded
to tell what there is.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from osimlite.base.choices import Choice
from osimlite.base.records import dataclass


@dataclass(frozen=True)
class Exporter:
    """A format."""

    # of the format in `osimlite translate --to`, or of the option of `osimlite view` that names the
    # file
    name: str
    command: str  # "translate" or "view"
    help: str  # what is written
    # of "translate" a function of a model and its choices as `to_urdf`, which returns what has
    # `write`, `fidelity` and `robot` as that of `Urdf`; of "view" a function of a `Shown`, a path
    # and the choices, which writes the file and says what it wrote
    write: Callable[..., Any]
    choices: tuple[Choice, ...] = ()  # that it has besides
    usual: bool = False  # whether it is taken if none is named


@cache
def exporters(command: str) -> dict[str, Exporter]:
    """The exporters of a command by name, the usual one first."""
    result = [
        import_module(f"{__name__}.{module.name}").EXPORTER for module in iter_modules(__path__)
    ]
    result.sort(key=lambda each: not each.usual)
    return {each.name: each for each in result if each.command == command}
