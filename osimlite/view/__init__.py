"""Pictures of models and motions."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.view.animation import animate as animate
    from osimlite.view.plots import plot_simulation as plot_simulation
    from osimlite.view.shown import Shown as Shown

_PUBLIC = {"animate": "animation", "plot_simulation": "plots", "Shown": "shown"}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'osimlite.view' has no attribute '{name}'")
    return getattr(import_module(f"osimlite.view.{_PUBLIC[name]}"), name)
