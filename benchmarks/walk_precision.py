"""Work and precision of integrators on a walk: from states along it, excitations held, to the end of a control step.

    python benchmarks/walk_precision.py [SCENARIO.scone] [SECONDS] [--steps N] [--picture FILE.png]

From each fourth state of a walk the same N control steps are integrated by every method at several
accuracies, as a walk does: each control step is a run of its own. The error is how far the values
and speeds of all coordinates are from those of Merson's method at 1e-11 (root mean square over
coordinates and states, rad and m, rad/s and m/s); the work is processor time over the time that
passes. Without a scenario our own human walks.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from osimlite.models.walking import write_scenario
from osimlite.simulation.copies import Copies
from osimlite.simulation.options import IntegrationOptions
from osimlite.studies.reflexes.scenario import Scenario

METHODS = {
    "euler2": (1e-2, 3e-3, 1e-3, 1e-4, 1e-5),
    "merson": (1e-1, 1e-2, 1e-3, 1e-4, 1e-6),
    "rosenbrock": (1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 1e-4),
    "adams": (1e-2, 1e-3, 1e-4, 1e-6),
    "bdf": (1e-2, 1e-3, 1e-4),
}
USUAL = "euler2", 1e-3
"""What SCONE takes."""
EVERY, TIMES = 4, 9


def measured(
    scenario: Scenario, seconds: float, steps: int
) -> list[tuple[str, float, float, float, float]]:
    """Method, accuracy, errors of values and of speeds, seconds of walking a second."""
    walked = scenario.walk(scenario.best(), duration=seconds)
    walkers = scenario.get_walkers(1)
    order = np.argsort([*walkers.offsets.values()])
    first = np.arange(0, len(walked.states.times) - 1 - steps, EVERY)
    start, rows = walked.states.rows[first][:, order], walked.excitations.rows
    size = len(walkers.coordinates)

    def ends(method: str, accuracy: float) -> tuple[np.ndarray, float]:
        copies = Copies(
            scenario.model,
            len(start),
            scenario.step,
            IntegrationOptions(accuracy=accuracy, integrator=method),
        )
        took = []
        for _ in range(TIMES if accuracy > 1e-10 else 1):
            copies.set_states(slice(None), start)
            before = time.process_time()
            for step in range(steps):
                copies.step_all(rows[first + step])
            took.append(time.process_time() - before)
        result = copies.states[:, : 2 * size].copy()
        copies.close()
        return result, min(took)

    wanted, _ = ends("merson", 1e-11)
    passed, found = len(start) * steps * scenario.step, []
    for method, accuracies in METHODS.items():
        for accuracy in accuracies:
            result, took = ends(method, accuracy)
            off = result - wanted
            of_values, of_speeds = (
                float(np.sqrt(np.mean(part**2))) for part in (off[:, :size], off[:, size:])
            )
            found.append((method, accuracy, of_values, of_speeds, passed / took))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenario", nargs="?", type=Path)
    parser.add_argument("seconds", nargs="?", type=float, default=3.0)
    parser.add_argument("--steps", type=int, default=1, help="control steps from each state")
    parser.add_argument("--picture", type=Path, help="draw the diagram into this file")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scenario = Scenario(chosen.scenario or write_scenario(Path(folder)))
        found = measured(scenario, chosen.seconds, chosen.steps)
    print(
        "| method | accuracy | error of values | of speeds | seconds of walking a second |\n|---|---|---|---|---|"
    )
    for method, accuracy, of_values, of_speeds, rate in found:
        mark = " (SCONE)" if (method, accuracy) == USUAL else ""
        print(
            f"| {method}{mark} | {accuracy:.0e} | {of_values:.1e} | {of_speeds:.1e} | {rate:.3g} |"
        )
    if chosen.picture:
        import matplotlib.pyplot as plt

        for method in METHODS:
            rows = [row for row in found if row[0] == method]
            plt.loglog([row[3] for row in rows], [row[4] for row in rows], "o-", label=method)
        plt.xlabel("error of speeds, rad/s and m/s")
        plt.ylabel("seconds of walking a second, one core")
        plt.legend()
        plt.savefig(chosen.picture, dpi=120, bbox_inches="tight")


if __name__ == "__main__":
    main()
