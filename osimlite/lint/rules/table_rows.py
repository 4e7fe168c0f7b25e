"""OSIM805 to OSIM809: the rows of a table, their cells and their times."""

from __future__ import annotations

import re
from itertools import pairwise

from osimlite.base.text import format_count
from osimlite.io.document.source import Position
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingSink, rule
from osimlite.lint.table import Table


@rule("OSIM805", "no-rows", severity=ERROR, about="table")
def no_rows(table: Table, report: FindingSink) -> None:
    """A table has no rows.

    Reports tables without any row.

    OpenSim refuses a storage file without rows; of a marker file it looks for the first row for
    ever.

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
    if (
        table.labels
        and "," not in table.labels[0].text
        and not table.rows.count
        and not table.rows.faults
    ):
        fate = "looks for one for ever" if table.is_markers else "refuses the table"
        report(f"there are no rows: OpenSim {fate}", at=Position(table.header.label_line, 1))


@rule("OSIM806", "ragged-row", severity=ERROR, mends="safe", about="table")
def ragged_row(table: Table, report: FindingSink) -> None:
    """A row of a table is no row of numbers, or has too many or too few.

    Compares the cells of each row with the labels, and points out lines between the rows that are
    blank or remarks.

    OpenSim's older reader goes on in the next line for what a row lacks: from there on all numbers
    are in wrong columns. The newer one refuses the file. In marker files and tables of version 2
    and 3 a blank line ends the table, and the rows behind it are lost without a word.

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
    for fault in rows.of("row", "comment", "blank"):
        at = Position(fault.line, fault.column, fault.length)
        if fault.kind == "row":
            fix = (
                _without_last_tabs(table, rows.cells)
                if table.is_markers and fault.number > rows.cells
                else None
            )
            has = format_count(fault.number, "cell")
            report(
                f"the row has {has} and needs {rows.cells}{fault.text}{fault.more()}",
                at=at,
                fix=fix,
            )
        elif fault.kind == "comment":
            report(f"OpenSim knows no remarks among the rows{fault.more('line')}", at=at)
        elif rows.count and fault.line <= rows.line_of(rows.count - 1):
            if table.is_markers or table.is_strict:
                lost = rows.line_of(rows.count - 1) - fault.line
                report(
                    f"a blank line ends the table for OpenSim: {format_count(lost, 'row')} behind it are lost",
                    at=at,
                    fix=_without_blank_lines(table, fault.line),
                )
            else:
                report(
                    f"there is a blank line among the rows{fault.more('line')}",
                    at=at,
                    severity=INFO,
                )


_LAST_TABS = re.compile(rb"\t+(?=\r?(\n|\Z))")
_BLANK_LINES = re.compile(rb"^[ \t\r]*\n(?:[ \t\r\n]*\n)?(?=[^\n]*\S)", re.MULTILINE)


def _without_last_tabs(table: Table, width: int) -> Fix | None:
    """The mend that takes out what ends rows of markers beyond their cells; None if that is more than tabs."""
    edits = []
    for match in _LAST_TABS.finditer(table.data, table.line_start(table.header.label_line + 2)):
        start = table.data.rfind(b"\n", 0, match.start()) + 1
        surplus = min(table.data.count(b"\t", start, match.end()) - (width - 1), len(match[0]))
        if surplus > 0:
            edits.append(Edit(match.end() - surplus, match.end(), ""))
    return Fix(tuple(edits)) if edits else None


def _without_blank_lines(table: Table, first: int) -> Fix:
    """The mend that takes out blank lines between rows, from a line on."""
    result = _BLANK_LINES.finditer(table.data, table.line_start(first))
    return Fix(tuple(Edit(*match.span(), "") for match in result))


@rule("OSIM807", "not-a-number", severity=ERROR, about="table")
def not_a_number(table: Table, report: FindingSink) -> None:
    """A cell of a table is no number.

    Finds words, NaN, infinity, decimal commas and whatever else is no number: once for each column,
    with the number of rows in which it is so. In marker files a marker that was not seen has three
    empty cells, or NaN in all three.

    At the first such cell OpenSim's older reader (version 1 or none) stops: the cell becomes 0, the
    rest of its row is that of the row before, and all later rows are lost, without a word. The
    newer one takes NaN for it (a warning).

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
    for fault in table.rows.of("cell", "time"):
        label = table.label_of(fault.number)
        if fault.kind == "time" and (table.is_markers or table.is_strict):
            fate = "a row without a time is none"
        elif table.is_markers:
            fate = "OpenSim takes the marker for one that it did not see"
        elif table.is_strict:
            fate = "OpenSim takes it for NaN"
        else:
            lost = max(0, end - fault.line)
            fate = f"OpenSim takes it for 0 and loses the rest of the table without a word, {format_count(lost, 'row')}"
        what = f"'{fault.text}' is no number" if fault.text else "there is no number"
        report(
            f"{what} (column '{label}'): {fate}{fault.more()}",
            at=Position(fault.line, fault.column, max(1, fault.length)),
            severity=WARNING
            if fault.kind == "cell" and (table.is_markers or table.is_strict)
            else None,
        )


@rule("OSIM808", "time-order", severity=ERROR, about="table")
def time_order(table: Table, report: FindingSink) -> None:
    """A time of a table is not after the one before it.

    Finds rows with the time of the row before, and rows that go back in time.

    Of two rows with one time OpenSim keeps the second, without a word; where time goes back the
    rows before are lost, or the tool stops. A marker file is refused for either. One time twice in
    a storage file is a warning, and in the last row an information: so OpenSim ends some of its
    results.

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
    if not table.is_markers and table.labels and table.labels[0].text.lower() != "time":
        return
    # OpenSim itself writes the last row of some results twice.
    last = table.rows.line_of(table.rows.count - 1) if table.rows.count else None
    for fault in table.rows.of("order"):
        time, before = fault.text.split()
        what = (
            f"goes back from {before} to {time}"
            if fault.number
            else f"{time} is that of the row before, too"
        )
        severity = (
            None if fault.number or table.is_markers else INFO if fault.line == last else WARNING
        )
        at = Position(fault.line, fault.column, fault.length)
        report(f"the time {what}{fault.more()}", at=at, severity=severity)


@rule("OSIM809", "time-gap", severity=WARNING, about="table")
def time_gap(table: Table, report: FindingSink) -> None:
    """Rows are missing in a table of even times.

    Finds steps that are at least half as long again as the usual one, in tables in which nearly all
    steps are alike.

    Rows were lost. OpenSim draws a spline through the gap; with a filter it does so at the smallest
    step.

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
    if rows.count < 6 or rows.of("order", "time", "row") or table.step <= 0:
        return
    longest = 1.5 * table.step
    steps = [after - before for before, after in pairwise(moments)]
    if max(steps) < longest:
        return
    # OpenSim starts some results one step before the others.
    gaps = [row for row, step in enumerate(steps, 1) if step >= longest and row > 1]
    even = sum(abs(step - table.step) <= 0.2 * table.step for step in steps)
    if len(gaps) <= max(1, len(steps) // 50) and even + len(gaps) >= 0.95 * len(steps):
        for row in gaps[:20]:
            missing = steps[row - 1] / table.step - 1
            lost = (
                f": {format_count(round(missing), 'row')} seem to be missing"
                if 0.5 <= missing < 1e9
                else ""
            )
            report(
                f"from one row to the next {steps[row - 1]:.6g} s pass, usually {table.step:.6g} s{lost}",
                at=table.time_at(rows.line_of(row)),
            )
