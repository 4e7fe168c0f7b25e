"""Which laws there are, and which kernels make what pushes out of which element.

A law is compiled when the first model that has it is made ready, and kept; the evaluation calls it by its address. A
new kind of force is a law in a module of its own, a line in each of the tables here, and a function that packs it.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

LAW_MODULES = {
    "evaluate": "dynamics",
    "run_several": "merson",
    "contact_places": "places",
    "place_ball": "balls",
    "move_ball": "balls",
    "place_drift": "drifts",
    "move_drift": "drifts",
    "hold": "hold",
    "project": "projection",
    "prescribe": "bonds",
    "couple": "bonds",
    "bind_bodies": "bonds",
    "amount_by_one": "functions",
    "amount_by_several": "functions",
    "amount_by_arc": "arcs",
    "touch_spheres": "contacts",
    "touch_ellipsoid": "rare_contacts",
    "touch_ellipsoids": "rare_contacts",
    "early_return": "rare_contacts",
    "touch_mesh": "meshes",
    "limit_power": "springs",
    "coordinate_spring": "springs",
    "point_spring": "springs",
    "bushing": "springs",
    "smooth_contact": "springs",
    "station_contact": "springs",
    "path_spring": "paths",
    "ligament": "paths",
    "blankevoort": "paths",
    "coordinate_formula": "programs",
    "point_formula": "programs",
    "path_formula": "programs",
    "bushing_formula": "programs",
    "drive": "drives",
    "path_drive": "drives",
    "prescribed": "drives",
}
"""The module of each law. The first two are no items: their numbers are those of the laws within the evaluation."""

LAW_NUMBERS = {name: number for number, name in enumerate(LAW_MODULES)}
"""Place of a law's address after `layout.LAWS`."""

PACKERS = {
    "HuntCrossley": ("pack_contacts", "pack_pairs"),
    "EllipsoidContact": ("pack_contacts", "pack_pairs"),
    "ElasticFoundation": ("pack_contacts", "pack_foundation"),
    "CoordinateLimit": ("pack_contacts", "pack_limit"),
    "CoordinateSpring": ("pack_springs", "pack_coordinate_spring"),
    "CoordinateFormula": ("pack_springs", "pack_coordinate_formula"),
    "PointSpring": ("pack_springs", "pack_point_spring"),
    "Bushing": ("pack_springs", "pack_bushing"),
    "StationContact": ("pack_springs", "pack_station_contact"),
    "SmoothContact": ("pack_springs", "pack_smooth_contact"),
    "PathSpringElement": ("pack_springs", "pack_path_spring"),
    "PathFormula": ("pack_springs", "pack_path_formula"),
    "LigamentElement": ("pack_springs", "pack_ligament"),
    "Blankevoort": ("pack_springs", "pack_blankevoort"),
    "PathDrive": ("pack_drives", "pack_path_drive"),
    "McKibben": ("pack_drives", "pack_path_drive"),
    "CoordinateDrive": ("pack_drives", "pack_coordinate_drive"),
    "TorqueDrive": ("pack_drives", "pack_torque_drive"),
    "PointDrive": ("pack_drives", "pack_point_drive"),
    "PointToPointDrive": ("pack_drives", "pack_point_to_point_drive"),
    "IdleActuator": ("pack_drives", "pack_idle"),
    "Prescribed": ("pack_drives", "pack_prescribed"),
    "ExternalLoad": ("pack_drives", "pack_external_load"),
}
"""Module and function that pack each class of elements."""


def law_function(name: str) -> Callable[..., Any]:
    """The function of a law."""
    function: Callable[..., Any] = getattr(import_module(f"{__package__}.{LAW_MODULES[name]}"), name)
    return function
