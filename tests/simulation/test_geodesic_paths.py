"""Tests of paths along geodesics of surfaces: known lengths, and derivatives of the length."""

from __future__ import annotations

from math import acos, hypot, pi, sqrt

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError
from tests.simulation.checked import Checked
from tests.simulation.support import PATH, SETUPS, wrapped
from tests.suite import choose

integrate = pytest.importorskip("scipy.integrate")


def surface(kind, sizes, quadrant="all"):
    still = {
        "xyz_body_rotation": (0, 0, 0),
        "translation": (0, 0, 0),
        "method": "hybrid",
        "range": None,
    }
    return {"kind": kind, "dimensions": sizes, "quadrant": quadrant, **still}


def around(*surfaces, via=()):
    return osimlite.paths(wrapped({"via": via, "objects": surfaces}), wrapping="geodesic")


def length(paths, first, second):
    return paths.lengths([0, 0, 0, *first, 0, 0, 0, *second, *[0] * 6])[PATH]


def over_circle(first, second, radius):
    """Return the length of the shorter path around a circle about the origin, in its plane."""
    d1, d2 = hypot(*first), hypot(*second)
    angle = acos(np.dot(first, second) / d1 / d2) - acos(radius / d1) - acos(radius / d2)
    return sqrt(d1**2 - radius**2) + sqrt(d2**2 - radius**2) + radius * angle


def test_helix_on_a_cylinder():
    paths = around(surface("Cylinder", [0.03, 1.0]))
    flat = over_circle((-0.1, 0.01), (0.12, 0.005), 0.03)
    assert length(paths, (-0.1, 0.01, 0.0), (0.12, 0.005, 0.07)) == pytest.approx(
        hypot(flat, 0.07), rel=1e-14
    )


def test_great_circle_on_a_sphere():
    paths = around(surface("Sphere", [0.03]))
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    first, second = turn[:, :2] @ (-0.1, 0.01), turn[:, :2] @ (0.12, 0.005)
    assert length(paths, first, second) == pytest.approx(
        over_circle((-0.1, 0.01), (0.12, 0.005), 0.03), rel=1e-14
    )


def test_meridian_of_a_torus():
    """In a plane through the axis of the torus, the path wraps around the tube as around a circle."""
    paths = around(surface("Torus", [0.02, 0.1]))
    inner = over_circle((-0.01, -0.1), (-0.01, 0.12), 0.02)
    assert length(paths, (0.09, 0.0, -0.1), (0.09, 0.0, 0.12)) == pytest.approx(inner, rel=1e-12)


def test_ellipse_of_an_ellipsoid():
    """In a plane of symmetry, the path consists of tangents of an ellipse and its arc."""
    a, b = 0.05, 0.03
    paths = around(surface("Ellipsoid", [a, b, 0.06]))
    # From (-d, 0) the tangent touches where cos t = -a / d.
    t = acos(-a / 0.1)
    line = hypot(0.1 + a * np.cos(t), b * np.sin(t))
    arc, _ = integrate.quad(lambda t: hypot(a * np.sin(t), b * np.cos(t)), pi - t, t, epsabs=1e-14)
    assert length(paths, (-0.1, 1e-13, 0.0), (0.1, 1e-13, 0.0)) == pytest.approx(
        2 * line + arc, rel=1e-11
    )


def test_ellipsoid_against_another_integrator():
    """The lines from both ends must be tangent to one geodesic, which SciPy integrates."""
    weights = np.array((0.03, 0.05, 0.04)) ** -2
    first, second = np.array((-0.08, 0.01, 0.03)), np.array((0.09, 0.01, -0.02))

    def rates(_, y):
        normal = weights * y[:3]
        return [*y[3:], *(-(weights @ y[3:] ** 2) / (normal @ normal) * normal)]

    paths = around(surface("Ellipsoid", (weights**-0.5).tolist()))
    (_, start), (_, end) = paths.points([0, 0, 0, *first, 0, 0, 0, *second, *[0] * 6])[PATH][1:3]
    before, after = start - first, second - end
    arc = length(paths, first, second) - np.linalg.norm(before) - np.linalg.norm(after)
    y = [*start, *(before / np.linalg.norm(before))]
    result = integrate.solve_ivp(rates, (0.0, arc), y, method="DOP853", rtol=1e-12, atol=1e-14).y[
        :, -1
    ]
    assert weights @ start**2 == pytest.approx(1.0, abs=1e-10)
    assert (weights * start) @ before == pytest.approx(0.0, abs=1e-9)
    assert result == pytest.approx([*end, *(after / np.linalg.norm(after))], abs=1e-9)
    assert arc > 0.01


def derivative(of, h=2e-3):
    """Return the derivative of a function at 0 by extrapolated central differences."""
    one, two, four = ((of(h / k) - of(-h / k)) * k / (2 * h) for k in (1, 2, 4))
    one, two = (4 * two - one) / 3, (4 * four - two) / 3
    return (16 * two - one) / 15


SMOOTH = {
    "cylinder_-y": range(24),
    "ellipsoid_all_hybrid": range(3, 12),
    "torus_y": range(16),
    "two_cylinders": range(9),
    "cylinder_sphere_ellipsoid": range(12, 24),
    "via_range_all": range(9),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_speeds_and_moment_arms_are_derivatives(name):
    paths = osimlite.paths(wrapped(SETUPS[name]), wrapping="geodesic")
    infos, rng = paths.mechanism.coordinates, np.random.default_rng(2)
    for case in (SETUPS[name]["cases"][k] for k in SMOOTH[name]):
        q = np.array([0, 0, 0, *case["p_A"], 0, 0, 0, *case["p_B"], *case["q_W"]])
        u = rng.normal(size=len(q)) / len(q)
        way = paths.mechanism.coordinate_rates(q, u)
        expected = derivative(lambda h, q=q, way=way: paths.lengths(q + h * way)[PATH])
        arms = paths.moment_arms(q)[PATH]
        assert paths.speeds(q, u)[PATH] == pytest.approx(expected, rel=0, abs=1e-9)
        assert -sum(
            arms.get(info.path, 0.0) * u[k] for k, info in enumerate(infos)
        ) == pytest.approx(expected, abs=1e-9)


ALL = {"Cylinder": [0.03, 9.0], "Sphere": [0.04], "Ellipsoid": [0.03, 0.05, 0.04]}


@pytest.mark.parametrize(
    "kinds",
    [
        *(
            ("Cylinder", "Cylinder"),
            ("Cylinder", "Ellipsoid"),
            ("Ellipsoid", "Ellipsoid"),
            ("Sphere", "Sphere"),
        ),
        *(("Sphere", "Ellipsoid"), ("Sphere", "Cylinder"), ("Cylinder", "Sphere")),
    ],
    ids=" and ".join,
)
def test_lengths_around_two_surfaces_do_not_jump(kinds):
    """On both sides of the surfaces and between them, where the shortest path changes, both paths have equal length."""
    one, two = (surface(kind, ALL[kind]) for kind in kinds)
    paths = around(
        one, {**two, "translation": (0.09, 0.01, 0.02), "xyz_body_rotation": (0.4, -0.3, 0.2)}
    )
    rng, steps = np.random.default_rng(6), np.linspace(0.0, 1.0, 61)[:, None]
    for _ in range(choose(8, 30)):
        begin, end = rng.uniform(
            (-0.2, -0.06, -0.06, 0.15, -0.06, -0.06), (-0.08, 0.06, 0.06, 0.3, 0.06, 0.06), (2, 6)
        )
        lengths = [length(paths, ends[:3], ends[3:]) for ends in begin + steps * (end - begin)]
        way = (end - begin) / (len(steps) - 1)
        assert np.max(np.abs(np.diff(lengths))) < np.linalg.norm(way[:3]) + np.linalg.norm(way[3:])


def test_surfaces_that_intersect():
    """In the notch between the surfaces, the path wraps around the one with an active side."""
    held, other = (
        surface("Sphere", [0.04], "y"),
        {**surface("Sphere", [0.03]), "translation": (0.04, 0.03, 0.0)},
    )
    for height in (-0.02, 0.0, 0.02, 0.04, 0.06):
        ends = (-0.1, height, 0.0), (0.12, 0.0, 0.001)
        assert length(around(held, other), *ends) == pytest.approx(
            length(around(held), *ends), rel=1e-12
        )


def test_nothing_outside_of_a_path_is_touched(monkeypatch):
    monkeypatch.setattr("osimlite.simulation.evaluation.select_code", lambda: Checked("Python"))
    setup = SETUPS["cylinder_sphere_ellipsoid"]
    case = setup["cases"][15]
    paths = osimlite.paths(wrapped(setup), wrapping="geodesic")
    paths.moment_arms([0, 0, 0, *case["p_A"], 0, 0, 0, *case["p_B"], *case["q_W"]])


@pytest.mark.parametrize(
    "one",
    [
        surface("Cylinder", [0.03, 1.0]),
        surface("Cylinder", [0.03, 1.0], "y"),
        surface("Sphere", [0.03], "y"),
        surface("Ellipsoid", [0.04, 0.03, 0.05]),
    ],
    ids=["cylinder", "cylinder y", "sphere y", "ellipsoid"],
)
def test_a_surface_is_met_and_left_at_tangency(one):
    """The path is never shorter than the line, and longer by at most the order of the depth to the power 3/2."""
    paths = around(one)
    for depth in (-1e-6, -1e-12, 0.0, 1e-12, 1e-8, 1e-6):
        line = hypot(0.2, 0.02)
        longer = length(paths, (-0.1, 0.03 - depth, 0.01), (0.1, 0.03 - depth, -0.01)) - line
        assert -1e-15 <= longer <= (20 * depth**1.5 if depth > 0.0 else 0.0) + 1e-15


def test_sides():
    """A path stays on the active side of a cylinder, even if the straight line passes on the other side."""
    first, second = (-0.1, -0.05, 0.0), (0.1, -0.05, 0.02)
    flat = 2 * sqrt(0.1**2 + 0.05**2 - 0.03**2)
    angle = 2 * (pi - acos(0.05 / hypot(0.1, 0.05)) - acos(0.03 / hypot(0.1, 0.05)))
    expected = {
        "all": hypot(0.2, 0.02),
        "-y": hypot(0.2, 0.02),
        "y": hypot(flat + 0.03 * angle, 0.02),
    }
    for side, value in expected.items():
        assert length(
            around(surface("Cylinder", [0.03, 1.0], side)), first, second
        ) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_a_knee_winds_on(mirrored):
    """Around a cylinder both methods agree, even if an end has turned past the half plane behind it."""
    knee = wrapped({"via": (), "objects": (surface("Cylinder", [0.04, 1.0], "x"),)})
    paths, usual = osimlite.paths(knee, wrapping="geodesic"), osimlite.paths(knee)
    for flexion in np.linspace(0.0, 2.6, 27):
        angle = -1.2 - flexion
        ends = (
            (0.05, mirrored * 0.3, 0.0),
            (0.06 * np.cos(angle), mirrored * 0.06 * np.sin(angle), 0.0),
        )
        assert length(paths, *ends) == pytest.approx(length(usual, *ends), rel=0.0, abs=1e-12)
    assert length(paths, *ends) > 0.35


def test_only_the_piece_nearest_to_the_axis_is_held_on_a_side():
    cylinder, first, via, second = (
        surface("Cylinder", [0.03, 1.0], "y"),
        (-0.1, 0.04, 0.0),
        (0.09, -0.02, 0.0),
        (0.1, -0.1, 0.0),
    )
    bent, behind = length(around(cylinder), first, via), length(around(cylinder), via, second)
    straight = np.linalg.norm(np.subtract(via, second))
    assert behind > straight + 0.05
    assert length(around(cylinder, via=[via]), first, second) == pytest.approx(
        bent + straight, rel=1e-14
    )


def test_far_side_of_a_sphere():
    """OpenSim's length is negative here."""
    result = length(
        around(surface("Sphere", [0.04], "x")), (-0.039, 0.02, 0.0), (-0.039, -0.02, 0.001)
    )
    assert 0.18 < result < 0.25


def test_unknown_wrapping():
    with pytest.raises(SettingError, match="'geodesic'"):
        osimlite.paths(wrapped({"via": (), "objects": ()}), wrapping="geodesics")


def test_a_simulation_runs_along_geodesics():
    """The first acceleration follows from the moment arms."""
    model = wrapped({"via": (), "objects": (surface("Cylinder", [0.03, 1.0]),)})
    paths, ends = (
        osimlite.paths(model, wrapping="geodesic"),
        {"A3": -0.1, "A4": 0.01, "B3": 0.12, "B5": 0.08},
    )
    pulled = {
        wrapping: osimlite.simulate(
            model,
            1e-6,
            "compiled",
            wrapping=wrapping,
            initial=ends,
            controls={"p": 1.0},
            accuracy=1e-9,
        )
        for wrapping in ("geodesic", "opensim")
    }
    place = paths.mechanism.coordinate_index("B5")
    arm = paths.moment_arms(ends)[PATH][paths.mechanism.coordinates[place].path]
    assert pulled["geodesic"].summary["settings"]["wrapping"] == "geodesic"
    assert pulled["geodesic"].speeds[-1][place] / 1e-6 == pytest.approx(arm, rel=1e-6)
    assert pulled["opensim"].speeds[-1][place] / 1e-6 != pytest.approx(arm, rel=1e-4)
