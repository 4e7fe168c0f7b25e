"""Sensors on models: IMUPlacer and inverse kinematics of orientations against OpenSim's own, live."""

from __future__ import annotations

import gzip
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.multibody.spatial import quaternion, rotation_of
from osimlite.simulation.files.storage import write_sto
from tests.fitting.test_scaling import assert_same
from tests.oracle.test_fitting import ask

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

PLACER = """<OpenSimDocument Version="40600">
    <IMUPlacer>
        <model_file>model.osim</model_file>
        <base_imu_label>{base}</base_imu_label>
        <base_heading_axis>{axis}</base_heading_axis>
        <sensor_to_opensim_rotations>{turn}</sensor_to_opensim_rotations>
        <orientation_file_for_calibration>standing.sto</orientation_file_for_calibration>
        <output_model_file>placed.osim</output_model_file>
    </IMUPlacer>
</OpenSimDocument>
"""
PLACE = """
import opensim
opensim.Logger.setLevelString("Off")
assert opensim.IMUPlacer("placer.xml").run()
"""


def real_model(corpus: Any, name: str, folder: Path) -> osimlite.Model:
    """A real model, in a folder and read from there."""
    converted = next(model.converted for model in corpus if model.id == name)
    (folder / "model.osim").write_bytes(gzip.decompress(converted.read_bytes()))
    return osimlite.read(folder / "model.osim")


def write_orientations(path: Path, times: Sequence[float], names: Sequence[str], rotations: Any) -> None:
    """Rotation matrices (t, k, 3, 3) as a table of quaternions."""
    rows = quaternion(rotations).reshape(len(times), -1).tolist()
    write_sto(path, "orientations", times, names, rows, kind="Quaternion")


@pytest.mark.parametrize(
    ("name", "axis"), [("m0013", "x"), ("m0172", "-z"), ("m0954", "Y"), ("m0097", "z"), ("m0109", "-x"), ("m0163", "")]
)
def test_sensors_are_placed_alike(corpus: Any, name: str, axis: str, tmp_path: Path) -> None:
    """Worn on random bodies, turned at random; the model of m0097 has its sensors already."""
    model, rng = real_model(corpus, name, tmp_path), np.random.default_rng(int(name[1:]))
    bodies = [body.name for body in model.body_set.objects]
    worn = [str(body) for body in rng.choice(bodies, min(5, len(bodies)), replace=False)]
    names = [f"{body}_imu" for body in worn] + ["nowhere_imu", "plain"]
    write_orientations(tmp_path / "standing.sto", [0.5, 0.6], names, rotation_of(rng.normal(size=(2, len(names), 4))))
    turn = " ".join(map(str, rng.uniform(-3.0, 3.0, 3)))
    (tmp_path / "placer.xml").write_text(PLACER.format(base=names[0] if axis else "", axis=axis, turn=turn))
    ask(PLACE, tmp_path)
    outcome = osimlite.run(tmp_path / "placer.xml", tmp_path / "ours", check=False)
    assert outcome.summary["left_out"] == ("nowhere_imu", "plain")
    ours = osimlite.read(tmp_path / "ours" / "placed.osim")
    assert_same(ours, osimlite.read(tmp_path / "placed.osim"))
    assert {imu.path for imu in ours.components(osimlite.IMU)} >= {f"/componentset/{body}_imu" for body in worn} - {
        imu.path for imu in model.components(osimlite.IMU)
    }
