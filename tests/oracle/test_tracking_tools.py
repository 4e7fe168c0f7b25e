"""Compare RRATool and CMCTool with a live OpenSim on the beginning of a measured walk."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import StoTable, read_sto
from tests.scripts import run_script
from tests.suite import choose

pytest.importorskip("opensim", reason="needs the opensim package (extra 'oracle')")
pytestmark = pytest.mark.oracle

# Coordinates that are tracked.
COORDINATES = ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r",
               "hip_flexion_l", "knee_angle_l", "ankle_angle_l", "lumbar_extension")  # fmt: skip
TASK = """<CMC_Joint name="{name}">
    <weight>{weight}</weight><active>true false false</active><kp>100</kp><kv>20</kv><coordinate>{name}</coordinate>
    {more}
</CMC_Joint>
"""
SETUP = """<OpenSimDocument Version="40600">
    <{tool} name="it">
        <model_file>model.osim</model_file>
        <force_set_files>reserves.xml</force_set_files>
        <results_directory>{results}</results_directory>
        <output_precision>16</output_precision>
        <initial_time>0.6</initial_time>
        <integrator_error_tolerance>1e-5</integrator_error_tolerance>
        <external_loads_file>grf.xml</external_loads_file>
        <desired_kinematics_file>walk.mot</desired_kinematics_file>
        <task_set_file>tasks.xml</task_set_file>
        <lowpass_cutoff_frequency>6</lowpass_cutoff_frequency>
        {more}
    </{tool}>
</OpenSimDocument>
"""


@pytest.fixture
def walk(shared: Path, tmp_path: Path) -> Path:
    """Return a folder with the model of a subject, its walk, loads and reserve actuators."""
    source = shared / "oracle" / "tools" / "reference"
    model = gzip.decompress((source / "models" / "gait10_subject01.osim.gz").read_bytes())
    (tmp_path / "model.osim").write_bytes(model)
    (tmp_path / "walk.mot").write_bytes(
        (source / "ik_gait10" / "subject01_walk_IK.mot").read_bytes()
    )
    loads = source / "id_gait10"
    grf = gzip.decompress((loads / "subject01_walk_grf.mot.gz").read_bytes())
    (tmp_path / "subject01_walk_grf.mot").write_bytes(grf)
    (tmp_path / "grf.xml").write_text((loads / "subject01_walk_grf.xml").read_text())
    reserves = (source / "so_gait10" / "gait10dof_Reserve_Actuators.xml").read_text()
    (tmp_path / "reserves.xml").write_text(reserves)
    return tmp_path


def tracked(
    folder: Path, tool: str, more: str, limits: str = ""
) -> tuple[dict[str, StoTable], dict[str, StoTable]]:
    """Run a tracking tool with both programs.

    Args:
        folder: folder of `walk`.
        tool: class of the tool.
        more: further properties of the setup.
        limits: further properties of each task.

    Returns:
        The tables of osimlite and those of OpenSim, by name.
    """
    weights = {"pelvis_tilt": 700, "pelvis_tx": 500}
    tasks = (
        TASK.format(name=name, weight=weights.get(name, 250), more=limits) for name in COORDINATES
    )
    text = f"<OpenSimDocument Version='40600'><CMC_TaskSet><objects>{''.join(tasks)}</objects></CMC_TaskSet>"
    (folder / "tasks.xml").write_text(f"{text}</OpenSimDocument>")
    for results in ("ours", "theirs"):
        (folder / f"{results}.xml").write_text(SETUP.format(tool=tool, results=results, more=more))
    script = f"import opensim; opensim.Logger.setLevelString('Off'); assert opensim.{tool}('theirs.xml').run()"
    run_script(script, folder=folder)
    outcome = osimlite.run(folder / "ours.xml")
    assert outcome.done, outcome.messages
    # OpenSim's table of states has two headers.
    names = [
        path.name
        for path in (folder / "theirs").glob("*.sto")
        if not path.name.endswith("_states.sto")
    ]
    assert len(names) == 8 and {*names} <= {*outcome.tables}
    theirs = {name: read_sto(folder / "theirs" / name) for name in names}
    for name, table in theirs.items():
        assert outcome.tables[name].columns == table.columns
    return outcome.tables, theirs


def apart(mine: StoTable, known: StoTable) -> float:
    """Return the largest difference of two tables, relative to the largest number of its column."""
    assert mine.times == pytest.approx(known.times, abs=1e-9)
    largest = np.abs(known.rows).max(axis=0)
    return float(
        (np.abs(mine.rows - known.rows).max(axis=0) / np.where(largest > 1e-9, largest, 1.0)).max()
    )


def test_residual_reduction(walk: Path) -> None:
    """The tables agree in nearly all digits, because the least squares of each window have one solution."""
    more = """<final_time>0.64</final_time><replace_force_set>true</replace_force_set>
        <adjust_com_to_reduce_residuals>true</adjust_com_to_reduce_residuals>
        <initial_time_for_com_adjustment>0.6</initial_time_for_com_adjustment>
        <final_time_for_com_adjustment>1.2</final_time_for_com_adjustment>
        <adjusted_com_body>torso</adjusted_com_body><output_model_file>{}.osim</output_model_file>"""
    limits = "<limit>0.0002</limit>"
    ours, theirs = tracked(walk, "RRATool", more.format("adjusted"), limits)
    for name, table in theirs.items():
        # Position errors of 1e-5 are differences of nearly equal coordinates and have fewer exact
        # digits.
        assert apart(ours[name], table) < (1e-5 if name == "it_pErr.sto" else 1e-7), name
    words = [(walk / folder / "it_avgResiduals.txt").read_text() for folder in ("ours", "theirs")]
    assert words[0] == words[1]
    changed, known = osimlite.read(walk / "adjusted.osim"), osimlite.read(walk / "model.osim")
    moved = [
        np.array(
            next(
                body for body in model.components(osimlite.Body) if body.name == "torso"
            ).mass_center
        )
        for model in (changed, known)
    ]
    # The adjusted model still has its muscles. OpenSim's run wrote a model of the same name
    # earlier.
    assert (
        0.0 < np.abs(moved[0] - moved[1]).max() <= 0.1
        and len([*changed.components(osimlite.Force)]) > 10
    )


def test_the_model_is_that_of_opensim(walk: Path) -> None:
    more = """<final_time>0.61</final_time><replace_force_set>true</replace_force_set>
        <adjust_com_to_reduce_residuals>true</adjust_com_to_reduce_residuals>
        <adjusted_com_body>torso</adjusted_com_body><output_model_file>{}.osim</output_model_file>"""
    text = SETUP.format(tool="RRATool", results="theirs", more=more)
    tracked(walk, "RRATool", more.format("theirs"))
    known = osimlite.read(walk / "theirs.osim")
    (walk / "ours.xml").write_text(text.format("mine"))
    osimlite.run(walk / "ours.xml")
    mine = osimlite.read(walk / "mine.osim")
    found = [
        next(body for body in model.components(osimlite.Body) if body.name == "torso").mass_center
        for model in (mine, known)
    ]
    assert found[0] == pytest.approx(found[1], abs=1e-12)


@pytest.mark.parametrize("fast", [True, False])
def test_computed_muscle_control(walk: Path, fast: bool) -> None:
    """Results agree as far as OpenSim's optimizer converges: same windows, and similar excitations."""
    more = f"""<final_time>{choose(0.645, 0.65)}</final_time><cmc_time_window>0.005</cmc_time_window>
        <optimization_convergence_tolerance>1e-5</optimization_convergence_tolerance>
        <use_fast_optimization_target>{str(fast).lower()}</use_fast_optimization_target>"""
    ours, theirs = tracked(walk, "CMCTool", more)
    # The steps depend on the last digits of forces, but the time windows end at the same times.
    ends = 0.63 + 0.005 * np.arange(3)
    motions, controls = (
        [
            [table.rows[np.abs(table.times - t).argmin()] for t in ends]
            for table in (ours[name], theirs[name])
        ]
        for name in ("it_Kinematics_q.sto", "it_controls.sto")
    )
    assert ours["it_Kinematics_q.sto"].times[0] == pytest.approx(0.63, abs=1e-12)
    assert np.array(motions[0]) == pytest.approx(np.array(motions[1]), abs=0.02)
    off = np.abs(np.array(controls[0]) - np.array(controls[1]))
    assert off.max() < 0.05 and np.median(off) < 1e-3
    errors = [np.abs(tables["it_pErr.sto"].rows).max() for tables in (ours, theirs)]
    assert errors[0] <= errors[1] + 1e-4
