"""Machine code beside the functions of CasADi: states of random numbers, derivatives, differences."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

import osimlite
from osimlite.simulation.run import Simulation


class Beside:
    """A model as functions of CasADi, and as machine code that takes the same states."""

    def __init__(self, model: Any, **choices: Any) -> None:
        self.functions = osimlite.casadi(model, **choices)
        engine: Any = Simulation(model, "compiled").engine
        self.engine = engine
        infos, order = engine.mechanism.coordinates, engine.order
        own = [f"{infos[place].path}/{what}" for what in ("value", "speed") for place in order] + engine.state.paths
        self.places = [own.index(name) for name in self.functions.states]
        self.size = len(self.functions.coordinates)
        # What drives the machine code is what the functions are given.
        self.t = 0.3

    def state(self, seed: int, change: float = 0.1) -> np.ndarray:
        """A random state near the first one."""
        rng, x = np.random.default_rng(seed), self.functions.x.copy()
        x[: self.size] += change * rng.normal(size=self.size)
        x[self.size : 2 * self.size] += rng.normal(size=self.size)
        x[2 * self.size :] *= rng.uniform(0.9, 1.1, len(x) - 2 * self.size)
        return x

    def derivative(self, x: np.ndarray) -> np.ndarray:
        """By machine code."""
        y = np.zeros(len(x))
        y[self.places] = x
        return np.array(self.engine.derivative(self.t, y.tolist()))[self.places]

    def controls(self, x: np.ndarray) -> list[float]:
        """What the model's controllers say."""
        self.derivative(x)
        result: list[float] = self.engine.controls()
        return result

    def xdot(self, x: np.ndarray) -> np.ndarray:
        """By the function."""
        f = self.functions
        return np.array(f.dynamics(self.t, x, self.controls(x), f.p)).ravel()


def slope(function: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Derivative at zero by central differences, extrapolated twice."""
    rows = [(function(h / 2**k) - function(-h / 2**k)) / (2 * h / 2**k) for k in range(3)]
    rows = [(4 * b - a) / 3 for a, b in pairwise(rows)]
    return (16 * rows[1] - rows[0]) / 15


def off(a: np.ndarray, b: np.ndarray) -> float:
    """The largest difference, each relative to the size of the number, or to one."""
    return float(np.max(np.abs(a - b) / np.maximum(1.0, np.abs(b)), initial=0.0))
