"""Old transforms, ``rx ry rz tx ty tz`` with body-fixed X-Y-Z angles, one after the other."""

from __future__ import annotations

from math import asin, atan2, cos, hypot, sin

from osimlite.io.document.upgrade.draft import reals
from osimlite.mechanics.laws.rotations import Axes, along_axes, body_fixed, turned_axes
from osimlite.mechanics.laws.vectors import Vector, plus

EPSILON = 2.0**-52


def compose(outer: str | None, inner: str | None) -> tuple[str, str] | None:
    """The texts of the angles (rad) and the translation (m) of `inner` within `outer`; None if both do nothing.

    Where one of the two does nothing, the words of the other stay as they are.
    """
    texts = [text for text in (outer, inner) if _moves(text)]
    if not texts:
        return None
    if len(texts) == 1:
        words = (texts[0] or "").split()
        return " ".join(words[:3]), " ".join(words[3:])
    (outer_turn, outer_shift), (inner_turn, inner_shift) = (_placed(text) for text in texts)
    angles = _angles(turned_axes(outer_turn, inner_turn))
    return " ".join(map(repr, angles)), " ".join(
        map(repr, plus(outer_shift, along_axes(outer_turn, inner_shift)))
    )


def _moves(text: str | None) -> bool:
    values = reals(text, 6)
    return values is not None and hypot(*values) >= EPSILON


def _placed(text: str | None) -> tuple[Axes, Vector]:
    values = reals(text, 6)
    assert values is not None
    (s1, s2, s3), (c1, c2, c3) = map(sin, values[:3]), map(cos, values[:3])
    x, y, z = values[3:]
    return body_fixed(s1, c1, s2, c2, s3, c3), (x, y, z)


def _angles(axes: Axes) -> Vector:
    """Body-fixed X-Y-Z angles; where the middle one is a right angle, the last is zero."""
    (one, _, _), (two, across, up), (sine, three, four) = axes
    middle = asin(max(-1.0, min(1.0, sine)))
    if abs(sine) > 1 - 4 * EPSILON:
        return atan2(up, across), middle, 0.0
    return atan2(-three, four), middle, atan2(-two, one)
