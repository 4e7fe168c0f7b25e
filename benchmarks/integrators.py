"""Compare integrators of osimlite and of OpenSim on muscle-driven models at equal errors.

    python benchmarks/integrators.py [--picture FILE] [--cpodes] [NAME=FILE ...]

Without files, models of the shared corpus are measured, if it stands beside the repository; the
first one also with DeGrooteFregly2016 muscles with elastic tendons, and these also with low
excitations. Muscles start in equilibrium, get constant excitations of 0.05 to 0.25, and move the
model for 0.1 s.

The error is the largest difference of any state at the end from a simulation with accuracy 1e-9,
relative to states above 1. Each integrator runs at several accuracies. Times are processor times of
the integration alone, the median of several runs. The table gives for each integrator the time (ms)
and the number of evaluations at an error of 1e-4, interpolated between the accuracies, and the
ratio of the fastest integrators of OpenSim and of osimlite. --picture draws all errors and times.
--cpodes adds OpenSim's CPodes, which takes minutes.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from math import exp, inf, log
from pathlib import Path
from statistics import median
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, unpack_file
from osimlite.simulation import Simulation
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.options import INTEGRATORS

CORPUS_NAMES = {
    "gait10dof18musc": "m0005",
    "gait2392, Thelen": "m0014",
    "gait2392, Millard": "m0013",
    "Rajagopal": "m0954",
}
"""Names of the models in the corpus."""

DEGROOTE = " with DeGrooteFregly2016"
"""Suffix of the names of models whose muscles are replaced."""

LOW_EXCITATION = ", excited by 0.02"
"""Suffix of the names of models with low excitations."""

DURATION_S = 0.1

TARGET_ERROR = 1e-4
"""Error at which the integrators are compared."""

REFERENCE_ACCURACY = 1e-9

ACCURACIES = 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7

ENOUGH_MARGIN = 0.2
"""Share of `TARGET_ERROR` below which no finer accuracy is tried."""

ROUNDS = 5
"""Largest number of runs of an integrator of osimlite at one accuracy."""

MAX_TOTAL_TIME_S = 0.2
"""Processor time of all runs at one accuracy (s), after which a run is not repeated."""

MAX_DRAWN_ERROR = 10.0
"""Largest error that the picture shows."""

OPENSIM_PREFIX = "OpenSim"
"""Beginning of the names of OpenSim's integrators."""


class Motion(NamedTuple):
    """Result of one simulation.

    Attributes:
        state: final state (y,) in the engine's order, NaN if the integration failed.
        seconds: processor time of the integration (s).
        evaluations: number of evaluations of the forces, 0 where OpenSim does not report it.
    """

    state: np.ndarray
    seconds: float
    evaluations: int


class AccuracyRun(NamedTuple):
    """Error and cost of an integrator at one accuracy.

    Attributes:
        error: error of the final state, infinite if the integration failed.
        seconds: median processor time (s).
        evaluations: number of evaluations of the forces, 0 where OpenSim does not report it.
    """

    error: float
    seconds: float
    evaluations: int


class IntegratorCost(NamedTuple):
    """Cost of an integrator at `TARGET_ERROR`.

    Attributes:
        seconds: processor time (s), infinite if no accuracy reaches the error.
        evaluations: number of evaluations of the forces, 0 if it is unknown.
    """

    seconds: float
    evaluations: float


def find_models(words: list[str], folder: Path) -> dict[str, Path]:
    """Return the model files by name.

    Args:
        words: words ``NAME=FILE`` of the command line; without any the corpus is used.
        folder: folder for unpacked files.

    Returns:
        The files by name, without models that the corpus lacks.
    """
    if words:
        return {name: Path(path) for name, _, path in (word.partition("=") for word in words)}
    files = {}
    for name, number in CORPUS_NAMES.items():
        packed = CORPUS / f"{number}.osim.gz"
        if packed.exists():
            files[name] = unpack_file(packed, folder / f"{number}.osim")
    return files


def write_driven_models(files: dict[str, Path], folder: Path) -> Iterator[tuple[str, Path]]:
    """Write each model with a controller that prescribes constant excitations.

    Args:
        files: model files by name.
        folder: folder for the models.

    Yields:
        The name and the file of each model with its controller.
    """
    sources = dict(files)
    for name, file in list(files.items())[:1]:
        sources[name + DEGROOTE] = file
        sources[name + DEGROOTE + LOW_EXCITATION] = file
    for name, file in sources.items():
        processor = opensim.ModelProcessor(str(file))
        if DEGROOTE in name:
            processor.append(opensim.ModOpReplaceMusclesWithDeGrooteFregly2016())
        model = processor.process()
        model.initSystem()
        if DEGROOTE in name:
            use_elastic_tendons(model)
        add_excitations(model, is_low=LOW_EXCITATION in name)
        model.finalizeConnections()
        # The number of files makes the name unique.
        path = folder / f"{len(list(folder.iterdir()))}.driven.osim"
        model.printToXML(str(path))
        yield name, path


def use_elastic_tendons(model: Any) -> None:
    """Give the DeGrooteFregly2016 muscles of an OpenSim model tendons with explicit dynamics."""
    for index in range(model.getMuscles().getSize()):
        muscle = model.getMuscles().get(index)
        muscle.set_ignore_tendon_compliance(False)
        degroote = opensim.DeGrooteFregly2016Muscle.safeDownCast(muscle)
        degroote.set_tendon_compliance_dynamics_mode("explicit")


def add_excitations(model: Any, *, is_low: bool) -> None:
    """Add a controller with constant excitations of all muscles to an OpenSim model.

    Args:
        model: OpenSim model.
        is_low: whether all excitations are 0.02 instead of 0.05, 0.15 and 0.25 in turn.
    """
    controller = opensim.PrescribedController()
    for index in range(model.getMuscles().getSize()):
        muscle = model.getMuscles().get(index)
        excitation = 0.02 if is_low else 0.05 + 0.1 * (index % 3)
        controller.addActuator(muscle)
        controller.prescribeControlForActuator(
            muscle.getAbsolutePathString(), opensim.Constant(excitation)
        )
    model.addController(controller)


def measure_model(path: Path, *, with_cpodes: bool) -> dict[str, list[AccuracyRun]]:
    """Measure all integrators on a model.

    Args:
        path: model file with its controller.
        with_cpodes: whether OpenSim's CPodes is measured.

    Returns:
        The runs of each integrator at all accuracies, by the name of the integrator.
    """
    opensim_model = opensim.Model(str(path))
    opensim_model.initSystem()
    # With OpenSim's errors in derivatives of joints (docs/differences.md) both have one motion.
    with Simulation(osimlite.read(path), "compiled", opensim_derivatives=True) as simulation:
        exact = prepare_osimlite(simulation, "merson", REFERENCE_ACCURACY)().state
        runs = {
            label: run_accuracies(partial(prepare_osimlite, simulation, name), exact, ROUNDS)
            for name, label in INTEGRATORS.items()
        }
        state_paths = list_state_paths(simulation)
    methods = {"RungeKuttaMerson": opensim.Manager.IntegratorMethod_RungeKuttaMerson}
    if with_cpodes:
        methods["CPodes"] = opensim.Manager.IntegratorMethod_CPodes
    for name, method in methods.items():
        prepare = partial(prepare_opensim, opensim_model, state_paths, method)
        # OpenSim runs once at each accuracy, because it takes long.
        runs[f"{OPENSIM_PREFIX}, {name}"] = run_accuracies(prepare, exact, rounds=1)
    return runs


def run_accuracies(
    prepare: Callable[[float], Callable[[], Motion]], exact: np.ndarray, rounds: int
) -> list[AccuracyRun]:
    """Run an integrator with finer and finer accuracy until the error is small enough.

    Args:
        prepare: returns the simulation with an accuracy.
        exact: converged final state (y,).
        rounds: largest number of runs at one accuracy.
    """
    runs: list[AccuracyRun] = []
    for accuracy in ACCURACIES:
        runs.append(run_accuracy(prepare(accuracy), exact, rounds))
        if runs[-1].error < ENOUGH_MARGIN * TARGET_ERROR:
            break
    return runs


def run_accuracy(simulate: Callable[[], Motion], exact: np.ndarray, rounds: int) -> AccuracyRun:
    """Run an integrator at one accuracy several times.

    Args:
        simulate: simulates the motion.
        exact: converged final state (y,).
        rounds: largest number of runs.
    """
    motions = [simulate()]
    while len(motions) < rounds and len(motions) * motions[0].seconds < MAX_TOTAL_TIME_S:
        motions.append(simulate())
    first = motions[0]
    # Errors of states below 1 are absolute: otherwise states near zero would decide.
    error = float(np.max(np.abs(first.state - exact) / np.maximum(np.abs(exact), 1.0)))
    # A NaN would compare as neither small nor large.
    if np.isnan(error):
        error = inf
    return AccuracyRun(error, median(motion.seconds for motion in motions), first.evaluations)


def prepare_osimlite(
    simulation: Simulation, integrator: str, accuracy: float
) -> Callable[[], Motion]:
    """Return a function that simulates with an integrator of osimlite."""
    start = simulation.initial_state({}, {}, equilibrate=True)

    def simulate() -> Motion:
        settings = EngineSettings(accuracy=accuracy, integrator=integrator)
        began = time.process_time()
        # The callback records nothing.
        stepper = simulation.engine.make_stepper(0.0, start, settings, lambda t, y: None)
        stepper.tabulate([DURATION_S])
        seconds = time.process_time() - began
        state = np.array(stepper.state if stepper.ended is None else [np.nan] * len(start))
        return Motion(state, seconds, stepper.evaluations)

    return simulate


def list_state_paths(simulation: Simulation) -> list[str]:
    """Return OpenSim's paths of the states, in the engine's order."""
    coordinates = [simulation.mechanism.coordinates[index].path for index in simulation.state.order]
    return [
        *(f"{path}/value" for path in coordinates),
        *(f"{path}/speed" for path in coordinates),
        *simulation.state.paths,
    ]


def prepare_opensim(
    model: Any, state_paths: list[str], method: int, accuracy: float
) -> Callable[[], Motion]:
    """Return a function that simulates with an integrator of OpenSim.

    Args:
        model: OpenSim model.
        state_paths: paths of the states in the order of the result.
        method: OpenSim's number of the integrator.
        accuracy: accuracy of the integrator.
    """

    def simulate() -> Motion:
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        model.equilibrateMuscles(state)
        # A manager starts only once.
        manager = opensim.Manager(model)
        manager.setIntegratorMethod(method)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        began = time.process_time()
        try:
            end = manager.integrate(DURATION_S)
        except RuntimeError:
            # The integrator gives up: its error counts as infinite.
            return Motion(np.full(len(state_paths), np.nan), time.process_time() - began, 0)
        seconds = time.process_time() - began
        values = [model.getStateVariableValue(end, path) for path in state_paths]
        return Motion(np.array(values), seconds, 0)

    return simulate


def interpolate_cost(runs: list[AccuracyRun]) -> IntegratorCost:
    """Return the cost of an integrator at `TARGET_ERROR`.

    Time and evaluations are interpolated between the cheapest run with a smaller error and the most
    expensive run with a larger error that costs less, linearly in logarithms.
    """
    good_runs = [run for run in runs if run.error <= TARGET_ERROR]
    if not good_runs:
        return IntegratorCost(inf, 0.0)
    good = min(good_runs, key=lambda run: run.seconds)
    poor_runs = [
        run for run in runs if TARGET_ERROR < run.error < inf and run.seconds < good.seconds
    ]
    if not poor_runs:
        return IntegratorCost(good.seconds, float(good.evaluations))
    poor = max(poor_runs, key=lambda run: run.seconds)
    fraction = log(TARGET_ERROR / poor.error) / log(good.error / poor.error)

    def interpolate(start: float, end: float) -> float:
        # OpenSim's evaluations are 0, which has no logarithm.
        start = max(start, 1e-9)
        return exp(log(start) + fraction * log(max(end, 1e-9) / start))

    seconds = interpolate(poor.seconds, good.seconds)
    return IntegratorCost(seconds, round(interpolate(poor.evaluations, good.evaluations)))


def make_row(name: str, runs: dict[str, list[AccuracyRun]]) -> list[str]:
    """Return the row of a model: the cost of each integrator, and the ratio of the best ones.

    Args:
        name: name of the model.
        runs: runs by integrator.
    """
    costs = {integrator: interpolate_cost(row) for integrator, row in runs.items()}
    cells = []
    for cost in costs.values():
        digits = 0 if cost.seconds > 0.1 else 1
        evaluations = f" ({cost.evaluations:.0f})" if cost.evaluations > 0 else ""
        cells.append(f"{1e3 * cost.seconds:.{digits}f}{evaluations}")
    ours = min(cost.seconds for name, cost in costs.items() if not name.startswith(OPENSIM_PREFIX))
    theirs = min(cost.seconds for name, cost in costs.items() if name.startswith(OPENSIM_PREFIX))
    return [name, *cells, f"{theirs / ours:.0f}"]


def draw_picture(results: dict[str, dict[str, list[AccuracyRun]]], path: Path) -> None:
    """Draw a work-precision diagram for each model: error against processor time.

    Args:
        results: runs by model and integrator.
        path: picture to write.
    """
    from matplotlib import pyplot

    row_count = (len(results) + 2) // 3
    figure, grid = pyplot.subplots(
        row_count, 3, figsize=(9.6, 3.4 * row_count), layout="constrained", squeeze=False
    )
    all_axes = list(grid.flat)
    for axes, (name, runs) in zip(all_axes, results.items(), strict=False):
        for integrator, row in runs.items():
            drawn = [run for run in row if run.error < MAX_DRAWN_ERROR]
            axes.loglog(
                [1e3 * run.seconds for run in drawn],
                [run.error for run in drawn],
                "--o" if integrator.startswith(OPENSIM_PREFIX) else "-o",
                label=integrator,
                markersize=3,
            )
        axes.axhline(TARGET_ERROR, color="0.8", zorder=0)
        axes.set_title(fill(name, 32), fontsize=9)
        axes.set_xlabel(f"processor time for {DURATION_S:g} s, ms")
        axes.set_ylabel("error at the end")
    for axes in all_axes[len(results) :]:
        axes.axis("off")
    # All diagrams have the same integrators.
    handles = all_axes[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=5, fontsize=8)
    figure.savefig(path)


def main() -> None:
    """Run the command line."""
    opensim.Logger.setLevelString("off")
    words = sys.argv[1:]
    # The name of the picture may contain the sign of NAME=FILE.
    picture = Path(words.pop(words.index("--picture") + 1)) if "--picture" in words else None
    table = Table(
        title=f"{DURATION_S:g} s of motion at an error of {TARGET_ERROR:g}: "
        "processor time, ms (evaluations)"
    )
    results = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = find_models([word for word in words if "=" in word], folder)
        for name, path in write_driven_models(files, folder):
            runs = measure_model(path, with_cpodes="--cpodes" in words)
            results[name] = runs
            # The names of the integrators are known after the first model.
            if not table.columns:
                for heading in ("model", *runs, "OpenSim / osimlite"):
                    table.add_column(heading, justify="left" if heading == "model" else "right")
            table.add_row(*make_row(name, runs))
            # All runs, for those who wait for the table.
            Console(stderr=True).print(name, runs)
    Console(width=160).print(table)
    if picture:
        draw_picture(results, picture)


if __name__ == "__main__":
    main()
