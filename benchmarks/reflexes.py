"""Humans that walk by reflexes: seconds of walking per second of one core, beside OpenSim that only integrates.

    python benchmarks/reflexes.py [SCENARIO.scone] [SECONDS]

Without a scenario our own human walks. Each is run three times in turn; the medians of processor
time count. OpenSim moves the model by a PrescribedController that holds what the reflexes said,
with the same integrator and start.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from osimlite.mechanics.kernels.walks import PROGRESS
from osimlite.models.walking import write_scenario
from osimlite.studies.reflexes.scenario import Scenario

CANDIDATES, TIMES = 16, 3
OPENSIM = """
import json, sys, time, opensim
opensim.Logger.setLevelString("Off")
given = json.load(open(sys.argv[1]))
model = opensim.Model(given["model"])
brain = opensim.PrescribedController()
model.addController(brain)
for label, values in given["excitations"].items():
    brain.addActuator(model.getMuscles().get(label))
    function = opensim.PiecewiseConstantFunction()
    for row, value in enumerate(values):
        function.addPoint(row * given["step"] - 1e-12, value)
    brain.prescribeControlForActuator(label, function)
state = model.initSystem()
for name, value in given["start"].items():
    model.setStateVariableValue(state, name, value)
manager = opensim.Manager(model)
manager.setIntegratorMethod(opensim.Manager.IntegratorMethod_SemiExplicitEuler2)
manager.setIntegratorAccuracy(1e-3)
manager.initialize(state)
before = time.process_time()
for row in range(1, given["rows"] + 1):
    manager.integrate(row * given["step"])
print(time.process_time() - before)
"""


def main(file: Path, seconds: float) -> None:
    """Print a table in Markdown."""
    scenario = Scenario(file)
    best = scenario.best()
    walked = scenario.walk(best, duration=seconds)
    rows, evaluations = (
        len(walked.states.times) - 1,
        int(scenario.get_walkers(1).progress[0, PROGRESS.FORCES]),
    )
    scenario.walk(best, CANDIDATES, duration=0.1)
    alone, many, theirs = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        from osimlite.io.document.printer import write

        model, given = Path(folder) / "model.osim", Path(folder) / "given.json"
        write(scenario.model, model)
        told = {
            "model": str(model),
            "step": scenario.step,
            "rows": rows,
            "start": {name: walked.states[name][0] for name in walked.states.columns},
            "excitations": {
                name: walked.excitations[name][:rows].tolist()
                for name in walked.excitations.columns
            },
        }
        given.write_text(json.dumps(told))
        for _ in range(TIMES):
            before = time.process_time()
            scenario.walk(best, duration=seconds)
            alone.append(time.process_time() - before)
            before = time.process_time()
            scenario.walk(best, CANDIDATES, duration=seconds)
            many.append(time.process_time() - before)
            done = subprocess.run(
                [sys.executable, "-c", OPENSIM, str(given)],
                capture_output=True,
                text=True,
                check=True,
            )
            theirs.append(float(done.stdout.split()[-1]))
    took = walked.times[0]
    speed, each = walked.report["speed"][0], evaluations / took
    print(
        f"{file.stem}: walks {took:g} s at {speed:.3f} m/s, {each:.0f} evaluations of the forces a second"
    )
    print("| | seconds of walking per second of one core | beside OpenSim |")
    print("|---|---|---|")
    opensim = statistics.median(theirs)
    for name, times, count in (
        ("OpenSim integrates", theirs, 1),
        ("osimlite walks, with reflexes and measures", alone, 1),
        (f"{CANDIDATES} candidates", many, CANDIDATES),
    ):
        rate = count * took / statistics.median(times)
        print(f"| {name} | {rate:.3g} | {rate * opensim / took:.3g} |")


if __name__ == "__main__":
    chosen = sys.argv[1:]
    with tempfile.TemporaryDirectory() as ours:
        path = Path(chosen[0]) if chosen else write_scenario(Path(ours))
        main(path, float(chosen[1]) if len(chosen) > 1 else 5.0)
