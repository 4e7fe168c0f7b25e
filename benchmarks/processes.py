"""Whole processes beside OpenSim's, in turn: processor seconds of each and the ratio of each pair.

    python benchmarks/processes.py [--rounds N] [NAME ...]

Processor time is that of the finished process, so that a busy machine changes it little. The files
are those of the reference data in the shared folder; what a first run leaves (byte code, results)
is there when the time is taken.
"""

from __future__ import annotations

import argparse
import gzip
import os
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

from _corpus import CORPUS

REFERENCE = CORPUS.parents[1] / "oracle" / "tools" / "reference"
FIXTURES = Path(__file__).resolve().parent.parent / "fixtures"
WALKER = FIXTURES / "walker/DynamicWalkerModel.osim"
STEPS = FIXTURES / "pipelines/walking"
TOOL = (
    "import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}('{setup}').run()"
)
SIMULATION = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model("DynamicWalkerModel.osim")
state = model.initSystem()
manager = opensim.Manager(model)
manager.setIntegratorAccuracy(1e-3)
manager.initialize(state)
manager.integrate(2.0)
"""


class Case(NamedTuple):
    """Two commands that do the same in one folder."""

    name: str
    folder: Path
    ours: list[str]
    theirs: list[str]


def unpack(folder: Path, source: str) -> Path:
    """Put a folder of the reference data into another, uncompressed; return where it is."""
    target = folder / source
    target.mkdir()
    for file in sorted((REFERENCE / source).iterdir()):
        content = file.read_bytes()
        if file.suffix == ".gz":
            content = gzip.decompress(content)
        (target / file.name.removesuffix(".gz")).write_bytes(content)
    return target


def unpack_model(name: str, target: Path) -> None:
    """Write a model of the reference data, uncompressed."""
    target.write_bytes(gzip.decompress((REFERENCE / "models" / f"{name}.osim.gz").read_bytes()))


def unpack_steps(folder: Path) -> Path:
    """Put the files of the tools that track steps of gait10 into a folder; return where it is."""
    target = unpack(folder, "analyses_gait10")
    for setup in STEPS.iterdir():
        shutil.copy(setup, target)
    # The setups have names of their own for the same files.
    for name, source in (("loads.xml", "grf.xml"), ("reserves.xml", "reserve.xml")):
        shutil.copy(target / source, target / name)
    unpack_model("gait10_subject01", target / "model.osim")
    return target


def list_cases(folder: Path) -> list[Case]:
    """Return what is timed, with its files put below a folder."""
    osimlite = [sys.executable, "-m", "osimlite"]
    cases = []
    gait2354 = unpack(folder, "ik_id_gait2354")
    unpack_model("gait2354_subject01_simbody", gait2354 / "subject01_simbody.osim")
    # Inverse dynamics reads what inverse kinematics writes; either may be chosen alone.
    shutil.copy(gait2354 / "ik_accuracy_1e-5.mot", gait2354 / "subject01_walk1_ik.mot")
    steps = unpack_steps(folder)
    for name, source, setup in (
        ("ForwardTool", unpack(folder, "forward_arm26"), "fwd.xml"),
        ("ScaleTool", unpack(folder, "scale_gait2354"), "scale.xml"),
        ("InverseKinematicsTool", gait2354, "subject01_Setup_IK.xml"),
        ("InverseDynamicsTool", gait2354, "subject01_Setup_InverseDynamics.xml"),
        # Static optimization
        (
            "AnalyzeTool",
            unpack(folder, "so_arm26_bounds"),
            "arm26_bounds_Setup_StaticOptimization.xml",
        ),
        ("RRATool", steps, "rra.xml"),
        ("CMCTool", steps, "cmc.xml"),
    ):
        theirs = [sys.executable, "-c", TOOL.format(tool=name, setup=setup)]
        cases.append(Case(name, source, [*osimlite, "run", setup, "--overwrite"], theirs))
    walker = folder / "walker"
    walker.mkdir()
    shutil.copy(WALKER, walker)
    ours = [*osimlite, "simulate", WALKER.name, "--to", "2", "-o", "results"]
    cases.append(Case("simulate", walker, ours, [sys.executable, "-c", SIMULATION]))
    return cases


def measure_process(command: list[str], folder: Path) -> float:
    """Return the processor time that a process took, s.

    Raises:
        RuntimeError: it failed; the message ends with what it wrote to standard error.
    """
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(
            f"{command} ended with exit code {done.returncode}: {done.stderr.strip()}"
        )
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("names", nargs="*", metavar="NAME", help="only these cases")
    parser.add_argument(
        "--rounds", type=int, default=5, metavar="N", help="how many pairs, 5 by default"
    )
    options = parser.parse_args()
    table = Table(
        title="Whole processes",
        caption="processor time in s, medians; ratio = ours / OpenSim, per pair",
    )
    table.add_column("")
    for column in ("osimlite", "OpenSim", "ratio", "least", "greatest"):
        table.add_column(column, justify="right")
    with tempfile.TemporaryDirectory() as name:
        for case in list_cases(Path(name)):
            if options.names and case.name not in options.names:
                continue
            pairs = [
                (measure_process(case.ours, case.folder), measure_process(case.theirs, case.folder))
                for _ in range(1 + options.rounds)
            ][1:]
            ratios = [ours / theirs for ours, theirs in pairs]
            numbers = (
                *(median(times) for times in zip(*pairs, strict=True)),
                median(ratios),
                min(ratios),
                max(ratios),
            )
            table.add_row(case.name, *(f"{number:.3f}" for number in numbers))
    Console().print(table)


if __name__ == "__main__":
    main()
