"""The kinematics step of a client of OpenSim, before and after the patch of its kit: the same trial, time, difference.

    python benchmarks/clients.py perfanalytics-pose2sim CLONE TRIAL.trc
    python benchmarks/clients.py stanfordnmbl-opencap-core CLONE TRIAL.trc --static STATIC.trc

The clone must be at the commit of the kit, and what the client imports installed; in the end it is
as it was. Each step scales the model and fits the trial in a process of its own; both run in turn.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import types
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import osimlite
from adoption import KITS, git
from osimlite.io.tables.storage import StoTable, read_sto

MASS, HEIGHT = 75.0, 1.8
"""Of the subject, kg and m."""
CMD = f"""#!{sys.executable}
import opensim, sys
opensim.Logger.setLevelString("error")
tool = opensim.OpenSimObject.makeObjectFromFile(sys.argv[-1])
sys.exit(not getattr(opensim, tool.getConcreteClassName()).safeDownCast(tool).run())
"""
"""What stands in for opensim-cmd, which the wheel of OpenSim does not have."""
Step = Callable[[], tuple[str, str]]
"""Scales and fits; where in its folder the motion is, and the setup that it was fitted by."""


def pose2sim(folder: Path, trial: Path, static: Path | None) -> Step:
    """Pose2Sim scales by the trial itself, and knows by _LSTM in its name that the markers are augmented."""
    kinematics_all = import_module("Pose2Sim.kinematics").kinematics_all
    (folder / "pose-3d").mkdir()
    shutil.copy(trial, folder / "pose-3d")
    project = {"project_dir": str(folder), "participant_mass": MASS}
    kinematics = {"remove_individual_ik_setup": False, "make_bvh": False}

    def take() -> tuple[str, str]:
        kinematics_all({"project": project, "kinematics": kinematics})
        return f"kinematics/{trial.stem}.mot", f"kinematics/{trial.stem}_ik_setup.xml"

    return take


def opencap(folder: Path, trial: Path, static: Path | None) -> Step:
    """OpenCap scales by a static trial; the markers are those of its laboratory."""
    assert static is not None, "OpenCap needs --static"
    # The step uses nothing of this module, whose import logs in to a server.
    sys.modules["utils"] = types.SimpleNamespace(storage2numpy=None)  # type: ignore[assignment]
    sys.path.insert(0, os.getcwd())
    times, tools = (
        import_module("utilsDataman").TRCFile(str(static)).time,
        import_module("utilsOpenSim"),
    )
    here = Path.cwd() / "opensimPipeline"
    setups = [
        here / "Scaling" / "Setup_scaling_LaiUhlrich2022_Mocap.xml",
        here / "Models" / "LaiUhlrich2022.osim",
    ]
    span = [float(times[0]), float(times[-1])]

    def take() -> tuple[str, str]:
        scaled = tools.runScaleTool(
            *map(str, setups), MASS, str(static), span, str(folder), subjectHeight=HEIGHT
        )
        tools.runIKTool(str(here / "IK" / "Setup_IK_Mocap.xml"), scaled, str(trial), str(folder))
        return f"{trial.stem}.mot", f"Setup_IK_{trial.stem}.xml"

    return take


STEPS = {"perfanalytics-pose2sim": pose2sim, "stanfordnmbl-opencap-core": opencap}


def timed(name: str, folder: Path, trial: Path, static: Path | None) -> tuple[float, Path, Path]:
    """Let a client take its step in another process: processor seconds without imports, motion and setup."""
    folder.mkdir()
    command = [sys.executable, __file__, name, ".", str(trial), "--folder", str(folder)]
    command += ["--static", str(static)] * (static is not None)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    seconds, motion, setup = done.stdout.splitlines()[-1].split("\t")
    return float(seconds), folder / motion, folder / setup


def apart(one: StoTable, other: StoTable) -> str:
    """How far motions are apart: of all numbers half are nearer than the first, 95 of 100 nearer than the second."""
    assert one.columns == other.columns
    off = np.abs(one.rows - other.rows)
    half, most = np.quantile(off, (0.5, 0.95))
    worst = one.columns[off.max(axis=0).argmax()]
    return f"{half:.2g} degrees apart in the median, {most:.2g} for 95 %, {off.max():.2g} at most ({worst})"


def errors(motion: Path) -> str:
    """Root mean square of the marker errors that were reported beside a motion."""
    (file,) = motion.parent.glob("*_ik_marker_errors.sto")
    return f"{1e3 * np.sqrt(np.mean(read_sto(file)['marker_error_RMS'] ** 2)):.3f} mm"


def compare(name: str, trial: Path, static: Path | None, rounds: int) -> None:
    kit = KITS / name
    patch = kit / "client" / "kinematics.patch"
    with TemporaryDirectory() as place:
        here = Path(place)
        (here / "opensim-cmd").write_text(CMD)
        (here / "opensim-cmd").chmod(0o755)
        os.environ["PATH"] = f"{place}{os.pathsep}{os.environ['PATH']}"
        theirs, ours = [], []
        for number in range(rounds):
            theirs.append(timed(name, here / f"theirs{number}", trial, static))
            git("apply", patch)
            try:
                ours.append(timed(name, here / f"ours{number}", trial, static))
            finally:
                git("apply", "-R", patch)
        times = min(theirs)[0], min(ours)[0]
        print(
            f"OpenSim {times[0]:.2f} s, osimlite {times[1]:.2f} s of the processor: {times[0] / times[1]:.1f} times"
        )
        print(f"marker errors: OpenSim {errors(theirs[0][1])}, osimlite {errors(ours[0][1])}")
        known = read_sto(theirs[0][1])
        print(f"scaled and fitted: {apart(read_sto(ours[0][1]), known)}")
        osimlite.run(theirs[0][2], here / "same", check=False)
        print(
            f"fitted to the model that OpenSim scaled: {apart(read_sto(here / 'same' / theirs[0][1].name), known)}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("client", choices=STEPS)
    parser.add_argument("clone", type=Path)
    parser.add_argument("trial", type=Path)
    parser.add_argument("--static", type=Path)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    trial, static = asked.trial.resolve(), asked.static and asked.static.resolve()
    os.chdir(asked.clone)
    if asked.folder:
        take = STEPS[asked.client](asked.folder, trial, static)
        start = sum(os.times()[:4])
        found = take()
        print(sum(os.times()[:4]) - start, *found, sep="\t")
        return
    (commit,) = set(
        re.findall(
            r"\b[0-9a-f]{40}\b", (KITS / asked.client / "README.md").read_text(encoding="utf-8")
        )
    )
    assert git("rev-parse", "HEAD") == commit, f"the kit is for {commit}"
    compare(asked.client, trial, static, asked.rounds)


if __name__ == "__main__":
    main()
