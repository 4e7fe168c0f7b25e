"""Models that fit people: those of an expert, and made-up ones that are known.

    python benchmarks/person.py FOLDER        a person as AddBiomechanics publishes it
    python benchmarks/person.py FOLDER 10     and so many made-up ones, who move as that one

A folder has `generic.osim`, what an expert made of it, `hand_scaled.osim`, trials `NAME.trc` and
what was published of them, `NAME.mot`; `static*.trc` is the static trial. All markers weigh the
same. Made-up persons have random sizes and markers, the bony ones where the model has them, and 5
mm of noise.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import osimlite
from osimlite.fitting.inverse_kinematics import find_marker_stations
from osimlite.fitting.marker_data import MarkerData
from osimlite.fitting.person import Person
from osimlite.fitting.scaling import scale_model
from osimlite.io.tables.storage import read_sto
from osimlite.mechanics.multibody.spatial import Array
from osimlite.schema.frames import Body
from osimlite.schema.markers import Marker

NOISE, ELSEWHERE, FRAMES = 0.005, 0.015, 200
BONY = "calc", "toe", "5meta", "ankle", "knee", "ASIS", "C7", "Shoulder", "elbow", "wrist"
"""Parts of the names of markers on bones."""


def rms(errors: Array) -> float:
    """Root mean square of distances, mm."""
    return 1000.0 * float(np.sqrt(np.nanmean(errors**2)))


def of_people(folder: Path) -> list[Array]:
    """Print the errors of each trial, fitted, the expert's, and published; returns the poses of the fitted model."""
    generic, expert = (
        osimlite.read(folder / name) for name in ("generic.osim", "hand_scaled.osim")
    )
    static = sorted(folder.glob("static*.trc"))
    trials = [path for path in sorted(folder.glob("*.trc")) if path not in static]
    start, used = time.perf_counter(), time.process_time()
    person = osimlite.fit(generic, trials, static[0] if static else None)
    print(
        f"{len(trials)} trials, {len(person.times)} frames: {time.perf_counter() - start:.1f} s, "
        f"{time.process_time() - used:.1f} s of a processor"
    )
    print(f"{'trial':16} {'fitted':>7} {'expert':>7} {'published':>9}   mm")
    poses = []
    for path in trials:
        data = MarkerData.from_source(path)
        shared = [
            name for name in person.markers if name in data.names and expert_has(expert, name)
        ]
        weights = {
            name: float(name in shared)
            for name in data.find_shared_names([marker.name for marker in markers(generic)])
        }
        row = []
        for model in (person.model, expert):
            own = {name: weight for name, weight in weights.items() if expert_has(model, name)}
            motion = osimlite.inverse_kinematics(model, data, weights=own)
            row.append(
                rms(motion.marker_errors[:, [motion.markers.index(name) for name in shared]])
            )
            if model is person.model:
                poses.append(motion.values)
        published = path.with_suffix(".mot")
        if published.exists():
            row.append(as_published(expert, data, shared, published))
        print(
            f"{path.stem:16} "
            + " ".join(f"{value:7.2f}" for value in row)
            + ("  WORSE" * (row[0] > row[1]))
        )
    told(person)
    return poses


def markers(model: osimlite.Model) -> list[Marker]:
    """All markers."""
    return list(model.components(Marker))


def expert_has(model: osimlite.Model, name: str) -> bool:
    """Whether there is a marker of a name."""
    return any(marker.name == name for marker in markers(model))


def as_published(model: osimlite.Model, data: MarkerData, names: list[str], path: Path) -> float:
    """Errors of published poses."""
    mechanism, table = osimlite.mechanism(model), read_sto(path)
    stations, errors = find_marker_stations(model, mechanism), []
    infos = mechanism.coordinates
    for time_, places in zip(data.times, data.select_values(names), strict=True):
        row = int(np.argmin(np.abs(table.times - time_)))
        q = mechanism.values({})
        for k, info in enumerate(infos):
            if info.name in table.columns:
                value = table[info.name][row]
                q[k] = (
                    np.deg2rad(value)
                    if table.in_degrees and info.motion_type == "rotational"
                    else value
                )
        state = mechanism.at(q)
        errors.append(
            [
                np.linalg.norm(state.point(*stations[name]) - at)
                for name, at in zip(names, places, strict=True)
            ]
        )
    return rms(np.array(errors))


def told(person: Person) -> None:
    """Print the factors."""
    for body, own in person.factors.items():
        if not body.endswith("_l"):
            print(f"{body:12} {own[0]:.3f} ± {person.uncertain[body][0]:.3f}")


def made_up(generic: osimlite.Model, poses: Array, seed: int) -> None:
    """Fit somebody who is known."""
    rng, model = np.random.default_rng(seed), generic.copy_deep()
    bony = {marker.name for marker in markers(model) if any(part in marker.name for part in BONY)}
    sizes: dict[str, float] = {}
    groups = {
        "talus": "calcn",
        "toes": "calcn",
        "ulna": "radius",
        "hand": "radius",
        "patella": "femur",
    }
    for body in model.components(Body):
        name = body.name.split("_")[0]
        sizes[body.name] = sizes.setdefault(
            groups.get(name, name), float(np.clip(rng.normal(1.0, 0.08), 0.8, 1.2))
        )
    sizes = {body.name: sizes[body.name] for body in model.components(Body)}
    scale_model(model, {name: (size,) * 3 for name, size in sizes.items()})
    offsets = {}
    for marker in markers(model):
        if marker.name not in bony:
            offsets[marker.name] = rng.normal(0.0, ELSEWHERE, 3)
            marker.location = tuple((np.array(marker.location) + offsets[marker.name]).tolist())
    mechanism = osimlite.mechanism(model)
    stations = find_marker_stations(model, mechanism)
    rows: dict[str, list[Any]] = {name: [] for name in stations}
    for q in poses:
        state = mechanism.at(mechanism.assemble(q))
        for name, place in stations.items():
            rows[name].append(state.point(*place) + rng.normal(0.0, NOISE, 3))
    used = time.process_time()
    person = osimlite.fit(
        generic, {"moving": {name: np.array(row) for name, row in rows.items()}}, held=bony
    )
    size = max(abs(person.factors[name][0] / own - 1.0) for name, own in sizes.items())
    off = max(float(np.linalg.norm(person.offsets[name] - by)) for name, by in offsets.items())
    print(
        f"made up {seed}: sizes {100.0 * size:.2f} %, markers {1000.0 * off:.2f} mm off at most, "
        f"{time.process_time() - used:.1f} s of a processor"
    )


def main() -> None:
    """What the command line asks for."""
    folder, *count = sys.argv[1:]
    moved = np.concatenate(of_people(Path(folder)))
    generic = osimlite.read(Path(folder) / "generic.osim")
    chosen = moved[np.linspace(0, len(moved) - 1, FRAMES).astype(int)]
    for seed in range(int(count[0]) if count else 0):
        made_up(generic, chosen, seed)


if __name__ == "__main__":
    main()
