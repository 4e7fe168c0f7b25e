"""Speed of `osimlite sweep`, compared with a loop over OpenSim's Manager: a thousand walkers.

    python benchmarks/sweep.py               all tables
    python benchmarks/sweep.py --workers     only the first table
    python benchmarks/sweep.py --many        only memory and speed of a hundred thousand walkers

The walkers are simulated for two seconds at accuracy 1e-3 from different starts, and their distance
is recorded. The tables are:

- *workers*: walkers per second of wall-clock time with one and with two workers of a sweep, which
  run in turn, and of one and two separate processes that share nothing. The latter show how much
  more the machine does with two processes.
- *Dynamic Walkers*: processor time of osimlite and OpenSim, which run in turn. osimlite's time is
  that of the complete sweep: samples, simulations, measures and the results file. OpenSim's model
  and state are made once, and each walker has a manager of its own, as in OpenSim's examples.
- *Processor time per walker*: for several kinds of variables, in ms.

The last line has the differences of the distances between the programs.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import WALKER
from _pair import measure_time, print_pairs, time_pair
from osimlite.studies.sweep.plan import Plan, plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples

START_RANGES = {"RHip_rz": "20deg:40deg", "LHip_rz": "-20deg:0deg", "Pelvis_tx/speed": "0:1"}
"""Variables of the start and their ranges."""

STIFFNESS_RANGES = {**START_RANGES, "/forceset/*Foot*/contact_parameters/stiffness": "1e5:1e7:log"}
"""The same with the stiffness of the feet."""

MASS_RANGES = {**START_RANGES, "/bodyset/Pelvis/mass": "1:3"}
"""The same with the mass of the pelvis."""

TO = 2.0
"""End of each simulation (s)."""

WALKERS = 1000
"""Number of walkers of a sweep."""

WORKER_ROUNDS = 9
"""Number of rounds in which one and two workers are timed."""

ROUNDS = 2
"""Number of timed pairs with OpenSim."""

# PyBullet is slower, and its time per walker varies little.
BULLET_WALKERS = 30
"""Number of walkers that are simulated with PyBullet."""

MANY_WALKERS = 100_000
"""Number of walkers with `--many`."""


def main() -> None:
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.parquet"
        if "--many" in sys.argv:
            console.print(measure_many_walkers(path))
            return
        starts = plan(osimlite.read(WALKER), START_RANGES, to=TO)
        warm_up(Runner(starts))
        console.print(compare_workers(starts, path))
        if "--workers" in sys.argv:
            return
        compare_with_opensim(starts, path, console)


def warm_up(runner: Runner) -> None:
    """Run a few walkers, so that everything is made and compiled before the timed runs."""
    runner.run(choose_samples(runner.plan.variables, "sobol", 8).make_block(0, 8))


def compare_with_opensim(starts: Plan, path: Path, console: Console) -> None:
    """Print the times, the cost of each kind of variable, and the differences of the distances.

    Args:
        starts: plan of the sweep.
        path: results file.
        console: console to print to.
    """
    import opensim

    opensim.Logger.setLevelString("off")
    # Both programs simulate the same starts.
    rows = choose_samples(starts.variables, "sobol", WALKERS).make_block(0, WALKERS)
    theirs = prepare_opensim_runs(opensim, rows)
    times = time_pair(
        f"{WALKERS} walkers, processor time",
        ours=prepare_sweep(starts, path),
        theirs=theirs,
        rounds=ROUNDS,
        # Everything was made and compiled by the runs before.
        warmup=0,
        clock=time.process_time,
    )
    print_pairs(f"Dynamic Walkers, {TO:g} s, accuracy 1e-3", [times], console=console)
    console.print(compare_variables())
    ours = Runner(starts).run(rows).measures["distance"]
    differences = np.abs(ours - np.array(theirs()))
    console.print(
        f"difference of the distances: median {np.median(differences):.2g} m, "
        f"greatest {differences.max():.2g} m"
    )


def prepare_sweep(
    sweep_plan: Plan, path: Path, count: int = WALKERS, workers: int = 1
) -> Callable[[], object]:
    """Return a function that runs a sweep.

    Args:
        sweep_plan: plan of the sweep.
        path: results file.
        count: number of walkers.
        workers: number of worker processes.
    """
    samples = choose_samples(sweep_plan.variables, "sobol", count)
    return lambda: sweep(sweep_plan, samples, path, workers=workers)


def prepare_opensim_runs(opensim: Any, rows: Any) -> Callable[[], list[float]]:
    """Return a function that simulates all walkers in OpenSim and returns their distances (m).

    Args:
        opensim: OpenSim's module.
        rows: angles of the hips (rad) and speed of the pelvis (m/s) of each walker (walkers, 3).
    """
    # Model and state are made once, as in OpenSim's examples.
    model = opensim.Model(str(WALKER))
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    right_hip = coordinates.get("RHip_rz")
    left_hip = coordinates.get("LHip_rz")
    forward = coordinates.get("Pelvis_tx")
    default = opensim.State(state)

    def run() -> list[float]:
        distances = []
        for right, left, speed in rows.tolist():
            start = opensim.State(default)
            right_hip.setValue(start, right, False)
            left_hip.setValue(start, left, False)
            forward.setSpeedValue(start, speed)
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(1e-3)
            manager.initialize(start)
            distances.append(forward.getValue(manager.integrate(TO)))
        return distances

    return run


def compare_workers(sweep_plan: Plan, path: Path) -> Table:
    """Return a table of walkers per second with one and with two processes.

    Args:
        sweep_plan: plan of the sweep.
        path: results file.
    """
    table = Table(
        title=f"{WALKERS} walkers, walkers per second of wall-clock time",
        caption="median of the rounds; speed-up within each round",
    )
    for heading in ("", "one", "two", "speed-up", "least", "greatest"):
        table.add_column(heading, justify="right" if heading else "left")
    separate_rates = []
    sweep_rates = []
    with start_separate_processes(sweep_plan) as measure_rate:
        for _ in range(WORKER_ROUNDS):
            # Both ways take turns, so that they meet the same machine.
            separate_rates.append([measure_rate(count) for count in (1, 2)])
            sweep_rates.append(
                [
                    WALKERS / measure_time(prepare_sweep(sweep_plan, path, workers=count))
                    for count in (1, 2)
                ]
            )
    for name, rates in (
        ("workers of a sweep", sweep_rates),
        ("separate processes, the machine's bound", separate_rates),
    ):
        one, two = zip(*rates, strict=True)
        gains = [rate_two / rate_one for rate_one, rate_two in rates]
        table.add_row(
            name,
            f"{median(one):.0f}/s",
            f"{median(two):.0f}/s",
            f"{median(gains):.2f}",
            f"{min(gains):.2f}",
            f"{max(gains):.2f}",
        )
    return table


@contextmanager
def start_separate_processes(sweep_plan: Plan) -> Iterator[Callable[[int], float]]:
    """Start two independent processes that can both simulate all walkers.

    Args:
        sweep_plan: plan of the sweep.

    Yields:
        Function that lets one or two of them simulate at a time, and returns the walkers per second
        of both together.
    """
    # A forked process would share memory with this one.
    context = get_context("spawn")
    pipes = [context.Pipe() for _ in range(2)]
    processes = [
        context.Process(target=serve_walkers, args=(sweep_plan.pack(), end), daemon=True)
        for _, end in pipes
    ]

    def measure_rate(count: int) -> float:
        ends = [end for end, _ in pipes[:count]]
        for end in ends:
            end.send(WALKERS)
        # The processes work at the same time, and the slower one counts.
        return count * WALKERS / max(end.recv() for end in ends)

    for process in processes:
        process.start()
    try:
        # Wait until each process has finished its warm-up.
        for end, _ in pipes:
            end.recv()
        yield measure_rate
    finally:
        for end, _ in pipes:
            end.send(0)
        for process in processes:
            process.join()


def serve_walkers(packed_plan: bytes, end: Any) -> None:
    """Simulate walkers in a process of its own, until the number zero is received.

    Args:
        packed_plan: plan of the sweep.
        end: end of a pipe, which receives numbers of walkers and sends the time of each (s).
    """
    sweep_plan = Plan.unpack(packed_plan)
    runner = Runner(sweep_plan)
    warm_up(runner)
    end.send(0.0)
    while count := end.recv():
        rows = choose_samples(sweep_plan.variables, "sobol", count).make_block(0, count)
        end.send(measure_time(partial(runner.run, rows)))


def compare_variables() -> Table:
    """Return a table of the processor time per walker for several kinds of variables."""
    table = Table(title="Processor time per walker")
    for heading in ("variables", "walkers", "ms"):
        table.add_column(heading, justify="left" if heading == "variables" else "right")
    for name, ranges, count, engine in (
        ("starts", START_RANGES, WALKERS, "compiled"),
        ("starts and a stiffness", STIFFNESS_RANGES, WALKERS, "compiled"),
        ("starts and a mass", MASS_RANGES, WALKERS, "compiled"),
        ("starts, PyBullet", START_RANGES, BULLET_WALKERS, "bullet"),
    ):
        sweep_plan = plan(osimlite.read(WALKER), ranges, to=TO, engine=engine)
        runner = Runner(sweep_plan)
        rows = choose_samples(sweep_plan.variables, "sobol", count).make_block(0, count)
        # The first rows are the warm-up.
        runner.run(rows[:2])
        started = time.process_time()
        runner.run(rows)
        seconds = time.process_time() - started
        table.add_row(name, str(count), f"{seconds / count * 1e3:.3g}")
    return table


def measure_many_walkers(path: Path) -> Table:
    """Return a table of memory and time during a very large sweep, whose results go to a file."""
    table = Table(title=f"{MANY_WALKERS} walkers")
    for heading in ("runs", "memory, MB", "seconds"):
        table.add_column(heading, justify="right")
    sweep_plan = plan(osimlite.read(WALKER), START_RANGES, to=TO)
    started = time.perf_counter()
    # If memory grew with the number of runs, these rows would show it.
    marks = [int(MANY_WALKERS * fraction) for fraction in (0.01, 0.1, 0.25, 0.5, 0.75, 1.0)]

    def report_progress(done: float, _total: float) -> None:
        if marks and done >= marks[0]:
            marks.pop(0)
            seconds = time.perf_counter() - started
            table.add_row(f"{done:.0f}", f"{read_memory():.0f}", f"{seconds:.0f}")

    samples = choose_samples(sweep_plan.variables, "lhs", MANY_WALKERS)
    outcome = sweep(sweep_plan, samples, path, progress=report_progress)
    # Linux reports kilobytes.
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    table.caption = (
        f"{MANY_WALKERS / outcome.seconds:.0f} walkers/s; at most {peak:.0f} MB; "
        f"{path.stat().st_size / 1e6:.1f} MB on disk"
    )
    return table


def read_memory() -> float:
    """Return the resident memory of this process (MB); Linux only."""
    text = Path("/proc/self/status").read_text(encoding="utf-8")
    return float(text.partition("VmRSS:")[2].split()[0]) / 1024.0


if __name__ == "__main__":
    main()
