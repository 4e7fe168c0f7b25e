"""Speed of `osimlite sweep` with a muscle-driven model, compared with OpenSim's Manager.

    python benchmarks/muscle_sweep.py

gait10dof18musc is simulated many times for half a second from equilibrium, at accuracy 1e-3. Each
run has other controls: every pair of left and right muscles shares six nodes of a piecewise linear
control.

The table has processor times; the programs run in turn. osimlite's time includes the complete sweep
with one worker: samples, models, simulations, an expression of the mass centre, and the results
file. OpenSim's model is made once, and only the ordinates of its control functions change. The last
line has the differences of the final height of the mass centre between the programs.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

import osimlite
from _corpus import CORPUS
from _pair import print_pairs, time_pair
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples
from osimlite.studies.sweep.variables import Floats
from osimlite.studies.sweep.variants import Variants

MODEL = CORPUS.parent / "models" / "m0005" / "gait10dof18musc.osim"

TO = 0.5
"""End of each simulation (s)."""

NODES = 6
"""Number of nodes of each control."""

RUNS = 100
"""Number of simulations of a sweep."""

ROUNDS = 3
"""Number of timed pairs of sweeps."""

HEIGHT = "end(center_of_mass_Y)"
"""Measure of each simulation: the final height of the mass centre (m)."""


def main() -> None:
    muscle_plan = plan(
        osimlite.read(MODEL),
        # The pattern gives the left and the right muscle of a pair the same control.
        {f"{{*}}_?/control@0:{TO:g}:{NODES}": "0.01:1"},
        measures=(HEIGHT,),
        to=TO,
        equilibrate=True,
    )
    samples = choose_samples(muscle_plan.variables, "sobol", RUNS)
    rows = samples.make_block(0, RUNS)
    # A variant has the controller whose functions the loop in OpenSim changes.
    variants = Variants(muscle_plan)
    variants.apply_sample(rows[0].tolist())
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        osimlite.write(variants.model, folder / "model.osim")
        names = [variable.name for variable in muscle_plan.variables]
        theirs = prepare_opensim_runs(folder / "model.osim", names, rows)
        times = time_pair(
            f"{RUNS} runs of {TO:g} s, {len(names)} nodes",
            ours=partial(
                sweep, muscle_plan, samples, folder / "runs.parquet", workers=1, force=True
            ),
            theirs=theirs,
            rounds=ROUNDS,
            clock=time.process_time,
        )
    console = Console()
    print_pairs(
        "gait10dof18musc with other controls in each run, accuracy 1e-3, processor time",
        [times],
        console=console,
    )
    heights = Runner(muscle_plan).run(rows).measures[HEIGHT]
    differences = np.abs(heights - np.array(theirs()))
    console.print(
        f"difference of the heights: median {np.median(differences):.2g} m, "
        f"greatest {differences.max():.2g} m"
    )


def prepare_opensim_runs(path: Path, names: list[str], rows: Floats) -> Callable[[], list[float]]:
    """Return a function that simulates all runs in OpenSim and returns the final heights (m).

    Args:
        path: model file, which has the controller of the sweep.
        names: names of the variables, each the name of a muscle without its side, and a node.
        rows: values of the variables (runs, variables).
    """
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    state = model.initSystem()
    model.equilibrateMuscles(state)
    curves = find_control_curves(model, names)

    def run() -> list[float]:
        heights = []
        for row in rows.tolist():
            for curve, indices in curves:
                for point, index in enumerate(indices):
                    curve.setY(point, row[index])
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(1e-3)
            manager.initialize(opensim.State(state))
            end = manager.integrate(TO)
            # The mass centre needs the positions of the bodies at the end.
            model.realizePosition(end)
            heights.append(model.calcMassCenterPosition(end)[1])
        return heights

    return run


def find_control_curves(model: Any, names: list[str]) -> list[tuple[Any, list[int]]]:
    """Return each control function of the model, and the indices of the variables of its points."""
    import opensim

    controller = opensim.PrescribedController.safeDownCast(model.getControllerSet().get("node_1"))
    actuators = controller.getSocket("actuators")
    functions = controller.get_ControlFunctions()
    curves: list[tuple[Any, list[int]]] = []
    for number in range(functions.getSize()):
        muscle = Path(actuators.getConnecteePath(number)).name.rpartition("_")[0]
        indices = [index for index, name in enumerate(names) if name.startswith(f"{muscle}_")]
        curve = opensim.PiecewiseLinearFunction.safeDownCast(functions.get(number))
        # The function has one more point on either side, which keep it constant outside the nodes.
        curves.append((curve, [indices[0], *indices, indices[-1]]))
    return curves


if __name__ == "__main__":
    main()
