"""Tables as OpenSim's tools print them: the older form of its storage files, with eight decimals."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

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


def printed(table: StoTable, description: str = "", precision: int = PRECISION) -> Iterator[str]:
    """The lines of a table as OpenSim's ``Storage`` prints it.

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
    line = "\t".join([f"%{precision + _PADDING}.{precision}f"] * (len(table.columns) + 1)) + "\n"
    for row in np.column_stack([table.times, table.rows]).tolist():
        yield line % tuple(row)
