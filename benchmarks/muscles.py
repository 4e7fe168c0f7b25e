"""Models with muscles: osimlite and OpenSim side by side, in processor time.

    python benchmarks/muscles.py [NAME=FILE ...]

Without files: models of the shared corpus, if that stands beside the repository. An evaluation is
that of the derivative of a state, in turn of 16 poses; OpenSim's goes through its Python binding,
which adds about a microsecond. Motions start from the equilibrium of the muscles and go 0.1 s at
accuracy 1e-5. "apart" is the largest difference of a coordinate (rad or m) between the programs at
the end of the motion, "steps" how many each took. "First use" is a new process with an empty cache
of machine code, then one that has it, less what reading the model takes.
"""

from __future__ import annotations

import gzip
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from _pair import Pair, pair, report
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.simulation import Simulation
from osimlite.simulation.system import System
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples

REAL = {
    "arm26": "m0001",
    "gait10dof18musc": "m0005",
    "gait2392, Thelen": "m0014",
    "gait2392, Millard": "m0013",
    "Rajagopal": "m0954",
}
TO, ACCURACY, ROUNDS, POSES = 0.1, 1e-5, 5, 16
SWEPT, RUNS = "gait10dof18musc", 1000
FIRST = """
import sys, time, osimlite
model = osimlite.read(sys.argv[1])
started = time.perf_counter()
from osimlite.simulation import Simulation
simulation = Simulation(model, "compiled")
simulation.run(0.001, accuracy=1e-3, equilibrate=True)
print(time.perf_counter() - started)
"""


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console()
    ends = Table(title=f"After {TO:g} s at accuracy {ACCURACY:g}")
    for heading in ("model", "muscles", "engine", "steps", "OpenSim's", "apart"):
        ends.add_column(heading, justify="left" if heading in ("model", "engine") else "right")
    times: dict[str, list[Pair]] = {
        "evaluation": [],
        "motion": [],
        "moment arms": [],
        "equilibrium": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, path in models(Path(folder)):
            theirs = opensim.Model(str(path))
            theirs.initSystem()
            model = osimlite.read(path)
            for engine in ("compiled", "bullet"):
                with Simulation(model, engine, opensim_derivatives=True) as simulation:
                    title = f"{name}, {engine}"
                    times["evaluation"].append(
                        compared(
                            title,
                            evaluations(simulation),
                            in_poses(theirs, theirs.realizeAcceleration),
                            POSES,
                        )
                    )
                    ours, other = motions(simulation), their_motions(theirs, ROUNDS + 2)
                    row = apart(simulation, ours(), other())
                    ends.add_row(name, str(theirs.getMuscles().getSize()), engine, *row)
                    times["motion"].append(compared(title, ours, other))
                    if engine == "compiled":
                        asked = in_poses(theirs, theirs.equilibrateMuscles)
                        times["equilibrium"].append(
                            compared(name, equilibria(simulation), asked, POSES)
                        )
            times["moment arms"].append(
                compared(name, moment_arms(model, theirs), their_moment_arms(theirs))
            )
            console.print(f"{name}: first use {first_use(path)}", highlight=False)
        console.print(ends)
        for title, pairs in times.items():
            report(f"{title}, processor time", pairs, console=console)
        sweep(dict(models(Path(folder))).get(SWEPT), console)


def models(folder: Path) -> Iterator[tuple[str, Path]]:
    """Name and file of each model."""
    given = [word.partition("=") for word in sys.argv[1:]]
    yield from ((name, Path(path)) for name, _, path in given)
    for name, number in {} if given else REAL.items():
        path = CORPUS / f"{number}.osim.gz"
        if path.exists():
            (folder / f"{number}.osim").write_bytes(gzip.decompress(path.read_bytes()))
            yield name, folder / f"{number}.osim"


def compared(
    name: str, ours: Callable[[], object], theirs: Callable[[], object], count: int = 1
) -> Pair:
    found = pair(name, ours=ours, theirs=theirs, rounds=ROUNDS, clock=time.process_time)
    return Pair(
        name, *(tuple(value / count for value in row) for row in (found.ours, found.theirs))
    )


# ---------------------------------------------------------------------------------------------- one evaluation
def poses(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(-0.02, 0.02, (POSES, count))


def states_of(simulation: Simulation) -> np.ndarray:
    start = np.array(simulation.initial_state({}, {}, equilibrate=True))
    states = np.repeat(start[None], POSES, axis=0)
    count = len(simulation.state.order)
    states[:, :count] += poses(count)
    return states


def evaluations(simulation: Simulation) -> Callable[[], None]:
    engine, states = cast(System, simulation.engine), states_of(simulation)

    def run() -> None:
        for y in states:
            engine.realize(0.0, y, STAGE.ACCELERATION)

    return run


def in_poses(model: Any, ask: Callable[[Any], object]) -> Callable[[], None]:
    state = opensim.State(model.initializeState())
    model.equilibrateMuscles(state)
    start = state.getQ().to_numpy().copy()
    vectors = [opensim.Vector.createFromMat(start + shift) for shift in poses(len(start))]

    def run() -> None:
        for q in vectors:
            state.setQ(q)
            ask(state)

    return run


# ----------------------------------------------------------------------------------------------------- motions
def motions(simulation: Simulation) -> Callable[[], Any]:
    return lambda: simulation.run(TO, accuracy=ACCURACY, report_interval=TO, equilibrate=True)


def their_motions(model: Any, count: int) -> Callable[[], Any]:
    ready = []
    for _ in range(count):
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(ACCURACY)
        manager.initialize(state)
        ready.append(manager)

    def run() -> Any:
        manager = ready.pop()
        return manager, manager.integrate(TO), model

    return run


def apart(simulation: Simulation, ours: Any, theirs: Any) -> tuple[str, str, str]:
    manager, end, model = theirs
    values = {item.getAbsolutePathString(): item.getValue(end) for item in model.getCoordinateSet()}
    infos = simulation.mechanism.coordinates
    most = max(abs(ours.values[-1, k] - values[info.path]) for k, info in enumerate(infos))
    return str(ours.summary["steps"]), str(manager.getStatesTable().getNumRows() - 1), f"{most:.1e}"


# ------------------------------------------------------------------------------------ moment arms, equilibrium
def moment_arms(model: Any, theirs: Any) -> Callable[[], object]:
    paths = osimlite.paths(model)
    state = theirs.initializeState()
    q = {item.getAbsolutePathString(): item.getValue(state) for item in theirs.getCoordinateSet()}
    return lambda: paths.moment_arms(q)


def their_moment_arms(model: Any) -> Callable[[], None]:
    state = opensim.State(model.initializeState())
    muscles = [model.getMuscles().get(k) for k in range(model.getMuscles().getSize())]
    coordinates = [
        model.getCoordinateSet().get(k) for k in range(model.getCoordinateSet().getSize())
    ]

    def run() -> None:
        state.setQ(state.getQ())
        model.realizePosition(state)
        for muscle in muscles:
            for coordinate in coordinates:
                muscle.computeMomentArm(state, coordinate)

    return run


def equilibria(simulation: Simulation) -> Callable[[], None]:
    engine, states = simulation.engine, states_of(simulation).tolist()

    def run() -> None:
        for y in states:
            engine.equilibrate_muscles(0.0, y)

    return run


# --------------------------------------------------------------------------------------- first use, many runs
def first_use(path: Path) -> str:
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        command = [sys.executable, "-c", FIRST, str(path)]
        seconds = [
            float(
                subprocess.run(
                    command, env=environment, check=True, capture_output=True, text=True
                ).stdout
            )
            for _ in range(2)
        ]
    return f"{seconds[0]:.2f} s the first time, {seconds[1]:.2f} s the second"


def sweep(path: Path | None, console: Console) -> None:
    """Muscle-driven runs from starts apart: per core, and the memory of ten times as many."""
    if path is None:
        return
    made = plan(osimlite.read(path), {"hip_flexion_r": "-0.1:0.1"}, to=TO, accuracy=ACCURACY)
    runner = Runner(made)
    rows = choose_samples(made.variables, "sobol", RUNS).make_block(0, RUNS)
    model = opensim.Model(str(path))
    state = model.initSystem()
    hip = model.getCoordinateSet().get("hip_flexion_r")

    def theirs() -> None:
        for (value,) in rows[: RUNS // 20].tolist():
            start = opensim.State(state)
            hip.setValue(start, value, False)
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(ACCURACY)
            manager.initialize(start)
            manager.integrate(TO)

    found = pair(
        f"{RUNS} runs of {SWEPT}",
        ours=lambda: runner.run(rows),
        theirs=theirs,
        rounds=3,
        clock=time.process_time,
    )
    report(
        "A sweep, processor time",
        [Pair(found.name, found.ours, tuple(20.0 * x for x in found.theirs))],
        console=console,
    )
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    many = choose_samples(made.variables, "sobol", 10 * RUNS)
    for first in range(0, 10 * RUNS, RUNS):
        runner.run(many.make_block(first, first + RUNS))
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    console.print(f"{10 * RUNS} runs take {grown:.1f} MB more than {RUNS}", highlight=False)


if __name__ == "__main__":
    main()
