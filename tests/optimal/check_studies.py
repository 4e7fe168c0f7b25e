"""Tests of Moco studies: Moco's solutions have the same costs and residuals here, and osimlite's cost no more."""

from __future__ import annotations

import re
import signal
from functools import cache

import numpy as np
import pytest

import osimlite
from osimlite.io.tables.storage import read_sto, write_sto
from osimlite.moco import MocoTrajectory, build_problem, evaluate, solve
from osimlite.optimal.ipopt import Violation
from osimlite.optimal.program import Program
from osimlite.optimal.solution import MocoSolution
from osimlite.tools.job import Job
from osimlite.tools.moco_tools import report_solution
from osimlite.tools.outcome import Outcome
from tests.optimal import small
from tests.optimal.studies import moco_found, moco_said, study, study_file

STUDIES = "sliding-100", "pendulum-50", "squat-25"
SCHEMES = "trapezoidal", "legendre-gauss-3", "legendre-gauss-radau-3"


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """Return a cached function that solves the study of a name without changes."""
    folder = tmp_path_factory.mktemp("solved")
    return cache(lambda name: solve(study_file(folder, name)))


@pytest.mark.parametrize("name", STUDIES)
def test_moco_s_solution_is_one_here(name, tmp_path):
    program = Program(build_problem(study_file(tmp_path, name)))
    terms, missed = evaluate(program, MocoTrajectory.read(moco_found(tmp_path, name)))
    said = moco_said(name)
    assert terms == pytest.approx(said["terms"], rel=1e-9)
    # Moco stops when the unscaled rows are below 1e-4, and its files have 16 digits.
    assert not missed or missed[0].size < max(said["ctol"], 1e-7)


@pytest.mark.parametrize("name", STUDIES)
def test_ours_costs_no_more(name, solved, tmp_path):
    said, found = moco_said(name), solved(name)
    assert found.success
    if name == "squat-25":
        # At the study's tolerance, rounding decides where a search ends, 4e-4 to 2e-3 above the
        # optimum.
        assert found.objective == pytest.approx(said["objective"], rel=2e-3)
        found = solve(study(tmp_path, name, optim_convergence_tolerance=1e-5))
    assert found.objective <= said["objective"] * (1.0 + 1e-4)
    assert found.objective == pytest.approx(sum(found.terms.values()))
    if name != "squat-25":
        # The same program with the same numbers leads Ipopt through the same iterations.
        assert (found.iterations, found.objective) == (
            said["iterations"],
            pytest.approx(said["objective"], rel=1e-7),
        )


@pytest.mark.parametrize("name", STUDIES)
def test_exact_hessian_finds_it_too(name, tmp_path):
    found = solve(study(tmp_path, name, optim_hessian_approximation="exact"))
    assert found.success
    assert found.objective <= moco_said(name)["objective"] * (1.0 + 1e-4)


@pytest.mark.parametrize("hessian", ["limited-memory", "exact"])
@pytest.mark.parametrize("name", STUDIES)
def test_scaled_variables_find_it_too(name, hessian, tmp_path):
    scaled = {"scale_variables_using_bounds": True, "optim_hessian_approximation": hessian}
    found = solve(study(tmp_path, name, **scaled))
    assert found.success
    # At the tolerance of the squat, the limited-memory method ends up to 4e-4 above the optimum.
    assert found.objective <= moco_said(name)["objective"] * (
        1.0 + (1e-4 if hessian == "exact" else 5e-4)
    )
    if name == "squat-25":
        assert found.iterations < 40


def test_nothing_to_make_small():
    """Solve a study without costs: its Hessian has only constraints, whose multipliers vanish, and is left out."""

    def found(hessian):
        given = small.study_of(
            small.coupled(small.links(), "q1"), optim_hessian_approximation=hessian
        )
        given.problem.phases.state_infos = [
            osimlite.MocoVariableInfo(
                name="/jointset/j0/q0/value", bounds=(-2.0, 2.0), initial_bounds=(-0.5,)
            )
        ]
        return solve(given)

    exact, other = found("exact"), found("limited-memory")
    assert exact.success and exact.objective == 0.0
    assert exact.iterations == other.iterations


@pytest.mark.parametrize("scheme", SCHEMES)
def test_schemes_agree(scheme, tmp_path):
    found = solve(
        study(tmp_path, "sliding-100", transcription_scheme=scheme, num_mesh_intervals=40)
    )
    # Minimal time is 2 sqrt(distance / acceleration) for 1 m at 25 m/s2.
    assert found.success
    assert found.objective == pytest.approx(0.4, abs=2e-3)


def test_implicit_dynamics_agree(tmp_path, solved):
    explicit = solved("pendulum-50")
    implicit = solve(study(tmp_path, "pendulum-50", multibody_dynamics_mode="implicit"))
    assert implicit.success
    assert implicit.objective == pytest.approx(explicit.objective, rel=1e-4)
    assert implicit.trajectory.names["derivatives"] == (
        "/jointset/j0/q0/accel",
        "/jointset/j1/q1/accel",
    )


def test_the_file_comes_back_and_starts_another_search(tmp_path, solved):
    found = solved("pendulum-50")
    found.write(tmp_path / "solution.sto")
    again = MocoTrajectory.read(tmp_path / "solution.sto")
    assert again.header["status"] == "Solve_Succeeded"
    for name, column in found.trajectory.columns.items():
        np.testing.assert_allclose(again.columns[name], column, rtol=1e-14, atol=1e-14)
    warm = solve(study_file(tmp_path, "pendulum-50"), guess=tmp_path / "solution.sto")
    assert warm.iterations < found.iterations
    assert warm.objective == pytest.approx(found.objective, rel=1e-4)


def test_implicit_tendons(tmp_path):
    """Compare Moco's hanging muscle: its solution fulfils the tendon equilibrium here, and that of osimlite costs no more."""

    def hanging():
        given = study(tmp_path, "hanging-25")
        # The disabled goal contributes 1e-11 of the objective.
        given.problem.phases.goals[1].enabled = False
        return given

    said = moco_said("hanging-25")
    program = Program(build_problem(hanging()))
    terms, missed = evaluate(program, MocoTrajectory.read(moco_found(tmp_path, "hanging-25")))
    assert terms == {"goal": pytest.approx(said["terms"]["goal"], rel=1e-9)}
    assert missed[0].size < said["ctol"]
    found = solve(hanging())
    assert found.success
    assert found.objective <= said["objective"] * (1.0 + 1e-4)
    assert (
        "/forceset/muscle/implicitderiv_normalized_tendon_force"
        in found.trajectory.names["derivatives"]
    )


def test_progress_names_what_is_violated_and_when(tmp_path):
    told = []
    found = solve(study(tmp_path, "pendulum-50", optim_max_iterations=6), tell=told.append)
    assert [each.iteration for each in told] == list(range(7))
    assert not found.success
    assert found.status == "Maximum_Iterations_Exceeded"
    assert "defect at" in str(told[1].worst)
    assert str(told[1]).startswith("iteration 1, objective ")
    assert found.violations[0].size >= found.violations[-1].size > 0.0


@pytest.mark.parametrize(
    ("success", "name", "count"), [(True, "largest violation", 1), (False, "not fulfilled", 5)]
)
def test_a_failure_names_more_violations_than_a_solution(success, name, count, tmp_path):
    problem = build_problem(small.study_of(small.links()))
    layout = Program(problem).layout
    motion = MocoTrajectory.from_variables(layout, layout.make_guess())
    violations = [Violation(f"row {number}", 0.1, 1.0 / (1 + number)) for number in range(7)]
    solution = MocoSolution(motion, success, "a status", 3.0, {"goal": 3.0}, violations, 4, 0.5)
    outcome = Outcome()
    report_solution(Job(problem.study, tmp_path / "study.omoco"), problem, solution, outcome)
    assert outcome.done is success
    told = [
        words
        for title, words in outcome.messages
        if title in ("largest violation", "not fulfilled")
    ]
    assert told == [str(violation) for violation in violations[:count]]
    assert (name, told[0]) in outcome.messages
    # The solution is simulated on request only.
    assert not {"simulated", "not simulated"} & {title for title, _ in outcome.messages}


def test_an_interrupt_keeps_the_best_so_far(tmp_path):
    told = []

    def tell(progress):
        told.append(progress)
        if progress.iteration == 8:
            signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    found = solve(study_file(tmp_path, "pendulum-50"), tell=tell)
    assert signal.getsignal(signal.SIGINT) is before
    assert (found.success, found.status) == (False, "User_Requested_Stop")
    assert len(told) < 12
    least = min(progress.worst.size for progress in told)
    assert found.violations[0].size == pytest.approx(least, rel=1e-6)


def test_parameters_are_found(tmp_path):
    """The lightest slider arrives first, after 2 sqrt(1 m / (50 N / mass))."""
    given = study(tmp_path, "sliding-100", num_mesh_intervals=20)
    bounds = osimlite.MocoBounds(bounds=(1.0, 4.0))
    given.problem.phases.parameters.append(
        osimlite.MocoParameter(
            name="mass", moco_bounds=bounds, component_paths=("/body",), property_name="mass"
        )
    )
    found = solve(given)
    assert found.success
    assert found.parameters == {"mass": pytest.approx(1.0, abs=1e-4)}
    assert found.objective == pytest.approx(2.0 * np.sqrt(1.0 / 50.0), rel=2e-3)
    found.write(tmp_path / "solution.sto")
    assert MocoTrajectory.read(tmp_path / "solution.sto").parameters == found.parameters


FOLLOWED = (
    osimlite.MocoTranslationTrackingGoal,
    osimlite.MocoOrientationTrackingGoal,
    osimlite.MocoAngularVelocityTrackingGoal,
)


def _frames(tmp_path, kind, **given):
    """Return Moco's pendulum study with a goal for its second body, and the path of the solution.

    Args:
        tmp_path: folder of the files.
        kind: class of the goal.
        given: properties of the goal.
    """
    changed, found = study(tmp_path, "pendulum-50"), moco_found(tmp_path, "pendulum-50")
    reference = osimlite.TableProcessor(filepath=str(found))
    goal = kind(
        **{"name": "follow", "frame_paths": ["/bodyset/b1"], "states_reference": reference} | given
    )
    changed.problem.phases.goals = [goal]
    return changed, found


@pytest.mark.parametrize("kind", FOLLOWED)
def test_frames_follow_their_own_motion(kind, tmp_path):
    """A goal that tracks its own motion costs nothing; the gradient stays finite at a rotation angle of zero."""
    changed, found = _frames(tmp_path, kind)
    table, reference = read_sto(found), tmp_path / "reference.sto"
    states = [column for column in table.columns if column.startswith("/jointset")]
    write_sto(reference, "", table.times, states, np.column_stack([table[name] for name in states]))
    changed.problem.phases.goals[0].states_reference.filepath = str(reference)
    program = Program(build_problem(changed))
    terms, _ = evaluate(program, MocoTrajectory.read(found))
    assert terms["follow"] < 1e-12
    changed.solver.optim_max_iterations = 1
    assert np.isfinite(solve(changed, guess=found).objective)


@pytest.mark.parametrize(
    ("kind", "given", "said"),
    [
        (
            FOLLOWED[0],
            {"frame_paths": ["/bodyset/b2"]},
            "no frame '/bodyset/b2'; did you mean '/bodyset/b",
        ),
        (FOLLOWED[0], {"frame_paths": []}, "frame_paths is empty"),
        (
            FOLLOWED[1],
            {"states_reference": osimlite.TableProcessor()},
            "a reference file is required",
        ),
        (
            FOLLOWED[1],
            {"rotation_reference_file": "turns.sto"},
            "a reference file and a states_reference",
        ),
        (FOLLOWED[2], {}, "no state '/tau0'"),
    ],
)
def test_frames_that_are_not_told(kind, given, said, tmp_path):
    with pytest.raises(osimlite.OsimliteError, match=said):
        build_problem(_frames(tmp_path, kind, **given)[0])


@pytest.mark.parametrize(
    ("expression", "variables", "said"),
    [
        ("", (), "expression is required"),
        ("2*m", (), "expression is '2\\*m': .*'m'"),
        ("1+", (), "expression is '1\\+'"),
        ("m", ("m",), "0 parameters and 1 variable;"),
    ],
)
def test_expressions_that_are_none(expression, variables, said, tmp_path):
    changed = study(tmp_path, "pendulum-50")
    goal = osimlite.MocoExpressionBasedParameterGoal(
        name="e", expression=expression, variables=variables
    )
    changed.problem.phases.goals = [goal]
    with pytest.raises(osimlite.OsimliteError, match=said):
        build_problem(changed)


ONE = osimlite.MocoContactImpulseTrackingGoalGroup(external_force_name="foot")


@pytest.mark.parametrize(
    ("kind", "given", "said"),
    [
        (
            osimlite.MocoJointReactionGoal,
            {"joint_path": "/jointset/j2"},
            "no joint '/jointset/j2'; did you mean '/joint",
        ),
        (
            osimlite.MocoJointReactionGoal,
            {"joint_path": "/jointset/j1", "expressed_in_frame_path": "/bodyset/b2"},
            "no frame '/bodyset/b2'",
        ),
        (osimlite.MocoGeneralizedForceTrackingGoal, {}, "a filepath is required"),
        (
            osimlite.MocoGeneralizedForceTrackingGoal,
            {"force_paths": ["/tau2"]},
            "no force '/tau2'; did you mean '/tau",
        ),
        (
            osimlite.MocoGeneralizedForceTrackingGoal,
            {"force_paths": ["/tau0", "/tau."]},
            "force_paths matches '/tau0' twice",
        ),
        (
            osimlite.MocoGeneralizedForceTrackingGoal,
            {"force_paths": ["/tau("]},
            "'/tau\\(' is not a valid pattern",
        ),
        (osimlite.MocoContactImpulseTrackingGoal, {}, "impulse_axis is -1; expected 0, 1 or 2"),
        (osimlite.MocoContactImpulseTrackingGoal, {"impulse_axis": 1}, "it has 0 contact_groups"),
        (
            osimlite.MocoContactImpulseTrackingGoal,
            {"impulse_axis": 1, "contact_groups": [ONE]},
            "external_loads or external_loads_file is required",
        ),
    ],
)
def test_loads_that_are_none(kind, given, said, tmp_path):
    changed = study(tmp_path, "pendulum-50")
    changed.problem.phases.goals = [kind(name="load", **given)]
    with pytest.raises(osimlite.OsimliteError, match=said):
        build_problem(changed)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({}, "output_path is required"),
        (
            {"output_path": "/bodyset/b2|position"},
            "no component '/bodyset/b2'; did you mean '/bodyset/b",
        ),
        (
            {"output_path": "/bodyset/b1|rotation"},
            "the output 'rotation' of /bodyset/b1 is not supported",
        ),
        (
            {"output_path": "/bodyset/b1|position", "output_index": 3},
            "output_index is 3, but the output has no component",
        ),
        (
            {"output_path": "/jointset/j0/q0|value", "output_index": 0},
            "output_index is 0, but the output has no component",
        ),
        ({"output_path": "/bodyset/b1|position", "exponent": 0}, "exponent is 0"),
        ({"output_path": "/bodyset/b1|position", "operation": "addition"}, "require each other"),
        (
            {
                "output_path": "/|com_position",
                "second_output_path": "/tau0|actuation",
                "operation": "addition",
            },
            "have different types",
        ),
    ],
)
def test_outputs_that_are_none(given, said, tmp_path):
    changed = study(tmp_path, "pendulum-50")
    changed.problem.phases.goals = [osimlite.MocoOutputGoal(name="output", **given)]
    with pytest.raises(osimlite.OsimliteError, match=said):
        build_problem(changed)


def test_what_is_not_solved_is_refused_by_name_and_place(tmp_path):
    path = study_file(tmp_path, "pendulum-50")
    text = path.read_text()
    factor = '<scale_factors><MocoScaleFactor name="factor"/></scale_factors>\n'
    path.write_text(re.sub(r"(<MocoFinalTimeGoal .*?>\n)", rf"\1{factor}", text))
    line = next(
        k for k, words in enumerate(path.read_text().splitlines(), 1) if "<MocoScaleFactor" in words
    )
    with pytest.raises(
        osimlite.OsimliteError, match="MocoScaleFactor 'factor': a file does not store which column"
    ) as raised:
        solve(path)
    assert (raised.value.file, raised.value.line) == (str(path), line)
    with pytest.raises(osimlite.OsimliteError, match="'factor': the goal tracks no column '/tau0'"):
        solve(path, scaled={"factor": "/tau0"})
    path.write_text(text.replace('name="/tau0"', 'name="/tau2"'))
    with pytest.raises(osimlite.OsimliteError, match="no control '/tau2'; did you mean '/tau"):
        solve(path)


def test_settings_without_effect_are_refused(tmp_path):
    with pytest.raises(osimlite.OsimliteError, match="'snopt' is not supported; use ipopt"):
        build_problem(study(tmp_path, "sliding-100", optim_solver="snopt"))
    with pytest.raises(osimlite.OsimliteError, match="requires a model with constraints"):
        build_problem(study(tmp_path, "sliding-100", minimize_lagrange_multipliers=True))


def test_what_the_solver_makes_a_cost(tmp_path):
    choices = {
        "minimize_implicit_multibody_accelerations": True,
        "implicit_multibody_accelerations_weight": 1e-3,
    }
    found = solve(study(tmp_path, "pendulum-50", multibody_dynamics_mode="implicit", **choices))
    accelerations = [
        found.trajectory.columns[name] for name in found.trajectory.names["derivatives"]
    ]
    squares, times = np.square(accelerations).sum(axis=0), found.trajectory.times
    # Simpson's rule over each interval and its midpoint.
    each = (
        (squares[:-2:2] + 4.0 * squares[1::2] + squares[2::2]) * (times[2::2] - times[:-2:2]) / 6.0
    )
    assert found.terms["accelerations"] == pytest.approx(1e-3 * each.sum(), rel=1e-9)
    held = solve(
        study(
            tmp_path,
            "squat-25",
            minimize_lagrange_multipliers=True,
            lagrange_multiplier_weight=1e-6,
        )
    )
    assert found.success and held.success and 0.0 < held.terms["multipliers"] < 1e-3


def test_evaluate_takes_files_and_objects(tmp_path):
    file = study_file(tmp_path, "sliding-100")
    theirs = moco_found(tmp_path, "sliding-100")
    result = osimlite.moco.evaluate(file, theirs)
    problem = build_problem(file)
    assert evaluate(problem, MocoTrajectory.read(theirs)) == result
    assert evaluate(Program(problem), theirs).terms == result.terms
    assert result.objective == sum(result.terms.values())
    with pytest.raises(osimlite.OsimliteError, match="has no column"):
        evaluate(file, MocoTrajectory(np.linspace(0.0, 1.0, 5), {}, {}))


def test_names_of_older_releases_warn():
    with pytest.warns(DeprecationWarning, match=r"use osimlite\.moco\.evaluate$"):
        assert osimlite.moco.evaluated is osimlite.moco.evaluate
    with pytest.raises(AttributeError):
        osimlite.moco.nothing  # noqa: B018
