"""Differences between two tables over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.require import require

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable


def describe_table_differences(old: Path, new: Path) -> list[str]:
    """Describe removed and added columns, changed settings and times, and the largest change of each column.

    Rows are compared at times that both tables have.

    Args:
        old: first table; ``/dev/null`` is an empty one.
        new: second table; ``/dev/null`` is an empty one.

    Returns:
        One line for each difference.

    Raises:
        DocumentError: a table cannot be read; with line and column.
        MissingDependencyError: numpy is not installed.
    """
    require("numpy", extra="sim", purpose="comparing tables")
    import numpy as np

    from osimlite.io.document.lexical import format_shortest
    from osimlite.io.tables.storage import StoTable, read_sto

    before, after = (
        StoTable("", np.zeros(0), (), np.zeros((0, 0)))
        # git passes /dev/null for a file that was added or deleted.
        if str(file) == "/dev/null"
        else read_sto(file)
        for file in (old, new)
    )
    lines = [f"- {column}" for column in before.columns if column not in after.columns]
    lines += [f"+ {column}" for column in after.columns if column not in before.columns]
    facts = zip(
        ("inDegrees", "DataType", "rows", "time"),
        _describe_table(before),
        _describe_table(after),
        strict=True,
    )
    lines += [f"  {what}: {one} -> {another}" for what, one, another in facts if one != another]
    times, old_rows, new_rows = np.intersect1d(before.times, after.times, return_indices=True)
    for column in (column for column in dict.fromkeys(before.columns) if column in after.columns):
        was, now = before[column][old_rows], after[column][new_rows]
        changed = ~((was == now) | (np.isnan(was) & np.isnan(now)))
        if changed.any():
            # A change to or from NaN counts as infinite.
            largest = int(
                np.argmax(np.where(changed, np.nan_to_num(np.abs(now - was), nan=np.inf), -1.0))
            )
            rows = f"{np.count_nonzero(changed)} of {len(times)} rows differ"
            change = (
                f"{format_shortest(float(was[largest]))} -> {format_shortest(float(now[largest]))}"
            )
            lines.append(
                f"  {column}: {change} at {times[largest]:g} s, where it differs most; {rows}"
            )
    return lines


def _describe_table(table: StoTable) -> tuple[str, str, str, str]:
    span = f"{table.times[0]:g} to {table.times[-1]:g} s" if len(table.times) else "none"
    return "yes" if table.in_degrees else "no", table.kind, str(len(table.times)), span
