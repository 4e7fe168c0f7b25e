"""OpenSim's own example of an optimisation, the walker that is to get far in ten seconds, done by both programs.

The example varies nine numbers of the start: the angles of hips and knees, the forward speed of the pelvis, and the
angular speeds of hips and knees. It makes the distance large, less 10 times the square of what the forward speed lies
outside 0 to 2 m/s, by cma with populations of 20, a step of 0.5, tolerances of 1e-3 and 100 evaluations. Both programs
do so on the same model with the same random numbers; OpenSim by a loop over its Manager, as in the example, osimlite by
`optimize` with an objective in Python. Then osimlite as `osimlite optimize` does it unless told otherwise, the numbers
within bounds, with as many evaluations, and with twenty times as many.

In turn; times by the clock are of all that follows once the model is read, and osimlite writes history and model
within its.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.multibody import build_mechanism
from osimlite.sweep.optimize import Objective, optimize
from osimlite.sweep.plan import plan
from osimlite.sweep.search import Search, cma
from osimlite.sweep.variables import Floats, Range

MODEL = Path(__file__).resolve().parent.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"
JOINTS = ("LHip_rz", "RHip_rz", "LKnee_rz", "RKnee_rz")
FORWARD = "Pelvis_tx/speed"
NAMES = (*JOINTS, FORWARD, *(f"{name}/speed" for name in JOINTS))
TO, BUDGET, POPULATION, STEP, TOLERANCE, FIRST_SPEED, WEIGHT = 10.0, 100, 20, 0.5, 1e-3, 0.1, 10.0
SEEDS = (1, 2, 3)
WITHIN, LONGER = 0.7, 20


def penalty(speed: float) -> float:
    return WEIGHT * (min(speed, 0.0) ** 2 + max(speed - 2.0, 0.0) ** 2)


def cost(run: Any) -> float:
    return penalty(run.start[FORWARD]) - run.end["Pelvis_tx"]


def main() -> None:
    opensim.Logger.setLevelString("off")
    console = Console()
    table = Table(title=f"{BUDGET} evaluations of {TO:g} s", caption="distance of the pelvis in m, time in s")
    headings = ("seed", "OpenSim", "s", "osimlite", "s", "times as fast", "bounds", "s", f"{LONGER} times", "s")
    for heading in headings:
        table.add_column(heading, justify="right")
    first = starting_point()
    with tempfile.TemporaryDirectory() as folder:
        # What of machine code is not in the cache yet.
        as_the_example(first, 0, Path(folder) / "warm", POPULATION)
        for seed in map(int, sys.argv[1:]) if sys.argv[1:] else SEEDS:
            theirs, slow = timed(partial(by_opensim, first, seed))
            row = [str(seed), f"{theirs:.4f}", f"{slow:.2f}"]
            where = Path(folder) / str(seed)
            ours, fast = timed(partial(as_the_example, first, seed, where / "same", BUDGET))
            row += [f"{ours:.4f}", f"{fast:.3f}", f"{slow / fast:.1f}"]
            for budget in (BUDGET, LONGER * BUDGET):
                bounded, took = timed(partial(within_bounds, first, seed, where / str(budget), budget))
                row += [f"{bounded:.4f}", f"{took:.3f}"]
            table.add_row(*row)
    console.print(table)


def timed(work: Callable[[], float]) -> tuple[float, float]:
    started = time.perf_counter()
    return work(), time.perf_counter() - started


def starting_point() -> Floats:
    model = build_mechanism(osimlite.read(MODEL))
    values, speeds = model.default_state()
    places = [model.coordinate_index(name) for name in JOINTS]
    return np.array([*values[places], FIRST_SPEED, *speeds[places]])


def as_the_example(first: Floats, seed: int, folder: Path, budget: int) -> float:
    # Ranges of length one, which may be left, make a fraction of the ranges the step in rad and m/s.
    vary = {name: (x - 0.5, x + 0.5) for name, x in zip(NAMES, first.tolist(), strict=True)}
    found = optimize(
        plan(osimlite.read(MODEL), vary, measures=(), to=TO),
        Objective(cost, is_maximized=False),
        folder,
        budget=budget,
        popsize=POPULATION,
        sigma=STEP,
        tolerance=TOLERANCE,
        is_bounded=False,
        seed=seed,
        start=first.tolist(),
    )
    return penalty(found.values[FORWARD]) - found.value


def within_bounds(first: Floats, seed: int, folder: Path, budget: int) -> float:
    vary: dict[str, Range] = {name: (x - WITHIN, x + WITHIN) for name, x in zip(NAMES, first.tolist(), strict=True)}
    vary |= {FORWARD: (0.0, 2.0), "LKnee_rz": (-1.0, 0.0), "RKnee_rz": (-1.0, 0.0)}
    made = plan(osimlite.read(MODEL), vary, measures=(), to=TO)
    return optimize(made, Objective("distance"), folder, budget=budget, seed=seed).value


def by_opensim(first: Floats, seed: int) -> float:
    """The distance of the best evaluation."""
    model = opensim.Model(str(MODEL))
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    joints = [coordinates.get(name) for name in JOINTS]
    forward = coordinates.get("Pelvis_tx")
    found: list[tuple[float, float]] = []

    def costs(points: Floats) -> Floats:
        if len(found) + len(points) > BUDGET:
            raise StopIteration
        new = []
        for row in (points - 0.5 + first).tolist():
            for joint, angle, rate in zip(joints, row[:4], row[5:], strict=True):
                joint.setValue(state, angle, False)
                joint.setSpeedValue(state, rate)
            forward.setValue(state, 0.0, False)
            forward.setSpeedValue(state, row[4])
            manager = opensim.Manager(model)
            manager.initialize(state)
            distance = forward.getValue(manager.integrate(TO))
            new.append((penalty(row[4]) - distance, distance))
        found.extend(new)
        return np.array([price for price, _ in new])

    with suppress(StopIteration):
        cma(costs, Search(np.full(len(first), 0.5), STEP, POPULATION, seed, False, BUDGET, TOLERANCE))
    return min(found)[1]


if __name__ == "__main__":
    main()
