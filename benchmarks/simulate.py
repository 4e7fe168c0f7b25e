"""Simulation speed of the Dynamic Walker with osimlite's engines and with OpenSim's Manager.

    python benchmarks/simulate.py

The walker moves for two seconds. The models are read and initialised once. Only the motion from the
default pose is timed, in processor time; the programs run in turn. Both integrate with the method
of Runge, Kutta and Merson. OpenSim records its states at every step, osimlite every 10 ms. Complete
processes are timed by all.py.

The first table has the error of each program at t = 2 s: the largest difference of any coordinate
(rad or m) from a motion at accuracy 1e-10. The second has the times and their ratios.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import WALKER
from _pair import Pair, print_pairs, time_pair
from osimlite.simulation import Simulation

TO = 2.0
"""End of the simulation (s)."""

ACCURACIES = (1e-3, 1e-5, 1e-6)
"""Relative accuracies of the integrators that are compared."""

REFERENCE_ACCURACY = 1e-10
"""Accuracy of the motion that serves as the exact one."""

ROUNDS = 15
"""Number of timed pairs of runs."""

WARM_UP_ROUNDS = 2
"""Number of pairs before the timed ones."""

ENGINES = {"PyBullet": "bullet", "compiled": "compiled"}
"""Heading of each engine of osimlite in the tables, and its name in the package."""

OPENSIM_SCRIPT = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model({model!r})
state = model.initSystem()
manager = opensim.Manager(model)
manager.setIntegratorAccuracy({accuracy})
manager.initialize(state)
manager.integrate({to})
"""
"""Script of a complete OpenSim process; all.py fills in model, accuracy and end time."""


def main() -> None:
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(WALKER))
    model.initSystem()
    console = Console()
    simulations = {
        name: Simulation(osimlite.read(WALKER), engine) for name, engine in ENGINES.items()
    }
    # All programs converge to the same motion, so that one of them can provide the reference.
    exact = prepare_osimlite_runs(simulations["compiled"], REFERENCE_ACCURACY)()
    errors = Table(title=f"Error at {TO:g} s, rad or m")
    for heading in ("accuracy", *ENGINES, "OpenSim"):
        errors.add_column(heading, justify="right")
    times: list[Pair] = []
    for accuracy in ACCURACIES:
        # One run of OpenSim for the errors, and one for each round of each engine.
        opensim_runs = 1 + len(ENGINES) * (WARM_UP_ROUNDS + ROUNDS)
        theirs = prepare_opensim_runs(model, accuracy, opensim_runs)
        runs = {
            name: prepare_osimlite_runs(simulation, accuracy)
            for name, simulation in simulations.items()
        }
        cells = [f"{measure_error(run(), exact):.2g}" for run in (*runs.values(), theirs)]
        errors.add_row(f"{accuracy:g}", *cells)
        times += time_engines(accuracy, runs, theirs)
    for simulation in simulations.values():
        simulation.close()
    console.print(errors)
    print_pairs(f"Dynamic Walker, {TO:g} s, warm, by accuracy", times, console=console)


def measure_error(values: list[float], exact: list[float]) -> float:
    """Return the largest difference between two lists of coordinate values (rad or m)."""
    return max(abs(value - reference) for value, reference in zip(values, exact, strict=True))


def time_engines(
    accuracy: float, runs: dict[str, Callable[[], list[float]]], theirs: Callable[[], list[float]]
) -> list[Pair]:
    """Time each engine of osimlite in turn with OpenSim, in processor time.

    Args:
        accuracy: relative accuracy of the integrators, for the names of the rows.
        runs: one run of osimlite for each engine.
        theirs: one run of OpenSim.
    """
    return [
        time_pair(
            f"{name}, {accuracy:g}",
            ours=run,
            theirs=theirs,
            rounds=ROUNDS,
            warmup=WARM_UP_ROUNDS,
            clock=time.process_time,
        )
        for name, run in runs.items()
    ]


def prepare_osimlite_runs(
    simulation: Simulation, accuracy: float, to: float = TO
) -> Callable[[], list[float]]:
    """Return a function that simulates from the default pose and returns the final coordinates.

    Args:
        simulation: simulation of the model.
        accuracy: relative accuracy of the integrator.
        to: end of the simulation (s).
    """

    def run() -> list[float]:
        trajectory = simulation.run(to, accuracy=accuracy)
        return [float(value) for value in trajectory.values[-1]]

    return run


def prepare_opensim_runs(
    model: Any, accuracy: float, runs: int, to: float = TO
) -> Callable[[], list[float]]:
    """Return a function that simulates in OpenSim and returns the final coordinates.

    Args:
        model: initialised OpenSim model.
        accuracy: relative accuracy of the integrator.
        runs: how often the function can be called.
        to: end of the simulation (s).
    """
    coordinates = model.getCoordinateSet()
    # A manager can start only once. Initialise all of them here, so that only the motion is timed.
    managers = []
    for _ in range(runs):
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        managers.append(manager)

    def run() -> list[float]:
        # The state that `integrate` returns lives only as long as its manager.
        manager = managers.pop()
        end = manager.integrate(to)
        return [coordinates.get(index).getValue(end) for index in range(coordinates.getSize())]

    return run


if __name__ == "__main__":
    main()
