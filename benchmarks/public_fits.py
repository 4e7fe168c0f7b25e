"""Scaling and inverse kinematics on public data: osimlite, OpenSim, and published results.

    python benchmarks/public_fits.py setups FOLDER...
    python benchmarks/public_fits.py people FOLDER...

*setups* runs all setups of ScaleTool and InverseKinematicsTool in a copy of each folder with both
programs, and prints one line for each: how the scaled models, static poses and motions differ.
OpenSim runs inverse kinematics with an accuracy of 1e-9, or with a larger one if that takes too
long. Costs are the objective that inverse kinematics minimizes; a positive difference means that
osimlite's is larger.

*people* needs folders as AddBiomechanics publishes them, with `hand_scaled.osim` and trials
`NAME.trc`, and published coordinates in `NAME.mot`. It prints a table in Markdown with the root
mean square of the marker errors (mm) in the published frames, and the processor times. All markers
have the same weight, and OpenSim has its default accuracy.
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
from _pair import use_one_blas_thread
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

TIME_LIMIT = 150
"""Time that OpenSim has for one setup (s)."""

MAX_FRAMES = 150
"""Number of frames that are compared at most."""

# Not every setup ends in time with all frames and the best accuracy.
ATTEMPTS = ((MAX_FRAMES, 1e-9), (10, 1e-9), (MAX_FRAMES, 1e-6), (MAX_FRAMES, 1e-4))
"""Frames and accuracies of OpenSim in the order of attempts; the first that ends in time counts."""

OPENSIM_SCRIPT = """import opensim, time
opensim.Logger.setLevelString("Off")
start = time.process_time()
opensim.{}({!r}).run()
print(time.process_time() - start)
"""

# OpenSim prints the points of splines with six digits, and other numbers with more.
SPLINE_TOLERANCE = 1e-5
"""Relative difference of points of splines that counts as equal."""

NUMBER_TOLERANCE = 1e-9
"""Relative difference of other numbers that counts as equal."""

MAX_SHOWN_DIFFERENCES = 4
"""Number of differences of two models that are printed in full."""


def run_in_opensim(tool: Any, setup: Path, seconds: float = TIME_LIMIT) -> float | None:
    """Run a setup in OpenSim.

    Args:
        tool: tool of the setup.
        setup: setup file, whose folder is the working folder.
        seconds: time limit (s).

    Returns:
        Processor time (s), or None if OpenSim crashes or does not finish in time.
    """
    command = [sys.executable, "-c", OPENSIM_SCRIPT.format(type(tool).__name__, setup.name)]
    try:
        done = subprocess.run(
            command, cwd=setup.parent, capture_output=True, text=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return None
    return None if done.returncode else float(done.stdout.split()[-1])


def read_poses(motion: FittedMotion, table: StoTable) -> Array:
    """Return the poses (frames, coordinates), rad and m, of a table in degrees and m.

    Args:
        motion: motion whose coordinates are read.
        table: table of coordinates.
    """
    rows = np.column_stack([table[name] for name in motion.coordinates])
    return np.where(find_angles(motion), np.deg2rad(rows), rows)


def find_angles(motion: FittedMotion) -> Array:
    """Return which coordinates are angles, booleans (coordinates,)."""
    return np.array([info.motion_type == "rotational" for info in motion.mechanism.coordinates])


def select_angles(motion: FittedMotion, differences: Array) -> Array:
    """Return the angles, in degrees, of differences (frames, coordinates) in rad and m."""
    return np.asarray(np.rad2deg(differences[:, find_angles(motion)]))


def compute_marker_errors(motion: FittedMotion, poses: Array, frames: Iterable[int]) -> Array:
    """Return the distances of markers from their measured positions (frames, markers), m.

    Args:
        motion: motion that has the model and the measured positions.
        poses: poses (frames, coordinates), rad and m.
        frames: index of the measured frame of each pose.
    """
    assert motion.model is not None
    stations = find_marker_stations(motion.model, motion.mechanism)
    rows = []
    for q, frame in zip(poses, frames, strict=True):
        state = motion.mechanism.at(q)
        positions = np.array([state.point(*stations[name]) for name in motion.markers])
        rows.append(positions - motion.measured[frame])
    return np.asarray(np.linalg.norm(rows, axis=2))


def compute_costs(motion: FittedMotion, tasks: Any, poses: Array) -> Array:
    """Return the objective of inverse kinematics (frames,) in poses of another program.

    Args:
        motion: motion that has the model and the measured positions.
        tasks: tasks of the setup.
        poses: poses (frames, coordinates), rad and m.
    """
    assert motion.model is not None
    infos = motion.mechanism.coordinates
    data = MarkerData(motion.markers, motion.times, motion.measured)
    targets = collect_targets(motion.model, motion.mechanism, tasks, data, None)
    squares = compute_marker_errors(motion, poses, range(len(poses))) ** 2
    marker_weights = [targets.weights[name] for name in motion.markers]
    # As in OpenSim, a marker without a measured position has no weight in that frame.
    weights = np.where(np.isfinite(squares), marker_weights, 0.0)
    costs = np.sum(weights * np.nan_to_num(squares), axis=1) / weights.sum(axis=1)
    for goal, target in zip(targets.goals, targets.target_values.T, strict=True):
        if not infos[goal.coordinate].locked:
            costs += goal.weight * (poses[:, goal.coordinate] - target) ** 2
    return np.asarray(0.5 * costs)


def compare_inverse_kinematics(tool: Any, setup: Path) -> Iterator[str]:
    """Run a setup of inverse kinematics with both programs.

    Args:
        tool: tool of the setup; it is changed.
        setup: setup file.

    Yields:
        Sentences about the differences of the motions.
    """
    model = osimlite.read(setup.parent / tool.model_file.strip())
    data = MarkerData.from_source(setup.parent / tool.marker_file.strip())
    complete = run_inverse_kinematics(tool, model, data)
    yield f"{len(complete.times)} frames, {len(complete.unsettled)} not converged"
    opensim_setup = setup.with_name("theirs.xml")
    first = tool.time_range[0]
    tool.output_motion_file = "theirs.mot"
    tool.results_directory = "."
    tool.report_errors = False
    for count, accuracy in ATTEMPTS:
        tool.time_range = (first, float(complete.times[:count][-1]))
        tool.accuracy = accuracy
        osimlite.write(tool, opensim_setup)
        if run_in_opensim(tool, opensim_setup) is not None:
            break
    else:
        yield "OpenSim does not finish"
        return
    ours = run_inverse_kinematics(tool, model, data)
    poses = read_poses(ours, read_sto(opensim_setup.with_name("theirs.mot")))
    differences = np.abs(ours.values - poses)
    frame, index = np.unravel_index(differences.argmax(), differences.shape)
    angles = select_angles(ours, differences).max(axis=1)
    yield f"{len(poses)} frames compared at accuracy {accuracy:g}"
    yield (
        f"angles differ by at most {angles.max():.1e} deg, median {np.median(angles):.1e} "
        f"({ours.coordinates[index]}, frame {frame})"
    )
    # OpenSim's constraints hold to a tenth of the accuracy, osimlite's to rounding. Assemble
    # OpenSim's poses, because violated constraints would make their cost smaller.
    if any(not isinstance(item, Lock) for item in ours.mechanism.constraints):
        poses = np.array([ours.mechanism.assemble(q) for q in poses])
    excess = ours.costs - compute_costs(ours, tool.ik_task_set.objects, poses)
    yield (
        f"cost of {np.median(ours.costs):.1e} larger by at most {excess.max():.1e}, "
        f"smaller by at most {-excess.min():.1e}"
    )
    yield f"clamped coordinates at a bound in {count_frames_at_bounds(ours)} frames"


def count_frames_at_bounds(motion: FittedMotion) -> int:
    """Return the number of frames in which a clamped coordinate is at an end of its range."""
    is_at_bound = [
        np.abs(motion.values[:, [index]] - info.range).min(axis=1) < 1e-9
        for index, info in enumerate(motion.mechanism.coordinates)
        if info.clamped and not info.locked
    ]
    return int(np.any(is_at_bound, axis=0).sum()) if is_at_bound else 0


def collect_values(item: Object, path: str = "") -> dict[str, Any]:
    """Collect every value of an object and of its components.

    Args:
        item: object to examine.
        path: path of the object.

    Returns:
        Values by their path; of an object, the name of its class.
    """
    values: dict[str, Any] = {path: type(item).__name__}
    for spec in type(item).field_specs().values():
        field_path = f"{path}/{spec.name}"
        value = getattr(item, spec.name)
        for number, element in enumerate(value if isinstance(value, list) else [value]):
            if isinstance(element, Object):
                values |= collect_values(element, f"{field_path}[{number}]")
            else:
                values[field_path] = element
    return values


def compare_models(ours: Object, theirs: Object) -> list[str]:
    """Return the differences of two models that are larger than the digits of OpenSim's files."""
    our_values = collect_values(ours)
    their_values = collect_values(theirs)
    differences = [
        f"{key} is only in the model of {'osimlite' if key in our_values else 'OpenSim'}"
        for key in our_values.keys() ^ their_values.keys()
    ]
    for key in our_values.keys() & their_values.keys():
        a = our_values[key]
        b = their_values[key]
        tolerance = SPLINE_TOLERANCE if key.endswith(("/x", "/y")) else NUMBER_TOLERANCE
        is_number = isinstance(a, float) or (isinstance(a, tuple) and a and isinstance(a[0], float))
        if is_number:
            is_equal = np.allclose(a, b, rtol=tolerance, atol=1e-12, equal_nan=True)
        else:
            is_equal = a == b
        if not is_equal:
            differences.append(f"{key}: {a!r} and {b!r}")
    # The programs write the socket of a frame differently.
    return sorted(difference for difference in differences if "/socket_frame" not in difference)


def compare_scaling(tool: Any, setup: Path) -> Iterator[str]:
    """Run a setup of scaling with both programs.

    Args:
        tool: tool of the setup.
        setup: setup file.

    Yields:
        Sentences about the differences of the scaled models and of the static poses.
    """
    result = compute_scaled_model(tool, setup.parent)
    if run_in_opensim(tool, setup) is None:
        yield "OpenSim does not finish"
        return
    for name, text in result.texts.items():
        theirs = setup.parent / name.strip()
        if theirs.suffix == ".osim":
            differences = compare_models(osimlite.read_text(text), osimlite.read(theirs))
            others = [
                item for item in differences if "marker_set" not in item or "/location" not in item
            ]
            yield (
                f"{theirs.name}: {len(differences) - len(others)} markers at other positions, "
                f"{len(others)} other differences"
            )
            yield from others[:MAX_SHOWN_DIFFERENCES]
    file = setup.parent / tool.marker_placer.output_motion_file.strip()
    if result.placed is not None and file.is_file():
        motion = result.placed.pose
        table = read_sto(file)
        q = np.array([table[f"{info.path}/value"][0] for info in motion.mechanism.coordinates])
        (their_cost,) = compute_costs(motion, tool.marker_placer.ik_task_set.objects, q[None])
        yield f"static pose: cost {motion.costs[0]:.5e}, OpenSim's {their_cost:.5e}"


def compare_setups(folder: Path) -> Iterator[str]:
    """Run all setups of a folder with both programs.

    Args:
        folder: folder with the setups and their files; a copy is used.

    Yields:
        One line for each setup.
    """
    with TemporaryDirectory() as temporary:
        copy = shutil.copytree(folder, Path(temporary) / folder.name)
        setups = []
        for path in sorted(copy.rglob("*.xml")):
            try:
                tool = osimlite.read_document(path)
            # Folders also have XML files that are no documents of OpenSim.
            except OsimliteError:
                continue
            if isinstance(tool, osimlite.ScaleTool | osimlite.InverseKinematicsTool):
                setups.append((isinstance(tool, osimlite.InverseKinematicsTool), path, tool))
        # Scaling comes first: inverse kinematics may need the scaled models.
        for is_kinematics, path, tool in sorted(setups, key=lambda setup: setup[:2]):
            compare = compare_inverse_kinematics if is_kinematics else compare_scaling
            try:
                sentences = list(compare(tool, path))
            except OsimliteError as error:
                # The path of the temporary folder would differ in every run.
                sentences = [str(error).replace(temporary, "")]
            yield f"{path.relative_to(temporary)}: {'; '.join(sentences)}"


def compare_people(folder: Path) -> Iterator[str]:
    """Fit the trials of a person with both programs.

    Args:
        folder: folder of the person; a copy is used.

    Yields:
        Lines of a table in Markdown.
    """
    yield (
        "| trial | frames | osimlite | published | OpenSim | osimlite, processor time "
        "| OpenSim, processor time |\n|---|---|---|---|---|---|---|"
    )
    with TemporaryDirectory() as temporary:
        copy = shutil.copytree(folder, Path(temporary) / "copy")
        model = osimlite.read(copy / "hand_scaled.osim")
        for trial in sorted(copy.glob("*.trc")):
            yield compare_trial(model, copy, trial)


def compare_trial(model: osimlite.Model, folder: Path, trial: Path) -> str:
    """Fit one trial with both programs, and return its row of the table.

    Args:
        model: model of the person.
        folder: folder of the person.
        trial: file of the measured markers.
    """
    # The first call is the warm-up.
    osimlite.inverse_kinematics(model, trial)
    start = time.process_time()
    motion = osimlite.inverse_kinematics(model, trial)
    seconds = time.process_time() - start
    tool = osimlite.InverseKinematicsTool(
        model_file="hand_scaled.osim",
        marker_file=trial.name,
        output_motion_file="theirs.mot",
        time_range=(-1e9, 1e9),
        report_errors=False,
    )
    osimlite.write(tool, folder / "theirs.xml")
    opensim_seconds = run_in_opensim(tool, folder / "theirs.xml", 10 * TIME_LIMIT)
    published = trial.with_suffix(".mot")
    # Without published coordinates, all frames are compared.
    frames = np.arange(len(motion.times))
    published_error = ""
    opensim_error = ""
    if published.exists():
        table = read_sto(published)
        # Published times may differ from those of the recording by rounding.
        frames = np.searchsorted(motion.times, table.times - 1e-6)
        errors = compute_marker_errors(motion, read_poses(motion, table), frames)
        published_error = format_rms(errors)
    if opensim_seconds is not None:
        poses = read_poses(motion, read_sto(folder / "theirs.mot"))[frames]
        opensim_error = format_rms(compute_marker_errors(motion, poses, frames))
    return (
        f"| {trial.stem} | {len(frames)} of {len(motion.times)} "
        f"| {format_rms(motion.marker_errors[frames])} | {published_error} | {opensim_error} "
        f"| {seconds:.3f} s | {opensim_seconds or np.nan:.1f} s |"
    )


def format_rms(distances: Array) -> str:
    """Return the root mean square (mm) of distances (m), without missing ones."""
    return f"{1e3 * np.sqrt(np.nanmean(distances**2)):.2f} mm"


if __name__ == "__main__":
    if sys.argv[1:2] not in (["setups"], ["people"]):
        sys.exit(__doc__)
    use_one_blas_thread()
    for folder_name in sys.argv[2:]:
        compare_folder = compare_setups if sys.argv[1] == "setups" else compare_people
        for line in compare_folder(Path(folder_name)):
            print(line, flush=True)
