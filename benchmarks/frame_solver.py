"""How long the frame solver takes for a frame, and how long for the worst: what live data must wait for.

    python benchmarks/frame_solver.py [MODEL] [--frames N]

The motion and its data are made here: every joint swings, markers are a centimetre off, sensors
five degrees; in a tenth of the frames some are missing, and once a second all of them leap to
another pose. Each frame is timed by the clock and by the processor, whose time does not count what
else the machine does.
"""

from __future__ import annotations

import argparse
import gzip
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.mechanics.multibody.spatial import rotation_xyz

AIM = 1e-3
"""What the worst frame may take, s."""
RATE, NOISE, TURN = 100, 0.01, np.deg2rad(5.0)
"""Frames per second, and how far markers (m) and sensors (rad) are off, root mean square by axis."""
WARM = 200
"""Frames before those that count."""


def timed(step: Callable[[int], object], frames: int) -> tuple[list[float], list[float]]:
    """How long each frame takes, by the clock and by the processor (s)."""
    by_clock, by_processor = [], []
    for number in range(frames):
        clock, processor = time.perf_counter(), time.thread_time()
        step(number)
        by_processor.append(time.thread_time() - processor)
        by_clock.append(time.perf_counter() - clock)
    return by_clock[WARM:], by_processor[WARM:]


def solvers(model: osimlite.Model, frames: int) -> Iterator[tuple[str, Callable[[int], object]]]:
    """What solves a frame by its number: from markers, from sensors."""
    standing = {f"{body.name}_imu": np.eye(3) for body in model.components(osimlite.Body)}
    place_sensors(model, OrientationData.from_source(standing))
    mechanism, rng = osimlite.mechanism(model), np.random.default_rng(1)
    turning = np.array([info.motion_type == "rotational" for info in mechanism.coordinates])
    paths = [marker.path for marker in model.components(osimlite.Marker)]
    stations = [mechanism.stations[path] for path in paths]
    frames_of = [
        frame for path, frame in mechanism.frames.items() if path.rpartition("/")[2] in standing
    ]
    numbers = np.arange(frames)[:, None]
    phases = 5.0 * numbers / RATE + np.arange(len(turning)) + 0.5 * (numbers % RATE == RATE - 1)
    poses = mechanism.values({}) + 0.15 * np.sin(phases) * turning
    places, turns = np.empty((frames, len(stations), 3)), np.empty((frames, len(frames_of), 3, 3))
    for number, q in enumerate(poses):
        state = mechanism.at(q)
        places[number] = [state.point(*station) for station in stations]
        turns[number] = [
            (state.transform(frame.body) @ frame.transform)[:3, :3] for frame in frames_of
        ]
    places += rng.normal(0.0, NOISE, places.shape)
    off = rng.normal(0.0, TURN, (frames, len(frames_of), 3)).reshape(-1, 3)
    turns = np.array([rotation_xyz(angles) for angles in off]).reshape(turns.shape) @ turns
    for values in (places, turns):
        gaps = rng.random(frames) < 0.1
        values[gaps[:, None] & (rng.random(values.shape[:2]) < 0.2)] = np.nan
    of_markers = osimlite.FrameSolver(model, [path.rpartition("/")[2] for path in paths])
    of_sensors = osimlite.FrameSolver(model, sensors=[*standing])
    yield f"{len(stations)} markers", lambda number: of_markers.step(places[number])
    yield f"{len(frames_of)} sensors", lambda number: of_sensors.step(orientations=turns[number])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "model", nargs="?", type=Path, help="with markers; one of the shared folder if left out"
    )
    parser.add_argument(
        "--frames", type=int, default=10_000, metavar="N", help="10,000 if left out"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = options.model
        if path is None:
            path = Path(folder) / "model.osim"
            path.write_bytes(gzip.decompress((CORPUS / "m0954.osim.gz").read_bytes()))
        model = osimlite.read(path)
    table = Table(
        title=f"A frame of {model.name} (ms), {options.frames:,} frames",
        caption=f"aim: {1e3 * AIM:g} ms",
    )
    for column in (
        "",
        "clock: median",
        "1 of 1000",
        "worst",
        "processor: median",
        "1 of 1000",
        "worst",
        "",
    ):
        table.add_column(column, justify="right")
    for name, step in solvers(model, options.frames + WARM):
        cells, worst = [name], 0.0
        for times in timed(step, options.frames + WARM):
            worst = max(times)
            cells += [
                f"{1e3 * value:.3g}"
                for value in (median(times), float(np.quantile(times, 0.999)), worst)
            ]
        table.add_row(*cells, "kept" if worst <= AIM else "missed")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
