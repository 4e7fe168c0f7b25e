"""Times as setups give them."""

from __future__ import annotations

from collections.abc import Sequence

from osimlite.base.text import format_count
from osimlite.errors import SettingError


def both_of(time_range: Sequence[float]) -> tuple[float, float]:
    """The first and the last time (s) of a setup; SettingError if it does not give two."""
    if len(time_range) != 2:
        count = format_count(len(time_range), "number")
        raise SettingError(f"time_range has {count}; give it two, the first and the last time")
    return time_range[0], time_range[1]
