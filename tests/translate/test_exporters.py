"""An exporter is one file: the command line, its help and its messages follow from it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from osimlite.cli import main
from osimlite.io.document.printer import write
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.translate import exporters

pytest.importorskip("numpy", reason="needs numpy (extra 'sim')")

NAMES = '''
"""A list of the bodies."""
from osimlite.base.choices import Choice
from osimlite.translate.exporters import Exporter

def write(model, *, folder, name, geometry, ending="txt"):
    from osimlite.translate import to_urdf
    made = to_urdf(model, folder=folder, name=name)
    text = "\\n".join(body.name for body in model.body_set.objects)
    class Names:
        robot, fidelity = made.robot, made.fidelity
        def write(self, folder):
            folder.mkdir()
            (folder / f"{name}.{ending}").write_text(text)
            return [folder / f"{name}.{ending}"]
    return Names()

EXPORTER = Exporter("names", "translate", "a list of bodies", write, (Choice("ending", str | None, "Of the file."),))
'''


@pytest.fixture(autouse=True)
def forget() -> Iterator[None]:
    """Let the exporters be looked up anew, in the test and after it."""
    forget_exporters()
    yield
    forget_exporters()


def forget_exporters() -> None:
    exporters.exporters.cache_clear()
    # The command takes its options from the exporters when its module is imported.
    sys.modules.pop("osimlite.cli.translate", None)


@pytest.fixture
def names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    more = tmp_path / "more"
    more.mkdir()
    (more / "names.py").write_text(NAMES)
    monkeypatch.setattr(exporters, "__path__", [*exporters.__path__, str(more)])
    monkeypatch.chdir(tmp_path)
    write(dynamic_walker(), "walker.osim")


def call(*words: str) -> int:
    with pytest.raises(SystemExit) as done:
        main([*words])
    return int(str(done.value.code or 0))


@pytest.mark.usefixtures("names")
def test_a_new_exporter_is_one_file(capsys: pytest.CaptureFixture[str]) -> None:
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
    code = "import sys; from osimlite.translate.exporters import exporters as e; e('view'), e('translate'); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & {
        "numpy",
        "lxml",
        "pydantic",
        "osimlite.view.shown",
        "osimlite.translate.export",
    }
