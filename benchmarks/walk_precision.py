"""Work and precision of integrators during a walk by reflexes.

    python benchmarks/walk_precision.py [SCENARIO.scone] [SECONDS] [--steps N] [--picture FILE.png]

The default is osimlite's own human walker, for three seconds. From every fourth state of the walk,
the same N control steps are integrated with constant excitations by every method at several
accuracies. As in a walk, each control step is an integration of its own.

The table in Markdown has the errors of the values and of the speeds of all coordinates, relative to
Merson's method at accuracy 1e-11: the root mean square over coordinates and states (rad and m;
rad/s and m/s). The work is the simulated time per processor time of one core. The picture is a
work-precision diagram of the speeds.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

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
"""Integrators and their accuracies."""

SCONE_METHOD = ("euler2", 1e-3)
"""Integrator and accuracy that SCONE uses."""

REFERENCE_METHOD = ("merson", 1e-11)
"""Integrator and accuracy of the reference."""

STATE_INTERVAL = 4
"""Interval of control steps between the states from which the integrators start."""

# Other work on the machine only makes a run slower, so the shortest time counts.
ROUNDS = 9
"""Number of timed runs of each method."""


class Measurement(NamedTuple):
    """Precision and work of one method."""

    method: str
    accuracy: float
    value_error: float
    """Root mean square error of values (rad, m)."""
    speed_error: float
    """Root mean square error of speeds (rad/s, m/s)."""
    rate: float
    """Simulated time per processor time."""


class Integrations:
    """Integrations of control steps from many states of a walk.

    Args:
        scenario: scenario of the walk.
        seconds: duration of the walk (s).
        steps: number of control steps from each state.
    """

    def __init__(self, scenario: Scenario, seconds: float, steps: int) -> None:
        self.scenario = scenario
        self.steps = steps
        walk = scenario.walk(scenario.best(), duration=seconds)
        walkers = scenario.get_walkers(1)
        # Tables and integrator have different orders of the states.
        order = np.argsort([*walkers.offsets.values()])
        # The last state is the one from which `steps` control steps are left.
        self.first_rows = np.arange(0, len(walk.states.times) - 1 - steps, STATE_INTERVAL)
        self.starts = walk.states.rows[self.first_rows][:, order]
        self.excitations = walk.excitations.rows
        self.coordinate_count = len(walkers.coordinates)

    @property
    def simulated_seconds(self) -> float:
        """Sum of the simulated times (s)."""
        return len(self.starts) * self.steps * self.scenario.step

    def integrate(self, method: str, accuracy: float, rounds: int) -> tuple[np.ndarray, float]:
        """Integrate from all states.

        Args:
            method: name of the integrator.
            accuracy: its accuracy.
            rounds: number of timed runs.

        Returns:
            Final values and speeds (states, 2 coordinates), and the shortest processor time (s).
        """
        copies = Copies(
            self.scenario.model,
            len(self.starts),
            self.scenario.step,
            IntegrationOptions(accuracy=accuracy, integrator=method),
        )
        times = []
        for _ in range(rounds):
            # Every round starts from the same states.
            copies.set_states(slice(None), self.starts)
            before = time.process_time()
            for step in range(self.steps):
                # Each state continues with the excitations that the walk had after it.
                copies.step_all(self.excitations[self.first_rows + step])
            times.append(time.process_time() - before)
        # Values and speeds are the first states.
        ends = copies.states[:, : 2 * self.coordinate_count].copy()
        copies.close()
        return ends, min(times)


def compare_methods(scenario: Scenario, seconds: float, steps: int) -> list[Measurement]:
    """Measure all methods at all accuracies.

    Args:
        scenario: scenario of the walk.
        seconds: duration of the walk (s).
        steps: number of control steps from each state.
    """
    integrations = Integrations(scenario, seconds, steps)
    size = integrations.coordinate_count
    # The reference is slow and not timed.
    reference, _ = integrations.integrate(*REFERENCE_METHOD, rounds=1)
    measurements = []
    for method, accuracies in METHODS.items():
        for accuracy in accuracies:
            ends, processor_seconds = integrations.integrate(method, accuracy, ROUNDS)
            errors = ends - reference
            measurements.append(
                Measurement(
                    method,
                    accuracy,
                    compute_rms(errors[:, :size]),
                    compute_rms(errors[:, size:]),
                    integrations.simulated_seconds / processor_seconds,
                )
            )
    return measurements


def compute_rms(errors: np.ndarray) -> float:
    """Return the root mean square of an array."""
    return float(np.sqrt(np.mean(errors**2)))


def print_table(measurements: list[Measurement]) -> None:
    """Print a table in Markdown."""
    print(
        "| method | accuracy | error of values, rad or m | error of speeds, rad/s or m/s "
        "| simulated s per s |"
    )
    print("|---|---|---|---|---|")
    for method, accuracy, value_error, speed_error, rate in measurements:
        note = " (SCONE)" if (method, accuracy) == SCONE_METHOD else ""
        print(
            f"| {method}{note} | {accuracy:.0e} | {value_error:.1e} | {speed_error:.1e} "
            f"| {rate:.3g} |"
        )


def draw_diagram(measurements: list[Measurement], picture: Path) -> None:
    """Draw the work-precision diagram into a file."""
    import matplotlib.pyplot as plt

    for method in METHODS:
        rows = [row for row in measurements if row.method == method]
        errors = [row.speed_error for row in rows]
        plt.loglog(errors, [row.rate for row in rows], "o-", label=method)
    plt.xlabel("error of speeds, rad/s and m/s")
    plt.ylabel("seconds of walking a second, one core")
    plt.legend()
    plt.savefig(picture, dpi=120, bbox_inches="tight")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenario", nargs="?", type=Path, help="scenario file of the walk")
    parser.add_argument(
        "seconds", nargs="?", type=float, default=3.0, help="duration of the walk, s"
    )
    parser.add_argument("--steps", type=int, default=1, help="control steps from each state")
    parser.add_argument("--picture", type=Path, help="file of the diagram to draw")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scenario = Scenario(options.scenario or write_scenario(Path(folder)))
        measurements = compare_methods(scenario, options.seconds, options.steps)
    print_table(measurements)
    if options.picture:
        draw_diagram(measurements, options.picture)


if __name__ == "__main__":
    main()
