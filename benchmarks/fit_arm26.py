"""Muscles of arm26 fitted to a noisy motion: exact derivatives of the motion beside differences of runs.

Nine numbers, the strength, optimal fiber length and tendon slack length of three muscles, are found
from the two angles of the arm over a second, 101 moments, by scipy's least_squares from a start
that is up to 15 % off. Its Jacobian is that of `osimlite.sensitivity`, or differences: with scipy's
own step; with one that was tried out for the accuracy of the motion; and with one for motions 1000
times as accurate. The motion is made by the model itself, so that the numbers are known; without
noise and with noise of 0.002 rad. Paths around surfaces jump; polynomials are in their places
(`osimlite.modify`).

    python benchmarks/fit_arm26.py [ARM26.osim] [SEED ...]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares  # type: ignore[import-untyped]

import osimlite
from osimlite.simulation.properties import find_properties

MODEL = Path(__file__).resolve().parents[2] / "shared/corpus/models/m0001/arm26.osim"
MUSCLES = "TRIlong", "BIClong", "BRA"
KINDS = "max_isometric_force", "optimal_fiber_length", "tendon_slack_length"
NAMES = [f"/forceset/{muscle}/{kind}" for muscle in MUSCLES for kind in KINDS]
ANGLES = "/jointset/r_shoulder/r_shoulder_elev/value", "/jointset/r_elbow/r_elbow_flex/value"
TO, ACCURACY, NOISE, OFF, WITHIN = 1.0, 1e-6, 0.002, 0.15, 0.4
CONTROLS = {
    "TRIlong": osimlite.Sine(amplitude=0.15, omega=9.0, phase=0.0, offset=0.15),
    "BIClong": osimlite.Sine(amplitude=0.2, omega=7.0, phase=-np.pi / 2.0, offset=0.25),
    "BRA": osimlite.Sine(amplitude=0.2, omega=11.0, phase=0.0, offset=0.25),
}


class Fit:
    """One search: numbers are factors of those of the model.

    Args:
        model: with polynomials for paths.
        tangents: of it, with the numbers as parameters.
        initial: state that all motions start from.
    """

    def __init__(self, model: Any, tangents: Any, initial: Any, accuracy: float = ACCURACY) -> None:
        self.model, self.tangents = model.copy_deep(), tangents
        self._setters = [
            place.make_setter(self.model)
            for name in NAMES
            for place in find_properties(self.model, name)
        ]
        self._true = np.array([setter.get_value() for setter in self._setters])
        self._choices = {"accuracy": accuracy, "controls": CONTROLS, "initial": initial}
        self.motions, self.measured = 0, np.zeros(0)

    def _put(self, factors: Any) -> None:
        self.motions += 1
        for setter, value in zip(self._setters, (factors * self._true).tolist(), strict=True):
            setter.set_value(value)

    def angles(self, factors: Any) -> Any:
        """Residuals in standard deviations of the noise."""
        self._put(factors)
        run = osimlite.simulate(self.model, TO, "compiled", **self._choices)
        found = run.values[:, [run.coordinates.index(name.split("/")[-2]) for name in ANGLES]]
        return found.ravel() if not len(self.measured) else (found.ravel() - self.measured) / NOISE

    def slopes(self, factors: Any) -> Any:
        """Their derivatives by the factors."""
        self._put(factors)
        found = osimlite.sensitivity(self.model, self.tangents, TO, **self._choices)
        rows = found.derivatives[:, [found.states.index(name) for name in ANGLES]]
        return rows.reshape(-1, len(NAMES)) * self._true / NOISE


def main(words: list[str]) -> None:
    """Print a table in Markdown."""
    file = Path(words.pop(0)) if words and not words[0].isdigit() else MODEL
    model = osimlite.modify(osimlite.read(file), paths="polynomial")
    started = time.process_time()
    tangents = osimlite.tangents(model, NAMES)
    print(f"tangents made in {time.process_time() - started:.2g} s\n")
    first = osimlite.simulate(model, 0.001, "compiled", equilibrate=True)
    initial = {path: float(column[0]) for path, column in first.auxiliary.items()}
    ways: dict[str, tuple[float, dict[str, Any]]] = {
        "exact": (ACCURACY, {}),
        "differences": (ACCURACY, {"jac": "2-point"}),
        "differences, step 1e-3": (ACCURACY, {"jac": "2-point", "diff_step": 1e-3}),
        "differences, step 1e-4, accuracy 1e-9": (1e-9, {"jac": "2-point", "diff_step": 1e-4}),
    }
    print(
        "| seed | noise | Jacobian | steps of the search | motions | time, s | residual, sd | off, % | largest, % |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for seed in [int(word) for word in words] or [1, 2]:
        rng = np.random.default_rng(seed)
        start = 1.0 + OFF * rng.uniform(-1.0, 1.0, len(NAMES))
        noise = rng.normal(size=2 * (round(TO / 0.01) + 1))
        for size in (0.0, 1.0):
            for name, (accuracy, more) in ways.items():
                measured = Fit(model, tangents, initial, 1e-9).angles(np.ones(len(NAMES)))
                fit = Fit(model, tangents, initial, accuracy)
                fit.measured = measured + size * NOISE * noise
                started = time.process_time()
                found = least_squares(
                    fit.angles,
                    start,
                    bounds=(1.0 - WITHIN, 1.0 + WITHIN),
                    **{"jac": fit.slopes, **more},
                )
                seconds = time.process_time() - started
                off = 100.0 * np.abs(found.x - 1.0)
                residual = np.sqrt(2.0 * found.cost / len(fit.measured))
                print(
                    f"| {seed} | {size * NOISE:g} | {name} | {found.nfev} | {fit.motions} | {seconds:.1f} | "
                    f"{residual:.4f} | {np.sqrt(np.mean(off**2)):.2g} | {off.max():.2g} |",
                    flush=True,
                )


if __name__ == "__main__":
    main(sys.argv[1:])
