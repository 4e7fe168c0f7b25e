"""Tables as OpenSim's tools print them: version 1 of the storage format, with eight decimals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
from numpy.typing import NDArray

from osimlite.io.tables.storage import StoTable, expect_plain_labels
from osimlite.mechanics.multibody.spatial import Array

DEGREES = (
    "If the header above contains a line with 'inDegrees', this indicates whether rotational values are in degrees "
    "(yes) or radians (no).\n"
)
UNITS = f"Units are S.I. units (second, meters, Newtons, ...)\n{DEGREES}"
"""Text about units that OpenSim's tools write into the headers of their tables."""
PRECISION = 8
"""Decimals that OpenSim's tools print by default."""
_PADDING = 8
"""Characters of a cell besides its decimals: OpenSim prints with `%(8 + precision).precision f`."""
_BLOCK_SIZE = 4096
"""Numbers that are formatted at once."""


def format_old_table(
    table: StoTable, description: str = "", precision: int = PRECISION
) -> Iterator[str]:
    """Yield the text of a table in parts, as OpenSim's ``Storage`` prints it.

    Args:
        table: table to format.
        description: text before the end of the header; a line end is added.
        precision: number of decimals.
    """
    expect_plain_labels(table.name, table.columns)
    yield f"{table.name}\nversion=1\nnRows={len(table.times)}\nnColumns={len(table.columns) + 1}\n"
    yield f"inDegrees={'yes' if table.in_degrees else 'no'}\n"
    if description:
        yield f"{description}\n"
    yield "endheader\n"
    yield "\t".join(("time", *table.columns)) + "\n"
    rows = np.column_stack([table.times, table.rows])
    step = _BLOCK_SIZE // rows.shape[1] + 1
    cell = f"%{precision + _PADDING}.{precision}f"
    for start in range(0, len(rows), step):
        block = rows[start : start + step]
        text = _format_decimals(block, cell, precision // 8) if precision in (8, 16) else None
        if text is None:
            line = "\t".join([cell] * rows.shape[1]) + "\n"
            text = "".join([line % tuple(row) for row in block.tolist()])
        yield text


def _format_decimals(rows: Array, cell: str, eights: int) -> str | None:
    """Return the text of rows of numbers with 8 or 16 decimals, formatted all at once with numpy.

    It is the text that the format `cell` gives number by number. `eights` is the number of groups of
    eight decimals. Return None if a number is wider than the cell.
    """
    # Numbers with more than four digits before the point, NaN and infinities are rare and are
    # formatted one by one below.
    is_regular = np.abs(rows) < 9999.0
    size = np.where(is_regular, np.abs(rows), 0.0)
    digits = [size.astype(np.int64), *_split_decimals(size - size.astype(np.int64), eights)]
    for left_digits, eight in zip(digits[-2::-1], digits[:0:-1], strict=True):
        left_digits += eight == 10**8
        eight[eight == 10**8] = 0
    wholes, fours = _make_digit_tables()
    names = [f"{half}{number}" for number in range(eights) for half in ("first", "last")]
    # Layout of a number: 8 characters up to the point, groups of four decimals, and the separator
    # after it. Each group is copied from a table.
    cells = np.empty(
        rows.shape, [("whole", "u8"), *((name, "u4") for name in names), ("end", "u1")]
    )
    cells["whole"] = wholes[digits[0] + 10000 * np.signbit(rows)]
    for number, eight in enumerate(digits[1:]):
        left_four, right_four = np.divmod(eight.astype(np.int32), 10000)
        cells[f"first{number}"], cells[f"last{number}"] = fours[left_four], fours[right_four]
    cells["end"], cells["end"][:, -1] = ord("\t"), ord("\n")
    width = cells.itemsize - 1
    flat = cells.view("u1").reshape(-1, cells.itemsize)
    for index in np.flatnonzero(~is_regular):
        text = cell % rows.flat[index]
        if len(text) > width:
            return None
        flat[index, :width] = np.frombuffer(text.encode(), "u1")
    return cells.tobytes().decode()


def _split_decimals(fraction: Array, count: int) -> list[NDArray[np.int64]]:
    """Return the decimals of numbers in [0, 1) as `count` arrays of integers with eight digits each.

    The last integer is rounded to nearest, ties to even, and may be 1e8. The multiplication by 1e8 is
    exact: each product comes with its rounding error (T. J. Dekker, Numer. Math. 18, 1971; 134217729 is
    2^27 + 1, which splits a double into halves).
    """
    high = fraction
    low = np.zeros_like(fraction)
    result = []
    for number in range(count):
        product, split = 1e8 * high, 134217729.0 * high
        upper = split - (split - high)
        error = (1e8 * upper - product) + 1e8 * (high - upper) + 1e8 * low
        value = product + error
        error -= value - product
        if number == count - 1:
            integer_part = np.rint(value)
            # A value of exactly one half is no tie if the rounding `error` is not zero.
            half = value - integer_part
            integer_part += np.where((np.abs(half) == 0.5) & (half * error > 0.0), 2.0 * half, 0.0)
        else:
            integer_part = np.floor(value)
            integer_part -= (value == integer_part) & (error < 0.0)
            remainder = value - integer_part
            high = remainder + error
            low = error - (high - remainder)
        result.append(integer_part.astype(np.int64))
    return result


@cache
def _make_digit_tables() -> tuple[Array, Array]:
    """Return lookup tables of formatted numbers.

    Returns:
        Text up to the point by sign and whole part (20000,), and four decimals (10000,), as integers
        of the same bytes.
    """
    numbers = np.arange(10000)[:, None]
    blank = ord(" ")
    digits = (numbers // (1000, 100, 10, 1) % 10 + ord("0")).astype("u1")
    leading = numbers < (1000, 100, 10)
    text = np.full((2, 10000, 8), blank, "u1")
    text[:, :, 3:7], text[:, :, 7] = digits, ord(".")
    text[:, :, 3:6][:, leading] = blank
    text[1, numbers[:, 0], 2 + leading.sum(axis=1)] = ord("-")
    return text.view("u8").ravel(), digits.view("u4")[:, 0]
