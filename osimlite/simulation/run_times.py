"""What the times of a run may be: where it ends, its reports, its fixed steps."""

from __future__ import annotations

from math import floor, isfinite
from numbers import Real

from osimlite.errors import SettingError

MOST_STEPS = 1_000_000_000
"""Of a fixed length, which take hours to days."""

LONGEST_STEP = 0.1
"""A longer fixed step (s) follows no motion of bodies: a thousandth is usual, and MuJoCo takes 0.002 by itself."""


def _is_number(value: object) -> bool:
    """Whether it is a number: not every caller checks types."""
    return isinstance(value, Real)


def check_step(h: float, to: float) -> None:
    """SettingError for a fixed step h that means nothing for a motion up to a time, both in s."""
    if not (_is_number(h) and isfinite(h) and h > 0.0):
        raise SettingError(f"the fixed step is a positive and finite number of seconds, not {h!r}")
    if h > LONGEST_STEP:
        raise SettingError(
            f"a fixed step of {h:g} s is too long for any motion of bodies; take at most {LONGEST_STEP:g} s, with "
            "contacts about 0.001 s"
        )
    if h * MOST_STEPS < to:
        raise SettingError(
            f"{to:g} s in fixed steps of {h:g} s are more than a thousand million; take longer steps"
        )


def report_times(to: float, interval: float, start: float = 0.0) -> list[float]:
    """`start`, those of interval, 2 interval ... after it, and `to` (s).

    Raises:
        SimulationError: a number has no meaning.
    """
    for number in (to, interval):
        if not _is_number(number):
            raise SettingError(f"a time is a number of seconds, not {number!r}")
    if not (isfinite(to) and to > start):
        told = "for a positive time, not" if start == 0.0 else f"from {start:g} s on, and not to"
        raise SettingError(f"a simulation goes on {told} {to:g} s")
    if not (isfinite(interval) and interval > 0.0):
        raise SettingError(f"the report interval is a positive time, not {interval:g} s")
    if to / interval > 1e7:
        raise SettingError(
            f"a report every {interval:g} s makes more than ten million rows; take a longer interval"
        )
    times = [number * interval for number in range(floor(to / interval) + 1)]
    # A last moment that differs from `to` only by rounding is `to`.
    if to - times[-1] <= 1e-9 * interval:
        times.pop()
    if start > 0.0:
        times = [start, *(time for time in times if time - start > 1e-9 * interval)]
    return [*times, to]
