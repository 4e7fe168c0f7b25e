from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.multibody import functions as f
from osimlite.multibody.motions import EllipsoidPoint
from tests.multibody.cases import function, load

TABLE = load("functions_table.json")["functions"]


def _label(item):
    return f"{item['spec']['type']}-{len(item['spec'].get('x', ()))}"


@pytest.mark.parametrize("item", TABLE, ids=_label)
def test_values_and_derivatives_are_opensims(item):
    built = function(item["spec"])
    knots = item["spec"].get("x", ())
    # Where two abscissae coincide OpenSim's own numbers carry nine digits.
    tolerance = 1e-8 if len(set(knots)) < len(knots) else 1e-13
    for x, *expected in item["rows"]:
        value, gradient, hessian = built.evaluate(np.array((x,)))
        found = (value, gradient[0], hessian[0, 0])
        scale = [max(1.0, abs(number)) for number in expected]
        assert np.abs(np.subtract(found, expected) / scale).max() < tolerance


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
    """Squares at 0, 1, 2 ...: what OpenSim 4.6 returns exactly at the knots."""
    x = tuple(float(k) for k in range(count))
    y = tuple(k * k for k in x)
    knots = [np.array((k,)) for k in x]
    assert [f.PiecewiseConstant(x, y).evaluate(knot)[0] for knot in knots] == values
    assert [f.PiecewiseLinear(x, y).evaluate(knot)[1][0] for knot in knots] == slopes


def test_only_linear_functions_have_a_slope():
    assert f.Linear(-1.0, 0.3).slope == -1.0
    assert f.IDENTITY.slope == 1.0
    assert f.Constant(2.0).slope is None
    assert f.Scaled(1.0, f.IDENTITY).slope is None


@given(
    st.lists(st.floats(-2.0, 2.0), min_size=2, max_size=9, unique_by=lambda x: round(x, 2)),
    st.integers(0, 2**32 - 1),
    st.floats(-3.0, 3.0),
)
def test_a_spline_meets_its_points_and_is_twice_smooth(knots, seed, x):
    knots = sorted(round(value, 2) for value in knots)
    heights = np.random.default_rng(seed).uniform(-1.0, 1.0, len(knots))
    spline = f.SimmSpline(knots, heights)
    for knot, height in zip(knots, heights, strict=True):
        assert spline.evaluate(np.array((knot,)))[0] == pytest.approx(height, abs=1e-9)
    if len(knots) > 2:
        inner = knots[1]
        below, above = (spline.evaluate(np.array((inner + side,))) for side in (-1e-11, 1e-11))
        steepest = 1.0 + abs(above[2][0, 0])
        assert below[1][0] == pytest.approx(above[1][0], abs=1e-6 * steepest)
    if x < knots[0] or x > knots[-1]:
        assert spline.evaluate(np.array((x,)))[2][0, 0] == 0.0


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
        assert hessian[k] == pytest.approx((high[1] - low[1]) / (2 * step), abs=1e-9)


def test_a_sine_is_a_sine():
    wave = f.Sine(2.0, 3.0, 0.5, 1.0)
    assert wave.evaluate(np.array((0.1,)))[0] == pytest.approx(2.0 * math.sin(0.8) + 1.0, abs=1e-15)
