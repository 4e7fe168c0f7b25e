"""Tests of AddBiomechanics subjects as folders of files: the files are complete, and tools run on them."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import osimlite
from osimlite.io.b3d.messages import HEADER
from osimlite.io.tables.storage import read_sto
from tests.cli.command import run
from tests.io import b3d_files as files


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("b3d")
    files.write_subject(place / "it.b3d", (40, 30))
    code, out, error = run("convert", "it.b3d", "-o", "subject", folder=place)
    assert code == 0, error
    assert "components: " in out and "wrote subject/models/kinematics.osim" in out
    return place / "subject"


def test_files_are_complete(folder: Path) -> None:
    trial = {
        "addbiomechanics_moments.sto", "analyze.xml", "coordinates.mot", "emg.sto", "external_loads.xml",
        "force_plates.sto", "ground_forces.mot", "inverse_dynamics.xml", "markers.trc", "missing_forces.sto",
    }  # fmt: skip
    assert {path.name for path in (folder / "trials/walk_0").iterdir()} >= trial
    assert {path.name for path in (folder / "trials").iterdir()} == {"walk_0", "walk_1"}
    texts = [
        (folder / "models" / f"{kind}.osim").read_text() for kind in ("kinematics", "dynamics")
    ]
    assert texts == [osimlite.to_text(files.make_walker())] * 2
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["subject"]["mass_kg"] == 70.0 and summary["subject"]["age_years"] is None
    assert summary["models"][1] == {"type": "dynamics", "file": "models/dynamics.osim"}
    first = summary["trials"][0]
    assert first["missing_forces"] == {"not over a force plate": 1} and first["pass"] == "dynamics"
    assert all((folder / name).exists() for name in summary["files"])


def test_coordinates_have_all_digits_and_those_of_couplers(folder: Path) -> None:
    table = read_sto(folder / "trials/walk_1/coordinates.mot")
    assert table.columns == (*files.NIMBLE_ORDER, "patella_r_angle") and not table.in_degrees
    positions = files.make_arrays(30, 1)[1]["positions"]
    np.testing.assert_array_equal(table.rows[:, :-1], positions)
    np.testing.assert_allclose(table["patella_r_angle"], 0.5 * positions[:, 6] + 0.1, atol=1e-15)
    assert table.times[0] == 0.5


def test_markers_that_were_not_seen_are_gaps(folder: Path) -> None:
    lines = (folder / "trials/walk_0/markers.trc").read_text().splitlines()
    assert lines[3].split("\t")[2::3][:2] == ["RASI", "LASI"]
    assert lines[6 + 20].split("\t")[2:5] == ["", "", ""]


def test_loads_name_their_columns(folder: Path) -> None:
    root = ElementTree.parse(folder / "trials/walk_0/external_loads.xml").getroot()
    labels = read_sto(folder / "trials/walk_0/ground_forces.mot").columns
    for tag in ("force_identifier", "point_identifier", "torque_identifier"):
        for start in (element.text or "" for element in root.iter(tag)):
            matches = [label for label in labels if label.startswith(start)]
            assert [label[len(start) :] for label in matches] == ["x", "y", "z"]


def test_the_record_names_what_is_left_out(folder: Path) -> None:
    fidelity = json.loads((folder / "fidelity.json").read_text())
    records = {(each["component"], each["kind"]): each for each in fidelity["records"]}
    assert records["/trials/walk_0/ground_forces", "missing-forces"]["detail"].startswith(
        "1 of 40 frames"
    )
    assert records["/trials/walk_0/passes/0-kinematics", "pass"]["how"] == "dropped"
    assert records["/trials/walk_0/markers", "marker"]["detail"] == "1 marker"
    point = records["/trials/walk_0/ground_forces", "center-of-pressure"]["errors"]["point"]
    # The force plates of the test are at a height of 0.01 m, the centres of pressure at 0.
    assert point["unit"] == "m" and point["max"] < 0.02
    assert fidelity["translated"]["/trials/walk_0/coordinates"] == "trials/walk_0/coordinates.mot"


def test_setups_run_and_are_checked(folder: Path) -> None:
    trial = folder / "trials/walk_0"
    assert run("validate", ".", "--select", "OSIM8", folder=folder).code == 0
    for setup in ("inverse_dynamics.xml", "analyze.xml"):
        done = run("run", setup, folder=trial)
        assert done.code == 0, done.err
    moments = read_sto(trial / "results/inverse_dynamics.sto")
    assert "hip_r_flexion_moment" in moments.columns and np.isfinite(moments.rows).all()
    checked = run("check-trial", ".", folder=trial)
    assert checked.code in (0, 1) and "inverse_dynamics" in checked.out


def test_inverse_dynamics_with_the_written_loads_is_that_with_the_wrenches(folder: Path) -> None:
    trial = osimlite.read_b3d(folder.parent / "it.b3d").trials[0]
    model = files.make_walker()
    motion = folder / "trials/walk_0/coordinates.mot"
    loads = folder / "trials/walk_0/external_loads.xml"
    result = osimlite.inverse_dynamics(model, motion, loads)
    free = osimlite.inverse_dynamics(model, motion)
    total = trial.read_wrenches()[:, :, 3:].sum(axis=1)
    for axis, name in enumerate(("tx", "ty", "tz")):
        column = next(each for each in free.columns if name in each)
        difference = np.asarray(free[column]) - np.asarray(result[column])
        np.testing.assert_allclose(difference, total[:, axis], atol=1e-9)


def test_another_pass_can_be_chosen(folder: Path, tmp_path: Path) -> None:
    source = folder.parent / "it.b3d"
    done = run("convert", source, "--processing-pass", "kinematics", "-o", "k", folder=tmp_path)
    assert done.code == 0, done.err
    setup = (tmp_path / "k/trials/walk_0/inverse_dynamics.xml").read_text()
    # The coordinates of this pass are unfiltered, so the setup filters them.
    assert (
        "../../models/kinematics.osim" in setup
        and "<lowpass_cutoff_frequency_for_coordinates>6<" in setup
    )
    done = run("convert", source, "--processing-pass", "lowpass-filter", folder=tmp_path)
    assert done.code == 2 and "it has: kinematics, dynamics" in done.err


def test_a_model_of_nimble_is_rewritten(tmp_path: Path) -> None:
    model = files.make_walker()
    joint = osimlite.EllipsoidJoint(
        name="scapulothoracic",
        coordinates=[
            osimlite.Coordinate(name=f"scapula_{word}")
            for word in ("abduction", "elevation", "upward_rot")
        ],
        radii_x_y_z=(0.1, 0.2, 0.1),
    )
    scapula = model.add(
        osimlite.Body(name="scapula", mass=1.0, inertia=(1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    )
    model.add(joint.between(model["/bodyset/toes_l"], scapula))
    header = files.make_header(osimlite.to_text(model), (0,), (1,)) | {
        "dof_count": 13,
        "trials": (),
    }
    content = files.encode_file(files.encode_message(header, HEADER))
    (tmp_path / "it.b3d").write_bytes(content)
    assert run("convert", "it.b3d", "-o", "out", folder=tmp_path).code == 0
    assert {path.name for path in (tmp_path / "out/models").iterdir()} == {
        "dynamics.osim",
        "dynamics_opensim.osim",
    }
    record = json.loads((tmp_path / "out/fidelity.json").read_text())["records"][0]
    assert (
        record["component"].endswith("/jointset/scapulothoracic") and "_opensim" in record["done"]
    )


def test_a_damaged_file_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "it.b3d").write_bytes(files.make_subject()[:-5])
    code, out, error = run("convert", "it.b3d", folder=tmp_path)
    assert code == 2 and out == "" and len(error.splitlines()) == 1 and "cut off" in error
    assert not (tmp_path / "it").exists()
