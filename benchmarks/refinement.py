"""Meshes that split where the error is large, beside equal intervals of the same error.

    python benchmarks/refinement.py [STUDY ...]

STUDY: sliding, pendulum, predicted (``osimlite build human-walks``), walking (needs opensim-core's
sources beside this repository, as tests/optimal/check_tracking.py). Each search has a process of
its own; seconds are of the processor.
"""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
MOCO = ROOT.parent / "shared/oracle/moco"
EXAMPLE = ROOT.parent / "pub-opensim-core/OpenSim/Examples/Moco/example2DWalking"
STUDIES = {
    "sliding": ((10, 20, 40, 80), 10, 1e-6),
    "pendulum": ((25, 50, 100, 200), 25, 1e-4),
    "predicted": ((50, 100, 200, 400), 16, 1e-2),
    "walking": ((25, 50, 100, 200), 10, 1e-2),
}
"""Numbers of equal intervals, of those that refinement begins with, and the error that is wanted."""
ONE = """
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
    def more(made):
        phase = made.problem.phases
        phase.goals[1].weight = 10.0
        phase.goals += [goal.copy_deep() for goal in study.problem.phases.goals[2:4]]
        phase.state_infos += [info.copy_deep() for info in study.problem.phases.state_infos]
        made.solver.optim_convergence_tolerance = made.solver.optim_constraint_tolerance = 1e-4
        made.solver.optim_max_iterations = 1000
    problem, guess = build_track_problem(tool, folder=Path(sys.argv[5]), more=more)
else:
    study.solver.num_mesh_intervals = intervals
    problem = build_problem(study, file.parent)
program = Program(problem)
before = time.process_time()
found = solve_program(program, guess, None, refine)
search = time.process_time() - before
if found.rounds:
    last = found.rounds[-1]
    error, many = last.error, "-".join(str(each.intervals) for each in found.rounds)
else:
    error, many = float(estimate_errors(program, program.layout.guess_from_trajectory(found.trajectory)).max()), str(intervals)
print(json.dumps([found.success, many, error, found.iterations, found.objective, search]))
"""


def main(names: list[str]) -> None:
    """Print a table in Markdown."""
    print("| study | | intervals | largest error | iterations | objective | search, s |")
    print("|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in names or STUDIES:
            meshes, first, wanted = STUDIES[name]
            file = _file(name, Path(folder))
            print(f"| {name} | error {wanted:g} | | | | | |")
            for hessian in ("exact", "limited-memory"):
                _row(f"refined, {hessian}", name, first, f"{wanted}:{hessian}", file)
            for count in meshes:
                if _row("equal", name, count, "", file) <= wanted:
                    break


def _row(title: str, name: str, intervals: int, refine: str, file: Path) -> float:
    """Solve one, and print it; the largest error."""
    command = [sys.executable, "-c", ONE, name, str(intervals), refine, str(file), str(EXAMPLE)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    success, many, error, iterations, objective, search = json.loads(done.stdout.splitlines()[-1])
    note = "" if success else " (not solved)"
    print(
        f"| | {title}{note} | {many} | {error:.2g} | {iterations} | {objective:.7g} | {search:.3g} |",
        flush=True,
    )
    return float(error)


def _file(name: str, folder: Path) -> Path:
    if name == "predicted":
        model = folder / "human-walks.osim"
        build = [sys.executable, "-m", "osimlite", "build", "human-walks", "-o", str(model)]
        subprocess.run(build, check=True, capture_output=True, cwd=ROOT)
        return model.with_suffix(".omoco")
    stem = {"sliding": "sliding-100", "pendulum": "pendulum-50", "walking": "track"}[name]
    file = folder / f"{name}.omoco"
    file.write_bytes(gzip.decompress((MOCO / f"{stem}.omoco.gz").read_bytes()))
    return file


if __name__ == "__main__":
    main(sys.argv[1:])
