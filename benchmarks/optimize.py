"""OpenSim's example of an optimisation, a walker that should get far, with both programs.

    python benchmarks/optimize.py 1 2 3        # three seeds, compared with OpenSim
    python benchmarks/optimize.py --ours 20    # twenty seeds, osimlite only

The example varies nine variables of the initial state: the angles of hips and knees, the forward
speed of the pelvis, and the rates of hips and knees. It maximizes the distance, less 10 times the
square of the amount by which the forward speed is outside 0 to 2 m/s. The optimizer is CMA-ES with
populations of 20, an initial step of 0.5, tolerances of 1e-3 and 100 evaluations. Both programs do
this with the same model and the same random numbers: OpenSim with a loop over its Manager, as in
the example, osimlite with `optimize` and an objective in Python. Both evaluate the same candidates
and rank them in the same order.

In ten seconds of contact, a change of the last bit of a number grows to millimetres. No two
programs can agree on a distance more closely than one of them with itself. The first table
therefore has the distances of OpenSim's best start when one of the nine variables at a time is
replaced by the next floating-point number.

The second table is of `osimlite optimize` with bounds of the variables: with as many evaluations by
sobol-cma, which is made for few evaluations, and with twenty times as many by cma. The programs run
in turn. Times are wall-clock times of everything after reading the model; osimlite's include
writing history and model.
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
from _corpus import WALKER
from osimlite.mechanics.multibody import build_mechanism
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan
from osimlite.studies.sweep.search import Search, run_cma
from osimlite.studies.sweep.variables import Floats, Range

JOINTS = ("LHip_rz", "RHip_rz", "LKnee_rz", "RKnee_rz")
FORWARD_SPEED = "Pelvis_tx/speed"
VARIABLES = (*JOINTS, FORWARD_SPEED, *(f"{name}/speed" for name in JOINTS))
"""Variables of the search, in the order of the example."""

# The following settings are those of OpenSim's example.
TO = 10.0
"""End of each simulation (s)."""

BUDGET = 100
"""Number of evaluations of the example."""

POPULATION = 20
"""Number of candidates of a generation."""

STEP = 0.5
"""Initial step of the search (rad, m/s and rad/s)."""

TOLERANCE = 1e-3
"""Changes of variables and costs below which the search stops."""

START_SPEED = 0.1
"""Forward speed of the first candidate (m/s)."""

PENALTY_WEIGHT = 10.0
"""Weight of the squared speed outside its bounds (m per m^2/s^2)."""

DEFAULT_SEEDS = (1, 2, 3, 4, 5)

# The following settings are for the search with bounds.
BOUND = 0.7
"""Distance of the bounds from the first candidate, unless a variable has others (rad, rad/s)."""

LONG_FACTOR = 20
"""Factor of the number of evaluations in the longer search."""

CAPTION = "distance of the pelvis in m, wall-clock time in s"
T = TypeVar("T")


def compute_penalty(speed: float) -> float:
    """Return the cost (m) of a forward speed (m/s) outside 0 to 2 m/s."""
    return PENALTY_WEIGHT * (min(speed, 0.0) ** 2 + max(speed - 2.0, 0.0) ** 2)


def compute_cost(run: Any) -> float:
    """Return the cost (m) of a simulation, for osimlite's objective."""
    return compute_penalty(run.start[FORWARD_SPEED]) - run.end["Pelvis_tx"]


def main() -> None:
    console = Console(width=120)
    start = read_start()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Compile the machine code that is not in the cache yet, so that this is not timed.
        optimize_as_example(start, 0, folder / "warm", POPULATION)
        if sys.argv[1:2] == ["--ours"]:
            console.print(compare_methods(start, range(1, 1 + int(sys.argv[2])), folder))
        else:
            seeds = [int(word) for word in sys.argv[1:]] or DEFAULT_SEEDS
            for table in compare_with_opensim(start, seeds, folder):
                console.print(table)


def create_table(title: str, headings: Sequence[str]) -> Table:
    """Return an empty table; a column without heading has names."""
    table = Table(title=title, caption=CAPTION)
    for heading in headings:
        table.add_column(heading, justify="right" if heading else "left")
    return table


def compare_with_opensim(start: Floats, seeds: Sequence[int], folder: Path) -> list[Table]:
    """Optimize with both programs in turn.

    Args:
        start: first candidate (9,).
        seeds: seeds of the random numbers, one row each.
        folder: folder for osimlite's results.
    """
    import opensim

    opensim.Logger.setLevelString("off")
    example = create_table(
        f"The example's settings, {BUDGET} evaluations of {TO:g} s",
        (
            "seed",
            "OpenSim",
            "with last bits changed: least",
            "greatest",
            "OpenSim, s",
            "osimlite",
            "osimlite, s",
            "speed-up",
        ),
    )
    bounded = create_table(
        "osimlite's own settings, with bounds",
        (
            "seed",
            f"{BUDGET} evaluations",
            "minus OpenSim's",
            "s",
            f"{LONG_FACTOR * BUDGET} evaluations",
            "s",
        ),
    )
    for seed in seeds:
        (theirs, perturbed), their_seconds = measure(
            partial(optimize_in_opensim, opensim, start, seed)
        )
        # The simulations with changed bits are no part of the optimisation.
        their_seconds -= perturbed.seconds
        results = folder / str(seed)
        ours, our_seconds = measure(
            partial(optimize_as_example, start, seed, results / "same", BUDGET)
        )
        example.add_row(
            str(seed),
            f"{theirs:.4f}",
            f"{min(perturbed.distances):.4f}",
            f"{max(perturbed.distances):.4f}",
            f"{their_seconds:.2f}",
            f"{ours:.4f}",
            f"{our_seconds:.3f}",
            f"{their_seconds / our_seconds:.1f}",
        )
        few, few_seconds = measure(
            partial(optimize_with_bounds, start, seed, results / "few", BUDGET, method="sobol-cma")
        )
        many, many_seconds = measure(
            partial(optimize_with_bounds, start, seed, results / "many", LONG_FACTOR * BUDGET)
        )
        bounded.add_row(
            str(seed),
            f"{few:.4f}",
            f"{few - theirs:+.4f}",
            f"{few_seconds:.3f}",
            f"{many:.4f}",
            f"{many_seconds:.3f}",
        )
    return [example, bounded]


def compare_methods(start: Floats, seeds: Sequence[int], folder: Path) -> Table:
    """Return a table of the distances that each method of osimlite reaches with many seeds.

    Args:
        start: first candidate (9,).
        seeds: seeds of the random numbers.
        folder: folder for the results.
    """
    methods: dict[str, Callable[[int, Path], float]] = {
        "the example's settings": lambda seed, results: optimize_as_example(
            start, seed, results, BUDGET
        ),
        "cma with bounds": lambda seed, results: optimize_with_bounds(
            start, seed, results, BUDGET, method="cma"
        ),
        "sobol-cma with bounds": lambda seed, results: optimize_with_bounds(
            start, seed, results, BUDGET, method="sobol-cma"
        ),
    }
    table = create_table(
        f"{BUDGET} evaluations of {TO:g} s, {len(seeds)} seeds",
        (
            "",
            "least",
            "quarter",
            "median",
            "three quarters",
            "greatest",
            "farther than the example's",
            "s",
        ),
    )
    # The first method is the one that the others are compared with, seed by seed.
    example: list[float] = []
    for name, method in methods.items():
        started = time.perf_counter()
        distances = [method(seed, folder / name / str(seed)) for seed in seeds]
        seconds = (time.perf_counter() - started) / len(seeds)
        example = example or distances
        farther = sum(a > b for a, b in zip(distances, example, strict=True))
        quartiles = (f"{x:.3f}" for x in np.quantile(distances, (0.0, 0.25, 0.5, 0.75, 1.0)))
        table.add_row(
            name,
            *quartiles,
            "" if distances is example else f"{farther} of {len(seeds)}",
            f"{seconds:.3f}",
        )
    return table


def measure(work: Callable[[], T]) -> tuple[T, float]:
    """Call a function.

    Returns:
        Its result, and the wall-clock time (s).
    """
    started = time.perf_counter()
    return work(), time.perf_counter() - started


def read_start() -> Floats:
    """Return the first candidate (9,): the default state of the model, with a forward speed."""
    mechanism = build_mechanism(osimlite.read(WALKER))
    values, speeds = mechanism.default_state()
    indices = [mechanism.coordinate_index(name) for name in JOINTS]
    return np.array([*values[indices], START_SPEED, *speeds[indices]])


def optimize_as_example(start: Floats, seed: int, folder: Path, budget: int) -> float:
    """Optimize by osimlite with the settings of the example, and return the distance (m).

    Args:
        start: first candidate (9,).
        seed: seed of the random numbers.
        folder: folder for the results.
        budget: number of evaluations.
    """
    # osimlite's step is a fraction of the range. Ranges of length one, which candidates may leave,
    # make it a step in rad and m/s, as in the example.
    ranges = {name: (x - 0.5, x + 0.5) for name, x in zip(VARIABLES, start.tolist(), strict=True)}
    result = optimize(
        plan(osimlite.read(WALKER), ranges, measures=(), to=TO),
        Objective(compute_cost, is_maximized=False),
        folder,
        budget=budget,
        popsize=POPULATION,
        sigma=STEP,
        tolerance=TOLERANCE,
        is_bounded=False,
        method="cma",
        seed=seed,
        start=start.tolist(),
    )
    return compute_penalty(result.values[FORWARD_SPEED]) - result.value


def optimize_with_bounds(
    start: Floats, seed: int, folder: Path, budget: int, **options: Any
) -> float:
    """Optimize by osimlite with bounds of the variables, and return the distance (m).

    Args:
        start: middle of most ranges (9,).
        seed: seed of the random numbers.
        folder: folder for the results.
        budget: number of evaluations.
        **options: further options of `optimize`.
    """
    ranges: dict[str, Range] = {
        name: (x - BOUND, x + BOUND) for name, x in zip(VARIABLES, start.tolist(), strict=True)
    }
    # The penalty of the example becomes a bound, and knees cannot be hyperextended.
    ranges |= {FORWARD_SPEED: (0.0, 2.0), "LKnee_rz": (-1.0, 0.0), "RKnee_rz": (-1.0, 0.0)}
    bounded_plan = plan(osimlite.read(WALKER), ranges, measures=(), to=TO)
    result = optimize(
        bounded_plan, Objective("distance"), folder, budget=budget, seed=seed, **options
    )
    return result.value


class PerturbedDistances(NamedTuple):
    """Distances of the best start with the last bit of one variable changed."""

    distances: list[float]
    """Distances, two for each variable (m)."""
    seconds: float
    """Time of these simulations (s)."""


def optimize_in_opensim(opensim: Any, start: Floats, seed: int) -> tuple[float, PerturbedDistances]:
    """Optimize by a loop over OpenSim's Manager.

    Args:
        opensim: OpenSim's module.
        start: first candidate (9,).
        seed: seed of the random numbers.

    Returns:
        Distance of the best evaluation (m), and the distances with changed last bits.
    """
    model = opensim.Model(str(WALKER))
    state = model.initSystem()
    coordinates = model.getCoordinateSet()
    joints = [coordinates.get(name) for name in JOINTS]
    forward = coordinates.get("Pelvis_tx")
    # Cost, distance and candidate of each evaluation.
    evaluations: list[tuple[float, float, list[float]]] = []

    def simulate(row: list[float]) -> float:
        for joint, angle, rate in zip(joints, row[:4], row[5:], strict=True):
            joint.setValue(state, angle, False)
            joint.setSpeedValue(state, rate)
        # Every candidate starts at the origin, so that its final position is the distance.
        forward.setValue(state, 0.0, False)
        forward.setSpeedValue(state, row[4])
        manager = opensim.Manager(model)
        manager.initialize(state)
        distance: float = forward.getValue(manager.integrate(TO))
        return distance

    def compute_costs(points: Floats) -> Floats:
        if len(evaluations) + len(points) > BUDGET:
            raise StopIteration
        # Points are fractions of ranges of length one around the start.
        for row in (points - 0.5 + start).tolist():
            distance = simulate(row)
            evaluations.append((compute_penalty(row[4]) - distance, distance, row))
        return np.array([cost for cost, _, _ in evaluations[-len(points) :]])

    middle = np.full(len(start), 0.5)
    with suppress(StopIteration):
        run_cma(
            compute_costs,
            Search(middle, STEP, POPULATION, seed, False, BUDGET, TOLERANCE),
        )
    _, distance, best = min(evaluations)
    started = time.perf_counter()
    distances = []
    for index, number in enumerate(best):
        for direction in (-inf, inf):
            neighbor = nextafter(number, direction)
            distances.append(simulate([*best[:index], neighbor, *best[index + 1 :]]))
    return distance, PerturbedDistances(distances, time.perf_counter() - started)


if __name__ == "__main__":
    main()
