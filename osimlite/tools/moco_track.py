"""OpenSim's MocoTrack: a motion that follows measured states."""

from __future__ import annotations

from osimlite.tools.job import Job
from osimlite.tools.moco_study import report, telling
from osimlite.tools.outcome import Outcome


def run(job: Job, outcome: Outcome) -> None:
    """Find the motion, and write it beside the setup."""
    # CasADi is loaded with it.
    from osimlite.optimal.program import Program
    from osimlite.optimal.solution import solve_program
    from osimlite.optimal.track import build_track_problem

    problem, guess = build_track_problem(job.setup, job.file)
    solution = solve_program(Program(problem), guess, telling(outcome), job.refine)
    name = job.setup.name or "MocoTrack"
    for goal, what in (("state_tracking", "states"), ("marker_tracking", "markers")):
        if goal in problem.tables:
            outcome.new_table(job.result(f"{name}_tracked_{what}.sto"), problem.tables[goal])
    outcome.new_table(job.result(f"{name}_solution.sto"), solution.trajectory.table())
    report(job, problem, solution, outcome)
