from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.errors import ModelError
from osimlite.mechanics.multibody import functions as f
from osimlite.mechanics.multibody.motions import EllipsoidPoint
from osimlite.mechanics.multibody.schema_functions import convert_function
from tests.mechanics.multibody.cases import function, load

TABLE = load("functions_table.json")["functions"]


def _label(item):
    return f"{item['spec']['type']}-{len(item['spec'].get('x', ()))}"


@pytest.mark.parametrize("item", TABLE, ids=_label)
def test_values_and_derivatives_are_opensims(item):
    built = function(item["spec"])
    knots = item["spec"].get("x", ())
    # Where two abscissae coincide, the values from OpenSim have nine digits.
    tolerance = 1e-8 if len(set(knots)) < len(knots) else 1e-13
    for x, *expected in item["rows"]:
        value, gradient, hessian = built.evaluate(np.array((x,)))
        result = (value, gradient[0], hessian[0][0])
        scale = [max(1.0, abs(number)) for number in expected]
        assert np.abs(np.subtract(result, expected) / scale).max() < tolerance


@pytest.mark.parametrize(
    ("count", "values", "slopes"),
    [
        (5, [0, 1, 4, 4, 16], [1, 3, 5, 5, 7]),
        (6, [0, 1, 1, 9, 9, 25], [1, 3, 3, 7, 7, 9]),
        (7, [0, 1, 1, 9, 9, 25, 36], [1, 3, 3, 7, 7, 11, 11]),
        (8, [0, 1, 4, 4, 16, 16, 36, 49], [1, 3, 5, 5, 9, 9, 13, 13]),
    ],
)
def test_at_a_knot_the_neighbour_is_the_one_opensim_takes(count, values, slopes):
    """The points are squares at 0, 1, 2 ...; OpenSim 4.6 returns these values exactly at the knots."""
    x = tuple(float(k) for k in range(count))
    y = tuple(k * k for k in x)
    knots = [np.array((k,)) for k in x]
    assert [f.PiecewiseConstant(x, y).evaluate(knot)[0] for knot in knots] == values
    assert [f.PiecewiseLinear(x, y).evaluate(knot)[1][0] for knot in knots] == slopes


def test_only_linear_functions_have_a_slope():
    assert f.Linear(-1.0, 0.3).slope == -1.0
    assert f.IDENTITY.slope == 1.0
    assert f.ConstantValue(2.0).slope is None
    assert f.ScaledFunction(1.0, f.IDENTITY).slope is None


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=9, unique_by=lambda x: round(x, 2)),
    st.integers(0, 2**32 - 1),
    st.floats(-3.0, 3.0),
)
def test_a_spline_meets_its_points_and_is_twice_smooth(knots, seed, x):
    knots = sorted(round(value, 2) for value in knots)
    heights = np.random.default_rng(seed).uniform(-1.0, 1.0, len(knots))
    spline = f.SimmCubicSpline(knots, heights)
    for knot, height in zip(knots, heights, strict=True):
        assert spline.evaluate(np.array((knot,)))[0] == pytest.approx(height, abs=1e-9)
    if len(knots) > 2:
        inner = knots[1]
        below, above = (spline.evaluate(np.array((inner + side,))) for side in (-1e-11, 1e-11))
        steepest = 1.0 + abs(above[2][0][0])
        assert below[1][0] == pytest.approx(above[1][0], abs=1e-6 * steepest)
    if x < knots[0] or x > knots[-1]:
        assert spline.evaluate(np.array((x,)))[2][0][0] == 0.0


@given(st.integers(0, 2), st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_the_point_of_an_ellipsoid_has_the_derivatives_of_its_values(component, angles):
    point, at, step = EllipsoidPoint(component, 0.3), np.array(angles), 1e-5
    _, gradient, hessian = point.evaluate(at)
    for k in range(3):
        forward, backward = at.copy(), at.copy()
        forward[k] += step
        backward[k] -= step
        high, low = point.evaluate(forward), point.evaluate(backward)
        assert gradient[k] == pytest.approx((high[0] - low[0]) / (2 * step), abs=1e-9)
        assert hessian[k] == pytest.approx(np.subtract(high[1], low[1]) / (2 * step), abs=1e-9)


def test_a_sine_is_a_sine():
    wave = f.SineWave(2.0, 3.0, 0.5, 1.0)
    assert wave.evaluate(np.array((0.1,)))[0] == pytest.approx(2.0 * math.sin(0.8) + 1.0, abs=1e-15)


def _slopes(
    function: f.SmoothFunction, at: np.ndarray, step: float = 1e-5
) -> tuple[np.ndarray, np.ndarray]:
    """Return gradient and Hessian by central differences.

    Args:
        function: the function.
        at: point.
        step: step of the differences.
    """
    pairs = [
        [function.evaluate(at + sign * step * np.eye(len(at))[k]) for sign in (1.0, -1.0)]
        for k in range(len(at))
    ]
    gradient = np.array([(high[0] - low[0]) / (2.0 * step) for high, low in pairs])
    hessian = np.array([np.subtract(high[1], low[1]) / (2.0 * step) for high, low in pairs])
    return gradient, hessian


@given(st.integers(1, 3), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_a_polynomial_of_several_variables_has_the_derivatives_of_its_values(
    dimension, order, seed
):
    rng = np.random.default_rng(seed)
    polynomial = f.MultivariatePolynomial.complete(
        rng.uniform(-1.0, 1.0, math.comb(dimension + order, order)).tolist(), dimension, order
    )
    at = rng.uniform(-1.0, 1.0, dimension)
    _, gradient, hessian = polynomial.evaluate(at)
    slopes, bends = _slopes(polynomial, at)
    assert gradient == pytest.approx(slopes, abs=1e-8)
    assert hessian == pytest.approx(bends, abs=1e-8)


def test_the_monomials_come_in_opensims_order():
    # The order is 1, y, y², x, xy, x².
    polynomial = f.MultivariatePolynomial.complete((1.0, 10.0, 100.0, 1e3, 1e4, 1e5), 2, 2)
    value, gradient, hessian = polynomial.evaluate(np.array((2.0, 3.0)))
    assert value == 1.0 + 30.0 + 900.0 + 2e3 + 6e4 + 4e5
    assert gradient == [1e3 + 3e4 + 4e5, 10.0 + 600.0 + 2e4]
    assert hessian == [[2e5, 1e4], [1e4, 200.0]]
    theirs = f.MultivariatePolynomial(
        polynomial.coefficients, polynomial.powers, opensim_derivatives=True
    )
    assert theirs.evaluate(np.array((2.0, 3.0)))[2] == [[gradient[0]] * 2, [gradient[1]] * 2]


@given(st.floats(-1.0, 2.0))
def test_a_step_has_the_derivatives_of_its_values(x):
    step = f.QuinticStep(0.2, 0.9, -1.0, 2.5)
    _, gradient, hessian = step.evaluate(np.array((x,)))
    slopes, bends = _slopes(step, np.array((x,)))
    assert gradient == pytest.approx(slopes, abs=1e-6)
    assert hessian == pytest.approx(bends, abs=2e-3)
    assert step.evaluate(np.array((0.55,)))[0] == pytest.approx(0.75)


def test_a_weighted_sum():
    value, gradient, hessian = f.WeightedSum((2.0, -1.0), 0.5).evaluate(np.array((3.0, 4.0)))
    assert (value, gradient, hessian) == (2.5, [2.0, -1.0], [[0.0, 0.0], [0.0, 0.0]])


def test_a_function_that_is_not_there_is_named():
    with pytest.raises(
        ModelError, match=r"the function of '/constraintset/c' is missing; give one"
    ):
        convert_function(None, 1, "the function of '/constraintset/c'")
