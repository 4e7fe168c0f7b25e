"""Numbers as people write them, with or without a unit: ``0.5``, ``30deg``, ``2 cm``."""

from __future__ import annotations

import math
import re
import sys
import warnings
from pathlib import Path
from typing import NamedTuple

from osimlite.errors import DoubtfulWarning, UnitWarning

_FORM = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(deg|rad|cm|mm|m)?(?:/s)?")
_SIZES = {"deg": math.pi / 180.0, "rad": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001}


class Quantity(NamedTuple):
    """A number and the unit that was written after it, None if there was none."""

    number: float
    unit: str | None

    @property
    def is_angle(self) -> bool | None:
        """Whether the unit is one of angles; None without a unit."""
        return None if self.unit is None else self.unit in ("deg", "rad")

    @property
    def value(self) -> float:
        """In rad or m; a number without a unit as it is."""
        return self.number * _SIZES.get(self.unit or "rad", 1.0)


def doubt(name: str, given: Quantity | None, range: tuple[float, float]) -> str:
    """What is odd about the value of a coordinate that turns: more than a turn, out of its range, without a unit.

    Args:
        name: of the coordinate.
        given: as it was written.
        range: of the coordinate, rad.

    Returns:
        A sentence, or "" if there is nothing odd.
    """
    if given is None or given.unit is not None or not 2.0 * math.pi < abs(given.number) < math.inf:
        return ""
    low, high = range
    if low <= given.number <= high:
        return ""
    number = f"{given.number:g}"
    return f"{name} = {number} is in rad, and outside its range of {low:.3g} to {high:.3g} rad; did you mean {number}deg?"


def tell_doubt(odd: str) -> None:
    """Warn of what :func:`doubt` says; an empty text is nothing to tell of."""
    if odd:
        tell(odd, UnitWarning)


def tell(odd: str, category: type[DoubtfulWarning] = DoubtfulWarning) -> None:
    """Warn where the program of the user called."""
    level, frame, ours = 1, sys._getframe(), str(Path(__file__).parents[1])
    while frame.f_back is not None and frame.f_code.co_filename.startswith(ours):
        level, frame = level + 1, frame.f_back
    warnings.warn(odd, category, stacklevel=level)


def quantity(text: str) -> Quantity | None:
    """Read a quantity; None if the text is none."""
    match = _FORM.fullmatch(text.strip())
    return None if match is None else Quantity(float(match[1]), match[2])
