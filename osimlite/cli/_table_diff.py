"""Differences between two tables over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.require import require

if TYPE_CHECKING:
    from osimlite.io.tables.storage import StoTable


def describe_table_differences(old_file: Path, new_file: Path) -> list[str]:
    """Describe removed and added columns, changed settings and times, and the largest change of each column.

    Rows are compared at times that both tables have.

    Args:
        old_file: first table; ``/dev/null`` is an empty one.
        new_file: second table; ``/dev/null`` is an empty one.

    Returns:
        One line for each difference.

    Raises:
        DocumentError: a table cannot be read; with line and column.
        MissingDependency: numpy is not installed.
    """
    require("numpy", extra="sim", purpose="comparing tables")
    import numpy as np

    from osimlite.io.document.lexical import format_shortest
    from osimlite.io.tables.storage import StoTable, read_sto

    old_table, new_table = (
        StoTable("", np.zeros(0), (), np.zeros((0, 0)))
        # git passes /dev/null for a file that was added or deleted.
        if str(file) == "/dev/null"
        else read_sto(file)
        for file in (old_file, new_file)
    )
    lines = [f"- {column}" for column in old_table.columns if column not in new_table.columns]
    lines += [f"+ {column}" for column in new_table.columns if column not in old_table.columns]
    properties = zip(
        ("inDegrees", "DataType", "rows", "time"),
        _describe_table(old_table),
        _describe_table(new_table),
        strict=True,
    )
    lines += [
        f"  {property_name}: {old_value} -> {new_value}"
        for property_name, old_value, new_value in properties
        if old_value != new_value
    ]
    times, old_rows, new_rows = np.intersect1d(
        old_table.times, new_table.times, return_indices=True
    )
    for column in (
        column for column in dict.fromkeys(old_table.columns) if column in new_table.columns
    ):
        old_values, new_values = old_table[column][old_rows], new_table[column][new_rows]
        is_changed = ~((old_values == new_values) | (np.isnan(old_values) & np.isnan(new_values)))
        if is_changed.any():
            # A change to or from NaN counts as infinite.
            largest_row = int(
                np.argmax(
                    np.where(
                        is_changed, np.nan_to_num(np.abs(new_values - old_values), nan=np.inf), -1.0
                    )
                )
            )
            count = np.count_nonzero(is_changed)
            extent = f"differs at {count} of the {len(times)} times that both tables have"
            change = f"{format_shortest(float(old_values[largest_row]))} -> {format_shortest(float(new_values[largest_row]))}"
            lines.append(
                f"  {column}: {change} at {times[largest_row]:g} s, where the difference is largest; {extent}"
            )
    return lines


def _describe_table(table: StoTable) -> tuple[str, str, str, str]:
    time_span = f"{table.times[0]:g} to {table.times[-1]:g} s" if len(table.times) else "none"
    return "yes" if table.in_degrees else "no", table.kind, str(len(table.times)), time_span
