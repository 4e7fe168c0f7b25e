"""Setups of OpenSim's tools, run by both in turn: one table of times with what is aimed at.

    python benchmarks/tools.py [--quick] [--trials N]

Models and trials are those of the reference data in the shared folder, and for the constraints of Rajagopal2016 a
motion made here, its markers a centimetre off. What a frame costs is that of the whole tool in a warm process, files
read and written. With --trials N, N trials are run in one command on two workers, and the frames per second are told.
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
from osimlite.simulation.files.recorded import RecordedMotion
from osimlite.simulation.files.trc import write_trc
from validate import whole_process

REFERENCE = CORPUS.parents[1] / "oracle" / "tools" / "reference"
NOISE = 0.01
"""How far the markers are off that are made here, m (root mean square by axis)."""
THEIRS = "import opensim; opensim.Logger.setLevelString('off'); assert opensim.{tool}({setup!r}).run()"


class Case(NamedTuple):
    """A setup, how many frames it has, and how many times OpenSim's speed are asked for."""

    name: str
    tool: str
    setup: Path
    frames: int
    aim: float

    def ours(self) -> object:
        """Run it here."""
        return osimlite.run(self.setup)

    def theirs(self) -> None:
        """Run it in OpenSim, which looks for files from the folder of the setup."""
        os.chdir(self.setup.parent)
        assert getattr(opensim, self.tool)(str(self.setup)).run()


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
    yield Case("IK gait10", "InverseKinematicsTool", setup, 151, 10)
    unpack(place / "ik23", "ik_id_gait2354/*_IK.xml", "ik_id_gait2354/*.trc.gz", f"models/{many}.gz")
    yield Case(
        "IK gait2354",
        "InverseKinematicsTool",
        changed(place / "ik23", "subject01_Setup_IK.xml", model_file=many, output_motion_file="ik.mot"),
        73,
        10,
    )
    if (CORPUS / "m0954.osim.gz").exists():
        yield made(place / "rajagopal", 40)
    unpack(place / "id10", "id_gait10/*", "ik_gait10/subject01_walk_IK.mot", f"models/{ten}.gz")
    yield Case("ID gait10", "InverseDynamicsTool", dynamics(place / "id10", "walk_Setup_ID.xml", ten), 157, 10)
    unpack(place / "analyses", "analyses_gait10/*", "id_gait10/*_grf.mot.gz", f"models/{ten}.gz")
    folder = place / "analyses"
    shutil.copy(folder / ten, folder / "model.osim")
    setup = changed(folder, "an.xml", initial_time=0.3, final_time=1.3)
    document = osimlite.read_document(setup)
    document.analysis_set.objects = [osimlite.MuscleAnalysis(name="MuscleAnalysis")]
    osimlite.write(document, setup)
    yield Case("MuscleAnalysis gait10", "AnalyzeTool", setup, 61, 30)
    unpack(place / "scale", "scale_gait2354/*.xml", "scale_gait2354/static.trc.gz", "scale_gait2354/gait2354.osim.gz")
    yield Case("Scale gait2354", "ScaleTool", place / "scale" / "scale.xml", 1, 5)


def dynamics(folder: Path, setup: str, model: str) -> Path:
    """The setup of inverse dynamics with all its files in one folder."""
    return changed(
        folder,
        setup,
        model_file=model,
        coordinates_file="subject01_walk_IK.mot",
        external_loads_file="subject01_walk_grf.xml",
    )


def made(folder: Path, frames: int) -> Case:
    """Inverse kinematics of a motion of Rajagopal2016, whose knees are constrained."""
    folder.mkdir()
    model = folder / "model.osim"
    model.write_bytes(gzip.decompress((CORPUS / "m0954.osim.gz").read_bytes()))
    mechanism = osimlite.mechanism(osimlite.read(model))
    times = np.linspace(0.0, (frames - 1) / 100.0, frames)
    columns = [
        info.default_value + 0.15 * np.sin(5.0 * times + k) * (info.motion_type == "rotational")
        for k, info in enumerate(mechanism.coordinates)
    ]
    motion = RecordedMotion(mechanism, times, np.array(columns).T).assembled()
    markers = motion.markers()
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
    return Case("IK Rajagopal2016, with constraints", "InverseKinematicsTool", folder / "setup.xml", frames, 50)


def table(rows: list[tuple[Case, Pair]]) -> Table:
    found = Table(title="OpenSim's tools", caption="medians; ratio: OpenSim's time over ours, median of the pairs")
    found.add_column("")
    for column in ("osimlite (ms)", "OpenSim (ms)", "ours (ms a frame)", "times as fast", "aim", ""):
        found.add_column(column, justify="right")
    for case, row in rows:
        ratio, ours = 1.0 / median(row.ratios), 1e3 * median(row.ours)
        found.add_row(
            row.name, f"{ours:.4g}", f"{1e3 * median(row.theirs):.4g}", f"{ours / case.frames:.3g}", f"{ratio:.3g}",
            f"{case.aim:g}", "kept" if ratio >= case.aim else "missed",
        )  # fmt: skip
    return found


def throughput(case: Case, trials: int, place: Path) -> str:
    """Frames per second of many trials of one case in one command."""
    for k in range(trials):
        folder = place / f"trial{k:04}"
        folder.mkdir(parents=True)
        for file in case.setup.parent.iterdir():
            if file.is_file():
                (folder / file.name).hardlink_to(file)
    start = time.perf_counter()
    _run([*whole_process("run"), str(place / "*" / case.setup.name), "--workers", "2"])
    seconds = time.perf_counter() - start
    return f"{trials} trials of {case.name}: {seconds:.1f} s, {trials * case.frames / seconds:.0f} frames per second"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--quick", action="store_true", help="three rounds of each")
    parser.add_argument("--trials", type=int, default=0, metavar="N", help="run N trials in one command too")
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    rounds, rows, console = 3 if options.quick else 9, [], Console(width=120)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        for case in cases(place):
            rows.append((case, pair(case.name, ours=case.ours, theirs=case.theirs, rounds=rounds)))
            console.print(f"[dim]{case.name}", end="\r")
        smallest = rows[0][0]
        os.chdir(smallest.setup.parent)
        command = [sys.executable, "-c", THEIRS.format(tool=smallest.tool, setup=smallest.setup.name)]
        whole = pair_commands(
            f"{smallest.name}, whole process", ours=whole_process("run", "setup.xml"), theirs=command, rounds=rounds
        )
        rows.append((smallest._replace(aim=1), whole))
        console.print(table(rows))
        if options.trials:
            console.print(throughput(smallest, options.trials, place / "trials"))
        os.chdir("/")


if __name__ == "__main__":
    main()
