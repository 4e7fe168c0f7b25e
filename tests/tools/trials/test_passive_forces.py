"""Tests of passive muscle forces in a trial against Thelen's law, at rows of the trial's time range."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import write_sto
from osimlite.tools.job import Job
from osimlite.tools.trials.folder import MissingInput, TrialFolder, TrialTool
from osimlite.tools.trials.muscles import MAX_ROWS, compute_passive_forces, measure_passive_forces
from tests.simple_models import make_slide

STRENGTH_N, OPTIMAL_M, TENDON_M = 200.0, 0.1, 0.02


def write_trial(
    folder: Path, count: int, first: float = 0.1, last: float = 0.9, cutoff: float = -1.0
) -> TrialTool:
    """Write a muscle, a motion of one second that stretches it to 1.35 optimal fiber lengths, and a setup.

    Args:
        folder: folder of the files.
        count: number of rows of the motion.
        first: start of the time range (s).
        last: end of the time range (s).
        cutoff: cutoff frequency of the setup (Hz); negative for none.

    Returns:
        The setup as a tool of a trial.
    """
    muscle = osimlite.Thelen2003Muscle(
        name="muscle",
        max_isometric_force=STRENGTH_N,
        optimal_fiber_length=OPTIMAL_M,
        tendon_slack_length=TENDON_M,
    )
    for number, (frame, place) in enumerate((("/ground", 0.0), ("/bodyset/body", 0.0))):
        point = osimlite.PathPoint(
            name=f"p{number}", socket_parent_frame=frame, location=(place, 0.0, 0.0)
        )
        muscle.geometry_path.path_point_set.objects.append(point)
    osimlite.write(make_slide(muscle), folder / "model.osim")
    times = np.linspace(0.0, 1.0, count)
    fibers = OPTIMAL_M * (1.05 + 0.3 * np.sin(np.pi * times))
    write_sto(
        folder / "motion.sto",
        "motion",
        times.tolist(),
        ["x"],
        (TENDON_M + fibers)[:, None].tolist(),
    )
    write_sto(
        folder / "states.sto",
        "states",
        times.tolist(),
        ["/jointset/slide/x/value", "/jointset/slide/x/speed"]
        + [f"/forceset/muscle/{name}" for name in ("activation", "fiber_length")],
        np.column_stack([TENDON_M + fibers, 0.0 * times, 0.05 + 0.0 * times, fibers]).tolist(),
    )
    setup = osimlite.InverseDynamicsTool(
        name="id",
        model_file="model.osim",
        coordinates_file="motion.sto",
        time_range=(first, last),
        lowpass_cutoff_frequency_for_coordinates=cutoff,
    )
    osimlite.write(setup, folder / "id.xml")
    return TrialTool(TrialFolder([folder]), Job(setup, folder / "id.xml"))


def passive(times: np.ndarray) -> np.ndarray:
    """Compute the passive force by Thelen 2003, with the default shape 5 and strain 0.6 at the isometric force."""
    strain = 0.05 + 0.3 * np.sin(np.pi * times)
    return STRENGTH_N * (np.exp(5.0 * strain / 0.6) - 1.0) / (np.exp(5.0) - 1.0)


@pytest.mark.parametrize("count", [11, MAX_ROWS + 1, 2 * MAX_ROWS, 3 * MAX_ROWS + 1])
def test_forces_at_some_rows_of_the_range(tmp_path: Path, count: int) -> None:
    tool = write_trial(tmp_path, count)
    table = compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
    assert table.columns == ("muscle",)
    # The tolerance covers the stretch of the tendon.
    np.testing.assert_allclose(table["muscle"], passive(table.times), rtol=0.05)
    inside = np.linspace(0.0, 1.0, count)
    # As in OpenSim, the last row before the range is the first that is used.
    first = int(np.searchsorted(inside, 0.1 + 1e-9)) - 1
    inside = inside[first : int(np.searchsorted(inside, 0.9 + 1e-9))]
    assert set(table.times.round(9)) <= set(inside.round(9))
    assert table.times[0] == pytest.approx(inside[0])
    assert min(len(inside), MAX_ROWS // 2) <= len(table.times) <= MAX_ROWS


@pytest.mark.parametrize(("first", "rows"), [(0.005, 51), (0.015, 100)])
def test_as_many_rows_as_may_be_and_no_more(tmp_path: Path, first: float, rows: int) -> None:
    tool = write_trial(tmp_path, 101, first, 2.0)
    table = compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
    assert MAX_ROWS == 100 and len(table.times) == rows


def test_a_range_beyond_the_file_has_all_rows(tmp_path: Path) -> None:
    tool = write_trial(tmp_path, 11, -1.0, 2.0)
    table = compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
    assert table.times == pytest.approx(np.linspace(0.0, 1.0, 11))


def test_fibers_of_states_are_those_of_the_file(tmp_path: Path) -> None:
    tool = write_trial(tmp_path, 11)
    table = compute_passive_forces(tool, tmp_path / "states.sto", is_states=True)
    assert table.times == pytest.approx(np.linspace(0.1, 0.9, 9))
    np.testing.assert_allclose(table["muscle"], passive(table.times), rtol=1e-6)


def test_motions_are_filtered_and_states_are_not(tmp_path: Path) -> None:
    tool = write_trial(tmp_path, 101, cutoff=0.5)
    filtered = compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
    assert filtered["muscle"].max() < 0.8 * passive(np.array([0.5]))[0]
    table = compute_passive_forces(tool, tmp_path / "states.sto", is_states=True)
    np.testing.assert_allclose(table["muscle"], passive(table.times), rtol=1e-6)


def test_the_largest_of_the_strength_is_told(tmp_path: Path) -> None:
    tool = write_trial(tmp_path, 11)
    ((file, measurement),) = measure_passive_forces(tool, None)
    assert file == tmp_path / "motion.sto"
    largest = float(passive(np.array([0.5]))[0])
    assert measurement.value == pytest.approx(100.0 * largest / STRENGTH_N, rel=0.05)
    assert "'muscle'" in measurement.of and measurement.where.endswith(" at 0.5 s")
    ((file, measurement),) = measure_passive_forces(tool, tmp_path / "states.sto")
    assert file == tmp_path / "states.sto"
    assert measurement.value == pytest.approx(100.0 * largest / STRENGTH_N, rel=1e-6)


def test_without_muscles_or_rows_there_is_nothing_to_compute(tmp_path: Path) -> None:
    for tool in (write_trial(tmp_path, 11, 2.0, 3.0), write_trial(tmp_path, 11, 0.41, 0.49)):
        with pytest.raises(MissingInput, match="no row in its time range"):
            compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
    tool = write_trial(tmp_path, 11)
    osimlite.write(make_slide(), tmp_path / "model.osim")
    tool = TrialTool(TrialFolder([tmp_path]), tool.job)
    with pytest.raises(MissingInput, match="has no muscles"):
        compute_passive_forces(tool, tmp_path / "motion.sto", is_states=False)
