"""Tables as OpenSim's tools print them: the older form of its storage files, with eight decimals."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np

from osimlite.multibody.spatial import Array
from osimlite.simulation.files.storage import StoTable

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
_CELL = np.dtype([("whole", "u8"), ("first", "u4"), ("last", "u4"), ("end", "u1")])
"""A number as text: up to the point, twice four decimals, and what stands behind it."""


def printed(table: StoTable, description: str = "", precision: int = PRECISION) -> Iterator[str]:
    """The text of a table as OpenSim's ``Storage`` prints it, in parts.

    Args:
        table: the table.
        description: what stands before the end of the header; a line end is added.
        precision: digits behind the point.
    """
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
        text = _eight_decimals(block, cell) if precision == PRECISION else None
        if text is None:
            line = "\t".join([cell] * rows.shape[1]) + "\n"
            text = "".join([line % tuple(row) for row in block.tolist()])
        yield text


def _eight_decimals(rows: Array, cell: str) -> str | None:
    """Lines of numbers as the format of a cell writes each, all at once; None if one is wider than the others."""
    # What has more than four digits before the point is rare, and so is what is no number.
    plain = np.abs(rows) < 9999.0
    size = np.where(plain, np.abs(rows), 0.0)
    whole = size.astype(np.int64)
    part = size - whole
    # The product and what its rounding leaves over: T. J. Dekker, Numer. Math. 18, 1971. 1e8 has few enough digits.
    product, split = 1e8 * part, 134217729.0 * part
    high = split - (split - part)
    over = (1e8 * high - product) + 1e8 * (part - high)
    nearest = np.rint(product)
    # Halves are none if something is left over.
    half = product - nearest
    nearest += np.where((np.abs(half) == 0.5) & (half * over > 0.0), 2.0 * half, 0.0)
    first, last = np.divmod(nearest.astype(np.int32), 10000)
    whole += first == 10000
    first[first == 10000] = 0
    wholes, fours = _texts()
    cells = np.empty(rows.shape, _CELL)
    cells["whole"] = wholes[whole + 10000 * np.signbit(rows)]
    cells["first"], cells["last"] = fours[first], fours[last]
    cells["end"], cells["end"][:, -1] = ord("\t"), ord("\n")
    width = _CELL.itemsize - 1
    flat = cells.view("u1").reshape(-1, _CELL.itemsize)
    for place in np.flatnonzero(~plain):
        text = cell % rows.flat[place]
        if len(text) > width:
            return None
        flat[place, :width] = np.frombuffer(text.encode(), "u1")
    return cells.tobytes().decode()


@cache
def _texts() -> tuple[Array, Array]:
    """What is before the decimals of numbers by sign and whole part (20000,), and all four decimals (10000,)."""
    numbers, blank = np.arange(10000)[:, None], ord(" ")
    digits = (numbers // (1000, 100, 10, 1) % 10 + ord("0")).astype("u1")
    leading = numbers < (1000, 100, 10)
    text = np.full((2, 10000, 8), blank, "u1")
    text[:, :, 3:7], text[:, :, 7] = digits, ord(".")
    text[:, :, 3:6][:, leading] = blank
    text[1, numbers[:, 0], 2 + leading.sum(axis=1)] = ord("-")
    return text.view("u8").ravel(), digits.view("u4")[:, 0]
