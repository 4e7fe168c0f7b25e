"""From the mechanism to the formats of other programs, with an account of what they cannot say."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.translate.export import Urdf as Urdf
    from osimlite.translate.export import to_urdf as to_urdf
    from osimlite.translate.fidelity import Fidelity as Fidelity
    from osimlite.translate.robot import Robot as Robot
    from osimlite.translate.robot import build_robot as build_robot

_PUBLIC = {"Urdf": "export", "to_urdf": "export", "Fidelity": "fidelity", "Robot": "robot", "build_robot": "robot"}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'osimlite.translate' has no attribute '{name}'")
    return getattr(import_module(f"osimlite.translate.{_PUBLIC[name]}"), name)
