"""OpenSim's own example of an optimisation, the walker that is to get far in ten seconds, done by both programs.

The example varies nine numbers of the start: the angles of hips and knees, the forward speed of the
pelvis, and the angular speeds of hips and knees. It makes the distance large, less 10 times the
square of what the forward speed lies outside 0 to 2 m/s, by cma with populations of 20, a step of
0.5, tolerances of 1e-3 and 100 evaluations. Both programs do so on the same model with the same
random numbers; OpenSim by a loop over its Manager, as in the example, osimlite by `optimize` with
an objective in Python. Both ask for the same points, and put them into the same order.

In ten seconds of contacts the last bit of a number grows to millimetres, so that no two programs
agree on a distance more closely than one of them with itself: the table shows what OpenSim makes of
its best start when one of the nine numbers, each in turn, is moved to the floating-point number
next to it.

Then `osimlite optimize` with the numbers within bounds: with as many evaluations by sobol-cma,
which is made for few, and with twenty times as many by cma. In turn; times by the clock are of all
that follows once the model is read, and osimlite writes history and model within its.

    python benchmarks/optimize.py 1 2 3        # these seeds
    python benchmarks/optimize.py --ours 20    # twenty seeds, osimlite alone
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from math import inf, nextafter
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from rich.console import Console
from rich.table import Table

import osimlite
from osimlite.mechanics.multibody import build_mechanism
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.search import Search, run_cma
from osimlite.studies.sweep.variables import Floats, Range

MODEL = Path(__file__).resolve().parent.parent / "fixtures" / "walker" / "DynamicWalkerModel.osim"
JOINTS = ("LHip_rz", "RHip_rz", "LKnee_rz", "RKnee_rz")
FORWARD = "Pelvis_tx/speed"
NAMES = (*JOINTS, FORWARD, *(f"{name}/speed" for name in JOINTS))
TO, BUDGET, POPULATION, STEP, TOLERANCE, FIRST_SPEED, WEIGHT = 10.0, 100, 20, 0.5, 1e-3, 0.1, 10.0
SEEDS = (1, 2, 3, 4, 5)
WITHIN, LONGER = 0.7, 20
UNITS = "distance of the pelvis in m, time by the clock in s"
T = TypeVar("T")


def penalty(speed: float) -> float:
    return WEIGHT * (min(speed, 0.0) ** 2 + max(speed - 2.0, 0.0) ** 2)


def cost(run: Any) -> float:
    return penalty(run.start[FORWARD]) - run.end["Pelvis_tx"]


def main() -> None:
    console = Console(width=120)
    first = starting_point()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # What of machine code is not in the cache yet.
        as_the_example(first, 0, folder / "warm", POPULATION)
        if sys.argv[1:2] == ["--ours"]:
            console.print(ours_alone(first, range(1, 1 + int(sys.argv[2])), folder))
        else:
            for table in side_by_side(first, [int(word) for word in sys.argv[1:]] or SEEDS, folder):
                console.print(table)


def side_by_side(first: Floats, seeds: Sequence[int], folder: Path) -> list[Table]:
    import opensim

    opensim.Logger.setLevelString("off")
    example = Table(
        title=f"The example's settings, {BUDGET} evaluations of {TO:g} s", caption=UNITS
    )
    for heading in (
        "seed",
        "OpenSim",
        "its last bits: least",
        "most",
        "s",
        "osimlite",
        "s",
        "times as fast",
    ):
        example.add_column(heading, justify="right")
    own = Table(title="osimlite's own settings, within bounds", caption=UNITS)
    for heading in (
        "seed",
        f"{BUDGET} evaluations",
        "less OpenSim's",
        "s",
        f"{LONGER * BUDGET} evaluations",
        "s",
    ):
        own.add_column(heading, justify="right")
    for seed in seeds:
        (theirs, moved), slow = timed(partial(by_opensim, opensim, first, seed))
        slow -= moved.seconds
        where = folder / str(seed)
        ours, fast = timed(partial(as_the_example, first, seed, where / "same", BUDGET))
        spread = (f"{min(moved.distances):.4f}", f"{max(moved.distances):.4f}")
        example.add_row(
            str(seed),
            f"{theirs:.4f}",
            *spread,
            f"{slow:.2f}",
            f"{ours:.4f}",
            f"{fast:.3f}",
            f"{slow / fast:.1f}",
        )
        few, took = timed(
            partial(within_bounds, first, seed, where / "few", BUDGET, method="sobol-cma")
        )
        many, longer = timed(partial(within_bounds, first, seed, where / "many", LONGER * BUDGET))
        own.add_row(
            str(seed),
            f"{few:.4f}",
            f"{few - theirs:+.4f}",
            f"{took:.3f}",
            f"{many:.4f}",
            f"{longer:.3f}",
        )
    return [example, own]


def ours_alone(first: Floats, seeds: Sequence[int], folder: Path) -> Table:
    """How far each way of searching gets, over many seeds."""
    ways: dict[str, Callable[[int, Path], float]] = {
        "the example's settings": lambda seed, where: as_the_example(first, seed, where, BUDGET),
        "cma within bounds": lambda seed, where: within_bounds(
            first, seed, where, BUDGET, method="cma"
        ),
        "sobol-cma within bounds": lambda seed, where: within_bounds(
            first, seed, where, BUDGET, method="sobol-cma"
        ),
    }
    table = Table(title=f"{BUDGET} evaluations of {TO:g} s, {len(seeds)} seeds", caption=UNITS)
    for heading in (
        "",
        "least",
        "quarter",
        "median",
        "three quarters",
        "most",
        "farther than the example's",
        "s",
    ):
        table.add_column(heading, justify="right" if heading else "left")
    example: list[float] = []
    for name, way in ways.items():
        started = time.perf_counter()
        found = [way(seed, folder / name / str(seed)) for seed in seeds]
        took = (time.perf_counter() - started) / len(seeds)
        example = example or found
        farther = sum(a > b for a, b in zip(found, example, strict=True))
        quartiles = (f"{x:.3f}" for x in np.quantile(found, (0.0, 0.25, 0.5, 0.75, 1.0)))
        table.add_row(
            name,
            *quartiles,
            f"{farther} of {len(seeds)}" if found is not example else "",
            f"{took:.3f}",
        )
    return table


def timed(work: Callable[[], T]) -> tuple[T, float]:
    started = time.perf_counter()
    return work(), time.perf_counter() - started


def starting_point() -> Floats:
    model = build_mechanism(osimlite.read(MODEL))
    values, speeds = model.default_state()
    places = [model.coordinate_index(name) for name in JOINTS]
    return np.array([*values[places], FIRST_SPEED, *speeds[places]])


def as_the_example(first: Floats, seed: int, folder: Path, budget: int) -> float:
    # Ranges of length one, which may be left, make a fraction of the ranges the step in rad and
    # m/s.
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
        method="cma",
        seed=seed,
        start=first.tolist(),
    )
    return penalty(found.values[FORWARD]) - found.value


def within_bounds(first: Floats, seed: int, folder: Path, budget: int, **choices: Any) -> float:
    vary: dict[str, Range] = {
        name: (x - WITHIN, x + WITHIN) for name, x in zip(NAMES, first.tolist(), strict=True)
    }
    vary |= {FORWARD: (0.0, 2.0), "LKnee_rz": (-1.0, 0.0), "RKnee_rz": (-1.0, 0.0)}
    made = plan(osimlite.read(MODEL), vary, measures=(), to=TO)
    return optimize(made, Objective("distance"), folder, budget=budget, seed=seed, **choices).value


class Moved(NamedTuple):
    """Distances of the best start with one number moved by its last bit, and the time that this took."""

    distances: list[float]
    seconds: float


def by_opensim(opensim: Any, first: Floats, seed: int) -> tuple[float, Moved]:
    """The distance of the best evaluation, and what last bits make of it."""
    model = opensim.Model(str(MODEL))
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    joints = [coordinates.get(name) for name in JOINTS]
    forward = coordinates.get("Pelvis_tx")
    found: list[tuple[float, float, list[float]]] = []

    def distance(row: list[float]) -> float:
        for joint, angle, rate in zip(joints, row[:4], row[5:], strict=True):
            joint.setValue(state, angle, False)
            joint.setSpeedValue(state, rate)
        forward.setValue(state, 0.0, False)
        forward.setSpeedValue(state, row[4])
        manager = opensim.Manager(model)
        manager.initialize(state)
        reached: float = forward.getValue(manager.integrate(TO))
        return reached

    def costs(points: Floats) -> Floats:
        if len(found) + len(points) > BUDGET:
            raise StopIteration
        for row in (points - 0.5 + first).tolist():
            reached = distance(row)
            found.append((penalty(row[4]) - reached, reached, row))
        return np.array([price for price, _, _ in found[-len(points) :]])

    with suppress(StopIteration):
        run_cma(
            costs,
            Search(np.full(len(first), 0.5), STEP, POPULATION, seed, False, BUDGET, TOLERANCE),
        )
    _, farthest, best = min(found)
    started = time.perf_counter()
    moved = []
    for place, number in enumerate(best):
        for end in (-inf, inf):
            moved.append(distance([*best[:place], nextafter(number, end), *best[place + 1 :]]))
    return farthest, Moved(moved, time.perf_counter() - started)


if __name__ == "__main__":
    main()
