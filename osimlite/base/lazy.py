"""What is imported when it is first used, so that importing the package costs nothing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def imported_when_used(package: str, modules: Mapping[str, str]) -> Callable[[str], Any]:
    """What a package takes as its ``__getattr__``.

    Args:
        package: its name.
        modules: by the name of what is offered, the module that it is in.
    """

    def get(name: str) -> Any:
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(modules[name]), name)

    return get


def shown_in_notebooks(by: str) -> Callable[[Any], str]:
    """What a class takes as its ``_repr_html_``, by which Jupyter shows objects of it.

    Args:
        by: name of the function in :mod:`osimlite.view.notebook` that says it in HTML.
    """

    def _repr_html_(self: Any) -> str:
        return getattr(import_module("osimlite.view.notebook"), by)(self)

    return _repr_html_
