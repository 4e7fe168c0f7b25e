"""Studies of Moco, solved here and by Moco 4.6 itself in turn: iterations, objective, violations, time.

    python benchmarks/optimal.py [--core FOLDER] [--rounds N] [STUDY ...]

FOLDER: sources of opensim-core, or its git directory (``git clone --bare``), for walks and gaits.
``benchmarks/refinement.py`` shows what meshes save that are refined where it is needed.

Seconds are those of the processor, medians of the rounds. *Set-up and solve* begins with the files,
in a process that has loaded its libraries and solved another small study; the *process* is a whole
one from its start, which solves one. Moco uses one thread (``OPENSIM_MOCO_PARALLEL=0``), as we do:
more make its processor time larger. The violation is what Moco says of each solution file: its own
largest constraint violation where it is the guess, before the first step. Studies that Moco takes
most of an hour for are solved here alone, and only by name.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import osimlite
from _moco_studies import CORE, LONG, STUDIES, kept
from osimlite.base.records import replace
from osimlite.moco import MocoTrajectory

OURS = """
import json, os, sys, time
import osimlite, osimlite.optimal.solution
from osimlite import moco
hessian, warm = sys.argv[1:]
if warm:
    moco.solve(warm)
before = time.process_time()
def more(study):
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
    more(study)
    found = moco.solve(study)
elif os.path.exists("track.xml"):
    found = moco.solve_track(osimlite.read_document("track.xml"), more=more)
else:
    found = moco.solve_inverse(osimlite.read_document("inverse.xml"), more=more)
spent = time.process_time() - before
found.write("ours.sto")
print(json.dumps([found.success, found.iterations, found.objective, spent, time.process_time()]))
"""
THEIRS = """
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
    said = json.load(open("more.json"))
    for name in said["goals"]:
        study.updProblem().addGoal(phase.updGoal(name).clone())
    for name, bounds in said["states"].items():
        study.updProblem().setStateInfo(name, bounds)
    settings = osim.MocoCasADiSolver.safeDownCast(added.updSolver())
    for name in ("optim_convergence_tolerance", "optim_constraint_tolerance", "optim_max_iterations"):
        getattr(solver, f"set_{name}")(getattr(settings, f"get_{name}")())
if guess:
    # Ipopt reads that it is not to move the guess away from its bounds; Simbody's, which was asked before, too.
    with open("ipopt.opt", "w") as stream:
        stream.write("bound_push 1e-16\\nbound_frac 1e-16\\nbound_relax_factor 0\\n")
    solver.setGuessFile(guess)
    solver.set_optim_max_iterations(0)
    osim.Logger.setLevelString("Info")
else:
    solver.set_verbosity(0)
solution = study.solve()
spent = time.process_time() - before
success = solution.success()
if solution.isSealed():
    solution.unseal()
if not guess:
    solution.write("theirs.sto")
print()
print(json.dumps([success, solution.getNumIterations(), solution.getObjective(), spent, time.process_time()]))
"""


def main(names: list[str], core: Path, rounds: int) -> None:
    """Print a table in Markdown."""
    print(
        "| study | | iterations | objective | violation | set-up and solve, s | times | process, s | times |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as place:
        warm = Path(place) / "study.omoco"
        kept("sliding-100")(Path(place), core)
        text = warm.read_text(encoding="utf-8")
        warm.write_text(
            text.replace("<num_mesh_intervals>100<", "<num_mesh_intervals>5<"), encoding="utf-8"
        )
        for name in names or STUDIES:
            folder = Path(place) / name.replace(" ", "_")
            folder.mkdir()
            (STUDIES | LONG)[name](folder, core)
            _say_more(folder)
            _study(name, folder, str(warm), rounds)


def _say_more(folder: Path) -> None:
    """What SWIG does not show of a phase: names of goals, bounds of states."""
    if not (folder / "more.omoco").exists():
        return
    phase = osimlite.read_document(folder / "more.omoco").problem.phases
    said = {
        "goals": [goal.name for goal in phase.goals],
        "states": {info.name: list(info.bounds) for info in phase.state_infos},
    }
    (folder / "more.json").write_text(json.dumps(said), encoding="utf-8")


def _study(name: str, folder: Path, warm: str, rounds: int) -> None:
    """Solve one in turn, and print its rows."""
    sides = {"Moco": (THEIRS, ""), "as Moco": (OURS, ""), "exact": (OURS, "exact")}
    if name in LONG:
        sides = {"as Moco": sides["as Moco"]}
    spent: dict[str, list[float]] = {side: [] for side in sides}
    whole: dict[str, list[float]] = {side: [] for side in sides}
    said: dict[str, list[float]] = {}
    missed: dict[str, str] = {}
    for _ in range(rounds):
        for side, (code, choice) in sides.items():
            said[side], _ = _run(code, [choice, warm], folder)
            # The table comes late.
            print(f"{name}, {side}: {said[side]}", file=sys.stderr)
            spent[side].append(said[side][3])
            if side == "Moco":
                # A second one would take minutes; its libraries are loaded before it begins.
                cold, _ = _run(
                    "import json, time, opensim\nprint(json.dumps([time.process_time()]))",
                    [],
                    folder,
                )
                whole[side].append(cold[0] + said[side][3])
            else:
                whole[side].append(_run(code, [choice, ""], folder)[0][4])
            missed[side] = (
                "-"
                if name in LONG
                else _violation(folder, "theirs.sto" if side == "Moco" else "ours.sto")
            )
    for number, side in enumerate(sides):
        success, iterations, objective, *_ = said[side]
        note = "" if success else " (not solved)"
        cells = [
            "" if number else name,
            side + note,
            f"{iterations}",
            f"{objective:.7g}",
            missed[side],
        ]
        for kind in (spent, whole):
            own = median(kind[side])
            cells += [
                f"{own:.3g}",
                "" if side == "Moco" or name in LONG else f"{median(kind['Moco']) / own:.1f}",
            ]
        print("|", *(f"{cell} |" for cell in cells), flush=True)


def _run(code: str, arguments: list[str], folder: Path) -> tuple[list[float], str]:
    """The numbers that a script ends with, and all that it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        env=os.environ | {"OPENSIM_MOCO_PARALLEL": "0"},
        check=False,
    )
    if done.returncode:
        raise SystemExit(done.stdout[-2000:] + done.stderr[-4000:])
    found: list[float] = json.loads(done.stdout.splitlines()[-1])
    return found, done.stdout


def _violation(folder: Path, solution: str) -> str:
    """The largest one that Moco has of a solution file."""
    found = MocoTrajectory.read(folder / solution)
    if (folder / "inverse.xml").exists():
        # What MocoInverse adds to its solution is no variable of its study.
        own = [name for name in found.names["states"] if not name.endswith(("/value", "/speed"))]
        found = replace(found, names=found.names | {"states": tuple(own)})
    found.write(folder / "asked.sto")
    _, log = _run(THEIRS, ["asked.sto", ""], folder)
    (folder / "ipopt.opt").unlink()
    said = re.search(r"Constraint violation\.+:\s+\S+\s+(\S+)", log)
    return f"{float(said[1]):.1e}" if said else "?"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("studies", nargs="*", choices=[[], *STUDIES, *LONG], default=[])
    parser.add_argument("--core", type=Path, default=CORE)
    parser.add_argument("--rounds", type=int, default=1)
    chosen = parser.parse_args()
    main(chosen.studies, chosen.core, chosen.rounds)
