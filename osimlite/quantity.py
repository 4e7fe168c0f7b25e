"""Numbers as people write them, with or without a unit: ``0.5``, ``30deg``, ``2 cm``."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

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


def quantity(text: str) -> Quantity | None:
    """Read a quantity; None if the text is none."""
    match = _FORM.fullmatch(text.strip())
    return None if match is None else Quantity(float(match[1]), match[2])
