"""Tests of ``upgrade`` on the command line."""

from __future__ import annotations

import shutil
import stat
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner, Result

from osimlite.cli.upgrade import upgrade
from osimlite.errors import OsimliteError
from osimlite.io.document.reader import read_document
from osimlite.io.document.source import Source
from osimlite.schema.model import CURRENT_VERSION


def run(*arguments: object) -> Result:
    application = Typer()
    application.command()(upgrade)
    result = CliRunner().invoke(
        application, [str(argument) for argument in arguments], env={"COLUMNS": "80"}
    )
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


@pytest.fixture
def old(fixtures: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(fixtures / "versions" / "meaningless.osim", tmp_path / "leg.osim"))


def test_the_file_is_written_beside_the_old_one(old: Path, fixtures: Path) -> None:
    before = old.read_bytes()
    result = run(old)
    target = old.with_name(f"leg_{CURRENT_VERSION}.osim")
    assert result.exit_code == 0
    assert (
        target.read_text() == (fixtures / "versions" / "upgraded" / "meaningless.osim").read_text()
    )
    assert old.read_bytes() == before
    assert f"version 20303 to {CURRENT_VERSION}" in result.output


def test_the_report_says_what_changed_where_and_what_was_lost(old: Path) -> None:
    output = run(old, "-o", old.with_name("new.osim")).output
    lines = output.splitlines()
    assert all(len(line) <= 80 for line in lines[:-1])
    assert lines[0].split() == ["What", "changed", "Places", "First", "line"]
    [inertia] = [line for line in lines if line.startswith("Combine the six numbers of inertia")]
    assert inertia.split()[-2:] == ["1", "9"]
    assert "lost: Vmax 12 (line 38, Thelen2003Muscle 'vastus')" in lines


def test_a_file_that_is_there_is_not_overwritten_unless_named(old: Path) -> None:
    target = old.with_name(f"leg_{CURRENT_VERSION}.osim")
    target.write_text("mine")
    with pytest.raises(OsimliteError, match="exists already"):
        run(old)
    assert target.read_text() == "mine"
    run(old, "-o", target)
    assert read_document(Source.from_file(target)).version == CURRENT_VERSION


def test_the_file_itself_is_overwritten_only_when_named(old: Path) -> None:
    old.chmod(0o640)
    run(old, "-o", old)
    assert read_document(Source.from_file(old)).changes == []
    assert stat.S_IMODE(old.stat().st_mode) == 0o640


def test_a_current_file_needs_nothing(fixtures: Path, tmp_path: Path) -> None:
    current = shutil.copy(fixtures / "versions" / "upgraded" / "names.osim", tmp_path / "a.osim")
    result = run(current)
    assert result.exit_code == 0
    assert "nothing to do" in result.output
    assert list(tmp_path.iterdir()) == [Path(current)]


def test_text_that_is_no_xml_is_told(old: Path) -> None:
    old.write_text(
        old.read_text().replace('<Model name="old">', '<Model name="old"><credits>A & B</credits>')
    )
    assert "line 3: '&' is not XML and was read as it stands" in run(old).output


def test_nothing_is_written_for_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    broken = tmp_path / "broken.osim"
    broken.write_text('<OpenSimDocument Version="30000"><Model>')
    with pytest.raises(OsimliteError, match="not well-formed"):
        run(broken)
    with pytest.raises(OsimliteError, match="no such file"):
        run(tmp_path / "absent.osim")
    assert list(tmp_path.iterdir()) == [broken]


def test_numbers_as_opensim_prints_them(old: Path) -> None:
    run(old, "--numbers", "opensim", "-o", old)
    assert "<location>0.10000000000000001 0 0</location>" in old.read_text()
    with pytest.raises(OsimliteError, match="--numbers"):
        run(old, "--numbers", "many")


def test_a_setup_file_keeps_its_kind(fixtures: Path, tmp_path: Path) -> None:
    setup = Path(shutil.copy(fixtures / "versions" / "one_trial.xml", tmp_path / "ik.xml"))
    output = run(setup).output
    target = setup.with_name(f"ik_{CURRENT_VERSION}.xml")
    assert target.read_text() == (fixtures / "versions" / "upgraded" / "one_trial.xml").read_text()
    assert output.splitlines()[-1] == f"{target}: version 20201 to {CURRENT_VERSION}, 2 changes"
