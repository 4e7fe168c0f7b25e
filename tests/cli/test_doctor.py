"""The account of an installation."""

from __future__ import annotations

import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from typer import Typer
from typer.testing import CliRunner

from osimlite.cli.doctor import PURPOSES, Package, doctor, examine, requirements
from osimlite.errors import MissingFileError

ROOT = Path(__file__).parents[2]


def run(*arguments: str) -> tuple[int, str]:
    application = Typer()
    application.command()(doctor)
    done = CliRunner().invoke(application, list(arguments), env={"COLUMNS": "200"})
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


def test_every_extra_has_a_purpose() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert {*extras, ""} - {*PURPOSES} == {"all", "dev", "fast"}


def test_packages_of_the_plain_installation() -> None:
    assert {"lxml", "pydantic", "typer"} <= {*requirements()[""]}


def test_what_is_examined() -> None:
    assert examine("lxml") == Package("lxml", metadata.version("lxml"), "")
    assert examine("no-such-package-of-ours") == Package("no-such-package-of-ours", "", "")


def test_what_lies_in_the_current_folder_is_not_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lxml.py").write_text("raise SystemExit('executed')")
    monkeypatch.chdir(tmp_path)
    assert examine("lxml") == Package("lxml", metadata.version("lxml"), "")


def test_a_package_that_cannot_be_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "torn.py").write_text("raise OSError('libtorn.so: wrong ELF class')\n")
    info = tmp_path / "torn-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: torn\nVersion: 1.0\n")
    (info / "top_level.txt").write_text("torn\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    assert examine("torn") == Package("torn", "1.0", "OSError: libtorn.so: wrong ELF class")
    monkeypatch.setattr("osimlite.cli.doctor.requirements", lambda: {"": ["torn"], "sim": ["no-such-package"]})
    code, text = run(str(tmp_path))
    assert code == 1
    assert "torn 1.0 cannot be loaded: OSError: libtorn.so: wrong ELF class" in text
    assert "pip install 'osimlite[sim]'" in text


def test_where_meshes_are_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("osimlite.cli.doctor.requirements", lambda: {"": ["lxml"]})
    bones, more = tmp_path / "bones", tmp_path / "more"
    for folder, names in ((bones, ("a.vtp", "b.STL", "readme.txt")), (more, ())):
        folder.mkdir()
        for name in names:
            (folder / name).touch()
    (tmp_path / "osimlite.toml").write_text('mesh-paths = ["bones"]\n')
    monkeypatch.setenv("OSIMLITE_GEOMETRY", str(more))
    (tmp_path / "model.osim").touch()
    code, text = run(str(tmp_path / "model.osim"))
    assert code == 0
    lines = [line.strip() for line in text.splitlines()]
    assert f"settings: {tmp_path / 'osimlite.toml'}" in lines
    searched = lines[lines.index("mesh folders, in the order of the search:") + 1 :][:4]
    assert searched == [
        f"{tmp_path}: no mesh files",
        f"{tmp_path / 'Geometry'}: not there",
        f"{bones}: 2 mesh files",
        f"{more}: no mesh files",
    ]


def test_a_model_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MissingFileError, match=r"none.osim: there is no such file or folder"):
        run(str(tmp_path / "none.osim"))
