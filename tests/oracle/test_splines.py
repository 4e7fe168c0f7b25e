"""Compare splines through few or unevenly spaced points with OpenSim's GCVSpline.

The comparison includes arguments beyond the points.
"""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline

opensim = pytest.importorskip("opensim")

pytestmark = pytest.mark.oracle


@pytest.mark.parametrize("count", ["fewest", "one more", 12, 200, 2000])
@pytest.mark.parametrize("degree", [1, 3, 5, 7])
def test_through_points(degree, count):
    count = {"fewest": degree + 1, "one more": degree + 2}.get(count, count)
    rng = np.random.default_rng(count)
    x = 5.0 + np.cumsum(10.0 ** rng.uniform(-1.0, 0.0, count))
    y = np.sin(x) + rng.uniform(-0.1, 0.1, count)
    ours, theirs = smoothing_spline(x, y, (degree + 1) // 2, 0.0), opensim.GCVSpline()
    theirs.setDegree(degree)
    for point in zip(x.tolist(), y.tolist(), strict=True):
        theirs.addPoint(*point)
    span = x[-1] - x[0]
    beyond = x[0] - 0.1 * span, x[-1] + 0.1 * span
    places = np.array([*beyond, *x[:3], *x[-3:], *rng.uniform(x[0], x[-1], 30)])
    for order in range(3):
        expected = np.array([_derivative(theirs, place, order) for place in places.tolist()])
        result = np.array(
            [ours.evaluate(np.array((place,)))[order] for place in places], dtype=object
        )
        result = np.array([np.ravel(item)[0] for item in result])
        assert result == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def _derivative(spline, place, order):
    argument, orders = opensim.Vector(1, place), opensim.StdVectorInt()
    for _ in range(order):
        orders.push_back(0)
    return spline.calcDerivative(orders, argument) if order else spline.calcValue(argument)
