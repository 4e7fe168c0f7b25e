"""Old transforms, ``rx ry rz tx ty tz`` with body-fixed X-Y-Z angles, one after the other."""

from __future__ import annotations

from math import asin, atan2, cos, hypot, sin

from osimlite.document.upgrade.draft import reals

Matrix = list[list[float]]
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
    (outer_angles, outer_shift), (inner_angles, inner_shift) = (_split(text) for text in texts)
    turn = _matrix(outer_angles)
    shift = [a + b for a, b in zip(outer_shift, _times(turn, inner_shift), strict=True)]
    product = [_times(turn, column) for column in zip(*_matrix(inner_angles), strict=True)]
    angles = _angles([list(row) for row in zip(*product, strict=True)])
    return " ".join(map(repr, angles)), " ".join(map(repr, shift))


def _moves(text: str | None) -> bool:
    values = reals(text, 6)
    return values is not None and hypot(*values) >= EPSILON


def _split(text: str | None) -> tuple[list[float], list[float]]:
    values = reals(text, 6)
    assert values is not None
    return values[:3], values[3:]


def _matrix(angles: list[float]) -> Matrix:
    (sx, sy, sz), (cx, cy, cz) = map(sin, angles), map(cos, angles)
    return [
        [cy * cz, -cy * sz, sy],
        [cx * sz + sx * sy * cz, cx * cz - sx * sy * sz, -sx * cy],
        [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
    ]


def _times(matrix: Matrix, vector: list[float] | tuple[float, ...]) -> list[float]:
    # From Python 3.12 on, sum() rounds otherwise.
    return [a * vector[0] + b * vector[1] + c * vector[2] for a, b, c in matrix]


def _angles(matrix: Matrix) -> list[float]:
    """Body-fixed X-Y-Z angles; where the middle one is a right angle, the last is zero."""
    middle = asin(max(-1.0, min(1.0, matrix[0][2])))
    if abs(matrix[0][2]) > 1 - 4 * EPSILON:
        return [atan2(matrix[2][1], matrix[1][1]), middle, 0.0]
    return [atan2(-matrix[1][2], matrix[2][2]), middle, atan2(-matrix[0][1], matrix[0][0])]
