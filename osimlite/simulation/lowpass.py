"""Low-pass filters of OpenSim for recorded motions.

OpenSim has two: a Butterworth filter of third order that runs forward and backward, so that the
motion is not delayed, and a windowed sinc in the tools RRA and CMC. Records are resampled evenly if
necessary. For the Butterworth filter a record is first extended at both ends by half its length, by
point reflection about its first and last row.
"""

from __future__ import annotations

import math

import numpy as np

from osimlite.errors import SettingError
from osimlite.mechanics.multibody.smoothing_spline import derivatives_of_samples
from osimlite.mechanics.multibody.spatial import Array

MAX_SAMPLES = 100_000
"""Largest number of samples of a resampled record."""


def filter_lowpass(
    times: Array, values: Array, cutoff: float, *, limited: bool = False
) -> tuple[Array, Array]:
    """Filter a record by OpenSim's Butterworth filter, including the extension at both ends.

    Args:
        times: increasing times (t,), s.
        values: values (t, n).
        cutoff: frequency (Hz) at which each run of the filter halves the power.
        limited: whether a frequency that is too high for the times is reduced, as in OpenSim.

    Returns:
        Evenly spaced times (s,), s, and values (s, n).

    Raises:
        SettingError: the frequency is not positive or too high for the times, or there is only one
            time.
    """
    if not (math.isfinite(cutoff) and cutoff > 0.0):
        raise SettingError(f"a low-pass frequency must be a positive number of Hz, not {cutoff:g}")
    if len(times) < 2:
        raise SettingError("a low-pass filter needs a motion of two rows or more")
    # OpenSim extends by half the rows (Storage::pad), which hides the filter's start-up at the
    # ends.
    count = len(times) // 2
    times, values, step = _resample_evenly(extend_ends(times, count), extend_ends(values, count))
    # Half the sampling frequency (Nyquist) is the limit. OpenSim's tools take 0.49 of it with a
    # warning.
    if limited and cutoff * step >= 0.5:
        cutoff = 0.49 / step
    if cutoff * step >= 0.5:
        raise SettingError(
            f"a low-pass frequency of {cutoff:g} Hz is too high for samples every {step:g} s; "
            f"use less than {0.5 / step:g} Hz"
        )
    return times, _run_filter(_run_filter(values, cutoff * step)[::-1], cutoff * step)[::-1]


def filter_lowpass_by_sinc(
    times: Array, values: Array, cutoff: float, order: int
) -> tuple[Array, Array]:
    """Filter a record as OpenSim's tracking tools do: by a sinc with Hamming's window.

    Args:
        times: increasing times (t,), s.
        values: values (t, n).
        cutoff: frequency, Hz.
        order: number of samples on each side that contribute.

    Returns:
        Evenly spaced times (s,), s, and values (s, n). A record that is too short is returned
        unchanged, as in OpenSim.
    """
    times, values, step = _resample_evenly(times, values)
    if len(times) < 2 * order:
        return times, values
    # The ideal low-pass filter is an infinite sinc; Hamming's window cuts it off smoothly.
    k = np.arange(-order, order + 1)
    weights = np.sinc(2.0 * cutoff * step * k) * (0.54 + 0.46 * np.cos(np.pi * k / order))
    # A constant signal stays as it is.
    weights /= weights.sum()
    padded = extend_ends(values, order)
    return times, np.column_stack([np.convolve(column, weights, "valid") for column in padded.T])


def _resample_evenly(times: Array, values: Array) -> tuple[Array, Array, float]:
    """Return a record at evenly spaced times, by a spline of fifth degree as in OpenSim.

    Args:
        times: increasing times (t,), s.
        values: values (t, n).

    Returns:
        Times (s,), s, values (s, n), and the step between the times, s. An even record is returned
        unchanged.
    """
    step = float(np.diff(times).min())
    span = float(times[-1] - times[0])
    # OpenSim's test of even spacing: the mean step exceeds the smallest one by more than rounding.
    if span / (len(times) - 1) - step > np.finfo(float).eps:
        step = max(step, span / MAX_SAMPLES)
        # OpenSim adds the steps one by one; their rounding decides whether there is a last sample.
        even_times = np.add.accumulate(np.r_[times[0], np.full(int(span / step) + 1, step)])
        even_times = even_times[even_times <= times[-1]]
        (values,) = derivatives_of_samples(times, values, even_times, (0,))
        times = even_times
    return times, values, step


def extend_ends(values: Array, count: int) -> Array:
    """Extend values at both ends by point reflection about the first and last row.

    Args:
        values: values (t,) or (t, n), at least two rows.
        count: number of rows to add at each end. Short records are reflected repeatedly.

    Returns:
        The extended values (t + 2 count, ...).
    """
    while count > 0:
        added_count = min(count, len(values) - 1)
        # Reflected about the end point, so that the extended curve has no kink.
        leading = values[added_count:0:-1]
        trailing = values[-2 : -2 - added_count : -1]
        values = np.concatenate([2.0 * values[0] - leading, values, 2.0 * values[-1] - trailing])
        count -= added_count
    return values


def _run_filter(values: Array, cutoff: float) -> Array:
    """Return values after one forward run of the Butterworth filter of third order.

    With w = tan(π cutoff), the bilinear transform of 1 / ((s + 1) (s² + s + 1)) gives the recursion
    y_i = w³ / d (x_i + 3 x_{i-1} + 3 x_{i-2} + x_{i-3}) - a_1 y_{i-1} - a_2 y_{i-2} - a_3 y_{i-3}
    with d = (w + 1) (w² + w + 1). The first three rows are not changed, as in OpenSim.

    Args:
        values: values (t, n).
        cutoff: frequency of half power, as a fraction of the sampling frequency.
    """
    # The bilinear transform of a Butterworth filter of third order, as OpenSim's
    # Signal::LowpassIIR.
    w = math.tan(math.pi * cutoff)
    scale = (w + 1.0) * (w * w + w + 1.0)
    sums = [
        3 * w**3 + 2 * w * w - 2 * w - 3,
        3 * w**3 - 2 * w * w - 2 * w + 3,
        (w - 1.0) * (w * w - w + 1.0),
    ]
    a1, a2, a3 = (total / scale for total in sums)
    weighted_sums = values[3:] + 3.0 * (values[2:-1] + values[1:-2]) + values[:-3]
    # OpenSim leaves the first three rows as they are; the padding hides them.
    result = np.concatenate([values[:3], w**3 / scale * weighted_sums])
    # Each row is computed by itself: coefficients of slow filters nearly cancel, and blocks of rows
    # would lose seven digits.
    for row, (third, second, first) in zip(
        result[3:], zip(result, result[1:], result[2:], strict=False), strict=False
    ):
        row -= a1 * first
        row -= a2 * second
        row -= a3 * third
    return result
