"""Numbers with or without a unit, as users write them: ``0.5``, ``30deg``, ``2 cm``."""

from __future__ import annotations

import math
import sys
import warnings
from pathlib import Path

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.errors import DoubtfulWarning, UnitWarning

_FORM = compile_later(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(deg|rad|cm|mm|m)?(?:/s)?")
_SIZES = {"deg": math.pi / 180.0, "rad": 1.0, "m": 1.0, "cm": 0.01, "mm": 0.001}

LARGEST_JOINT_ANGLE = 10.0
"""Angle (rad) that no joint reaches in a motion; larger numbers are probably in degrees."""


class Quantity(NamedTuple):
    """Number with its unit, or with None if the user wrote no unit."""

    number: float
    unit: str | None

    @property
    def is_angle(self) -> bool | None:
        """True for a unit of angles; None without a unit."""
        return None if self.unit is None else self.unit in ("deg", "rad")

    @property
    def value(self) -> float:
        """The quantity in rad or m; a number without a unit is unchanged."""
        return self.number * _SIZES.get(self.unit or "rad", 1.0)


def describe_unit_mistake(name: str, value: Quantity | None, range: tuple[float, float]) -> str:
    """Describe why the value of a rotational coordinate is probably in degrees.

    That is so if it has no unit, is more than a turn and is outside the range of the coordinate.

    Args:
        name: name of the coordinate.
        value: value as the user wrote it.
        range: range of the coordinate (rad).

    Returns:
        A sentence, or "" for a plausible value.
    """
    if value is None or value.unit is not None or not 2.0 * math.pi < abs(value.number) < math.inf:
        return ""
    low, high = range
    if low <= value.number <= high:
        return ""
    number = f"{value.number:g}"
    in_range = low <= math.radians(value.number) <= high
    advice = f"did you mean {number}deg?" if in_range else f"write {number}deg for degrees"
    return f"{name} = {number} is in rad, and outside its range of {low:.3g} to {high:.3g} rad; {advice}"


def warn_of_unit(message: str) -> None:
    """Issue the warning of :func:`describe_unit_mistake`; do nothing for an empty text."""
    if message:
        warn_caller(message, UnitWarning)


def warn_caller(message: str, category: type[DoubtfulWarning] = DoubtfulWarning) -> None:
    """Issue a warning at the line of the user's program that called osimlite.

    Args:
        message: text of the warning.
        category: class of the warning.
    """
    level = 1
    frame = sys._getframe()
    package_folder = str(Path(__file__).parents[1])
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package_folder):
        level += 1
        frame = frame.f_back
    warnings.warn(message, category, stacklevel=level)


def parse_quantity(text: str) -> Quantity | None:
    """Return the quantity in a text, or None if the text is not a quantity."""
    match = _FORM.fullmatch(text.strip())
    return None if match is None else Quantity(float(match[1]), match[2])
