"""Tests of setups of inverse kinematics and scaling against OpenSim's results: the same files, the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.tools.running import run
from tests.tools.support import unpacked

REFERENCE = "oracle/tools/reference"


def test_inverse_kinematics_writes_opensims_files(shared: Path, tmp_path: Path) -> None:
    """Headers, columns and digits are equal; values are near OpenSim's, and errors are no larger."""
    case = shared / REFERENCE / "ik_gait10"
    setup = osimlite.read_document(case / "walk_Setup_IK.xml")
    setup.model_file, setup.marker_file, setup.output_motion_file = (
        "model.osim",
        "walk.trc",
        "walk_IK.mot",
    )
    setup.results_directory, setup.report_marker_locations = "results", True
    osimlite.write(setup, tmp_path / "setup.xml")
    unpacked(shared / REFERENCE / "models" / "gait10_subject01.osim", tmp_path, "model.osim")
    unpacked(case / "subject01_walk.trc", tmp_path, "walk.trc")
    outcome = run(tmp_path / "setup.xml", check=False)
    theirs = (case / "subject01_walk_IK.mot").read_text()
    assert (tmp_path / "walk_IK.mot").read_text().split("endheader")[0] == theirs.split(
        "endheader"
    )[0]
    ours, known = read_sto(tmp_path / "walk_IK.mot"), read_sto(case / "subject01_walk_IK.mot")
    assert ours.columns == known.columns and ours.rows == pytest.approx(known.rows, abs=0.1)
    errors = read_sto(next((tmp_path / "results").glob("*_ik_marker_errors.sto")))
    known = read_sto(case / "_ik_marker_errors.sto")
    assert errors.columns == known.columns and np.abs(errors.rows - known.rows).max() < 1e-3
    assert len(outcome.files) == 3 and outcome.summary["markers"] == 31


def test_scaling_writes_opensims_files(shared: Path, tmp_path: Path) -> None:
    """Compare two models, the scale factors, and the pose of the subject."""
    case = shared / REFERENCE / "scale_gait2354"
    tool = osimlite.read_document(case / "scale.xml")
    names = {
        "gait2354.osim": tool.generic_model_maker.model_file,
        "markers.xml": tool.generic_model_maker.marker_set_file,
        "static.trc": tool.model_scaler.marker_file,
    }
    for source, name in names.items():
        unpacked(case / source, tmp_path, name)
    unpacked(case / "scale.xml", tmp_path, "scale.xml")
    outcome = run(tmp_path / "scale.xml", check=False)
    written = {path.name for path in outcome.files}
    assert {tool.model_scaler.output_model_file, tool.marker_placer.output_model_file} <= written
    known = osimlite.read_document(case / "subject01_scaleSet_applied.xml").objects
    pelvis = next(scale.scales for scale in known if scale.segment == "pelvis")
    assert outcome.summary["ratios"]["pelvis"] == pytest.approx(pelvis[0], rel=1e-5)
    model = osimlite.read(tmp_path / tool.marker_placer.output_model_file)
    assert sum(body.mass for body in model.components(osimlite.Body)) == pytest.approx(tool.mass)
