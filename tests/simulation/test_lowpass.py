"""The low-pass filter without OpenSim: short records, and what it leaves of a wave."""

from __future__ import annotations

import numpy as np
import pytest

from osimlite.errors import SettingError
from osimlite.simulation.lowpass import _followed, lowpassed


@pytest.mark.parametrize("rows", [2, 3, 4, 7])
def test_what_does_not_change_stays(rows):
    times, values = lowpassed(0.01 * np.arange(rows), np.full((rows, 2), 0.3), 6.0)
    assert len(times) == len(values)
    assert values == pytest.approx(np.full((len(times), 2), 0.3), abs=1e-12)


def test_a_wave_at_the_cutoff_loses_half_of_its_size():
    """Half of the power each time, and the filter is run twice."""
    times = np.arange(2001) / 500.0
    _, values = lowpassed(times, np.sin(2.0 * np.pi * 6.0 * times)[:, None], 6.0)
    middle = values[len(values) // 2 - 250 : len(values) // 2 + 250]
    assert np.abs(middle).max() == pytest.approx(0.5, abs=1e-3)


def test_one_row_is_no_motion():
    with pytest.raises(SettingError, match="two rows"):
        lowpassed(np.zeros(1), np.ones((1, 2)), 6.0)


@pytest.mark.parametrize("rows", [3, 4, 5, 34, 35, 36, 67, 200])
def test_values_follow_from_those_before_one_by_one(rows):
    rng = np.random.default_rng(rows)
    back, start, given = np.array((-1.9, 1.4, -0.4)), rng.normal(size=(3, 2)), rng.normal(size=(rows - 3, 2))
    expected = [*start]
    for row in given:
        expected.append(row - back[0] * expected[-1] - back[1] * expected[-2] - back[2] * expected[-3])
    assert _followed(back, start, given) == pytest.approx(np.array(expected), rel=1e-12, abs=1e-12)
