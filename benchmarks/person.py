"""Accuracy of models fitted to persons: an expert's model and synthetic persons as references.

    python benchmarks/person.py FOLDER        a person as AddBiomechanics publishes it
    python benchmarks/person.py FOLDER 10     also ten synthetic persons with the same motion

FOLDER contains the model `generic.osim`, the model `hand_scaled.osim` that an expert made of it,
and trials `NAME.trc`, with published coordinates in `NAME.mot` if they exist. `static*.trc` is the
static trial.

The first table has the root mean square of the marker errors (mm) of each trial: of the fitted
model and of the expert's model with osimlite's inverse kinematics, and of the expert's model in the
published poses. All markers have the same weight. The scale factors of the fitted model follow,
with their uncertainty.

Synthetic persons have random sizes and random marker positions, except for markers on bones, and
noise of 5 mm. Printed are the largest errors of a size (%) and of a marker position (mm).
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from _pair import use_one_blas_thread
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.person import Person
from osimlite.fitting.scaling import scale_model
from osimlite.io.tables.storage import StoTable, read_sto
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import Body
from osimlite.schema.markers import Marker

NOISE = 0.005
"""Standard deviation of the noise of markers (m)."""

MARKER_OFFSET = 0.015
"""Standard deviation of the offset of markers that are not on bones (m)."""

FRAMES = 200
"""Number of frames of a synthetic person."""

# The fit keeps these where the model has them, and moves all other markers.
BONY_MARKERS = (
    "calc",
    "toe",
    "5meta",
    "ankle",
    "knee",
    "ASIS",
    "C7",
    "Shoulder",
    "elbow",
    "wrist",
)
"""Parts of the names of markers on bones."""

# Adjacent bones of a segment have the same size.
SIZE_GROUPS = {
    "talus": "calcn",
    "toes": "calcn",
    "ulna": "radius",
    "hand": "radius",
    "patella": "femur",
}
"""Bodies whose size in synthetic persons is that of another body."""


def compute_rms(errors: Array) -> float:
    """Return the root mean square (mm) of distances (m)."""
    # Markers that are not visible have no position (NaN).
    return 1000.0 * float(np.sqrt(np.nanmean(errors**2)))


def compare_with_expert(folder: Path) -> list[Array]:
    """Fit a person, and print the errors of each trial.

    Args:
        folder: folder of the person.

    Returns:
        Poses (frames, coordinates) of the fitted model in each trial, rad and m.
    """
    generic = osimlite.read(folder / "generic.osim")
    expert = osimlite.read(folder / "hand_scaled.osim")
    static = sorted(folder.glob("static*.trc"))
    trials = [path for path in sorted(folder.glob("*.trc")) if path not in static]
    start = time.perf_counter()
    start_processor = time.process_time()
    person = osimlite.fit(generic, trials, static[0] if static else None)
    print(
        f"{len(trials)} trials, {len(person.times)} frames: {time.perf_counter() - start:.1f} s, "
        f"{time.process_time() - start_processor:.1f} s of processor time"
    )
    print(f"{'trial':16} {'fitted':>7} {'expert':>7} {'published':>9}   mm")
    poses = [print_trial(path, person, generic, expert) for path in trials]
    print_scale_factors(person)
    return poses


def print_trial(
    path: Path, person: Person, generic: osimlite.Model, expert: osimlite.Model
) -> Array:
    """Print the errors of one trial, and return the poses of the fitted model in it.

    Args:
        path: file of the trial.
        person: fitted person.
        generic: model that was fitted.
        expert: model of the expert.
    """
    data = MarkerData.from_source(path)
    # Errors of markers that only one of the models has cannot be compared.
    compared = [name for name in person.markers if name in data.names and has_marker(expert, name)]
    generic_names = [marker.name for marker in list_markers(generic)]
    weights = {name: float(name in compared) for name in data.find_shared_names(generic_names)}
    errors = []
    motions = []
    for model in (person.model, expert):
        model_weights = {
            name: weight for name, weight in weights.items() if has_marker(model, name)
        }
        motion = osimlite.inverse_kinematics(model, data, weights=model_weights)
        indices = [motion.markers.index(name) for name in compared]
        errors.append(compute_rms(motion.marker_errors[:, indices]))
        motions.append(motion)
    published = path.with_suffix(".mot")
    if published.exists():
        errors.append(compute_published_error(expert, data, compared, published))
    fitted_error, expert_error = errors[:2]
    note = "  WORSE" if fitted_error > expert_error else ""
    print(f"{path.stem:16} " + " ".join(f"{error:7.2f}" for error in errors) + note)
    return motions[0].values


def list_markers(model: osimlite.Model) -> list[Marker]:
    """Return all markers of a model."""
    return list(model.components(Marker))


def has_marker(model: osimlite.Model, name: str) -> bool:
    """Return whether a model has a marker of this name."""
    return any(marker.name == name for marker in list_markers(model))


def compute_published_error(
    model: osimlite.Model, data: MarkerData, names: list[str], path: Path
) -> float:
    """Return the root mean square of the marker errors (mm) in published poses.

    Args:
        model: model of the expert.
        data: measured markers.
        names: names of the markers to compare.
        path: file of the published coordinates.
    """
    mechanism = osimlite.mechanism(model)
    table = read_sto(path)
    stations = find_marker_stations(model, mechanism)
    errors = []
    for instant, positions in zip(data.times, data.select_values(names), strict=True):
        # Published tables may have other times than the recording.
        row = int(np.argmin(np.abs(table.times - instant)))
        state = mechanism.at(read_pose(mechanism, table, row))
        errors.append(
            [
                np.linalg.norm(state.point(*stations[name]) - position)
                for name, position in zip(names, positions, strict=True)
            ]
        )
    return compute_rms(np.array(errors))


def read_pose(mechanism: Any, table: StoTable, row: int) -> Array:
    """Return the coordinates (n,), rad and m, in a row of a table.

    Args:
        mechanism: mechanism of the model.
        table: table of coordinates; coordinates that it does not have keep their default values.
        row: index of the row.
    """
    q = mechanism.values({})
    for index, info in enumerate(mechanism.coordinates):
        if info.name in table.columns:
            value = table[info.name][row]
            is_angle = table.in_degrees and info.motion_type == "rotational"
            q[index] = np.deg2rad(value) if is_angle else value
    return q


def print_scale_factors(person: Person) -> None:
    """Print the scale factor of each body along x with its uncertainty, except on the left."""
    for body, factors in person.factors.items():
        if not body.endswith("_l"):
            print(f"{body:12} {factors[0]:.3f} ± {person.uncertain[body][0]:.3f}")


def fit_synthetic_person(generic: osimlite.Model, poses: Array, seed: int) -> None:
    """Fit a synthetic person, whose sizes and marker positions are known, and print the errors.

    Args:
        generic: model from which the person is made, and which is fitted.
        poses: poses (frames, coordinates) of the person, rad and m.
        seed: seed of the random numbers.
    """
    rng = np.random.default_rng(seed)
    model = generic.copy_deep()
    # The fit keeps the positions of these markers.
    bony = {
        marker.name
        for marker in list_markers(model)
        if any(part in marker.name for part in BONY_MARKERS)
    }
    sizes = draw_sizes(model, rng)
    scale_model(model, {name: (size,) * 3 for name, size in sizes.items()})
    offsets = {}
    for marker in list_markers(model):
        if marker.name not in bony:
            offsets[marker.name] = rng.normal(0.0, MARKER_OFFSET, 3)
            marker.location = tuple((np.array(marker.location) + offsets[marker.name]).tolist())
    trial = simulate_markers(model, poses, rng)
    start = time.process_time()
    person = osimlite.fit(generic, {"moving": trial}, held=bony)
    size_error = max(abs(person.factors[name][0] / size - 1.0) for name, size in sizes.items())
    marker_error = max(
        float(np.linalg.norm(person.offsets[name] - offset)) for name, offset in offsets.items()
    )
    print(
        f"synthetic person {seed}: largest errors: sizes {100.0 * size_error:.2f} %, "
        f"markers {1000.0 * marker_error:.2f} mm; "
        f"{time.process_time() - start:.1f} s of processor time"
    )


def draw_sizes(model: osimlite.Model, rng: np.random.Generator) -> dict[str, float]:
    """Draw a random scale factor for each body.

    Args:
        model: model of the person.
        rng: source of random numbers.

    Returns:
        Scale factor by name of the body; left and right bodies have the same one.
    """
    sizes: dict[str, float] = {}
    names = [body.name for body in model.components(Body)]
    for name in names:
        part = name.split("_")[0]
        # Factors outside this range would be no plausible sizes.
        size = float(np.clip(rng.normal(1.0, 0.08), 0.8, 1.2))
        sizes[name] = sizes.setdefault(SIZE_GROUPS.get(part, part), size)
    # Remove the entries of groups, which are no bodies.
    return {name: sizes[name] for name in names}


def simulate_markers(
    model: osimlite.Model, poses: Array, rng: np.random.Generator
) -> dict[str, Array]:
    """Simulate a measurement of markers with noise.

    Args:
        model: model of the person.
        poses: poses (frames, coordinates), rad and m.
        rng: source of random numbers.

    Returns:
        Positions (frames, 3) by marker, m.
    """
    mechanism = osimlite.mechanism(model)
    stations = find_marker_stations(model, mechanism)
    rows: dict[str, list[Any]] = {name: [] for name in stations}
    for q in poses:
        state = mechanism.at(mechanism.assemble(q))
        for name, station in stations.items():
            rows[name].append(state.point(*station) + rng.normal(0.0, NOISE, 3))
    return {name: np.array(row) for name, row in rows.items()}


def main() -> None:
    """Fit the person of the command line, then the synthetic ones."""
    use_one_blas_thread()
    folder, *count = sys.argv[1:]
    poses = np.concatenate(compare_with_expert(Path(folder)))
    generic = osimlite.read(Path(folder) / "generic.osim")
    # These frames are evenly distributed over all trials.
    selected = poses[np.linspace(0, len(poses) - 1, FRAMES).astype(int)]
    for seed in range(int(count[0]) if count else 0):
        fit_synthetic_person(generic, selected, seed)


if __name__ == "__main__":
    main()
