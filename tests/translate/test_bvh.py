"""Tests of models and motions as BVH, in which all bodies keep their poses, and of BVH as markers."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.errors import SettingError
from osimlite.io.bvh import read_bvh
from osimlite.mechanics.multibody.mechanism import Mechanism
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.simulation.bvh_export import make_bvh
from osimlite.translate.bvh import to_bvh
from tests.cli.command import run
from tests.io.b3d_files import make_walker


def compare(path: Path, mechanism: Mechanism, values: np.ndarray, scale: float = 100.0) -> None:
    """Compare rotations of bodies and centres of joints with those of a mechanism.

    Args:
        path: BVH file.
        mechanism: the mechanism.
        values: coordinates (t, n).
        scale: length units of the file per metre.
    """
    motion = read_bvh(path)
    names = [joint.name for joint in motion.joints]
    rotations, positions = motion.compute_poses()
    assert len(rotations) == len(values)
    for row, q in enumerate(values):
        state = mechanism.at(q)
        for index, body in enumerate(mechanism.bodies):
            joint = names.index(body.name.rpartition("/")[2])
            center = state.point(index, body.mobilizer.child_frame[:3, 3])
            np.testing.assert_allclose(rotations[row, joint], state.rotations[index], atol=1e-12)
            np.testing.assert_allclose(positions[row, joint] / scale, center, atol=1e-12)


def test_poses_of_a_motion_are_exact(tmp_path: Path) -> None:
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    trajectory = osimlite.simulate(dynamic_walker(), to=0.2, report_interval=0.02)
    trajectory.to_sto(tmp_path / "states.sto")
    done = run("convert", "walker.osim", "--motion", "states.sto", "-o", "it.bvh", folder=tmp_path)
    assert done.code == 0, done.err
    compare(tmp_path / "it.bvh", trajectory.mechanism, trajectory.values)
    trajectory.to_bvh(tmp_path / "same.bvh", scale=1.0)
    compare(tmp_path / "same.bvh", trajectory.mechanism, trajectory.values, 1.0)
    records = json.loads((tmp_path / "fidelity.json").read_text())["records"]
    # The hip centre of the walker slides on its platform, which is recorded.
    assert "/bodyset/Pelvis" in [
        each["component"] for each in records if each["kind"] == "translation"
    ]


def test_changed_names_of_markers_are_recorded(tmp_path: Path) -> None:
    text = (
        "HIERARCHY\nROOT Knie links ä\n{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n"
        "JOINT Hip\n{ OFFSET 0 1 0 } }\nMOTION\nFrames: 1\nFrame Time: 0.1\n0\n"
    )
    (tmp_path / "a.bvh").write_text(text, encoding="utf-8")
    done = run("convert", "a.bvh", "-o", "a.trc", folder=tmp_path)
    assert done.code == 0, done.err
    records = json.loads((tmp_path / "fidelity.json").read_text())["records"]
    assert [each["component"] for each in records if each["kind"] == "name"] == ["/Knie_links__"]
    assert "'Knie links ä' became 'Knie_links__'" in str(records)


def test_any_pose_of_a_tree_is_exact(tmp_path: Path) -> None:
    mechanism = osimlite.mechanism(make_walker())
    rng = np.random.default_rng(0)
    values = rng.uniform(-1.4, 1.4, (30, len(mechanism.coordinates)))
    values = np.array(
        [mechanism.assemble(dict(zip(mechanism.coordinate_names, q, strict=True))) for q in values]
    )
    result = make_bvh(mechanism, np.linspace(0.0, 0.29, 30), values)
    path = to_bvh(make_walker(), name="it").write(tmp_path)[0]
    path.write_text("".join(osimlite.io.bvh.format_bvh(result.motion)))
    compare(path, mechanism, values)
    assert result.translating == () and not result.is_resampled
    # All joints of one leg come before those of the other, because a BVH file nests the joints.
    assert [joint.name for joint in result.motion.joints][:3] == ["pelvis", "calcn_r", "toes_r"]


def test_a_model_whose_gravity_points_along_z_is_turned_upright(tmp_path: Path) -> None:
    model = make_walker()
    model.gravity = (0.0, 0.0, -9.81)
    model["/jointset/ground_pelvis/tz"].default_value = 1.0
    motion = to_bvh(model).motion
    np.testing.assert_allclose(motion.compute_poses()[1][0, 0], [0.0, 100.0, 0.0], atol=1e-12)


def test_several_roots_hang_on_one() -> None:
    model = make_walker()
    ball = model.add(osimlite.Body(name="ball", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)))
    model.add(osimlite.PinJoint(name="spin").between(model.ground, ball, at=(0.0, 0.5, 0.0)))
    joints = to_bvh(model).motion.joints
    assert joints[0].name == "ground" and [joint.parent for joint in joints].count(-1) == 1
    assert {joint.name for joint in joints if joint.parent == 0} == {"pelvis", "ball"}


def test_unequal_times_are_made_equal() -> None:
    mechanism = osimlite.mechanism(make_walker())
    times = np.array([0.0, 0.01, 0.02, 0.03, 0.05])
    values = np.zeros((5, len(mechanism.coordinates)))
    values[:, 0] = 2.0 * times
    result = make_bvh(mechanism, times, values)
    assert result.is_resampled and len(result.motion.values) == 6
    np.testing.assert_allclose(
        result.motion.values[:, 3], np.degrees(2.0 * 0.01 * np.arange(6)), atol=1e-9
    )


def test_joints_become_markers(tmp_path: Path) -> None:
    mechanism = osimlite.mechanism(make_walker())
    to_bvh(make_walker(), name="it").write(tmp_path)
    done = run("convert", "it.bvh", "-o", "centres.trc", folder=tmp_path)
    assert done.code == 0, done.err
    lines = (tmp_path / "centres.trc").read_text().splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name]
    numbers = np.array(lines[6].split("\t")[2:-1], dtype=float).reshape(-1, 3)
    state = mechanism.at(mechanism.assemble({}))
    for index, body in enumerate(mechanism.bodies):
        center = state.point(index, body.mobilizer.child_frame[:3, 3])
        np.testing.assert_allclose(
            numbers[names.index(body.name.rpartition("/")[2])], center, atol=1e-12
        )
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["from"], summary["to"], summary["joints"]) == ("bvh", "trc", len(names))
    done = run("convert", "it.bvh", "-o", "it.glb", folder=tmp_path)
    assert done.code == 2 and "cannot be written as 'glb'" in done.err


def test_a_scale_is_positive(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="positive number"):
        to_bvh(make_walker(), scale=0.0)
