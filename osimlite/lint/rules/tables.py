"""OSIM80x: tables over time, in storage files (.sto, .mot) and marker files (.trc)."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from osimlite.document.source import Position
from osimlite.lint.engine import ERROR, INFO, WARNING, Found, rule
from osimlite.lint.rows import Fault
from osimlite.lint.table import COUNTS, MARKER_KEYS, Table
from osimlite.lint.words import times
from osimlite.text import nearest


@rule("OSIM801", "table-header", severity=ERROR, about="table")
def table_header(table: Table, found: Found) -> None:
    """The header of a table is not as OpenSim needs it.

    ## What it does
    Looks for the line `endheader` of a storage file, in small letters, and for `nRows` and `nColumns` where the older
    reader takes the file (version 1 or none). A marker file must start with `PathFileType`, without a byte order mark,
    and name all eight keys of its second line in their order, each with a value.

    ## Why is this bad
    OpenSim refuses the file; of a storage file it says no more than that an index is out of bounds.

    ## Example
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    EndHeader
    time knee_angle
    0.0 0.5
    0.1 0.6
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.6
    ```
    """
    start = Position(1, 1)
    if not table.data.strip():
        found("the file is empty: OpenSim refuses it", at=start)
    elif table.is_markers:
        _marker_header(table, found)
    elif not table.ends_header:
        words = table.data[:100].lstrip()
        if words.startswith(b"PathFileType"):
            found("these are markers over time; a file of them is called .trc", at=start)
        elif not table.end_line.line > 1:
            found("there is no line 'endheader' in this file, so it is no storage file: OpenSim refuses it", at=start)
        elif table.end_line.length > 1:
            found(
                "the header must end with 'endheader' in small letters: OpenSim takes all that follows for header",
                at=table.end_line, suggestion="endheader",
            )  # fmt: skip
        else:
            found("no line 'endheader' stands before the labels: OpenSim refuses the table", at=table.end_line)
    elif not table.is_strict:
        for key in ("nRows", "nColumns"):
            if key not in table.entries:
                near = nearest(key, table.entries, cutoff=75)
                at = table.entries[near].key.at if near else table.end_line
                found(f"the header does not say '{key}': OpenSim refuses the table", at=at, suggestion=near and key)


def _marker_header(table: Table, found: Found) -> None:
    if not table.data.startswith(b"PathFileType"):
        mark = table.data.startswith(b"\xef\xbb\xbf")
        why = "starts with a byte order mark; save it as UTF-8 without one" if mark else "must start with PathFileType"
        found(f"a marker file {why}: OpenSim refuses it", at=Position(1, 1))
    if len(table.head) < 4:
        ends = ": its lines end with CR alone" if b"\r" in table.data else ""
        found(f"a marker file has five lines before its rows, this has {len(table.head)}{ends}", at=Position(1, 1))
        return
    keys, values = table.words(2), table.words(3)
    for key, right in zip(keys, MARKER_KEYS, strict=False):
        if key.text != right:
            found(f"the header says '{key.text}' where OpenSim wants '{right}'", at=key.at, suggestion=right)
            break
    else:
        if len(keys) < len(MARKER_KEYS):
            found(f"the header does not say '{MARKER_KEYS[len(keys)]}': OpenSim refuses the file", at=Position(2, 1))
        elif len(values) != len(keys):
            found(
                f"there are {len(values)} values of the {len(keys)} keys above them: OpenSim refuses the file",
                at=Position(3, 1),
            )
    subscripts = [word.text for word in table.words(5)] if len(table.head) > 4 else []
    count = len(table.labels)
    wanted = [f"{axis}{number}" for number in range(1, count + 1) for axis in "XYZ"]
    if subscripts[: 3 * count] != wanted:
        wrong = next((k for k, word in enumerate(wanted) if subscripts[k : k + 1] != [word]), 0)
        place = table.words(5)[wrong].at if wrong < len(subscripts) else Position(5, 1)
        found(f"the fifth line must say '{wanted[wrong]}' here: OpenSim refuses the file", at=place)


@rule("OSIM802", "table-count", severity=ERROR, about="table")
def table_count(table: Table, found: Found) -> None:
    """A count in the header of a table is not that of the table.

    ## What it does
    Compares `nRows` and `nColumns`, or `NumFrames` and `NumMarkers`, with the rows and the labels that there are.

    ## Why is this bad
    Of a storage file of version 1 OpenSim reads as many rows as the header says, and takes numbers by `nColumns` from
    one line to the next. A marker file with another number of labels is refused. Where OpenSim does not look at a
    count, it is a warning.

    ## Example
    ```sto
    knee
    version=1
    nRows=1
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.6
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.6
    ```
    """
    rows = table.rows
    labels = len(table.labels)
    if table.is_markers:
        counts = (("NumFrames", rows.count, "frames", WARNING), ("NumMarkers", labels, "labels", ERROR))
    else:
        known = WARNING if table.is_strict else ERROR
        counts = (("nRows", rows.count, "rows", known), ("nColumns", labels, "labels", known))
    odd_rows = rows.of("row", "blank", "comment")
    for key, count, what, severity in counts:
        entry = table.entries.get(key)
        if entry is None or (what in ("rows", "frames") and (odd_rows or not count)):
            continue
        said = entry.value.text
        if said.lstrip("+").isdecimal() and int(said) == count:
            continue
        fate = ""
        if severity is ERROR and what == "rows" and said.isdecimal():
            lost = count - int(said)
            severity, fate = (ERROR, f": OpenSim leaves out the last {lost}") if lost > 0 else (WARNING, "")
        elif severity is ERROR:
            fate = ": OpenSim refuses the file" if table.is_markers else ": OpenSim takes numbers for others"
        found(
            f"'{entry.key.text}' is '{said}', and there are {count} {what}{fate}",
            at=entry.value.at, severity=severity, suggestion=str(count),
        )  # fmt: skip


@rule("OSIM803", "table-setting", severity=ERROR, about="table")
def table_setting(table: Table, found: Found) -> None:
    """A setting in the header of a table has a value that OpenSim does not know.

    ## What it does
    Looks at `inDegrees`, which is `yes` or `no`, at the letters that keys are written in, at `version`, `DataType`,
    and of marker files at `Units` (m, cm, mm) and `DataRate`.

    ## Why is this bad
    For OpenSim `inDegrees=true` is no: the angles are taken for radians without a word. Unknown units make it refuse
    the file.

    ## Example
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    inDegrees=true
    endheader
    time knee_angle
    0.0 30.5
    0.1 31.6
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    inDegrees=yes
    endheader
    time knee_angle
    0.0 30.5
    0.1 31.6
    ```
    """
    entries = table.entries
    if table.is_markers:
        units = entries.get("Units")
        if units is not None and units.value.text not in ("m", "mm", "cm", "km"):
            near = {"millimetre": "mm", "millimeter": "mm", "metre": "m", "meter": "m", "centimeter": "cm"}
            right = near.get(units.value.text.lower().rstrip("s"), units.value.text.lower())
            found(
                f"OpenSim does not know the units '{units.value.text}' and refuses the file",
                at=units.value.at, suggestion=right if right in ("m", "mm", "cm") else None,
            )  # fmt: skip
        rate = entries.get("DataRate")
        if rate is not None and not _is_positive(rate.value.text):
            found(f"'DataRate' is '{rate.value.text}' and no frequency", at=rate.value.at, severity=WARNING)
        return
    for key, entry in entries.items():
        right = next((known for known in ("inDegrees", "version", *COUNTS) if known.lower() == key.lower()), key)
        if right != key and right not in entries:
            found(f"OpenSim does not know '{key}' and leaves it out", at=entry.key.at, suggestion=right)
    degrees = entries.get("inDegrees")
    if degrees is not None and degrees.value.text.lower() not in ("yes", "y", "no", "n"):
        meant = {"true": "yes", "1": "yes", "false": "no", "0": "no"}.get(degrees.value.text.lower())
        harmless = meant == "no"
        found(
            f"'inDegrees' is 'yes' or 'no'; of '{degrees.value.text}' OpenSim makes no: it takes angles for radians",
            at=degrees.value.at, suggestion=meant, severity=WARNING if harmless else None,
        )  # fmt: skip
    version = entries.get("version")
    if version is not None and not version.value.text.isdecimal():
        found(f"the version is a whole number, not '{version.value.text}'", at=version.value.at, severity=WARNING)


def _is_positive(text: str) -> bool:
    try:
        return float(text) > 0.0
    except ValueError:
        return False


@rule("OSIM804", "column-label", severity=ERROR, about="table")
def column_label(table: Table, found: Found) -> None:
    """A label of a table is missing, stands there twice, or is not as OpenSim needs it.

    ## What it does
    The first column of a storage file is `time`, in small letters. Every column has a label of its own. Labels of
    markers have no blanks, and the time and the frame before them are called `Time` and `Frame#`.

    ## Why is this bad
    Without a column `time` OpenSim refuses the table. Of two columns with one label it finds the first (a warning), and
    takes no loads from them; of two markers with one name it refuses the file. A blank makes two labels of one, so that
    all that follow name the wrong columns.

    ## Example
    ```sto
    knee
    version=1
    nRows=2
    nColumns=3
    endheader
    time knee_angle knee_angle
    0.0 0.5 0.1
    0.1 0.6 0.1
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=2
    nColumns=3
    endheader
    time knee_angle_r knee_angle_l
    0.0 0.5 0.1
    0.1 0.6 0.1
    ```
    """
    labels = table.labels
    if table.is_markers:
        for word, right in zip(table.words(4) if len(table.head) > 3 else [], ("Frame#", "Time"), strict=False):
            if word.text != right:
                found(
                    f"the label '{word.text}' must be '{right}': OpenSim refuses the file", at=word.at, suggestion=right
                )
        for label in labels:
            if " " in label.text:
                found(f"the marker '{label.text}' has a blank in its name, which no marker of a model has", at=label.at)
    elif not labels:
        if table.ends_header:
            found("the table ends before its labels", at=table.end_line)
        return
    elif labels[0].text != "time":
        first, at = labels[0]
        near = "time" if first.lower() in ("time", "t", "times", "time(s)") else None
        if "," in first:
            found("tabs or blanks separate the columns of a storage file, not commas: OpenSim refuses it", at=at)
        elif all(label.text not in ("time", "range") for label in labels):
            found(
                f"the first column is '{first}': OpenSim needs one called 'time'",
                at=at,
                suggestion=near,
            )
        else:
            found(f"the first column is '{first}': OpenSim takes it for the time", at=at)
    seen = Counter(label.text for label in labels)
    told: set[str] = set()
    for label in labels:
        if seen[label.text] > 1 and label.text in told:
            fate = "refuses the file" if table.is_markers else "does not find this one by its name"
            severity = None if table.is_markers else WARNING
            found(f"a column is called '{label.text}' already: OpenSim {fate}", at=label.at, severity=severity)
        told.add(label.text)


@rule("OSIM805", "no-rows", severity=ERROR, about="table")
def no_rows(table: Table, found: Found) -> None:
    """A table has no rows.

    ## What it does
    Reports tables without any row.

    ## Why is this bad
    OpenSim refuses a storage file without rows; of a marker file it looks for the first row for ever.

    ## Example
    ```sto
    knee
    version=1
    nRows=0
    nColumns=2
    endheader
    time knee_angle
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=1
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    ```
    """
    if table.labels and "," not in table.labels[0].text and not table.rows.count and not table.rows.faults:
        fate = "looks for one for ever" if table.is_markers else "refuses the table"
        found(f"there are no rows: OpenSim {fate}", at=Position(table.label_line, 1))


def _more(fault: Fault, noun: str) -> str:
    return f"; so it is in {times(fault.times - 1, f'more {noun}')}" if fault.times > 1 else ""


@rule("OSIM806", "ragged-row", severity=ERROR, about="table")
def ragged_row(table: Table, found: Found) -> None:
    """A row of a table is no row of numbers, or has too many or too few.

    ## What it does
    Compares the cells of each row with the labels, and points out lines between the rows that are blank or remarks.

    ## Why is this bad
    OpenSim's older reader goes on in the next line for what a row lacks: from there on all numbers are in wrong
    columns. The newer one refuses the file. In marker files and tables of version 2 and 3 a blank line ends the table,
    and the rows behind it are lost without a word.

    ## Example
    ```sto
    knee
    version=1
    nRows=3
    nColumns=3
    endheader
    time knee hip
    0.0 0.5 0.1
    0.1 0.6
    0.2 0.7 0.1
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=3
    nColumns=3
    endheader
    time knee hip
    0.0 0.5 0.1
    0.1 0.6 0.1
    0.2 0.7 0.1
    ```
    """
    rows = table.rows
    width = len(table.labels) * 3 + 2 if table.is_markers else len(table.labels)
    for fault in rows.of("row", "comment", "blank"):
        at = Position(fault.line, fault.column, fault.length)
        if fault.kind == "row":
            found(f"the row has {fault.text} cells and needs {width}{_more(fault, 'row')}", at=at)
        elif fault.kind == "comment":
            found(f"OpenSim knows no remarks among the rows{_more(fault, 'line')}", at=at)
        elif rows.count and fault.line <= rows.line_of(rows.count - 1):
            if table.is_markers or table.is_strict:
                lost = rows.line_of(rows.count - 1) - fault.line
                found(f"a blank line ends the table for OpenSim: {times(lost, 'row')} behind it are lost", at=at)
            else:
                found(f"there is a blank line among the rows{_more(fault, 'line')}", at=at, severity=INFO)


@rule("OSIM807", "not-a-number", severity=ERROR, about="table")
def not_a_number(table: Table, found: Found) -> None:
    """A cell of a table is no number.

    ## What it does
    Finds words, NaN, infinity, decimal commas and whatever else is no number: once for each column, with the number of
    rows in which it is so. In marker files a marker that was not seen has three empty cells, or NaN in all three.

    ## Why is this bad
    At the first such cell OpenSim's older reader (version 1 or none) stops: the cell becomes 0, the rest of its row is
    that of the row before, and all later rows are lost, without a word. The newer one takes NaN for it (a warning).

    ## Example
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 NaN
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=2
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.5
    ```
    """
    for fault in table.rows.of("cell", "time"):
        label = _label(table, fault.number)
        if table.is_markers:
            fate = "OpenSim takes the marker for one that it did not see"
        elif table.is_strict:
            fate = "OpenSim takes it for NaN"
        else:
            lost = table.rows.line_of(table.rows.count - 1) - fault.line if table.rows.count else 0
            fate = f"OpenSim takes it for 0 and loses the rest of the table without a word, {times(lost, 'row')}"
        what = f"'{fault.text}' is no number" if fault.text else "there is no number"
        found(
            f"{what} (column '{label}'): {fate}{_more(fault, 'row')}",
            at=Position(fault.line, fault.column, max(1, fault.length)),
            severity=WARNING if fault.kind == "cell" and (table.is_markers or table.is_strict) else None,
        )


def _label(table: Table, number: int) -> str:
    """The label of a column by its number; of a marker file its marker's."""
    if table.is_markers:
        place = (number - 2) // 3
        return "Time" if number < 2 else table.labels[place].text if place < len(table.labels) else str(number)
    return table.labels[number].text if number < len(table.labels) else str(number)


@rule("OSIM808", "time-order", severity=ERROR, about="table")
def time_order(table: Table, found: Found) -> None:
    """A time of a table is not after the one before it.

    ## What it does
    Finds rows with the time of the row before, and rows that go back in time.

    ## Why is this bad
    Of two rows with one time OpenSim keeps the second, without a word; where time goes back the rows before are lost,
    or the tool stops. A marker file is refused for either. One time twice in a storage file is a warning.

    ## Example
    ```sto
    knee
    version=1
    nRows=3
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.6
    0.1 0.7
    ```

    ## Use instead
    ```sto
    knee
    version=1
    nRows=3
    nColumns=2
    endheader
    time knee_angle
    0.0 0.5
    0.1 0.6
    0.2 0.7
    ```
    """
    if not table.is_markers and table.labels and table.labels[0].text.lower() != "time":
        return
    for fault in table.rows.of("order"):
        time, before = fault.text.split()
        what = f"goes back from {before} to {time}" if fault.number else f"{time} is that of the row before, too"
        # OpenSim itself writes the last row of some results twice.
        severity = None if fault.number or table.is_markers else WARNING
        at = Position(fault.line, fault.column, fault.length)
        found(f"the time {what}{_more(fault, 'row')}", at=at, severity=severity)


@rule("OSIM809", "time-gap", severity=WARNING, about="table")
def time_gap(table: Table, found: Found) -> None:
    """Rows are missing in a table of even times.

    ## What it does
    Finds steps that are at least half as long again as the usual one, in tables in which nearly all steps are alike.

    ## Why is this bad
    Rows were lost. OpenSim draws a spline through the gap; with a filter it does so at the smallest step.

    ## Example
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
    0.8 0.8
    ```

    ## Use instead
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
    0.5 0.8
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
            missing = round(steps[row - 1] / table.step) - 1
            lost = f": {times(missing, 'row')} seem to be missing" if missing else ""
            found(
                f"from one row to the next {steps[row - 1]:.6g} s pass, usually {table.step:.6g} s{lost}",
                at=Position(rows.line_of(row), 1),
            )
