"""Tests of MocoTrack on 2-D walking that follows a measured gait (opensim-core's example2DWalking)."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto
from osimlite.moco import MocoTrajectory, build_track_problem, evaluate
from osimlite.optimal.program import Program
from tests.conftest import ROOT
from tests.optimal.studies import moco_found, moco_said, study

WALKING = "OpenSim/Examples/Moco/example2DWalking"


@pytest.fixture
def example():
    for parent in ROOT.parents:
        if (folder := parent / "pub-opensim-core" / WALKING).is_dir():
            return folder
    return pytest.skip("needs the sources of opensim-core, which are not beside this repository")


def gait(intervals):
    operators = [osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)]
    return osimlite.MocoTrack(
        name="gait",
        model=osimlite.ModelProcessor(filepath="2D_gait.osim"),
        states_reference=osimlite.TableProcessor(
            filepath="referenceCoordinates.sto", operators=operators
        ),
        allow_unused_references=True,
        track_reference_position_derivatives=True,
        apply_tracked_states_to_guess=True,
        initial_time=0.0,
        final_time=0.470089,
        mesh_interval=0.470089 / intervals,
    )


def test_moco_s_walk_is_one_here(example, tmp_path):
    """Moco's solution has the same cost here, term by term, and fulfils the constraints to its tolerance."""
    of_moco = study(tmp_path, "track").problem.phases

    def more(made):
        phase = made.problem.phases
        phase.goals[1].weight = 10.0
        phase.goals += [of_moco.goals[2].copy_deep(), of_moco.goals[3].copy_deep()]
        phase.state_infos += [info.copy_deep() for info in of_moco.state_infos]

    problem, guess = build_track_problem(gait(10), folder=Path(example), more=more)
    assert problem.solver.num_mesh_intervals == 10
    assert guess is not None and len(guess.times) == 50
    program = Program(problem)
    terms, missed = evaluate(program, MocoTrajectory.read(moco_found(tmp_path, "walk-10t4")))
    assert terms == pytest.approx(moco_said("walk-10t4")["terms"], rel=1e-10)
    assert missed[0].size < 3e-6
    # References are functions of time: their derivatives must be exact where the times are
    # variables too.
    w = program.layout.make_guess()
    way = np.random.default_rng(0).normal(size=len(w)) * 1e-2
    way[:2] = 0.01, -0.02
    gradient, numbers = program.compute_slopes(w)
    change = (
        program.compute_values(w + 1e-5 * way)[0].sum()
        - program.compute_values(w - 1e-5 * way)[0].sum()
    ) / 2e-5
    assert gradient @ way == pytest.approx(change, rel=1e-6)
    assert np.isfinite(numbers).all()


def test_what_tools_do_not_do_is_refused(example):
    tool = gait(10)
    tool.final_time = 3.0
    with pytest.raises(
        osimlite.OsimliteError,
        match=r"the tables cover 0 s to 0.47.* s, not the motion from 0 s to 3 s",
    ):
        build_track_problem(tool, folder=Path(example))
    tool.states_reference.filepath = ""
    with pytest.raises(
        osimlite.OsimliteError, match="a states_reference or a markers_reference is required"
    ):
        build_track_problem(tool, folder=Path(example))


def test_a_setup_is_run(example, tmp_path):
    for name in ("2D_gait.osim", "referenceCoordinates.sto"):
        shutil.copy(Path(example) / name, tmp_path)
    osimlite.write(gait(2), tmp_path / "track.xml")
    lines = []
    outcome = osimlite.run(tmp_path / "track.xml", progress=lines.append)
    assert outcome.done and outcome.summary["status"] == "Solve_Succeeded"
    assert sorted(path.name for path in outcome.files) == [
        "gait_solution.sto",
        "gait_tracked_states.sto",
    ]
    assert ", infeasibility " in lines[0]
    written = MocoTrajectory.read(tmp_path / "gait_solution.sto")
    assert float(written.header["objective"]) == pytest.approx(
        outcome.summary["objective"], abs=1e-6
    )
    followed = read_sto(tmp_path / "gait_tracked_states.sto")
    assert len(followed.columns) == 20 and len(followed.times) == 50
