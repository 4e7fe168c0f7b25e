"""Check the walking models of the library with OpenSim, and measure how robust their walks are.

    python benchmarks/gait.py [NAME ...]

NAMEs are built-in walkers, by default those of `ACCURACIES`. Three tables are printed:

1. The gait cycle that osimlite finds near the initial state of the model, its Floquet multipliers,
   and how many of 60 random initial states near it walk 20 steps.
2. How far each parameter of the model can change alone while the walker still walks for 60 s.
3. The walk of 60 s by OpenSim and by osimlite: steps, scuffs, distance, and processor time. OpenSim
   reads the file that `osimlite build` writes. Its foot strikes are found in the contact forces
   that it reports at each step of its integrator.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from _opensim_walks import WalkRequest, simulate_opensim_walks
from osimlite.models.source import list_parameters, make_model
from osimlite.simulation import Simulation
from osimlite.studies.gait.basin import sample_perturbed_starts, simulate_walks
from osimlite.studies.gait.cycle import find_cycle
from osimlite.studies.gait.stepmap import StepMap
from osimlite.studies.gait.steps import WalkerSteps, walk_many

DURATION_S = 60.0
"""Duration of a walk (s)."""

ACCURACIES = {"steady-walker": 1e-8, "human-walker": 1e-6, "furthest-walker": 1e-8}
"""Integrator accuracy of OpenSim's walk, by model.

The knees of the human walker stop so hard that a finer accuracy takes OpenSim very long.
"""

CYCLE_ACCURACY = 1e-12
"""Integrator accuracy of the step map.

Its Jacobian consists of central differences, which magnify the error of the integration.
"""

MARGIN_ACCURACY = 1e-6
"""Integrator accuracy of the walks that find margins of parameters."""

MIN_STEPS = 50
"""Least number of steps in `DURATION_S` that counts as a walk."""

MARGIN_RESOLUTION = 2e-3
"""Resolution of the margin of a parameter, relative to its value."""

START_COUNT = 60
"""Number of random initial states."""

START_STEPS = 20
"""Number of steps after which a walk from a random initial state is a success."""

PERTURBATIONS = (0.05, 0.1)
"""Sizes of the random changes of the initial state, relative to its values."""


def make_table(title: str, headings: Sequence[str], text_columns: Sequence[str]) -> Table:
    """Return an empty table whose columns are aligned right, but for columns of text."""
    table = Table(title=title)
    for heading in headings:
        table.add_column(heading, justify="left" if heading in text_columns else "right")
    return table


def measure_cycles(names: list[str]) -> Table:
    """Return the table of gait cycles and of walks from random initial states."""
    headings = (
        "model",
        "step (m)",
        "period (s)",
        "speed (m/s)",
        "residual of the cycle",
        "largest multipliers",
        *(f"walks, {size:.0%} perturbed" for size in PERTURBATIONS),
    )
    title = f"Gait cycle, and walks from {START_COUNT} random initial states near the model's own"
    table = make_table(title, headings, ["model"])
    for name in names:
        with Simulation(make_model(name), "compiled") as simulation:
            engine: Any = simulation.engine
            start = simulation.initial_state({}, {})
            step_map = StepMap(engine, start, accuracy=CYCLE_ACCURACY)
            cycle = find_cycle(step_map)
            successes = []
            for size in PERTURBATIONS:
                # With a fixed seed each run of this script draws the same states.
                starts = sample_perturbed_starts(step_map, start, size, START_COUNT, seed=0)
                walks = simulate_walks(step_map, cycle, starts, START_STEPS)
                successes.append(sum(len(walk.steps) >= START_STEPS for walk in walks))
            table.add_row(
                name,
                f"{cycle.length:.6f}",
                f"{cycle.period:.6f}",
                f"{cycle.speed:.6f}",
                f"{cycle.residual:.1g}",
                ", ".join(f"{size:.4f}" for size in np.abs(cycle.multipliers[:3])),
                *map(str, successes),
            )
    return table


def measure_margins(names: list[str]) -> Table:
    """Return the table of the range of each parameter in which a model walks."""
    title = f"Range of each parameter, changed alone, in which the model walks for {DURATION_S:g} s"
    headings = ("model", "parameter", "least", "value", "largest")
    table = make_table(title, headings, ["model", "parameter"])
    for name in names:
        for parameter, value in list_parameters(name).items():
            # The default values keep the current name and parameter of the loop.
            def can_walk(number: float, name: str = name, parameter: str = parameter) -> bool:
                # The text of the number has all its digits.
                model = make_model(name, {parameter: repr(number)})
                walk = simulate_walk(model, DURATION_S, MARGIN_ACCURACY)
                return len(walk.steps) >= MIN_STEPS

            least = find_margin(can_walk, value, direction=-1.0)
            largest = find_margin(can_walk, value, direction=1.0)
            table.add_row(name, parameter, f"{least:.4g}", f"{value:g}", f"{largest:.4g}")
    return table


def find_margin(can_walk: Callable[[float], bool], value: float, direction: float) -> float:
    """Find the last value of a parameter with which the model walks.

    The search goes away from `value` in growing steps until the model falls, then bisects.

    Args:
        can_walk: says whether the model walks with a value of the parameter.
        value: value of the parameter with which the model walks.
        direction: 1 to search larger values, -1 to search smaller ones.
    """
    good = value
    step = 0.01 * abs(value)
    while can_walk(good + direction * step) and step < abs(value):
        good += direction * step
        # The steps grow, because the size of the margin is unknown.
        step *= 1.5
    bad = good + direction * step
    while abs(bad - good) > MARGIN_RESOLUTION * abs(value):
        middle = 0.5 * (good + bad)
        if can_walk(middle):
            good = middle
        else:
            bad = middle
    return good


def compare_with_opensim(names: list[str]) -> Table:
    """Return the table of walks by OpenSim and by osimlite."""
    headings = (
        "model",
        "accuracy",
        "program",
        "steps",
        "scuffs",
        "distance (m)",
        "end",
        "processor time (s)",
    )
    table = make_table(f"Walking for {DURATION_S:g} s", headings, ["model", "program", "end"])
    with tempfile.TemporaryDirectory() as folder:
        requests = {}
        for name in names:
            path = Path(folder) / f"{name}.osim"
            osimlite.write(make_model(name), path)
            requests[name] = WalkRequest(path, DURATION_S, ACCURACIES[name])
        # They run in parallel; processor times do not depend on each other.
        theirs = simulate_opensim_walks(requests)
    for name in names:
        start = time.process_time()
        walk = simulate_walk(make_model(name), DURATION_S, ACCURACIES[name])
        ours = walk, time.process_time() - start
        for program, (walk, seconds) in (("OpenSim", theirs[name]), ("osimlite", ours)):
            table.add_row(
                name,
                f"{ACCURACIES[name]:g}",
                program,
                str(len(walk.steps)),
                str(len(walk.scuffs)),
                f"{walk.distance:.6f}",
                walk.ending if walk.walks else f"fell on {walk.fell_on} at {walk.end:.2f} s",
                f"{seconds:.2f}",
            )
    return table


def simulate_walk(model: osimlite.Model, duration: float, accuracy: float) -> WalkerSteps:
    """Simulate a walk with osimlite from the default state of a model.

    Args:
        model: walker.
        duration: simulated time (s).
        accuracy: accuracy of the integrator.
    """
    with Simulation(model, "compiled") as simulation:
        engine: Any = simulation.engine
        start = simulation.initial_state({}, {})
        # A walk is a sweep of one walker.
        (walk,) = walk_many(engine, [start], duration, accuracy=accuracy)
        return walk


def main() -> None:
    """Print the three tables."""
    console = Console()
    names = sys.argv[1:] or list(ACCURACIES)
    # The furthest walker has no parameters: it falls after four steps, and has no cycle.
    parametric = [name for name in names if list_parameters(name)]
    for measure in (measure_cycles, measure_margins):
        console.print(measure(parametric))
    console.print(compare_with_opensim(names))


if __name__ == "__main__":
    main()
