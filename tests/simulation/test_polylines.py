"""Tests of the corners of paths on surfaces with known curves."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.schema.contact_types import ContactEllipsoid, ContactSphere
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import PathPoint, PathWrap
from tests.simulation.checked import Checked
from tests.simulation.support import LEFT, RIGHT, cable, over


def paths_over(surface, *stations, wrapping):
    """Return the paths of a model with a path through stations of ground, over a surface of ground.

    Args:
        surface: wrap object.
        stations: points of the path (m).
        wrapping: "opensim" or "geodesic".
    """
    model = osimlite.Model(name="over")
    surface.name = "surface"
    model.ground.wrap_object_set.objects.append(surface)
    force = PathActuator(name="p", optimal_force=1.0)
    for number, station in enumerate(stations):
        point = PathPoint(name=f"p{number}", socket_parent_frame="/ground", location=station)
        force.geometry_path.path_point_set.objects.append(point)
    force.geometry_path.path_wrap_set.objects.append(PathWrap(name="wrap", wrap_object="surface"))
    model.add(force)
    return osimlite.paths(model, wrapping)


@pytest.fixture(params=["as it is", "Python"], autouse=True)
def code(request, monkeypatch):
    if request.param == "Python":
        monkeypatch.setattr("osimlite.simulation.polylines.select_code", lambda: Checked("Python"))


SURFACES = {
    "cylinder": (
        osimlite.WrapCylinder(radius=0.05, length=1.0),
        lambda p: np.hypot(p[:, 0], p[:, 1]) / 0.05,
    ),
    "sphere": (osimlite.WrapSphere(radius=0.05), lambda p: np.linalg.norm(p, axis=1) / 0.05),
    "ellipsoid": (
        osimlite.WrapEllipsoid(dimensions=(0.05, 0.06, 0.04)),
        lambda p: np.linalg.norm(p / (0.05, 0.06, 0.04), axis=1),
    ),
    "torus": (
        osimlite.WrapTorus(inner_radius=0.02, outer_radius=0.06),
        lambda p: np.hypot(np.hypot(p[:, 0], p[:, 1]) - 0.06, p[:, 2]) / 0.02,
    ),
}


@pytest.mark.parametrize("wrapping", ["opensim", "geodesic"])
@pytest.mark.parametrize("name", SURFACES)
def test_corners_on_a_surface_are_on_it(name, wrapping):
    surface, level = SURFACES[name]
    ends = (-0.08, -0.01, 0.02), (0.08, -0.02, -0.03)
    if name == "torus":
        ends = (0.08, 0.01, 0.1), (0.075, -0.02, -0.15)
    paths = paths_over(surface.model_copy(deep=True), *ends, wrapping=wrapping)
    corners = paths.polylines({})["/forceset/p"]
    assert len(corners) > 6 and corners[[0, -1]].tolist() == [list(end) for end in ends]
    # As in OpenSim, tangent points are only near the ellipsoid, and the tube of the torus is
    # straight there.
    near = {"ellipsoid": 1e-4, "torus": 1e-3}.get(name, 1e-12) if wrapping == "opensim" else 1e-9
    assert level(corners[1:-1]) == pytest.approx(1.0, abs=near)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    assert length == pytest.approx(paths.lengths({})["/forceset/p"], rel=1e-3)


@pytest.mark.parametrize(
    "surface", [ContactSphere(radius=0.1), ContactEllipsoid(radii=(0.1, 0.1, 0.1))]
)
def test_a_cable_runs_over_what_it_touches(surface):
    paths = osimlite.paths(
        cable(LEFT, over((0.0, 0.1, 0.0)), RIGHT, surface=surface.model_copy(deep=True))
    )
    corners = paths.polylines({})["/forceset/s"]
    assert len(corners) > 6 and corners[[0, -1]] == pytest.approx(
        np.array([(-0.3, 0.01, 0), (0.3, 0.01, 0)])
    )
    assert np.linalg.norm(corners[1:-1], axis=1) == pytest.approx(0.1, abs=1e-9)
    length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
    assert length == pytest.approx(paths.lengths({})["/forceset/s"], rel=1e-3)
    ends = paths.mechanism.values({"x": 3.0})
    assert paths.polylines(ends)["/forceset/s"][-1] == pytest.approx((3.3, 0.01, 0.0))
