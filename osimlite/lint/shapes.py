"""Recognition of lines that are rows of numbers, many lines at a time.

A block of lines becomes one large integer, a byte for each character: a shift by eight bits continues
to the next character, and an addition carries a mark over a run of characters to what follows on
it. So the rules of how numbers are written are checked at hundreds of megabytes a second. The
method is that of R. D. Cameron et al., "Bitwise data parallelism in regular expression matching"
(PACT 2014).
"""

from __future__ import annotations

from functools import lru_cache

from osimlite.base.named_tuples import NamedTuple

# The lower half of a code byte is the class of a character, the upper half the classes that
# must not follow it.
_SIGN = 1
"""Class of signs."""
_POWER = 2
"""Class of the letter of an exponent."""
_SPACE = 4
"""Class of blanks and tabs."""
_POINT = 8
"""Class of the decimal point."""
_LAYOUT = (_SPACE | _POINT) << 4 | _SPACE
"""Bits of a code byte that distinguish separators."""

_CHARACTERS = (
    # Characters that belong to no number must not follow any other.
    (bytes(range(256)), _SIGN | _POWER | _POINT, 0),
    (b"0123456789", 0, _SIGN),
    (b".", _POINT, _SIGN | _POINT),
    (b"+-", _SIGN, _SIGN | _POWER | _SPACE),
    (b"eE", _POWER, _POWER | _SPACE | _POINT),
    (b" \t", _SPACE, _POWER),
)
"""Characters, their class, and the classes that must not follow them."""


class RowLayout(NamedTuple):
    """Layout of rows: a code byte for each character, and the characters of the resulting shapes."""

    codes: bytes
    visible: bytes
    hidden: bytes


def _make_layout(separators: bytes, *more_characters: tuple[bytes, int, int]) -> RowLayout:
    """Return a layout with some separators kept in the shapes.

    Some characters are said to follow on each other never, though they may: that tells separators
    from each other.
    """
    codes, visible_bytes = bytearray(256), bytearray(256)
    for characters, code, no_repeat in (*_CHARACTERS, *more_characters):
        for character in characters:
            codes[character] = code | no_repeat << 4
    visible_bytes[1] = ord("0")
    for separator in b"\n" + separators:
        visible_bytes[codes[separator] & _LAYOUT] = separator
    for value in range(256):
        if value & 2:
            visible_bytes[value] = 10 if visible_bytes[value ^ 2] == 10 else ord("!")
    return RowLayout(
        bytes(codes),
        bytes(visible_bytes),
        bytes(value for value in range(256) if not visible_bytes[value]),
    )


ROWS = _make_layout(b"", (b"\n", _SPACE, _POWER | _POINT))
"""Rows of numbers with blanks and tabs between them."""
VECTORS = _make_layout(
    b"\t,",
    (b"\n", _SPACE, _POWER | _SPACE | _POINT),
    # Tabs end cells: OpenSim rejects a row with an empty cell.
    (b"\t", _SPACE, _POWER | _SPACE),
    (b",", _SPACE, _POWER | _POINT),
)
"""Rows of cells with tabs between them, and several numbers each with commas between these."""
MARKERS = _make_layout(
    b"\t",
    (b"\n", _SPACE, _POWER | _SPACE | _POINT),
    (b" ", _SPACE, _POWER | _POINT),
    (b"123456789", 0, _SIGN | _POWER),
)
"""Rows of numbers that end with tabs, which may have nothing between them."""

_AS_NUMBERS = bytes.maketrans(b" \t", b"00")
_NO_SEPARATORS = bytes(set(range(256)) - set(b" \t\n"))


def compute_shapes(block: bytes, layout: RowLayout) -> tuple[bytes, bool]:
    """Return the shapes of lines: ``0`` for each number, separators, and ``!`` where a line is not valid.

    Nothing is wrong with a line without ``!``: its numbers are such as C++ reads (no NaN, no
    infinity, no hexadecimal digits). A line with one needs to be looked at.

    Args:
        block: lines, each with its end.
        layout: :data:`ROWS`, :data:`VECTORS` or :data:`MARKERS`.

    Returns:
        The lines, and whether a number of markers may be 0.
    """
    text = int.from_bytes(block.translate(layout.codes), "little")
    ones, twos, fifteens = _make_masks(len(block).bit_length())
    spaces, points = text >> 2 & ones, text >> 3 & ones
    solid = ones ^ spaces
    behind_space = spaces << 8 | 1
    others = solid ^ points
    run_ends = (
        others << 8
    ) - others  # all bits of every other character: a mark that is added is carried to their end
    # Mark forbidden pairs of characters, and two points in one number.
    invalid = (text << 4 | _POWER) & text & fifteens | (points << 8) + run_ends & points
    powers = text >> 1 & ones if text & twos else 0
    if powers:
        # Neither a point nor another power stands in an exponent.
        others ^= powers
        invalid |= (powers << 8) + (others << 8) - others & (points | powers)
    last_points = points & (spaces | powers) >> 8
    if last_points:
        # Before the point must be a digit then: neither point nor sign, and no sign may follow on
        # it.
        digits = (text >> 4 & solid | points | text & ones) ^ (points | text & ones)
        invalid |= last_points ^ (last_points & digits << 8)
    if layout is ROWS and not invalid and not spaces & behind_space:
        # One separator between any two numbers: they tell how many there are.
        return block.translate(_AS_NUMBERS, _NO_SEPARATORS).replace(b"\n", b"0\n"), False
    starts = behind_space & solid
    zeros = 0
    if layout is MARKERS:
        digits = text >> 5 & solid
        nothing = solid ^ digits ^ (digits & text)
        zeros = (starts & nothing) + (nothing << 8) - nothing & spaces
    marks = starts | text & spaces * _LAYOUT
    if invalid:
        invalid = (invalid | invalid >> 1 | invalid >> 2 | invalid >> 3) & ones
        marks |= (invalid & solid | (invalid & spaces) >> 8) << 1
    shapes = marks.to_bytes(len(block) + 1, "little").translate(layout.visible, layout.hidden)
    return shapes[:-1], bool(zeros)


@lru_cache(maxsize=4)
def _make_masks(exponent: int) -> tuple[int, int, int]:
    """Return a 1 in each of 2**exponent + 1 bytes, then 2 and 15 in each."""
    ones = int.from_bytes(b"\1" * ((1 << exponent) + 1), "little")
    return ones, 2 * ones, 15 * ones
