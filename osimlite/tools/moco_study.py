"""OpenSim's MocoStudy: an optimal control problem, solved."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from osimlite.tools.job import Job
from osimlite.tools.outcome import Outcome

if TYPE_CHECKING:
    from osimlite.optimal.ipopt import Progress
    from osimlite.optimal.solution import MocoSolution


def run(job: Job, outcome: Outcome) -> None:
    """Solve the problem, and write the solution, whether ``write_solution`` asks for it or not.

    A motion that goes on as a MocoPeriodicityGoal says is written with what follows it, too, as a stride.
    """
    # CasADi is loaded with it.
    from osimlite.optimal.problem import Problem
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solved

    study = job.setup
    tell = telling(outcome) if study.solver.verbosity > 0 else None
    solution = solved(Program(Problem(study, job.file)), None, tell, job.refine)
    name = study.name or "MocoStudy"
    outcome.new_table(job.in_results(f"{name}_solution.sto"), solution.trajectory.table())
    if solution.stride is not None:
        outcome.new_table(job.in_results(f"{name}_stride.sto"), solution.stride.table())
    report(solution, outcome)


def telling(outcome: Outcome) -> Callable[[Progress], None] | None:
    """What tells of each iteration, if somebody listens."""
    says = outcome.progress
    return None if says is None else (lambda progress: says(str(progress)))


def report(solution: MocoSolution, outcome: Outcome) -> None:
    """Say what came out of a search."""
    outcome.done = solution.success
    outcome.summary |= {
        "objective": solution.objective,
        "terms": solution.terms,
        "iterations": solution.iterations,
        "status": solution.status,
        "duration": solution.duration,
        "rounds": [each._asdict() for each in solution.rounds],
    }
    outcome.tell("status", f"{solution.status} after {solution.iterations} iterations in {solution.duration:.3g} s")
    for each in solution.rounds:
        outcome.tell("mesh", str(each))
    for goal, value in solution.terms.items():
        outcome.tell(goal, f"{value:.8g}")
    outcome.tell("objective", f"{solution.objective:.8g}")
    for violation in solution.violations[: 1 if solution.success else 5]:
        outcome.tell("largest violation" if solution.success else "not fulfilled", str(violation))
