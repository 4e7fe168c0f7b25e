"""The Dynamic Walker, two seconds: osimlite's engines and OpenSim's Manager, side by side in one run.

Warm: the model is read and made ready once; what is timed is the motion alone, from the default
pose, in processor time. Both integrate with Runge-Kutta-Merson, OpenSim records its states at every
step, osimlite every 10 ms. Whole processes are in all.py. The error is the largest difference of
any coordinate (rad or m) from the converged motion, at t = 2 s.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _pair import pair, report
from osimlite.simulation import Simulation

MODEL = Path(__file__).resolve().parent.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"
TO = 2.0
ACCURACIES = (1e-3, 1e-5, 1e-6)
CONVERGED = 1e-10
ROUNDS, WARM_UP = 15, 2

ENGINES = {"PyBullet": "bullet", "compiled": "compiled"}
THEIRS = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model({model!r})
state = model.initSystem()
manager = opensim.Manager(model)
manager.setIntegratorAccuracy({accuracy})
manager.initialize(state)
manager.integrate({to})
"""


def main() -> None:
    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(MODEL))
    model.initSystem()
    console = Console()
    simulations = {
        name: Simulation(osimlite.read(MODEL), engine) for name, engine in ENGINES.items()
    }
    exact = run_ours(simulations["compiled"], CONVERGED)()
    errors = Table(title="Error at 2 s")
    for heading in ("accuracy", *ENGINES, "OpenSim"):
        errors.add_column(heading, justify="right")
    warm = []
    for accuracy in ACCURACIES:
        theirs = run_opensim(model, accuracy, 1 + len(ENGINES) * (WARM_UP + ROUNDS))
        runs = {name: run_ours(simulation, accuracy) for name, simulation in simulations.items()}
        ends = [
            max(abs(a - b) for a, b in zip(run(), exact, strict=True))
            for run in (*runs.values(), theirs)
        ]
        errors.add_row(f"{accuracy:g}", *(f"{end:.2g}" for end in ends))
        for name, run in runs.items():
            title, clock = f"{name}, {accuracy:g}", time.process_time
            warm.append(
                pair(title, ours=run, theirs=theirs, rounds=ROUNDS, warmup=WARM_UP, clock=clock)
            )
    for simulation in simulations.values():
        simulation.close()
    console.print(errors)
    report(f"Dynamic Walker, {TO:g} s, warm, by accuracy", warm, console=console)


def run_ours(simulation: Simulation, accuracy: float, to: float = TO) -> Callable[[], list[float]]:
    def run() -> list[float]:
        trajectory = simulation.run(to, accuracy=accuracy)
        return [float(value) for value in trajectory.values[-1]]

    return run


def run_opensim(
    model: Any, accuracy: float, runs: int, to: float = TO
) -> Callable[[], list[float]]:
    coordinates = model.getCoordinateSet()
    # A manager starts once. All are made ready here, so that only the motion is timed.
    ready = []
    for _ in range(runs):
        state = opensim.State(model.initializeState())
        state.setTime(0.0)
        manager = opensim.Manager(model)
        manager.setIntegratorAccuracy(accuracy)
        manager.initialize(state)
        ready.append(manager)

    def run() -> list[float]:
        # The state it returns lives as long as the manager.
        manager = ready.pop()
        end = manager.integrate(to)
        return [coordinates.get(place).getValue(end) for place in range(coordinates.getSize())]

    return run


if __name__ == "__main__":
    main()
