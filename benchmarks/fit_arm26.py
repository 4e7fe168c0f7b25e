"""Fit muscles of arm26 to a noisy motion, with exact derivatives or with differences.

    python benchmarks/fit_arm26.py [ARM26.osim] [SEED ...]

Nine parameters are estimated: strength, optimal fiber length and tendon slack length of three
muscles. The data are the two angles of the arm over a second, at 101 times. scipy's least_squares
starts from parameters that are up to 15 % wrong. The data are simulated with the model itself, so
that the true parameters are known, without noise and with noise of 0.002 rad.

The Jacobian is exact (`osimlite.sensitivity`), or consists of differences: with scipy's own step;
with a step that was found by trials for the accuracy of the simulation; and with a smaller step for
simulations that are 1000 times as accurate. Paths around wrap surfaces jump; polynomials replace
them (`osimlite.modify`).

The script prints a table in Markdown. For each search it has the evaluations by least_squares, the
number of simulations, the processor time (s), the root mean square residual in standard deviations
of the noise, and the error of the parameters (%): root mean square and largest.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares  # type: ignore[import-untyped]

import osimlite
from osimlite.simulation.properties import find_properties

MODEL = Path(__file__).resolve().parents[2] / "shared/corpus/models/m0001/arm26.osim"

MUSCLES = "TRIlong", "BIClong", "BRA"

PROPERTIES = "max_isometric_force", "optimal_fiber_length", "tendon_slack_length"

PARAMETERS = [f"/forceset/{muscle}/{name}" for muscle in MUSCLES for name in PROPERTIES]

ANGLES = "/jointset/r_shoulder/r_shoulder_elev/value", "/jointset/r_elbow/r_elbow_flex/value"
"""States that are measured."""

DURATION_S = 1.0

SAMPLE_TIME_S = 0.01
"""Time between rows of a simulation."""

ACCURACY = 1e-6
"""Accuracy of most simulations."""

FINE_ACCURACY = 1e-9
"""Accuracy of the simulated data, and of the differences with a smaller step."""

NOISE_RAD = 0.002
"""Standard deviation of the noise; residuals are divided by it also where there is no noise."""

START_ERROR = 0.15
"""Largest relative error of the parameters at the start."""

BOUND = 0.4
"""Largest relative change of a parameter that the search allows."""

DEFAULT_SEEDS = [1, 2]

CONTROLS = {
    "TRIlong": osimlite.Sine(amplitude=0.15, omega=9.0, phase=0.0, offset=0.15),
    "BIClong": osimlite.Sine(amplitude=0.2, omega=7.0, phase=-np.pi / 2.0, offset=0.25),
    "BRA": osimlite.Sine(amplitude=0.2, omega=11.0, phase=0.0, offset=0.25),
}
"""Excitations of the muscles, with different frequencies to tell the muscles apart."""


class JacobianMethod(NamedTuple):
    """Way to compute the Jacobian of the residuals.

    Attributes:
        accuracy: accuracy of the simulations.
        options: options of least_squares; without ``jac`` the Jacobian is exact.
    """

    accuracy: float
    options: dict[str, Any]


METHODS = {
    "exact": JacobianMethod(ACCURACY, {}),
    # scipy's own step, 1.5e-8 of a factor, is smaller than the error of such a simulation.
    "differences": JacobianMethod(ACCURACY, {"jac": "2-point"}),
    "differences, step 1e-3": JacobianMethod(ACCURACY, {"jac": "2-point", "diff_step": 1e-3}),
    "differences, step 1e-4, accuracy 1e-9": JacobianMethod(
        FINE_ACCURACY, {"jac": "2-point", "diff_step": 1e-4}
    ),
}


class FitProblem:
    """Least-squares problem of one search, whose unknowns are factors of the true parameters.

    Args:
        model: model whose paths are polynomials.
        tangents: tangents of the model with `PARAMETERS` as parameters.
        initial: initial states of muscles by path.
        accuracy: accuracy of the simulations.

    Attributes:
        measured: measured angles (rad), a flat array of times and angles.
        simulation_count: number of simulations so far.
    """

    def __init__(
        self, model: osimlite.Model, tangents: Any, initial: dict[str, float], accuracy: float
    ) -> None:
        # A search changes the parameters of its own copy.
        self.model = model.copy_deep()
        self.tangents = tangents
        self.measured = np.zeros(0)
        self.simulation_count = 0
        self._setters = [
            place.make_setter(self.model)
            for name in PARAMETERS
            for place in find_properties(self.model, name)
        ]
        self._true_values = np.array([setter.get_value() for setter in self._setters])
        self._options: dict[str, Any] = {
            "accuracy": accuracy,
            "controls": CONTROLS,
            "initial": initial,
        }

    def _set_parameters(self, factors: np.ndarray) -> None:
        self.simulation_count += 1
        values = (factors * self._true_values).tolist()
        for setter, value in zip(self._setters, values, strict=True):
            setter.set_value(value)

    def simulate_angles(self, factors: np.ndarray) -> np.ndarray:
        """Return the angles (rad) with these factors of the parameters, a flat array."""
        self._set_parameters(factors)
        run = osimlite.simulate(self.model, DURATION_S, "compiled", **self._options)
        columns = [run.coordinates.index(name.split("/")[-2]) for name in ANGLES]
        return run.values[:, columns].ravel()

    def compute_residuals(self, factors: np.ndarray) -> np.ndarray:
        """Return the residuals in standard deviations of the noise."""
        return (self.simulate_angles(factors) - self.measured) / NOISE_RAD

    def compute_jacobian(self, factors: np.ndarray) -> np.ndarray:
        """Return the exact derivatives of the residuals by the factors (residuals, factors)."""
        self._set_parameters(factors)
        result = osimlite.sensitivity(self.model, self.tangents, DURATION_S, **self._options)
        derivatives = result.derivatives[:, [result.states.index(name) for name in ANGLES]]
        return derivatives.reshape(-1, len(PARAMETERS)) * self._true_values / NOISE_RAD


def run_search(problem: FitProblem, start: np.ndarray, method: JacobianMethod) -> tuple[Any, float]:
    """Estimate the parameters with one method.

    Args:
        problem: problem with measured angles.
        start: factors of the parameters at the start.
        method: how the Jacobian is computed.

    Returns:
        The result of least_squares, and the processor time (s).
    """
    began = time.process_time()
    result = least_squares(
        problem.compute_residuals,
        start,
        # The bounds keep strengths and lengths positive.
        bounds=(1.0 - BOUND, 1.0 + BOUND),
        **{"jac": problem.compute_jacobian, **method.options},
    )
    return result, time.process_time() - began


def compare_methods(
    model: osimlite.Model, tangents: Any, initial: dict[str, float], seed: int
) -> None:
    """Print the rows of all methods for one random start, without and with noise.

    Args:
        model: model whose paths are polynomials.
        tangents: tangents of the model with `PARAMETERS` as parameters.
        initial: initial states of muscles by path.
        seed: seed of the start and of the noise.
    """
    rng = np.random.default_rng(seed)
    start = 1.0 + START_ERROR * rng.uniform(-1.0, 1.0, len(PARAMETERS))
    noise = NOISE_RAD * rng.normal(size=len(ANGLES) * (round(DURATION_S / SAMPLE_TIME_S) + 1))
    true_factors = np.ones(len(PARAMETERS))
    exact_angles = FitProblem(model, tangents, initial, FINE_ACCURACY).simulate_angles(true_factors)
    # All methods solve the same problem: same data, same start.
    for noise_level in (0.0, 1.0):
        for name, method in METHODS.items():
            problem = FitProblem(model, tangents, initial, method.accuracy)
            problem.measured = exact_angles + noise_level * noise
            result, seconds = run_search(problem, start, method)
            # The cost is half the sum of squares.
            residual = np.sqrt(2.0 * result.cost / len(problem.measured))
            errors = 100.0 * np.abs(result.x - 1.0)
            print(
                f"| {seed} | {noise_level * NOISE_RAD:g} | {name} | {result.nfev} "
                f"| {problem.simulation_count} | {seconds:.1f} | {residual:.4f} "
                f"| {np.sqrt(np.mean(errors**2)):.2g} | {errors.max():.2g} |",
                flush=True,
            )


def main(words: list[str]) -> None:
    """Print the table.

    Args:
        words: arguments of the command line.
    """
    file = Path(words.pop(0)) if words and not words[0].isdigit() else MODEL
    seeds = [int(word) for word in words] or DEFAULT_SEEDS
    model = osimlite.modify(osimlite.read(file), paths="polynomial")
    began = time.process_time()
    # Tangents are made once for all searches, so their time is printed separately.
    tangents = osimlite.tangents(model, PARAMETERS)
    print(f"tangents made in {time.process_time() - began:.2g} s\n")
    # All simulations start from the same muscle states, in equilibrium with the true parameters.
    first = osimlite.simulate(model, 0.001, "compiled", equilibrate=True)
    initial = {path: float(column[0]) for path, column in first.auxiliary.items()}
    headings = (
        "seed",
        "noise, rad",
        "Jacobian",
        "evaluations",
        "simulations",
        "processor time, s",
        "residual, sd",
        "error, %",
        "largest error, %",
    )
    print(f"| {' | '.join(headings)} |")
    print("|---" * len(headings) + "|")
    for seed in seeds:
        compare_methods(model, tangents, initial, seed)


if __name__ == "__main__":
    main(sys.argv[1:])
