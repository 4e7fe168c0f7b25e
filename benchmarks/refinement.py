"""Mesh refinement in optimal control, compared with equal intervals of the same error.

    python benchmarks/refinement.py [STUDY ...]

STUDY is sliding, pendulum, predicted (``osimlite build human-walks``) or walking, which needs the
sources of opensim-core next to this repository, as tests/optimal/check_tracking.py does. Refinement
splits intervals where the error is large. Each study is solved with refinement, with exact and with
limited-memory Hessians, and then with more and more equal intervals until their error is as small.

The table in Markdown has the numbers of intervals (of each round of refinement), the largest error,
the iterations on all meshes, the objective, and the processor time of the search. Each search
has a process of its own.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from _corpus import MOCO, ROOT, unpack_file
from _pair import run_script

WALKING_EXAMPLE = ROOT.parent / "pub-opensim-core/OpenSim/Examples/Moco/example2DWalking"


class Study(NamedTuple):
    """Meshes with which a study is solved."""

    equal: tuple[int, ...]
    """Numbers of equal intervals, in increasing order."""
    initial: int
    """Number of intervals with which refinement begins."""
    tolerance: float
    """Largest error that is allowed."""


STUDIES = {
    "sliding": Study((10, 20, 40, 80), 10, 1e-6),
    "pendulum": Study((25, 50, 100, 200), 25, 1e-4),
    "predicted": Study((50, 100, 200, 400), 16, 1e-2),
    "walking": Study((25, 50, 100, 200), 10, 1e-2),
}

SOLVE_SCRIPT = """
import json, sys, time
from pathlib import Path
import osimlite
from osimlite.optimal.program import Program
from osimlite.optimal.refinement import estimate_errors
from osimlite.optimal.solution import build_problem, solve_program
name, intervals, refine = sys.argv[1], int(sys.argv[2]), sys.argv[3] or None
file = Path(sys.argv[4])
study, guess = osimlite.read_document(file), None
if name == "walking":
    from osimlite.moco import build_track_problem
    lowpass = osimlite.TabOpLowPassFilter(cutoff_frequency=6.0)
    tool = osimlite.MocoTrack(
        name="gait", model=osimlite.ModelProcessor(filepath="2D_gait.osim"),
        states_reference=osimlite.TableProcessor(filepath="referenceCoordinates.sto", operators=[lowpass]),
        allow_unused_references=True, track_reference_position_derivatives=True, apply_tracked_states_to_guess=True,
        initial_time=0.0, final_time=0.470089, mesh_interval=0.470089 / intervals,
    )
    def change_study(tracking):
        phase = tracking.problem.phases
        phase.goals[1].weight = 10.0
        phase.goals += [goal.copy_deep() for goal in study.problem.phases.goals[2:4]]
        phase.state_infos += [info.copy_deep() for info in study.problem.phases.state_infos]
        tracking.solver.optim_convergence_tolerance = tracking.solver.optim_constraint_tolerance = 1e-4
        tracking.solver.optim_max_iterations = 1000
    problem, guess = build_track_problem(tool, folder=Path(sys.argv[5]), more=change_study)
else:
    study.solver.num_mesh_intervals = intervals
    problem = build_problem(study, file.parent)
program = Program(problem)
before = time.process_time()
solution = solve_program(program, guess, None, refine)
seconds = time.process_time() - before
if solution.rounds:
    error = solution.rounds[-1].error
    mesh = "-".join(str(each.intervals) for each in solution.rounds)
else:
    point = program.layout.guess_from_trajectory(solution.trajectory)
    error = float(estimate_errors(program, point).max())
    mesh = str(intervals)
print(json.dumps([solution.success, mesh, error, solution.iterations, solution.objective, seconds]))
"""
"""Script that solves one study. Arguments: name, intervals, refinement, study file, folder of the walking example."""


def main(names: list[str]) -> None:
    """Print a table in Markdown."""
    print(
        "| study | mesh | intervals | largest error | iterations | objective | search, processor s |"
    )
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in names or STUDIES:
            study = STUDIES[name]
            file = write_study(name, Path(folder))
            print(f"| {name} | error {study.tolerance:g} | | | | | |")
            # Approximate Hessians are cheaper, but need more iterations.
            for hessian in ("exact", "limited-memory"):
                refine = f"{study.tolerance}:{hessian}"
                solve_and_print(f"refined, {hessian}", name, study.initial, refine, file)
            for count in study.equal:
                # Finer meshes than the first one with a small enough error only take longer.
                if solve_and_print("equal", name, count, "", file) <= study.tolerance:
                    break


def solve_and_print(title: str, name: str, intervals: int, refine: str, file: Path) -> float:
    """Solve a study, print its row, and return its largest error.

    Args:
        title: name of the mesh.
        name: name of the study.
        intervals: number of intervals, at first if the mesh is refined.
        refine: error and Hessian approximation of the refinement; empty for equal intervals.
        file: file of the study.
    """
    arguments = [name, str(intervals), refine, str(file), str(WALKING_EXAMPLE)]
    line = run_script(SOLVE_SCRIPT, *arguments)
    success, mesh, error, iterations, objective, seconds = json.loads(line)
    note = "" if success else " (not solved)"
    print(
        f"| | {title}{note} | {mesh} | {error:.2g} | {iterations} | {objective:.7g} | {seconds:.3g} |",
        flush=True,
    )
    return float(error)


def write_study(name: str, folder: Path) -> Path:
    """Write the file of a study into a folder, and return it."""
    if name == "predicted":
        model = folder / "human-walks.osim"
        build = [sys.executable, "-m", "osimlite", "build", "human-walks", "-o", str(model)]
        subprocess.run(build, check=True, capture_output=True, cwd=ROOT)
        return model.with_suffix(".omoco")
    stem = {"sliding": "sliding-100", "pendulum": "pendulum-50", "walking": "track"}[name]
    return unpack_file(MOCO / f"{stem}.omoco.gz", folder / f"{name}.omoco")


if __name__ == "__main__":
    main(sys.argv[1:])
