"""What an error costs: osimlite's integrators and OpenSim's on muscle-driven models, in processor time.

    python benchmarks/integrators.py [--picture FILE] [--cpodes] [NAME=FILE ...]

Without files: models of the shared corpus, if that stands beside the repository; the first with
DeGrooteFregly2016 muscles and elastic tendons too, once with low excitations. Muscles start in
equilibrium, are excited by 0.05 to 0.25, and move the model for 0.1 s. The error is the largest
difference of any state at the end from a converged run (accuracy 1e-9), relative to states above 1.
Times are of the steps alone, the median of several runs in turn. What is told at one error is
interpolated between the accuracies that were tried. OpenSim's CPodes takes minutes.
"""

from __future__ import annotations

import gzip
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from math import exp, log
from pathlib import Path
from statistics import median
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS
from osimlite.simulation import Simulation
from osimlite.simulation.engines.protocol import EngineSettings
from osimlite.simulation.options import INTEGRATORS

REAL = {
    "gait10dof18musc": "m0005",
    "gait2392, Thelen": "m0014",
    "gait2392, Millard": "m0013",
    "Rajagopal": "m0954",
}
LOW = ", excited by 0.02"
DEGROOTE, TO, ERROR, CONVERGED, ROUNDS = " with DeGrooteFregly2016", 0.1, 1e-4, 1e-9, 5
ENOUGH = 0.2
"""Processor time (s) after which a run is not repeated."""
ACCURACIES = 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7


class Run(NamedTuple):
    """What a motion erred and cost: processor time (s) and evaluations, 0 where OpenSim does not tell."""

    error: float
    seconds: float
    evaluations: int


def main() -> None:
    opensim.Logger.setLevelString("off")
    words = sys.argv[1:]
    picture = Path(words.pop(words.index("--picture") + 1)) if "--picture" in words else None
    table = Table(
        title=f"{TO:g} s of motion at an error of {ERROR:g}: processor time, ms (evaluations)"
    )
    found: dict[str, dict[str, list[Run]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, path in models([word for word in words if "=" in word], Path(folder)):
            found[name] = runs = measured(path)
            if not table.columns:
                for heading in ("model", *runs, "times faster"):
                    table.add_column(heading, justify="left" if heading == "model" else "right")
            costs = [at_error(row) for row in runs.values()]
            ours = min(
                cost[0]
                for name, cost in zip(runs, costs, strict=True)
                if not name.startswith("OpenSim")
            )
            theirs = min(
                cost[0]
                for name, cost in zip(runs, costs, strict=True)
                if name.startswith("OpenSim")
            )
            told = [
                f"{1e3 * seconds:.{0 if seconds > 0.1 else 1}f}" + f" ({count:.0f})" * (count > 0)
                for seconds, count in costs
            ]
            table.add_row(name, *told, f"{theirs / ours:.0f}")
            Console(stderr=True).print(name, runs)
    Console(width=160).print(table)
    if picture:
        draw(found, picture)


def models(given: list[str], folder: Path) -> Iterator[tuple[str, Path]]:
    """Name and file of each model, with its controls."""
    paths = {name: Path(path) for name, _, path in (word.partition("=") for word in given)}
    for name, number in {} if given else REAL.items():
        path = CORPUS / f"{number}.osim.gz"
        if path.exists():
            paths[name] = folder / f"{number}.osim"
            paths[name].write_bytes(gzip.decompress(path.read_bytes()))
    for name in (
        *paths,
        *(f"{name}{DEGROOTE}{low}" for name in list(paths)[:1] for low in ("", LOW)),
    ):
        processor = opensim.ModelProcessor(
            str(paths[name.removesuffix(LOW).removesuffix(DEGROOTE)])
        )
        if DEGROOTE in name:
            processor.append(opensim.ModOpReplaceMusclesWithDeGrooteFregly2016())
        model = processor.process()
        model.initSystem()
        brain = opensim.PrescribedController()
        for k in range(model.getMuscles().getSize()):
            muscle = model.getMuscles().get(k)
            if DEGROOTE in name:
                muscle.set_ignore_tendon_compliance(False)
                opensim.DeGrooteFregly2016Muscle.safeDownCast(
                    muscle
                ).set_tendon_compliance_dynamics_mode("explicit")
            brain.addActuator(muscle)
            brain.prescribeControlForActuator(
                muscle.getAbsolutePathString(),
                opensim.Constant(0.02 if LOW in name else 0.05 + 0.1 * (k % 3)),
            )
        model.addController(brain)
        model.finalizeConnections()
        path = folder / f"{len(list(folder.iterdir()))}.driven.osim"
        model.printToXML(str(path))
        yield name, path


def measured(path: Path) -> dict[str, list[Run]]:
    """The runs of each integrator."""
    theirs = opensim.Model(str(path))
    theirs.initSystem()
    with Simulation(osimlite.read(path), "compiled", opensim_derivatives=True) as simulation:
        exact = our_motion(simulation, "merson", CONVERGED)()[0]
        found = {
            shown: tried(partial(our_motion, simulation, name), exact, ROUNDS)
            for name, shown in INTEGRATORS.items()
        }
        paths = simulation_paths(simulation)
    asked = {"OpenSim, RungeKuttaMerson": opensim.Manager.IntegratorMethod_RungeKuttaMerson}
    if "--cpodes" in sys.argv:
        asked["OpenSim, CPodes"] = opensim.Manager.IntegratorMethod_CPodes
    for name, method in asked.items():
        found[name] = tried(partial(their_motion, theirs, paths, method), exact, 1)
    return found


def tried(
    motion: Callable[[float], Callable[[], tuple[Any, float, int]]], exact: Any, rounds: int
) -> list[Run]:
    """Runs at ever more accuracy, until one errs much less than what is asked."""
    found: list[Run] = []
    for accuracy in ACCURACIES:
        found.append(run(motion(accuracy), exact, rounds))
        if found[-1].error < 0.2 * ERROR:
            break
    return found


def run(motion: Callable[[], tuple[Any, float, int]], exact: Any, rounds: int) -> Run:
    """One integrator at one accuracy; without an error if it fails."""
    ends = [motion()]
    while len(ends) < rounds and len(ends) * ends[0][1] < ENOUGH:
        ends.append(motion())
    error = float(np.max(np.abs(ends[0][0] - exact) / np.maximum(np.abs(exact), 1.0)))
    return Run(
        error if error == error else float("inf"), median(end[1] for end in ends), ends[0][2]
    )


def our_motion(
    simulation: Simulation, integrator: str, accuracy: float
) -> Callable[[], tuple[Any, float, int]]:
    start = simulation.initial_state({}, {}, equilibrate=True)

    def motion() -> tuple[Any, float, int]:
        settings = EngineSettings(accuracy=accuracy, integrator=integrator)
        began = time.process_time()
        stepper = simulation.engine.make_stepper(0.0, start, settings, lambda t, y: None)
        stepper.tabulate([TO])
        took = time.process_time() - began
        return (
            np.array(stepper.state if stepper.ended is None else [np.nan] * len(start)),
            took,
            stepper.evaluations,
        )

    return motion


def simulation_paths(simulation: Simulation) -> list[str]:
    """The states in the engine's order, as OpenSim calls them."""
    infos = [simulation.mechanism.coordinates[place].path for place in simulation.state.order]
    return [f"{path}/{what}" for what in ("value", "speed") for path in infos] + list(
        simulation.state.paths
    )


def their_motion(
    model: Any, paths: list[str], method: int, accuracy: float
) -> Callable[[], tuple[Any, float, int]]:
    def motion() -> tuple[Any, float, int]:
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        model.equilibrateMuscles(state)
        manager = opensim.Manager(model)
        manager.setIntegratorMethod(method)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        began = time.process_time()
        try:
            end = manager.integrate(TO)
        except RuntimeError:
            return np.full(len(paths), np.nan), time.process_time() - began, 0
        took = time.process_time() - began
        return np.array([model.getStateVariableValue(end, path) for path in paths]), took, 0

    return motion


def at_error(runs: list[Run]) -> tuple[float, float]:
    """Time (s) and evaluations at the error, between the runs beside it; infinite if none gets there."""
    better = [item for item in runs if item.error <= ERROR]
    if not better:
        return float("inf"), 0.0
    best = min(better, key=lambda item: item.seconds)
    worse = [
        item for item in runs if ERROR < item.error < float("inf") and item.seconds < best.seconds
    ]
    if not worse:
        return best.seconds, float(best.evaluations)
    last = max(worse, key=lambda item: item.seconds)
    part = log(ERROR / last.error) / log(best.error / last.error)
    seconds, count = (
        exp(log(max(one, 1e-9)) + part * log(max(other, 1e-9) / max(one, 1e-9)))
        for one, other in ((last.seconds, best.seconds), (last.evaluations, best.evaluations))
    )
    return seconds, round(count)


def draw(found: dict[str, dict[str, list[Run]]], path: Path) -> None:
    """A work-precision diagram for each model."""
    from matplotlib import pyplot

    rows = (len(found) + 2) // 3
    figure, axes = pyplot.subplots(
        rows, 3, figsize=(9.6, 3.4 * rows), layout="constrained", squeeze=False
    )
    places = list(axes.flat)
    for axis, (name, runs) in zip(places, found.items(), strict=False):
        for method, row in runs.items():
            good = [item for item in row if item.error < 10.0]
            axis.loglog(
                [1e3 * item.seconds for item in good],
                [item.error for item in good],
                "--o" if method.startswith("OpenSim") else "-o",
                label=method,
                markersize=3,
            )
        axis.axhline(ERROR, color="0.8", zorder=0)
        axis.set_title(fill(name, 32), fontsize=9)
        axis.set_xlabel(f"processor time for {TO:g} s, ms")
        axis.set_ylabel("error at the end")
    for axis in places[len(found) :]:
        axis.axis("off")
    figure.legend(
        *places[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=8
    )
    figure.savefig(path)


if __name__ == "__main__":
    main()
