"""Moco studies solved by osimlite and by Moco 4.6: iterations, objective, constraint violation, time.

    python benchmarks/optimal.py [--core FOLDER] [--rounds N] [STUDY ...]

FOLDER contains the sources of opensim-core, or is its git directory (``git clone --bare``); studies
of walking and gait need it. Each study is solved in turn by Moco, by osimlite with the Hessian
approximation that Moco uses ("as Moco"), and by osimlite with exact Hessians. Studies for which
Moco needs most of an hour are solved by osimlite alone, and only if they are named.

All times are processor times, medians of the rounds. *Set-up and solve* begins with reading the
files, in a process that has loaded its libraries and solved a small study before. *Process* is a
complete process that solves one study. After each time, "speed-up" is Moco's time divided by it.
Moco uses one thread (``OPENSIM_MOCO_PARALLEL=0``), as osimlite does; more threads would increase
its processor time.

*Violation* is the largest constraint violation that Moco computes for each solution file, by taking
it as the guess and stopping before the first step.

``benchmarks/refinement.py`` shows what is saved by refining meshes where errors are large.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import NamedTuple

import osimlite
from _moco_studies import CORE, LONG, STUDIES, get_saved_study
from osimlite.base.records import replace
from osimlite.moco import MocoTrajectory

OSIMLITE_SCRIPT = """
import json, os, sys, time
import osimlite, osimlite.optimal.solution
from osimlite import moco
hessian, warm = sys.argv[1:]
if warm:
    moco.solve(warm)
before = time.process_time()
def change_study(study):
    if hessian:
        study.solver.optim_hessian_approximation = hessian
    elif os.path.exists("inverse.xml"):
        study.solver.optim_hessian_approximation = "limited-memory"
    if os.path.exists("more.omoco"):
        added = osimlite.read_document("more.omoco")
        study.problem.phases.goals += [goal.copy_deep() for goal in added.problem.phases.goals]
        study.problem.phases.state_infos += [info.copy_deep() for info in added.problem.phases.state_infos]
        for name in ("optim_convergence_tolerance", "optim_constraint_tolerance", "optim_max_iterations"):
            setattr(study.solver, name, getattr(added.solver, name))
if os.path.exists("study.omoco"):
    study = osimlite.read_document("study.omoco")
    change_study(study)
    solution = moco.solve(study)
elif os.path.exists("track.xml"):
    solution = moco.solve_track(osimlite.read_document("track.xml"), more=change_study)
else:
    solution = moco.solve_inverse(osimlite.read_document("inverse.xml"), more=change_study)
seconds = time.process_time() - before
solution.write("ours.sto")
print(json.dumps([solution.success, solution.iterations, solution.objective, seconds, time.process_time()]))
"""
"""Script that solves the study of its folder. Arguments: Hessian approximation, study for the warm-up."""

OPENSIM_SCRIPT = """
import json, os, sys, time
import opensim as osim
osim.Logger.setLevelString("Off")
guess, warm = sys.argv[1:]
if warm:
    osim.MocoStudy(warm).solve()
before = time.process_time()
if os.path.exists("study.omoco"):
    study = osim.MocoStudy("study.omoco")
else:
    file, kind = ("track.xml", osim.MocoTrack) if os.path.exists("track.xml") else ("inverse.xml", osim.MocoInverse)
    tool = kind.safeDownCast(osim.OpenSimObject.makeObjectFromFile(file))
    study = tool.initialize()
solver = osim.MocoCasADiSolver.safeDownCast(study.updSolver())
if os.path.exists("more.omoco"):
    added = osim.MocoStudy("more.omoco")
    phase = added.updProblem().updPhase(0)
    names = json.load(open("more.json"))
    for name in names["goals"]:
        study.updProblem().addGoal(phase.updGoal(name).clone())
    for name, bounds in names["states"].items():
        study.updProblem().setStateInfo(name, bounds)
    settings = osim.MocoCasADiSolver.safeDownCast(added.updSolver())
    for name in ("optim_convergence_tolerance", "optim_constraint_tolerance", "optim_max_iterations"):
        getattr(solver, f"set_{name}")(getattr(settings, f"get_{name}")())
if guess:
    # This file keeps Ipopt from moving the guess away from its bounds. Simbody's Ipopt, which
    # solves for assemblies before, reads it too.
    with open("ipopt.opt", "w") as stream:
        stream.write("bound_push 1e-16\\nbound_frac 1e-16\\nbound_relax_factor 0\\n")
    solver.setGuessFile(guess)
    solver.set_optim_max_iterations(0)
    osim.Logger.setLevelString("Info")
else:
    solver.set_verbosity(0)
solution = study.solve()
seconds = time.process_time() - before
success = solution.success()
if solution.isSealed():
    solution.unseal()
if not guess:
    solution.write("theirs.sto")
print()
print(json.dumps([success, solution.getNumIterations(), solution.getObjective(), seconds, time.process_time()]))
"""
"""The same by Moco. Arguments: file of the guess to examine instead of solving, study for the warm-up."""

IMPORT_SCRIPT = "import json, time, opensim\nprint(json.dumps([time.process_time()]))"
"""Script that prints the processor time (s) in which OpenSim's libraries are loaded."""


class Solve(NamedTuple):
    """Numbers that a script prints at its end."""

    success: float
    iterations: float
    objective: float
    seconds: float
    """Processor time of set-up and solve (s)."""
    process_seconds: float
    """Processor time of the process so far (s)."""


class Solver(NamedTuple):
    """One way of solving studies."""

    script: str
    hessian: str
    """Hessian approximation; empty for that of the study. Moco has no such argument."""

    @property
    def is_moco(self) -> bool:
        """True for Moco, which has a script of its own."""
        return self.script == OPENSIM_SCRIPT


@dataclass
class Record:
    """Results of one solver for one study."""

    solve: Solve | None = None
    """Last solve."""
    violation: str = ""
    """Largest constraint violation of the last solution."""
    solve_times: list[float] = field(default_factory=list)
    """Processor times of set-up and solve, one for each round (s)."""
    process_times: list[float] = field(default_factory=list)
    """Processor times of a complete process, one for each round (s)."""


SOLVERS = {
    "Moco": Solver(OPENSIM_SCRIPT, ""),
    "as Moco": Solver(OSIMLITE_SCRIPT, ""),
    "exact": Solver(OSIMLITE_SCRIPT, "exact"),
}
"""Solvers by their title in the table."""


def main(names: list[str], core: Path, rounds: int) -> None:
    """Solve studies and print a table in Markdown.

    Args:
        names: names of the studies; all except the long ones if empty.
        core: sources or git directory of opensim-core.
        rounds: how often each solver solves each study.
    """
    print(
        "| study | solver | iterations | objective | violation | set-up and solve, s | speed-up "
        "| process, s | speed-up |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        warm_up = _write_warm_up(Path(temporary), core)
        for name in names or STUDIES:
            folder = Path(temporary) / name.replace(" ", "_")
            folder.mkdir()
            (STUDIES | LONG)[name](folder, core)
            _write_added_names(folder)
            solvers = {"as Moco": SOLVERS["as Moco"]} if name in LONG else SOLVERS
            records = _solve_study(name, folder, str(warm_up), solvers, rounds)
            _print_rows(name, records)


def _write_warm_up(folder: Path, core: Path) -> Path:
    """Write a small study, which a process solves before the timed one; return its file."""
    get_saved_study("sliding-100")(folder, core)
    file = folder / "study.omoco"
    # Five intervals are solved in a moment, and load the same libraries.
    text = file.read_text(encoding="utf-8")
    file.write_text(
        text.replace("<num_mesh_intervals>100<", "<num_mesh_intervals>5<"), encoding="utf-8"
    )
    return file


def _write_added_names(folder: Path) -> None:
    """Write the names of goals and the bounds of states that are added to a study, for Moco's script.

    OpenSim's Python binding has no access to these lists of a phase.
    """
    if not (folder / "more.omoco").exists():
        return
    phase = osimlite.read_document(folder / "more.omoco").problem.phases
    names = {
        "goals": [goal.name for goal in phase.goals],
        "states": {info.name: list(info.bounds) for info in phase.state_infos},
    }
    (folder / "more.json").write_text(json.dumps(names), encoding="utf-8")


def _solve_study(
    name: str, folder: Path, warm_up: str, solvers: dict[str, Solver], rounds: int
) -> dict[str, Record]:
    """Solve one study with each solver in turn.

    Args:
        name: name of the study.
        folder: folder with its files.
        warm_up: file of the study that is solved before.
        solvers: solvers by title.
        rounds: how often each solves it.

    Returns:
        Results by title of the solver.
    """
    records = {title: Record() for title in solvers}
    for _ in range(rounds):
        for title, solver in solvers.items():
            record = records[title]
            numbers, _ = _run_script(solver.script, [solver.hessian, warm_up], folder)
            record.solve = Solve(*numbers)
            # The rows are printed after the last round, which may be much later.
            print(f"{name}, {title}: {numbers}", file=sys.stderr)
            record.solve_times.append(record.solve.seconds)
            if solver.is_moco:
                # Solving a second time would take minutes. Moco's process is the time of loading
                # its libraries plus that of the solve.
                (import_seconds,), _ = _run_script(IMPORT_SCRIPT, [], folder)
                record.process_times.append(import_seconds + record.solve.seconds)
            else:
                numbers, _ = _run_script(solver.script, [solver.hessian, ""], folder)
                record.process_times.append(Solve(*numbers).process_seconds)
            if name in LONG:
                # Moco needs too long for these studies.
                record.violation = "-"
            else:
                file = "theirs.sto" if solver.is_moco else "ours.sto"
                record.violation = _compute_violation(folder, file)
    return records


def _print_rows(name: str, records: dict[str, Record]) -> None:
    """Print one row of the table for each solver.

    Args:
        name: name of the study.
        records: results by title of the solver.
    """
    for number, (title, record) in enumerate(records.items()):
        assert record.solve is not None
        note = "" if record.solve.success else " (not solved)"
        cells = [
            "" if number else name,
            title + note,
            f"{record.solve.iterations}",
            f"{record.solve.objective:.7g}",
            record.violation,
        ]
        moco = None if title == "Moco" else records.get("Moco")
        seconds = median(record.solve_times)
        process_seconds = median(record.process_times)
        cells += [
            f"{seconds:.3g}",
            "" if moco is None else f"{median(moco.solve_times) / seconds:.1f}",
            f"{process_seconds:.3g}",
            "" if moco is None else f"{median(moco.process_times) / process_seconds:.1f}",
        ]
        print("|", *(f"{cell} |" for cell in cells), flush=True)


def _run_script(code: str, arguments: list[str], folder: Path) -> tuple[list[float], str]:
    """Run a script in a folder.

    Args:
        code: text of the script.
        arguments: its arguments.
        folder: its working folder.

    Returns:
        The numbers that it prints on its last line, and everything that it prints.

    Raises:
        SystemExit: the script fails; the message ends with what it printed.
    """
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        # More threads would increase the processor time of Moco.
        env=os.environ | {"OPENSIM_MOCO_PARALLEL": "0"},
        check=False,
    )
    if done.returncode:
        raise SystemExit(done.stdout[-2000:] + done.stderr[-4000:])
    numbers: list[float] = json.loads(done.stdout.splitlines()[-1])
    return numbers, done.stdout


def _compute_violation(folder: Path, solution: str) -> str:
    """Return the largest constraint violation that Moco computes for a solution file.

    Args:
        folder: folder of the study.
        solution: name of the file.
    """
    trajectory = MocoTrajectory.read(folder / solution)
    if (folder / "inverse.xml").exists():
        # MocoInverse adds coordinates to its solution, which are no variables of its study.
        states = [
            name for name in trajectory.names["states"] if not name.endswith(("/value", "/speed"))
        ]
        trajectory = replace(trajectory, names=trajectory.names | {"states": tuple(states)})
    trajectory.write(folder / "guess.sto")
    _, log = _run_script(OPENSIM_SCRIPT, ["guess.sto", ""], folder)
    # Later solves of the study must not use these options.
    (folder / "ipopt.opt").unlink()
    match = re.search(r"Constraint violation\.+:\s+\S+\s+(\S+)", log)
    return f"{float(match[1]):.1e}" if match else "?"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "studies",
        nargs="*",
        choices=[[], *STUDIES, *LONG],
        default=[],
        help="names of the studies to solve",
    )
    parser.add_argument(
        "--core", type=Path, default=CORE, help="sources or git directory of opensim-core"
    )
    parser.add_argument(
        "--rounds", type=int, default=1, help="how often each solver solves each study"
    )
    options = parser.parse_args()
    main(options.studies, options.core, options.rounds)
