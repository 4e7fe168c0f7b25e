"""Optimization of a reaching movement of arm26: gradients compared with population-based methods.

    python benchmarks/reach.py [ARM26.osim]

The variables are the excitations of six muscles at five times, thirty in all. The arm should flex
the elbow to 1.5 rad in 0.4 s and stop there, with little activation. Paths around wrap surfaces
have discontinuous derivatives, so that polynomials replace them (`osimlite.modify`).

The table in Markdown has for each method: the number of simulations, the lowest cost, and the
processor time (s). The default model is that of the shared corpus.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import osimlite
from osimlite.studies.sweep.optimize import Objective, optimize
from osimlite.studies.sweep.plan import plan

MODEL = Path(__file__).resolve().parents[2] / "shared/corpus/models/m0001/arm26.osim"
MUSCLES = ("TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA")

EFFORT = " + ".join(f"integral({muscle}/activation^2)" for muscle in MUSCLES)

# The error of the angle (rad) weighs most: the arm has to reach the target before it saves effort.
COST = (
    "100*(end(r_elbow_flex) - 1.5)^2 + end(r_elbow_flex/speed)^2 "
    f"+ end(r_shoulder_elev/speed)^2 + {EFFORT}"
)

TO = 0.4
"""End of the simulation (s)."""

CONTROL_INTERVAL = 0.1
"""Time between two nodes of an excitation (s)."""

ACCURACY = 1e-5
"""Relative accuracy of the integrator."""

SEARCHES = (
    ("gradient", 100),
    ("cma", 300),
    ("cma", 3000),
    ("sobol-cma", 3000),
    ("differential-evolution", 3000),
)
"""Methods with their numbers of evaluations."""


def main(words: list[str]) -> None:
    """Search with each method, and print the table in Markdown."""
    model = osimlite.modify(osimlite.read(words[0] if words else MODEL), paths="polynomial")
    ranges = {
        f"{muscle}/control@{CONTROL_INTERVAL * node:g}": (0.01, 0.9)
        for muscle in MUSCLES
        for node in range(5)
    }
    reach_plan = plan(model, ranges, measures=(), to=TO, accuracy=ACCURACY)
    print("| method | simulations | cost | processor time, s |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        # Compile the machine code that is not in the cache yet, so that this is not timed.
        optimize(reach_plan, Objective(COST), folder / "first", method="gradient", budget=2)
        for number, (method, budget) in enumerate(SEARCHES):
            started = time.process_time()
            # One worker: the processor time of child processes would not be counted.
            result = optimize(
                reach_plan,
                Objective(COST),
                folder / str(number),
                method=method,
                budget=budget,
                workers=1,
            )
            seconds = time.process_time() - started
            print(f"| `{method}` | {result.evaluations} | {result.value:.4f} | {seconds:.1f} |")


if __name__ == "__main__":
    main(sys.argv[1:])
