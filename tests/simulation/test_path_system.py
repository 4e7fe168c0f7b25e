"""Tests of paths in many poses at once against single poses."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite import read
from osimlite.simulation.engines.linking import MACHINE_CODE, PYTHON_CODE, READY_CODE
from osimlite.simulation.engines.machine_code import has_machine_code
from osimlite.simulation.paths import Paths

CODES = [
    PYTHON_CODE,
    READY_CODE,
    pytest.param(
        MACHINE_CODE,
        marks=pytest.mark.skipif(not has_machine_code(), reason="there is no machine code"),
    ),
]


FILES = ["OSIM631/fail-02-*", "OSIM632/fail-02-*", "OSIM633/fail-02-*"]


@pytest.fixture(params=CODES, ids=["python", "at hand", "compiled"])
def code(request):
    return request.param


@pytest.fixture(params=FILES)
def paths(request, fixtures, code):
    (file,) = (fixtures / "lint").glob(request.param)
    return Paths(read(file), code=code)


@pytest.fixture
def poses(paths):
    ranges = np.array([info.range for info in paths.mechanism.coordinates])
    parts = np.random.default_rng(1).random((7, len(ranges)))
    return np.vstack([paths.mechanism.assemble({}), ranges[:, 0] + parts * np.ptp(ranges, axis=1)])


def test_lengths_are_those_of_each_pose(paths, poses):
    result = paths.system.measure_poses(poses)
    assert result.tolist() == [list(paths.lengths(q).values()) for q in poses]


def test_one_path_is_measured_alone(paths, poses):
    places = [k % len(paths.names) for k in range(len(poses))]
    every = paths.system.measure_poses(poses)
    assert (
        paths.system.measure_one_path(places, poses).tolist()
        == every[range(len(poses)), places].tolist()
    )


def test_lengths_on_surfaces_are_those_of_each_pose(paths, poses):
    every = {
        (name, surface): lengths
        for name, surface, lengths in paths.system.measure_all_on_surfaces(poses, paths.routes)
    }
    for k, q in enumerate(poses):
        for name, own in paths.lengths_on_surfaces(q).items():
            assert [every[name, surface][k] for surface in own] == pytest.approx(
                [*own.values()], nan_ok=True, abs=0.0
            )


def test_the_length_on_the_far_side_of_a_sphere_is_negative(fixtures, code):
    paths = Paths(
        read(fixtures / "lint" / "OSIM633" / "fail-02-far-side-and-middle.osim"), code=code
    )
    every = {
        name: lengths
        for name, _, lengths in paths.system.measure_all_on_surfaces(np.zeros((2, 5)), paths.routes)
    }
    assert every["/forceset/far"].tolist() == pytest.approx([-0.18, -0.18], abs=5e-4)
    assert np.isnan(every["/forceset/middle"]).all()


def test_a_pose_that_cannot_be_computed_is_no_number_and_the_next_one_is(paths, poses):
    poses[1] = np.nan
    result = paths.system.measure_poses(poses)
    assert np.isnan(result[1]).all() and not np.isnan(result[2]).any()
    assert result[2].tolist() == list(paths.lengths(poses[2]).values())


def test_paths_around_surfaces_share_the_mechanism(fixtures):
    model = read(fixtures / "lint" / "OSIM631" / "fail-01-example.osim")
    paths = Paths(model, code=READY_CODE)
    around = paths.rewrap_paths(model, "geodesic", READY_CODE)
    assert around.mechanism is paths.mechanism
    assert around.lengths({}) == Paths(model, "geodesic", READY_CODE).lengths({})
