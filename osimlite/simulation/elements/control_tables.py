"""Controls in tables over time."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

import numpy as np

from osimlite.errors import ModelError
from osimlite.io.tables.storage import StoTable
from osimlite.io.tables.table_stream import TableStream, start_of_word
from osimlite.mechanics.multibody.functions import Function, PiecewiseConstant
from osimlite.mechanics.multibody.smoothing_spline import smoothing_spline


def read_controls(path: str | Path) -> StoTable:
    """A table of controls; of rows at the same time the last one counts, as in OpenSim.

    Raises:
        DocumentError: it is no table.
        ModelError: the times do not increase, a number is not finite, or there are no rows.
    """
    rows: dict[float, list[float]] = {}
    with TableStream(path) as stream:
        last = -np.inf
        for time, row in stream:
            for number, value in enumerate((time, *row)):
                if not isfinite(value):
                    where, column = (
                        ("time", *stream.columns)[number],
                        start_of_word(stream.text, number),
                    )
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
                "the table has no rows; give it some", file=stream.file, line=stream.line
            )
        return StoTable(
            stream.name,
            np.array([*rows]),
            stream.columns,
            np.array([*rows.values()]),
            file=stream.file,
        )


def column_function(table: StoTable, place: int, degree: int, what: str) -> Function:
    """A column as a function of time, as OpenSim makes it one: steps, or a spline through its values.

    Outside, steps and straight lines hold the end values, and other splines go on as polynomials of
    lower degree.

    Args:
        table: with the column.
        place: of the column.
        degree: of the spline; 0 is steps, and an even number stands for the odd one below it.
        what: sets the degree, for messages.

    Raises:
        ModelError: the degree is not possible with so many rows.
    """
    times, values, half_order = table.times, table.rows[:, place], (degree + 1) // 2
    if degree == 0:
        return PiecewiseConstant(tuple(times.tolist()), tuple(values.tolist()))
    if not 1 <= half_order <= 4 or len(times) < 2 * half_order:
        raise ModelError(
            f"{what} is {degree}, which {len(times)} rows do not allow; take 0 for steps or 1 for straight lines",
            file=table.file,
        )
    return smoothing_spline(times, values, half_order, 0.0)
