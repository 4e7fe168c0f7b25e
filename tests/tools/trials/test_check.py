"""Tests of `check_trial`: OpenSim's trial of gait2354, and copies with one fault each, which must be found."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from shutil import copytree
from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.cli import main
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.tools.running import run

REFERENCE = "oracle/tools/reference"
IK, ID, LOADS = (
    "subject01_Setup_IK.xml",
    "subject01_Setup_InverseDynamics.xml",
    "subject01_walk1_grf.xml",
)
TRUE_OF_IT = {"OSIM902"}
"""Real fault of OpenSim's trial: markers of the shoulders are off by 8 cm, because the model has no arms."""


@pytest.fixture(scope="module")
def gait(shared: Path, tmp_path_factory) -> Path:
    """Write the trial with OpenSim's motion and inverse dynamics, and return the folder."""
    folder = tmp_path_factory.mktemp("gait")
    case = shared / REFERENCE / "ik_id_gait2354"
    for file in case.iterdir():
        data = gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes()
        (folder / file.name.removesuffix(".gz")).write_bytes(data)
    model = shared / REFERENCE / "models" / "gait2354_subject01_simbody.osim.gz"
    (folder / "subject01_simbody.osim").write_bytes(gzip.decompress(model.read_bytes()))
    (folder / "ik_accuracy_1e-9.mot").rename(folder / "subject01_walk1_ik.mot")
    ik, dynamics = (osimlite.read_document(folder / name) for name in (IK, ID))
    ik.model_file = dynamics.model_file = "subject01_simbody.osim"
    ik.marker_file, ik.output_motion_file = "subject01_walk1.trc", "subject01_walk1_ik.mot"
    dynamics.external_loads_file, dynamics.coordinates_file = LOADS, ik.output_motion_file
    dynamics.results_directory, dynamics.output_gen_force_file = ".", "inverse_dynamics.sto"
    osimlite.write(ik, folder / IK)
    osimlite.write(dynamics, folder / ID)
    return folder


@pytest.fixture
def trial(gait: Path, tmp_path: Path) -> Path:
    return copytree(gait, tmp_path / "trial")


def warned(report) -> set[str]:
    return {
        finding.code for finding in report.warnings if finding.code not in ("OSIM911", "OSIM912")
    }


def number(report, name: str, kind: str = "") -> Any:
    return next(
        verdict for verdict in report.verdicts if verdict.name == name and kind in verdict.of
    )


def test_a_trial_of_opensims_has_no_false_alarm(gait: Path) -> None:
    report = osimlite.check_trial(gait)
    assert warned(report) == TRUE_OF_IT
    # docs/whole-subject.md lists the same errors, as inverse kinematics reports them.
    assert number(report, "marker-error", "root").value == pytest.approx(2.19, abs=0.06)
    assert "R.Acromium" in number(report, "marker-error", "peak").where
    assert number(report, "swapped-markers").value == 0.0
    assert number(report, "swapped-feet").value == 0.0
    assert number(report, "measured-weight").value < 1.0
    assert number(report, "filter-content", "change").value < 1.0
    peak = number(report, "residual-force", "peak of pelvis_ty")
    table = read_sto(gait / "inverse_dynamics.sto")
    assert peak.value == pytest.approx(np.abs(table["pelvis_ty_force"]).max())
    # The limits are 5 % of the largest external force, and OpenSim's 10 N.
    assert (peak.good, peak.verdict) == (10.0, "bad") and 40.0 < peak.bad < 50.0
    assert any("ScaleTool" in why for why in report.unchecked)


def test_a_finding_is_at_the_row_it_is_about(gait: Path) -> None:
    report = osimlite.check_trial(gait, select="OSIM902")
    worst = next(finding for finding in report if "peak" in finding.message)
    line = (gait / "subject01_walk1_ik.mot").read_text().splitlines()[(worst.line or 0) - 1]
    time = number(report, "marker-error", "peak").where.split(" at ")[1].split()[0]
    assert float(line.split()[0]) == pytest.approx(float(time), abs=1e-5)
    assert worst.file == str(gait / "subject01_walk1_ik.mot")


def exchange(trial: Path, one: str, other: str, first: float = 0.0, last: float = 9.0) -> None:
    """Exchange two markers in the data between two times, and fit the motion again."""
    file = trial / "subject01_walk1.trc"
    lines = file.read_text().splitlines()
    places = [lines[3].split("\t").index(name) for name in (one, other)]
    for row in range(5, len(lines)):
        cells = lines[row].split("\t")
        if len(cells) > max(places) and first <= float(cells[1]) <= last:
            a, b = (slice(place, place + 3) for place in places)
            cells[a], cells[b] = cells[b], cells[a]
            lines[row] = "\t".join(cells)
    file.write_text("\n".join(lines) + "\n")
    run(trial / IK, check=False)


@pytest.mark.parametrize(
    ("pair", "times"),
    [
        (("R.Thigh.Upper", "R.Thigh.Front"), (0.0, 9.0)),
        (("R.ASIS", "L.ASIS"), (0.0, 9.0)),
        (("R.Shank.Upper", "L.Shank.Upper"), (0.8, 1.0)),
    ],
)
def test_markers_that_were_exchanged_are_named(trial: Path, pair, times) -> None:
    exchange(trial, *pair, *times)
    (finding,) = osimlite.check_trial(trial / IK, select="OSIM903").findings
    assert all(f"'{name}'" in finding.message for name in pair)
    shown = number(osimlite.check_trial(trial / IK, select="OSIM903"), "swapped-markers")
    assert (shown.value == 100.0) == (times == (0.0, 9.0))


def test_feet_that_were_exchanged_are_found(trial: Path) -> None:
    text = (trial / LOADS).read_text()
    swapped = (
        text.replace("calcn_r", "calcn_?")
        .replace("calcn_l", "calcn_r")
        .replace("calcn_?", "calcn_l")
    )
    (trial / LOADS).write_text(swapped)
    findings = [finding for finding in osimlite.check_trial(trial) if finding.code == "OSIM906"]
    assert len(findings) == 2 and all(finding.line is not None for finding in findings)
    assert {"calcn_l", "calcn_r"} <= set(findings[0].message.replace(",", " ").split())


@pytest.mark.parametrize(("cutoff", "word"), [(1.5, "change of"), (-1.0, "noise")])
def test_a_filter_that_takes_motion_or_leaves_noise_is_found(
    trial: Path, cutoff: float, word: str
) -> None:
    setup = osimlite.read_document(trial / ID)
    setup.lowpass_cutoff_frequency_for_coordinates = cutoff
    osimlite.write(setup, trial / ID)
    (finding,) = osimlite.check_trial(trial, select="OSIM905").findings
    assert word in finding.message


def test_a_wrong_mass_is_found(trial: Path) -> None:
    model = osimlite.read(trial / "subject01_simbody.osim")
    for body in model.components(osimlite.Body):
        body.mass *= 1.12
    osimlite.write(model, trial / "subject01_simbody.osim")
    (finding,) = osimlite.check_trial(trial, select="OSIM907").findings
    assert finding.severity == "warning" and " kg on the plates is 12." in finding.message


def test_what_is_missing_is_told_and_not_checked(trial: Path) -> None:
    (trial / "subject01_walk1.trc").unlink()
    (trial / "inverse_dynamics.sto").unlink()
    report = osimlite.check_trial(trial)
    assert any("subject01_walk1.trc" in why for why in report.unchecked)
    assert any("inverse_dynamics.sto" in why for why in report.unchecked)
    assert not [
        verdict for verdict in report.verdicts if verdict.name in ("marker-error", "residual-force")
    ]


def tables(folder: Path) -> None:
    """Write results of RRA without a setup: peaks of 30 N and 60 N m, and an error of 6 cm."""
    times = np.linspace(0.0, 1.0, 51)
    bump = np.exp(-(((times - 0.5) / 0.05) ** 2))
    forces = np.column_stack([30.0 * bump, 2.0 * bump, 60.0 * bump])
    write_sto(
        folder / "walk_Actuation_force.sto", "ActuationForces", times, ["FX", "FY", "MZ"], forces
    )
    errors = np.column_stack([0.06 * bump, np.radians(1.0) * bump])
    write_sto(
        folder / "walk_pErr.sto", "PositionErrors", times, ["pelvis_tx", "knee_angle_r"], errors
    )


def test_results_without_a_setup_are_judged_by_what_they_say(tmp_path: Path) -> None:
    tables(tmp_path)
    report = osimlite.check_trial(tmp_path)
    shown: dict[str, Any] = {
        verdict.of: (verdict.verdict, verdict.value) for verdict in report.verdicts
    }
    assert shown["the peak of FX of 'walk_Actuation_force.sto'"] == ("bad", pytest.approx(30.0))
    assert shown["the peak of FY of 'walk_Actuation_force.sto'"] == ("good", pytest.approx(2.0))
    # Without loads, the limit of Hicks et al. (2015) is unknown, and OpenSim's limit is 75 N m.
    assert shown["the peak of MZ of 'walk_Actuation_force.sto'"] == ("okay", pytest.approx(60.0))
    assert shown["the peak of the error of 'pelvis_tx'"] == ("bad", pytest.approx(6.0))
    assert shown["the peak of the error of 'knee_angle_r'"] == ("good", pytest.approx(1.0))
    assert any("no such setup" in why for why in report.unchecked)


def test_a_threshold_of_the_settings_counts(tmp_path: Path) -> None:
    tables(tmp_path)
    (tmp_path / "osimlite.toml").write_text("[thresholds]\nresidual-force-bad = 40\n")
    report = osimlite.check_trial(tmp_path, select="OSIM911")
    assert {finding.severity for finding in report} == {"info"}


def test_the_command_shows_verdicts_and_exits_as_validate(tmp_path: Path, capsys) -> None:
    tables(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(["check-trial", str(tmp_path)])
    out = capsys.readouterr().out
    assert stopped.value.code == 1 and "OSIM911" in out and "Not checked: results of " in out
    assert any(line.startswith("bad") and "30 N" in line for line in out.splitlines())
    # The line after the tables ends there, without an escaped line break.
    assert "it is okay.\n\n" in out
    assert (
        max(
            map(
                len,
                (
                    line
                    for line in out.splitlines()
                    if str(tmp_path) not in line and line[:1] != "N"
                ),
            )
        )
        <= 80
    )
    with pytest.raises(SystemExit) as stopped:
        main(["check-trial", str(tmp_path), "--fail-on", "error", "--format", "json"])
    assert stopped.value.code == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told) == {"findings", "verdicts", "unchecked"} and told["verdicts"][0]["source"]
    with pytest.raises(SystemExit):
        main(["check-trial", str(tmp_path), "--format", "sarif"])
    sarif = json.loads(capsys.readouterr().out)
    assert {rule["id"] for rule in sarif["runs"][0]["tool"]["driver"]["rules"]} == {
        "OSIM911",
        "OSIM912",
        "OSIM914",
    }


def test_a_missing_value_is_a_dash(tmp_path: Path) -> None:
    """A tool writes NaN for times without a solution."""
    tables(tmp_path)
    file = tmp_path / "walk_Actuation_force.sto"
    # The peak of FX is in the row of 0.5 s.
    file.write_text(
        "\n".join(
            "\t".join(["0.5", "nan", *line.split("\t")[2:]])
            if line.split("\t")[0].strip() == "0.5"
            else line
            for line in file.read_text().splitlines()
        )
    )
    report = osimlite.check_trial(tmp_path, select="OSIM911")
    verdict = next(row for row in report.verdicts if "the peak of FX " in row.of)
    assert np.isnan(verdict.value) and verdict.verdict == "bad"
    assert verdict.value_text == "-" and "nan" not in verdict.limits
    # JSON has no NaN.
    (value,) = [row["value"] for row in report.as_dict()["verdicts"] if row["of"] == verdict.of]
    assert value is None
    json.dumps(report.as_dict(), allow_nan=False)


def test_a_folder_without_anything_of_a_trial_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(OsimliteError, match="this is not a trial"):
        osimlite.check_trial(tmp_path)
    with pytest.raises(OsimliteError, match="no such file or folder"):
        osimlite.check_trial(tmp_path / "absent")
