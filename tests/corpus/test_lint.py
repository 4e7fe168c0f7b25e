"""Check the linter's errors on corpus models.

There must be no error where OpenSim does what the file says, and the right error where OpenSim
rejects the file.
"""

from __future__ import annotations

import gzip
import json

import pytest

from osimlite.lint import validate
from tests.conftest import CorpusModel

# Errors in files that OpenSim loads, each with the reason why the error is right.
PROVED = {
    # Massless fingers are at the ends of chains: the mass matrix is singular, and accelerations are NaN.
    "m0109": {"OSIM407"},
    # The class has no property derivative_smoothing: it is missing in OpenSim's own print of the
    # file.
    "m0115": {"OSIM101"},
    # The muscle starts and ends at the same point of two bodies: OpenSim's acceleration is NaN.
    "m0123": {"OSIM541"},
    # The tags of the curves do not belong to the muscle any more: OpenSim prints its default curves
    # instead.
    "m0117": {"OSIM101"},
    # The file sets enable_controller to false, which is no property: OpenSim prints the controller
    # without <enabled>, so that it is on.
    "m0189": {"OSIM101"},
    # The file has <publications> three times: OpenSim prints only the first.
    "m0225": {"OSIM104"},
    # Two joints are named 'back': OpenSim renames one to /jointset/back_0.
    "m0239": {"OSIM311"},
    # The document holds no model: OpenSim loads an empty one.
    "m0356": {"OSIM003"},
}

REASONS = {
    "m0064": ("OSIM206", "<minimum_activation>", "minimum_activation"),
    "m0069": ("OSIM004", 'Version="10900"', "too old"),
    "m0113": ("OSIM102", "<PistonActuator", "no class 'PistonActuator'"),
    "m0119": ("OSIM102", "<BodyDragForce", "plug-in"),
    "m0181": ("OSIM004", 'Version="10600"', "too old"),
    "m0199": ("OSIM304", ">../toes_r<", "OpenSim 4.6 finds nothing there"),
    "m0321": ("OSIM001", "", "the file is empty"),
    "m0380": ("OSIM102", "<Smith2018ArticularContactForce", "plug-in"),
    "m0382": ("OSIM102", "<Smith2018ArticularContactForce", "plug-in"),
    "m0386": ("OSIM102", "<PistonActuator", "no class 'PistonActuator'"),
    "m0387": ("OSIM701", "<filename>", "'blockMesh.obj'"),
    "m0455": ("OSIM404", "pelvis_ground", "OpenSim rejects the model"),
    "m0459": ("OSIM303", "<ActivationCoordinateActuator", "expected the name of a Coordinate"),
    "m0460": ("OSIM303", "<PointToPointActuator", "expected the name of a Body"),
    "m0702": ("OSIM102", "<WISCO_Ligament", "no class 'WISCO_Ligament'"),
    "m0713": (
        "OSIM102",
        "<WISCO_ElasticFoundationForce",
        "no class 'WISCO_ElasticFoundationForce'",
    ),
    "m0719": ("OSIM303", "<PinJoint", "socket_child_frame"),
    "m0923": ("OSIM102", "<FixationController", "no class 'FixationController'"),
    "m1004": ("OSIM102", "<OrientationSensor", "no class 'OrientationSensor'"),
}
"""Expected error for each file that OpenSim rejects: code, content of the line, words of the message."""


def test_no_error_without_proof(corpus_model: CorpusModel) -> None:
    if corpus_model.converted is None:
        pytest.skip("OpenSim cannot load this file")
    # tests/oracle/test_lint_measures.py verifies the rules that measure paths and muscles.
    report = validate(corpus_model.path, ignore="OSIM63")
    assert {finding.code for finding in report.errors} == PROVED.get(corpus_model.id, set()), str(
        report
    )


def test_what_opensim_refuses_is_explained_in_its_line(corpus_model: CorpusModel) -> None:
    if corpus_model.converted is not None:
        pytest.skip("OpenSim loads this file")
    code, text, words = REASONS[corpus_model.id]
    lines = corpus_model.path.read_text("utf-8", "replace").splitlines() or [""]
    errors = validate(corpus_model.path, select=code).errors
    assert any(
        words in finding.message and finding.line is not None and text in lines[finding.line - 1]
        for finding in errors
    ), "\n".join(map(str, errors))


def test_the_lists_are_of_files_that_exist(corpus: list[CorpusModel]) -> None:
    assert set(PROVED) <= {model.id for model in corpus if model.converted is not None}
    assert set(REASONS) == {model.id for model in corpus if model.converted is None}


@pytest.mark.parametrize(("name", "gone"), [("m0115", "derivative_smoothing"), ("m0189", "enable")])
def test_opensim_drops_what_is_called_an_unknown_tag(
    corpus: list[CorpusModel], name: str, gone: str
) -> None:
    model = next(model for model in corpus if model.id == name)
    assert model.converted is not None
    text = gzip.decompress(model.converted.read_bytes()).decode()
    assert gone in model.path.read_text()
    if gone == "enable":
        text = text[text.index("<CorrectionController") :].split("</CorrectionController>")[0]
    assert f"<{gone}" not in text


def test_opensim_renames_the_second_joint_of_a_name(corpus: list[CorpusModel]) -> None:
    model = next(model for model in corpus if model.id == "m0239")
    paths = {
        path for path, _ in json.loads(gzip.decompress(model.truth.read_bytes()))["components"]
    }
    assert "/jointset/back_0" in paths
