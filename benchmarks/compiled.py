"""Measure sweeps of the compiled engine on the Dynamic Walker, and processes that simulate once.

    python benchmarks/compiled.py

Three tables are printed, all for simulations of two seconds:

1. A sweep of 1,000 walkers whose initial states differ a little: walkers per second of one core, by
   osimlite and by OpenSim. osimlite saves the final states and the contact events of all runs.
   OpenSim simulates some of the same walkers one by one in its fastest way: the model is built
   once, the state is copied, and nothing is recorded. Both count processor time. The last column is
   the largest difference of any coordinate at the end (rad or m).
2. The same sweep by osimlite with several threads.
3. Wall time of a Python process that imports osimlite, reads the file, simulates, and ends.

One walker is measured by simulate.py.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from functools import partial
from statistics import median
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import WALKER
from _pair import measure_time
from osimlite.simulation import Simulation
from osimlite.simulation.batches import run_many
from simulate import TO

ACCURACIES = (1e-3, 1e-5, 1e-6)

WALKER_COUNT = 1000

OPENSIM_WALKER_COUNT = 25
"""Number of walkers that OpenSim simulates: all of them would take minutes."""

ROUNDS = 3
"""Repetitions of each sweep; the fastest counts."""

MAX_CHANGE = 0.01
"""Largest random change of the initial coordinates (rad, m) and speeds (rad/s, m/s)."""

MAX_EVENTS = 40
"""Contact events of a walker for which memory is reserved."""

PROCESS = """
import osimlite
osimlite.simulate(osimlite.read({model!r}), to={to}, engine={engine!r}).summary
"""
"""Python program that simulates the walker once."""


def make_initial_states(simulation: Any, count: int) -> Any:
    """Return random states near the default pose and speeds (count, 2n)."""
    infos = simulation.mechanism.coordinates
    values = [info.default_value for info in infos]
    speeds = [info.default_speed for info in infos]
    row = np.array(simulation.state.pack(values, speeds))
    rng = np.random.default_rng(0)
    return row + rng.uniform(-MAX_CHANGE, MAX_CHANGE, (count, len(row)))


def compare_sweeps(simulation: Any) -> Table:
    """Return the table of walkers per second of one core, by both programs."""
    table = Table(title=f"Sweep of {WALKER_COUNT} walkers: walkers per second of one core")
    for heading in ("accuracy", "osimlite", "OpenSim", "ratio", "largest difference at 2 s"):
        table.add_column(heading, justify="right")
    rows = make_initial_states(simulation, WALKER_COUNT)
    model = opensim.Model(str(WALKER))
    state = model.initSystem()
    for accuracy in ACCURACIES:
        run_sweep = partial(
            run_many,
            simulation.engine,
            rows,
            TO,
            accuracy=accuracy,
            most_events=MAX_EVENTS,
            threads=1,
        )
        # The first sweep prepares what later ones find ready. Its result is the same.
        final_states = run_sweep().states
        # Other programs disturb the fastest run least.
        osimlite_time = min(measure_time(run_sweep, time.process_time) for _ in range(ROUNDS))
        opensim_times = []
        differences = []
        for row, final_state in zip(rows[:OPENSIM_WALKER_COUNT], final_states, strict=False):
            values: list[float] = []
            run_opensim = partial(
                simulate_opensim_walker, model, state, simulation, row, accuracy, values
            )
            opensim_times.append(measure_time(run_opensim, time.process_time))
            ours = simulation.state.values(final_state.tolist())
            differences.append(np.abs(np.subtract(values, ours)).max())
        osimlite_rate = WALKER_COUNT / osimlite_time
        opensim_rate = 1.0 / median(opensim_times)
        table.add_row(
            f"{accuracy:g}",
            f"{osimlite_rate:.0f}",
            f"{opensim_rate:.1f}",
            f"{osimlite_rate / opensim_rate:.1f}",
            f"{max(differences):.1g}",
        )
    return table


def simulate_opensim_walker(
    model: Any, state: Any, simulation: Any, row: Any, accuracy: float, values: list[float]
) -> None:
    """Simulate one walker with OpenSim.

    Args:
        model: OpenSim's model.
        state: state of the model, which is copied.
        simulation: osimlite's simulation of the same model, which names the coordinates.
        row: initial state in osimlite's order (2n,).
        accuracy: accuracy of the integrator.
        values: list to which the final values of all coordinates are added.
    """
    coordinates = model.getCoordinateSet()
    initial_state = opensim.State(state)
    initial_values = simulation.state.values(row.tolist())
    initial_speeds = simulation.state.speeds(row.tolist())
    infos = simulation.mechanism.coordinates
    for index, info in enumerate(infos):
        # OpenSim keeps the values of locked coordinates.
        if not info.locked:
            coordinate = coordinates.get(info.name)
            # False: OpenSim does not project the state onto constraints each time.
            coordinate.setValue(initial_state, initial_values[index], False)
            coordinate.setSpeedValue(initial_state, initial_speeds[index])
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    # Nothing is recorded: this is the fastest way of OpenSim.
    manager.setPerformAnalyses(False)
    manager.setWriteToStorage(False)
    manager.initialize(initial_state)
    end = manager.integrate(TO)
    values += (coordinates.get(info.name).getValue(end) for info in infos)


def measure_threads(simulation: Any) -> Table:
    """Return the table of sweeps with one thread to as many as there are cores."""
    table = Table(title=f"Sweep of {WALKER_COUNT} walkers with several threads, accuracy 1e-3")
    for heading in ("threads", "walkers/s", "processor time of a walker, ms"):
        table.add_column(heading, justify="right")
    rows = make_initial_states(simulation, WALKER_COUNT)
    for count in range(1, (os.cpu_count() or 1) + 1):
        run_sweep = partial(run_many, simulation.engine, rows, TO, threads=count)
        processor_time = min(measure_time(run_sweep, time.process_time) for _ in range(ROUNDS))
        wall_time = min(measure_time(run_sweep) for _ in range(ROUNDS))
        table.add_row(
            str(count),
            f"{WALKER_COUNT / wall_time:.0f}",
            f"{processor_time / WALKER_COUNT * 1e3:.3f}",
        )
    return table


def measure_processes() -> Table:
    """Return the table of wall times of processes that simulate once."""
    table = Table(title="Process that imports, reads, simulates and ends")
    for heading in ("engine", "wall time, s"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        # Without the library of kernels, numba compiles them in the first process, and the second
        # finds them in this folder.
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        for name, engine in (
            ("compiled, first", "compiled"),
            ("compiled, second", "compiled"),
            ("PyBullet", "bullet"),
        ):
            program = PROCESS.format(model=str(WALKER), to=TO, engine=engine)
            run_process = partial(
                subprocess.run,
                [sys.executable, "-c", program],
                env=environment,
                check=True,
                capture_output=True,
            )
            table.add_row(name, f"{measure_time(run_process):.2f}")
    return table


def main() -> None:
    """Print the three tables."""
    opensim.Logger.setLevelString("off")
    console = Console()
    with Simulation(osimlite.read(WALKER), "compiled") as simulation:
        console.print(compare_sweeps(simulation))
        console.print(measure_threads(simulation))
    console.print(measure_processes())


if __name__ == "__main__":
    main()
