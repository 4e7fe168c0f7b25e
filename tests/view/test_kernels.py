"""Tests of the page's computations in a browser without the page: poses, path lengths and moment arms."""

from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.mechanics.multibody.constraints import Coupler
from osimlite.simulation.polylines import Polylines, TraceablePath
from osimlite.view.kernels import kernels_text, program_data
from tests.simulation.support import JOINTS, tree

MODELS = [
    "m0001",
    "m0005",
    "m0014",
    "m0097",
    "m0109",
    "m0129",
    "m0139",
    "m0163",
    "m0168",
    "m0387",
    "m0923",
    "m0954",
]
"""Corpus models with chained couplers, ball joints, moving path points, all wrap surfaces and body constraints."""

FOUND = """([program, lines, poses, asked]) => {
  const mechanism = new window.osimlite.Mechanism({ program, lines });
  return poses.map((given) => {
    const q = mechanism.coupled(given), bodies = mechanism.poses(q);
    return [q, bodies.flat(), lines.map((_, k) => mechanism.corners(k, q, bodies).flat()),
      lines.map((_, k) => asked.map((c) => mechanism.over(k, c, q)))];
  });
}"""


@pytest.fixture(scope="module")
def found(chromium):
    """Yield a function that lets the page compute coordinates, poses, path corners, lengths and moment arms."""
    page = chromium.new_page()

    def of(mechanism, poses, routes=(), asked=()):
        program = program_data(Polylines(mechanism, routes), mechanism.constraints)
        script = files("osimlite.view").joinpath("web", "mechanism.js").read_text(encoding="utf-8")
        page.evaluate(f"() => {{ {kernels_text(program)}\n{script} }}")
        lines = [{"route": k} for k, _ in enumerate(routes)]
        return page.evaluate(FOUND, [program, lines, poses.tolist(), [*map(int, asked)]])

    yield of
    page.close()


def off(bodies, state) -> float:
    """Return the largest difference between poses of bodies on the page and in osimlite."""
    placed = np.dstack((state.rotations, state.origins[:, :, None]))
    return np.abs(np.reshape(bodies, placed.shape) - placed).max()


def test_all_joints_and_functions_place_bodies_as_the_mechanism_does(found):
    joints = [*JOINTS, *JOINTS, "WeldJoint", "PinJoint"]
    mechanism = tree(joints, reversed={k for k, _ in enumerate(joints) if k >= len(JOINTS)})
    poses = np.random.default_rng(5).uniform(-1.0, 1.0, (3, len(mechanism.coordinates)))
    for q, (same, bodies, *_) in zip(poses, found(mechanism, poses), strict=True):
        assert same == q.tolist() and off(bodies, mechanism.at(q)) < 1e-12


@pytest.mark.parametrize("name", MODELS)
def test_models_are_where_osimlite_has_them_and_their_paths_pull_alike(name, shared, found):
    (path,) = (shared / "corpus" / "models" / name).glob("*.osim")
    model = osimlite.read(path)
    mechanism = build_mechanism(model)
    paths = osimlite.paths(model, mechanism=mechanism)
    routes = {
        name: route for name, route in paths.routes.items() if isinstance(route, TraceablePath)
    }
    random, start = np.random.default_rng(3), mechanism.values({})
    poses = start + random.uniform(-0.3, 0.3, (2, len(start)))
    couplers = [item for item in mechanism.constraints if isinstance(item, Coupler)]
    still = {item.dependent for item in couplers}
    free = [
        k
        for k, info in enumerate(mechanism.coordinates)
        if not (info.locked or info.prescribed or k in still)
    ]
    asked = random.permutation(free)[:5]
    for given, (q, bodies, corners, measured) in zip(
        poses, found(mechanism, poses, [*routes.values()], asked), strict=True
    ):
        expected = given.copy()
        for item in couplers * len(couplers):
            expected[item.dependent] = item.function.evaluate(expected[list(item.independent)])[0]
        assert np.abs(q - expected).max() < 1e-12
        assert off(bodies, mechanism.at(expected)) < 1e-12
        lengths, arms = paths.lengths(expected), paths.compute_moment_arms(expected[None])[0]
        # Rounding errors grow with the motion of dependent coordinates per motion of the selected
        # one.
        polylines, far = paths.polylines(expected), np.abs(paths.compute_coupling(expected)).max()
        for route, line, row in zip(routes, corners, measured, strict=True):
            assert line == pytest.approx(polylines[route].ravel(), abs=1e-12)
            assert [each["length"] for each in row] == pytest.approx(
                [lengths[route]] * len(asked), abs=1e-12
            )
            own = arms[paths.names.index(route), asked]
            assert [each["arm"] for each in row] == pytest.approx(own, abs=1e-12 * far)
