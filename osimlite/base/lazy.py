"""Imports at first use, so that importing the package is fast."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def make_lazy_getattr(
    package: str, modules: Mapping[str, str], deprecated: Mapping[str, str] | None = None
) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package that imports its names when they are first used.

    Args:
        package: name of the package.
        modules: module of each name that the package offers.
        deprecated: present names by their former ones, whose use warns.
    """

    def get(name: str) -> Any:
        if deprecated is not None and name in deprecated:
            from osimlite.errors import DeprecatedWarning

            present = deprecated[name]
            message = f"{package}.{name} is deprecated; use {package}.{present}"
            warnings.warn(message, DeprecatedWarning, stacklevel=2)
            name = present
        if name not in modules:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(modules[name]), name)

    return get


def make_notebook_repr(function_name: str) -> Callable[[Any], str]:
    """Return the ``_repr_html_`` of a class, by which Jupyter shows its objects.

    Args:
        function_name: name of the function in :mod:`osimlite.view.notebook` that returns the HTML.
    """

    def _repr_html_(self: Any) -> str:
        return getattr(import_module("osimlite.view.notebook"), function_name)(self)

    return _repr_html_


def make_plot(function_name: str) -> Callable[..., Any]:
    """Return the ``plot`` method of a class, which draws its objects by matplotlib.

    Args:
        function_name: name of the function in :mod:`osimlite.view.plotted` that returns the pictures.
    """

    def plot(self: Any, folder: Any = None) -> Any:  # noqa: D417 - `self` is not an argument
        """Draw the columns: left and right in one panel, one unit per axis, twelve panels a page.

        Args:
            folder: folder to write the pages into as PNG; nothing is written without one.

        Returns:
            The pages, which notebooks show: a list with the name and the matplotlib figure of each.

        Raises:
            MissingDependency: matplotlib is not installed.
            OsimliteError: there is no time to draw, or the folder cannot be written.
        """
        pages = getattr(import_module("osimlite.view.plotted"), function_name)(self)
        if folder is not None:
            pages.write(folder)
        return pages

    return plot
