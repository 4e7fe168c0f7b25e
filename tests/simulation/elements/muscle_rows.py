"""Model of one muscle between ground and a block on a slider, and tables of what OpenSim 4.6 computes for it."""

from __future__ import annotations

import csv
import gzip
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from osimlite import Model
from osimlite.schema.controller_types import PrescribedController
from osimlite.schema.paths import GeometryPath, PathPoint
from osimlite.schema.registry import find_class
from osimlite.schema.splines import PiecewiseLinearFunction
from tests.simple_models import make_slide

FOLDER = Path(__file__).resolve().parents[3] / "fixtures" / "muscles"
# Class and properties of the muscle of each case, from which the tables were computed.
CONFIGURATIONS: dict[str, Any] = json.loads((FOLDER / "configurations.json").read_text())
# Values of the properties NAMES for cases that do not set them (N, m, m, rad, optimal fiber lengths
# per s).
USUAL = {"F": 546.0, "lo": 0.0535, "lt": 0.272, "pen": 0.1, "v": 10.0}
NAMES = {
    "F": "max_isometric_force",
    "lo": "optimal_fiber_length",
    "lt": "tendon_slack_length",
    "pen": "pennation_angle_at_optimal",
    "v": "max_contraction_velocity",
}
# Mass of the block (kg).
MASS = 20.0


def table(name: str, case: str) -> list[dict[str, str]]:
    """Return the rows of a case in a table."""
    with gzip.open(FOLDER / f"{name}.csv.gz", "rt") as file:
        return [row for row in csv.DictReader(file) if row["case"] == case]


def muscle(case: str, **more: Any) -> Any:
    """Return the muscle of a case with the path of `line`; `more` sets further properties."""
    settings = CONFIGURATIONS[case]
    base = {NAMES[name]: value for name, value in {**USUAL, **settings["base"]}.items()}
    own = {name: value for name, value in settings.items() if name not in ("cls", "base")}
    component: Any = find_class(settings["cls"])
    return component(name="mu", geometry_path=line(), **{**base, **own, **more})


def line() -> GeometryPath:
    """Return a path whose length is the coordinate of the block."""
    path = GeometryPath(name="path")
    for name, frame in (("a", "/ground"), ("b", "/bodyset/block")):
        path.path_point_set.objects.append(PathPoint(name=name, socket_parent_frame=frame))
    return path


def hung(force: Any, excitations: Sequence[float] = (0.0,), gravity: float = 0.0) -> Model:
    """Return the model with a muscle.

    Args:
        force: the muscle.
        excitations: excitation at the times 0, 1, 2 ... s.
        gravity: gravity along the slider (m/s²).
    """
    model = make_slide(force, name="one", body="block", mass=MASS, gravity=(gravity, 0.0, 0.0))
    brain = PrescribedController(name="brain", socket_actuators=(f"/forceset/{force.name}",))
    times = tuple(map(float, range(len(excitations) + 1)))
    brain.ControlFunctions.objects.append(PiecewiseLinearFunction(x=times, y=(*excitations, 0.0)))
    model.add(brain)
    return model
