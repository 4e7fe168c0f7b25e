"""Check that commands write only where the user has asked them to (SECURITY.md states the rule)."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from zlib import crc32

import pytest

from osimlite import __version__
from osimlite.base.reading import describe_content
from osimlite.base.result_writing import ResultWriter, project_folder
from osimlite.base.writing import WriteRefusedError, write_atomically, write_into
from osimlite.errors import OsimliteError
from tests.cli.command import Done, run

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows users may make no links")

SETUP = """<OpenSimDocument Version="40600"><InverseDynamicsTool name="swing">
<results_directory>{folder}</results_directory><model_file>model.osim</model_file>
<coordinates_file>angles.sto</coordinates_file><output_gen_force_file>{name}</output_gen_force_file>
</InverseDynamicsTool></OpenSimDocument>
"""
ANGLES = "motion\nversion=1\nnRows=12\nnColumns=3\ninDegrees=no\nendheader\ntime\tq0\tq1\n"
OWN = "# precious\n"
RESULT = "Inverse Dynamics Generalized Forces\nversion=1\nnRows=0\nnColumns=1\nendheader\ntime\n"
OTHER_TABLE = RESULT.replace("Inverse Dynamics Generalized Forces", "Coordinates")
MESSY = '<OpenSimDocument Version="40600"><Model name="m"><gravty>0 -5 0</gravty></Model></OpenSimDocument>'


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Redirect the user's cache to a folder of the test."""
    folder = tmp_path_factory.mktemp("cache")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    return folder


@pytest.fixture
def study(tmp_path: Path, fixtures: Path) -> Path:
    """Return the folder of a project from an untrusted source, next to the home of the user."""
    folder, home = tmp_path / "study", tmp_path / "home"
    folder.mkdir()
    home.mkdir()
    (home / ".bashrc").write_text(OWN)
    (home / "thesis.docx").write_bytes(b"PK\x03\x04" + b"\0" * 40)
    model = (fixtures / "pipelines" / "pendulum" / "model.osim").read_text()
    (folder / "model.osim").write_text(model)
    rows = (f"{0.1 * k:.1f}\t{0.01 * k * k:.4f}\t0.1\n" for k in range(12))
    (folder / "angles.sto").write_text(ANGLES + "".join(rows))
    return folder


def compute(study: Path, folder: str, name: str, *words: object) -> Done:
    """Run a setup that names an output folder and a result file."""
    (study / "setup.xml").write_text(SETUP.format(folder=folder, name=name))
    return run("run", "setup.xml", *words, folder=study)


@pytest.mark.parametrize(
    ("folder", "name", "words"),
    [
        ("../home", ".bashrc", "hidden file"),
        ("../home", "thesis.docx", "the name of a result ends in"),
        ("../../../../../../../../../../var/osimlite-test", "a.sto", "outside of"),
        ("/var/osimlite-test", "a.sto", "outside of"),
        (".git/hooks", "pre-commit.sto", "hidden file"),
        ("out", "Makefile.py", "the name of a result ends in"),
        ("out", "-", "needs the name of a file|ends in|no equilibrium|names no"),
    ],
)
def test_a_setup_cannot_name_any_file(study: Path, folder: str, name: str, words: str) -> None:
    before = contents(study.parent)
    done = compute(study, folder, name)
    if name == "-":
        # OpenSim accepts a name without an ending.
        assert done.code == 0
        return
    assert done.code == 2 and words in " ".join(done.err.split())
    assert contents(study.parent) == before | {
        study / "setup.xml": (study / "setup.xml").read_bytes()
    }


@pytest.mark.parametrize("there", [OWN, OTHER_TABLE, "", "{}", "<html/>"])
def test_only_a_result_of_the_same_kind_is_replaced(study: Path, there: str) -> None:
    place = study / "forces.sto"
    place.write_text(there)
    done = compute(study, ".", "forces.sto")
    if there == "":
        assert done.code == 0
        return
    assert done.code == 2 and "a result would replace this file" in " ".join(done.err.split())
    assert place.read_text() == there
    assert compute(study, ".", "forces.sto", "--overwrite").code == 0
    assert place.read_text().startswith("Inverse Dynamics")


def test_the_same_setup_runs_again_and_beside_its_folder(study: Path) -> None:
    for _ in range(2):
        assert compute(study, "../results", "forces.sto").code == 0
    assert (study.parent / "results" / "forces.sto").read_text().startswith("Inverse Dynamics")


def test_what_is_farther_away_needs_an_option(
    study: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    away = tmp_path_factory.mktemp("away")
    assert compute(study, str(away), "forces.sto").code == 2
    assert not list(away.iterdir())
    assert compute(study, str(away), "forces.sto", "--write-outside").code == 0
    assert compute(study, ".", "forces.sto", "-o", away / "own").code == 0
    assert sorted(path.name for path in away.iterdir()) == ["forces.sto", "own"]


@pytest.mark.parametrize("kind", ["file", "folder", "nothing"])
def test_no_result_goes_through_a_link(study: Path, kind: str) -> None:
    target = study.parent / "home" / "table.sto"
    if kind != "nothing":
        target.write_text(RESULT)
    if kind == "folder":
        (study / "Results").symlink_to("/var")
        assert compute(study, "Results/osimlite", "table.sto").code == 2
        return
    (study / "table.sto").symlink_to(target)
    done = compute(study, ".", "table.sto")
    assert done.code == 2 and "names a link" in " ".join(done.err.split())
    assert target.exists() == (kind == "file")
    assert compute(study, ".", "table.sto", "--overwrite").code == 0
    assert not (study / "table.sto").is_symlink()
    assert kind == "nothing" or target.read_text() == RESULT


@pytest.mark.parametrize("words", [(), ("--overwrite",)])
def test_a_result_does_not_wait_for_a_pipe(study: Path, words: tuple[str, ...]) -> None:
    os.mkfifo(study / "pipe.sto")
    done = compute(study, ".", "pipe.sto", *words)
    assert done.code == 2 and "a pipe or a device" in done.err


def test_a_file_that_the_user_names_may_be_no_waiting_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OsimliteError, match="no program reads from this pipe"):
        write_atomically(tmp_path / "pipe", "text")


def test_the_input_with_a_hard_link_keeps_its_content(study: Path) -> None:
    other = study.parent / "home" / "mine.sto"
    other.write_text(RESULT)
    os.link(other, study / "forces.sto")
    assert compute(study, ".", "forces.sto").code == 0
    assert other.read_text() == RESULT


def journal_of(study: Path) -> Path:
    (study / "bad.xml").write_text(
        SETUP.format(folder=".", name="b.sto").replace("angles.sto", "gone.sto")
    )
    (study / "setup.xml").write_text(SETUP.format(folder="out", name="forces.sto"))
    return study / ".osimlite-run.jsonl"


def test_the_journal_is_not_written_through_a_link(study: Path) -> None:
    journal, own = journal_of(study), study.parent / "home" / ".bashrc"
    journal.symlink_to(own)
    assert run("run", "setup.xml", "bad.xml", folder=study).code == 2
    assert own.read_text() == OWN and not journal.is_symlink()


@pytest.mark.parametrize("words", [(), ("--resume",)])
def test_a_pipe_in_the_place_of_the_journal(study: Path, words: tuple[str, ...]) -> None:
    os.mkfifo(journal_of(study))
    assert run("run", "setup.xml", "bad.xml", *words, folder=study).code == 2


@pytest.mark.parametrize(
    "damage",
    [
        {"messages": 5},
        {"messages": [["a"]]},
        {"messages": [["a", 1]]},
        {"files": 5},
        {"files": [5]},
        {"failure": [5]},
        {"warnings": {"a": 1}},
        {"warnings": [1]},
        {"summary": []},
        {"summary": {"rms_marker_error": "x"}},
        {"seconds": "x"},
        {"status": []},
        {"status": "other"},
        {"setup": None},
        {"digest": 1},
        {"more": 1},
    ],
    ids=str,
)
def test_a_damaged_journal_counts_for_nothing(study: Path, damage: dict[str, object]) -> None:
    from osimlite.tools.many import RunRecord, read_record

    line = json.dumps(vars(RunRecord("setup.xml", "done")))
    assert read_record(line.encode()) is not None
    assert read_record(json.dumps(json.loads(line) | damage).encode()) is None
    assert read_record(b"[" * 100_000) is None


def test_findings_are_not_kept_in_a_project(tmp_path: Path, cache: Path) -> None:
    """Links that a project has at the old location of the cache are not followed."""
    own, repo = tmp_path / "mine", tmp_path / "repo"
    own.write_text(OWN)
    repo.mkdir()
    (repo / "m.osim").write_text(MESSY)
    (repo / "osimlite.toml").write_text("")
    digest = f"{crc32(str(repo / 'm.osim').encode()):08x}"
    entry = repo / ".osimlite_cache" / __version__ / digest[:2] / f"{digest[2:]}.json"
    entry.parent.mkdir(parents=True)
    entry.symlink_to(own)
    (repo / ".osimlite_cache" / ".gitignore").symlink_to(tmp_path / "new")
    assert run("validate", ".", folder=repo).code == 1
    assert own.read_text() == OWN and not (tmp_path / "new").exists()
    assert list(cache.rglob("*.json"))


def test_a_relative_cache_folder_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "cache").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "m.osim").write_text(MESSY)
    assert run("validate", "m.osim", folder=tmp_path).code == 1
    assert not list((tmp_path / "elsewhere").iterdir())


REWRITES = (("validate", "--unsafe-fixes"), ("format",))


@pytest.mark.parametrize("words", REWRITES, ids=" ".join)
@pytest.mark.parametrize("named", [".", "m.osim"])
def test_files_are_not_rewritten_through_a_link_out_of_the_project(
    tmp_path: Path, words: tuple[str, ...], named: str
) -> None:
    repo, other = tmp_path / "repo", tmp_path / "other"
    repo.mkdir()
    other.mkdir()
    (other / "mine.osim").write_text(MESSY)
    (repo / "m.osim").symlink_to("../other/mine.osim")
    done = run(*words, named, folder=repo)
    assert done.code != 0 and "is not followed" in " ".join(done.err.split())
    assert (other / "mine.osim").read_text() == MESSY


def test_folders_behind_links_are_not_fixed(tmp_path: Path) -> None:
    repo, other = tmp_path / "repo", tmp_path / "other"
    repo.mkdir()
    other.mkdir()
    (other / "mine.osim").write_text(MESSY)
    (repo / "own.osim").write_text(MESSY)
    (repo / "models").symlink_to(other)
    run("validate", ".", "--unsafe-fixes", folder=repo)
    assert (other / "mine.osim").read_text() == MESSY
    assert (repo / "own.osim").read_text() != MESSY


def test_links_within_a_project_are_followed(tmp_path: Path) -> None:
    (tmp_path / ".git").mkdir()
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    (tmp_path / "a" / "m.osim").write_text(MESSY)
    (tmp_path / "b" / "m.osim").symlink_to("../a/m.osim")
    run("validate", "b/m.osim", "--unsafe-fixes", folder=tmp_path)
    assert (tmp_path / "a" / "m.osim").read_text() != MESSY


def test_the_default_folder_of_results_is_no_link(study: Path) -> None:
    (study / "model").symlink_to(study.parent / "home")
    done = run("inverse-dynamics", "model.osim", "angles.sto", folder=study)
    assert done.code == 2 and "through this link" in " ".join(done.err.split())
    assert sorted(path.name for path in (study.parent / "home").iterdir()) == [
        ".bashrc",
        "thesis.docx",
    ]


def test_the_project_of_a_document(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    setup = tmp_path / "lab" / "subject" / "setups" / "ik.xml"
    setup.parent.mkdir(parents=True)
    setup.touch()
    assert project_folder(setup) == str(tmp_path / "lab" / "subject")
    (tmp_path / "lab" / "pyproject.toml").touch()
    assert project_folder(setup) == str(tmp_path / "lab")
    monkeypatch.setenv("HOME", str(tmp_path / "lab" / "subject"))
    assert project_folder(setup) == str(setup.parent)


def test_a_program_that_chooses_a_name_replaces_a_link(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text(OWN)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").symlink_to("../mine")
    write_into(tmp_path / "out", "summary.json", "{}")
    assert (tmp_path / "mine").read_text() == OWN
    assert (tmp_path / "out" / "summary.json").read_text() == "{}"
    (tmp_path / "out" / "folder").mkdir()
    with pytest.raises(OsimliteError, match="this is a folder"):
        write_into(tmp_path / "out", "folder", "")


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        (
            "<?xml version='1.0'?>\n<!-- a -- b -->\n<OpenSimDocument Version='1'><Model name='m'>",
            "<Model>",
        ),
        ("<OpenSimDocument><!-- x --><ScaleSet", "<ScaleSet>"),
        ("<Model name='m'>", None),
        (RESULT, "'Inverse Dynamics Generalized Forces'"),
        ("inDegrees=no\nDataType=double\nversion=3\nendheader\n", "table ''"),
        ("PathFileType\t4\t(X/Y/Z)\ta.trc\n", "a table of markers"),
        ("Average Residuals:\n\n", "residuals"),
        ("#!/bin/sh\nendheader\n", None),
        ("a\0" + RESULT, None),
        ("", None),
    ],
)
def test_kinds_of_results(text: str, kind: str | None) -> None:
    found = describe_content(text.encode())
    assert found is None if kind is None else kind in (found or "")


def test_names_of_results_without_a_tool(tmp_path: Path) -> None:
    writer = ResultWriter.for_document(tmp_path / "a" / "setup.xml", tmp_path / "a")
    for name in ("a\0.sto", "..", "b/../../c.sto", ".a.sto", "b/.c/d.sto"):
        with pytest.raises(WriteRefusedError):
            writer.resolve(tmp_path / "a" / name)
    assert writer.resolve(tmp_path / "a" / "b" / "c.STO") == tmp_path / "a" / "b" / "c.STO"


def contents(folder: Path) -> dict[Path, bytes]:
    """Return all files below a folder.

    Returns:
        The content of each file by its path.
    """
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_table_without_a_name_is_a_result(tmp_path: Path) -> None:
    """OpenSim names the states of RRA and CMC 'UNKNOWN'."""
    writer = ResultWriter.for_document(tmp_path / "setup.xml", tmp_path)
    path = tmp_path / "it_states.sto"
    path.write_text(RESULT.replace(RESULT.partition("\n")[0], "UNKNOWN"))
    writer.expect_replaceable(path, RESULT.encode())
    path.write_text(RESULT.replace(RESULT.partition("\n")[0], "Coordinates"))
    with pytest.raises(WriteRefusedError):
        writer.expect_replaceable(path, RESULT.encode())
