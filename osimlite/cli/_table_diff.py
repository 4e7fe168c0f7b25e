"""What changed between two tables over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.require import require

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable


def table_differences(old: Path, new: Path) -> list[str]:
    """Columns that went and came, other settings and times, and where a column that both have differs most.

    Rows are compared at times that both tables have.

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
        if str(file) == "/dev/null"
        else read_sto(file)
        for file in (old, new)
    )
    lines = [f"- {column}" for column in before.columns if column not in after.columns]
    lines += [f"+ {column}" for column in after.columns if column not in before.columns]
    said = zip(
        ("inDegrees", "DataType", "rows", "time"), _facts(before), _facts(after), strict=True
    )
    lines += [f"  {what}: {one} -> {another}" for what, one, another in said if one != another]
    times, at, here = np.intersect1d(before.times, after.times, return_indices=True)
    for column in (column for column in dict.fromkeys(before.columns) if column in after.columns):
        was, now = before[column][at], after[column][here]
        other = ~((was == now) | (np.isnan(was) & np.isnan(now)))
        if other.any():
            most = int(
                np.argmax(np.where(other, np.nan_to_num(np.abs(now - was), nan=np.inf), -1.0))
            )
            rows = f"{np.count_nonzero(other)} of {len(times)} rows differ"
            change = f"{format_shortest(float(was[most]))} -> {format_shortest(float(now[most]))}"
            lines.append(
                f"  {column}: {change} at {times[most]:g} s, where it differs most; {rows}"
            )
    return lines


def _facts(table: StoTable) -> tuple[str, str, str, str]:
    span = f"{table.times[0]:g} to {table.times[-1]:g} s" if len(table.times) else "none"
    return "yes" if table.in_degrees else "no", table.kind, str(len(table.times)), span
