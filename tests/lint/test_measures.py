"""Check measurements of paths and muscles: when they are made, and what is reported when they are not."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from osimlite.io.document.source import Source
from osimlite.lint import Config, measures, validate
from osimlite.lint.many import check_files
from osimlite.lint.reporters.terminal import describe_unmeasured
from osimlite.mechanics.multibody.parts import CoordinateInfo
from tests.cli.command import run

JUMPING = "fail-02-two-coordinates.osim"


@pytest.fixture
def jumping(fixtures: Path, tmp_path: Path) -> Path:
    path = tmp_path / "m.osim"
    path.write_bytes((fixtures / "lint" / "OSIM632" / JUMPING).read_bytes())
    (tmp_path / "osimlite.toml").write_text("")
    return path


WHY = (
    "rules OSIM42x, OSIM53x and OSIM63x did not run: they need osimlite[sim] (numpy is not installed); "
    "run: pip install 'osimlite[sim]'"
)
"""Report in an environment without numpy."""


def test_a_model_without_muscles_is_checked_without_a_numeric_library(fixtures):
    script = (
        "import sys; from osimlite.lint import validate; assert not validate(sys.argv[1]).unmeasured;"
        "print([name for name in ('numpy', 'osimlite.simulation') if name in sys.modules])"
    )
    command = [sys.executable, "-c", script, str(fixtures / "lint" / "skeleton.osim")]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == "[]\n"


def test_missing_packages_are_reported_in_every_format_and_are_no_finding(bare, jumping):
    for name in ("full", "concise"):
        done = bare.call("validate", "--no-cache", "--format", name, jumping, folder=jumping.parent)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.endswith(f"{jumping}: {WHY}.\n")
    texts = {}
    for name in ("json", "sarif", "github"):
        # A note is not a finding: --fail-on info does not count it.
        done = bare.call(
            "validate",
            "--no-cache",
            "--fail-on",
            "info",
            "--format",
            name,
            jumping,
            folder=jumping.parent,
        )
        assert (done.returncode, done.stderr) == (0, "")
        texts[name] = done.stdout
    (note,) = json.loads(texts["json"])
    assert (note["code"], note["name"], note["severity"], note["file"]) == (
        "OSIM42", "not-measured", "info", str(jumping),
    )  # fmt: skip
    assert note["message"] == WHY
    (invocation,) = json.loads(texts["sarif"])["runs"][0]["invocations"]
    assert WHY in invocation["toolExecutionNotifications"][0]["message"]["text"]
    assert texts["github"].startswith("::notice title=not-measured::") and WHY in texts["github"]
    done = bare.call(
        "validate", "--no-cache", "--ignore", "OSIM42,OSIM53,OSIM63", jumping, folder=jumping.parent
    )
    assert "measured" not in done.stdout


def test_the_cache_repeats_the_reason_until_it_can_be_measured(
    bare, jumping, tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "cache"))
    monkeypatch.setenv("HOME", str(tmp_path))
    for _ in range(2):
        assert WHY in bare.call("validate", jumping, folder=jumping.parent).stdout
    done = run("validate", "--format", "json", jumping, folder=jumping.parent)
    assert [finding["code"] for finding in json.loads(done.out)] == ["OSIM632"] * 2


def test_a_comment_is_not_called_unused_where_nobody_measured(bare, jumping):
    jumping.write_text(
        "<!-- osimlite: ignore OSIM632 OSIM505 -->\n" + jumping.read_text().partition("\n")[2]
    )
    done = bare.call("validate", "--no-cache", "--format", "json", jumping, folder=jumping.parent)
    finding, _ = json.loads(done.stdout)
    assert finding["code"] == "OSIM010" and "'OSIM505'" in finding["message"]


def test_a_model_that_cannot_be_computed_is_named_with_the_reason(fixtures):
    text = (
        (fixtures / "lint" / "OSIM632" / JUMPING).read_text().replace("<PinJoint", "<ScrewJoint", 1)
    )
    report = validate(Source(text.replace("</PinJoint>", "</ScrewJoint>", 1).encode(), "m.osim"))
    assert set(report.codes) >= {"OSIM102"} and not any(
        code.startswith("OSIM63") for code in report.codes
    )
    (why,) = report.unmeasured
    assert why.startswith("m.osim: ") and "ScrewJoint" in why


def test_a_reason_that_ends_with_a_suggestion_gets_no_full_stop(fixtures):
    text = (fixtures / "lint" / "OSIM632" / JUMPING).read_text()
    name = re.search(r"<socket_parent_frame>([^<]*)", text)[1]
    report = validate(Source(text.replace(f"{name}</", f"{name}x</", 1).encode(), "m.osim"))
    (why,) = report.unmeasured
    assert why.endswith("?") and describe_unmeasured(report) == why


def test_numbers_beyond_what_is_computed_with_are_no_traceback(fixtures):
    text = (fixtures / "lint" / "OSIM633" / "fail-01-example.osim").read_text()
    text = text.replace("WrapSphere", "WrapEllipsoid").replace(
        "<radius>0.04</radius>", "<dimensions>1e-300 1 1</dimensions>"
    )
    report = validate(Source(text.encode()))
    assert [why.partition(" (")[0] for why in report.unmeasured] == [
        "the model: rules OSIM63x did not run: a number is too large to compute with"
    ]


def test_a_path_is_reported_once_with_its_greatest_jump(fixtures):
    text = (fixtures / "lint" / "OSIM632" / JUMPING).read_text()
    (one, two) = validate(Source(text.encode())).findings
    # The point is active between 0.2 and 1.
    assert (
        "jumps by 18 mm at 'hip_flexion' = 11.46 deg, where the path starts or stops using 'b'"
        in one.message
    )
    assert "jumps by 98.7 mm at 'knee_angle' = -57.3 deg" in two.message


def test_the_language_server_does_not_measure(jumping):
    pytest.importorskip("pygls")
    from osimlite.cli.language_server.analysis import DocumentAnalysis
    from osimlite.cli.language_server.text import Text

    report = DocumentAnalysis(Text(jumping.read_text()), str(jumping)).report
    assert not report.findings and not report.unmeasured


@pytest.mark.parametrize(
    ("motion", "said"),
    [("rotational", "28.65 deg"), ("translational", "0.5 m"), ("coupled", "0.5")],
)
def test_a_value_is_told_in_the_unit_of_what_the_coordinate_moves(motion, said):
    info = CoordinateInfo("q", "/jointset/j/q", "/jointset/j", motion)
    assert str(measures.CoordinateSetting(info.name, 0.5, info.unit)) == f"'q' = {said}"


def test_without_machine_code_many_surfaces_are_not_measured(jumping, monkeypatch):
    """The report says that surfaces were not measured.

    It is not cached, because the next check may have machine code.
    """
    from osimlite.lint.measuring import model

    monkeypatch.setattr(measures, "MAX_WRAPS_UNCOMPILED", -1)
    measures.remembered.clear()
    with monkeypatch.context() as without:
        without.setattr(model, "has_machine_code", lambda: False)
        (why,) = check_files([str(jumping)], Config()).unmeasured
        assert "minutes in Python" in why and "osimlite[jit]" in why
    assert check_files([str(jumping)], Config()).codes == {"OSIM632": 2}
