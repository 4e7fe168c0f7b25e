"""What is measured of paths and muscles: when, how it is told that it could not be, and who does without."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from osimlite._require import absent
from osimlite.document.source import Source
from osimlite.lint import Config, cache, measures, parts, validate
from osimlite.lint.many import check_files
from osimlite.lint.reporters import render
from osimlite.multibody.parts import CoordinateInfo

JUMPING = "fail-02-two-coordinates.osim"


@pytest.fixture
def jumping(fixtures: Path, tmp_path: Path) -> Path:
    path = tmp_path / "m.osim"
    path.write_bytes((fixtures / "lint" / "OSIM632" / JUMPING).read_bytes())
    (tmp_path / "osimlite.toml").write_text("")
    return path


@pytest.fixture
def without_numpy(monkeypatch):
    monkeypatch.setattr(measures, "absent", lambda *names: ("numpy",))


def test_a_model_without_muscles_is_checked_without_a_numeric_library(fixtures):
    script = (
        "import sys; from osimlite.lint import validate; assert not validate(sys.argv[1]).unmeasured;"
        "print([name for name in ('numpy', 'osimlite.simulation') if name in sys.modules])"
    )
    command = [sys.executable, "-c", script, str(fixtures / "lint" / "skeleton.osim")]
    assert subprocess.run(command, check=True, capture_output=True, text=True).stdout == "[]\n"


def test_what_is_missing_is_told_in_one_line_and_is_no_finding(jumping, without_numpy):
    report = validate(jumping)
    assert not report.findings
    (why,) = report.unmeasured
    assert why == f"{jumping}: that needs numpy; run: pip install 'osimlite[sim]'"
    for name in ("full", "concise"):
        assert render(report, name, width=200).endswith(f"Paths and muscles (OSIM63) were not measured: {why}.\n")
    assert not validate(jumping, ignore="OSIM63").unmeasured


def test_the_cache_tells_it_again_and_measures_once_it_can(jumping, monkeypatch):
    with monkeypatch.context() as context:
        for module in (measures, cache):
            context.setattr(module, "absent", lambda *names: ("numpy",))
        reports = [check_files([str(jumping)], Config()) for _ in range(2)]
    assert all(len(report.unmeasured) == 1 and not report.findings for report in reports)
    assert check_files([str(jumping)], Config()).codes == {"OSIM632": 2}


def test_a_comment_is_not_called_unused_where_nobody_measured(jumping, without_numpy):
    jumping.write_text("<!-- osimlite: ignore OSIM632 OSIM505 -->\n" + jumping.read_text().partition("\n")[2])
    (finding,) = validate(jumping).findings
    assert finding.code == "OSIM010" and "'OSIM505'" in finding.message


def test_a_model_that_cannot_be_computed_is_named_with_the_reason(fixtures):
    text = (fixtures / "lint" / "OSIM632" / JUMPING).read_text().replace("<PinJoint", "<ScrewJoint", 1)
    report = validate(Source(text.replace("</PinJoint>", "</ScrewJoint>", 1).encode(), "m.osim"))
    assert set(report.codes) >= {"OSIM102"} and not any(code.startswith("OSIM63") for code in report.codes)
    (why,) = report.unmeasured
    assert why.startswith("m.osim: ") and "ScrewJoint" in why


def test_numbers_beyond_what_is_computed_with_are_no_traceback(fixtures):
    text = (fixtures / "lint" / "OSIM633" / "fail-01-example.osim").read_text()
    text = text.replace("WrapSphere", "WrapEllipsoid").replace(
        "<radius>0.04</radius>", "<dimensions>1e-300 1 1</dimensions>"
    )
    report = validate(Source(text.encode()))
    assert [why.partition(" (")[0] for why in report.unmeasured] == [
        "the model: a number of it is beyond what can be computed with"
    ]


def test_a_path_is_reported_once_with_its_greatest_jump(fixtures):
    text = (fixtures / "lint" / "OSIM632" / JUMPING).read_text()
    (one, two) = validate(Source(text.encode())).findings
    # It comes in at 0.2 and goes at 1.
    assert "jumps by 18 mm at 'hip_flexion' = 11.46 deg, where 'b' comes or goes" in one.message
    assert "jumps by 98.7 mm at 'knee_angle' = -57.3 deg" in two.message


def test_the_language_server_does_not_measure(jumping):
    pytest.importorskip("pygls")
    from osimlite.lsp.analysis import Analysis
    from osimlite.lsp.text import Text

    report = Analysis(Text(jumping.read_text()), str(jumping)).report
    assert not report.findings and not report.unmeasured


@pytest.mark.parametrize(
    ("motion", "said"), [("rotational", "28.65 deg"), ("translational", "0.5 m"), ("coupled", "0.5")]
)
def test_a_value_is_told_in_the_unit_of_what_the_coordinate_moves(motion, said):
    info = CoordinateInfo("q", "/jointset/j/q", "/jointset/j", motion)
    assert str(measures.Value(info.name, 0.5, info.unit)) == f"'q' = {said}"


@pytest.fixture
def begun(monkeypatch):
    """Nothing is compiled, and what would be is noted here."""
    from osimlite.simulation.engines import ahead, machine_code

    names: list[str] = []
    monkeypatch.setattr(machine_code, "is_at_hand", lambda name: False)
    monkeypatch.setattr(ahead, "begin", names.extend)
    monkeypatch.setattr(measures, "FEW", -1)
    monkeypatch.setattr(measures, "waits", False)
    parts._memory.clear()
    return names


@pytest.mark.skipif(bool(absent("numba")), reason="numba is not installed")
def test_nobody_who_looks_on_waits_for_a_compiler(jumping, begun, monkeypatch):
    report = check_files([str(jumping)], Config(), waits=False)
    (why,) = report.unmeasured
    assert "machine code" in why and "run it again" in why
    assert not report.findings and {"evaluate", "watch", "straight_path"} <= set(begun)
    monkeypatch.undo()
    parts._memory.clear()
    assert check_files([str(jumping)], Config()).codes == {"OSIM632": 2}
