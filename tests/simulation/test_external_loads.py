"""Tests of measured forces: their effect in a simulation, and refused documents."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from osimlite.errors import DocumentError, MissingFileError, UnsupportedError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.schema.functions import Constant, FunctionSet
from osimlite.schema.joint_types import FreeJoint
from osimlite.schema.prescribed import ExternalForce, PrescribedForce
from osimlite.simulation import simulate, write_sto
from osimlite.simulation.elements.external_loads import read_external_loads
from tests.simple_models import make_single_body

LABELS = ["grf_vx", "grf_vy", "grf_vz", "grf_px", "grf_py", "grf_pz", "grf_mx", "grf_my", "grf_mz"]


@pytest.fixture
def model():
    return make_single_body(
        FreeJoint(name="free"), body="block", mass=2.0, inertia=(0.2, 0.3, 0.4, 0.0, 0.0, 0.0)
    )


def document(folder: Path, body: str, datafile: str = "grf.mot", version: int = 40600) -> Path:
    path = folder / "loads.xml"
    path.write_text(
        f'<?xml version="1.0"?><OpenSimDocument Version="{version}"><ExternalLoads name="loads"><objects>'
        f'<ExternalForce name="plate">{body}</ExternalForce></objects><datafile>{datafile}</datafile>'
        "</ExternalLoads></OpenSimDocument>"
    )
    return path


def force(**tags: str) -> str:
    given = {
        "applied_to_body": "block",
        "force_identifier": "grf_v",
        "point_identifier": "grf_p",
        **tags,
    }
    return "".join(f"<{tag}>{value}</{tag}>" for tag, value in given.items() if value)


def data(folder: Path, rows: np.ndarray, times=(0.0, 1.0)) -> None:
    write_sto(folder / "grf.mot", "grf", times, LABELS, rows.tolist(), has_missing=True)


def test_the_same_as_a_prescribed_force(model, tmp_path):
    row = [1.0, 25.0, -2.0, 0.1, 0.2, -0.1, 0.3, 0.4, -0.5]
    data(tmp_path, np.array([row, row]))
    path = document(tmp_path, force(point_expressed_in_body="block", torque_identifier="grf_m"))
    loaded = simulate(model, 0.3, external_loads=path, accuracy=1e-8)
    assert loaded.summary["settings"]["external_loads"] == str(path)
    parts = [[Constant(value=value) for value in row[start : start + 3]] for start in (0, 3, 6)]
    names = ("forceFunctions", "pointFunctions", "torqueFunctions")
    sets = {
        name: FunctionSet(name=name, objects=part) for name, part in zip(names, parts, strict=True)
    }
    model.add(PrescribedForce(name="same", socket_frame="/bodyset/block", **sets))
    same = simulate(model, 0.3, accuracy=1e-8)
    assert loaded.values[-1] == pytest.approx(same.values[-1], abs=1e-12)
    assert loaded.forces["block_plate_Fy"][-1] == 25.0
    assert loaded.forces["block_plate_py"][-1] == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("tags", "words"),
    [
        ({"applied_to_body": "blok"}, r"the applied_to_body of 'plate' is 'blok', .*mean 'block'"),
        ({"force_expressed_in_body": "/bodyset/blocks"}, "did you mean '/bodyset/block'"),
        (
            {"force_identifier": "gfr_v"},
            "the force_identifier of 'plate' is 'gfr_v'; .* mean 'grf_v'",
        ),
        (
            {"force_identifier": "grf_"},
            "exactly three column labels must begin with this text, but in .* these do: grf_vx, grf_vy",
        ),
        ({"force_identifier": ""}, "has no force_identifier and no torque_identifier"),
        ({"force_identifier": "", "torque_identifier": "grf_m"}, "leave out the point_identifier"),
        ({"force_identifer": "grf_v"}, "<force_identifer> is unknown"),
    ],
)
def test_misspellings(model, tmp_path, tags, words):
    data(tmp_path, np.ones((2, 9)))
    path = document(tmp_path, force(**tags))
    with pytest.raises(DocumentError, match=words) as caught:
        read_external_loads(build_mechanism(model), path)
    assert caught.value.file == str(path)


def test_data_that_cannot_be_used(model, tmp_path):
    mechanism = build_mechanism(model)
    path = document(tmp_path, force())
    with pytest.raises(MissingFileError) as caught:
        read_external_loads(mechanism, path)
    assert caught.value.file == str(tmp_path / "grf.mot")
    gap = np.ones((2, 9))
    gap[1, 1] = np.nan
    data(tmp_path, gap)
    with pytest.raises(DocumentError, match="'grf_vy' is nan at 1 s; fill the gap"):
        read_external_loads(mechanism, path)
    data(tmp_path, np.ones((2, 9)), (0.5, 0.5))
    with pytest.raises(DocumentError, match=r"the time 0\.5 does not come after 0\.5"):
        read_external_loads(mechanism, path)
    data(tmp_path, np.ones((2, 9)), (0.5, np.inf))
    with pytest.raises(DocumentError, match="the time of row 2 is inf s; correct it"):
        read_external_loads(mechanism, path)
    data(tmp_path, np.ones((0, 9)), ())
    with pytest.raises(DocumentError, match="no rows"):
        read_external_loads(mechanism, path)
    with pytest.raises(DocumentError, match="names no data file"):
        read_external_loads(mechanism, document(tmp_path, force(), datafile=""))
    (tmp_path / "model.xml").write_text(
        '<OpenSimDocument Version="40600"><Model name="m"/></OpenSimDocument>'
    )
    with pytest.raises(DocumentError, match="holds a <Model>, not an <ExternalLoads>"):
        read_external_loads(mechanism, tmp_path / "model.xml")


def test_older_documents(model, tmp_path):
    data(tmp_path, np.ones((2, 9)))
    path = document(tmp_path, force(), version=20302)
    assert len(read_external_loads(build_mechanism(model), path)) == 1


def test_a_measured_force_without_data_is_refused(model):
    model.force_set.objects.append(
        ExternalForce(name="lost", applied_to_body="block", force_identifier="f")
    )
    with pytest.raises(
        UnsupportedError, match=r"'/forceset/lost' \(ExternalForce outside of ExternalLoads"
    ):
        simulate(model, 0.01)


def test_what_older_versions_asked_for_is_ignored_and_what_is_misspelt_refused(model, tmp_path):
    """The public files of Rajagopal2016 contain the old properties."""
    data(tmp_path, np.ones((2, 9)))
    path = document(tmp_path, force(), version=30000)
    old = "<external_loads_model_kinematics_file>ik.mot</external_loads_model_kinematics_file>"
    old += "<lowpass_cutoff_frequency_for_load_kinematics>6</lowpass_cutoff_frequency_for_load_kinematics>"
    path.write_text(path.read_text().replace("<datafile>", f"{old}<datafile>"))
    assert len(read_external_loads(build_mechanism(model), path)) == 1
    path.write_text(path.read_text().replace("force_identifier", "force_identifer"))
    with pytest.raises(
        DocumentError, match=r"<force_identifer> is unknown .* mean <force_identifier>"
    ):
        read_external_loads(build_mechanism(model), path)
