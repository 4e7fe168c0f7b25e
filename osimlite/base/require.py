"""Import of optional packages, with messages that say how to install them."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType

from osimlite.errors import MissingDependency

DISTRIBUTIONS = {"PIL": "Pillow", "yaml": "PyYAML"}
"""Packages that are installed under another name than that of their import."""


@cache
def find_missing_packages(*packages: str) -> tuple[str, ...]:
    """Return those packages that are not installed.

    Returns:
        Names in the order of the arguments.
    """
    return tuple(name for name in packages if find_spec(name) is None)


def require(module: str, *, extra: str, purpose: str, alternative: str = "") -> ModuleType:
    """Import an optional package, or raise an error that names the extra of osimlite with it.

    Args:
        module: name to import, e.g. ``"numpy"`` or ``"matplotlib.pyplot"``.
        extra: extra of osimlite that installs it, e.g. ``"sim"``.
        purpose: subject of the message "... needs numpy", such as ``"the PyBullet engine"``.
        alternative: alternative that works without it, if any.

    Returns:
        Imported module.

    Raises:
        MissingDependency: the package is not installed, or cannot be loaded.
    """
    package = module.partition(".")[0]
    distribution = DISTRIBUTIONS.get(package, package)
    if (loaded := sys.modules.get(module)) is not None:
        return loaded
    cure = (
        f"use {alternative}, or " if alternative else ""
    ) + f"run: pip install 'osimlite[{extra}]'"
    try:
        with leave_current_folder():
            return import_module(module)
    except ModuleNotFoundError as error:
        if error.name == package:
            raise MissingDependency(
                f"{purpose} needs {distribution}, which is not installed; {cure}"
            ) from error
        raise MissingDependency(
            f"{purpose} needs {distribution}, which is installed without its dependency {error.name}; {cure}"
        ) from error
    except ImportError as error:
        raise MissingDependency(
            f"{purpose} needs {distribution}, which is installed but cannot be loaded ({error}); reinstall it, or {cure}"
        ) from error


SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable that stops Python from importing modules of the current folder."""


def protect_processes() -> None:
    """Stop Python processes that this one starts from importing modules of the current folder.

    The folder can be untrusted, and packages start processes: glfw, which mujoco imports, runs
    `python -c` without `-P`.
    """
    os.environ.setdefault(SAFE_PATH, "1")


@contextmanager
def leave_current_folder() -> Iterator[None]:
    """Change to the folder of this package during an import.

    Some packages search files in the current folder when they are imported: glfw libraries, numba
    `.numba_config.yaml`, matplotlib `matplotlibrc`.
    """
    before = os.environ.get(SAFE_PATH)
    try:
        folder = os.getcwd()
    except OSError:
        # The folder was removed, so that it has no files.
        yield
        return
    os.environ[SAFE_PATH] = "1"
    path = list(sys.path)
    # An empty entry means the current folder.
    away = [os.path.abspath(entry) for entry in path if entry not in ("", ".")]
    sys.path[:] = away
    os.chdir(os.path.dirname(os.path.abspath(__file__)))
    try:
        yield
    finally:
        os.chdir(folder)
        sys.path[:] = [*(entry for entry in sys.path if entry not in away), *path]
        if before is None:
            del os.environ[SAFE_PATH]
