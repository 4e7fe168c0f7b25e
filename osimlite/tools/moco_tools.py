"""OpenSim's MocoStudy, MocoTrack and MocoInverse: optimal control problems, solved and reported."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

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
    """Solve the problem, and write the solution, whether ``write_solution`` asks for it or not.

    A motion that goes on as a MocoPeriodicityGoal says is written with what follows it, too, as a
    stride.
    """
    # CasADi is loaded with it.
    from osimlite.optimal.problem import Problem
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program

    study = job.setup
    tell = make_progress_callback(outcome) if study.solver.verbosity > 0 else None
    problem = Problem(study, job.file)
    solution = solve_program(Program(problem), None, tell, job.refine)
    name = study.name or "MocoStudy"
    outcome.new_table(job.in_results(f"{name}_solution.sto"), solution.trajectory.table())
    if solution.stride is not None:
        outcome.new_table(job.in_results(f"{name}_stride.sto"), solution.stride.table())
    report_solution(job, problem, solution, outcome)


def make_progress_callback(outcome: Outcome) -> Callable[[Progress], None] | None:
    """What tells of each iteration, if somebody listens."""
    says = outcome.progress
    return None if says is None else (lambda progress: says(str(progress)))


def report_solution(job: Job, problem: Problem, solution: MocoSolution, outcome: Outcome) -> None:
    """Say what came out of a search, and what a report_solution shows of it."""
    outcome.done, outcome.title = solution.success, job.setup.name
    outcome.summary |= {
        "objective": solution.objective,
        "terms": solution.terms,
        "iterations": solution.iterations,
        "status": solution.status,
        "duration": solution.duration,
        "rounds": [each._asdict() for each in solution.rounds],
    }
    outcome.tell(
        "status",
        f"{solution.status} after {solution.iterations} iterations in {solution.duration:.3g} s",
    )
    for each in solution.rounds:
        outcome.tell("mesh", str(each))
    for goal, value in solution.terms.items():
        outcome.tell(goal, f"{value:.8g}")
    outcome.tell("objective", f"{solution.objective:.8g}")
    for violation in solution.violations[: 1 if solution.success else 5]:
        outcome.tell("largest violation" if solution.success else "not fulfilled", str(violation))
    outcome.evidence = _collect_evidence(job, problem, solution)
    if job.simulates:
        from osimlite.optimal.simulation_check import check_by_simulation

        try:
            outcome.tell("simulated", str(check_by_simulation(problem, solution.trajectory)))
        except OsimliteError as error:
            outcome.tell("not simulated", error.message)


def _collect_evidence(job: Job, problem: Problem, solution: MocoSolution) -> Evidence:
    """The motion with its controls, and what follows it if that is known."""
    trajectory = solution.stride or solution.trajectory
    mechanism, columns = build_mechanism(problem.model), trajectory.columns
    values, speeds = (
        np.column_stack([columns[f"{info.path}/{what}"] for info in mechanism.coordinates])
        for what in ("value", "speed")
    )
    named = problem.phase.model.filepath.strip()
    return Evidence.of(
        problem.model,
        problem.locate_file(named) if named else job.file,
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
    """Find the motion, and write it beside the setup."""
    # CasADi is loaded with it.
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program
    from osimlite.optimal.track import build_track_problem

    problem, guess = build_track_problem(job.setup, job.file)
    solution = solve_program(Program(problem), guess, make_progress_callback(outcome), job.refine)
    name = job.setup.name or "MocoTrack"
    for goal, what in (("state_tracking", "states"), ("marker_tracking", "markers")):
        if goal in problem.tables:
            outcome.new_table(job.result(f"{name}_tracked_{what}.sto"), problem.tables[goal])
    outcome.new_table(job.result(f"{name}_solution.sto"), solution.trajectory.table())
    report_solution(job, problem, solution, outcome)


def run_moco_inverse(job: Job, outcome: Outcome) -> None:
    """Find what the muscles do, and write it beside the setup."""
    # CasADi is loaded with it.
    from osimlite.optimal.inverse import build_inverse_problem, solve_inverse_problem

    if job.setup.output_paths:
        raise job.unable(
            "output_paths is given, and outputs of the solution are not computed here; leave it empty"
        )
    problem = build_inverse_problem(job.setup, job.file)
    solution = solve_inverse_problem(problem, make_progress_callback(outcome), job.refine)
    outcome.new_table(
        job.result(f"{job.setup.name or 'MocoInverse'}_solution.sto"), solution.trajectory.table()
    )
    report_solution(job, problem, solution, outcome)
