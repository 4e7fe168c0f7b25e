"""Tests of mesh refinement: intervals with large errors are split."""

from __future__ import annotations

import numpy as np
import pytest

import osimlite
from osimlite.cli import main
from osimlite.moco import Refinement, build_problem, solve
from osimlite.optimal.program import Program
from osimlite.optimal.refinement import estimate_errors, interpolate_solution
from tests.optimal.studies import study, study_file

integrate = pytest.importorskip("scipy.integrate")
ORDERS = {
    "trapezoidal": 3,
    "hermite-simpson": 4,
    "legendre-gauss-3": 4,
    "legendre-gauss-radau-2": 3,
}
"""Order of the error of an interval: the integral of a polynomial through two, three, three and two rates."""


def found_on(folder, intervals, **choices):
    given = study(
        folder,
        "pendulum-50",
        num_mesh_intervals=intervals,
        optim_convergence_tolerance=1e-8,
        **choices,
    )
    given.solver.optim_constraint_tolerance, given.solver.optim_hessian_approximation = (
        1e-10,
        "exact",
    )
    program, found = Program(build_problem(given)), solve(given)
    assert found.success
    return program, found, program.layout.guess_from_trajectory(found.trajectory)


@pytest.mark.parametrize("scheme", ORDERS)
def test_errors_fall_with_the_order_of_the_scheme(scheme, tmp_path):
    coarse, fine = (found_on(tmp_path, count, transcription_scheme=scheme) for count in (60, 120))
    means = [estimate_errors(program, w).mean() for program, _, w in (coarse, fine)]
    assert np.log2(means[0] / means[1]) == pytest.approx(ORDERS[scheme], abs=0.25)


def test_errors_bound_those_of_an_integration(tmp_path):
    """Integrate from the start of each interval with the same controls."""
    program, found, w = found_on(tmp_path, 20)
    functions, times = program.problem.functions, found.states.times
    x = np.column_stack([found.states[name] for name in functions.states])
    u = np.column_stack([found.controls[name] for name in functions.controls])
    estimated, sizes = estimate_errors(program, w), 1.0 + np.abs(x).max(axis=0)
    for k, error in enumerate(estimated):
        first, last = 2 * k, 2 * k + 2

        def rate(t, y, first=first, last=last):
            part = (t - times[first]) / (times[last] - times[first])
            return np.array(
                functions.dynamics(t, y, u[first] + part * (u[last] - u[first]), [])
            ).ravel()

        end = integrate.solve_ivp(rate, times[[first, last]], x[first], rtol=1e-11, atol=1e-12).y[
            :, -1
        ]
        # At the end of an interval, much of the error within it has cancelled.
        assert (np.abs(end - x[last]) / sizes).max() < error


def test_the_same_mesh_takes_over_what_was_found(tmp_path):
    program, _, w = found_on(tmp_path, 20)
    np.testing.assert_allclose(interpolate_solution(program, w, program), w, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("hessian", ["exact", "limited-memory"])
def test_intervals_split_where_it_is_needed(hessian, tmp_path):
    told = []
    given = study(tmp_path, "pendulum-50", num_mesh_intervals=15)
    found = solve(given, refine=Refinement(1e-5, hessian), tell=told.append)
    assert found.success
    assert [each.intervals for each in found.rounds] == sorted(
        each.intervals for each in found.rounds
    )
    assert (
        found.rounds[0].intervals == 15
        and found.rounds[0].error > 1e-4
        and found.rounds[-1].error <= 1e-5
    )
    assert (
        found.iterations
        == sum(each.iterations for each in found.rounds)
        == len(told) - len(found.rounds)
    )
    lengths = np.diff(found.states.times[::2])
    assert len(lengths) == found.rounds[-1].intervals and lengths.max() / lengths.min() > 1.9
    finest = solve(study(tmp_path, "pendulum-50", num_mesh_intervals=200))
    assert found.objective == pytest.approx(finest.objective, rel=2e-4)
    assert found.rounds[-1].iterations < found.rounds[0].iterations
    # A new solution starts from this one, on its mesh.
    given.solver.mesh = tuple((found.states.times[::2] / found.states.times[-1]).tolist())
    program = Program(build_problem(given))
    assert estimate_errors(
        program, program.layout.guess_from_trajectory(found.trajectory)
    ).max() == pytest.approx(found.rounds[-1].error)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("fine", "a number such as 1e-3, not 'fine'"),
        ("0", "must be positive, not 0"),
        ("1e-3:exakt", "'exakt'; did you mean 'exact'"),
    ],
)
def test_words_that_are_no_refinement(words, said):
    with pytest.raises(osimlite.OsimliteError, match=said):
        Refinement.parse(words)


def test_what_has_no_error_here_is_refused(tmp_path):
    given = study(tmp_path, "pendulum-50", multibody_dynamics_mode="implicit")
    with pytest.raises(osimlite.OsimliteError, match="requires multibody_dynamics_mode explicit"):
        solve(given, refine=1e-3)
    hanging = study(tmp_path, "hanging-25")
    hanging.problem.phases.goals[1].enabled = False
    with pytest.raises(osimlite.OsimliteError, match="does not support implicit tendons"):
        solve(hanging, refine=1e-3)
    moved = study(tmp_path, "squat-25", kinematic_constraint_method="Bordalba2023")
    with pytest.raises(osimlite.OsimliteError, match="kinematic_constraint_method Posa2016"):
        solve(moved, refine=1e-3)


def test_the_command(tmp_path, capfd):
    file = study_file(tmp_path, "pendulum-50")
    with pytest.raises(SystemExit) as done:
        main(["run", str(file), "--refine", "1e-6:limited-memory", "-o", str(tmp_path / "out")])
    assert not done.value.code
    out = " ".join(capfd.readouterr().out.split())
    assert "mesh 50 intervals, error" in out
    for arguments, said in (
        ([str(file), str(study_file(tmp_path, "sliding-100"))], "--refine takes one study"),
        ([str(file), "--json"], "--refine takes one study"),
    ):
        with pytest.raises(SystemExit) as done:
            main(["run", *arguments, "--refine", "1e-3"])
        assert done.value.code == 2
        assert said in " ".join(capfd.readouterr().err.split())


def test_other_tools_have_no_mesh(tmp_path):
    osimlite.write(osimlite.InverseDynamicsTool(name="id"), tmp_path / "id.xml")
    with pytest.raises(osimlite.OsimliteError, match="InverseDynamicsTool has no mesh to refine"):
        osimlite.run(tmp_path / "id.xml", refine=1e-3)
