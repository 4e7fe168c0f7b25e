"""Tests of MocoInverse: muscle activity of a prescribed squat is compared with Moco's solution."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.errors import OsimliteError
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.moco import MocoTrajectory, build_inverse_problem, evaluate, solve, solve_inverse
from osimlite.optimal.program import Program
from tests.optimal.studies import moco_found, moco_said, study, study_file

NAME = "squat_inverse-20"


def squat(folder, **choices):
    """Return the MocoInverse tool of the squat.

    The study that OpenSim wrote for it contains the motion with six digits only, so the motion
    comes from the solution file instead.
    """
    model = study(folder, NAME).problem.phases.model.model.copy_deep()
    for motion in list(model.components(osimlite.PositionMotion)):
        model.remove(motion)
    if not (folder / "squat-25.sto").exists():
        moco_found(folder, "squat-25")
    kinematics = osimlite.TableProcessor(
        filepath="squat-25.sto", operators=[osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)]
    )
    settings = {
        "initial_time": 0.0,
        "final_time": 1.0,
        "mesh_interval": 0.05,
        "convergence_tolerance": 1e-4,
        "constraint_tolerance": 1e-4,
        "kinematics_allow_extra_columns": True,
        "minimize_sum_squared_activations": True,
    }
    return osimlite.MocoInverse(
        name="squat",
        model=osimlite.ModelProcessor(model=model),
        kinematics=kinematics,
        **(settings | choices),
    )


def test_moco_s_solution_is_one_here(tmp_path):
    program = Program(build_inverse_problem(squat(tmp_path), folder=tmp_path))
    terms, missed = evaluate(program, MocoTrajectory.read(moco_found(tmp_path, NAME)))
    assert terms == pytest.approx(moco_said(NAME)["terms"], rel=1e-9)
    # The rows are N m, with terms of some hundreds; OpenSim's poses fulfil the patella constraint
    # to about 1e-9.
    assert missed[0].size < 1e-3


def test_ours_costs_no_more(tmp_path):
    found = solve_inverse(squat(tmp_path), folder=tmp_path)
    assert found.success
    assert found.objective <= moco_said(NAME)["objective"] * (1.0 + 1e-4)
    for kind, names in MocoTrajectory.read(moco_found(tmp_path, NAME)).names.items():
        assert found.trajectory.names.get(kind, ())[: len(names)] == names
    assert "/jointset/hip_r/hip_flexion_r/value" in found.states.columns


def test_meshes_of_given_motions_are_refined(tmp_path):
    """Meshes are refined with rigid tendons; implicit tendons are refused."""
    with pytest.raises(OsimliteError, match="does not support implicit tendons"):
        solve_inverse(squat(tmp_path), folder=tmp_path, refine=1e-3)
    rigid = squat(tmp_path, mesh_interval=0.2)
    rigid.model.operators.append(osimlite.ModOpIgnoreTendonCompliance())
    found = solve_inverse(rigid, folder=tmp_path, refine=1e-3)
    assert found.success
    assert found.rounds[0].error > 1e-3 >= found.rounds[-1].error
    assert found.states.times[-1] == pytest.approx(1.0)


def test_columns_that_are_no_states_must_be_allowed(tmp_path):
    with pytest.raises(
        OsimliteError, match=r"is not a state.*[Ss]et kinematics_allow_extra_columns"
    ):
        build_inverse_problem(
            squat(tmp_path, kinematics_allow_extra_columns=False), folder=tmp_path
        )


def test_names_of_coordinates_will_do(tmp_path):
    """Other tools name columns by coordinates and write degrees."""
    made = build_inverse_problem(squat(tmp_path), folder=tmp_path)
    table = read_sto(tmp_path / "squat-25.sto")
    names = [name for name in table.columns if name.endswith("/value")]
    rows = np.rad2deg(np.column_stack([table[name] for name in names]))
    short = [name.split("/")[-2] for name in names]
    write_sto(tmp_path / "squat-25.sto", "", table.times, short, rows, in_degrees=True)
    again = build_inverse_problem(squat(tmp_path), folder=tmp_path)
    times = np.linspace(0.0, 1.0, 5)
    assert again.functions.numbers(times) == pytest.approx(
        made.functions.numbers(times), rel=1e-9, abs=1e-9
    )


def test_setups_are_run_and_tell_the_motion_too(tmp_path):
    osimlite.write(squat(tmp_path, mesh_interval=0.2), tmp_path / "setup.xml")
    outcome = osimlite.run(tmp_path / "setup.xml", simulates=True)
    assert outcome.done
    assert ("not simulated", "the motion is prescribed") in outcome.messages
    page = osimlite.report({tmp_path / "setup.xml": outcome}, tmp_path / "page.html").read_text(
        encoding="utf-8"
    )
    assert (
        "<h1>squat</h1>" in page
        and "<h2>Controls</h2>" in page
        and "<h2>Contact forces</h2>" not in page
    )
    table = outcome.tables["squat_solution.sto"]
    assert {"/jointset/hip_r/hip_flexion_r/value", "/jointset/hip_r/hip_flexion_r/speed"} <= {
        *table.columns
    }
    speed = np.gradient(table["/jointset/hip_r/hip_flexion_r/value"], table.times)
    assert np.abs(speed - table["/jointset/hip_r/hip_flexion_r/speed"])[2:-2].max() < 0.3


def test_a_study_with_a_motion(tmp_path):
    found = solve(study_file(tmp_path, NAME))
    assert found.success
    # The motion has six digits, and its accelerations have fewer.
    assert found.objective == pytest.approx(moco_said(NAME)["objective"], rel=0.05)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda phase: setattr(
                phase, "time_final_bounds", osimlite.MocoFinalBounds(bounds=(0.9, 1.1))
            ),
            "be fixed",
        ),
        (
            lambda phase: phase.parameters.append(
                osimlite.MocoParameter(component_paths=("/bodyset/torso",), property_name="mass")
            ),
            "parameters",
        ),
        (
            lambda phase: phase.goals.append(osimlite.MocoAverageSpeedGoal(name="speed")),
            "with a prescribed motion",
        ),
    ],
)
def test_what_a_given_motion_excludes(change, words, tmp_path):
    made = study(tmp_path, NAME)
    change(made.problem.phases)
    with pytest.raises(OsimliteError, match=words):
        Program(osimlite.moco.build_problem(made, tmp_path))


def test_a_motion_without_a_coordinate(tmp_path):
    made = study(tmp_path, NAME)
    (motion,) = made.problem.phases.model.model.components(osimlite.PositionMotion)
    motion.functions.objects.pop()
    with pytest.raises(OsimliteError, match="has no function for '/jointset/"):
        osimlite.moco.build_problem(made, tmp_path)


def test_muscles_without_states_are_solved(tmp_path):
    """As in Moco, activations are controls then, and only the balance of generalized forces remains."""
    tool = squat(tmp_path)
    tool.model.operators = [
        osimlite.ModOpIgnoreActivationDynamics(),
        osimlite.ModOpIgnoreTendonCompliance(),
    ]
    problem = build_inverse_problem(tool, folder=tmp_path)
    assert not problem.functions.states
    found = solve_inverse(tool, folder=tmp_path)
    assert found.success and found.violations[0].size < 1e-3
