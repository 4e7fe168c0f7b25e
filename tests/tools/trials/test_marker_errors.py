"""Tests of marker errors of one motion in `run`, its table and `check-trial`: where they agree and differ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs scipy (extra 'sim')")

import osimlite
from osimlite.tools.running import run
from tests.labs import change, copy_lab

ONE_TASK = '<IKMarkerTask name="{}"><apply>true</apply><weight>1</weight></IKMarkerTask>'


def compare_errors(folder: Path) -> tuple[np.ndarray, list[tuple[float, float]]]:
    """Run the inverse kinematics of a lab, and check the trial.

    Returns:
        Marker errors (t, m) in cm; root mean square and largest error in cm of the summary of the
        run, of the table that it writes, and of the check of the trial.
    """
    outcome = run(folder / "ik.xml")
    table = outcome.tables["ik_ik_marker_errors.sto"]
    evidence: Any = outcome.evidence
    errors = 100.0 * np.linalg.norm(evidence.positions - evidence.measured, axis=2)
    summary = (
        100.0 * outcome.summary["rms_marker_error"],
        100.0 * outcome.summary["largest_marker_error"],
    )
    written = (
        100.0 * float(np.sqrt(np.mean(table["marker_error_RMS"] ** 2))),
        100.0 * float(table["marker_error_max"].max()),
    )
    return errors, [summary, written, check_errors(folder)]


def check_errors(folder: Path) -> tuple[float, float]:
    """Check a trial.

    Returns:
        Root mean square and largest marker error (cm) that the check reports.
    """
    verdicts = [
        verdict
        for verdict in osimlite.check_trial(folder).verdicts
        if verdict.name == "marker-error"
    ]
    rms, peak = sorted(verdicts, key=lambda verdict: "root" not in verdict.of)
    return rms.value, peak.value


def expect_close(numbers: tuple[float, float], expected: tuple[float, float]) -> None:
    # The check reads the motion from a file with fewer digits.
    assert numbers == pytest.approx(expected, rel=1e-3)


def reduce(errors: np.ndarray) -> tuple[float, float]:
    """Summarize errors, leaving out NaN.

    Returns:
        Root mean square and largest value.
    """
    return float(np.sqrt(np.nanmean(errors**2))), float(np.nanmax(errors))


def test_without_unseen_markers_all_agree(tmp_path: Path) -> None:
    folder = copy_lab("unseen", tmp_path)
    change(folder / "ik.xml", ("<time_range>0 0.05<", "<time_range>0 0.01<"))
    errors, three = compare_errors(folder)
    assert not np.isnan(errors).any()
    for numbers in three:
        expect_close(numbers, reduce(errors))


def test_unseen_markers_count_in_the_table_of_opensim_alone(tmp_path: Path) -> None:
    """An invisible marker adds no error, but OpenSim's mean is over all markers."""
    errors, (summary, written, checked) = compare_errors(copy_lab("unseen", tmp_path))
    assert np.isnan(errors).any()
    expect_close(summary, reduce(errors))
    expect_close(checked, reduce(errors))
    expect_close(written, reduce(np.nan_to_num(errors)))
    assert written[0] < 0.999 * summary[0]


def test_without_the_markers_the_check_reads_the_table(tmp_path: Path) -> None:
    folder = copy_lab("unseen", tmp_path)
    _, (_, written, _) = compare_errors(folder)
    (folder / "walk.trc").unlink()
    expect_close(check_errors(folder), written)


def test_markers_without_weight_count_in_the_run_alone(tmp_path: Path) -> None:
    folder = copy_lab("unseen", tmp_path)
    task = ONE_TASK.format("SAC")
    change(
        folder / "ik.xml",
        (task, task.replace("<weight>1<", "<weight>0<")),
        ("<time_range>0 0.05<", "<time_range>0 0.01<"),
    )
    errors, (summary, written, checked) = compare_errors(folder)
    expect_close(summary, reduce(errors))
    expect_close(written, reduce(errors))
    expect_close(checked, reduce(np.delete(errors, 2, axis=1)))
    assert checked[0] < 0.99 * summary[0]


@pytest.mark.parametrize("how", ["not applied", "no task", "no tasks at all"])
def test_markers_without_a_task(tmp_path: Path, how: str) -> None:
    """Without any marker task all markers count; otherwise only those of tasks that apply."""
    folder = copy_lab("unseen", tmp_path)
    change(folder / "ik.xml", ("<time_range>0 0.05<", "<time_range>0 0.01<"))
    task = ONE_TASK.format("SAC")
    text = (folder / "ik.xml").read_text()
    if how == "not applied":
        text = text.replace(task, task.replace("<apply>true<", "<apply>false<"))
    elif how == "no task":
        text = text.replace(task, "")
    else:
        start, end = text.index("<IKTaskSet>"), text.index("</IKTaskSet>") + len("</IKTaskSet>")
        text = text[:start] + text[end:]
    (folder / "ik.xml").write_text(text)
    errors, three = compare_errors(folder)
    assert errors.shape[1] == (8 if how == "no tasks at all" else 7)
    for numbers in three:
        expect_close(numbers, reduce(errors))
