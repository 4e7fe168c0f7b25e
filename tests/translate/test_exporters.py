"""Tests of the table of exporters: command line, help and messages follow from an entry."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from osimlite.base.options import OptionSpec
from osimlite.cli import main
from osimlite.io.document.printer import write
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.translate import exporters
from osimlite.translate.exporters import Exporter

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")


class Names:
    """Translation of a model to a list of its bodies."""

    def __init__(self, model: Any, name: str, ending: str, made: Any) -> None:
        self.robot, self.fidelity = made.robot, made.fidelity
        self.text = "\n".join(body.name for body in model.body_set.objects)
        self.file = f"{name}.{ending}"

    def write(self, folder: Path) -> list[Path]:
        folder.mkdir()
        (folder / self.file).write_text(self.text)
        return [folder / self.file]


def write_names(
    model: Any, *, folder: Path, name: str, geometry: Any, ending: str = "txt"
) -> Names:
    from osimlite.translate import to_urdf

    return Names(model, name, ending, to_urdf(model, folder=folder, name=name))


@pytest.fixture(autouse=True)
def forget() -> Iterator[None]:
    """Make the command import its options anew, in the test and after it."""
    # The command reads its options from the exporters when its module is imported.
    sys.modules.pop("osimlite.cli.translate", None)
    yield
    sys.modules.pop("osimlite.cli.translate", None)


@pytest.fixture
def names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    choices = (OptionSpec("ending", str | None, "Of the file."),)
    exporter = Exporter("names", "translate", "a list of bodies", write_names, choices)
    monkeypatch.setattr(exporters, "EXPORTERS", [*exporters.EXPORTERS, exporter])
    monkeypatch.chdir(tmp_path)
    write(dynamic_walker(), "walker.osim")


def call(*words: str) -> int:
    with pytest.raises(SystemExit) as done:
        main([*words])
    return int(str(done.value.code or 0))


@pytest.mark.usefixtures("names")
def test_a_new_exporter_is_one_entry(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("translate", "walker.osim", "--to", "names", "--ending", "lst", "-o", "out") == 0
    assert "RightThigh" in Path("out/walker.lst").read_text()
    assert call("translate", "--help") == 0
    told = " ".join(capsys.readouterr().out.replace("│", " ").split())
    assert "'names' writes a list of bodies" in told and "--ending" in told
    assert call("translate", "walker.osim", "--ending", "lst") == 2
    assert "--ending is an option of --to names" in capsys.readouterr().err
    assert call("translate", "walker.osim", "--to", "name") == 2
    assert "'names'" in capsys.readouterr().err


def test_exporters_are_told_without_what_they_work_with() -> None:
    code = (
        "import sys; from osimlite.translate.exporters import list_exporters;"
        "list_exporters('view'), list_exporters('translate'); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & {
        "numpy",
        "lxml",
        "pydantic",
        "osimlite.view.model_view",
        "osimlite.translate.export",
    }
