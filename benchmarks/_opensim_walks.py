"""Walks by OpenSim itself: foot strikes from its own contact forces, judged by the rules of `osimlite.studies.gait`.

``python benchmarks/_opensim_walks.py FILE SECONDS ACCURACY`` makes one and prints it as JSON, which
is how several walk at a time.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import osimlite
from osimlite.simulation import Simulation
from osimlite.studies.gait.foot_contacts import find_footing
from osimlite.studies.gait.steps import (
    GaitStep,
    Scuff,
    WalkerSteps,
    follow_events,
    measure_along_slope,
)


class Order(NamedTuple):
    """What OpenSim is to do: model file, how long (s), accuracy of its integrator."""

    path: Path
    to: float
    accuracy: float


def opensim_walks(orders: Mapping[str, Order]) -> dict[str, tuple[WalkerSteps, float]]:
    """What OpenSim makes of each order, and the processor time (s) that it took; all at a time, each in its process."""
    with tempfile.TemporaryDirectory() as folder:
        running = {
            name: subprocess.Popen(
                [sys.executable, "-W", "ignore", __file__, *(str(each) for each in order)],
                cwd=folder, stdout=subprocess.PIPE, text=True,
            )
            for name, order in orders.items()
        }  # fmt: skip
        try:
            printed = {name: process.communicate()[0] for name, process in running.items()}
        finally:
            for process in running.values():
                process.kill()
                process.wait()
    for name, process in running.items():
        if process.returncode:
            raise RuntimeError(
                f"OpenSim did not walk with '{name}': it ended with {process.returncode}"
            )
    return {name: _from_json(text) for name, text in printed.items()}


def opensim_walk(path: Path, to: float, accuracy: float) -> tuple[WalkerSteps, float]:
    """What OpenSim makes of a file, and the processor time that it took (s).

    A touch-down is known to a step of its integrator; where the feet are then is computed from its
    states.
    """
    import opensim

    opensim.Logger.setLevelString("off")
    opensim.Logger.removeFileSink()
    began = time.process_time()
    theirs = opensim.Model(str(path))
    reporter = opensim.ForceReporter(theirs)
    theirs.addAnalysis(reporter)
    state = theirs.initSystem()
    manager = opensim.Manager(theirs)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    taken = time.process_time() - began
    names = theirs.getStateVariableNames()
    states = _States(manager.getStateStorage(), [names.get(k) for k in range(names.getSize())])
    with Simulation(osimlite.read(path), "compiled") as simulation:
        return _read_off(simulation.engine, reporter.getForceStorage(), states), taken


class _States(NamedTuple):
    """OpenSim's states at its steps, and the paths of what is in them.

    OpenSim makes a table of them too, but copies all of it for each row that is added.
    """

    storage: Any
    paths: list[str]

    def at(self, row: int, paths: list[str]) -> list[float]:
        values = self.storage.getStateVector(row).getData()
        return [values.get(self.paths.index(path)) for path in paths]


def _read_off(engine: Any, forces: Any, states: _States) -> WalkerSteps:
    labels = forces.getColumnLabels()
    columns = [labels.get(k) for k in range(labels.getSize())]
    times = _column(forces, "time")
    touching = []
    for contact in engine.contacts:
        own = [label for label in columns if label.startswith(f"{contact}.") and ".force." in label]
        touching.append(np.any([_column(forces, label) != 0.0 for label in own], axis=0))
    changes = [
        (k, contact, bool(pushes[k]))
        for contact, pushes in zip(engine.contacts, touching, strict=True)
        for k in (np.flatnonzero(np.diff(pushes)) + 1).tolist()
    ]
    changes.sort(key=lambda change: change[0])
    paths = [engine.mechanism.coordinates[place].path for place in engine.order]
    order = [f"{path}/{kind}" for kind in ("value", "speed") for path in paths]
    moments = np.array([states.at(k, order) for k, _, _ in changes])
    walk = follow_events(
        find_footing(engine),
        engine.contacts,
        [(float(times[k]), contact, begins) for k, contact, begins in changes],
        moments,
        measure_along_slope(engine, moments)[0],
        np.array([pushes[0] for pushes in touching]),
    )
    if walk.walks:
        walk.end = float(times[-1])
    return walk


def _column(storage: Any, label: str) -> Any:
    import opensim

    found = opensim.ArrayDouble()
    if label == "time":
        storage.getTimeColumn(found)
    else:
        storage.getDataColumn(label, found)
    return np.array([found.get(k) for k in range(found.getSize())])


def _to_json(walk: WalkerSteps, taken: float) -> str:
    """A walk without the states at its steps."""
    return json.dumps([{**vars(walk), "steps": [step[:4] for step in walk.steps]}, taken])


def _from_json(text: str) -> tuple[WalkerSteps, float]:
    found, taken = json.loads(text)
    found["steps"] = [GaitStep._make([*step, np.empty(0)]) for step in found["steps"]]
    found["scuffs"] = [Scuff._make(scuff) for scuff in found["scuffs"]]
    return WalkerSteps(**found), taken


if __name__ == "__main__":
    file, seconds, finest = sys.argv[1:]
    print(_to_json(*opensim_walk(Path(file), float(seconds), float(finest))))
