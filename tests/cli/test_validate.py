"""Tests of ``validate`` and ``rule`` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from osimlite.lint.registry import all_rules
from tests.cli.command import run

WALKER = Path(__file__).resolve().parents[2] / "fixtures" / "walker" / "DynamicWalkerModel.osim"


@pytest.fixture
def faulty(tmp_path):
    path = tmp_path / "faulty.osim"
    path.write_text(
        WALKER.read_text().replace("RFootContact PlatformContact", "RFootContct PlatformContact")
    )
    return path


def test_a_sound_model_is_exit_0():
    done = run("validate", WALKER, "--format", "concise")
    assert done.code == 0 and done.err == ""
    assert done.out.endswith(" infos in 1 file.\n")


def test_an_error_is_exit_1(faulty):
    done = run("validate", faulty)
    assert done.code == 1
    assert "OSIM301" in done.out and "did you mean 'RFootContact'?" in done.out
    assert "^^^^^^^^^^^" in done.out and "\033" not in done.out


def test_fail_on_and_select_and_ignore(faulty):
    assert run("validate", WALKER, "--fail-on", "info").code == 1
    assert run("validate", WALKER, "--fail-on", "warning").code == 0
    assert run("validate", faulty, "--ignore", "OSIM3").code == 0
    assert run("validate", faulty, "--select", "OSIM1,physics").code == 0


def test_json_from_standard_input(faulty):
    done = run("validate", "-", "--format", "json", text=faulty.read_text())
    findings = json.loads(done.out)
    assert done.code == 1
    assert {finding["code"] for finding in findings} == {"OSIM301", "OSIM508"}
    assert {finding["file"] for finding in findings} == {"<stdin>"}


def test_standard_input_may_be_a_setup_or_a_table_of_a_project(fixtures, tmp_path):
    for file in (fixtures / "setups").glob("*.*"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    ik, motion = (tmp_path / "ik.xml").read_text(), (tmp_path / "coords.mot").read_text()
    text = ik.replace("walk.trc", "wolk.trc")
    assert (
        "'wolk.trc'" in run("validate", "-", "--stdin-filename", tmp_path / "ik.xml", text=text).out
    )
    assert (
        "'walk.trc'"
        not in run("validate", "-", "--stdin-filename", tmp_path / "ik.xml", text=ik).out
    )
    wrong = motion.replace("=yes", "=true")
    done = run("validate", "-", "--stdin-filename", "a.mot", text=wrong, folder=tmp_path)
    assert done.out.startswith("a.mot:5:11: error OSIM803")
    # Without a file name the text belongs to no project; it still must not be taken for a model.
    assert run("validate", "-", "--select", "OSIM003", text=ik).code == 0
    done = run("validate", "-", "--fix", "--stdin-filename", tmp_path / "ik.xml", text=text)
    assert done.code == 2 and (tmp_path / "ik.xml").read_text() == ik


def test_xml_of_others_is_passed_over_where_that_is_asked_for(tmp_path):
    (tmp_path / "pom.xml").write_text("<project/>")
    assert run("validate", tmp_path / "pom.xml").code == 1
    assert run("validate", tmp_path / "pom.xml", "--skip-other-xml").code == 0
    for command in ("validate", "format"):
        done = run(command, tmp_path)
        assert done.code == 2 and "no OpenSim file in this folder: no .osim, .xml" in done.err


def test_a_folder_is_every_model_below(faulty):
    (faulty.parent / "sub").mkdir()
    (faulty.parent / "sub" / "other.osim").write_text("<OpenSimDocument/>")
    done = run("validate", faulty.parent, "--statistics")
    assert done.code == 1
    assert "1  OSIM301  unresolved-reference" in done.out
    assert "1  OSIM004  document-version" in done.out
    assert done.out.endswith("in 2 files.\n")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["validate", "no_such_file.osim"],
            "no_such_file.osim: cannot read the file: no such file",
        ),
        (["validate", WALKER, "--format", "yaml"], "--format must be one of"),
        (
            ["validate", WALKER, "--fail-on", "bad"],
            "--fail-on must be one of error, warning and info, not 'bad'",
        ),
        (["validate", WALKER, "--select", "OSIM999"], "no rule has the code or name 'OSIM999'"),
        (["rule", "unresolved-refrence"], "did you mean 'unresolved-reference'?"),
    ],
)
def test_what_cannot_be_carried_out_is_exit_2_and_one_sentence(arguments, words):
    done = run(*arguments)
    assert done.code == 2
    assert words in done.err and "Traceback" not in done.err
    assert len(done.err.strip().splitlines()) == 1


def test_the_table_and_the_page_of_a_rule():
    some = run("rule", "osim86").out
    assert "OSIM861" in some and "OSIM301" not in some and "OSIM80" in run("rule", "data").out
    table = run("rule").out
    assert "OSIM301  unresolved-reference" in table
    page = run("rule", "osim301").out
    assert page.startswith("# unresolved-reference (OSIM301)\n\nSeverity: error\nFix: sometimes")
    assert "## Use instead" in page


def test_the_table_of_rules_fits_a_terminal():
    lines = run("rule").out.splitlines()
    assert max(map(len, lines)) <= 80
    assert sum(line.startswith("OSIM") for line in lines) == len(all_rules())


def test_what_is_no_certain_mend_is_named(tmp_path):
    path = tmp_path / "walker.osim"
    path.write_text(
        WALKER.read_text().replace("RFootContact PlatformContact", "RFotContact PlatformContact")
    )
    shown = run("validate", path, "--fix", "--diff")
    assert shown.code == 0 and not shown.out
    assert shown.err == "Would apply 0 fixes; 1 probable fix needs --unsafe-fixes.\n"
    mended = run("validate", path, "--fix")
    assert mended.err == "Applied 0 fixes; 1 probable fix needs --unsafe-fixes.\n"
    assert "1 has a probable fix (--unsafe-fixes)." in mended.out
    clean = run("validate", WALKER, "--diff")
    assert clean.code == 0 and clean.err == "Would apply 0 fixes.\n"


def test_fix_mends_in_place_and_diff_shows_it_first(tmp_path):
    path = tmp_path / "walker.osim"
    path.write_text(
        WALKER.read_text().replace("RFootContact PlatformContact", "rfootcontact PlatformContact")
    )
    before = path.read_text()
    shown = run("validate", path, "--diff")
    assert shown.code == 1 and path.read_text() == before
    assert "+++" in shown.out and "RFootContact PlatformContact" in shown.out
    done = run("validate", path, "--fix")
    assert done.code == 0 and "Applied 1 fix." in done.err
    assert path.read_text() == WALKER.read_text()


def test_unsafe_fixes_must_be_asked_for(faulty):
    before = faulty.read_text()
    assert run("validate", faulty, "--fix").code == 1
    assert faulty.read_text() == before
    assert run("validate", faulty, "--unsafe-fixes").code == 0
    assert faulty.read_text() == WALKER.read_text()


def test_a_baseline_lets_an_old_repository_begin(faulty):
    baseline = faulty.parent / "baseline.json"
    assert run("validate", faulty, "--write-baseline", baseline).code == 0
    done = run("validate", faulty, "--baseline", baseline)
    assert done.code == 0 and done.out == "No findings in 1 file (3 more in the baseline).\n"


def test_settings_of_the_project_hold(faulty):
    (faulty.parent / "pyproject.toml").write_text(
        '[tool.osimlite]\nignore = ["OSIM3", "OSIM5"]\nfail-on = "info"\n'
    )
    assert run("validate", faulty).code == 0
    (faulty.parent / "pyproject.toml").write_text("[tool.osimlite]\nignores = []\n")
    done = run("validate", faulty)
    assert done.code == 2 and "did you mean 'ignore'?" in done.err


@pytest.mark.parametrize(
    ("name", "text"), [("no.osim", "hello"), ("torn.osim", "<a><b></a>"), ("t.sto", "x\n")]
)
def test_diff_of_what_cannot_be_read_is_exit_2_with_the_place(name, text, tmp_path):
    (tmp_path / name).write_text(text)
    done = run("validate", tmp_path / name, "--diff")
    assert done.code == 2
    assert f"{tmp_path / name}:1:" in done.err
