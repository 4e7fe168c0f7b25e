"""Walks that OpenSim simulates, evaluated by the rules of `osimlite.studies.gait`.

OpenSim integrates the model and reports its contact forces. A foot strike is a change of a contact
force from zero; the rules of osimlite decide which strikes are steps, which are scuffs, and whether
the walker has fallen.

``python benchmarks/_opensim_walks.py FILE SECONDS ACCURACY`` simulates one walk and prints it as
JSON. `simulate_opensim_walks` starts one such process for each walk, so that they run in parallel.
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


class WalkRequest(NamedTuple):
    """Simulation that OpenSim is to run.

    Attributes:
        path: model file.
        to: final time (s).
        accuracy: accuracy of OpenSim's integrator.
    """

    path: Path
    to: float
    accuracy: float


def simulate_opensim_walks(
    requests: Mapping[str, WalkRequest],
) -> dict[str, tuple[WalkerSteps, float]]:
    """Simulate walks with OpenSim in parallel, each in a process of its own.

    Args:
        requests: simulations by name.

    Returns:
        The steps of each walk and the processor time of its integration (s), by name.

    Raises:
        RuntimeError: the process of a walk failed.
    """
    with tempfile.TemporaryDirectory() as folder:
        processes = {
            name: subprocess.Popen(
                # OpenSim's bindings warn when they are imported.
                [sys.executable, "-W", "ignore", __file__, *map(str, request)],
                # OpenSim may write a log file into the working folder.
                cwd=folder,
                stdout=subprocess.PIPE,
                text=True,
            )
            for name, request in requests.items()
        }
        try:
            outputs = {name: process.communicate()[0] for name, process in processes.items()}
        finally:
            # After an error or an interrupt no process may stay behind.
            for process in processes.values():
                process.kill()
                process.wait()
    for name, process in processes.items():
        if process.returncode:
            raise RuntimeError(f"OpenSim did not simulate '{name}': exit code {process.returncode}")
    return {name: _walk_from_json(text) for name, text in outputs.items()}


def simulate_opensim_walk(path: Path, to: float, accuracy: float) -> tuple[WalkerSteps, float]:
    """Simulate one walk with OpenSim in this process.

    The time of a touch-down is known to one step of OpenSim's integrator. The positions of the feet
    at that time are computed by osimlite from OpenSim's states.

    Args:
        path: model file.
        to: final time (s).
        accuracy: accuracy of OpenSim's integrator.

    Returns:
        The steps of the walk, and the processor time of loading and integration (s).
    """
    import opensim

    opensim.Logger.setLevelString("off")
    # Otherwise OpenSim writes opensim.log into the working folder.
    opensim.Logger.removeFileSink()
    start = time.process_time()
    model = opensim.Model(str(path))
    reporter = opensim.ForceReporter(model)
    model.addAnalysis(reporter)
    state = model.initSystem()
    manager = opensim.Manager(model)
    manager.setIntegratorAccuracy(accuracy)
    manager.initialize(state)
    manager.integrate(to)
    processor_time = time.process_time() - start
    names = model.getStateVariableNames()
    paths = [names.get(k) for k in range(names.getSize())]
    states = _StateHistory(manager.getStateStorage(), paths)
    with Simulation(osimlite.read(path), "compiled") as simulation:
        walk = _evaluate_walk(simulation.engine, reporter.getForceStorage(), states)
    return walk, processor_time


class _StateHistory(NamedTuple):
    """States of OpenSim at the steps of its integrator.

    OpenSim also offers a table of them, but copies all of it for each row that is added.

    Attributes:
        storage: OpenSim's ``Storage`` of states.
        paths: paths of the state variables, in the order of a row.
    """

    storage: Any
    paths: list[str]

    def get_values(self, row: int, paths: list[str]) -> list[float]:
        """Return the values of some state variables at one step of the integrator."""
        values = self.storage.getStateVector(row).getData()
        return [values.get(self.paths.index(path)) for path in paths]


def _evaluate_walk(engine: Any, forces: Any, states: _StateHistory) -> WalkerSteps:
    """Find the steps of a walk in the contact forces that OpenSim has reported."""
    times = _read_column(forces, "time")
    touching = _find_contact_times(engine, forces)
    # Each event is a row of the reports, a contact, and whether the contact begins there.
    events = [
        (k, contact, bool(is_touching[k]))
        for contact, is_touching in zip(engine.contacts, touching, strict=True)
        for k in (np.flatnonzero(np.diff(is_touching)) + 1).tolist()
    ]
    events.sort(key=lambda event: event[0])
    coordinates = [engine.mechanism.coordinates[index].path for index in engine.order]
    # The engine's state has all values, then all speeds.
    variables = [f"{path}/{part}" for part in ("value", "speed") for path in coordinates]
    event_states = np.array([states.get_values(k, variables) for k, _, _ in events])
    walk = follow_events(
        find_footing(engine),
        engine.contacts,
        [(float(times[k]), contact, begins) for k, contact, begins in events],
        event_states,
        measure_along_slope(engine, event_states)[0],
        np.array([is_touching[0] for is_touching in touching]),
    )
    if walk.walks:
        # A walk without a fall ends with the integration.
        walk.end = float(times[-1])
    return walk


def _find_contact_times(engine: Any, forces: Any) -> list[np.ndarray]:
    """Find where the force of each contact is not zero.

    Returns:
        For each contact of the engine a boolean for each row of the reports.
    """
    labels = forces.getColumnLabels()
    columns = [labels.get(k) for k in range(labels.getSize())]
    touching = []
    for contact in engine.contacts:
        components = [
            label for label in columns if label.startswith(f"{contact}.") and ".force." in label
        ]
        values = [_read_column(forces, label) != 0.0 for label in components]
        touching.append(np.any(values, axis=0))
    return touching


def _read_column(storage: Any, label: str) -> Any:
    """Return a column of an OpenSim ``Storage`` as array; the label ``time`` gives the times."""
    import opensim

    values = opensim.ArrayDouble()
    if label == "time":
        storage.getTimeColumn(values)
    else:
        storage.getDataColumn(label, values)
    return np.array([values.get(k) for k in range(values.getSize())])


def _walk_to_json(walk: WalkerSteps, processor_time: float) -> str:
    """Return a walk and its processor time (s) as JSON, without the states at the steps."""
    # The state is the fifth and last field of a step; comparisons do not need it.
    content = {**vars(walk), "steps": [step[:4] for step in walk.steps]}
    return json.dumps([content, processor_time])


def _walk_from_json(text: str) -> tuple[WalkerSteps, float]:
    """Return the walk and the processor time (s) that `_walk_to_json` has written."""
    content, processor_time = json.loads(text)
    content["steps"] = [GaitStep._make([*step, np.empty(0)]) for step in content["steps"]]
    content["scuffs"] = [Scuff._make(scuff) for scuff in content["scuffs"]]
    return WalkerSteps(**content), processor_time


def main() -> None:
    """Simulate the walk that the command line describes, and print it."""
    path, to, accuracy = sys.argv[1:]
    print(_walk_to_json(*simulate_opensim_walk(Path(path), float(to), float(accuracy))))


if __name__ == "__main__":
    main()
