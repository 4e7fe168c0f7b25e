"""Tests of lengths, lengthening speeds and moment arms of the paths of a model."""

from __future__ import annotations

import gzip
import json
from math import isfinite

import pytest

import osimlite
from osimlite.errors import ModelError
from osimlite.mechanics.multibody.spatial import invert_transform
from osimlite.schema.function_types import Sine
from osimlite.schema.functions import Constant
from osimlite.schema.muscles import PathActuator
from osimlite.schema.paths import MovingPathPoint, PathPoint
from tests.simulation.elements.muscle_rows import hung, line
from tests.simulation.force_cases import FORCES, with_force

FILES = {"gait10dof18musc": "m0005", "gait2392": "m0014"}
"""Ids of the models in the corpus."""


@pytest.mark.parametrize("name", FILES)
def test_muscles(name, shared):
    """Compare all poses of a table from OpenSim."""
    with gzip.open(shared / "oracle" / "muscles" / "moment_arms.json.gz") as file:
        table = next(item for item in json.load(file) if item["model"] == name)
    (file,) = (shared / "corpus" / "models" / FILES[name]).glob("*.osim")
    paths = osimlite.paths(osimlite.read(file))
    muscles = {path: path.rpartition("/")[2] for path in paths.names}
    assert list(muscles.values()) == table["muscles"]
    for pose in table["poses"]:
        lengths, speeds, arms = (
            paths.lengths(pose["q"]),
            paths.speeds(pose["q"], pose["u"]),
            paths.moment_arms(pose["q"]),
        )
        for path, muscle in muscles.items():
            assert lengths[path] == pytest.approx(pose["length"][muscle], rel=0, abs=1e-12)
            assert speeds[path] == pytest.approx(pose["speed"][muscle], rel=0, abs=1e-10)
            expected = [
                pose["moment_arms"][muscle].get(of.rpartition("/")[2], 0.0)
                for of in table["coordinates"]
            ]
            result = [arms[path].get(of, 0.0) for of in table["coordinates"]]
            assert result == pytest.approx(expected, rel=0, abs=1e-10)


def test_a_pose_is_an_array_or_a_mapping():
    paths = osimlite.paths(with_force(FORCES["path"]))
    assert paths.names == ("/forceset/a",)
    by_name = paths.lengths({"q2_0": 0.3, "q0_4": -0.2})
    values = paths.mechanism.values({"/jointset/j2/q2_0": 0.3, "q0_4": -0.2})
    assert by_name == paths.lengths(values) != paths.lengths({})
    with pytest.raises(ModelError, match="no coordinate 'q2_9'"):
        paths.moment_arms({"q2_9": 1.0})


def test_a_force_that_does_not_act_has_a_path_too():
    model = with_force(FORCES["path"])
    before = osimlite.paths(model).lengths({})
    model["/forceset/a"].appliesForce = False
    assert osimlite.paths(model).lengths({}) == before


def test_moment_arms_are_what_the_length_loses():
    """Moment arms are minus the derivatives of the length, where nothing wraps and joints are simple."""
    paths = osimlite.paths(with_force(FORCES["path"]))
    pose = paths.mechanism.values({"q0_3": 0.4, "q2_0": 0.3})
    arms = paths.moment_arms(pose)["/forceset/a"]
    assert "/jointset/j3/q3_0" not in arms
    for name in ("q0_3", "q0_4", "q0_5", "q2_0"):
        place = paths.mechanism.coordinate_index(name)
        lengths = []
        for step in (-1e-6, 1e-6):
            near = pose.copy()
            near[place] += step
            lengths.append(paths.lengths(near)["/forceset/a"])
        path = paths.mechanism.coordinates[place].path
        assert arms[path] == pytest.approx((lengths[0] - lengths[1]) / 2e-6, rel=1e-7)


def test_points_in_one_place_pull_nothing():
    """The remaining segments lie between the bodies, and move nothing relative to ground."""
    model = with_force(FORCES["path"])
    points = model["/forceset/a"].geometry_path.path_point_set.objects
    place = invert_transform(osimlite.mechanism(model).body_transforms({})["b0"]) @ (
        *points[0].location,
        1.0,
    )
    points.insert(
        1, PathPoint(name="same", socket_parent_frame="/bodyset/b0", location=tuple(place[:3]))
    )
    arms = osimlite.paths(model).moment_arms({})["/forceset/a"]
    assert list(arms) == [
        "/jointset/j1/q1_0",
        "/jointset/j1/q1_1",
        "/jointset/j1/q1_2",
        "/jointset/j2/q2_0",
    ]
    assert all(map(isfinite, arms.values()))


def test_a_point_whose_place_is_no_number_is_refused():
    model = hung(PathActuator(name="mu", geometry_path=line()))
    axes = {f"{axis}_location": Constant(value=0.0) for axis in "xyz"}
    sockets = {f"socket_{axis}_coordinate": "/jointset/slide/x" for axis in "xyz"}
    point = MovingPathPoint(name="a", socket_parent_frame="/ground", **sockets, **axes)
    point.x_location = Sine(amplitude=0.1, omega=1.0, phase=float("inf"), offset=0.0)
    model.find("/forceset/mu").geometry_path.path_point_set.objects[0] = point
    with pytest.raises(
        ModelError,
        match=r"the location of a point of '/forceset/mu.*' has a number that is not finite",
    ):
        osimlite.simulate(model, 0.1)
