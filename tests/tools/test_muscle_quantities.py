"""Tests of quantities of fibers and tendons: velocities are derivatives of lengths and angles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import osimlite
from osimlite.simulation.elements.muscle import SPRING
from osimlite.tools.muscle_quantities import compute_quantities

STEP = 1e-6


def records(t: float) -> dict[str, Any]:
    """Return the values that the law of a muscle of constant width records at a time, with arbitrary forces."""
    width = 0.02
    along, along_rate = 0.08 + 0.01 * np.sin(3.0 * t), 0.03 * np.cos(3.0 * t)
    fiber = np.hypot(width, along)
    numbers = {
        "tension": 250.0, "fiber_length": fiber, "cos_pennation": along / fiber,
        "active_fiber_force": 180.0, "passive_fiber_force": 90.0, SPRING: 70.0,
        "length": along + 0.2 + 0.005 * t, "rate": along_rate + 0.005,
        "fiber_velocity": along_rate * along / fiber,
    }  # fmt: skip
    return {name: np.array([[number]]) for name, number in numbers.items()}


def test_rates_and_powers_follow_from_lengths_and_forces() -> None:
    muscle = osimlite.Thelen2003Muscle(
        name="m", optimal_fiber_length=0.09, max_contraction_velocity=12.0
    )
    before, now, after = (
        {
            name: float(table[0, 0])
            for name, table in compute_quantities(records(t), [muscle]).items()
        }
        for t in (0.4 - STEP, 0.4, 0.4 + STEP)
    )
    rates = {name: (after[name] - before[name]) / (2.0 * STEP) for name in now}
    fiber, turning, tendon, path = (
        rates[name] for name in ("FiberLength", "PennationAngle", "TendonLength", "Length")
    )
    assert now == pytest.approx(
        now
        | {
            "NormalizedFiberLength": now["FiberLength"] / 0.09,
            "FiberVelocity": fiber,
            "NormFiberVelocity": fiber / (0.09 * 12.0),
            "PennationAngularVelocity": turning,
            # The passive power is that of the parallel spring, and the active power that of all
            # other fiber forces.
            "FiberPassivePower": -70.0 * fiber,
            "FiberActivePower": -(180.0 + 90.0 - 70.0) * fiber,
            "TendonPower": -250.0 * tendon,
            "MuscleActuatorPower": -250.0 * path,
        },
        rel=1e-7,
    )
