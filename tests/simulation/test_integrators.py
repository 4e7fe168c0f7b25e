"""Tests of Runge-Kutta-Merson on equations with known solutions, and of its errors."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import OsimliteError, SimulationError
from osimlite.mechanics.kernels.error_control import next_step_size
from osimlite.simulation.euler import SemiImplicitEuler
from osimlite.simulation.stepper import IntegrationError
from tests.simulation.equations import (
    Counting,
    cannon,
    last,
    oscillator,
    pendulum,
    runge_kutta_merson,
)

# ------------------------------------------------------------------------------------- Runge-Kutta-Merson's method


def fixed_steps(f, y, until, n):
    """Return the state after n steps of equal length, which the error control does not change."""
    integrator = runge_kutta_merson(f, 0.0, y, len(y) // 2, accuracy=0.9)
    for i in range(n):
        integrator.next_step = until / n
        integrator.step(until * (i + 1) / n)
    assert integrator.attempted == n
    return integrator.state


@pytest.mark.parametrize("f", [pendulum, cannon])
def test_fourth_order(f):
    reference = fixed_steps(f, [1.0, 0.0], 1.0, 1000)
    errors = [abs(fixed_steps(f, [1.0, 0.0], 1.0, n)[0] - reference[0]) for n in (40, 80, 160)]
    for coarse, fine in pairwise(errors):
        assert math.log2(coarse / fine) == pytest.approx(4.0, abs=0.35)


@given(
    st.lists(st.floats(-3.0, 3.0), min_size=4, max_size=4),
    st.floats(0.1, 2.0),
    st.floats(-1.0, 1.0),
)
def test_exact_for_cubic_derivatives(coefficients, h, t0):
    """The quadrature is exact for cubic derivatives, at the solution's weights and the nodes of the method."""
    a, b, c, d = coefficients

    def antiderivative(t):
        return t * (a + t * (b / 2 + t * (c / 3 + t * d / 4)))

    def f(t, y):
        return [a + t * (b + t * (c + t * d))]

    integrator = runge_kutta_merson(f, t0, [0.0], 0, accuracy=0.9)
    integrator.next_step = h
    integrator.step()
    wanted = antiderivative(integrator.time) - antiderivative(t0)
    assert integrator.state[0] == pytest.approx(wanted, abs=1e-12 * (1 + h) ** 4 * 20)


# ------------------------------------------------------------------------------------------------ error control


@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9, 1e-11])
def test_error_follows_the_accuracy(accuracy):
    integrator = runge_kutta_merson(oscillator, 0.0, [1.0, 0.0], 1, accuracy=accuracy)
    t, y = last(integrator.iterate_steps(10.0))
    assert t == 10.0
    error = max(abs(y[0] - math.cos(10.0)), abs(y[1] + math.sin(10.0)))
    # Each step errs by at most the accuracy; an oscillator does not amplify earlier errors.
    assert error < 2.0 * accuracy * integrator.accepted
    assert error > 1e-3 * accuracy


def test_more_accuracy_costs_more_and_gains():
    errors, costs = [], []
    for accuracy in (1e-3, 1e-5, 1e-7, 1e-9):
        integrator = runge_kutta_merson(cannon, 0.0, [0.0, 0.0], 1, accuracy=accuracy)
        _, y = last(integrator.iterate_steps(3.0))
        errors.append(abs(y[0] - math.log(math.cosh(3.0))))
        costs.append(integrator.evaluations)
    assert errors == sorted(errors, reverse=True)
    assert costs == sorted(costs)


def test_default_accuracy_and_first_step_are_opensims():
    first = runge_kutta_merson(lambda t, y: [y[1], 0.0], 0.0, [0.0, 0.0], 1)
    first.step()
    assert first.time == 0.01  # without an error: accepted ...
    first.step()
    assert first.time == pytest.approx(0.06)  # ... and the next step is five times as large
    by_default = list(runge_kutta_merson(pendulum, 0.0, [1.0, 0.0], 1).iterate_steps(2.0))
    assert by_default == list(
        runge_kutta_merson(pendulum, 0.0, [1.0, 0.0], 1, accuracy=1e-3).iterate_steps(2.0)
    )


def test_speeds_count_relative_to_their_size_and_coordinates_do_not():
    def exponential(t, y):
        return [4.0 * x for x in y]

    def count(y, n):
        integrator = runge_kutta_merson(exponential, 0.0, y, n, accuracy=1e-6)
        last(integrator.iterate_steps(1.0))
        return integrator.attempted

    assert count([0.0, 1e3], 1) == count([0.0, 1e6], 1)
    assert count([1e6, 0.0], 1) > 1.5 * count([1e3, 0.0], 1)
    # Below 1, errors of speeds count absolutely.
    assert (
        count([0.0, 1e-9], 1) < count([0.0, 1e-3], 1) < count([0.0, 1.0], 1) == count([0.0, 1e3], 1)
    )
    # Auxiliary states count as speeds do.
    assert count([1e6], 0) == count([0.0, 1e6], 1)


def test_coordinates_left_out_may_be_counted():
    """A locked coordinate counts in the error norm, whether it is a state or only counted."""

    def locked(t, y):
        return [0.0, y[3], 0.0, -9.81 * math.sin(y[1])]

    with_it = [
        t for t, _ in runge_kutta_merson(locked, 0.0, [0.3, 1.0, 0.0, 0.0], 2).iterate_steps(2.0)
    ]
    counted = runge_kutta_merson(pendulum, 0.0, [1.0, 0.0], 1, counted=(2, 2))
    assert [t for t, _ in counted.iterate_steps(2.0)] == with_it
    assert [
        t for t, _ in runge_kutta_merson(pendulum, 0.0, [1.0, 0.0], 1).iterate_steps(2.0)
    ] != with_it


def test_the_worst_of_coordinates_speeds_and_auxiliary_states_decides():
    """The three states are independent: the most demanding one determines the steps."""

    def apart(t, y):
        return [math.cos(3 * t), math.cos(20 * t), math.cos(7 * t)]

    together = runge_kutta_merson(apart, 0.0, [0.0, 0.0, 0.0], 1)
    alone = runge_kutta_merson(lambda t, y: [math.cos(20 * t)], 0.0, [0.0], 0)
    assert [t for t, _ in together.iterate_steps(1.0)] == [t for t, _ in alone.iterate_steps(1.0)]


positive = st.floats(1e-12, 1e3)


@given(positive, st.floats(0.0, 1e6), st.floats(1e-12, 0.5), st.booleans())
def test_next_step(h, error, accuracy, cut):
    new = next_step_size(h, error, accuracy, cut, 4.0)
    assert 0.1 * h <= new <= 5.0 * h
    assert (new < h) == (error > accuracy)
    if new > h:
        assert not cut and new >= 1.2 * h
    if new < h:
        assert new <= 0.9 * h
    if h < new < 5.0 * h or 0.1 * h < new < 0.9 * h:
        # The expected error of the new step is 0.9^4 of the accuracy.
        assert error * (new / h) ** 4 == pytest.approx(0.9**4 * accuracy, rel=1e-6)


@pytest.mark.parametrize(
    ("wanted", "chosen"),
    [
        (20.0, 5.0),
        (4.0, 4.0),
        (1.21, 1.21),
        (1.19, 1.0),
        (0.91, 1.0),
        (0.895, 0.895),
        (0.5, 0.5),
        (0.05, 0.1),
    ],
)
def test_next_step_where_a_given_one_is_wanted(wanted, chosen):
    """Arguments are factors of the current step; just below 0.9 the error exceeds the accuracy."""
    assert next_step_size(1.0, 1e-3 * (0.9 / wanted) ** 4, 1e-3, False, 4.0) == pytest.approx(
        chosen
    )


@pytest.mark.parametrize("error", [math.nan, math.inf])
def test_next_step_after_a_failed_evaluation(error):
    assert next_step_size(1.0, error, 1e-3, False, 4.0) == 0.1


def test_counts():
    f = Counting(pendulum)
    integrator = runge_kutta_merson(f, 0.0, [3.0, 0.0], 1)
    steps = list(integrator.iterate_steps(10.0))
    assert len(steps) == integrator.accepted
    assert integrator.attempted > integrator.accepted
    assert integrator.evaluations == 1 + 4 * integrator.attempted + integrator.accepted
    # A single step evaluates its start once more.
    assert f.calls == integrator.evaluations + integrator.accepted
    together = Counting(pendulum)
    runge_kutta_merson(together, 0.0, [3.0, 0.0], 1).tabulate([10.0])
    assert integrator.evaluations < together.calls < f.calls


# ---------------------------------------------------------------------------------------------------------- errors


def test_a_derivative_that_is_no_number_at_the_start():
    with pytest.raises(
        IntegrationError, match=r"derivative of knee_speed is nan at t = 2\.5 s"
    ) as caught:
        runge_kutta_merson(
            lambda t, y: [0.0, math.nan], 2.5, [0.0, 1.0], 1, names=["knee", "knee_speed"]
        )
    assert (caught.value.time, caught.value.index) == (2.5, 1)
    assert isinstance(caught.value, SimulationError) and isinstance(caught.value, OsimliteError)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_derivative_that_ceases_to_exist(bad):
    """The integrator approaches the time of the discontinuity and reports it."""

    def f(t, y):
        return [y[1], 0.0, bad if t > 0.7 else 1.0]

    integrator = runge_kutta_merson(f, 0.0, [0.0, 1.0, 0.0], 1)
    with pytest.raises(IntegrationError, match="derivative of state 2") as caught:
        list(integrator.iterate_steps(1.0))
    assert caught.value.time == pytest.approx(0.7)
    assert caught.value.index == 2
    assert integrator.time == pytest.approx(0.7)


def test_no_number_in_a_trial_step_only():
    """A first step into undefined states is shortened, as Simbody does."""

    def f(t, y):
        return [math.nan if y[0] > 1.1 else -400.0 * (y[0] - 1.0)]

    integrator = runge_kutta_merson(f, 0.0, [0.0], 0)
    _, y = last(integrator.iterate_steps(0.1))
    assert y[0] == pytest.approx(1.0, abs=1e-3)
    assert integrator.attempted > integrator.accepted


def test_overflow_in_a_trial_step_only():
    failures = []

    def steep(t, y):
        try:
            return [-200.0 * math.sinh(y[0])]
        except OverflowError:
            failures.append(t)
            raise

    integrator = runge_kutta_merson(steep, 0.0, [8.0], 0)
    _, y = last(integrator.iterate_steps(0.1))
    assert y[0] == pytest.approx(0.0, abs=5e-3)
    assert failures and integrator.attempted > integrator.accepted


def test_overflow_for_good():
    def f(t, y):
        return [1.0 if t < 0.5 else math.exp(1e3)]

    with pytest.raises(
        IntegrationError, match=r"cannot be computed at t = 0\.5 s: math range error"
    ) as caught:
        list(runge_kutta_merson(f, 0.0, [0.0], 0).iterate_steps(1.0))
    assert isinstance(caught.value.__cause__, OverflowError)
    assert caught.value.time == pytest.approx(0.5)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_states_that_leave_the_range_of_numbers():
    def f(t, y):
        return [0.0, 1e308 if t > 0.5 else 0.0]

    with pytest.raises(IntegrationError, match="makes a number infinite or NaN: state 1") as caught:
        list(runge_kutta_merson(f, 0.0, [0.0, 1.7e308], 0).iterate_steps(3.0))
    assert caught.value.index == 1


def test_failing_at_the_first_state():
    with pytest.raises(IntegrationError, match="cannot be computed at t = 0 s"):
        runge_kutta_merson(lambda t, y: [1.0 / y[0]], 0.0, [0.0], 1)


def test_no_step_small_enough():
    """The solution of y' = y^2 is unbounded at t = 1."""
    integrator = runge_kutta_merson(
        lambda t, y: [0.0, y[1] * y[1]], 0.0, [0.0, 1.0], 1, names=["q", "speed of q"]
    )
    with pytest.raises(IntegrationError) as caught:
        list(integrator.iterate_steps(2.0))
    assert caught.value.time == pytest.approx(1.0, abs=1e-3)
    assert caught.value.index == 1
    assert "speed of q" in str(caught.value)


def test_a_jump_is_passed():
    _, y = last(
        runge_kutta_merson(lambda t, y: [0.0 if t < 0.5 else 1e6], 0.0, [0.0], 0).iterate_steps(0.6)
    )
    assert y[0] == pytest.approx(1e5, rel=1e-6)


@pytest.mark.parametrize("accuracy", [0.0, 1.0, -1e-3, math.nan])
def test_impossible_accuracies(accuracy):
    with pytest.raises(SimulationError, match="accuracy"):
        runge_kutta_merson(oscillator, 0.0, [1.0, 0.0], 1, accuracy=accuracy)


def test_sizes_that_do_not_fit():
    with pytest.raises(ValueError, match="1 derivatives for 2 states"):
        runge_kutta_merson(lambda t, y: [0.0], 0.0, [1.0, 0.0], 1)
    with pytest.raises(ValueError, match="2 coordinates and as many speeds do not fit"):
        SemiImplicitEuler(oscillator, 0.0, [1.0, 0.0], 2, 1e-3)


def test_a_motion_ends_at_a_state_that_has_a_derivative():
    ends = []

    def f(t, y):
        if y[0] == t > 0.3:
            ends.append(t)
            return [math.nan]
        return [1.0]

    integrator = runge_kutta_merson(f, 0.0, [0.0], 0)
    with pytest.raises(IntegrationError):
        list(integrator.iterate_steps(1.0))
    assert ends and f(integrator.time, integrator.state) == [1.0]
