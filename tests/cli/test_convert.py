"""Tests of ``convert``: formats follow from suffix and content, and each conversion writes a record of losses."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import osimlite
from osimlite.cli import main
from osimlite.models.dynamic_walker import dynamic_walker
from osimlite.translate import importers
from osimlite.translate.fidelity import Fidelity
from osimlite.translate.importers import Importer
from tests.cli.command import run


@pytest.fixture
def walker(tmp_path: Path) -> Path:
    osimlite.write(dynamic_walker(), tmp_path / "walker.osim")
    return tmp_path


@pytest.mark.parametrize(
    ("words", "main_file", "target"),
    [
        (("-o", "robot/w.urdf"), "robot/w.urdf", "urdf"),
        (("-o", "robot/w.xml"), "robot/w.xml", "mjcf"),
        (("-o", "robot", "--to", "urdf"), "robot/walker.urdf", "urdf"),
        (("--to", "mjcf"), "walker/walker.xml", "mjcf"),
        (("-o", "robot/w.glb"), "robot/w.glb", "glb"),
    ],
)
def test_the_format_follows_from_the_names(
    walker: Path, words: tuple[str, ...], main_file: str, target: str
) -> None:
    code, out, _ = run("convert", "walker.osim", *words, folder=walker)
    folder = (walker / main_file).parent
    summary = json.loads((folder / "summary.json").read_text())
    fidelity = json.loads((folder / "fidelity.json").read_text())
    assert code == 0 and (walker / main_file).exists() and main_file in out
    assert (summary["from"], summary["to"]) == ("osim", target)
    assert summary["files"][0] == Path(main_file).name
    assert fidelity["target"].startswith(target)
    assert target != "mjcf" or "Lost or approximated in MJCF (MuJoCo): " in out
    assert summary["parts"]["left_out"] == len(
        {each["component"] for each in fidelity["records"] if each["how"] == "dropped"}
    )


def test_formats_are_listed() -> None:
    code, out, _ = run("convert", "--formats")
    assert code == 0
    assert all(name in out for name in ("osim", "urdf", "mjcf", "glb", *importers.list_importers()))
    assert max(map(len, out.splitlines())) <= 80


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ((), "name a file to convert"),
        (("walker.osim",), "name a file with -o"),
        (("walker.osim", "-o", "out"), "name a file with -o"),
        (("walker.osim", "--to", "urdv"), "unknown format 'urdv'; did you mean 'urdf'?"),
        (("walker.osim", "--from", "x"), "--from: unknown format 'x'"),
        (
            ("notes.txt",),
            "does not recognize the format of 'notes.txt'; name the format with --from",
        ),
        (("notes",), "does not recognize the format of 'notes'; name the format with --from"),
        (("robot.urdf",), "osimlite writes URDF files, but does not read them"),
        (("walk.trc",), "'walk.trc' is a table of OpenSim"),
        (("gone.b3d",), "no such file"),
        (("gone.xml", "--from", "osim", "-o", "walker.osim"), "osimlite upgrade"),
        (("gone.osim", "--from", "osim", "-o", "notes.xml"), "no such file"),
        (("walker.osim", "-o", "new.osim"), "'osimlite upgrade'"),
        (("walker.osim", "--to", "project"), "cannot be written as 'project'"),
        (("walker.osim", "-o", "x.urdf", "--to", "mjcf"), "-o names a file of the format 'urdf'"),
        (("walker.osim", "-o", "w.xyz"), "'convert' cannot write '.xyz' files"),
        (("walker.osim", "--to", "mjcf", "--merge"), "--merge is not an option of a conversion"),
        (("walker.osim", "--to", "urdf", "--motion", "m.mot"), "cannot contain a motion"),
    ],
)
def test_what_cannot_be_converted_is_said_in_one_line(
    walker: Path, words: tuple[str, ...], message: str
) -> None:
    for name in ("notes", "notes.txt", "notes.xml", "robot.urdf", "walk.trc"):
        (walker / name).write_text("nothing")
    code, out, error = run("convert", *words, folder=walker)
    assert code == 2 and out == "" and len(error.splitlines()) == 1 and message in error


class Names:
    """Importer of an example format: a list of names of bodies."""

    def __init__(self, path: Path, name: str) -> None:
        self.model: Any = osimlite.Model(name=name)
        for body in path.read_text().split():
            self.model.add(osimlite.Body(name=body, mass=1.0, inertia=(1.0,) * 3 + (0.0,) * 3))
        self.fidelity, self.summary = Fidelity(name, "osim"), {"bodies": 2}
        self.fidelity.add("list", "/a", "a joint", "left out")

    def write(self, folder: str | Path) -> list[Path]:
        path = Path(folder, f"{self.model.name}.osim")
        path.parent.mkdir(exist_ok=True)
        osimlite.write(self.model, path)
        return [path]


def test_a_new_importer_is_one_entry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    entry = Importer(
        "names", "list of names", (".lst",), "osim", "bodies", lambda path, name: Names(path, name)
    )
    monkeypatch.setattr(importers, "IMPORTERS", [entry])
    monkeypatch.setattr("osimlite.cli.convert.IMPORTERS", [entry])
    monkeypatch.chdir(tmp_path)
    Path("two.lst").write_text("a b")
    for words in (("-o", "x/some.osim"), ("-o", "y/some.urdf")):
        with pytest.raises(SystemExit) as done:
            main(["convert", "two.lst", *words])
        assert not done.value.code, capsys.readouterr().err
    assert len(osimlite.read("x/some.osim").body_set.objects) == 2
    # Losses of the first of two steps are recorded in the result.
    for folder in "xy":
        records = json.loads(Path(folder, "fidelity.json").read_text())["records"]
        assert records[0]["kind"] == "list"
        assert json.loads(Path(folder, "summary.json").read_text())["bodies"] == 2


def test_summaries_of_other_commands_are_not_replaced(walker: Path) -> None:
    assert run("simulate", "walker.osim", "--to", "0.02", "-o", "r", folder=walker).code == 0
    before = (walker / "r" / "summary.json").read_bytes()
    words = ("convert", "walker.osim", "--motion", "r/states.sto", "-o")
    done = run(*words, "r/w.glb", folder=walker)
    assert done.code == 2 and "r/summary.json" in done.err and "another folder" in done.err
    assert (walker / "r" / "summary.json").read_bytes() == before
    assert not (walker / "r" / "w.glb").exists()
    # A conversion replaces the summary of an earlier conversion.
    for _ in range(2):
        assert run(*words, "new/w.glb", folder=walker).code == 0


@pytest.mark.parametrize("words", [("-o", "m.xml"), ("-o", ".", "--to", "mjcf"), ("-o", "l.xml")])
def test_the_input_is_not_replaced(walker: Path, words: tuple[str, ...]) -> None:
    text = (walker / "walker.osim").read_bytes()
    (walker / "m.xml").write_bytes(text)
    (walker / "l.xml").hardlink_to(walker / "m.xml")
    done = run("convert", "m.xml", *words, folder=walker)
    assert done.code == 2 and "would be replaced" in done.err
    assert (walker / "m.xml").read_bytes() == text


def test_folders_can_have_dots(walker: Path) -> None:
    assert run("convert", "walker.osim", "-o", "v1.2", "--to", "urdf", folder=walker).code == 0
    (walker / "old.xml").mkdir()
    assert run("convert", "walker.osim", "-o", "old.xml", "--to", "urdf", folder=walker).code == 0
    assert (walker / "v1.2" / "walker.urdf").exists() and (walker / "old.xml/walker.urdf").exists()


def test_formats_are_listed_without_what_reads_them() -> None:
    code = "import sys; from osimlite.translate.importers import list_importers; list_importers(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert not set(done.stdout.split()) & {"numpy", "lxml", "pydantic", "mujoco"}


def test_an_output_with_a_foreign_suffix_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "a.bvh").write_text(BVH)
    code, _, message = run("convert", "a.bvh", "-o", "m.csv", folder=tmp_path)
    assert code == 2 and "'.trc'" in message and not (tmp_path / "m.csv").exists()
    assert run("convert", "a.bvh", "-o", "take-1.2", folder=tmp_path).code == 0
    assert (tmp_path / "take-1.2" / "a.trc").exists()


BVH = """HIERARCHY
ROOT a
{
  OFFSET 0 0 0
  CHANNELS 3 Xrotation Yrotation Zrotation
}
MOTION
Frames: 1
Frame Time: 0.1
0 0 0
"""


def test_a_folder_has_the_record_of_one_conversion(walker: Path) -> None:
    assert run("convert", "walker.osim", "-o", "out/a.urdf", folder=walker).code == 0
    assert run("convert", "walker.osim", "-o", "out/a.urdf", folder=walker).code == 0
    before = (walker / "out" / "fidelity.json").read_text()
    for command in (
        ("convert", "walker.osim", "-o", "out/b.urdf"),
        ("convert", "walker.osim", "-o", "out/a.glb"),
        ("translate", "walker.osim", "--to", "mjcf", "-o", "out"),
    ):
        code, _, message = run(*command, folder=walker)
        assert code == 2 and "is the record of another conversion" in message
        assert "--overwrite" in message
        assert (walker / "out" / "fidelity.json").read_text() == before
    assert run("convert", "walker.osim", "-o", "out/b.urdf", "--overwrite", folder=walker).code == 0


@pytest.mark.parametrize("name", ["w.urdf", "w.coordinates.json"])
def test_files_of_others_are_not_replaced(walker: Path, name: str) -> None:
    (walker / "out").mkdir()
    (walker / "out" / name).write_text("mine")
    words = ("convert", "walker.osim", "-o", "out/w.urdf")
    code, _, message = run(*words, folder=walker)
    assert code == 2 and f"{name}' exists already" in message
    assert (walker / "out" / name).read_text() == "mine"
    assert run(*words, "--overwrite", folder=walker).code == 0
    assert (walker / "out" / name).read_text() != "mine"


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (("static-optimization", "a.osim", "b.mot", "--to", "1"), "--until"),
        (("simulate", "a.osim", "--until", "1"), "--to"),
    ],
)
def test_the_last_time_has_two_names(words: tuple[str, ...], advice: str) -> None:
    code, _, message = run(*words)
    assert code == 2 and f"(Possible options: {advice})" in message
