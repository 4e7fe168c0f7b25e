"""The Dynamic Walker, two seconds, with the compiled engine: beside OpenSim, with PyBullet's figures, cold and cached.

Warm: as in simulate.py; "bare" are the runs of many walkers on one thread, without reports, per walker. The error is
the largest difference of any coordinate (rad or m) from the converged motion at t = 2 s. Whole process: a new Python
that imports, reads the file, simulates, and ends; cold with an empty cache of machine code, cached with a full one.
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
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _pair import pair, report
from osimlite.simulation import Simulation
from osimlite.simulation.many import run_many
from simulate import CONVERGED, MODEL, TO, run_opensim, run_ours

ACCURACIES = (1e-3, 1e-5, 1e-6)
ROUNDS, WARM_UP, WALKERS = 9, 2, 64
PROCESS = "import osimlite; osimlite.simulate(osimlite.read({model!r}), to={to}, engine={engine!r}).summary"


def main() -> None:
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(MODEL))
    model.initSystem()
    console = Console()
    rows: list[Any] = []
    errors = Table(title="Error at 2 s")
    for heading in ("accuracy", "compiled", "OpenSim"):
        errors.add_column(heading, justify="right")
    with Simulation(osimlite.read(MODEL), "compiled") as fast, Simulation(osimlite.read(MODEL)) as bullet:
        exact = run_ours(fast, CONVERGED)()
        for accuracy in ACCURACIES:
            theirs = run_opensim(model, accuracy, 1 + 3 * (WARM_UP + ROUNDS))
            runs = {
                "compiled": run_ours(fast, accuracy),
                "bare": run_bare(fast, accuracy),
                "PyBullet": run_ours(bullet, accuracy),
            }
            ends = [max(abs(a - b) for a, b in zip(run(), exact, strict=True)) for run in (runs["compiled"], theirs)]
            errors.add_row(f"{accuracy:g}", *(f"{end:.2g}" for end in ends))
            rows += [
                pair(f"{name}, {accuracy:g}", ours=run, theirs=theirs, rounds=ROUNDS, warmup=WARM_UP)
                for name, run in runs.items()
            ]
        console.print(errors)
        report(f"Dynamic Walker, {TO:g} s, warm, by accuracy", rows, console=console)
        console.print(many(fast))
    console.print(whole_processes())


def run_bare(simulation: Any, accuracy: float) -> Callable[[], object]:
    start = start_of(simulation)
    return lambda: run_many(simulation.engine, start, TO, accuracy=accuracy, threads=1)


def start_of(simulation: Any) -> Any:
    infos, state = simulation.mechanism.coordinates, simulation.state
    return np.array([state.pack([info.default_value for info in infos], [info.default_speed for info in infos])])


def many(simulation: Any) -> Table:
    """Walkers from starts a little apart, by threads."""
    table = Table(title=f"{WALKERS} walkers, accuracy 1e-3")
    for heading in ("threads", "walkers/s"):
        table.add_column(heading, justify="right")
    starts = start_of(simulation) + np.random.default_rng(0).uniform(
        -0.01, 0.01, (WALKERS, 2 * len(simulation.state.order))
    )
    for threads in range(1, (os.cpu_count() or 1) + 1):
        work = partial(run_many, simulation.engine, starts, TO, threads=threads)
        table.add_row(str(threads), f"{WALKERS / min(timed(work) for _ in range(5)):.0f}")
    return table


def whole_processes() -> Table:
    table = Table(title="Whole process")
    for heading in ("start", "time"):
        table.add_column(heading, justify="right")
    with tempfile.TemporaryDirectory() as folder:
        for name, engine in (
            ("cold", "compiled"),
            ("cached", "compiled"),
            ("cached", "compiled"),
            ("PyBullet", "bullet"),
        ):
            command = [sys.executable, "-c", PROCESS.format(model=str(Path(MODEL)), to=TO, engine=engine)]
            environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
            seconds = timed(lambda: subprocess.run(command, env=environment, check=True, capture_output=True))  # noqa: B023
            table.add_row(name, f"{seconds:.2f} s")
    return table


def timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
