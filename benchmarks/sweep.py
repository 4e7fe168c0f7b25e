"""A thousand walkers from starts apart: `osimlite sweep` beside a loop over OpenSim's Manager, in one run.

Both simulate two seconds at accuracy 1e-3 from the same starts, and keep the distance. OpenSim's
model and state are made once, and each walker has a manager of its own, as in OpenSim's examples.
osimlite's time is that of the whole
sweep: samples, simulations, measures and the file. Times of processors are compared, per walker,
since other programs may run beside; the walkers per second of one and of two workers are by the
clock, in turn, beside those of one and of two processes that share nothing: what more the machine
does with two at a time.

With `--workers`, only that. With `--many`, a hundred thousand walkers, and the memory that this
takes.
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
from _pair import pair, report
from osimlite.studies.sweep.plan import Plan, plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples

MODEL = Path(__file__).resolve().parent.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"
VARY = {"RHip_rz": "20deg:40deg", "LHip_rz": "-20deg:0deg", "Pelvis_tx/speed": "0:1"}
STIFFNESS = {**VARY, "/forceset/*Foot*/contact_parameters/stiffness": "1e5:1e7:log"}
MASS = {**VARY, "/bodyset/Pelvis/mass": "1:3"}
TO, WALKERS, TURNS, ROUNDS, BY_BULLET, MANY = 2.0, 1000, 9, 2, 30, 100_000


def main() -> None:
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.parquet"
        if "--many" in sys.argv:
            console.print(many(path))
            return
        starts = plan(osimlite.read(MODEL), VARY, to=TO)
        # What is made once, and what of machine code is not in the cache yet.
        Runner(starts).run(choose_samples(starts.variables, "sobol", 8).make_block(0, 8))
        console.print(workers(starts, path))
        if "--workers" in sys.argv:
            return
        import opensim

        opensim.Logger.setLevelString("off")
        rows = choose_samples(starts.variables, "sobol", WALKERS).make_block(0, WALKERS)
        theirs = run_opensim(opensim, rows)
        name = f"{WALKERS} walkers, processor time"
        report(
            f"Dynamic Walkers, {TO:g} s, accuracy 1e-3",
            [
                pair(
                    name,
                    ours=by_sweep(starts, path),
                    theirs=theirs,
                    rounds=ROUNDS,
                    warmup=0,
                    clock=time.process_time,
                )
            ],
            console=console,
        )
        console.print(kinds(path))
        ours = Runner(starts).run(rows).measures["distance"]
        apart = np.abs(ours - np.array(theirs()))
        console.print(
            f"distances differ by {np.median(apart):.2g} m in the middle, {apart.max():.2g} m at most"
        )


def by_sweep(
    made: Plan, path: Path, count: int = WALKERS, workers: int = 1
) -> Callable[[], object]:
    chosen = choose_samples(made.variables, "sobol", count)
    return lambda: sweep(made, chosen, path, workers=workers)


def run_opensim(opensim: Any, rows: Any) -> Callable[[], list[float]]:
    model = opensim.Model(str(MODEL))
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    hips = [coordinates.get(name) for name in ("RHip_rz", "LHip_rz")]
    forward = coordinates.get("Pelvis_tx")
    beginning = opensim.State(state)

    def run() -> list[float]:
        found = []
        for right, left, speed in rows.tolist():
            start = opensim.State(beginning)
            hips[0].setValue(start, right, False)
            hips[1].setValue(start, left, False)
            forward.setSpeedValue(start, speed)
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(1e-3)
            manager.initialize(start)
            found.append(forward.getValue(manager.integrate(TO)))
        return found

    return run


def workers(made: Plan, path: Path) -> Table:
    """Walkers per second by the clock, one worker and two in turn, and what the machine itself allows."""
    table = Table(
        title=f"{WALKERS} walkers", caption="median of the rounds; speed-up within each round"
    )
    for heading in ("", "one", "two", "speed-up", "least", "most"):
        table.add_column(heading, justify="right" if heading else "left")
    alone, swept = [], []
    with separate_processes(made) as together:
        for _ in range(TURNS):
            alone.append([together(count) for count in (1, 2)])
            swept.append(
                [WALKERS / elapsed(by_sweep(made, path, workers=count)) for count in (1, 2)]
            )
    for name, rows in (
        ("workers of a sweep", swept),
        ("separate processes, the machine's bound", alone),
    ):
        one, two = zip(*rows, strict=True)
        gains = [b / a for a, b in rows]
        speed = (f"{walkers:.0f}/s" for walkers in (median(one), median(two)))
        table.add_row(
            name, *speed, *(f"{gain:.2f}" for gain in (median(gains), min(gains), max(gains)))
        )
    return table


def elapsed(work: Callable[[], object]) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


@contextmanager
def separate_processes(made: Plan) -> Iterator[Callable[[int], float]]:
    """What makes one process or two, which share nothing, walk all walkers each; how many walk per second together."""
    context = get_context("spawn")
    ends = [context.Pipe() for _ in range(2)]
    others = [
        context.Process(target=walk_when_told, args=(made.pack(), end), daemon=True)
        for _, end in ends
    ]

    def together(count: int) -> float:
        told = [end for end, _ in ends[:count]]
        for end in told:
            end.send(WALKERS)
        return count * WALKERS / max(end.recv() for end in told)

    for process in others:
        process.start()
    try:
        for end, _ in ends:
            end.recv()
        yield together
    finally:
        for end, _ in ends:
            end.send(0)
        for process in others:
            process.join()


def walk_when_told(packed: bytes, end: Any) -> None:
    """In a process of its own: walk as many as it is told, and tell the time that this took, until it is told none."""
    made = Plan.unpack(packed)
    runner = Runner(made)
    runner.run(choose_samples(made.variables, "sobol", 8).make_block(0, 8))
    end.send(0.0)
    while count := end.recv():
        rows = choose_samples(made.variables, "sobol", count).make_block(0, count)
        end.send(elapsed(partial(runner.run, rows)))


def kinds(path: Path) -> Table:
    """What it costs to vary what: processor time per walker."""
    table = Table(title="Processor time per walker")
    for heading in ("", "walkers", "ms"):
        table.add_column(heading, justify="left" if not heading else "right")
    for name, vary, count, engine in (
        ("starts", VARY, WALKERS, "compiled"),
        ("starts and a stiffness", STIFFNESS, WALKERS, "compiled"),
        ("starts and a mass", MASS, WALKERS, "compiled"),
        ("starts, PyBullet", VARY, BY_BULLET, "bullet"),
    ):
        made = plan(osimlite.read(MODEL), vary, to=TO, engine=engine)
        runner, rows = (
            Runner(made),
            choose_samples(made.variables, "sobol", count).make_block(0, count),
        )
        runner.run(rows[:2])
        started = time.process_time()
        runner.run(rows)
        table.add_row(name, str(count), f"{(time.process_time() - started) / count * 1e3:.3g}")
    return table


def many(path: Path) -> Table:
    """Memory while very many walkers walk."""
    table = Table(title=f"{MANY} walkers")
    for heading in ("runs", "memory, MB", "seconds"):
        table.add_column(heading, justify="right")
    made = plan(osimlite.read(MODEL), VARY, to=TO)
    started, marks = (
        time.perf_counter(),
        [MANY // 100, MANY // 10, MANY // 4, MANY // 2, MANY * 3 // 4, MANY],
    )

    def progress(done: float, of: float) -> None:
        if marks and done >= marks[0]:
            marks.pop(0)
            table.add_row(f"{done:.0f}", f"{memory():.0f}", f"{time.perf_counter() - started:.0f}")

    outcome = sweep(made, choose_samples(made.variables, "lhs", MANY), path, progress=progress)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    table.caption = f"{MANY / outcome.seconds:.0f} walkers/s; at most {peak:.0f} MB; {path.stat().st_size / 1e6:.1f} MB on disk"
    return table


def memory() -> float:
    """Of this process, MB."""
    text = Path("/proc/self/status").read_text(encoding="utf-8")
    return float(text.partition("VmRSS:")[2].split()[0]) / 1024.0


if __name__ == "__main__":
    main()
