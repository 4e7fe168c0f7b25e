"""Optional packages: imported where they are used, and missed in words a user can act on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from osimlite.errors import MissingDependency


@cache
def absent(*packages: str) -> tuple[str, ...]:
    """Those of some packages that are not installed."""
    return tuple(name for name in packages if find_spec(name) is None)


def require(module: str, *, extra: str, purpose: str, instead: str = "") -> ModuleType:
    """Import an optional package, or say which extra of osimlite brings it.

    Args:
        module: name to import, e.g. ``"numpy"`` or ``"matplotlib.pyplot"``.
        extra: the extra of osimlite that installs it, e.g. ``"sim"``.
        purpose: what it is needed for, as the subject of a sentence: ``"the PyBullet engine"``.
        instead: what does as well without it, if anything does.

    Raises:
        MissingDependency: the package is absent, or present and cannot be loaded.
    """
    package = module.partition(".")[0]
    if (loaded := sys.modules.get(module)) is not None:
        return loaded
    cure = (f"take {instead}, or " if instead else "") + f"run: pip install 'osimlite[{extra}]'"
    try:
        with leave_current_folder():
            return import_module(module)
    except ModuleNotFoundError as error:
        if error.name == package:
            raise MissingDependency(
                f"{purpose} needs {package}, which is not installed; {cure}"
            ) from error
        raise MissingDependency(
            f"{purpose} needs {package}, which is installed without its own dependency {error.name}; {cure}"
        ) from error
    except ImportError as error:
        raise MissingDependency(
            f"{purpose} needs {package}, which is installed but cannot be loaded ({error}); reinstall it, or {cure}"
        ) from error


SAFE_PATH = "PYTHONSAFEPATH"
"""Environment variable by which Python finds no modules in the folder that it is started in."""


def protect_processes() -> None:
    """Let no Python process that this one starts find modules in the current folder.

    The folder may be a stranger's, and packages start processes of their own: glfw, which mujoco
    imports, runs `python -c` without `-P`.
    """
    os.environ.setdefault(SAFE_PATH, "1")


@contextmanager
def leave_current_folder() -> Iterator[None]:
    """Work from the folder of this package, for the time of an import.

    Some look for files in the current folder while they are loaded: glfw for libraries, numba for
    `.numba_config.yaml`, matplotlib for `matplotlibrc`.
    """
    before = os.environ.get(SAFE_PATH)
    try:
        folder = os.getcwd()
    except OSError:
        # It was removed, so that nothing is in it.
        yield
        return
    os.environ[SAFE_PATH] = "1"
    path = list(sys.path)
    # An empty entry stands for the current folder.
    away = [os.path.abspath(entry) for entry in path if entry not in ("", ".")]
    sys.path[:] = away
    os.chdir(Path(__file__).parent)
    try:
        yield
    finally:
        os.chdir(folder)
        sys.path[:] = [*(entry for entry in sys.path if entry not in away), *path]
        if before is None:
            del os.environ[SAFE_PATH]
