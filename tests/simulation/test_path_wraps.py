"""Paths around surfaces, against tables of what OpenSim 4.6 computes."""

from __future__ import annotations

import gzip
import json

import pytest

import osimlite
from osimlite import Body, Model
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import PathPoint, PathWrap
from osimlite.simulation.elements.geometries.paths.geometry_path import LAWS
from tests.conftest import ROOT
from tests.simulation.checked import Checked

SIZES = {kind.__name__.removeprefix("Wrap"): names for kind, (*_, names) in LAWS.items()}
with gzip.open(ROOT / "fixtures" / "forces" / "wrap_cases.json.gz") as file:
    SETUPS = {setup["name"]: setup for setup in json.load(file)}
SETUPS = {
    name: setup
    for name, setup in SETUPS.items()
    if {item["kind"] for item in setup["objects"]} <= SIZES.keys()
}
PATH = "/forceset/p"


def wrapped(setup) -> Model:
    """A path from body A over points and surfaces of body W to body B; each body is free."""
    model = Model(name="wraps")
    bodies = {
        name: model.add(Body(name=name, mass=1.0, inertia=(1, 1, 1, 0, 0, 0))) for name in "ABW"
    }
    for name, body in bodies.items():
        joint = osimlite.FreeJoint(name=f"j{name}")
        for number, coordinate in enumerate(joint.coordinates):
            coordinate.name = f"{name}{number}"
        model.add(joint.between(model.ground, body))
    force = PathActuator(name="p", optimal_force=1.0)
    stations = [("A", (0, 0, 0)), *(("W", station) for station in setup["via"]), ("B", (0, 0, 0))]
    for number, (body, station) in enumerate(stations):
        point = PathPoint(
            name=f"p{number}", socket_parent_frame=f"/bodyset/{body}", location=station
        )
        force.geometry_path.path_point_set.objects.append(point)
    for number, surface in enumerate(setup["objects"]):
        sizes = surface["dimensions"]
        names = SIZES[surface["kind"]]
        made = getattr(osimlite, f"Wrap{surface['kind']}")(
            name=f"w{number}",
            quadrant=surface["quadrant"],
            xyz_body_rotation=surface["xyz_body_rotation"],
            translation=surface["translation"],
            **dict(zip(names, sizes if len(names) == len(sizes) else [sizes], strict=True)),
        )
        bodies["W"].wrap_object_set.objects.append(made)
        wrap = PathWrap(name=f"wrap{number}", wrap_object=made.name, method=surface["method"])
        if surface["range"]:
            wrap.range = tuple(surface["range"])
        force.geometry_path.path_wrap_set.objects.append(wrap)
    model.add(force)
    return model


def compare(paths, case):
    q = [0, 0, 0, *case["p_A"], 0, 0, 0, *case["p_B"], *case["q_W"]]
    u = [0, 0, 0, *case["v_A"], 0, 0, 0, *case["v_B"], *case["u_W"]]
    length, speed = paths.lengths(q)[PATH], paths.speeds(q, u)[PATH]
    arms = paths.moment_arms(q)[PATH]
    forces = [arms.get(info.path, 0.0) for info in paths.mechanism.coordinates]
    expected = [*[0.0] * 3, *case["force_A"], *[0.0] * 3, *case["force_B"], *case["u_force_W"]]
    assert length == pytest.approx(case["length"], rel=0, abs=1e-12, nan_ok=True)
    assert speed == pytest.approx(case["speed"], rel=0, abs=1e-10)
    assert forces == pytest.approx(expected, rel=0, abs=1e-10)


@pytest.mark.parametrize("name", SETUPS)
def test_wrapped(name):
    paths = osimlite.paths(wrapped(SETUPS[name]))
    for case in SETUPS[name]["cases"]:
        compare(paths, case)


@pytest.mark.parametrize(
    "name", [name for name, setup in SETUPS.items() if len(setup["objects"]) > 1]
)
def test_several_as_python(name, monkeypatch):
    """Nothing is read or written outside of what belongs to a path."""
    monkeypatch.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
    paths = osimlite.paths(wrapped(SETUPS[name]))
    for case in SETUPS[name]["cases"][:1]:
        compare(paths, case)
