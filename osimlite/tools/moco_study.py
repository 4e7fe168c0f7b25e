"""OpenSim's MocoStudy: an optimal control problem, solved."""

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


def run(job: Job, outcome: Outcome) -> None:
    """Solve the problem, and write the solution, whether ``write_solution`` asks for it or not.

    A motion that goes on as a MocoPeriodicityGoal says is written with what follows it, too, as a
    stride.
    """
    # CasADi is loaded with it.
    from osimlite.optimal.problem import Problem
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program

    study = job.setup
    tell = telling(outcome) if study.solver.verbosity > 0 else None
    problem = Problem(study, job.file)
    solution = solve_program(Program(problem), None, tell, job.refine)
    name = study.name or "MocoStudy"
    outcome.new_table(job.in_results(f"{name}_solution.sto"), solution.trajectory.table())
    if solution.stride is not None:
        outcome.new_table(job.in_results(f"{name}_stride.sto"), solution.stride.table())
    report(job, problem, solution, outcome)


def telling(outcome: Outcome) -> Callable[[Progress], None] | None:
    """What tells of each iteration, if somebody listens."""
    says = outcome.progress
    return None if says is None else (lambda progress: says(str(progress)))


def report(job: Job, problem: Problem, solution: MocoSolution, outcome: Outcome) -> None:
    """Say what came out of a search, and what a report shows of it."""
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
    outcome.evidence = _evidence(job, problem, solution)
    if job.simulates:
        from osimlite.optimal.simulated import check_by_simulation

        try:
            outcome.tell("simulated", str(check_by_simulation(problem, solution.trajectory)))
        except OsimliteError as error:
            outcome.tell("not simulated", error.message)


def _evidence(job: Job, problem: Problem, solution: MocoSolution) -> Evidence:
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
