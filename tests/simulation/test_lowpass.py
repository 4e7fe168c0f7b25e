"""Tests of the low-pass filter without OpenSim: short records, and its effect on a sine wave."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest

from osimlite.errors import SettingError
from osimlite.simulation.lowpass import filter_lowpass


@pytest.mark.parametrize("rows", [2, 3, 4, 7])
def test_what_does_not_change_stays(rows):
    times, values = filter_lowpass(0.01 * np.arange(rows), np.full((rows, 2), 0.3), 6.0)
    assert len(times) == len(values)
    assert values == pytest.approx(np.full((len(times), 2), 0.3), abs=1e-12)


def test_a_wave_at_the_cutoff_loses_half_of_its_size():
    """At the cutoff, one pass halves the power, and the filter runs twice."""
    times = np.arange(2001) / 500.0
    _, values = filter_lowpass(times, np.sin(2.0 * np.pi * 6.0 * times)[:, None], 6.0)
    middle = values[len(values) // 2 - 250 : len(values) // 2 + 250]
    assert np.abs(middle).max() == pytest.approx(0.5, abs=1e-3)


def test_one_row_is_no_motion():
    with pytest.raises(SettingError, match="two rows"):
        filter_lowpass(np.zeros(1), np.ones((1, 2)), 6.0)


def test_a_slow_filter_keeps_its_digits() -> None:
    """Ten digits agree with a computation with forty digits, although the factors of a slow filter nearly cancel."""
    values = np.random.default_rng(5).normal(size=400).cumsum()
    _, result = filter_lowpass(np.arange(400) / 600.0, values[:, None], 2.5)
    continued = [
        *(2.0 * values[0] - values[200:0:-1]),
        *values,
        *(2.0 * values[-1] - values[-2:-202:-1]),
    ]
    with localcontext(prec=40):
        w = Decimal(np.tan(np.pi * 2.5 / 600.0))
        scale = (w + 1) * (w * w + w + 1)
        back = (
            3 * w**3 + 2 * w * w - 2 * w - 3,
            3 * w**3 - 2 * w * w - 2 * w + 3,
            (w - 1) * (w * w - w + 1),
        )
        rows = [Decimal(value) for value in continued]
        for _ in range(2):
            run = rows[:3]
            for k in range(3, len(rows)):
                taken = w**3 * (rows[k] + 3 * (rows[k - 1] + rows[k - 2]) + rows[k - 3])
                run.append(
                    (taken - sum(one * run[k - 1 - j] for j, one in enumerate(back))) / scale
                )
            rows = run[::-1]
    expected = np.array([float(row) for row in rows])
    assert result[:, 0] == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())
