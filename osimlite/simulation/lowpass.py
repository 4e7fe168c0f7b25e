"""OpenSim's low-pass filter of recorded motions: Butterworth's of third order, run forward and backward.

A record is first continued at both ends by half its length, turned about its first and last point,
and sampled evenly where it is not.
"""

from __future__ import annotations

import math

import numpy as np

from osimlite.errors import SettingError
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array

MOST_SAMPLES = 100_000
"""A record is not sampled more finely than this many times."""


def lowpassed(
    times: Array, values: Array, cutoff: float, *, limited: bool = False
) -> tuple[Array, Array]:
    """A filtered record, with the continuation at both ends.

    Args: times: (t,), s, increasing. values: (t, n). cutoff: frequency (Hz) of which half the power
        passes each time the filter is run. limited: whether a frequency that is too high for the
        times gives way to one that is not, as in OpenSim.

    Returns:
        Times (s,), evenly spaced, and values (s, n).

    Raises:
        SettingError: the frequency is not positive, or too high for the times, or there is but one.
    """
    if not (math.isfinite(cutoff) and cutoff > 0.0):
        raise SettingError(f"a low-pass frequency is a positive number of Hz, not {cutoff:g}")
    if len(times) < 2:
        raise SettingError("a low-pass filter needs a motion of two rows or more")
    count = len(times) // 2
    times, values, step = _even(continued(times, count), continued(values, count))
    if limited and cutoff * step >= 0.5:
        cutoff = 0.49 / step
    if cutoff * step >= 0.5:
        raise SettingError(
            f"a low-pass frequency of {cutoff:g} Hz is too high for samples every {step:g} s; "
            f"take less than {0.5 / step:g} Hz"
        )
    return times, _filtered(_filtered(values, cutoff * step)[::-1], cutoff * step)[::-1]


def lowpassed_by_sinc(
    times: Array, values: Array, cutoff: float, order: int
) -> tuple[Array, Array]:
    """A record through the filter of OpenSim's tracking tools: a sinc of its cut-off under Hamming's window.

    Args:
        times: (t,), s, increasing.
        values: (t, n).
        cutoff: frequency, Hz.
        order: so many samples on both sides count.

    Returns: Times (s,), evenly spaced, and values (s, n). A record that is too short is returned as
        it is, as in OpenSim.
    """
    times, values, step = _even(times, values)
    if len(times) < 2 * order:
        return times, values
    k = np.arange(-order, order + 1)
    weights = np.sinc(2.0 * cutoff * step * k) * (0.54 + 0.46 * np.cos(np.pi * k / order))
    weights /= weights.sum()
    padded = continued(values, order)
    return times, np.column_stack([np.convolve(column, weights, "valid") for column in padded.T])


def _even(times: Array, values: Array) -> tuple[Array, Array, float]:
    """A record at even times, and the step between these."""
    step = float(np.diff(times).min())
    span = float(times[-1] - times[0])
    if span / (len(times) - 1) - step > np.finfo(float).eps:
        step = max(step, span / MOST_SAMPLES)
        # Summed one by one, as OpenSim does it: it decides whether there is a last sample.
        even = np.add.accumulate(np.r_[times[0], np.full(int(span / step) + 1, step)])
        even = even[even <= times[-1]]
        (values,) = derivatives_of_samples(times, values, even, (0,))
        times = even
    return times, values, step


def continued(values: Array, count: int) -> Array:
    """Values with `count` more at both ends, turned about the first and the last; of a short record several times."""
    while count > 0:
        more = min(count, len(values) - 1)
        before, after = values[more:0:-1], values[-2 : -2 - more : -1]
        values = np.concatenate([2.0 * values[0] - before, values, 2.0 * values[-1] - after])
        count -= more
    return values


def _filtered(values: Array, cutoff: float) -> Array:
    """Values (t, n) after one run; `cutoff` in parts of the sampling frequency. The first three stay as they are."""
    w = math.tan(math.pi * cutoff)
    scale = (w + 1.0) * (w * w + w + 1.0)
    sums = [
        3 * w**3 + 2 * w * w - 2 * w - 3,
        3 * w**3 - 2 * w * w - 2 * w + 3,
        (w - 1.0) * (w * w - w + 1.0),
    ]
    one, two, three = (total / scale for total in sums)
    taken = values[3:] + 3.0 * (values[2:-1] + values[1:-2]) + values[:-3]
    result = np.concatenate([values[:3], w**3 / scale * taken])
    # One after the other: the numbers of slow filters are so near one another that blocks of rows
    # lose seven digits.
    for row, (third, second, first) in zip(
        result[3:], zip(result, result[1:], result[2:], strict=False), strict=False
    ):
        row -= one * first
        row -= two * second
        row -= three * third
    return result
