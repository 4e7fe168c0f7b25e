"""Tests of models for biorbd: segments, markers and muscles of the file have the poses of the model.

tests/oracle/test_biorbd.py compares with biorbd itself.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.models.jumper import jumper
from osimlite.translate.biomod import BioMod, to_biomod
from osimlite.translate.survey import CONTAINERS
from tests.cli.command import run
from tests.simple_models import make_single_body
from tests.translate.support import make_tilted


def find_segments(made: BioMod, values: dict[str, float]) -> dict[str, np.ndarray]:
    """Compute the poses of all segments of a translation.

    Args:
        made: translation.
        values: value of each moving segment.

    Returns:
        Pose (4, 4) in the base by segment.
    """
    poses = {"base": np.eye(4)}
    numbers = iter(values.values())
    for name, body in re.findall(r"^segment (\S+)\n(.*?)^endsegment$", made.text, re.M | re.S):
        parent = re.search(r"parent (\S+)", body)
        assert parent is not None
        pose = poses[parent[1]]
        if matrix := re.search(r"\trt\n((?:\t\t.*\n){4})", body):
            pose = pose @ np.array(matrix[1].split(), dtype=float).reshape(4, 4)
        if motion := re.search(r"(rotations|translations) ([xyz])", body):
            value, axis = next(numbers), "xyz".index(motion[2])
            moved = np.eye(4)
            if motion[1] == "translations":
                moved[axis, 3] = value
            else:
                i, j = ((1, 2), (2, 0), (0, 1))[axis]
                moved[i, i] = moved[j, j] = np.cos(value)
                moved[j, i], moved[i, j] = np.sin(value), -np.sin(value)
            pose = pose @ moved
        poses[name] = pose
    return poses


@pytest.mark.parametrize("make", [make_tilted, dynamic_walker, jumper])
def test_segments_have_the_poses_of_the_bodies(make) -> None:
    made = to_biomod(make())
    mechanism = made.robot.mechanism
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = mechanism.values({}) + rng.uniform(-0.5, 0.5, len(mechanism.coordinates))
        for index, info in enumerate(mechanism.coordinates):
            if info.locked:
                q[index] = info.default_value
        values = {joint.name: joint.value(q) for joint in made.robot.moving}
        poses = find_segments(made, values)
        state = mechanism.at(q)
        for index, body in enumerate(mechanism.bodies):
            link, frame = made.robot.link_of[body.path]
            np.testing.assert_allclose(poses[link.name] @ frame, state.transform(index), atol=1e-12)


def test_markers_and_muscles_are_written() -> None:
    made = to_biomod(make_tilted())
    assert "marker tip\n\tparent tail\n\tposition 0.1 0.2 0.3\n" in made.text
    assert "muscle wagger\n\ttype hillthelen\n" in made.text and "\tmaximalforce 200\n" in made.text
    assert "viapoint wagger_1\n\tparent pelvis\n\tmuscle wagger\n" in made.text
    kinds = {record.kind for record in made.fidelity}
    assert {"muscle-law", "constraint"} <= kinds


def test_paths_that_biorbd_cannot_follow_have_measured_errors() -> None:
    model = make_tilted()
    muscle = osimlite.Thelen2003Muscle(name="turner")
    pelvis, tail = model["/bodyset/pelvis"], model["/bodyset/tail"]
    muscle.geometry_path.add_point(pelvis, (0.0, 0.1, 0.0))
    # The coordinate never reaches this range: OpenSim's path is straight, but biorbd's has a
    # corner.
    muscle.geometry_path.path_point_set.objects.append(
        osimlite.ConditionalPathPoint(
            name="corner",
            socket_parent_frame=pelvis,
            location=(0.0, 0.2, 0.0),
            socket_coordinate="/jointset/tail/swing",
            range=(50.0, 51.0),
        )
    )
    muscle.geometry_path.add_point(tail, (-0.2, 0.0, 0.05))
    model.add(muscle)
    (record,) = [record for record in to_biomod(model).fidelity if record.kind == "path"]
    assert record.component == "/forceset/turner"
    # The corner adds 0.1 m, and the rest of the path is longer by less than that.
    assert 0.1 < record.errors["length"].rms < record.errors["length"].max < 0.2
    assert "moment arm about swing" in record.errors


def test_other_time_constants_are_recorded() -> None:
    model = make_tilted()
    (muscle,) = model.components(osimlite.Muscle)
    muscle.activation_time_constant, muscle.deactivation_time_constant = 0.01, 0.05
    (record,) = [record for record in to_biomod(model).fidelity if record.kind == "activation"]
    assert record.detail == "deactivation_time_constant 0.05 s"
    muscle.deactivation_time_constant = 0.04
    assert "activation" not in {record.kind for record in to_biomod(model).fidelity}


# ------------------------------------------------------------------------------------------------ records of losses
@pytest.mark.parametrize("make", [make_tilted, dynamic_walker, jumper])
def test_every_component_is_accounted_for(make) -> None:
    model = make()
    made = to_biomod(model)
    paths = [part.path for part in model.components() if not isinstance(part, CONTAINERS)]
    assert made.fidelity.list_missing(paths) == []


@pytest.mark.parametrize(
    ("properties", "kind"),
    [
        ({"default_value": 0.4}, "default-pose"),
        ({"default_speed_value": 2.0}, "default-speed"),
        ({"prescribed": True, "prescribed_function": osimlite.Constant(value=0.7)}, "prescribed"),
        ({"range": (-math.inf, math.inf)}, "coordinate-range"),
        ({"range": (1.0, -1.0)}, "coordinate-range"),
    ],
)
def test_what_a_degree_of_freedom_lacks_is_recorded(properties, kind) -> None:
    coordinate = osimlite.Coordinate(name="q", **properties)
    made = to_biomod(make_single_body(osimlite.PinJoint(name="pin", coordinates=[coordinate])))
    (record,) = made.fidelity
    assert (record.kind, record.component) == (kind, "/jointset/pin/q")
    assert ("rangesQ" in made.text) == (kind != "coordinate-range")


def test_joints_with_other_speeds_are_recorded() -> None:
    (record,) = to_biomod(make_single_body(osimlite.FreeJoint(name="free"))).fidelity
    assert (record.kind, record.component) == ("speeds", "/jointset/free")
    model = osimlite.Model(name="loose")
    model.add(osimlite.Body(name="ball", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    (record,) = to_biomod(model).fidelity
    assert (record.kind, record.component) == ("loose-body", "/bodyset/ball")


def test_a_muscle_that_is_off_is_left_out_with_its_parts() -> None:
    model = make_tilted()
    (muscle,) = model.components(osimlite.Muscle)
    muscle.appliesForce = False
    made = to_biomod(model)
    assert "wagger" not in made.text
    (record,) = (
        record for record in made.fidelity if record.component.startswith("/forceset/wagger")
    )
    assert (record.component, record.how) == ("/forceset/wagger", "dropped")


READ_ATTRIBUTES = {
    "segment": {
        "parent",
        "rtinmatrix",
        "rt",
        "translations",
        "rotations",
        "rangesq",
        "mass",
        "inertia",
        "com",
    },
    "marker": {"parent", "position", "technical"},
    "musclegroup": {"originparent", "insertionparent"},
    "muscle": {
        "type",
        "musclegroup",
        "originposition",
        "insertionposition",
        "optimallength",
        "maximalforce",
        "tendonslacklength",
        "pennationangle",
        "maxshorteningspeed",
    },
    "viapoint": {"parent", "muscle", "musclegroup", "position"},
}
"""Written attributes that biorbd 1.12.4 reads (`ModelReader.cpp`); it ignores all others."""


def test_biorbd_knows_all_attributes() -> None:
    text = to_biomod(make_tilted()).text
    used: dict[str, set[str]] = {}
    for element, body in re.findall(r"^(\w+) \S+\n((?:\t.*\n)+)end\1$", text, re.M):
        used.setdefault(element, set()).update(re.findall(r"^\t([a-zA-Z]\w*)", body, re.M))
    assert {element: {name.lower() for name in names} for element, names in used.items()} == (
        READ_ATTRIBUTES
    )


def test_the_command_writes_all_files(tmp_path: Path) -> None:
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    done = run("convert", "walker.osim", "-o", "out/it.bioMod", folder=tmp_path)
    assert done.code == 0, done.err
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "it.bioMod", "it.coordinates.json", "fidelity.json", "summary.json",
    }  # fmt: skip
    records = json.loads((tmp_path / "out/fidelity.json").read_text())["records"]
    assert {"force"} <= {record["kind"] for record in records}
