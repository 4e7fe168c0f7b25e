"""The walking models of the library, confirmed by OpenSim itself, and how much they put up with.

OpenSim reads the file that `osimlite build` writes and walks for 60 s; what touches the slope is read off the contact
forces that it reports at every step of its integrator. Then osimlite: Floquet multipliers, random starts near the
cycle, and how far each property that was changed may move, alone, while the walk goes on for 60 s.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.gait.basin import perturbed, walks_from
from osimlite.gait.cycle import find_cycle
from osimlite.gait.footing import find_footing
from osimlite.gait.stepmap import StepMap
from osimlite.gait.steps import Walk, along_slope, follow, walk_many
from osimlite.models.source import make_model
from osimlite.simulation import Simulation

TO = 60.0
CONFIRMED = {"steady-walker": 1e-8, "human-walker": 1e-6}
"""Accuracy at which OpenSim walks."""

CHANGED: dict[str, dict[str, float]] = {
    "steady-walker": {"shank_inertia": 0.091, "foot_ahead": 0.072},
    "human-walker": {"slope": 2.5, "foot_radius": 0.17, "foot_ahead": 0.044, "knee_stiffness": 15.8},
}
MANY = 50
"""So many steps in that time are a walk."""

FINEST = 2e-3
"""A margin is found to this part of the property's value."""


def main() -> None:
    console = Console()
    names = sys.argv[1:] or list(CONFIRMED)
    for part in (near, margins, confirmation):
        console.print(part(names))


def confirmation(names: list[str]) -> Table:
    table = Table(title=f"Walking for {TO:g} s")
    for heading in ("model", "accuracy", "program", "steps", "scuffs", "way (m)", "ends", "time taken (s)"):
        table.add_column(heading, justify="left" if heading in ("model", "program", "ends") else "right")
    for name in names:
        accuracy = CONFIRMED[name]
        for program, run in (("OpenSim", opensim_walk), ("osimlite", our_walk)):
            began = time.process_time()
            walk = run(make_model(name), TO, accuracy)
            taken = time.process_time() - began
            ends = walk.ending if walk.walks else f"fell on {walk.fell_on} at {walk.end:.2f} s"
            numbers = f"{len(walk.steps)}", f"{len(walk.scuffs)}", f"{walk.distance:.4f}"
            table.add_row(name, f"{accuracy:g}", program, *numbers, ends, f"{taken:.2f}")
    return table


def our_walk(model: osimlite.Model, to: float, accuracy: float) -> Walk:
    with Simulation(model, "compiled") as simulation:
        engine: Any = simulation.engine
        (walk,) = walk_many(engine, [simulation.initial_state({}, {})], to, accuracy=accuracy)
        return walk


def opensim_walk(model: osimlite.Model, to: float, accuracy: float) -> Walk:
    """What OpenSim makes of the model's file; steps and scuffs by the rules of osimlite, from OpenSim's forces."""
    opensim.Logger.setLevelString("off")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walker.osim"
        osimlite.write(model, path)
        theirs = opensim.Model(str(path))
    reporter = opensim.ForceReporter(theirs)
    theirs.addAnalysis(reporter)
    state = theirs.initSystem()
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    with Simulation(model, "compiled") as simulation:
        return _read_off(simulation.engine, reporter.getForcesTable(), manager.getStatesTable())


def _read_off(engine: Any, forces: Any, states: Any) -> Walk:
    """Touch-downs from OpenSim's forces, and where the feet are at OpenSim's states."""
    footing = find_footing(engine)
    times, matrix = np.array(forces.getIndependentColumn()), forces.getMatrix().to_numpy()
    labels = list(forces.getColumnLabels())
    touching = []
    for contact in engine.contacts:
        own = [k for k, label in enumerate(labels) if label.startswith(f"{contact}.") and ".force." in label]
        touching.append(np.abs(matrix[:, own]).max(axis=1) > 0.0)
    changes = [
        (k, contact, bool(pushes[k]))
        for contact, pushes in zip(engine.contacts, touching, strict=True)
        for k in (np.flatnonzero(np.diff(pushes)) + 1).tolist()
    ]
    changes.sort(key=lambda change: change[0])
    columns = list(states.getColumnLabels())
    paths = [engine.mechanism.coordinates[place].path for place in engine.order]
    order = [columns.index(f"{path}/{kind}") for kind in ("value", "speed") for path in paths]
    rows = np.searchsorted(states.getIndependentColumn(), [times[k] - 1e-12 for k, _, _ in changes])
    moments = states.getMatrix().to_numpy()[:, order][rows]
    walk = follow(
        footing,
        engine.contacts,
        [(float(times[k]), contact, begins) for k, contact, begins in changes],
        moments,
        along_slope(engine, moments)[0],
        np.array([pushes[0] for pushes in touching]),
    )
    if walk.walks:
        walk.end = float(times[-1])
    return walk


def near(names: list[str]) -> Table:
    table = Table(title="The cycle, and 60 random starts near the model's own")
    headings = ("model", "step (m)", "period (s)", "speed (m/s)", "fixed to", "largest multipliers", "5 %", "10 %")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "model" else "right")
    for name in names:
        with Simulation(make_model(name), "compiled") as simulation:
            engine: Any = simulation.engine
            start = simulation.initial_state({}, {})
            step_map = StepMap(engine, start, accuracy=1e-12)
            cycle = find_cycle(step_map)
            walks = [walks_from(step_map, cycle, perturbed(step_map, start, part, 60, 0), 20) for part in (0.05, 0.1)]
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
    table = Table(title=f"How far each changed property may move alone, from the same start, for {TO:g} s")
    for heading in ("model", "property", "least", "value", "most"):
        table.add_column(heading, justify="left" if heading in ("model", "property") else "right")
    for name in names:
        for parameter, value in CHANGED.get(name, {}).items():

            def walks(number: float, name: str = name, parameter: str = parameter) -> bool:
                return len(our_walk(make_model(name, {parameter: repr(number)}), TO, 1e-6).steps) >= MANY

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
