"""Translation of models to formats of other programs, with an account of what these cannot express."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.base.lazy import make_lazy_getattr

if TYPE_CHECKING:
    from osimlite.simulation.robot.build import build_robot as build_robot
    from osimlite.simulation.robot.robot import Robot as Robot
    from osimlite.translate.export import Urdf as Urdf
    from osimlite.translate.export import to_urdf as to_urdf
    from osimlite.translate.fidelity import Fidelity as Fidelity
    from osimlite.translate.mjcf.export import Mjcf as Mjcf
    from osimlite.translate.mjcf.export import to_mjcf as to_mjcf
    from osimlite.translate.mjcf_import.convert import Osim as Osim
    from osimlite.translate.mjcf_import.convert import from_mjcf as from_mjcf

__getattr__ = make_lazy_getattr(
    __name__,
    {
        "Fidelity": "osimlite.translate.fidelity",
        "Mjcf": "osimlite.translate.mjcf.export",
        "Osim": "osimlite.translate.mjcf_import.convert",
        "Robot": "osimlite.simulation.robot.robot",
        "Urdf": "osimlite.translate.export",
        "build_robot": "osimlite.simulation.robot.build",
        "from_mjcf": "osimlite.translate.mjcf_import.convert",
        "to_mjcf": "osimlite.translate.mjcf.export",
        "to_urdf": "osimlite.translate.export",
    },
)
