"""Tests of the ends of steps and reports, and of the interpolation in between."""

from __future__ import annotations

import math
from functools import partial

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.simulation.euler import SemiImplicitEuler
from tests.simulation.equations import Counting, last, oscillator, pendulum, runge_kutta_merson


@pytest.mark.parametrize(
    ("limit", "ends"),
    [
        (0.005, [0.005, 0.015]),  # a step that is cut short does not let the next one grow
        (0.0094, [0.0094, 0.0194]),
        (0.0096, [0.0096, 0.0596]),  # nearly a complete step: the next one is five times as large
        (0.010005, [0.010005, 0.060005]),  # a complete step is stretched a little to the limit
        (0.0102, [0.01, 0.0102, 0.0602]),  # the remainder needs another step
    ],
)
def test_steps_near_a_limit(limit, ends):
    """Without errors, the first step is the initial one of 0.01 s, and each growth is fivefold."""
    integrator = runge_kutta_merson(lambda t, y: [y[1], 0.0], 0.0, [0.0, 0.0], 1)
    times = [t for t, _ in integrator.iterate_steps(limit)]
    integrator.step()
    assert [*times, integrator.time] == pytest.approx(ends, rel=1e-12)


def steppers():
    return [
        runge_kutta_merson(pendulum, 0.0, [1.0, 0.0], 1),
        SemiImplicitEuler(pendulum, 0.0, [1.0, 0.0], 1, 1e-3),
    ]


@pytest.mark.parametrize("which", [0, 1])
def test_steps_end_where_they_are_told_to_and_go_on(which):
    stepper = steppers()[which]
    first = list(stepper.iterate_steps(0.7305))
    assert first[-1][0] == stepper.time == 0.7305
    assert first[-1][1] is stepper.state
    second = list(stepper.iterate_steps(1.0))
    assert second[-1][0] == 1.0
    times = [t for t, _ in first + second]
    assert times == sorted(set(times))
    assert list(stepper.iterate_steps(1.0)) == []
    assert last(stepper.iterate_steps(2.0))[0] == 2.0


@pytest.mark.parametrize("which", [0, 1])
def test_reports_do_not_change_the_steps(which):
    alone, reporting = steppers()[which], steppers()[which]
    list(alone.iterate_steps(1.0))
    seen = [list(row) for row in reporting.tabulate([0.0, 0.0, 1e-4, 0.25, 0.2503, 1.0])]
    assert len(seen) == 6
    assert (reporting.accepted, reporting.time, reporting.state) == (
        alone.accepted,
        alone.time,
        alone.state,
    )
    assert seen[0] == seen[1] == [1.0, 0.0]
    assert seen[-1] == alone.state


def test_reports_are_as_accurate_as_steps():
    integrator = runge_kutta_merson(oscillator, 0.0, [1.0, 0.0], 1, accuracy=1e-6)
    times = [i / 100 for i in range(501)]
    for t, y in zip(times, integrator.tabulate(times), strict=True):
        assert y == pytest.approx([math.cos(t), -math.sin(t)], abs=2e-5)
    assert integrator.accepted < 200


@given(st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4), st.floats(0.0, 1.0))
def test_interpolation_is_exact_for_cubic_motion(coefficients, fraction):
    a, b, c, d = coefficients
    integrator = runge_kutta_merson(lambda t, y: [b + t * (2 * c + t * 3 * d)], 0.0, [a], 0)
    list(integrator.iterate_steps(0.5))
    start = integrator.previous[0]
    t = start + fraction * (0.5 - start)
    assert integrator.interpolate(t)[0] == pytest.approx(a + t * (b + t * (c + t * d)), abs=1e-9)


@pytest.mark.parametrize("which", [0, 1])
def test_states_outside_the_last_step_are_refused(which):
    stepper = steppers()[which]
    list(stepper.iterate_steps(0.5))
    with pytest.raises(ValueError, match="outside the last step"):
        stepper.interpolate(0.1)
    with pytest.raises(ValueError, match="outside the last step"):
        stepper.interpolate(0.5001)
    with pytest.raises(ValueError, match="limit"):
        stepper.step(0.5)


@pytest.mark.parametrize("make", [runge_kutta_merson, partial(SemiImplicitEuler, h=1e-2)])
def test_the_observer_sees_each_step_right_after_its_derivative(make):
    f = Counting(pendulum)
    seen = []

    def observe(t, y):
        assert f.latest == (t, y)
        seen.append((t, y))

    stepper = make(f, 0.0, [1.0, 0.0], 1, observe=observe)
    assert seen == []
    assert list(stepper.iterate_steps(0.5)) == seen
