"""Speed of walking by reflexes, compared with OpenSim's integration of the same walk.

    python benchmarks/reflexes.py [SCENARIO.scone] [SECONDS]

The default is osimlite's own human walker, for five seconds. osimlite walks with reflexes and
measures, once alone and once with many candidates at a time. OpenSim only integrates: a
PrescribedController has the excitations that the reflexes computed, and start, integrator and
accuracy are the same. The programs run in turn; medians of the processor times count.

The table in Markdown has the simulated seconds per second of one core, and their ratio to
OpenSim's.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

from _pair import measure_time, run_script
from osimlite.mechanics.kernels.walks import PROGRESS
from osimlite.models.walking import write_scenario
from osimlite.studies.reflexes.scenario import Scenario

CANDIDATES = 16
"""Number of candidates that walk at a time."""

ROUNDS = 3
"""Number of timed runs of each program."""

# Points are slightly before the steps, so that rounding of times cannot delay an excitation by a
# step.
OPENSIM_SCRIPT = """
import json, sys, time, opensim
opensim.Logger.setLevelString("Off")
walk = json.load(open(sys.argv[1]))
model = opensim.Model(walk["model"])
brain = opensim.PrescribedController()
model.addController(brain)
for label, values in walk["excitations"].items():
    brain.addActuator(model.getMuscles().get(label))
    function = opensim.PiecewiseConstantFunction()
    for row, value in enumerate(values):
        function.addPoint(row * walk["step"] - 1e-12, value)
    brain.prescribeControlForActuator(label, function)
state = model.initSystem()
for name, value in walk["start"].items():
    model.setStateVariableValue(state, name, value)
manager = opensim.Manager(model)
manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_SemiExplicitEuler2)
manager.setIntegratorAccuracy(1e-3)
manager.initialize(state)
before = time.process_time()
for row in range(1, walk["rows"] + 1):
    manager.integrate(row * walk["step"])
print(time.process_time() - before)
"""
"""Script that integrates a walk in OpenSim and prints the processor time (s)."""


def main(file: Path, seconds: float) -> None:
    """Print a table in Markdown.

    Args:
        file: scenario.
        seconds: duration of the walk (s).
    """
    scenario = Scenario(file)
    best = scenario.best()
    walk = scenario.walk(best, duration=seconds)
    # Counted before the candidates walk, which have other walkers.
    evaluations = int(scenario.get_walkers(1).progress[0, PROGRESS.FORCES])
    # Prepare the walkers of all candidates, so that this is not timed.
    scenario.walk(best, CANDIDATES, duration=0.1)
    walk_alone = partial(scenario.walk, best, duration=seconds)
    walk_together = partial(scenario.walk, best, CANDIDATES, duration=seconds)
    single_times = []
    candidate_times = []
    opensim_times = []
    with tempfile.TemporaryDirectory() as folder:
        walk_file = write_walk(Path(folder), scenario, walk)
        for _ in range(ROUNDS):
            single_times.append(measure_time(walk_alone, time.process_time))
            candidate_times.append(measure_time(walk_together, time.process_time))
            opensim_times.append(float(run_script(OPENSIM_SCRIPT, str(walk_file))))
    # A walk ends early if the walker falls.
    duration = walk.times[0]
    speed = walk.report["speed"][0]
    print(
        f"{file.stem}: walks {duration:g} s at {speed:.3f} m/s, "
        f"{evaluations / duration:.0f} evaluations of the forces per simulated second"
    )
    print("| program | simulated seconds per second of one core | ratio to OpenSim |")
    print("|---|---|---|")
    opensim_seconds = statistics.median(opensim_times)
    for name, times, count in (
        ("OpenSim integrates", opensim_times, 1),
        ("osimlite walks, with reflexes and measures", single_times, 1),
        (f"osimlite walks, {CANDIDATES} candidates", candidate_times, CANDIDATES),
    ):
        rate = count * duration / statistics.median(times)
        print(f"| {name} | {rate:.3g} | {rate * opensim_seconds / duration:.3g} |")


def write_walk(folder: Path, scenario: Scenario, walk: Any) -> Path:
    """Write the model and the excitations of a walk for OpenSim.

    Args:
        folder: folder for the files.
        scenario: scenario of the walk.
        walk: result of the walk.

    Returns:
        File of the walk in JSON.
    """
    from osimlite.io.document.printer import write

    model = folder / "model.osim"
    write(scenario.model, model)
    steps = len(walk.states.times) - 1
    content = {
        "model": str(model),
        "step": scenario.step,
        "rows": steps,
        "start": {name: walk.states[name][0] for name in walk.states.columns},
        "excitations": {
            name: walk.excitations[name][:steps].tolist() for name in walk.excitations.columns
        },
    }
    file = folder / "walk.json"
    file.write_text(json.dumps(content))
    return file


if __name__ == "__main__":
    arguments = sys.argv[1:]
    with tempfile.TemporaryDirectory() as scenario_folder:
        path = Path(arguments[0]) if arguments else write_scenario(Path(scenario_folder))
        main(path, float(arguments[1]) if len(arguments) > 1 else 5.0)
