"""Equations of motion with known solutions, and an engine that integrates any equations."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np

from osimlite.mechanics.kernels import record
from osimlite.mechanics.kernels.layout import MODEL, WORK
from osimlite.mechanics.kernels.table import LAW_NUMBERS
from osimlite.simulation.engines.controlled_steps import ControlledSteps
from osimlite.simulation.engines.linking import PYTHON_CODE, Program
from osimlite.simulation.options import IntegrationOptions
from osimlite.simulation.pack import PackedModel


def oscillator(t, y):
    """Differentiate a unit mass on a unit spring: q = cos t from (1, 0)."""
    return [y[1], -y[0]]


def pendulum(t, y):
    return [y[1], -9.81 * math.sin(y[0])]


def cannon(t, y):
    """Differentiate a fall with quadratic drag: u = tanh t from rest."""
    return [y[1], 1.0 - y[1] * y[1]]


def last(pairs):
    for pair in pairs:
        final = pair
    return final


class Counting:
    """Derivative function that counts its calls and remembers the last arguments."""

    def __init__(self, f):
        self.f = f
        self.calls = 0
        self.latest = None

    def __call__(self, t, y):
        self.calls += 1
        self.latest = t, list(y)
        return self.f(t, y)


class Equations:
    """Engine whose derivatives are a function of (t, y), with n coordinates, n speeds and further states."""

    contacts = ()

    def __init__(self, f, size, n, counted=None, names=None, code=PYTHON_CODE):
        def evaluate(s, x, w, y, derivative, stage):
            derivative[:size] = f(float(w[WORK.TIME]), y[:size].tolist())

        first = WORK.SIZE
        structure = np.zeros(MODEL.LAWS + len(LAW_NUMBERS), dtype=np.int64)
        structure[[MODEL.DOFS, MODEL.STATE_SIZE, MODEL.WORK_STATE]] = n, size, first
        structure[MODEL.WORK_SIZE] = first + record.STATES * size
        kernels = {MODEL.LAWS + LAW_NUMBERS["evaluate"]: evaluate}
        packed = PackedModel(structure, np.zeros(1), (), kernels, {}, {}, {}, {}, (), [], [])
        self.program = Program(packed, code, ("run_several", "merson"))
        self.structure, self.numbers, self.order = structure, packed.numbers, (0,) * n
        self.error_counts = (n, n) if counted is None else counted
        names = [f"state {k}" for k in range(size)] if names is None else names
        self.state = SimpleNamespace(names=names, to_table=lambda rows: np.array(rows, dtype=float))
        self.compute_derivative = f

    def project_state(self, t, y, tolerance):
        return y

    def store_contact_loads(self, forces):
        pass


def runge_kutta_merson(
    f, t: float, y: Any, n: int, *, observe: Any = None, accuracy: float = 1e-3, **options: Any
):
    """Return a Runge-Kutta-Merson integrator of any equations.

    Args:
        f: derivative function of (t, y).
        t: initial time.
        y: initial state.
        n: number of coordinates.
        observe: function that is called after each step.
        accuracy: accuracy of the integrator.
        options: further arguments of `Equations`.
    """
    engine: Any = Equations(f, len(y), n, **options)
    return ControlledSteps(engine, t, y, IntegrationOptions(accuracy=accuracy), observe)
