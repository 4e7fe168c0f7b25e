"""Setups of OpenSim's tools, run by both in turn: one table of times with what is aimed at.

    python benchmarks/tools.py [--quick] [--trials N]

Models and trials are those of the reference data in the shared folder, and for the constraints of
Rajagopal2016 a motion made here, its markers a centimetre off. A whole run reads and checks the
setup and all it names and writes its files, in a warm process; what a frame more costs is found by
running half of them too. With --trials N, N trials are run in one command on two workers, and the
frames per second are told.
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
from _pair import Pair, _run, pair, pair_commands
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.io.tables.storage import write_sto
from osimlite.io.tables.writers import write_trc
from osimlite.mechanics.multibody.spatial import quaternion_of, rotation_xyz
from osimlite.simulation.recorded_motion import RecordedMotion
from validate import build_command

REFERENCE = CORPUS.parents[1] / "oracle" / "tools" / "reference"
NOISE = 0.01
"""How far the markers are off that are made here, m (root mean square by axis)."""
THEIRS = (
    "import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}({setup!r}).run()"
)


class Case(NamedTuple):
    """A setup, how many times OpenSim's speed are asked for, and what to set it to for half of its frames."""

    name: str
    tool: str
    setup: Path
    aim: float
    half: tuple[str, object] | None = None

    def ours(self) -> object:
        """Run it here."""
        return osimlite.run(self.setup)

    def theirs(self) -> None:
        """Run it in OpenSim, which looks for files from the folder of the setup."""
        os.chdir(self.setup.parent)
        assert getattr(opensim, self.tool)(str(self.setup)).run()

    def frames(self) -> int:
        """How many there are."""
        return len(next(iter(osimlite.run(self.setup).tables.values())).times)

    def shorter(self) -> Case:
        """The case with half of the frames."""
        assert self.half is not None
        setup = self.setup.with_name("half.xml")
        document = osimlite.read_document(self.setup)
        setattr(document, *self.half)
        osimlite.write(document, setup)
        return self._replace(setup=setup, half=None)


class Row(NamedTuple):
    """Times of whole runs, and of one frame more (s) here and in OpenSim."""

    case: Case
    whole: Pair
    frame: tuple[float, float] | None = None


def timed(case: Case, rounds: int) -> Row:
    """Time a case, and the half of it."""
    whole = pair(case.name, ours=case.ours, theirs=case.theirs, rounds=rounds)
    if case.half is None:
        return Row(case, whole)
    short = case.shorter()
    half = pair(case.name, ours=short.ours, theirs=short.theirs, rounds=rounds)
    more = case.frames() - short.frames()
    ours, theirs = (
        (min(getattr(whole, k)) - min(getattr(half, k))) / more for k in ("ours", "theirs")
    )
    return Row(case, whole, (ours, theirs))


def unpack(folder: Path, *sources: str) -> None:
    """Put files of the reference data into one folder."""
    folder.mkdir()
    for source in sources:
        for file in sorted(REFERENCE.glob(source)):
            content = file.read_bytes()
            if file.suffix == ".gz":
                content = gzip.decompress(content)
            (folder / file.name.removesuffix(".gz")).write_bytes(content)


def changed(folder: Path, setup: str, **fields: object) -> Path:
    """A setup of the folder with other files; its results go into the folder "results"."""
    document = osimlite.read_document(folder / setup)
    for field, value in {"results_directory": "results", **fields}.items():
        setattr(document, field, value)
    osimlite.write(document, folder / "setup.xml")
    return folder / "setup.xml"


def cases(place: Path) -> Iterator[Case]:
    """All that is timed; the files are put into folders of a place."""
    ten, many = "gait10_subject01.osim", "gait2354_subject01_simbody.osim"
    unpack(place / "ik10", "ik_gait10/walk_Setup_IK.xml", "ik_gait10/*.trc.gz", f"models/{ten}.gz")
    setup = changed(
        place / "ik10",
        "walk_Setup_IK.xml",
        model_file=ten,
        marker_file="subject01_walk.trc",
        output_motion_file="ik.mot",
    )
    yield Case("IK gait10", "InverseKinematicsTool", setup, 10, ("time_range", (0.0, 1.25)))
    unpack(
        place / "ik23", "ik_id_gait2354/*_IK.xml", "ik_id_gait2354/*.trc.gz", f"models/{many}.gz"
    )
    yield Case(
        "IK gait2354",
        "InverseKinematicsTool",
        changed(
            place / "ik23", "subject01_Setup_IK.xml", model_file=many, output_motion_file="ik.mot"
        ),
        10,
        ("time_range", (0.4, 1.0)),
    )
    if (CORPUS / "m0954.osim.gz").exists():
        yield made(place / "rajagopal", 40)
        yield worn(place / "sensors", 100)
    unpack(place / "id10", "id_gait10/*", "ik_gait10/subject01_walk_IK.mot", f"models/{ten}.gz")
    setup = dynamics(place / "id10", "walk_Setup_ID.xml", ten)
    yield Case("ID gait10", "InverseDynamicsTool", setup, 10, ("time_range", (0.0, 1.25)))
    unpack(
        place / "so10",
        "so_gait10/*.xml",
        "id_gait10/*_grf.*",
        "ik_gait10/subject01_walk_IK.mot",
        f"models/{ten}.gz",
    )
    setup = dynamics(
        place / "so10",
        "walk_Setup_SO.xml",
        ten,
        force_set_files=("gait10dof_Reserve_Actuators.xml",),
    )
    yield Case("StaticOptimization gait10", "AnalyzeTool", setup, 20, ("final_time", 1.0))
    unpack(place / "analyses", "analyses_gait10/*", "id_gait10/*_grf.mot.gz", f"models/{ten}.gz")
    folder = place / "analyses"
    shutil.copy(folder / ten, folder / "model.osim")
    setup = changed(folder, "an.xml", initial_time=0.3, final_time=1.3)
    document = osimlite.read_document(setup)
    document.analysis_set.objects = [osimlite.MuscleAnalysis(name="MuscleAnalysis")]
    osimlite.write(document, setup)
    yield Case("MuscleAnalysis gait10", "AnalyzeTool", setup, 30, ("final_time", 0.8))
    unpack(
        place / "scale",
        "scale_gait2354/*.xml",
        "scale_gait2354/static.trc.gz",
        "scale_gait2354/gait2354.osim.gz",
    )
    yield Case("Scale gait2354", "ScaleTool", place / "scale" / "scale.xml", 5)


def dynamics(folder: Path, setup: str, model: str, **more: object) -> Path:
    """The setup of inverse dynamics with all its files in one folder."""
    return changed(
        folder,
        setup,
        model_file=model,
        coordinates_file="subject01_walk_IK.mot",
        external_loads_file="subject01_walk_grf.xml",
        **more,
    )


def swung(model: osimlite.Model, frames: int) -> RecordedMotion:
    """A motion in which every joint swings, at 100 Hz, and the constraints hold."""
    mechanism = osimlite.mechanism(model)
    times = np.linspace(0.0, (frames - 1) / 100.0, frames)
    columns = [
        info.default_value + 0.15 * np.sin(5.0 * times + k) * (info.motion_type == "rotational")
        for k, info in enumerate(mechanism.coordinates)
    ]
    return RecordedMotion(mechanism, times, np.array(columns).T).assembled()


def worn(folder: Path, frames: int) -> Case:
    """Inverse kinematics of sensors on all bodies of Rajagopal2016, five degrees off."""
    folder.mkdir()
    (folder / "plain.osim").write_bytes(gzip.decompress((CORPUS / "m0954.osim.gz").read_bytes()))
    model = osimlite.read(folder / "plain.osim")
    names = [f"{body.name}_imu" for body in model.body_set.objects]
    place_sensors(model, OrientationData.from_source({name: np.eye(3) for name in names}))
    osimlite.write(model, folder / "model.osim")
    motion, rng = swung(model, frames), np.random.default_rng(1)
    placed = {path.rpartition("/")[2]: frame for path, frame in motion.mechanism.frames.items()}
    rows = []
    for q in motion.values:
        state = motion.mechanism.at(q)
        found = np.array(
            [
                (state.transform(placed[name].body) @ placed[name].transform)[:3, :3]
                for name in names
            ]
        )
        off = np.array(
            [rotation_xyz(angles) for angles in rng.normal(0.0, np.deg2rad(5.0), (len(names), 3))]
        )
        rows.append(quaternion_of(off @ found).ravel().tolist())
    write_sto(folder / "trial.sto", "trial", motion.times.tolist(), names, rows, kind="Quaternion")
    tool = osimlite.IMUInverseKinematicsTool(
        name="trial",
        model_file="model.osim",
        orientations_file="trial.sto",
        results_directory="results",
        time_range=(0.0, 9.0),
    )
    osimlite.write(tool, folder / "setup.xml")
    return Case(
        "IMU IK Rajagopal2016, with constraints",
        "IMUInverseKinematicsTool",
        folder / "setup.xml",
        50,
        ("time_range", (0.0, 0.005 * frames)),
    )


def made(folder: Path, frames: int) -> Case:
    """Inverse kinematics of a motion of Rajagopal2016, whose knees are constrained."""
    folder.mkdir()
    model = folder / "model.osim"
    model.write_bytes(gzip.decompress((CORPUS / "m0954.osim.gz").read_bytes()))
    motion = swung(osimlite.read(model), frames)
    times, markers = motion.times, motion.markers()
    noisy = markers.rows + np.random.default_rng(1).normal(0.0, NOISE, markers.rows.shape)
    names = [column.removesuffix("_X") for column in markers.columns[::3]]
    write_trc(folder / "trial.trc", times.tolist(), names, noisy.tolist())
    tool = osimlite.InverseKinematicsTool(
        name="trial",
        model_file="model.osim",
        marker_file="trial.trc",
        output_motion_file="ik.mot",
        time_range=(0.0, 9.0),
    )
    osimlite.write(tool, folder / "setup.xml")
    return Case(
        "IK Rajagopal2016, with constraints",
        "InverseKinematicsTool",
        folder / "setup.xml",
        50,
        ("time_range", (0.0, 0.005 * frames)),
    )


def table(rows: list[Row]) -> Table:
    caption = "medians of whole runs; the least of a frame more; times as fast as OpenSim"
    made = Table(title="OpenSim's tools", caption=caption)
    made.add_column("")
    for column in (
        "osimlite (ms)",
        "OpenSim (ms)",
        "faster",
        "a frame: ours",
        "OpenSim",
        "faster",
        "aim",
        "",
    ):
        made.add_column(column, justify="right")
    for case, whole, frame in rows:
        faster = 1.0 / median(whole.ratios)
        cells = ["", "", ""]
        if frame is not None:
            faster = frame[1] / frame[0]
            cells = [f"{1e3 * frame[0]:.3g}", f"{1e3 * frame[1]:.3g}", f"{faster:.3g}"]
        made.add_row(
            case.name, f"{1e3 * median(whole.ours):.4g}", f"{1e3 * median(whole.theirs):.4g}",
            f"{1.0 / median(whole.ratios):.3g}", *cells, f"{case.aim:g}", "kept" if faster >= case.aim else "missed",
        )  # fmt: skip
    return made


def throughput(case: Case, trials: int, place: Path) -> str:
    """Frames per second of many trials of one case in one command."""
    for k in range(trials):
        folder = place / f"trial{k:04}"
        folder.mkdir(parents=True)
        for file in case.setup.parent.iterdir():
            if file.is_file():
                (folder / file.name).hardlink_to(file)
    start = time.perf_counter()
    _run([*build_command("run"), str(place / "*" / case.setup.name), "--workers", "2"])
    seconds = time.perf_counter() - start
    return f"{trials} trials of {case.name}: {seconds:.1f} s, {trials * case.frames() / seconds:.0f} frames per second"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true", help="three rounds of each")
    parser.add_argument(
        "--trials", type=int, default=0, metavar="N", help="run N trials in one command too"
    )
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    rounds, rows, console = 3 if options.quick else 9, [], Console(width=120)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        for case in cases(place):
            rows.append(timed(case, rounds))
        smallest = rows[0].case
        os.chdir(smallest.setup.parent)
        command = [
            sys.executable,
            "-c",
            THEIRS.format(tool=smallest.tool, setup=smallest.setup.name),
        ]
        whole = pair_commands(
            f"{smallest.name}, whole process",
            ours=build_command("run", "setup.xml"),
            theirs=command,
            rounds=rounds,
        )
        rows.append(Row(smallest._replace(name=whole.name, aim=1), whole))
        console.print(table(rows))
        if options.trials:
            console.print(throughput(smallest, options.trials, place / "trials"))
        os.chdir("/")


if __name__ == "__main__":
    main()
