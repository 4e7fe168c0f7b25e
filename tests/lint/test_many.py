"""Check many files at once: the cache of findings, when it is used, and parallel work."""

from __future__ import annotations

import json
import os
import shutil
import sys
import time
from pathlib import Path

import pytest

from osimlite.base.writing import user_cache_folder
from osimlite.errors import MissingFileError
from osimlite.lint import Config, validate
from osimlite.lint import many as module
from osimlite.lint.cache import describe_code_version
from osimlite.lint.many import SourceTexts, check_files, find_settings
from osimlite.lint.project_files import is_opensim_xml

MESH = """\
<OpenSimDocument Version="40600">
<Model name="m">
<BodySet><objects><Body name="b">
<attached_geometry><Mesh name="g"><mesh_file>bone.vtp</mesh_file></Mesh></attached_geometry>
<mass>1</mass><inertia>1 1 1 0 0 0</inertia></Body></objects></BodySet>
<JointSet><objects><FreeJoint name="j"><socket_parent_frame>/ground</socket_parent_frame>
<socket_child_frame>/bodyset/b</socket_child_frame></FreeJoint></objects></JointSet>
<gravty>0 0 0</gravty>
</Model>
</OpenSimDocument>
"""


@pytest.fixture
def project(tmp_path):
    find_settings.__globals__["load_settings"].cache_clear()
    module.resolve_folder.cache_clear()
    (tmp_path / "osimlite.toml").write_text("")
    (tmp_path / "m.osim").write_text(MESH)
    yield tmp_path
    find_settings.__globals__["load_settings"].cache_clear()


@pytest.fixture
def checked(monkeypatch):
    """Return a list that grows by the name of each file that is checked instead of taken from the cache."""
    files: list[str] = []
    real = module.check_job

    def spy(job):
        files.append(Path(job.file).name)
        return real(job)

    monkeypatch.setattr(module, "check_job", spy)
    return files


def codes(project, **options):
    return sorted(
        finding.code for finding in check_files([str(project / "m.osim")], Config(), **options)
    )


def test_an_unchanged_file_is_not_checked_again(project, checked):
    first = check_files([str(project / "m.osim")], Config())
    again = check_files([str(project / "m.osim")], Config())
    assert checked == ["m.osim"]
    assert again.findings == first.findings == validate(project / "m.osim").findings
    assert [finding.fix for finding in again] == [finding.fix for finding in first]
    assert any(finding.fix for finding in again)
    assert again.texts[str(project / "m.osim")] == MESH
    assert not list(project.glob(".*"))


def test_another_text_or_configuration_is_checked(project, checked):
    codes(project)
    (project / "m.osim").write_text(MESH.replace("gravty", "gravity"))
    assert "OSIM101" not in codes(project)
    check_files([str(project / "m.osim")], Config(ignore=("OSIM7",)))
    assert len(checked) == 3
    codes(project, cached=False)
    assert len(checked) == 4


@pytest.fixture
def later(monkeypatch):
    """Let checks begin some seconds after files were written, so that their time stamps are trusted."""
    moment = time.time_ns() + 10**10
    monkeypatch.setattr(module, "time_ns", lambda: moment)


def test_a_file_whose_stamp_has_not_changed_is_not_read_again(project, checked, later, monkeypatch):
    first = codes(project)
    monkeypatch.setattr("osimlite.lint.cache.fingerprint_text", None)
    assert codes(project) == first and len(checked) == 1


def test_a_file_that_was_touched_is_read_again_and_not_checked(project, checked, findings_cache):
    first = codes(project)
    (project / "m.osim").write_text(MESH)
    (entry,) = findings_cache.rglob("*.json")
    before = entry.stat().st_ino
    assert codes(project) == first and len(checked) == 1
    assert entry.stat().st_ino != before, "the entry was written anew"


@pytest.mark.parametrize("settled", [False, True])
def test_a_file_that_changes_at_one_time_and_in_one_size_is_checked_again(
    project, checked, request, settled
):
    if settled:
        request.getfixturevalue("later")
    codes(project)
    stamp = (project / "m.osim").stat()
    (project / "m.osim").write_text(MESH.replace("gravty", "gravti"))
    os.utime(project / "m.osim", ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    codes(project)
    assert len(checked) == 2


def test_a_mesh_that_comes_or_goes_counts(project, checked):
    assert "OSIM701" in codes(project)
    (project / "Geometry").mkdir()
    (project / "Geometry" / "bone.vtp").write_text("")
    assert "OSIM701" not in codes(project)
    assert "OSIM701" not in codes(project) and len(checked) == 2
    (project / "Geometry" / "bone.vtp").unlink()
    assert "OSIM701" in codes(project)


def test_a_mesh_in_other_letter_case_counts(project, checked):
    codes(project)
    (project / "BONE.vtp").write_text("")
    report = check_files([str(project / "m.osim")], Config())
    assert [finding.suggestion for finding in report if finding.code == "OSIM701"] == ["BONE.vtp"]


def test_a_model_that_includes_another_file_is_always_checked(project, checked):
    (project / "markers.osim").write_text(
        '<OpenSimDocument Version="40600"><MarkerSet/></OpenSimDocument>'
    )
    (project / "m.osim").write_text(
        MESH.replace("<BodySet>", '<MarkerSet file="markers.osim"/><BodySet>')
    )
    assert codes(project) == codes(project)
    assert len(checked) == 2


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"key": 1}', "\x00"])
def test_a_broken_entry_is_no_entry(project, checked, content, findings_cache):
    first = codes(project)
    (entry,) = findings_cache.rglob("*.json")
    entry.write_text(content)
    assert codes(project) == first and len(checked) == 2
    assert json.loads(entry.read_text())["findings"]


def _places(value, *way):
    """Yield the path of every value in JSON data, as keys and indices."""
    yield way
    parts = (
        value.items()
        if isinstance(value, dict)
        else enumerate(value)
        if isinstance(value, list)
        else ()
    )
    for key, part in parts:
        yield from _places(part, *way, key)


@pytest.mark.full
def test_an_entry_with_anything_of_another_type_is_no_entry(project, checked, findings_cache):
    first = check_files([str(project / "m.osim")], Config())
    (entry,) = findings_cache.rglob("*.json")
    whole = json.loads(entry.read_text())
    line, column, suggestion, fix, consequence = 4, 5, 8, 9, 10
    assert whole["outside"] and any(values[fix] for values in whole["findings"])
    tried = 0
    for way in _places(whole):
        for wrong in (None, 1.5, 7, "x", [], [1], {}, {"a": 1}):
            damaged = json.loads(json.dumps({"": whole}))
            outer, last = ("", *way)[:-1], ("", *way)[-1]
            inside = damaged
            for key in outer:
                inside = inside[key]
            # These fields may be None.
            fits = wrong is None and last in (line, column, suggestion, fix, consequence)
            others = {line: 7, column: 7, suggestion: "x"}
            fits = fits or (inside[last] is None and others.get(last) == wrong)
            # If the file was old enough to have a reliable time stamp, the stamp is compared
            # instead of the text. With another stamp the text is compared.
            unread = ("file",) if whole["file"] is None else ("file", "text")
            if fits or (way[:1] and way[0] in unread) or type(inside[last]) is type(wrong):
                continue
            inside[last] = wrong
            entry.write_text(json.dumps(damaged[""]))
            again = check_files([str(project / "m.osim")], Config())
            assert again.findings == first.findings
            assert [finding.fix for finding in again] == [finding.fix for finding in first], (
                way,
                wrong,
            )
            tried += 1
    assert len(checked) == 1 + tried and tried > 100
    entry.write_text("[" * 100_000)
    assert check_files([str(project / "m.osim")], Config()).findings == first.findings


@pytest.mark.parametrize(
    "damage",
    [
        {"unmeasured": [5]},
        {"unmeasured": ["x", None]},
        {"unmeasured": [["x"]]},
        {"findings": [[]]},
        {"findings": [{"code": "OSIM101"}]},
        {"findings": [["OSIM101", "unknown-tag", "error", "x", True, 1, 1, "", None, None]]},
        {"findings": [["OSIM101", "unknown-tag", "error", "x", 1, None, 1, "", None, None]]},
        {"findings": [["OSIM101", "unknown-tag", "error", "x", 0, 1, 1, "", None, None]]},
        {"findings": [["OSIM101", "unknown-tag", "error", "x", 1, 1, -1, "", None, None]]},
        {"findings": [["OSIM101", "unknown-tag", "error", "x", 1, 1, 1, "", None, [1, []]]]},
        {
            "findings": [
                [
                    "OSIM101",
                    "unknown-tag",
                    "error",
                    "x",
                    1,
                    1,
                    1,
                    "",
                    None,
                    [True, [[0, True, "x"]]],
                ]
            ]
        },
        {"outside": [["x", [1, True]]]},
    ],
    ids=str,
)
def test_an_entry_is_read_by_its_schema_or_not_at_all(project, checked, damage, findings_cache):
    first = check_files([str(project / "m.osim")], Config())
    (entry,) = findings_cache.rglob("*.json")
    entry.write_text(json.dumps(json.loads(entry.read_text()) | damage))
    again = check_files([str(project / "m.osim")], Config())
    assert (again.findings, again.unmeasured) == (first.findings, first.unmeasured)
    assert len(checked) == 2


def test_a_cache_that_cannot_be_written_is_done_without(project, checked, findings_cache):
    findings_cache.rmdir()
    findings_cache.write_text("a file stands in its place")
    assert codes(project) == codes(project)
    assert len(checked) == 2


@pytest.mark.skipif(sys.platform != "linux", reason="the variable is that of Linux")
def test_the_cache_is_in_the_folder_of_the_user(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache_folder() == tmp_path / "osimlite"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert user_cache_folder() == Path.home() / ".cache" / "osimlite"


def test_shared_work_finds_the_same_in_the_same_order(project):
    files = []
    for number in range(9):
        file = project / f"m{number}.osim"
        file.write_text(MESH.replace("<mass>1", f"<mass>{number - 4}"))
        files.append(str(file))
    seen: list[tuple[int, int]] = []
    alone = check_files(files, Config(), cached=False, processes=1)
    shared = check_files(
        files, Config(), cached=False, processes=2, progress=lambda *counts: seen.append(counts)
    )
    assert shared.findings == alone.findings and shared.checked == 9
    assert seen == [(count, 9) for count in range(1, 10)]


@pytest.mark.skipif(sys.platform != "linux", reason="replaces a function in forked processes")
def test_an_interrupt_does_not_wait_for_files_that_are_being_checked(project, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    def check_slowly(job):
        if not job.file.endswith("m0.osim"):
            time.sleep(30.0)
        return module.Report(job.file, [])

    check_slowly.__qualname__, check_slowly.__module__ = "check_job", module.__name__
    monkeypatch.setattr(module, "check_job", check_slowly)
    files = [str(project / f"m{number}.osim") for number in range(4)]
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        check_files(files, Config(), cached=False, processes=2, progress=interrupt)
    assert time.monotonic() - started < 10.0


def test_a_missing_file_is_named_also_by_another_process(project):
    absent = str(project / "absent.osim")
    for processes in (1, 2):
        with pytest.raises(MissingFileError, match="absent"):
            check_files([absent, str(project / "m.osim")], Config(), processes=processes)


def test_work_is_shared_only_if_there_is_enough(project, monkeypatch):
    jobs = [module.CheckJob(str(project / "m.osim"), Config(), None)] * 3
    assert module.count_processes(jobs) == 1
    monkeypatch.setattr(module, "MIN_PARALLEL_BYTES", 10)
    monkeypatch.setattr("os.cpu_count", lambda: 4)
    monkeypatch.setattr("sys.platform", "win32")
    assert module.count_processes(jobs) == 3


def test_the_text_of_a_file_that_has_gone_is_empty(project):
    file = project / "m.osim"
    texts = SourceTexts()
    assert texts[str(file)] == MESH
    shutil.move(file, project / "moved.osim")
    assert texts[str(file)] == ""


@pytest.mark.parametrize(
    ("text", "ours"),
    [
        ('<?xml version="1.0"?>\n<!-- a > b -->\n<IKTool name="x">', True),
        ("\ufeff<InverseKinemtaticsTool>", True),
        ("<OpenSimDocument Version='40600'>", True),
        ("<TaskSpace::Controller> <TaskSet>", False),
        ("<!-- ForceSet --> <project>", False),
        ("<!-- x --><?" * 300, False),
    ],
)
def test_xml_of_other_programs_is_known_by_its_root(text, ours):
    assert is_opensim_xml(text.encode()) is ours


def test_every_part_that_checks_tells_which_code_this_is():
    assert describe_code_version().endswith(
        f" {len([*Path(module.__file__).parents[1].rglob('*.py')])}"
    )
