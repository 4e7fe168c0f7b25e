"""Public setups of scaling and inverse kinematics, and published motions of people, here and in OpenSim.

    python benchmarks/public_fits.py setups FOLDER...
    python benchmarks/public_fits.py people FOLDER...

Setups are all below a folder, which is copied first; OpenSim runs them with an accuracy of 1e-9,
and with a larger one where that takes too long. A folder of people has `hand_scaled.osim` and
trials, `NAME.trc` and what was published of it, `NAME.mot`, as AddBiomechanics has them; there all
markers weigh the same, and OpenSim has its default accuracy.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import osimlite
from osimlite.errors import OsimliteError
from osimlite.fitting.fitted_motion import FittedMotion
from osimlite.fitting.ik_tool import collect_targets, run_inverse_kinematics
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.scale_tool import compute_scaled_model
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.constraints import Lock
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.base import Object

SECONDS, FRAMES = 150, 150
"""How long OpenSim may run, and how many frames are compared at most."""
TRIES = (FRAMES, 1e-9), (10, 1e-9), (FRAMES, 1e-6), (FRAMES, 1e-4)
"""Frames and accuracies, of which the first that OpenSim comes to an end with counts."""
RUN = """import opensim, time
opensim.Logger.setLevelString("Off")
start = time.process_time()
opensim.{}({!r}).run()
print(time.process_time() - start)
"""


def opensim_runs(tool: Any, setup: Path, seconds: float = SECONDS) -> float | None:
    """Let OpenSim run a setup in its folder: processor seconds, None if it crashes or does not come to an end."""
    command = [sys.executable, "-c", RUN.format(type(tool).__name__, setup.name)]
    try:
        done = subprocess.run(
            command, cwd=setup.parent, capture_output=True, text=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return None
    return None if done.returncode else float(done.stdout.split()[-1])


def poses_of(motion: FittedMotion, table: StoTable) -> Array:
    """The poses (t, n) of a file in degrees, rad and m."""
    rows = np.column_stack([table[name] for name in motion.coordinates])
    return np.where(turning(motion), np.deg2rad(rows), rows)


def turning(motion: FittedMotion) -> Array:
    """Which coordinates are angles."""
    return np.array([info.motion_type == "rotational" for info in motion.mechanism.coordinates])


def degrees(motion: FittedMotion, apart: Array) -> Array:
    """Differences (t, n) of the angles alone."""
    return np.asarray(np.rad2deg(apart[:, turning(motion)]))


def errors(motion: FittedMotion, poses: Array, frames: Iterable[int]) -> Array:
    """How far the markers of poses are from where they were measured in some frames (t, m), m."""
    assert motion.model is not None
    stations, rows = find_marker_stations(motion.model, motion.mechanism), []
    for q, frame in zip(poses, frames, strict=True):
        state = motion.mechanism.at(q)
        rows.append(
            np.array([state.point(*stations[name]) for name in motion.markers])
            - motion.measured[frame]
        )
    return np.asarray(np.linalg.norm(rows, axis=2))


def costs(motion: FittedMotion, tasks: Any, poses: Array) -> Array:
    """What inverse kinematics minimises, in poses (t, n) that were found elsewhere."""
    assert motion.model is not None
    data, infos = (
        MarkerData(motion.markers, motion.times, motion.measured),
        motion.mechanism.coordinates,
    )
    asked = collect_targets(motion.model, motion.mechanism, tasks, data, None)
    squares = errors(motion, poses, range(len(poses))) ** 2
    weights = np.where(np.isfinite(squares), [asked.weights[name] for name in motion.markers], 0.0)
    found = np.sum(weights * np.nan_to_num(squares), axis=1) / weights.sum(axis=1)
    for goal, wanted in zip(asked.goals, asked.wanted.T, strict=True):
        if not infos[goal.coordinate].locked:
            found += goal.weight * (poses[:, goal.coordinate] - wanted) ** 2
    return np.asarray(0.5 * found)


def kinematics(tool: Any, setup: Path) -> Iterator[str]:
    """How the motions differ."""
    model = osimlite.read(setup.parent / tool.model_file.strip())
    data = MarkerData.from_source(setup.parent / tool.marker_file.strip())
    whole = run_inverse_kinematics(tool, model, data)
    yield f"{len(whole.times)} frames, {len(whole.unsettled)} unsettled"
    theirs, first = setup.with_name("theirs.xml"), tool.time_range[0]
    tool.output_motion_file, tool.results_directory, tool.report_errors = "theirs.mot", ".", False
    for count, accuracy in TRIES:
        tool.time_range, tool.accuracy = (first, float(whole.times[:count][-1])), accuracy
        osimlite.write(tool, theirs)
        if opensim_runs(tool, theirs) is not None:
            break
    else:
        yield "OpenSim does not come to an end"
        return
    ours = run_inverse_kinematics(tool, model, data)
    poses = poses_of(ours, read_sto(theirs.with_name("theirs.mot")))
    apart = np.abs(ours.values - poses)
    frame, place = np.unravel_index(apart.argmax(), apart.shape)
    off = degrees(ours, apart).max(axis=1)
    yield f"{len(poses)} compared at {accuracy:g}"
    yield f"{off.max():.1e} deg at most, {np.median(off):.1e} in the median ({ours.coordinates[place]}, frame {frame})"
    # OpenSim's constraints hold to a tenth of the accuracy, ours to rounding: pull its poses onto
    # them.
    if any(not isinstance(item, Lock) for item in ours.mechanism.constraints):
        poses = np.array([ours.mechanism.assemble(q) for q in poses])
    more = ours.costs - costs(ours, tool.ik_task_set.objects, poses)
    yield f"cost of {np.median(ours.costs):.1e} larger by {more.max():.1e} at most, smaller by {-more.min():.1e}"
    infos = enumerate(ours.mechanism.coordinates)
    ranges = [(place, *info.range) for place, info in infos if info.clamped and not info.locked]
    ends = [
        np.abs(ours.values[:, [place]] - (low, high)).min(axis=1) < 1e-9
        for place, low, high in ranges
    ]
    yield f"clamped coordinates at an end in {int(np.any(ends, axis=0).sum()) if ends else 0} frames"


def numbers_of(item: Object, path: str = "") -> dict[str, Any]:
    """Every value of an object and of all that it holds, by where it is."""
    found: dict[str, Any] = {path: type(item).__name__}
    for spec in type(item).field_specs().values():
        value, place = getattr(item, spec.name), f"{path}/{spec.name}"
        for number, one in enumerate(value if isinstance(value, list) else [value]):
            found |= (
                numbers_of(one, f"{place}[{number}]") if isinstance(one, Object) else {place: one}
            )
    return found


def otherwise(ours: Object, theirs: Object) -> list[str]:
    """Where models differ by more than 1e-9, of points of splines 1e-5: OpenSim prints six digits of these."""
    one, other = numbers_of(ours), numbers_of(theirs)
    wrong = [
        f"{key} is only {'here' if key in one else 'there'}" for key in one.keys() ^ other.keys()
    ]
    for key in one.keys() & other.keys():
        a, b = one[key], other[key]
        numbers = isinstance(b, float) or (isinstance(b, tuple) and b and isinstance(b[0], float))
        nearly = 1e-5 if key.endswith(("/x", "/y")) else 1e-9
        if not (np.allclose(a, b, rtol=nearly, atol=1e-12, equal_nan=True) if numbers else a == b):
            wrong.append(f"{key}: {a!r} and {b!r}")
    return sorted(item for item in wrong if "/socket_frame" not in item)


def scaling(tool: Any, setup: Path) -> Iterator[str]:
    """How the scaled models and the static poses differ."""
    found = compute_scaled_model(tool, setup.parent)
    if opensim_runs(tool, setup) is None:
        yield "OpenSim does not come to an end"
        return
    for name, text in found.texts.items():
        theirs = setup.parent / name.strip()
        if theirs.suffix == ".osim":
            wrong = otherwise(osimlite.read_text(text), osimlite.read(theirs))
            rest = [item for item in wrong if "marker_set" not in item or "/location" not in item]
            yield f"{theirs.name}: {len(wrong) - len(rest)} markers elsewhere, {len(rest)} other differences"
            yield from rest[:4]
    file = setup.parent / tool.marker_placer.output_motion_file.strip()
    if found.placed is not None and file.is_file():
        pose, table = found.placed.pose, read_sto(file)
        q = np.array([table[f"{info.path}/value"][0] for info in pose.mechanism.coordinates])
        (theirs_cost,) = costs(pose, tool.marker_placer.ik_task_set.objects, q[None])
        yield f"static pose: cost {pose.costs[0]:.5e}, OpenSim's {theirs_cost:.5e}"


def setups(folder: Path) -> Iterator[str]:
    """One line for each setup, those of scaling first: the others may need their models."""
    with TemporaryDirectory() as place:
        copy, found = shutil.copytree(folder, Path(place) / folder.name), []
        for path in sorted(copy.rglob("*.xml")):
            try:
                tool = osimlite.read_document(path)
            except OsimliteError:
                continue
            if isinstance(tool, osimlite.ScaleTool | osimlite.InverseKinematicsTool):
                found.append((isinstance(tool, osimlite.InverseKinematicsTool), path, tool))
        for fits, path, tool in sorted(found, key=lambda item: item[:2]):
            try:
                told = list((kinematics if fits else scaling)(tool, path))
            except OsimliteError as error:
                told = [str(error).replace(place, "")]
            yield f"{path.relative_to(place)}: {'; '.join(told)}"


def people(folder: Path) -> Iterator[str]:
    """A row for each trial: root mean square of the marker errors in the frames that were published."""
    yield "| trial | frames | osimlite | published | OpenSim | osimlite | OpenSim |\n|---|---|---|---|---|---|---|"
    with TemporaryDirectory() as place:
        copy = shutil.copytree(folder, Path(place) / "copy")
        model = osimlite.read(copy / "hand_scaled.osim")
        for trial in sorted(copy.glob("*.trc")):
            osimlite.inverse_kinematics(model, trial)
            start = time.process_time()
            motion = osimlite.inverse_kinematics(model, trial)
            seconds = time.process_time() - start
            tool = osimlite.InverseKinematicsTool(
                model_file="hand_scaled.osim", marker_file=trial.name, output_motion_file="theirs.mot",
                time_range=(-1e9, 1e9), report_errors=False,
            )  # fmt: skip
            osimlite.write(tool, copy / "theirs.xml")
            theirs = opensim_runs(tool, copy / "theirs.xml", 10 * SECONDS)
            published, counted = trial.with_suffix(".mot"), np.arange(len(motion.times))
            told = ["", ""]
            if published.exists():
                table = read_sto(published)
                counted = np.searchsorted(motion.times, table.times - 1e-6)
                told[0] = millimetres(errors(motion, poses_of(motion, table), counted))
            if theirs is not None:
                poses = poses_of(motion, read_sto(copy / "theirs.mot"))[counted]
                told[1] = millimetres(errors(motion, poses, counted))
            ours = millimetres(motion.marker_errors[counted])
            yield (
                f"| {trial.stem} | {len(counted)} of {len(motion.times)} | {ours} | {' | '.join(told)} | "
                f"{seconds:.3f} s | {theirs or np.nan:.1f} s |"
            )


def millimetres(distances: Array) -> str:
    """Root mean square of distances, m, that are known."""
    return f"{1e3 * np.sqrt(np.nanmean(distances**2)):.2f} mm"


if __name__ == "__main__":
    if sys.argv[1:2] not in (["setups"], ["people"]):
        sys.exit(__doc__)
    for name in sys.argv[2:]:
        for line in (setups if sys.argv[1] == "setups" else people)(Path(name)):
            print(line, flush=True)
