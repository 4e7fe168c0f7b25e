"""Runs of a muscle-driven model under other controls each: `osimlite sweep` with one worker, beside OpenSim's Manager.

gait10dof18musc for half a second from equilibrium, at accuracy 1e-3. Each muscle, alike on both
sides, has six nodes of its control. osimlite's time is that of the whole sweep: samples, models,
simulations, an expression of the mass centre, the file. OpenSim's model is made once, and only the
ordinates of its functions change. Times of the processor, in turn.

    python benchmarks/muscle_sweep.py
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
from _pair import pair, report
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.run import sweep
from osimlite.studies.sweep.runner import Runner
from osimlite.studies.sweep.sampling import choose_samples
from osimlite.studies.sweep.variables import Floats
from osimlite.studies.sweep.variants import Variants

MODEL = CORPUS.parent / "models" / "m0005" / "gait10dof18musc.osim"
TO, NODES, RUNS, ROUNDS, HEIGHT = 0.5, 6, 100, 3, "end(center_of_mass_Y)"


def main() -> None:
    model = osimlite.read(MODEL)
    made = plan(
        model,
        {f"{{*}}_?/control@0:{TO:g}:{NODES}": "0.01:1"},
        measures=(HEIGHT,),
        to=TO,
        equilibrate=True,
    )
    chosen = choose_samples(made.variables, "sobol", RUNS)
    rows, variants = chosen.make_block(0, RUNS), Variants(made)
    variants.apply_sample(rows[0].tolist())
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        osimlite.write(variants.model, path / "model.osim")
        theirs = by_opensim(path / "model.osim", [item.name for item in made.variables], rows)
        ours = partial(sweep, made, chosen, path / "runs.parquet", workers=1, force=True)
        name = f"{RUNS} runs of {TO:g} s, {len(made.variables)} nodes"
        times = pair(name, ours=ours, theirs=theirs, rounds=ROUNDS, clock=time.process_time)
    console = Console()
    report(
        "gait10dof18musc under other controls each, accuracy 1e-3, processor time",
        [times],
        console=console,
    )
    apart = np.abs(Runner(made).run(rows).measures[HEIGHT] - np.array(theirs()))
    console.print(
        f"heights differ by {np.median(apart):.2g} m in the middle, {apart.max():.2g} at most"
    )


def by_opensim(path: Path, names: list[str], rows: Floats) -> Callable[[], list[float]]:
    import opensim

    opensim.Logger.setLevelString("off")
    model = opensim.Model(str(path))
    state = model.initSystem()
    model.equilibrateMuscles(state)
    brain = opensim.PrescribedController.safeDownCast(model.getControllerSet().get("node_1"))
    actuators, functions = brain.getSocket("actuators"), brain.get_ControlFunctions()
    curves: list[tuple[Any, list[int]]] = []
    for number in range(functions.getSize()):
        muscle = Path(actuators.getConnecteePath(number)).name.rpartition("_")[0]
        places = [place for place, name in enumerate(names) if name.startswith(f"{muscle}_")]
        curve = opensim.PiecewiseLinearFunction.safeDownCast(functions.get(number))
        curves.append((curve, [places[0], *places, places[-1]]))

    def run() -> list[float]:
        found = []
        for row in rows.tolist():
            for curve, places in curves:
                for point, place in enumerate(places):
                    curve.setY(point, row[place])
            manager = opensim.Manager(model)
            manager.setIntegratorAccuracy(1e-3)
            manager.initialize(opensim.State(state))
            end = manager.integrate(TO)
            model.realizePosition(end)
            found.append(model.calcMassCenterPosition(end)[1])
        return found

    return run


if __name__ == "__main__":
    main()
