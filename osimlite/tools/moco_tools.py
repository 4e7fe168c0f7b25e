"""OpenSim's MocoStudy, MocoTrack and MocoInverse: optimal control problems."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from osimlite.base.text import format_count
from osimlite.errors import OsimliteError
from osimlite.mechanics.multibody import build_mechanism
from osimlite.tools.evidence import Evidence
from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome

if TYPE_CHECKING:
    from osimlite.optimal.ipopt import Progress
    from osimlite.optimal.problem import Problem
    from osimlite.optimal.solution import MocoSolution


def run_moco_study(job: Job, outcome: Outcome) -> None:
    """Solve the problem; write the solution, regardless of ``write_solution``.

    If a MocoPeriodicityGoal makes the motion periodic, its continuation is written as well, as a
    stride.

    Args:
        job: setup, a MocoStudy.
        outcome: outcome to which the results are added.
    """
    # This imports CasADi, which is slow.
    from osimlite.optimal.problem import Problem
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program

    study = job.setup
    progress_callback = make_progress_callback(outcome) if study.solver.verbosity > 0 else None
    problem = Problem(study, job.file)
    solution = solve_program(Program(problem), None, progress_callback, job.refine)
    name = study.name or "MocoStudy"
    outcome.add_typed_table(
        job.get_results_path(f"{name}_solution.sto"), solution.trajectory.table()
    )
    if solution.stride is not None:
        outcome.add_typed_table(job.get_results_path(f"{name}_stride.sto"), solution.stride.table())
    report_solution(job, problem, solution, outcome)


def make_progress_callback(outcome: Outcome) -> Callable[[Progress], None] | None:
    """Return a function that reports each iteration; None if nothing listens."""
    report = outcome.progress
    return None if report is None else (lambda progress: report(str(progress)))


def report_solution(job: Job, problem: Problem, solution: MocoSolution, outcome: Outcome) -> None:
    """Add the results of a solver to an outcome, with the motion for a report.

    Args:
        job: setup of the tool, with the paths of its files.
        problem: optimal control problem of the setup.
        solution: solution of the problem.
        outcome: outcome to which the results are added.
    """
    outcome.done = solution.success
    outcome.title = job.setup.name
    outcome.summary |= {
        "objective": solution.objective,
        "terms": solution.terms,
        "iterations": solution.iterations,
        "status": solution.status,
        "duration": solution.duration,
        "rounds": [refinement._asdict() for refinement in solution.rounds],
    }
    outcome.add_message(
        "status",
        f"{solution.status} after {format_count(solution.iterations, 'iteration')} in {solution.duration:.3g} s",
    )
    for refinement in solution.rounds:
        outcome.add_message("mesh", str(refinement))
    for goal, value in solution.terms.items():
        outcome.add_message(goal, f"{value:.8g}")
    outcome.add_message("objective", f"{solution.objective:.8g}")
    # Of a solution, the largest violation shows its accuracy; of a failure, several help to find
    # the cause.
    for violation in solution.violations[: 1 if solution.success else 5]:
        outcome.add_message(
            "largest violation" if solution.success else "not fulfilled", str(violation)
        )
    outcome.evidence = _collect_evidence(job, problem, solution)
    if job.simulates:
        from osimlite.optimal.simulation_check import check_by_simulation

        try:
            outcome.add_message("simulated", str(check_by_simulation(problem, solution.trajectory)))
        except OsimliteError as error:
            outcome.add_message("not simulated", error.message)


def _collect_evidence(job: Job, problem: Problem, solution: MocoSolution) -> Evidence:
    """Return the motion with its controls; of a periodic motion the whole stride."""
    trajectory = solution.stride or solution.trajectory
    mechanism = build_mechanism(problem.model)
    columns = trajectory.columns
    values, speeds = (
        np.column_stack([columns[f"{info.path}/{quantity}"] for info in mechanism.coordinates])
        for quantity in ("value", "speed")
    )
    model_name = problem.phase.model.filepath.strip()
    return Evidence.from_values(
        problem.model,
        problem.locate_file(model_name) if model_name else job.file,
        mechanism,
        trajectory.times,
        values,
        speeds=speeds,
        states={
            name: columns[name]
            for name in trajectory.names["states"]
            if name.endswith("/activation")
        },
        controls=trajectory.table("controls"),
    )


def run_moco_track(job: Job, outcome: Outcome) -> None:
    """Track measured states; write the solution, and the tracked tables.

    Args:
        job: setup, a MocoTrack.
        outcome: outcome to which the results are added.
    """
    # This imports CasADi, which is slow.
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program
    from osimlite.optimal.track import build_track_problem

    problem, guess = build_track_problem(job.setup, job.file)
    solution = solve_program(Program(problem), guess, make_progress_callback(outcome), job.refine)
    name = job.setup.name or "MocoTrack"
    for goal, table_kind in (("state_tracking", "states"), ("marker_tracking", "markers")):
        if goal in problem.tables:
            outcome.add_typed_table(
                job.get_output_path(f"{name}_tracked_{table_kind}.sto"), problem.tables[goal]
            )
    outcome.add_typed_table(
        job.get_output_path(f"{name}_solution.sto"), solution.trajectory.table()
    )
    report_solution(job, problem, solution, outcome)


def run_moco_inverse(job: Job, outcome: Outcome) -> None:
    """Find muscle excitations for a prescribed motion; write the solution.

    Args:
        job: setup, a MocoInverse.
        outcome: outcome to which the results are added.
    """
    # This imports CasADi, which is slow.
    from osimlite.optimal.inverse import build_inverse_problem, solve_inverse_problem

    if job.setup.output_paths:
        raise job.create_unsupported_error(
            "osimlite does not compute outputs of the solution; leave output_paths empty"
        )
    problem = build_inverse_problem(job.setup, job.file)
    solution = solve_inverse_problem(problem, make_progress_callback(outcome), job.refine)
    outcome.add_typed_table(
        job.get_output_path(f"{job.setup.name or 'MocoInverse'}_solution.sto"),
        solution.trajectory.table(),
    )
    report_solution(job, problem, solution, outcome)
