"""Speed of OpenSim's tools in osimlite, compared with OpenSim itself and with targets.

    python benchmarks/tools.py [--quick] [--trials N]

The programs run the same setup files in turn. A complete run reads and checks the setup and all
files that it names, and writes its results, in a process that has loaded its libraries. The time of
one more frame is found by also running half of the frames. Models and trials are those of the
reference data in the shared folder; inverse kinematics with constraints uses a synthetic motion of
Rajagopal2016.

The table has the medians of complete runs, the shortest times per additional frame, the speed-ups
(OpenSim's time divided by osimlite's), the target of the speed-up, and whether it is reached. The
target is for additional frames where their time is known. With ``--trials N``, N trials are run by
one command with two workers, and the frames per second are printed.
"""

from __future__ import annotations

import argparse
import gzip
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from _pair import Pair, run_command, time_command_pair, time_pair
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.io.tables.storage import write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.spatial import quaternion_of, rotation_xyz
from osimlite.simulation.recorded_motion import RecordedMotion
from validate import build_command

REFERENCE = CORPUS.parents[1] / "oracle" / "tools" / "reference"
GAIT10 = "gait10_subject01.osim"
GAIT2354 = "gait2354_subject01_simbody.osim"
RAJAGOPAL = CORPUS / "m0954.osim.gz"

MARKER_NOISE = 0.01
"""Standard deviation of the noise of synthetic markers along each axis (m)."""

SENSOR_NOISE = np.deg2rad(5.0)
"""Standard deviation of the noise of synthetic orientations about each axis (rad)."""

OPENSIM_SCRIPT = (
    "import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}({setup!r}).run()"
)
"""Script of a complete OpenSim process."""


class ToolCase(NamedTuple):
    """Setup that both programs run."""

    name: str
    tool: str
    """Name of OpenSim's class."""
    setup: Path
    """Setup file, whose folder has all other files."""
    target: float
    """Speed-up that osimlite should reach."""
    half: tuple[str, object] | None = None
    """Property of the tool and its value for half of the frames; None if frames are not timed."""

    def run_osimlite(self) -> object:
        """Run the setup with osimlite."""
        return osimlite.run(self.setup)

    def run_opensim(self) -> None:
        """Run the setup with OpenSim."""
        # OpenSim finds the files of some setups only from their folder.
        os.chdir(self.setup.parent)
        assert getattr(opensim, self.tool)(str(self.setup)).run()

    def count_frames(self) -> int:
        """Return the number of frames of the results."""
        return len(next(iter(osimlite.run(self.setup).tables.values())).times)

    def create_half(self) -> ToolCase:
        """Write a setup with half of the frames, and return its case."""
        assert self.half is not None
        setup = self.setup.with_name("half.xml")
        document = osimlite.read_document(self.setup)
        setattr(document, *self.half)
        osimlite.write(document, setup)
        return self._replace(setup=setup, half=None)


class FrameTimes(NamedTuple):
    """Times of one additional frame (s)."""

    ours: float
    theirs: float


class Row(NamedTuple):
    """Times of a case."""

    case: ToolCase
    complete: Pair
    """Times of complete runs."""
    frame: FrameTimes | None = None


def time_case(case: ToolCase, rounds: int) -> Row:
    """Time a case, and the time of an additional frame if half of its frames can be run.

    Args:
        case: case to time.
        rounds: number of timed pairs.
    """
    complete = time_pair(case.name, ours=case.run_osimlite, theirs=case.run_opensim, rounds=rounds)
    if case.half is None:
        return Row(case, complete)
    short = case.create_half()
    half = time_pair(case.name, ours=short.run_osimlite, theirs=short.run_opensim, rounds=rounds)
    frame_count = case.count_frames() - short.count_frames()
    # The difference of medians would be noisier: other work only makes runs slower.
    frame = FrameTimes(
        (min(complete.ours) - min(half.ours)) / frame_count,
        (min(complete.theirs) - min(half.theirs)) / frame_count,
    )
    return Row(case, complete, frame)


# -------------------------------------------------------------------------------------------- cases
def unpack(folder: Path, *patterns: str) -> None:
    """Make a folder with uncompressed files of the reference data.

    Args:
        folder: folder to make.
        *patterns: patterns of files in the reference data.
    """
    folder.mkdir()
    for pattern in patterns:
        for file in sorted(REFERENCE.glob(pattern)):
            content = file.read_bytes()
            if file.suffix == ".gz":
                content = gzip.decompress(content)
            (folder / file.name.removesuffix(".gz")).write_bytes(content)


def change_setup(folder: Path, setup: str, **fields: object) -> Path:
    """Write a changed copy of a setup, whose results go into the folder "results".

    Args:
        folder: folder of the setup.
        setup: name of the setup file.
        **fields: properties of the tool to change.

    Returns:
        File of the copy.
    """
    document = osimlite.read_document(folder / setup)
    for field, value in {"results_directory": "results", **fields}.items():
        setattr(document, field, value)
    osimlite.write(document, folder / "setup.xml")
    return folder / "setup.xml"


def change_dynamics_setup(folder: Path, setup: str, **fields: object) -> Path:
    """Write a changed copy of a setup of dynamics of gait10, with all files in one folder.

    Args:
        folder: folder of the setup.
        setup: name of the setup file.
        **fields: further properties of the tool to change.

    Returns:
        File of the copy.
    """
    return change_setup(
        folder,
        setup,
        model_file=GAIT10,
        coordinates_file="subject01_walk_IK.mot",
        external_loads_file="subject01_walk_grf.xml",
        **fields,
    )


def create_cases(folder: Path) -> Iterator[ToolCase]:
    """Write the files of all cases into subfolders.

    Args:
        folder: parent of the subfolders.

    Yields:
        Cases, the first one that of the smallest setup.
    """
    yield create_gait10_kinematics(folder / "ik10")
    yield create_gait2354_kinematics(folder / "ik23")
    if RAJAGOPAL.exists():
        yield create_rajagopal_kinematics(folder / "rajagopal", frames=40)
        yield create_sensor_kinematics(folder / "sensors", frames=100)
    yield create_inverse_dynamics(folder / "id10")
    yield create_static_optimization(folder / "so10")
    yield create_muscle_analysis(folder / "analyses")
    yield create_scaling(folder / "scale")


def create_gait10_kinematics(folder: Path) -> ToolCase:
    """Return the case of inverse kinematics of gait10."""
    unpack(folder, "ik_gait10/walk_Setup_IK.xml", "ik_gait10/*.trc.gz", f"models/{GAIT10}.gz")
    setup = change_setup(
        folder,
        "walk_Setup_IK.xml",
        model_file=GAIT10,
        marker_file="subject01_walk.trc",
        output_motion_file="ik.mot",
    )
    return ToolCase("IK gait10", "InverseKinematicsTool", setup, 10, ("time_range", (0.0, 1.25)))


def create_gait2354_kinematics(folder: Path) -> ToolCase:
    """Return the case of inverse kinematics of gait2354."""
    unpack(folder, "ik_id_gait2354/*_IK.xml", "ik_id_gait2354/*.trc.gz", f"models/{GAIT2354}.gz")
    setup = change_setup(
        folder, "subject01_Setup_IK.xml", model_file=GAIT2354, output_motion_file="ik.mot"
    )
    return ToolCase("IK gait2354", "InverseKinematicsTool", setup, 10, ("time_range", (0.4, 1.0)))


def create_inverse_dynamics(folder: Path) -> ToolCase:
    """Return the case of inverse dynamics of gait10."""
    unpack(folder, "id_gait10/*", "ik_gait10/subject01_walk_IK.mot", f"models/{GAIT10}.gz")
    setup = change_dynamics_setup(folder, "walk_Setup_ID.xml")
    return ToolCase("ID gait10", "InverseDynamicsTool", setup, 10, ("time_range", (0.0, 1.25)))


def create_static_optimization(folder: Path) -> ToolCase:
    """Return the case of static optimization of gait10."""
    unpack(
        folder,
        "so_gait10/*.xml",
        "id_gait10/*_grf.*",
        "ik_gait10/subject01_walk_IK.mot",
        f"models/{GAIT10}.gz",
    )
    setup = change_dynamics_setup(
        folder, "walk_Setup_SO.xml", force_set_files=("gait10dof_Reserve_Actuators.xml",)
    )
    return ToolCase("StaticOptimization gait10", "AnalyzeTool", setup, 20, ("final_time", 1.0))


def create_muscle_analysis(folder: Path) -> ToolCase:
    """Return the case of a muscle analysis of gait10, without the other analyses of its setup."""
    unpack(folder, "analyses_gait10/*", "id_gait10/*_grf.mot.gz", f"models/{GAIT10}.gz")
    shutil.copy(folder / GAIT10, folder / "model.osim")
    setup = change_setup(folder, "an.xml", initial_time=0.3, final_time=1.3)
    document = osimlite.read_document(setup)
    document.analysis_set.objects = [osimlite.MuscleAnalysis(name="MuscleAnalysis")]
    osimlite.write(document, setup)
    return ToolCase("MuscleAnalysis gait10", "AnalyzeTool", setup, 30, ("final_time", 0.8))


def create_scaling(folder: Path) -> ToolCase:
    """Return the case of scaling gait2354."""
    unpack(
        folder,
        "scale_gait2354/*.xml",
        "scale_gait2354/static.trc.gz",
        "scale_gait2354/gait2354.osim.gz",
    )
    return ToolCase("Scale gait2354", "ScaleTool", folder / "scale.xml", 5)


def create_motion(model: osimlite.Model, frames: int) -> RecordedMotion:
    """Return a motion at 100 Hz in which every joint swings and the constraints hold.

    Args:
        model: model that moves.
        frames: number of frames.
    """
    mechanism = osimlite.mechanism(model)
    times = np.linspace(0.0, (frames - 1) / 100.0, frames)
    # Phases that differ keep the coordinates from being proportional to each other.
    columns = [
        info.default_value + 0.15 * np.sin(5.0 * times + index) * (info.motion_type == "rotational")
        for index, info in enumerate(mechanism.coordinates)
    ]
    return RecordedMotion(mechanism, times, np.array(columns).T).assemble_poses()


def create_rajagopal_kinematics(folder: Path, frames: int) -> ToolCase:
    """Return the case of inverse kinematics of Rajagopal2016, whose knees have constraints.

    Args:
        folder: folder to make.
        frames: number of frames of the synthetic motion.
    """
    folder.mkdir()
    model = folder / "model.osim"
    model.write_bytes(gzip.decompress(RAJAGOPAL.read_bytes()))
    motion = create_motion(osimlite.read(model), frames)
    markers = motion.markers()
    noise = np.random.default_rng(1).normal(0.0, MARKER_NOISE, markers.rows.shape)
    names = [column.removesuffix("_X") for column in markers.columns[::3]]
    rows = (markers.rows + noise).tolist()
    write_trc(folder / "trial.trc", motion.times.tolist(), names, rows)
    tool = osimlite.InverseKinematicsTool(
        name="trial",
        model_file="model.osim",
        marker_file="trial.trc",
        output_motion_file="ik.mot",
        # The motion is shorter, so that all frames are used.
        time_range=(0.0, 9.0),
    )
    osimlite.write(tool, folder / "setup.xml")
    # Frames are 0.01 s apart, so that this is half of the motion.
    half = ("time_range", (0.0, 0.005 * frames))
    name = "IK Rajagopal2016, with constraints"
    return ToolCase(name, "InverseKinematicsTool", folder / "setup.xml", 50, half)


def create_sensor_kinematics(folder: Path, frames: int) -> ToolCase:
    """Return the case of inverse kinematics of sensors on all bodies of Rajagopal2016.

    Args:
        folder: folder to make.
        frames: number of frames of the synthetic motion.
    """
    folder.mkdir()
    (folder / "plain.osim").write_bytes(gzip.decompress(RAJAGOPAL.read_bytes()))
    model = osimlite.read(folder / "plain.osim")
    names = [f"{body.name}_imu" for body in model.body_set.objects]
    # Identity rotations: in the default pose, all sensors have the axes of ground.
    place_sensors(model, OrientationData.from_source({name: np.eye(3) for name in names}))
    osimlite.write(model, folder / "model.osim")
    motion = create_motion(model, frames)
    rows = simulate_sensors(motion, names)
    write_sto(folder / "trial.sto", "trial", motion.times.tolist(), names, rows, kind="Quaternion")
    tool = osimlite.IMUInverseKinematicsTool(
        name="trial",
        model_file="model.osim",
        orientations_file="trial.sto",
        results_directory="results",
        # The motion is shorter, so that all frames are used.
        time_range=(0.0, 9.0),
    )
    osimlite.write(tool, folder / "setup.xml")
    # Frames are 0.01 s apart, so that this is half of the motion.
    half = ("time_range", (0.0, 0.005 * frames))
    name = "IMU IK Rajagopal2016, with constraints"
    return ToolCase(name, "IMUInverseKinematicsTool", folder / "setup.xml", 50, half)


def simulate_sensors(motion: RecordedMotion, names: list[str]) -> list[list[float]]:
    """Return the quaternions of sensors with noise in each frame (frames, 4 sensors).

    Args:
        motion: motion of a model with sensors.
        names: names of the frames of the sensors.
    """
    # The seed makes the noise of all runs of this script equal.
    rng = np.random.default_rng(1)
    sensors = {path.rpartition("/")[2]: frame for path, frame in motion.mechanism.frames.items()}
    rows = []
    for q in motion.values:
        state = motion.mechanism.at(q)
        rotations = np.array(
            [
                (state.transform(sensors[name].body) @ sensors[name].transform)[:3, :3]
                for name in names
            ]
        )
        angles = rng.normal(0.0, SENSOR_NOISE, (len(names), 3))
        noise = np.array([rotation_xyz(sensor_angles) for sensor_angles in angles])
        rows.append(quaternion_of(noise @ rotations).ravel().tolist())
    return rows


# ------------------------------------------------------------------------------------------ results
def make_table(rows: list[Row]) -> Table:
    """Return the table of times and speed-ups."""
    table = Table(
        title="OpenSim's tools",
        caption="medians of complete runs; shortest time of an additional frame",
    )
    table.add_column("")
    for column in (
        "osimlite (ms)",
        "OpenSim (ms)",
        "speed-up",
        "one frame: osimlite (ms)",
        "OpenSim (ms)",
        "speed-up",
        "target",
        "",
    ):
        table.add_column(column, justify="right")
    for case, complete, frame in rows:
        complete_speedup = 1.0 / median(complete.ratios)
        speedup = complete_speedup
        frame_cells = ["", "", ""]
        if frame is not None:
            speedup = frame.theirs / frame.ours
            frame_cells = [
                f"{1e3 * frame.ours:.3g}",
                f"{1e3 * frame.theirs:.3g}",
                f"{speedup:.3g}",
            ]
        table.add_row(
            case.name,
            f"{1e3 * median(complete.ours):.4g}",
            f"{1e3 * median(complete.theirs):.4g}",
            f"{complete_speedup:.3g}",
            *frame_cells,
            f"{case.target:g}",
            "reached" if speedup >= case.target else "missed",
        )
    return table


def time_process(case: ToolCase, rounds: int) -> Row:
    """Time complete processes that run a case.

    Args:
        case: case to time.
        rounds: number of timed pairs.
    """
    os.chdir(case.setup.parent)
    script = OPENSIM_SCRIPT.format(tool=case.tool, setup=case.setup.name)
    complete = time_command_pair(
        f"{case.name}, complete process",
        ours=build_command("run", "setup.xml"),
        theirs=[sys.executable, "-c", script],
        rounds=rounds,
    )
    return Row(case._replace(name=complete.name, target=1), complete)


def measure_throughput(case: ToolCase, trials: int, folder: Path) -> str:
    """Return a sentence about the frames per second of many trials in one command.

    Args:
        case: case that is run as every trial.
        trials: number of trials.
        folder: parent of the folders of the trials.
    """
    for index in range(trials):
        trial = folder / f"trial{index:04}"
        trial.mkdir(parents=True)
        for file in case.setup.parent.iterdir():
            if file.is_file():
                # Inputs are only read, so that links are enough.
                (trial / file.name).hardlink_to(file)
    start = time.perf_counter()
    run_command([*build_command("run"), str(folder / "*" / case.setup.name), "--workers", "2"])
    seconds = time.perf_counter() - start
    rate = trials * case.count_frames() / seconds
    return f"{trials} trials of {case.name}: {seconds:.1f} s, {rate:.0f} frames per second"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true", help="time three pairs instead of nine")
    parser.add_argument(
        "--trials", type=int, default=0, metavar="N", help="also run N trials with one command"
    )
    options = parser.parse_args()
    # OpenSim's messages would take time, and hide the table.
    opensim.Logger.setLevelString("off")
    rounds = 3 if options.quick else 9
    console = Console(width=120)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows = [time_case(case, rounds) for case in create_cases(folder)]
        smallest = rows[0].case
        rows.append(time_process(smallest, rounds))
        console.print(make_table(rows))
        if options.trials:
            console.print(measure_throughput(smallest, options.trials, folder / "trials"))
        # The temporary folder cannot be removed while it is the working folder.
        os.chdir("/")


if __name__ == "__main__":
    main()
