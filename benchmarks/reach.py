"""A reach of arm26 with least effort, found by exact derivatives and by populations.

What six muscles are told at five moments of 0.4 s, thirty numbers, is to bend the elbow to 1.5 rad
and to stop there with little activation. Paths around surfaces jump; polynomials are in their
places (`osimlite.modify`). Prints a table in Markdown: the cost that is reached, and seconds of the
processor.

    python benchmarks/reach.py [ARM26.osim]
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
MUSCLES = "TRIlong", "TRIlat", "TRImed", "BIClong", "BICshort", "BRA"
EFFORT = " + ".join(f"integral({muscle}/activation^2)" for muscle in MUSCLES)
COST = f"100*(end(r_elbow_flex) - 1.5)^2 + end(r_elbow_flex/speed)^2 + end(r_shoulder_elev/speed)^2 + {EFFORT}"
TO, ACCURACY = 0.4, 1e-5
SEARCHES = (
    ("gradient", 100),
    ("cma", 300),
    ("cma", 3000),
    ("sobol-cma", 3000),
    ("differential-evolution", 3000),
)


def main(words: list[str]) -> None:
    """Print the table."""
    model = osimlite.modify(osimlite.read(words[0] if words else MODEL), paths="polynomial")
    vary = {f"{muscle}/control@{0.1 * k:g}": (0.01, 0.9) for muscle in MUSCLES for k in range(5)}
    made = plan(model, vary, measures=(), to=TO, accuracy=ACCURACY)
    print("| method | runs | cost | s |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        # What has to be compiled is.
        optimize(made, Objective(COST), Path(folder) / "first", method="gradient", budget=2)
        for number, (method, budget) in enumerate(SEARCHES):
            started = time.process_time()
            found = optimize(
                made,
                Objective(COST),
                Path(folder) / str(number),
                method=method,
                budget=budget,
                workers=1,
            )
            print(
                f"| `{method}` | {found.evaluations} | {found.value:.4f} | {time.process_time() - started:.1f} |"
            )


if __name__ == "__main__":
    main(sys.argv[1:])
