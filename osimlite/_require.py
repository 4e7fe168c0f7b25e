"""Optional packages: imported where they are used, and missed in words a user can act on."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from importlib.util import find_spec
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
    cure = (f"take {instead}, or " if instead else "") + f"run: pip install 'osimlite[{extra}]'"
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name == package:
            raise MissingDependency(f"{purpose} needs {package}, which is not installed; {cure}") from error
        raise MissingDependency(
            f"{purpose} needs {package}, which is installed without its own dependency {error.name}; {cure}"
        ) from error
    except ImportError as error:
        raise MissingDependency(
            f"{purpose} needs {package}, which is installed but cannot be loaded ({error}); reinstall it, or {cure}"
        ) from error
