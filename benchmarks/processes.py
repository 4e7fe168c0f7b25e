"""Processor time of complete processes, compared with OpenSim.

    python benchmarks/processes.py [--rounds N] [NAME ...]

Each case is a tool of OpenSim or a simulation. osimlite and OpenSim run in turn, each in a process
of its own. The table has the median processor times (s), and the median, least and greatest ratio
of the times of a pair. Processor time is used because a busy machine changes it little. The files
are those of the reference data in the shared folder. One pair runs before the timed ones, so that
byte code and results of an earlier run exist, as they do for users.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from _corpus import FIXTURES, REFERENCE, WALKER, unpack_file, unpack_files
from _pair import copy_user_environment

MODELS = REFERENCE / "models"

STEPS = FIXTURES / "pipelines" / "walking"
"""Setups of RRA and CMC that track steps of gait10."""

TOOL_SCRIPT = (
    "import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}('{setup}').run()"
)
SIMULATION_SCRIPT = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model("DynamicWalkerModel.osim")
state = model.initSystem()
manager = opensim.Manager(model)
manager.setIntegratorAccuracy(1e-3)
manager.initialize(state)
manager.integrate(2.0)
"""


class ProcessCase(NamedTuple):
    """Two commands that do the same in one folder."""

    name: str
    folder: Path
    """Working folder of both."""
    ours: list[str]
    """Command of osimlite."""
    theirs: list[str]
    """Command of OpenSim."""


def unpack(folder: Path, source: str) -> Path:
    """Copy a folder of the reference data into another, uncompressed, and return the copy."""
    target = folder / source
    target.mkdir()
    unpack_files((REFERENCE / source).iterdir(), target)
    return target


def unpack_steps(folder: Path) -> Path:
    """Copy the files of the tools that track steps of gait10 into a folder, and return it."""
    target = unpack(folder, "analyses_gait10")
    for setup in STEPS.iterdir():
        shutil.copy(setup, target)
    # The setups use other names for files of the reference data.
    for name, source in (("loads.xml", "grf.xml"), ("reserves.xml", "reserve.xml")):
        shutil.copy(target / source, target / name)
    unpack_file(MODELS / "gait10_subject01.osim.gz", target / "model.osim")
    return target


def list_cases(folder: Path) -> list[ProcessCase]:
    """Return the cases, whose files are copied into subfolders of a folder."""
    osimlite = [sys.executable, "-m", "osimlite"]
    cases = []
    gait2354 = unpack(folder, "ik_id_gait2354")
    unpack_file(MODELS / "gait2354_subject01_simbody.osim.gz", gait2354 / "subject01_simbody.osim")
    # Inverse dynamics reads the result of inverse kinematics, which may not be run.
    shutil.copy(gait2354 / "ik_accuracy_1e-5.mot", gait2354 / "subject01_walk1_ik.mot")
    steps = unpack_steps(folder)
    for name, source, setup in (
        ("ForwardTool", unpack(folder, "forward_arm26"), "fwd.xml"),
        ("ScaleTool", unpack(folder, "scale_gait2354"), "scale.xml"),
        ("InverseKinematicsTool", gait2354, "subject01_Setup_IK.xml"),
        ("InverseDynamicsTool", gait2354, "subject01_Setup_InverseDynamics.xml"),
        # This setup is of static optimization.
        (
            "AnalyzeTool",
            unpack(folder, "so_arm26_bounds"),
            "arm26_bounds_Setup_StaticOptimization.xml",
        ),
        ("RRATool", steps, "rra.xml"),
        ("CMCTool", steps, "cmc.xml"),
    ):
        theirs = [sys.executable, "-c", TOOL_SCRIPT.format(tool=name, setup=setup)]
        cases.append(ProcessCase(name, source, [*osimlite, "run", setup, "--overwrite"], theirs))
    walker = folder / "walker"
    walker.mkdir()
    shutil.copy(WALKER, walker)
    ours = [*osimlite, "simulate", WALKER.name, "--to", "2", "-o", "results"]
    cases.append(ProcessCase("simulate", walker, ours, [sys.executable, "-c", SIMULATION_SCRIPT]))
    return cases


def measure_process(command: list[str], folder: Path) -> float:
    """Return the processor time of a process (s).

    Args:
        command: command line.
        folder: working folder.

    Raises:
        RuntimeError: the process failed; the message ends with what it wrote to standard error.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command,
        cwd=folder,
        env=copy_user_environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(
            f"{command} ended with exit code {done.returncode}: {done.stderr.strip()}"
        )
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def measure_case(case: ProcessCase, rounds: int) -> list[float]:
    """Run both commands of a case in turn.

    Args:
        case: case to measure.
        rounds: number of timed pairs.

    Returns:
        Median times of osimlite and OpenSim (s); median, least and greatest ratio.
    """
    pairs = []
    for _ in range(1 + rounds):
        ours = measure_process(case.ours, case.folder)
        theirs = measure_process(case.theirs, case.folder)
        pairs.append((ours, theirs))
    # The first pair is the warm-up.
    pairs = pairs[1:]
    ratios = [ours / theirs for ours, theirs in pairs]
    medians = [median(times) for times in zip(*pairs, strict=True)]
    return [*medians, median(ratios), min(ratios), max(ratios)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="names of cases to run; all by default"
    )
    parser.add_argument(
        "--rounds", type=int, default=5, metavar="N", help="number of timed pairs, 5 by default"
    )
    options = parser.parse_args()
    table = Table(
        title="Complete processes",
        caption="processor time in s, medians; ratio = osimlite / OpenSim, per pair",
    )
    table.add_column("")
    for column in ("osimlite, s", "OpenSim, s", "ratio", "least", "greatest"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as name:
        for case in list_cases(Path(name)):
            if options.names and case.name not in options.names:
                continue
            numbers = measure_case(case, options.rounds)
            table.add_row(case.name, *(f"{number:.3f}" for number in numbers))
    Console().print(table)


if __name__ == "__main__":
    main()
