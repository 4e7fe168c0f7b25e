from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples, smoothing_spline

X = (0.0, 0.3, 0.5, 1.1, 1.2, 1.9, 2.4, 2.5, 3.1, 3.3)
Y = (0.1, 0.5, 0.4, 1.2, 1.0, 0.3, -0.4, -0.5, -0.2, 0.3)

# Value, first and second derivative in OpenSim 4.6 at 0.0, 0.77 and 3.3, by half order and error
# variance.
OPENSIM = {
    (1, 0.0): (
        (0.1, 1.333333333333, 0),
        (0.76, 1.333333333333, 0),
        (0.3, 0, 0),
    ),
    (1, 0.001): (
        (0.1031977630479, 1.308293179393, 0),
        (0.7588456517634, 1.313036205943, 0),
        (0.2940205947589, 0, 0),
    ),
    (1, -1.0): (
        (0.1000000019766, 1.333333317685, 0),
        (0.7599999992711, 1.333333320568, 0),
        (0.2999999962939, 0, 0),
    ),
    (2, 0.0): (
        (0.1, 2.052647015049, 0),
        (0.8444614145112, 2.354294610826, -0.5974482663549),
        (0.3, 2.705548209272, 0),
    ),
    (2, 0.001): (
        (0.1011324936592, 2.004172859507, 0),
        (0.8370599986608, 2.280896026732, -0.5119406927025),
        (0.29924810449, 2.695771356328, 0),
    ),
    (2, -1.0): (
        (0.1197152001366, 0.9577257979382, 0),
        (0.8345482342804, 1.043652612229, -0.980496200595),
        (0.2155633095041, 1.796174779642, 0),
    ),
    (3, 0.0): (
        (0.1, 3.571894336002, -15.81953327114),
        (0.8624211634936, 2.623551762136, -0.5833041821051),
        (0.3, 3.053997662923, 5.55202517005),
    ),
    (3, 0.001): (
        (0.1006601652843, 3.487430829403, -15.3124931003),
        (0.852801481642, 2.549781599087, -0.4320301806891),
        (0.2999755460891, 3.04330603515, 5.446017259863),
    ),
    (3, -1.0): (
        (0.0867939097435, 1.025787707661, 0.09203370337813),
        (0.8702756828942, 0.8417402318978, -1.405352477429),
        (0.2682605253192, 2.677647277914, 4.536735695882),
    ),
    (4, 0.0): (
        (0.1, 5.578422199768, -41.7193312895),
        (0.9084937539309, 2.59825095541, -2.291984458772),
        (0.3, 3.241685328356, 8.189905605588),
    ),
    (4, 0.001): (
        (0.1003631675213, 5.452450627996, -40.51003180087),
        (0.8964762866255, 2.535126439724, -2.04985197593),
        (0.2999630761154, 3.195528647071, 7.594154486578),
    ),
    (4, -1.0): (
        (0.08404692318889, 0.8604304738647, 1.597036432971),
        (0.8839142858261, 0.7882733225938, -1.706770339055),
        (0.3156835842926, 3.493981763037, 7.833983359258),
    ),
}


def _at(spline, x):
    value, first, second = spline.evaluate(np.array((x,)))
    return value, first[0], second[0][0]


@given(st.integers(1, 4), st.integers(8, 30), st.integers(0, 2**32 - 1))
def test_it_goes_through_the_points_and_is_natural(half_order, count, seed):
    rng = np.random.default_rng(seed)
    x, y = np.cumsum(rng.uniform(0.05, 0.2, count)), rng.uniform(-1.0, 1.0, count)
    spline = smoothing_spline(x, y, half_order, 0.0)
    assert [_at(spline, knot)[0] for knot in x] == pytest.approx(y, abs=1e-8)
    # Beyond the ends, the spline is a polynomial of degree half_order - 1.
    ends = [_at(spline, x[0] - 0.1 * k)[0] for k in range(1, half_order + 2)]
    assert np.diff(ends, half_order) == pytest.approx(
        np.zeros(1), abs=1e-7 * (1.0 + np.abs(ends).max())
    )


@pytest.mark.parametrize("case", OPENSIM, ids=str)
def test_it_is_opensims(case):
    half_order, error_variance = case
    spline = smoothing_spline(X, Y, half_order, error_variance)
    # The search for the smoothing parameter ends near OpenSim's. Degree 7 with unequal knots loses
    # digits: against a computation with sixty digits the error is 1.1e-11 on one processor, and
    # less than 1e-11 on others.
    exact = 1e-11 if half_order < 4 else 1e-10
    tolerance = exact if error_variance == 0.0 else 2e-5
    for x, expected in zip((0.0, 0.77, 3.3), OPENSIM[case], strict=True):
        assert _at(spline, x) == pytest.approx(expected, rel=tolerance, abs=tolerance)


@pytest.mark.parametrize("half_order", [1, 2, 3])
def test_a_smoothed_curve_is_nearer_to_the_true_one_than_the_data(half_order):
    """With the variance of the noise as error variance, the spline is much closer to the true curve than the data."""
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 6.0, 200)
    noise = 0.05 * rng.normal(size=200)
    spline = smoothing_spline(x, np.sin(x) + noise, half_order, 0.05**2)
    off = [_at(spline, knot)[0] - np.sin(knot) for knot in x]
    assert np.sqrt(np.mean(np.square(off))) < 0.5 * np.std(noise)


@pytest.mark.parametrize("count", [6, 192, 193, 450])
def test_rates_taken_in_blocks_are_those_of_the_whole_spline(count):
    rng = np.random.default_rng(6)
    x = np.cumsum(rng.uniform(0.01, 0.02, count))
    y = np.cumsum(rng.normal(size=(count, 2)), axis=0)
    first, second = derivatives_of_samples(x, y, x, (1, 2))
    for column in range(2):
        whole = smoothing_spline(x, y[:, column], 3, 0.0)
        for row in {0, 1, count // 2, min(191, count - 1), min(192, count - 1), count - 1}:
            _, slope, bend = _at(whole, x[row])
            assert first[row, column] == pytest.approx(
                slope, rel=1e-8, abs=1e-8 * np.abs(first).max()
            )
            assert second[row, column] == pytest.approx(
                bend, rel=1e-8, abs=1e-8 * np.abs(second).max()
            )


@pytest.mark.parametrize("place", [0, 30, 60])
def test_samples_at_times_that_differ_by_rounding_are_one(place):
    x = np.insert(np.linspace(0.0, 3.0, 61), place + 1, np.linspace(0.0, 3.0, 61)[place] + 2e-14)
    first, second = derivatives_of_samples(x, np.sin(x)[:, None], x, (1, 2))
    assert first[:, 0] == pytest.approx(np.cos(x), abs=1e-3)
    assert second[10:-10, 0] == pytest.approx(-np.sin(x[10:-10]), abs=1e-4)


@pytest.mark.parametrize("half_order", [2, 3, 4])
def test_long_records_are_as_scipy_has_them(half_order):
    interpolate = pytest.importorskip("scipy.interpolate")
    rng = np.random.default_rng(8)
    x, y = np.cumsum(rng.uniform(0.9, 1.1, 1001)), np.cumsum(rng.normal(size=(1001, 3)), axis=0)
    ends = [(order, np.zeros(3)) for order in range(half_order, 2 * half_order - 1)]
    theirs = interpolate.make_interp_spline(x, y, 2 * half_order - 1, bc_type=(ends, ends))
    at = np.concatenate([x, rng.uniform(x[0], x[-1], 200)])
    for order, ours in enumerate(derivatives_of_samples(x, y, at, range(half_order), half_order)):
        expected = theirs(at, order)
        assert ours == pytest.approx(expected, rel=0.0, abs=1e-10 * np.abs(expected).max())
