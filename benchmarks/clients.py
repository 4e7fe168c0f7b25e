"""Compare a program that uses OpenSim for kinematics before and after the patch of its kit.

    python benchmarks/clients.py perfanalytics-pose2sim CLONE TRIAL.trc
    python benchmarks/clients.py stanfordnmbl-opencap-core CLONE TRIAL.trc --static STATIC.trc

The patch of docs/adoption/CLIENT/client replaces OpenSim by osimlite. CLONE is a clone of the
client at the commit of the kit, whose dependencies are installed; at the end it is as before. In
each round the client scales a model and fits the trial twice, in processes of their own: with
OpenSim, and with the patch.

The script prints the processor times of both, the marker errors that both report, and how far the
motions differ: of the complete step, and with the model that OpenSim has scaled.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import types
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

import osimlite
from adoption import KITS, check_commit, run_git
from osimlite.io.tables.storage import StoTable, read_sto

SUBJECT_MASS_KG = 75.0

SUBJECT_HEIGHT_M = 1.8

OPENSIM_CMD = f"""#!{sys.executable}
import opensim, sys
opensim.Logger.setLevelString("error")
tool = opensim.OpenSimObject.makeObjectFromFile(sys.argv[-1])
sys.exit(not getattr(opensim, tool.getConcreteClassName()).safeDownCast(tool).run())
"""
"""Program that replaces opensim-cmd, which the wheel of OpenSim lacks."""

KinematicsStep = Callable[[], tuple[str, str]]
"""Function that scales and fits; it returns the files of the motion and of the setup of the fit."""


class StepResult(NamedTuple):
    """Result of a kinematics step.

    Attributes:
        seconds: processor time without imports (s).
        motion: file of the motion.
        setup: setup file of inverse kinematics.
    """

    seconds: float
    motion: Path
    setup: Path


def prepare_pose2sim(folder: Path, trial: Path, static: Path | None) -> KinematicsStep:
    """Prepare a project of Pose2Sim, which scales with the trial itself.

    Args:
        folder: folder for the project.
        trial: marker file; with ``_LSTM`` in its name Pose2Sim takes the markers as augmented.
        static: not used.
    """
    kinematics_all = import_module("Pose2Sim.kinematics").kinematics_all
    (folder / "pose-3d").mkdir()
    shutil.copy(trial, folder / "pose-3d")
    project = {"project_dir": str(folder), "participant_mass": SUBJECT_MASS_KG}
    # The setup is needed afterwards; an animation file would cost time in both programs.
    kinematics = {"remove_individual_ik_setup": False, "make_bvh": False}

    def scale_and_fit() -> tuple[str, str]:
        kinematics_all({"project": project, "kinematics": kinematics})
        return f"kinematics/{trial.stem}.mot", f"kinematics/{trial.stem}_ik_setup.xml"

    return scale_and_fit


def prepare_opencap(folder: Path, trial: Path, static: Path | None) -> KinematicsStep:
    """Prepare the step of OpenCap, which scales with a static trial.

    Args:
        folder: folder for the results.
        trial: marker file with the markers of OpenCap's laboratory.
        static: marker file of the static trial.
    """
    assert static is not None, "OpenCap needs --static"
    # The step uses nothing of this module, whose import logs in to a server.
    sys.modules["utils"] = types.SimpleNamespace(storage2numpy=None)  # type: ignore[assignment]
    # OpenCap is not a package: its modules are imported from the clone.
    sys.path.insert(0, os.getcwd())
    times = import_module("utilsDataman").TRCFile(str(static)).time
    tools = import_module("utilsOpenSim")
    pipeline = Path.cwd() / "opensimPipeline"
    scale_setup = pipeline / "Scaling" / "Setup_scaling_LaiUhlrich2022_Mocap.xml"
    generic_model = pipeline / "Models" / "LaiUhlrich2022.osim"
    ik_setup = pipeline / "IK" / "Setup_IK_Mocap.xml"
    time_range = [float(times[0]), float(times[-1])]

    def scale_and_fit() -> tuple[str, str]:
        scaled_model = tools.runScaleTool(
            str(scale_setup),
            str(generic_model),
            SUBJECT_MASS_KG,
            str(static),
            time_range,
            str(folder),
            subjectHeight=SUBJECT_HEIGHT_M,
        )
        tools.runIKTool(str(ik_setup), scaled_model, str(trial), str(folder))
        return f"{trial.stem}.mot", f"Setup_IK_{trial.stem}.xml"

    return scale_and_fit


CLIENTS = {
    "perfanalytics-pose2sim": prepare_pose2sim,
    "stanfordnmbl-opencap-core": prepare_opencap,
}
"""Functions that prepare the kinematics step, by the kit of the client."""


def run_step(client: str, folder: Path, trial: Path, static: Path | None) -> StepResult:
    """Let a client scale and fit in a process of its own.

    Args:
        client: kit of the client.
        folder: folder for the results, which is made.
        trial: marker file of the motion.
        static: marker file of the static trial, if the client needs one.
    """
    folder.mkdir()
    command = [sys.executable, __file__, client, ".", str(trial), "--folder", str(folder)]
    if static is not None:
        command += ["--static", str(static)]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stderr[-2000:]
    # The client may print lines of its own before.
    seconds, motion, setup = process.stdout.splitlines()[-1].split("\t")
    return StepResult(float(seconds), folder / motion, folder / setup)


def time_step(client: str, folder: Path, trial: Path, static: Path | None) -> None:
    """Scale and fit in this process; print processor time (s), motion and setup for `run_step`."""
    scale_and_fit = CLIENTS[client](folder, trial, static)
    # The first four times are those of this process and of processes that it has started.
    start = sum(os.times()[:4])
    motion, setup = scale_and_fit()
    print(sum(os.times()[:4]) - start, motion, setup, sep="\t")


def describe_difference(motion: StoTable, reference: StoTable) -> str:
    """Return the median, the 0.95 quantile and the maximum of the differences of two motions."""
    assert motion.columns == reference.columns
    differences = np.abs(motion.rows - reference.rows)
    half, most = np.quantile(differences, (0.5, 0.95))
    column = motion.columns[differences.max(axis=0).argmax()]
    return (
        f"differences of {half:.2g} degrees in the median, {most:.2g} in 95 %, "
        f"{differences.max():.2g} at most ({column})"
    )


def describe_marker_errors(motion: Path) -> str:
    """Return the root mean square of the marker errors that were reported with a motion."""
    (file,) = motion.parent.glob("*_ik_marker_errors.sto")
    return f"{1e3 * np.sqrt(np.mean(read_sto(file)['marker_error_RMS'] ** 2)):.3f} mm"


def provide_opensim_cmd(folder: Path) -> None:
    """Write a program ``opensim-cmd`` to a folder, and add the folder to the search path."""
    program = folder / "opensim-cmd"
    program.write_text(OPENSIM_CMD, encoding="utf-8")
    program.chmod(0o755)
    os.environ["PATH"] = f"{folder}{os.pathsep}{os.environ['PATH']}"


def compare_client(client: str, trial: Path, static: Path | None, rounds: int) -> None:
    """Compare a client with and without the patch of its kit, and print the results.

    Args:
        client: kit of the client, whose clone is the working folder.
        trial: marker file of the motion.
        static: marker file of the static trial, if the client needs one.
        rounds: number of runs of each.
    """
    patch = KITS / client / "client" / "kinematics.patch"
    with TemporaryDirectory() as name:
        folder = Path(name)
        provide_opensim_cmd(folder)
        theirs = []
        ours = []
        # Both run in turn, so that they meet the same machine.
        for number in range(rounds):
            theirs.append(run_step(client, folder / f"theirs{number}", trial, static))
            run_git("apply", patch)
            try:
                ours.append(run_step(client, folder / f"ours{number}", trial, static))
            finally:
                run_git("apply", "-R", patch)
        # Other programs disturb the fastest run least.
        opensim_time = min(theirs).seconds
        osimlite_time = min(ours).seconds
        print(
            f"processor time: OpenSim {opensim_time:.2f} s, osimlite {osimlite_time:.2f} s, "
            f"ratio {opensim_time / osimlite_time:.1f}"
        )
        print(
            f"marker errors: OpenSim {describe_marker_errors(theirs[0].motion)}, "
            f"osimlite {describe_marker_errors(ours[0].motion)}"
        )
        reference = read_sto(theirs[0].motion)
        complete = describe_difference(read_sto(ours[0].motion), reference)
        print(f"scaled and fitted: {complete}")
        # The same setup, with the model that OpenSim has scaled.
        osimlite.run(theirs[0].setup, folder / "same", check=False)
        fitted = read_sto(folder / "same" / theirs[0].motion.name)
        print(f"fitted to the model that OpenSim scaled: {describe_difference(fitted, reference)}")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("client", choices=CLIENTS, help="kit of the client")
    parser.add_argument("clone", type=Path, help="clone of the client")
    parser.add_argument("trial", type=Path, help="marker file of the motion")
    parser.add_argument("--static", type=Path, help="marker file of the static trial")
    parser.add_argument("--rounds", type=int, default=3, help="number of runs, 3 by default")
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    trial = options.trial.resolve()
    static = options.static.resolve() if options.static else None
    os.chdir(options.clone)
    if options.folder:
        time_step(options.client, options.folder, trial, static)
        return
    check_commit(KITS / options.client)
    compare_client(options.client, trial, static, options.rounds)


if __name__ == "__main__":
    main()
