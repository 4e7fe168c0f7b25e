"""The compiled engine on the Dynamic Walker, two seconds: many walkers beside OpenSim, and whole processes.

One walker is in simulate.py. A sweep starts from a little beside the default pose, and keeps the
ends and the contacts of every run; OpenSim runs some of the same starts one by one on one core, in
its quickest way: the model built once, the state copied, nothing recorded. Both count processor
time. Whole process: a new Python that imports, reads the file, simulates, and ends.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.simulation import Simulation
from osimlite.simulation.batches import run_many
from simulate import MODEL, TO

ACCURACIES = (1e-3, 1e-5, 1e-6)
WALKERS, SAMPLE, ROUNDS = 1000, 25, 3
PROCESS = "import osimlite; osimlite.simulate(osimlite.read({model!r}), to={to}, engine={engine!r}).summary"


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console()
    with Simulation(osimlite.read(MODEL), "compiled") as simulation:
        console.print(sweep(simulation))
        console.print(threads(simulation))
    console.print(whole_processes())


def starts(simulation: Any, count: int) -> Any:
    """States beside the default pose and speeds (count, 2n)."""
    infos, state = simulation.mechanism.coordinates, simulation.state
    row = state.pack([info.default_value for info in infos], [info.default_speed for info in infos])
    return np.array(row) + np.random.default_rng(0).uniform(-0.01, 0.01, (count, len(row)))


def sweep(simulation: Any) -> Table:
    """Walkers per second of one core."""
    table = Table(title=f"A sweep of {WALKERS} walkers: walkers for each second of one core")
    for heading in ("accuracy", "osimlite", "OpenSim", "ratio", "largest difference at 2 s"):
        table.add_column(heading, justify="right")
    rows = starts(simulation, WALKERS)
    model = opensim.Model(str(MODEL))
    state = model.initSystem()
    for accuracy in ACCURACIES:
        work = partial(
            run_many, simulation.engine, rows, TO, accuracy=accuracy, most_events=40, threads=1
        )
        work()
        ours = WALKERS / min(timed(work, time.process_time) for _ in range(ROUNDS))
        ends = work().states
        theirs, differences = [], []
        for row, end in zip(rows[:SAMPLE], ends, strict=False):
            found: list[float] = []
            theirs.append(
                timed(
                    partial(opensim_run, model, state, simulation, row, accuracy, found),
                    time.process_time,
                )
            )
            differences.append(
                np.abs(np.subtract(found, simulation.state.values(end.tolist()))).max()
            )
        rate = 1.0 / median(theirs)
        table.add_row(
            f"{accuracy:g}",
            f"{ours:.0f}",
            f"{rate:.1f}",
            f"{ours / rate:.1f}",
            f"{max(differences):.1g}",
        )
    return table


def opensim_run(
    model: Any, base: Any, simulation: Any, row: Any, accuracy: float, found: list[float]
) -> None:
    """One run of OpenSim; the values of all coordinates at the end go into `found`."""
    coordinates, state = model.getCoordinateSet(), opensim.State(base)
    values, speeds = simulation.state.values(row.tolist()), simulation.state.speeds(row.tolist())
    for place, info in enumerate(simulation.mechanism.coordinates):
        if not info.locked:
            coordinates.get(info.name).setValue(state, values[place], False)
            coordinates.get(info.name).setSpeedValue(state, speeds[place])
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.setPerformAnalyses(False)
    manager.setWriteToStorage(False)
    manager.initialize(state)
    end = manager.integrate(TO)
    found += (coordinates.get(info.name).getValue(end) for info in simulation.mechanism.coordinates)


def threads(simulation: Any) -> Table:
    """Walkers per second on all cores, and processor time per walker."""
    table = Table(title=f"{WALKERS} walkers, accuracy 1e-3")
    for heading in ("threads", "walkers/s", "processor time of a walker"):
        table.add_column(heading, justify="right")
    rows = starts(simulation, WALKERS)
    for count in range(1, (os.cpu_count() or 1) + 1):
        work = partial(run_many, simulation.engine, rows, TO, threads=count)
        busy = min(timed(work, time.process_time) for _ in range(ROUNDS))
        table.add_row(
            str(count),
            f"{WALKERS / min(timed(work, time.perf_counter) for _ in range(ROUNDS)):.0f}",
            f"{busy / WALKERS * 1e3:.3f} ms",
        )
    return table


def whole_processes() -> Table:
    table = Table(title="Whole process")
    for heading in ("start", "time"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for name, engine in (
            ("first", "compiled"),
            ("second", "compiled"),
            ("PyBullet", "bullet"),
        ):
            command = [
                sys.executable,
                "-c",
                PROCESS.format(model=str(Path(MODEL)), to=TO, engine=engine),
            ]
            environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
            work = partial(
                subprocess.run, command, env=environment, check=True, capture_output=True
            )
            seconds = timed(work, time.perf_counter)
            table.add_row(name, f"{seconds:.2f} s")
    return table


def timed(work: Callable[[], object], clock: Callable[[], float]) -> float:
    start = clock()
    work()
    return clock() - start


if __name__ == "__main__":
    main()
