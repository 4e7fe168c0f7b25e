"""Comparison of CasADi functions with machine code and with the kernels: random states, derivatives, differences."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

import osimlite
from osimlite.simulation.constrained import find_consistent_state
from osimlite.simulation.pack import pack
from osimlite.simulation.run import Simulation
from tests.derivatives.jets import differentiate_by_jets


class Beside:
    """Model as CasADi functions, and as machine code that takes the same states."""

    def __init__(self, model: Any, **choices: Any) -> None:
        self.functions = osimlite.casadi(model, **choices)
        engine: Any = Simulation(model, "compiled").engine
        self.engine = engine
        infos, order = engine.mechanism.coordinates, engine.order
        own = [
            f"{infos[place].path}/{what}" for what in ("value", "speed") for place in order
        ] + engine.state.paths
        self.places = [own.index(name) for name in self.functions.states]
        self.size = len(self.functions.coordinates)
        # Time at which both are evaluated.
        self.t = 0.3
        self._made: Any = None

    def state(self, seed: int, change: float = 0.1) -> np.ndarray:
        """Return a random state near the initial state.

        Args:
            seed: seed of the random numbers.
            change: standard deviation of the changes of coordinates.
        """
        rng, x = np.random.default_rng(seed), self.functions.x.copy()
        x[: self.size] += change * rng.normal(size=self.size)
        x[self.size : 2 * self.size] += rng.normal(size=self.size)
        auxiliary = x[2 * self.size :]
        auxiliary *= rng.uniform(0.9, 1.1, len(auxiliary))
        # Many internal states start at zero, where derivatives are special.
        auxiliary[auxiliary == 0.0] = rng.uniform(0.05, 0.3, np.count_nonzero(auxiliary == 0.0))
        return x

    def kept(self, x: np.ndarray) -> np.ndarray:
        """Return a state near x that fulfils the constraints."""
        infos, order = self.engine.mechanism.coordinates, self.engine.order
        values, speeds = (
            np.array([getattr(i, f"default_{what}") for i in infos]) for what in ("value", "speed")
        )
        y = np.zeros(len(x))
        y[self.places] = x
        values[[*order]], speeds[[*order]] = y[: self.size], y[self.size : 2 * self.size]
        values, speeds = find_consistent_state(
            self.engine.mechanism, values.tolist(), speeds.tolist(), (), ()
        )
        y[: self.size], y[self.size : 2 * self.size] = values[[*order]], speeds[[*order]]
        return y[self.places]

    def derivative(self, x: np.ndarray) -> np.ndarray:
        """Compute the state derivative by machine code."""
        y = np.zeros(len(x))
        y[self.places] = x
        return np.array(self.engine.compute_derivative(self.t, y.tolist()))[self.places]

    def controls(self, x: np.ndarray) -> list[float]:
        """Return the controls of the model's controllers at a state."""
        self.derivative(x)
        result: list[float] = self.engine.read_controls()
        return result

    def xdot(self, x: np.ndarray) -> np.ndarray:
        """Compute the state derivative by the CasADi function, with the controls of the model's controllers."""
        f = self.functions
        return np.array(f.dynamics(self.t, x, self.controls(x), f.p)).ravel()

    def errors(self, x: np.ndarray, seed: int = 0) -> dict[str, float]:
        """Compare value, Jacobian and Hessian by the state with those of the kernels, at random controls.

        The Hessian is that of a random combination of the rows, along a random direction. Functions
        that are no SX expressions have none.

        Returns:
            Largest differences of "value", "jacobian" and "hessian", relative to the size of the
            terms or to one.
        """
        f, rng, n = self.functions, np.random.default_rng(seed), len(x)
        u, push, along = (
            rng.uniform(0.05, 0.95, len(f.controls)),
            rng.normal(size=n),
            rng.normal(size=n),
        )
        y, way = np.zeros(n), np.zeros(n)
        y[self.places], way[self.places] = x, along
        packed = pack(self.engine.mechanism, self.engine.forces)
        value, jacobian, bends = differentiate_by_jets(packed, self.t, y.tolist(), u.tolist(), way)
        value, bends = value[self.places], bends[np.ix_(self.places, self.places)]
        jacobian = jacobian[np.ix_(self.places, self.places)]
        found = self._derivatives(x, u, push, along)
        result = {"value": off(found[0], value), "jacobian": off(found[1], jacobian)}
        if len(found) > 2:
            sizes = np.abs(bends).T @ np.abs(push) + np.abs(jacobian).T @ np.abs(push)
            result["hessian"] = off(found[2], bends.T @ push, sizes)
        return result

    def _derivatives(self, *given: np.ndarray) -> list[np.ndarray]:
        if self._made is None:
            # Import CasADi here: processes with OpenSim cannot load it, but use the rest of this
            # module.
            import casadi

            n, made = len(self.functions.states), self.functions.dynamics
            x, u, push, along = (
                casadi.MX.sym(name, size)
                for name, size in zip("xupd", (n, len(given[1]), n, n), strict=True)
            )
            xdot = made(self.t, x, u, self.functions.p)
            found = [xdot, casadi.jacobian(xdot, x)]
            if made.is_a("SXFunction"):
                found.append(casadi.jtimes(casadi.jtimes(xdot, x, push, True), x, along))
            self._made = casadi.Function("all", [x, u, push, along], found)
        return [
            np.array(part.full()).squeeze(-1 if k != 1 else ())
            for k, part in enumerate(self._made(*given))
        ]


def slope(function: Callable[[float], np.ndarray], h: float) -> np.ndarray:
    """Differentiate a function at zero by central differences with two Richardson extrapolations."""
    rows = [(function(h / 2**k) - function(-h / 2**k)) / (2 * h / 2**k) for k in range(3)]
    rows = [(4 * b - a) / 3 for a, b in pairwise(rows)]
    return (16 * rows[1] - rows[0]) / 15


def off(a: np.ndarray, b: np.ndarray, sizes: np.ndarray | None = None) -> float:
    """Return the largest difference, relative to the magnitude of each number or to one.

    Args:
        a: numbers to check.
        b: reference.
        sizes: magnitudes; by default those of the reference.
    """
    return float(
        np.max(np.abs(a - b) / np.maximum(1.0, np.abs(b) if sizes is None else sizes), initial=0.0)
    )
