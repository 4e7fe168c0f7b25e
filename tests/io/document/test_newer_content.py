"""Check documents whose content is newer than the version that they state."""

from __future__ import annotations

from pathlib import Path

import pytest

import osimlite
from osimlite.errors import VersionError
from osimlite.io.document.reader import read_text, require_stated_version
from osimlite.io.document.source import Source
from osimlite.lint import validate
from tests.cli.command import run
from tests.lint.verdict_cases import small_model

MODEL_ALONE = (
    small_model().replace('<OpenSimDocument Version="40600">', "").replace("</OpenSimDocument>", "")
)


def test_a_model_without_a_document_is_read_as_it_was_dumped(tmp_path: Path):
    path = tmp_path / "m.osim"
    path.write_text(MODEL_ALONE)
    model = osimlite.read(path)
    assert osimlite.to_text(model) == osimlite.to_text(read_text(small_model()))
    (finding,) = validate(path).errors
    assert finding.code == "OSIM004" and '<OpenSimDocument Version="40600">' in finding.message
    done = run("upgrade", path, "-o", tmp_path / "new.osim")
    assert done.code == 0
    assert not validate(tmp_path / "new.osim").errors


@pytest.mark.parametrize("version", [20303, 30000, 30500])
def test_a_document_that_states_too_old_a_version_is_not_upgraded(tmp_path: Path, version: int):
    path = tmp_path / "m.osim"
    path.write_text(small_model().replace("40600", str(version)))
    done = run("upgrade", path, "-o", tmp_path / "new.osim")
    assert done.code == 2 and 'write Version="40600"' in done.err
    assert not (tmp_path / "new.osim").exists()
    with pytest.raises(VersionError, match="exists only since version"):
        require_stated_version(Source.from_file(path))
    assert any("did you mean" not in finding.message for finding in validate(path).errors)


@pytest.mark.corpus
def test_a_real_document_states_its_version(corpus_model):
    source = Source.from_file(corpus_model.path)
    try:
        require_stated_version(source)
    except VersionError as error:
        assert "exists only since" not in str(error)
    except osimlite.OsimliteError:
        pytest.skip("it is no document")


def test_an_old_controller_that_names_an_actuator_twice_is_said_to_be_refused():
    text = small_model(
        forces='<CoordinateActuator name="m"><coordinate>q</coordinate></CoordinateActuator>',
        controllers='<PrescribedController name="c"><actuator_list>m m</actuator_list></PrescribedController>',
    ).replace("40600", "40000")
    report = validate(Source(text.encode(), "m.osim"))
    assert any("names an actuator twice" in finding.message for finding in report.errors), str(
        report
    )
