"""Tables as OpenSim's tools print them: the older form of its storage files, with eight decimals."""

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
"""What OpenSim says of its tables in their headers."""
PRECISION = 8
"""Digits behind the point that OpenSim prints unless it is told otherwise."""
_PADDING = 8
_BLOCK = 4096
"""So many numbers are written at once."""


def format_old_table(
    table: StoTable, description: str = "", precision: int = PRECISION
) -> Iterator[str]:
    """The text of a table as OpenSim's ``Storage`` prints it, in parts.

    Args:
        table: the table.
        description: what stands before the end of the header; a line end is added.
        precision: digits behind the point.
    """
    expect_plain_labels(table.name, table.columns)
    yield f"{table.name}\nversion=1\nnRows={len(table.times)}\nnColumns={len(table.columns) + 1}\n"
    yield f"inDegrees={'yes' if table.in_degrees else 'no'}\n"
    if description:
        yield f"{description}\n"
    yield "endheader\n"
    yield "\t".join(("time", *table.columns)) + "\n"
    rows = np.column_stack([table.times, table.rows])
    step = _BLOCK // rows.shape[1] + 1
    cell = f"%{precision + _PADDING}.{precision}f"
    for start in range(0, len(rows), step):
        block = rows[start : start + step]
        text = _format_decimals(block, cell, precision // 8) if precision in (8, 16) else None
        if text is None:
            line = "\t".join([cell] * rows.shape[1]) + "\n"
            text = "".join([line % tuple(row) for row in block.tolist()])
        yield text


def _format_decimals(rows: Array, cell: str, eights: int) -> str | None:
    """Lines of numbers with so many times eight decimals as the format of a cell writes them, all at once.

    None if one is wider than the others.
    """
    # What has more than four digits before the point is rare, and so is what is no number.
    plain = np.abs(rows) < 9999.0
    size = np.where(plain, np.abs(rows), 0.0)
    digits = [size.astype(np.int64), *_format_8_digits(size - size.astype(np.int64), eights)]
    for before, eight in zip(digits[-2::-1], digits[:0:-1], strict=True):
        before += eight == 10**8
        eight[eight == 10**8] = 0
    wholes, fours = _format_numbers()
    names = [f"{half}{number}" for number in range(eights) for half in ("first", "last")]
    # A number as text: up to the point, four decimals and four more each time, and what stands
    # behind it.
    cells = np.empty(
        rows.shape, [("whole", "u8"), *((name, "u4") for name in names), ("end", "u1")]
    )
    cells["whole"] = wholes[digits[0] + 10000 * np.signbit(rows)]
    for number, eight in enumerate(digits[1:]):
        first, last = np.divmod(eight.astype(np.int32), 10000)
        cells[f"first{number}"], cells[f"last{number}"] = fours[first], fours[last]
    cells["end"], cells["end"][:, -1] = ord("\t"), ord("\n")
    width = cells.itemsize - 1
    flat = cells.view("u1").reshape(-1, cells.itemsize)
    for place in np.flatnonzero(~plain):
        text = cell % rows.flat[place]
        if len(text) > width:
            return None
        flat[place, :width] = np.frombuffer(text.encode(), "u1")
    return cells.tobytes().decode()


def _format_8_digits(part: Array, count: int) -> list[NDArray[np.int64]]:
    """Whole numbers of eight decimals each, one behind the other, of numbers from 0 up to 1.

    The last is rounded to the nearest, to the even of two, and may be 1e8. A product comes with
    what its rounding leaves over: T. J. Dekker, Numer. Math. 18, 1971. 1e8 has few enough digits
    for all to be exact.
    """
    high, low, result = part, np.zeros_like(part), []
    for number in range(count):
        product, split = 1e8 * high, 134217729.0 * high
        upper = split - (split - high)
        over = (1e8 * upper - product) + 1e8 * (high - upper) + 1e8 * low
        value = product + over
        over -= value - product
        if number == count - 1:
            whole = np.rint(value)
            # Halves are none if something is left over.
            half = value - whole
            whole += np.where((np.abs(half) == 0.5) & (half * over > 0.0), 2.0 * half, 0.0)
        else:
            whole = np.floor(value)
            whole -= (value == whole) & (over < 0.0)
            rest = value - whole
            high = rest + over
            low = over - (high - rest)
        result.append(whole.astype(np.int64))
    return result


@cache
def _format_numbers() -> tuple[Array, Array]:
    """What is before the decimals of numbers by sign and whole part (20000,), and all four decimals (10000,)."""
    numbers, blank = np.arange(10000)[:, None], ord(" ")
    digits = (numbers // (1000, 100, 10, 1) % 10 + ord("0")).astype("u1")
    leading = numbers < (1000, 100, 10)
    text = np.full((2, 10000, 8), blank, "u1")
    text[:, :, 3:7], text[:, :, 7] = digits, ord(".")
    text[:, :, 3:6][:, leading] = blank
    text[1, numbers[:, 0], 2 + leading.sum(axis=1)] = ord("-")
    return text.view("u8").ravel(), digits.view("u4")[:, 0]
