"""Check the reports on a project with faults in a setup and in tables, for all ways to call the linter."""

from __future__ import annotations

import json
from shutil import copy

import pytest

from osimlite.lint.diagnostic import Finding, Report, Severity
from osimlite.lint.engine import load_subject, run_rules
from osimlite.lint.reporters.terminal import format_summary
from tests.cli.command import run as command


@pytest.fixture
def project(fixtures, tmp_path, monkeypatch):
    """Return a folder with two faults in a setup, two in a motion, and one in marker data."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "project"
    (folder / "data").mkdir(parents=True)
    for name in ("leg.osim", "leg.mot"):
        copy(fixtures / "lint" / name, folder)
    copy(fixtures / "lint" / "leg.trc", folder / "data")
    setup = (fixtures / "lint" / "OSIM821" / "pass-ik.xml").read_text()
    setup = setup.replace("../leg.osim", "leg.osim").replace("../leg.trc", "data/leg.trc")
    # Coordinate tasks replace the information of the marker that the setup misspells.
    tasks = "".join(
        f'<IKCoordinateTask name="{name}"> <value_type>manual_value</value_type> <weight>1</weight></IKCoordinateTask>'
        for name in ("pelvis_rz", "pelvis_tx", "pelvis_ty")
    )
    setup = setup.replace("</objects>", f"{tasks}\n</objects>")
    (folder / "ik.xml").write_text(setup.replace('"knee_marker"', '"knee_markr"'))
    change(folder / "leg.mot", "nRows=51", "nRows=50")
    change(folder / "leg.mot", "inDegrees", "indegrees")
    change(folder / "data" / "leg.trc", "50\t50\t51", "50\t50\t44")
    monkeypatch.chdir(folder)
    return folder


def change(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


FOUND = {("data/leg.trc", "OSIM802"), ("ik.xml", "OSIM831"), ("ik.xml", "OSIM841"), ("leg.mot", "OSIM802"),
         ("leg.mot", "OSIM803")}  # fmt: skip


def found(*options):
    done = command("validate", ".", "--format", "json", *options)
    return {(each["file"], each["code"]) for each in json.loads(done.out)}, done.code


def test_every_file_is_in_one_report_and_again_from_the_cache(project):
    assert found() == (FOUND, 1) == found() == found("--no-cache")


def test_rules_are_selected_ignored_and_counted(project):
    assert found("--select", "OSIM802") == (
        {("data/leg.trc", "OSIM802"), ("leg.mot", "OSIM802")},
        1,
    )
    # Only warnings remain.
    assert found("--ignore", "table-count,OSIM803")[1] == 0
    assert found("--ignore", "table-count,OSIM803", "--fail-on", "warning")[1] == 1
    assert found("--select", "OSIM5")[0] == set()
    counts = command("validate", ".", "--statistics").out
    assert "     2  OSIM802  table-count\n" in counts and counts.endswith("in 3 files.\n")


def test_settings_hold_for_tables_and_setups(project):
    (project / "osimlite.toml").write_text(
        '[per-file-ignores]\n"*.trc" = ["data"]\n"ik.xml" = ["OSIM84"]\n[severity]\ntable-count = "info"\n'
        'table-setting = "info"\n'
    )
    assert found() == ({("ik.xml", "OSIM831"), ("leg.mot", "OSIM802"), ("leg.mot", "OSIM803")}, 0)


def test_lines_and_comments_ignore(project):
    change(
        project / "leg.mot",
        "version=1",
        "osimlite: ignore OSIM802, table-setting OSIM809\nversion=1",
    )
    change(
        project / "ik.xml",
        "<InverseKinematicsTool",
        "<!-- osimlite: ignore OSIM301 -->\n<InverseKinematicsTool",
    )
    change(
        project / "ik.xml",
        '"knee_markr">',
        '"knee_markr"> <!-- osimlite: ignore OSIM831 OSIM841 -->',
    )
    unused = {("leg.mot", "OSIM010"), ("ik.xml", "OSIM010")}
    assert found()[0] == {("data/leg.trc", "OSIM802"), *unused}
    (comment,) = run_rules(load_subject("leg.mot"))
    assert (comment.line, comment.column, comment.message) == (
        2,
        1,
        "the code 'OSIM809' ignores nothing here; delete it",
    )


def test_a_baseline_knows_them_again(project):
    assert (
        command("validate", ".", "--write-baseline", "known.json").out == "known.json: 5 findings\n"
    )
    assert found("--baseline", "known.json") == (set(), 0)
    assert command("validate", ".", "--baseline", "known.json").out.endswith(
        " files (5 more in the baseline).\n"
    )
    change(project / "leg.mot", "nColumns=6", "nColumns=7")
    assert found("--baseline", "known.json") == ({("leg.mot", "OSIM802")}, 1)


def test_formats_for_programs_name_every_file(project):
    github = command("validate", ".", "--format", "github").out
    assert "file=data/leg.trc,line=3,col=7,endColumn=9::" in github
    sarif = json.loads(command("validate", ".", "--format", "sarif").out)["runs"][0]["results"]
    places = {each["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for each in sarif}
    assert places == {"data/leg.trc", "ik.xml", "leg.mot"}
    junit = command("validate", ".", "--format", "junit").out
    assert '<testcase name="leg.mot"' in junit and 'tests="4" failures="3"' in junit


def test_findings_that_are_alike_are_folded(project):
    names = "\t".join(f"a{k}" for k in range(8))
    (project / "many.sto").write_text(
        f"many\nversion=1\nnRows=1\nnColumns=9\nendheader\ntime\t{names}\n0\t"
        + "\t".join(["x"] * 8)
        + "\n"
    )
    concise = command("validate", "many.sto", "--format", "concise").out
    assert concise.count("OSIM807") == 1 and "7 more like this" in concise
    assert command("validate", "many.sto", "--format", "concise", "--all").out.count("OSIM807") == 8


def test_mends_of_a_project(project):
    before = {path: path.read_bytes() for path in project.rglob("*.*") if path.is_file()}
    shown = command("validate", ".", "--diff")
    assert shown.code == 1 and "+nRows=51\n" in shown.out
    assert {path: path.read_bytes() for path in before} == before
    assert (
        command("validate", ".", "--fix").err
        == "Applied 3 fixes; 1 probable fix needs --unsafe-fixes.\n"
    )
    assert found()[0] == {("ik.xml", "OSIM831"), ("ik.xml", "OSIM841")}
    assert found("--unsafe-fixes") == (set(), 0)


def test_the_closing_line_counts_the_files_with_findings(project):
    """A check of one setup may find errors in the tables that it names."""
    done = command("validate", ".", "--format", "concise")
    assert done.out.endswith(" in 3 files.\n")
    alone = command("validate", "leg.mot", "leg.osim", "--format", "concise").out
    assert alone.endswith(" in 1 file.\n")
    assert command("validate", "leg.osim", "ik.xml", "--select", "OSIM5").out == (
        "No findings in 2 files.\n"
    )
    tables = [Finding("OSIM802", "x", Severity.ERROR, "x", name) for name in ("a.mot", "b.trc")]
    assert format_summary(Report(tables, checked=1)) == "Found 2 errors in 2 files."
    assert "in 2 files" in repr(Report(tables, checked=1))
