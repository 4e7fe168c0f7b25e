"""Controls in tables over time."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np

from osimlite.base.records import dataclass
from osimlite.base.text import format_count
from osimlite.errors import ModelError
from osimlite.io.tables.storage import StoTable
from osimlite.io.tables.table_stream import TableStream, find_word_start
from osimlite.mechanics.multibody.functions import (
    PiecewiseConstant,
    PiecewiseLinear,
    SmoothFunction,
)
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline


@dataclass(frozen=True)
class TableColumn(PiecewiseLinear):
    """Linear interpolation between the rows of a table, which is undefined outside of the table."""

    source: str = ""  # path of the component that has the table


def read_controls(path: str | Path) -> StoTable:
    """Return a table of controls.

    As in OpenSim, the last of several rows at one time counts.

    Args:
        path: the file.

    Raises:
        DocumentError: the file is not a table.
        ModelError: the times go back, a number is not finite, or there are no rows.
    """
    rows: dict[float, list[float]] = {}
    with TableStream(path) as stream:
        last = -np.inf
        for time, row in stream:
            for number, value in enumerate((time, *row)):
                if not isfinite(value):
                    where = ("time", *stream.columns)[number]
                    column = find_word_start(stream.text, number)
                    raise ModelError(
                        f"'{where}' is {value}; give a number",
                        file=stream.file,
                        line=stream.line,
                        column=column,
                    )
            if time < last:
                raise ModelError(
                    f"the time goes back from {last:g} to {time:g} s; sort the rows",
                    file=stream.file,
                    line=stream.line,
                )
            rows[time] = row
            last = time
        if not rows:
            raise ModelError(
                "the table has no rows; add at least one", file=stream.file, line=stream.line
            )
        return StoTable(
            stream.name,
            np.array([*rows]),
            stream.columns,
            np.array([*rows.values()]),
            file=stream.file,
        )


def make_column_function(table: StoTable, index: int, degree: int, what: str) -> SmoothFunction:
    """Return a column as a function of time, as OpenSim does: steps, or a spline through its values.

    Outside the table, steps and lines have the end values; other splines are extrapolated by
    polynomials of lower degree.

    Args:
        table: the table.
        index: index of the column.
        degree: degree of the spline; 0 for steps; an even degree stands for the odd one below it.
        what: name of the setting of the degree, for messages.

    Returns:
        The function of time (s).

    Raises:
        ModelError: the table has too few rows for the degree.
    """
    times = table.times
    values = table.rows[:, index]
    half_order = (degree + 1) // 2
    if degree == 0:
        return PiecewiseConstant(tuple(times.tolist()), tuple(values.tolist()))
    if not 1 <= half_order <= 4 or len(times) < 2 * half_order:
        raise ModelError(
            f"{what} is {degree}, which is impossible with {format_count(len(times), 'row')}; use 0 for steps "
            "or 1 for straight lines",
            file=table.file,
        )
    return smoothing_spline(times, values, half_order, 0.0)
