"""Tests of semi-implicit Euler on equations with known solutions, and of its errors."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest

from osimlite.errors import SimulationError
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.stepper import IntegrationError
from tests.simulation.equations import cannon, last, oscillator, pendulum


def test_one_euler_step():
    stepper = SemiImplicitEuler(pendulum, 0.0, [1.0, 0.5], 1, 0.01)
    stepper.step()
    u = 0.5 - 0.01 * 9.81 * math.sin(1.0)
    assert stepper.state == pytest.approx([1.0 + 0.01 * u, u], rel=1e-15)


def test_euler_is_of_first_order():
    errors = []
    for h in (1e-2, 5e-3, 2.5e-3):
        _, y = last(SemiImplicitEuler(cannon, 0.0, [0.0, 0.0], 1, h).iterate_steps(2.0))
        errors.append(abs(y[0] - math.log(math.cosh(2.0))))
    for coarse, fine in pairwise(errors):
        assert coarse / fine == pytest.approx(2.0, rel=0.05)


def test_euler_keeps_the_energy_of_an_oscillator():
    """The method is symplectic: the energy does not drift in a hundred periods."""
    for _, (q, u) in SemiImplicitEuler(oscillator, 0.0, [1.0, 0.0], 1, 0.05).iterate_steps(
        200 * math.pi
    ):
        assert q * q + u * u == pytest.approx(1.0, abs=0.06)


def test_euler_with_rates_of_its_own():
    """Coordinates are not integrals of the speeds here; the rates use the old coordinates and the new speeds."""

    def f(t, y):
        return [0.0, 1.0]

    def rates(q, u):
        return [3.0 * q[0] * u[0]]

    stepper = SemiImplicitEuler(f, 0.0, [2.0, 1.0], 1, 0.5, rates=rates)
    stepper.step()
    assert stepper.state == [2.0 + 0.5 * 3.0 * 2.0 * 1.5, 1.5]


def test_euler_counts_its_steps_without_drift():
    stepper = SemiImplicitEuler(oscillator, 0.0, [1.0, 0.0], 1, 1e-3)
    times = [t for t, _ in stepper.iterate_steps(2.0)]
    assert stepper.accepted == 2000 and times[-1] == 2.0
    assert max(abs(t - (i + 1) / 1000) for i, t in enumerate(times)) < 1e-15 * 4


def test_euler_shortens_only_the_last_step():
    stepper = SemiImplicitEuler(lambda t, y: [0.0, 0.0], 0.0, [0.0, 1.0], 1, 0.25)
    assert [t for t, _ in stepper.iterate_steps(0.6)] == [0.25, 0.5, 0.6]
    assert stepper.state[0] == pytest.approx(0.6)
    assert [t for t, _ in stepper.iterate_steps(1.1)] == pytest.approx([0.85, 1.1])
    assert stepper.accepted == 5 and stepper.state[0] == pytest.approx(1.1)


def test_euler_interpolates_on_a_line():
    stepper = SemiImplicitEuler(lambda t, y: [0.0, 0.0], 0.0, [0.0, 2.0], 1, 0.25)
    assert [y[0] for y in stepper.tabulate([0.1, 0.3, 0.5])] == pytest.approx([0.2, 0.6, 1.0])


def test_euler_names_what_is_no_number():
    stepper = SemiImplicitEuler(
        lambda t, y: [0.0, math.nan if t > 0.5 else 0.0],
        0.0,
        [0.0, 1.0],
        1,
        0.1,
        names=["hip", "hip_speed"],
    )
    with pytest.raises(
        IntegrationError, match=r"derivative of hip_speed is nan.*a control above 0"
    ) as caught:
        list(stepper.iterate_steps(1.0))
    assert caught.value.time == pytest.approx(0.6)


@pytest.mark.parametrize("h", [0.0, -1e-3, math.inf, math.nan])
def test_euler_refuses_impossible_steps(h):
    with pytest.raises(SimulationError, match="fixed step"):
        SemiImplicitEuler(oscillator, 0.0, [1.0, 0.0], 1, h)
