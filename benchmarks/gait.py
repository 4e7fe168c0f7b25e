"""The walking models of the library, confirmed by OpenSim itself, and how much they put up with.

OpenSim reads the file that `osimlite build` writes and walks for 60 s; what touches the slope is
read off the contact forces that it reports at every step of its integrator. Then osimlite: Floquet
multipliers, random starts near the cycle, and how far each property that was changed may move,
alone, while the walk goes on for 60 s.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _opensim_walks import Order, opensim_walks
from osimlite.models.source import list_parameters, make_model
from osimlite.simulation import Simulation
from osimlite.studies.gait.basin import sample_perturbed_starts, simulate_walks
from osimlite.studies.gait.cycle import find_cycle
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import WalkerSteps, walk_many

TO = 60.0
CONFIRMED = {"steady-walker": 1e-8, "human-walker": 1e-6, "furthest-walker": 1e-8}
"""Accuracy at which OpenSim walks."""

MANY = 50
"""So many steps in that time are a walk."""

FINEST = 2e-3
"""A margin is found to this part of the property's value."""


def main() -> None:
    console = Console()
    names = sys.argv[1:] or list(CONFIRMED)
    for part in (near, margins):
        console.print(part([name for name in names if list_parameters(name)]))
    console.print(confirmation(names))


def confirmation(names: list[str]) -> Table:
    table = Table(title=f"Walking for {TO:g} s")
    for heading in (
        "model",
        "accuracy",
        "program",
        "steps",
        "scuffs",
        "way (m)",
        "ends",
        "time taken (s)",
    ):
        table.add_column(
            heading, justify="left" if heading in ("model", "program", "ends") else "right"
        )
    with tempfile.TemporaryDirectory() as folder:
        orders = {name: Order(Path(folder) / f"{name}.osim", TO, CONFIRMED[name]) for name in names}
        for name, order in orders.items():
            osimlite.write(make_model(name), order.path)
        theirs = opensim_walks(orders)
    for name in names:
        began = time.process_time()
        ours = our_walk(make_model(name), TO, CONFIRMED[name]), time.process_time() - began
        for program, (walk, taken) in (("OpenSim", theirs[name]), ("osimlite", ours)):
            ends = walk.ending if walk.walks else f"fell on {walk.fell_on} at {walk.end:.2f} s"
            numbers = f"{len(walk.steps)}", f"{len(walk.scuffs)}", f"{walk.distance:.6f}"
            table.add_row(name, f"{CONFIRMED[name]:g}", program, *numbers, ends, f"{taken:.2f}")
    return table


def our_walk(model: osimlite.Model, to: float, accuracy: float) -> WalkerSteps:
    with Simulation(model, "compiled") as simulation:
        engine: Any = simulation.engine
        (walk,) = walk_many(engine, [simulation.initial_state({}, {})], to, accuracy=accuracy)
        return walk


def near(names: list[str]) -> Table:
    table = Table(title="The cycle, and 60 random starts near the model's own")
    headings = (
        "model",
        "step (m)",
        "period (s)",
        "speed (m/s)",
        "fixed to",
        "largest multipliers",
        "5 %",
        "10 %",
    )
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "model" else "right")
    for name in names:
        with Simulation(make_model(name), "compiled") as simulation:
            engine: Any = simulation.engine
            start = simulation.initial_state({}, {})
            step_map = StepMap(engine, start, accuracy=1e-12)
            cycle = find_cycle(step_map)
            walks = [
                simulate_walks(
                    step_map, cycle, sample_perturbed_starts(step_map, start, part, 60, 0), 20
                )
                for part in (0.05, 0.1)
            ]
            table.add_row(
                name,
                f"{cycle.length:.6f}",
                f"{cycle.period:.6f}",
                f"{cycle.speed:.6f}",
                f"{cycle.residual:.1g}",
                ", ".join(f"{size:.4f}" for size in np.abs(cycle.multipliers[:3])),
                *(f"{sum(len(walk.steps) >= 20 for walk in some)}" for some in walks),
            )
    return table


def margins(names: list[str]) -> Table:
    table = Table(
        title=f"How far each changed property may move alone, from the same start, for {TO:g} s"
    )
    for heading in ("model", "property", "least", "value", "most"):
        table.add_column(heading, justify="left" if heading in ("model", "property") else "right")
    for name in names:
        for parameter, value in list_parameters(name).items():

            def walks(number: float, name: str = name, parameter: str = parameter) -> bool:
                return (
                    len(our_walk(make_model(name, {parameter: repr(number)}), TO, 1e-6).steps)
                    >= MANY
                )

            least, most = (_edge(walks, value, side) for side in (-1.0, 1.0))
            table.add_row(name, parameter, f"{least:.4g}", f"{value:g}", f"{most:.4g}")
    return table


def _edge(walks: Callable[[float], bool], value: float, side: float) -> float:
    """The last value that walks, going away from one that does until one does not, then halving."""
    good, step = value, 0.01 * abs(value)
    while walks(good + side * step) and step < abs(value):
        good += side * step
        step *= 1.5
    bad = good + side * step
    while abs(bad - good) > FINEST * abs(value):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if walks(middle) else (good, middle)
    return good


if __name__ == "__main__":
    main()
