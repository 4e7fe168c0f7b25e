"""From the mechanism to the formats of other programs, with an account of what they cannot say."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.robot.build import build_robot as build_robot
    from osimlite.robot.robot import Robot as Robot
    from osimlite.translate.export import Urdf as Urdf
    from osimlite.translate.export import to_urdf as to_urdf
    from osimlite.translate.fidelity import Fidelity as Fidelity

_PUBLIC = {
    "Urdf": "translate.export",
    "to_urdf": "translate.export",
    "Fidelity": "translate.fidelity",
    "Robot": "robot.robot",
    "build_robot": "robot.build",
}


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'osimlite.translate' has no attribute '{name}'")
    return getattr(import_module(f"osimlite.{_PUBLIC[name]}"), name)
