"""Measure how long the frame solver takes for a frame: the latency that it adds to live data.

    python benchmarks/frame_solver.py [MODEL] [--frames N]

A motion with its data is simulated: every joint swings, marker positions have an error of a
centimetre, orientations one of five degrees. In a tenth of the frames some data are missing. In the
last frame of each second all joints jump to another pose, from which they return.

The table has a row for markers and a row for orientation sensors. It gives the median, the 0.999
quantile and the maximum of the time of a frame, by the wall clock and by processor time, which does
not count what else the machine does. The last column says whether the slowest frame stays below a
millisecond of processor time.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, unpack_file
from osimlite.fitting.orientation_data import OrientationData
from osimlite.fitting.sensors import place_sensors
from osimlite.mechanics.multibody.spatial import rotation_xyz

TARGET_S = 1e-3
"""Largest processor time (s) that the slowest frame should take."""

FRAME_RATE_HZ = 100

MARKER_NOISE_M = 0.01
"""Standard deviation of marker positions along each axis (m)."""

ORIENTATION_NOISE_RAD = np.deg2rad(5.0)
"""Standard deviation of orientations about each axis (rad)."""

SWING_RAD = 0.15
"""Amplitude of all rotational coordinates (rad)."""

SWING_FREQUENCY_RAD_S = 5.0
"""Angular frequency of all coordinates (rad/s)."""

JUMP_RAD = 0.5
"""Change of all phases (rad) in the last frame of a second, which makes the pose jump."""

GAP_FRAME_SHARE = 0.1
"""Share of the frames in which data are missing."""

GAP_SHARE = 0.2
"""Share of markers or sensors that are missing in such a frame."""

WARMUP_FRAMES = 200
"""Frames before those that count, so that the solver has found the motion."""


def measure_frames(
    solve_frame: Callable[[int], object], frame_count: int
) -> tuple[list[float], list[float]]:
    """Time the solution of each frame.

    Args:
        solve_frame: solves the frame of a number.
        frame_count: number of frames, including `WARMUP_FRAMES`.

    Returns:
        Times by the wall clock and processor times of this thread (s), without those of the
        warm-up.
    """
    wall_times = []
    processor_times = []
    for number in range(frame_count):
        wall_start = time.perf_counter()
        processor_start = time.thread_time()
        solve_frame(number)
        processor_times.append(time.thread_time() - processor_start)
        wall_times.append(time.perf_counter() - wall_start)
    return wall_times[WARMUP_FRAMES:], processor_times[WARMUP_FRAMES:]


def simulate_poses(mechanism: Any, frame_count: int) -> np.ndarray:
    """Return the coordinates of all frames (frames, q): rotational ones swing, others rest."""
    is_rotational = np.array([info.motion_type == "rotational" for info in mechanism.coordinates])
    numbers = np.arange(frame_count)[:, None]
    jumps = JUMP_RAD * (numbers % FRAME_RATE_HZ == FRAME_RATE_HZ - 1)
    # Each coordinate has a phase of its own.
    phases = SWING_FREQUENCY_RAD_S * numbers / FRAME_RATE_HZ + np.arange(len(is_rotational)) + jumps
    return mechanism.values({}) + SWING_RAD * np.sin(phases) * is_rotational


def add_gaps(rng: np.random.Generator, data: np.ndarray) -> None:
    """Replace some data of some frames by NaN.

    Args:
        rng: random numbers.
        data: data that change, with frames and markers or sensors as first two dimensions.
    """
    has_gaps = rng.random(len(data)) < GAP_FRAME_SHARE
    data[has_gaps[:, None] & (rng.random(data.shape[:2]) < GAP_SHARE)] = np.nan


def make_solvers(
    model: osimlite.Model, frame_count: int
) -> Iterator[tuple[str, Callable[[int], object]]]:
    """Yield the frame solvers of markers and of sensors, each as a function of the frame's number.

    Args:
        model: model with markers; a sensor is added to each of its bodies.
        frame_count: number of frames to simulate.
    """
    # In the default pose all sensors are aligned with ground.
    standing = {f"{body.name}_imu": np.eye(3) for body in model.components(osimlite.Body)}
    place_sensors(model, OrientationData.from_source(standing))
    mechanism = osimlite.mechanism(model)
    # With a fixed seed each run of this script solves the same frames.
    rng = np.random.default_rng(1)
    marker_paths = [marker.path for marker in model.components(osimlite.Marker)]
    stations = [mechanism.stations[path] for path in marker_paths]
    sensors = [
        frame for path, frame in mechanism.frames.items() if path.rpartition("/")[2] in standing
    ]
    positions = np.empty((frame_count, len(stations), 3))
    rotations = np.empty((frame_count, len(sensors), 3, 3))
    for number, q in enumerate(simulate_poses(mechanism, frame_count)):
        state = mechanism.at(q)
        positions[number] = [state.point(*station) for station in stations]
        rotations[number] = [
            (state.transform(sensor.body) @ sensor.transform)[:3, :3] for sensor in sensors
        ]
    positions += rng.normal(0.0, MARKER_NOISE_M, positions.shape)
    angles = rng.normal(0.0, ORIENTATION_NOISE_RAD, (frame_count * len(sensors), 3))
    errors = np.array([rotation_xyz(angle) for angle in angles]).reshape(rotations.shape)
    # The errors are rotations about the axes of ground.
    rotations = errors @ rotations
    add_gaps(rng, positions)
    add_gaps(rng, rotations)
    marker_names = [path.rpartition("/")[2] for path in marker_paths]
    marker_solver = osimlite.FrameSolver(model, marker_names)
    sensor_solver = osimlite.FrameSolver(model, sensors=[*standing])
    yield f"{len(stations)} markers", lambda number: marker_solver.step(positions[number])
    yield (
        f"{len(sensors)} sensors",
        lambda number: sensor_solver.step(orientations=rotations[number]),
    )


def read_default_model() -> osimlite.Model:
    """Read Rajagopal2016 of the shared folder."""
    with tempfile.TemporaryDirectory() as folder:
        # The model is in memory when the folder is removed.
        return osimlite.read(unpack_file(CORPUS / "m0954.osim.gz", Path(folder) / "model.osim"))


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "model",
        nargs="?",
        type=Path,
        metavar="MODEL",
        help="model file with markers, by default Rajagopal2016 of the shared folder",
    )
    parser.add_argument(
        "--frames",
        type=int,
        # Ten of these frames are slower than the 0.999 quantile.
        default=10_000,
        metavar="N",
        help="number of frames, 10,000 by default",
    )
    options = parser.parse_args()
    model = osimlite.read(options.model) if options.model else read_default_model()
    table = Table(
        title=f"Time of a frame of {model.name} (ms), {options.frames:,} frames",
        caption=f"target: {1e3 * TARGET_S:g} ms of processor time in the slowest frame",
    )
    table.add_column("data")
    for clock in ("wall", "processor"):
        table.add_column(f"{clock}: median", justify="right")
        table.add_column("1 of 1000", justify="right")
        table.add_column("slowest", justify="right")
    table.add_column("target", justify="right")
    frame_count = options.frames + WARMUP_FRAMES
    for name, solve_frame in make_solvers(model, frame_count):
        cells = [name]
        wall_times, processor_times = measure_frames(solve_frame, frame_count)
        for times in (wall_times, processor_times):
            quantile = float(np.quantile(times, 0.999))
            cells += [f"{1e3 * value:.3g}" for value in (median(times), quantile, max(times))]
        is_reached = max(processor_times) <= TARGET_S
        table.add_row(*cells, "reached" if is_reached else "missed")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
