"""Speed of models with muscles, compared with OpenSim, in processor time.

    python benchmarks/muscles.py [NAME=FILE ...]

Without files, the models are those of the shared corpus if it is present. The tables are:

- *evaluation*: derivatives of one state, mean of 16 poses. OpenSim is called through its Python
  binding, which adds about a microsecond.
- *motion*: a simulation of 0.1 s from the equilibrium of the muscles, at accuracy 1e-5.
- *moment arms*: moment arms of all muscles about all coordinates in one pose.
- *equilibrium*: equilibrium of all muscles, mean of 16 poses.

Another table has the number of integrator steps of both programs, and the largest difference of a
coordinate at the end of the motion (rad or m). *First use* is the time of a new process without and
then with cached machine code, without reading the model. The last table and line are about many
simulations: the time of a sweep, and the memory of ten times as many runs.
"""

from __future__ import annotations

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
from _corpus import CORPUS, unpack_file
from _pair import Pair, print_pairs, time_pair
from osimlite.mechanics.kernels.layout import STAGE
from osimlite.simulation import Simulation
from osimlite.simulation.system import System
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples

CORPUS_MODELS = {
    "arm26": "m0001",
    "gait10dof18musc": "m0005",
    "gait2392, Thelen": "m0014",
    "gait2392, Millard": "m0013",
    "Rajagopal": "m0954",
}
"""Titles of models in the tables, and their names in the corpus."""

TO = 0.1
"""End of the simulation (s)."""

ACCURACY = 1e-5
"""Relative accuracy of the integrators."""

ROUNDS = 5
"""Number of timed pairs of runs."""

# Poses that differ keep either program from using earlier results.
POSES = 16
"""Number of poses in which one evaluation is timed."""

SWEPT_MODEL = "gait10dof18musc"
"""Title of the model that is simulated many times."""

SWEEP_RUNS = 1000
"""Number of simulations of that model."""

# OpenSim's time is proportional to the number of runs, so a part of them is enough.
OPENSIM_SHARE = 20
"""Divisor of the number of simulations that OpenSim does."""

FIRST_USE_SCRIPT = """
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
    for heading in (
        "model",
        "muscles",
        "engine",
        "osimlite, steps",
        "OpenSim, steps",
        "difference, rad or m",
    ):
        ends.add_column(heading, justify="left" if heading in ("model", "engine") else "right")
    times: dict[str, list[Pair]] = {
        "evaluation": [],
        "motion": [],
        "moment arms": [],
        "equilibrium": [],
    }
    with tempfile.TemporaryDirectory() as folder:
        for name, path in find_models(Path(folder)):
            compare_model(name, path, times, ends)
            console.print(f"{name}: first use {measure_first_use(path)}", highlight=False)
        console.print(ends)
        for title, pairs in times.items():
            print_pairs(f"{title}, processor time", pairs, console=console)
        swept_file = dict(find_models(Path(folder))).get(SWEPT_MODEL)
        if swept_file is not None:
            compare_sweep(swept_file, console)


def find_models(folder: Path) -> Iterator[tuple[str, Path]]:
    """Find the models of the command line, or those of the corpus.

    Args:
        folder: folder for uncompressed models of the corpus.

    Yields:
        Name and file of each model.
    """
    words = [word.partition("=") for word in sys.argv[1:]]
    yield from ((name, Path(path)) for name, _, path in words)
    if words:
        return
    for name, number in CORPUS_MODELS.items():
        path = CORPUS / f"{number}.osim.gz"
        if path.exists():
            yield name, unpack_file(path, folder / f"{number}.osim")


def compare_model(name: str, path: Path, times: dict[str, list[Pair]], ends: Table) -> None:
    """Time a model with each engine of osimlite and with OpenSim.

    Args:
        name: title of the model.
        path: model file.
        times: lists by title of their table, which are extended.
        ends: table of steps and differences, to which rows are added.
    """
    opensim_model = opensim.Model(str(path))
    opensim_model.initSystem()
    model = osimlite.read(path)
    for engine in ("compiled", "bullet"):
        with Simulation(model, engine, opensim_derivatives=True) as simulation:
            title = f"{name}, {engine}"
            ours: Callable[[], Any] = prepare_evaluations(simulation)
            theirs: Callable[[], Any] = prepare_opensim_poses(
                opensim_model, opensim_model.realizeAcceleration
            )
            times["evaluation"].append(time_evaluations(title, ours, theirs, POSES))
            ours = prepare_motions(simulation)
            # One run for the differences, one as warm-up, and one for each round.
            theirs = prepare_opensim_motions(opensim_model, ROUNDS + 2)
            row = compare_ends(simulation, ours(), theirs())
            ends.add_row(name, str(opensim_model.getMuscles().getSize()), engine, *row)
            times["motion"].append(time_evaluations(title, ours, theirs))
            # Equilibria involve no dynamics of the bodies, so that one engine is enough.
            if engine == "compiled":
                ours = prepare_equilibria(simulation)
                theirs = prepare_opensim_poses(opensim_model, opensim_model.equilibrateMuscles)
                times["equilibrium"].append(time_evaluations(name, ours, theirs, POSES))
    ours = prepare_moment_arms(model, opensim_model)
    theirs = prepare_opensim_moment_arms(opensim_model)
    times["moment arms"].append(time_evaluations(name, ours, theirs))


def time_evaluations(
    name: str, ours: Callable[[], object], theirs: Callable[[], object], count: int = 1
) -> Pair:
    """Return the processor times of one evaluation (s).

    Args:
        name: name of the row.
        ours: evaluations with osimlite.
        theirs: evaluations with OpenSim.
        count: number of evaluations that one call makes.
    """
    row = time_pair(name, ours=ours, theirs=theirs, rounds=ROUNDS, clock=time.process_time)
    return Pair(
        name,
        tuple(seconds / count for seconds in row.ours),
        tuple(seconds / count for seconds in row.theirs),
    )


# ----------------------------------------------------------------------------------- one evaluation
def draw_offsets(count: int) -> np.ndarray:
    """Return small random offsets (poses, count) of coordinates, rad or m."""
    return np.random.default_rng(0).uniform(-0.02, 0.02, (POSES, count))


def create_states(simulation: Simulation) -> np.ndarray:
    """Return states (poses, states) near the default pose, with muscles near equilibrium."""
    start = np.array(simulation.initial_state({}, {}, equilibrate=True))
    states = np.repeat(start[None], POSES, axis=0)
    count = len(simulation.state.order)
    states[:, :count] += draw_offsets(count)
    return states


def prepare_evaluations(simulation: Simulation) -> Callable[[], None]:
    """Return a function that computes the derivatives of all states."""
    engine = cast(System, simulation.engine)
    states = create_states(simulation)

    def run() -> None:
        for y in states:
            engine.realize(0.0, y, STAGE.ACCELERATION)

    return run


def prepare_opensim_poses(model: Any, evaluate: Callable[[Any], object]) -> Callable[[], None]:
    """Return a function that makes an evaluation in OpenSim in each pose.

    Args:
        model: initialised OpenSim model.
        evaluate: evaluation of a state.
    """
    state = opensim.State(model.initializeState())
    model.equilibrateMuscles(state)
    start = state.getQ().to_numpy().copy()
    # Convert the poses before, so that the conversion is not timed.
    vectors = [opensim.Vector.createFromMat(start + offset) for offset in draw_offsets(len(start))]

    def run() -> None:
        for q in vectors:
            state.setQ(q)
            evaluate(state)

    return run


# ------------------------------------------------------------------------------------------ motions
def prepare_motions(simulation: Simulation) -> Callable[[], Any]:
    """Return a function that simulates from equilibrium and returns the trajectory."""
    return lambda: simulation.run(TO, accuracy=ACCURACY, report_interval=TO, equilibrate=True)


def prepare_opensim_motions(model: Any, count: int) -> Callable[[], Any]:
    """Return a function that simulates in OpenSim, and returns manager, final state and model.

    Args:
        model: initialised OpenSim model.
        count: how often the function can be called.
    """
    # A manager can start only once. Initialise all of them here, so that only the motion is timed.
    managers = []
    for _ in range(count):
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(ACCURACY)
        manager.initialize(state)
        managers.append(manager)

    def run() -> Any:
        # The final state lives only as long as its manager, which is returned for that reason.
        manager = managers.pop()
        return manager, manager.integrate(TO), model

    return run


def compare_ends(simulation: Simulation, ours: Any, theirs: Any) -> tuple[str, str, str]:
    """Compare the ends of two simulations.

    Args:
        simulation: simulation of osimlite.
        ours: its trajectory.
        theirs: manager, final state and model of OpenSim.

    Returns:
        Cells of a row: steps of osimlite, steps of OpenSim, largest difference (rad or m).
    """
    manager, end, model = theirs
    values = {item.getAbsolutePathString(): item.getValue(end) for item in model.getCoordinateSet()}
    infos = simulation.mechanism.coordinates
    difference = max(
        abs(ours.values[-1, index] - values[info.path]) for index, info in enumerate(infos)
    )
    opensim_steps = manager.getStatesTable().getNumRows() - 1
    return str(ours.summary["steps"]), str(opensim_steps), f"{difference:.1e}"


# ------------------------------------------------------------------------- moment arms, equilibrium
def prepare_moment_arms(model: Any, opensim_model: Any) -> Callable[[], object]:
    """Return a function that computes all moment arms in OpenSim's default pose."""
    paths = osimlite.paths(model)
    state = opensim_model.initializeState()
    q = {
        item.getAbsolutePathString(): item.getValue(state)
        for item in opensim_model.getCoordinateSet()
    }
    return lambda: paths.moment_arms(q)


def prepare_opensim_moment_arms(model: Any) -> Callable[[], None]:
    """Return a function that computes all moment arms in OpenSim."""
    state = opensim.State(model.initializeState())
    muscle_set = model.getMuscles()
    muscles = [muscle_set.get(index) for index in range(muscle_set.getSize())]
    coordinate_set = model.getCoordinateSet()
    coordinates = [coordinate_set.get(index) for index in range(coordinate_set.getSize())]

    def run() -> None:
        # Setting the coordinates invalidates the results in the state.
        state.setQ(state.getQ())
        model.realizePosition(state)
        for muscle in muscles:
            for coordinate in coordinates:
                muscle.computeMomentArm(state, coordinate)

    return run


def prepare_equilibria(simulation: Simulation) -> Callable[[], None]:
    """Return a function that solves the equilibrium of the muscles in all states."""
    engine = simulation.engine
    states = create_states(simulation).tolist()

    def run() -> None:
        for y in states:
            engine.equilibrate_muscles(0.0, y)

    return run


# ----------------------------------------------------------------------------- first use, many runs
def measure_first_use(path: Path) -> str:
    """Return the times of two new processes that simulate a model, the first without a cache."""
    with tempfile.TemporaryDirectory() as cache:
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        # The cache is empty for the first process, and filled by it for the second.
        command = [sys.executable, "-c", FIRST_USE_SCRIPT, str(path)]
        seconds = []
        for _ in range(2):
            done = subprocess.run(
                command, env=environment, check=True, capture_output=True, text=True
            )
            seconds.append(float(done.stdout))
    return f"{seconds[0]:.2f} s the first time, {seconds[1]:.2f} s the second"


def compare_sweep(path: Path, console: Console) -> None:
    """Print the times of many runs of a model from different starts, and the growth of memory.

    Args:
        path: model file.
        console: console to print to.
    """
    sweep_plan = plan(osimlite.read(path), {"hip_flexion_r": "-0.1:0.1"}, to=TO, accuracy=ACCURACY)
    runner = Runner(sweep_plan)
    rows = choose_samples(sweep_plan.variables, "sobol", SWEEP_RUNS).make_block(0, SWEEP_RUNS)
    row = time_pair(
        f"{SWEEP_RUNS} runs of {SWEPT_MODEL}",
        ours=lambda: runner.run(rows),
        theirs=prepare_opensim_sweep(path, rows[: SWEEP_RUNS // OPENSIM_SHARE]),
        rounds=3,
        clock=time.process_time,
    )
    opensim_times = tuple(float(OPENSIM_SHARE) * seconds for seconds in row.theirs)
    print_pairs(
        "A sweep, processor time", [Pair(row.name, row.ours, opensim_times)], console=console
    )
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    samples = choose_samples(sweep_plan.variables, "sobol", 10 * SWEEP_RUNS)
    for first in range(0, 10 * SWEEP_RUNS, SWEEP_RUNS):
        runner.run(samples.make_block(first, first + SWEEP_RUNS))
    growth = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    console.print(
        f"{10 * SWEEP_RUNS} runs take {growth:.1f} MB more than {SWEEP_RUNS}", highlight=False
    )


def prepare_opensim_sweep(path: Path, rows: Any) -> Callable[[], None]:
    """Return a function that simulates from several hip angles in OpenSim.

    Args:
        path: model file.
        rows: hip angles (runs, 1), rad.
    """
    model = opensim.Model(str(path))
    state = model.initSystem()
    hip = model.getCoordinateSet().get("hip_flexion_r")

    def run() -> None:
        for (value,) in rows.tolist():
            start = opensim.State(state)
            hip.setValue(start, value, False)
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(ACCURACY)
            manager.initialize(start)
            manager.integrate(TO)

    return run


if __name__ == "__main__":
    main()
