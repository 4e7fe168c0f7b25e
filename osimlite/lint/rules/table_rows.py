"""OSIM805 to OSIM809: the rows of a table, their cells and their times."""

from __future__ import annotations

import re
from itertools import pairwise
from math import isfinite

from osimlite.base.patterns import compile_later
from osimlite.base.text import format_count
from osimlite.io.document.source import Position
from osimlite.io.tables.headers import MAX_TIME_S
from osimlite.io.tables.vector_rows import (
    DECIMAL_COMMA,
    LARGE_NUMBER,
    parse_leading_number,
    split_vector,
)
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingCollector, rule
from osimlite.lint.table import Table


@rule("OSIM805", "no-rows", severity=ERROR, about="table")
def report_no_rows(table: Table, report: FindingCollector) -> None:
    """A table has no rows.

    Reports tables without any row.

    OpenSim rejects a storage file without rows; for a marker file it hangs.

    ```sto
      knee
      version=1
    - nRows=0
    + nRows=1
      nColumns=2
      endheader
      time knee_angle
    + 0.0 0.5
    ```
    """
    # Labels with commas, and rows that are all faulty, are reported by other rules.
    if (
        table.labels
        and "," not in table.labels[0].text
        and not table.rows.count
        and not table.rows.faults
    ):
        consequence = "hangs" if table.is_markers else "rejects the table"
        report(f"there are no rows: OpenSim {consequence}", at=Position(table.header.label_line, 1))


@rule("OSIM806", "ragged-row", severity=ERROR, fixes="safe", about="table")
def report_ragged_row(table: Table, report: FindingCollector) -> None:
    """A row of a table has the wrong number of cells.

    Compares the cells of each row with the labels, and reports blank lines, comments and other text
    between the rows.

    OpenSim's older reader takes missing cells from the next line: from there on all numbers are in
    the wrong columns. The newer reader rejects the file. In marker files and tables of version 2
    and 3 a blank line ends the table, and the rows after it are lost without a message. In tables
    of vectors (`DataType=Vec3` and others) one tab separates two cells, and OpenSim rejects the
    table if a cell has too few or too many numbers.

    ```sto
      knee
      version=1
      nRows=3
      nColumns=3
      endheader
      time knee hip
      0.0 0.5 0.1
    - 0.1 0.6
    + 0.1 0.6 0.1
      0.2 0.7 0.1
    ```
    """
    rows = table.rows
    for fault in rows.select("row", "vector", "comment", "words", "blank"):
        position = Position(fault.line, fault.column, fault.length)
        if fault.kind == "vector":
            count = len(split_vector(fault.text))
            problem = f"has {format_count(count, 'number')}" if count else "is empty"
            report(
                f"the cell of column '{table.label_of(fault.number)}' {problem} and needs "
                f"{table.parts}: OpenSim rejects the table{fault.describe_repeats()}",
                at=position,
            )
        elif fault.kind == "row":
            # A tab too many at the end of each line is what several programs write.
            fix = (
                _remove_last_tabs(table, rows.cells)
                if table.is_markers and fault.number > rows.cells
                else None
            )
            cell_count = format_count(fault.number, "cell")
            report(
                f"the row has {cell_count} and needs {rows.cells}{fault.text}{fault.describe_repeats()}",
                at=position,
                fix=fix,
            )
        elif fault.kind == "comment":
            report(
                f"OpenSim does not allow comments among the rows{fault.describe_repeats('line')}",
                at=position,
            )
        elif fault.kind == "words":
            report(
                f"expected a row of numbers, found '{fault.text}'{fault.describe_repeats('line')}",
                at=position,
            )
        # Blank lines after the last row do no harm.
        elif rows.count and fault.line <= rows.line_of(rows.count - 1):
            # The newer reader stops at a blank line; the older one passes over it.
            if table.is_markers or table.is_strict:
                lost_count = rows.line_of(rows.count - 1) - fault.line
                report(
                    "a blank line ends the table: OpenSim ignores "
                    f"{format_count(lost_count, 'row')} after it",
                    at=position,
                    fix=_remove_blank_lines(table, fault.line),
                )
            else:
                report(
                    f"there is a blank line among the rows{fault.describe_repeats('line')}",
                    at=position,
                    severity=INFO,
                )


_LAST_TABS = compile_later(rb"\t+(?=\r?(\n|\Z))")
_BLANK_LINES = compile_later(rb"^[ \t\r]*\n(?:[ \t\r\n]*\n)?(?=[^\n]*\S)", re.MULTILINE)


def _remove_last_tabs(table: Table, width: int) -> Fix | None:
    """Return the fix that deletes tabs beyond the cells of rows of markers; None without one."""
    edits = []
    for match in _LAST_TABS.finditer(table.data, table.line_start(table.header.label_line + 2)):
        start = table.data.rfind(b"\n", 0, match.start()) + 1
        # Only tabs at the end are removed, and no more than there are too many.
        surplus = min(table.data.count(b"\t", start, match.end()) - (width - 1), len(match[0]))
        if surplus > 0:
            edits.append(Edit(match.end() - surplus, match.end(), ""))
    return Fix(tuple(edits)) if edits else None


def _remove_blank_lines(table: Table, first: int) -> Fix:
    """Return the fix that deletes blank lines between rows, from a line on."""
    result = _BLANK_LINES.finditer(table.data, table.line_start(first))
    return Fix(tuple(Edit(*match.span(), "") for match in result))


@rule("OSIM807", "not-a-number", severity=ERROR, about="table")
def report_not_a_number(table: Table, report: FindingCollector) -> None:
    """A cell of a table is not a number.

    Reports words, NaN, infinity, decimal commas and other cells that are not numbers: once for each
    column, with the number of rows. In marker files a missing marker has three empty cells, or NaN
    in all three.

    At the first such cell OpenSim's older reader (version 1 or none) stops: the cell becomes 0, the
    rest of its row repeats the row before, and all later rows are lost, without a message. The
    newer reader, and that of marker files, read the number at the beginning of the cell, or NaN. The
    finding is then a warning, except for decimal commas, whose decimals are lost, and for times.

    ```sto
      knee
      version=1
      nRows=2
      nColumns=2
      endheader
      time knee_angle
      0.0 0.5
    - 0.1 NaN
    + 0.1 0.5
    ```
    """
    end = table.rows.line_of(table.rows.count - 1) if table.rows.count else 0
    for fault in table.rows.select("cell", "time"):
        label = table.label_of(fault.number)
        value = parse_leading_number(fault.text)
        is_decimal_comma = bool(DECIMAL_COMMA.fullmatch(fault.text.strip()))
        # The newer reader and that of marker files ignore what follows a number.
        ignores_rest = table.is_markers or table.is_strict
        if ignores_rest and isfinite(value):
            consequence = f"OpenSim reads {value:g}"
        elif fault.kind == "time" and ignores_rest:
            consequence = "a row needs a time"
        elif table.is_markers:
            consequence = "OpenSim treats the marker as not seen"
        elif table.is_strict:
            consequence = "OpenSim reads it as NaN"
        # The older reader stops at a word, and fills what is left with zeros.
        else:
            lost_count = max(0, end - fault.line)
            stored_text = "1.8e308" if LARGE_NUMBER.fullmatch(fault.text) else "0"
            consequence = (
                f"OpenSim reads {stored_text} and loses the rest of the table, {format_count(lost_count, 'row')}, without "
                "a message"
            )
        if not fault.text:
            problem = "the number is missing"
        elif LARGE_NUMBER.fullmatch(fault.text):
            problem = f"'{fault.text}' is beyond 1.8e308, the largest number"
        else:
            problem = f"'{fault.text}' is not a number"
        report(
            f"{problem} (column '{label}'): {consequence}{fault.describe_repeats()}",
            at=Position(fault.line, fault.column, max(1, fault.length)),
            # Without its decimals a number is wrong, but plausible.
            severity=WARNING
            if fault.kind == "cell" and ignores_rest and not is_decimal_comma
            else None,
            suggestion=fault.text.replace(",", ".") if is_decimal_comma else None,
        )


@rule("OSIM808", "time-order", severity=ERROR, about="table")
def report_time_order(table: Table, report: FindingCollector) -> None:
    """A time of a table is not after the one before it.

    Reports rows with the time of the row before, rows that go back in time, and times beyond 1e25 s.

    Of two rows with one time OpenSim keeps the second, without a message; where time goes back the
    rows before are lost, or the tool stops. OpenSim rejects a marker file or a table of vectors
    with either. In a storage file with single numbers, a repeated time is a warning. In the last row
    it is an info, because OpenSim writes the last time of some results twice.

    ```sto
      knee
      version=1
      nRows=3
      nColumns=2
      endheader
      time knee_angle
      0.0 0.5
      0.1 0.6
    - 0.1 0.7
    + 0.2 0.7
    ```
    """
    # Without a column of times the order means nothing.
    if not table.is_markers and table.labels and table.labels[0].text.lower() != "time":
        return
    # OpenSim itself writes the last row of some results twice.
    last_line = table.rows.line_of(table.rows.count - 1) if table.rows.count else None
    for fault in table.rows.select("order"):
        time, previous_time = fault.text.split()
        problem = (
            f"goes back from {previous_time} to {time}"
            if fault.number
            else f"{time} repeats that of the row before"
        )
        # Repeated times are kept apart from times that go back, which no spline can be put through.
        severity = (
            None
            if fault.number or table.is_markers or table.parts > 1
            else INFO
            if fault.line == last_line
            else WARNING
        )
        position = Position(fault.line, fault.column, fault.length)
        report(f"the time {problem}{fault.describe_repeats()}", at=position, severity=severity)
    # Rows without a readable time have a substitute that may be at the end of all numbers.
    times = [] if table.span is None else table.rows.times
    # Times grow: what is too large is at the ends. A time that goes back is reported above.
    far_rows = [row for row in (0, len(times) - 1) if times and abs(times[row]) >= MAX_TIME_S]
    if far_rows:
        # Damaged times may also be large and negative at the end.
        row = next(row for row, time in enumerate(times) if abs(time) >= MAX_TIME_S)
        report(
            f"the time {times[row]:g} s is too large for a motion: osimlite does not read the table, "
            "because splines through it would overflow",
            at=Position(table.rows.line_of(row), 1),
        )


@rule("OSIM809", "time-gap", severity=WARNING, about="table")
def report_time_gap(table: Table, report: FindingCollector) -> None:
    """Rows are missing in a table with a constant time step.

    Reports time steps at least 1.5 times the usual step, in tables with nearly constant steps.

    Rows were lost. OpenSim interpolates the gap with a spline; with a filter it resamples at the
    smallest step.

    ```sto
      knee
      version=1
      nRows=6
      nColumns=2
      endheader
      time knee_angle
      0.0 0.5
      0.1 0.6
      0.2 0.7
      0.3 0.7
      0.4 0.7
    - 0.8 0.8
    + 0.5 0.8
    ```
    """
    rows = table.rows
    moments = rows.times
    # Irregular steps have no usual step.
    if rows.count < 6 or rows.select("order", "time", "row") or table.step <= 0:
        return
    longest = 1.5 * table.step
    steps = [after - before for before, after in pairwise(moments)]
    if max(steps) < longest:
        return
    # OpenSim starts some results one step before the others.
    gaps = [row for row, step in enumerate(steps, 1) if step >= longest and row > 1]
    even_count = sum(abs(step - table.step) <= 0.2 * table.step for step in steps)
    # Few gaps in otherwise even steps; a table with variable steps has no gaps.
    if len(gaps) <= max(1, len(steps) // 50) and even_count + len(gaps) >= 0.95 * len(steps):
        # The first twenty gaps show the cause.
        for row in gaps[:20]:
            loss_note = ""
            if (missing_ratio := steps[row - 1] / table.step - 1) < 1e9:
                missing_count = max(1, round(missing_ratio))
                verb = "seems" if missing_count == 1 else "seem"
                loss_note = f": {format_count(missing_count, 'row')} {verb} to be missing"
            report(
                f"from one row to the next {steps[row - 1]:.6g} s pass, usually {table.step:.6g} "
                f"s{loss_note}",
                at=table.locate_time(rows.line_of(row)),
            )
