"""Speed of OpenSim's tools in osimlite, compared with OpenSim itself and with targets.

    python benchmarks/tools.py [--quick] [--trials N]

The programs run the same setup files in turn. A complete run reads and checks the setup and all
files that it names, and writes its results, in a process that has loaded its libraries. The time of
an additional frame follows from a second run with half of the frames. These are processor times. In
the last row complete processes are compared, in wall-clock time. Models and trials are those of the
reference data in the shared folder; inverse kinematics with constraints uses a synthetic motion of
Rajagopal2016.

The table has the medians of complete runs, the shortest times per additional frame, the speed-ups
(OpenSim's time divided by osimlite's), the target of the speed-up, and whether it is reached. The
target is for additional frames if half of the frames are run too. If noise hides the time of an
additional frame, the table has question marks. With ``--trials N``, N trials are run by one command
with two workers, and the frames per second are printed.
"""

from __future__ import annotations

import argparse
import gc
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import NamedTuple

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, REFERENCE, unpack_file, unpack_files
from _pair import Pair, measure_time, run_command, time_command_pair, use_one_blas_thread
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.io.tables.storage import write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.spatial import quaternion_of, rotation_xyz
from osimlite.simulation.recorded_motion import RecordedMotion
from validate import build_command

GAIT10 = "gait10_subject01.osim"
GAIT2354 = "gait2354_subject01_simbody.osim"
RAJAGOPAL = CORPUS / "m0954.osim.gz"

GAIT10_DYNAMICS = {
    "model_file": GAIT10,
    "coordinates_file": "subject01_walk_IK.mot",
    "external_loads_file": "subject01_walk_grf.xml",
}
"""Properties of setups of dynamics of gait10 whose files are all in one folder."""

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


def measure_run(run: Callable[[], object]) -> float:
    """Return the processor time of one run (s)."""
    # Otherwise some runs would also collect the garbage of others, which takes as long as a run.
    gc.collect()
    return measure_time(run, time.process_time)


def time_case(case: ToolCase, rounds: int) -> Row:
    """Time a case, and the time of an additional frame if half of its frames can be run.

    Args:
        case: case to time.
        rounds: number of timed runs of each program.
    """
    cases = [case] if case.half is None else [case, case.create_half()]
    runs = [run for each in cases for run in (each.run_osimlite, each.run_opensim)]
    # All runs take turns, so that they meet the same machine. The first round is the warm-up.
    rows = [[measure_run(run) for run in runs] for _ in range(1 + rounds)]
    ours, theirs, *half_times = zip(*rows[1:], strict=True)
    complete = Pair(case.name, ours, theirs)
    if not half_times:
        return Row(case, complete)
    half_ours, half_theirs = half_times
    complete_count, half_count = (each.count_frames() for each in cases)
    frame_count = complete_count - half_count
    # The difference of medians would be noisier: other work only makes runs slower.
    frame = FrameTimes(
        (min(ours) - min(half_ours)) / frame_count, (min(theirs) - min(half_theirs)) / frame_count
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
        unpack_files(REFERENCE.glob(pattern), folder)


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
    setup = change_setup(folder, "walk_Setup_ID.xml", **GAIT10_DYNAMICS)
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
    setup = change_setup(
        folder,
        "walk_Setup_SO.xml",
        force_set_files=("gait10dof_Reserve_Actuators.xml",),
        **GAIT10_DYNAMICS,
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
    model = osimlite.read(unpack_file(RAJAGOPAL, folder / "model.osim"))
    motion = create_motion(model, frames)
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
    model = osimlite.read(unpack_file(RAJAGOPAL, folder / "plain.osim"))
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
        verdict = "reached" if complete_speedup >= case.target else "missed"
        frame_cells = ["", "", ""]
        if frame is not None and min(frame) <= 0.0:
            frame_cells = ["?", "?", "?"]
            verdict = "unknown"
        elif frame is not None:
            speedup = frame.theirs / frame.ours
            verdict = "reached" if speedup >= case.target else "missed"
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
            verdict,
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
    parser.add_argument("--quick", action="store_true", help="time three rounds instead of nine")
    parser.add_argument(
        "--trials", type=int, default=0, metavar="N", help="also run N trials with one command"
    )
    options = parser.parse_args()
    use_one_blas_thread()
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
