"""OpenSim's MocoInverse: what muscles do in a motion that is given exactly."""

from __future__ import annotations

from osimlite.tools.job import Job
from osimlite.tools.moco_study import report, telling
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Find what the muscles do, and write it beside the setup."""
    # CasADi is loaded with it.
    from osimlite.optimal.inverse import build_inverse_problem, solve_inverse_problem

    if job.setup.output_paths:
        raise job.unable(
            "output_paths is given, and outputs of the solution are not computed here; leave it empty"
        )
    problem = build_inverse_problem(job.setup, job.file)
    solution = solve_inverse_problem(problem, telling(outcome), job.refine)
    outcome.new_table(
        job.result(f"{job.setup.name or 'MocoInverse'}_solution.sto"), solution.trajectory.table()
    )
    report(job, problem, solution, outcome)
