"""OSIM801 to OSIM804: the header and the labels of tables over time (.sto, .mot, .trc)."""

from __future__ import annotations

from math import nan

from osimlite.base.patterns import compile_later
from osimlite.base.text import find_nearest, format_count
from osimlite.io.document.source import Position
from osimlite.io.tables.headers import COUNTS, MARKER_KEYS, SUFFIXES, Entry, MarkerHeader
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.registry import ERROR, INFO, WARNING, FindingCollector, rule
from osimlite.lint.table import Table

_WHOLE_NUMBER = compile_later(r"\+?[0-9]+")
_TO_THE_END = 1_000_000
"""Length of a position that reaches to the end of any line, in characters."""


@rule("OSIM801", "table-header", severity=ERROR, fixes="safe", about="table")
def report_table_header(table: Table, report: FindingCollector) -> None:
    """The header of a table is invalid.

    Checks the line `endheader` of a storage file, which must be in lower case. Checks `nRows` and
    `nColumns` if OpenSim's older reader reads the file (version 1 or none). A marker file must
    start with `PathFileType`, without a byte-order mark. All eight keys must be in its second line
    in order, each with a value.

    OpenSim rejects the file; for a storage file its message says only that an index is out of
    bounds.

    ```sto
      knee
      version=1
      nRows=2
      nColumns=2
    - EndHeader
    + endheader
      time knee_angle
      0.0 0.5
      0.1 0.6
    ```
    """
    start = Position(1, 1)
    header = table.header
    if not table.data or table.data.isspace():
        report("the file is empty: OpenSim rejects it", at=start)
    elif isinstance(header, MarkerHeader):
        _check_marker_header(table, header, report)
    elif header.end.text != "endheader":
        # Of a misnamed marker file only the name is wrong; its lines need no further findings.
        beginning = table.data[:100].lstrip()
        if beginning.startswith(b"PathFileType"):
            report("this is marker data; the name of its file must end with .trc", at=start)
        # The first line as the end of the header means that no line looks like one.
        elif header.end.at.line == 1:
            # Line ends of old Macintosh programs make one line of the whole file.
            ends = (
                "; its lines end with CR alone"
                if b"\r" in table.data[:1000] and b"\n" not in table.data
                else ""
            )
            report(
                f"expected a line 'endheader', found none: OpenSim rejects this storage file{ends}",
                at=start,
            )
        # The line is there in another letter case.
        elif header.end.text:
            report(
                "the header must end with 'endheader' in lower case: OpenSim reads all that "
                "follows as header",
                at=header.end.at,
                suggestion="endheader",
            )
        else:
            report(
                "the line 'endheader' before the labels is missing: OpenSim rejects the table",
                at=header.end.at,
                fix=table.insert_line(header.label_line, "endheader"),
            )
    elif not table.is_strict:
        for key, count in (("nRows", table.rows.count), ("nColumns", len(table.labels))):
            if key not in table.entries:
                # A misspelt key keeps its value, so that its line is changed and none is added.
                similar_key = find_nearest(key, table.entries, cutoff=75)
                entry = table.entries[similar_key] if similar_key else None
                position = entry.key.at if entry else header.end.at
                fix = (
                    _set_count(table, entry, key, count)
                    if entry
                    else table.insert_line(position.line, f"{key}={count}")
                )
                report(
                    f"the header lacks '{key}': OpenSim rejects the table",
                    at=position,
                    suggestion=similar_key and key,
                    fix=fix,
                    # A file with DataType is for the newer reader, which does not require this key.
                    severity=WARNING if "DataType" in table.entries else None,
                )


def _set_count(table: Table, entry: Entry, key: str, count: int) -> Fix | None:
    """Return the fix that sets a count in a line of a header: the key alone if a value is there."""
    if entry.value.text:
        return table.make_replacement(entry.key.at, None, key, certain=True)
    return table.make_replacement(
        entry.key.at._replace(length=_TO_THE_END), None, f"{key}={count}", certain=True
    )


def _check_marker_header(table: Table, header: MarkerHeader, report: FindingCollector) -> None:
    """Report the faults in the five header lines of a marker file."""
    if not table.data.startswith(b"PathFileType"):
        mark = table.data.startswith(b"\xef\xbb\xbf")
        problem = (
            "starts with a byte order mark; save it as UTF-8 without one"
            if mark
            else "must start with PathFileType"
        )
        report(
            f"a marker file {problem}: OpenSim rejects it",
            at=Position(1, 1),
            fix=Fix((Edit(0, 3, ""),)) if mark else None,
        )
    if len(header.lines) < 4:
        ends = ": its lines end with CR alone" if b"\r" in table.data else ""
        report(
            "expected five lines before the rows of a marker file, found "
            f"{len(header.lines)}{ends}",
            at=Position(1, 1),
        )
        # Without these lines nothing of the following can be located.
        return
    keys, values = header.words(2), header.words(3)
    for key, expected_key in zip(keys, MARKER_KEYS, strict=False):
        if key.text != expected_key:
            # With a key missing or too many, the keys stand in other columns, and a replacement by
            # position would be wrong.
            suggestion = expected_key if len(keys) == len(MARKER_KEYS) else None
            report(
                f"expected '{expected_key}' in the header, found '{key.text}'",
                at=key.at,
                suggestion=suggestion,
                certain=True,
            )
            # All following keys would differ as well.
            break
    else:
        if len(keys) < len(MARKER_KEYS):
            report(
                f"the header lacks '{MARKER_KEYS[len(keys)]}': OpenSim rejects the file",
                at=Position(2, 1),
            )
        elif len(values) != len(keys):
            report(
                f"found {format_count(len(values), 'value')} for the {len(keys)} keys in the line above: "
                "OpenSim rejects the file",
                at=Position(3, 1),
            )
    # The fifth line names the coordinates of each marker; OpenSim expects X1 Y1 Z1 X2 and so on.
    fifth = header.lines[4] if len(header.lines) > 4 else b""
    subscripts = [word.text for word in header.words(5)] if fifth else []
    count = len(table.labels)
    expected_subscripts = [f"{axis}{number}" for number in range(1, count + 1) for axis in "XYZ"]
    if subscripts[: 3 * count] != expected_subscripts:
        wrong_index = next(
            (k for k, word in enumerate(expected_subscripts) if subscripts[k : k + 1] != [word]), 0
        )
        position = (
            header.words(5)[wrong_index].at if wrong_index < len(subscripts) else Position(5, 1)
        )
        line = "\t\t" + "\t".join(expected_subscripts)
        fix = None
        # Complete but wrongly numbered subscripts are replaced as a line.
        if len(subscripts) == len(expected_subscripts) and all(
            word[:1] in "XYZ" for word in subscripts
        ):
            fix = table.make_replacement(
                Position(5, 1, len(fifth.rstrip())), None, line, certain=True
            )
        # If the line is missing, the rows begin in the fifth line; it is added only if NumMarkers
        # confirms the number.
        elif (fifth[:1].isdigit() or not fifth.strip()) and [word.text for word in values[3:4]] == [
            str(count)
        ]:
            fix = table.insert_line(5, line)
        report(
            f"expected '{expected_subscripts[wrong_index]}' here in the fifth line: OpenSim rejects the file",
            at=position,
            fix=fix,
        )


@rule("OSIM802", "table-count", severity=ERROR, fixes="safe", about="table")
def report_table_count(table: Table, report: FindingCollector) -> None:
    """A count in the header of a table is wrong.

    Compares `nRows` and `nColumns`, or `NumFrames` and `NumMarkers`, with the actual rows and
    labels.

    From a storage file of version 1, OpenSim reads as many rows as `nRows` says. It takes the next
    `nColumns` numbers as a row, even if they stand on two lines. It rejects a marker file whose
    number of labels is not `NumMarkers`. If OpenSim ignores a wrong count, the finding is a
    warning.

    ```sto
      knee
      version=1
    - nRows=1
    + nRows=2
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
        counts = (
            ("NumFrames", rows.count, "frames", WARNING),
            ("NumMarkers", labels, "labels", ERROR),
        )
    else:
        severity_if_wrong = WARNING if table.is_strict else ERROR
        counts = (
            ("nRows", rows.count, "rows", severity_if_wrong),
            ("nColumns", labels, "labels", severity_if_wrong),
        )
    # Rows that are odd have findings of their own, and may be the reason for the difference.
    odd_rows = rows.select("row", "blank", "comment", "words")
    for key, count, row_kind, severity in counts:
        entry = table.entries.get(key)
        if entry is None or (row_kind in ("rows", "frames") and (odd_rows or not count)):
            continue
        count_text = entry.value.text
        number = float(count_text) if _WHOLE_NUMBER.fullmatch(count_text) else nan
        if number == count:
            continue
        consequence = ""
        # Too large a number of rows is harmless: OpenSim stops at the end of the file.
        if severity is ERROR and row_kind == "rows" and number == number:
            lost_count = count - number
            severity, consequence = (
                (
                    ERROR,
                    ": OpenSim ignores the last row"
                    if round(lost_count) == 1
                    else f": OpenSim ignores the last {format_count(round(lost_count), 'row')}",
                )
                if lost_count > 0
                else (WARNING, "")
            )
        elif severity is ERROR:
            consequence = (
                ": OpenSim rejects the file"
                if table.is_markers
                else ": OpenSim puts numbers into the wrong columns"
            )
        # A suggestion needs evidence from the rows.
        # Where a row has as many cells as the header says, it is a label that is wrong.
        in_rows = {"nColumns": rows.cells, "NumMarkers": (rows.cells - 2) // 3}.get(key, count)
        is_right = not odd_rows and rows.count > 0 and in_rows == count
        report(
            f"'{entry.key.text}' is '{count_text}', but there are {count} {row_kind}{consequence}",
            at=entry.value.at,
            severity=severity,
            suggestion=str(count) if is_right else None,
            certain=True,
            fix=_set_count(table, entry, key, count) if is_right and not count_text else None,
        )


@rule("OSIM803", "table-setting", severity=ERROR, fixes="safe", about="table")
def report_table_setting(table: Table, report: FindingCollector) -> None:
    """A setting in the header of a table has an unknown value.

    Checks `inDegrees` (`yes` or `no`), the letter case of keys, `version` and
    `DataType`. In marker files, checks `Units` (m, cm, mm) and `DataRate`. A `DataRate` that does
    not fit the times is an info.

    OpenSim reads `inDegrees=true` as no: it takes the angles as radians without a message. It
    rejects a file with unknown units.

    ```sto
      knee
      version=1
      nRows=2
      nColumns=2
    - inDegrees=true
    + inDegrees=yes
      endheader
      time knee_angle
      0.0 30.5
      0.1 31.6
    ```
    """
    entries = table.entries
    if table.is_markers:
        units = entries.get("Units")
        # OpenSim knows km as well, but no measured marker is in kilometres.
        if units is not None and units.value.text not in ("m", "mm", "cm", "km"):
            unit_names = {
                "millimetre": "mm",
                "millimeter": "mm",
                "metre": "m",
                "meter": "m",
                "centimeter": "cm",
            }
            expected = unit_names.get(
                units.value.text.lower().rstrip("s"), units.value.text.lower()
            )
            # The suggestion is limited to the units of motion capture.
            report(
                f"unknown units '{units.value.text}': OpenSim rejects the file",
                at=units.value.at,
                suggestion=expected if expected in ("m", "mm", "cm") else None,
                certain=True,
            )
        rate = entries.get("DataRate")
        if rate is not None and not _is_positive(rate.value.text):
            report(
                f"'DataRate' is '{rate.value.text}', expected a frequency",
                at=rate.value.at,
                severity=WARNING,
            )
        # Rounded times move the usual step by some per cent, and missing rows the mean one.
        elif (
            rate is not None
            and table.step > 0.0
            and not 0.9 < float(rate.value.text) * table.step < 1.1
            and table.rate > 0.0
            and not 0.9 < float(rate.value.text) / table.rate < 1.1
        ):
            report(
                f"'DataRate' is '{rate.value.text}', but the times of the frames give "
                f"{table.rate:.4g}",
                at=rate.value.at,
                severity=INFO,
            )
        return
    # OpenSim's keys depend on the letter case.
    for key, entry in entries.items():
        expected = next(
            (
                known_key
                for known_key in ("inDegrees", "version", *COUNTS)
                if known_key.lower() == key.lower()
            ),
            key,
        )
        if expected != key and expected not in entries:
            # Without a version a table is read as one of version 1.
            severity = WARNING if expected == "version" else None
            report(
                f"OpenSim does not know '{key}' and ignores it",
                at=entry.key.at,
                suggestion=expected,
                severity=severity,
            )
    degrees = entries.get("inDegrees")
    # OpenSim's reader looks for yes and no only, in any letter case.
    if degrees is not None and degrees.value.text.lower() not in ("yes", "y", "no", "n"):
        suggestion = {"true": "yes", "1": "yes", "false": "no", "0": "no"}.get(
            degrees.value.text.lower()
        )
        # A word that means no is read as no.
        harmless = suggestion == "no"
        report(
            f"'inDegrees' must be 'yes' or 'no', found '{degrees.value.text}': OpenSim reads this "
            "as no, and the angles in radians",
            at=degrees.value.at,
            suggestion=suggestion,
            certain=True,
            severity=WARNING if harmless else None,
        )
    _check_cell_type(table, report)
    version = entries.get("version")
    if version is not None and not version.value.text.isdecimal():
        report(
            f"expected a whole number as version, found '{version.value.text}'",
            at=version.value.at,
            severity=WARNING,
        )


def _check_cell_type(table: Table, report: FindingCollector) -> None:
    """Report the type of the cells, and blanks around keys, that the newer reader of storage files misreads."""
    kind = table.entries.get("DataType")
    if kind is not None and kind.value.text and kind.value.text not in SUFFIXES:
        report(
            f"unknown DataType '{kind.value.text}': OpenSim rejects the file",
            at=kind.value.at,
            suggestion=find_nearest(kind.value.text, SUFFIXES),
            severity=None if table.is_strict else WARNING,
        )
    # The newer reader splits at "=" and does not strip the rest; the older one does.
    for key, entry in table.entries.items() if table.is_strict else ():
        behind = table.header.lines[entry.key.at.line - 1][
            entry.key.at.column - 1 + entry.key.at.length :
        ]
        if key != "version" and "=" in behind and not behind.startswith(f"={entry.value.text}"):
            report(
                f"OpenSim's newer reader reads the blanks beside '=' as parts of '{key}' and of "
                "its value",
                at=entry.key.at,
                severity=ERROR if key == "DataType" else WARNING,
            )


def _is_positive(text: str) -> bool:
    try:
        return float(text) > 0.0
    except ValueError:
        return False


_ROWS = "0.0→0.5→0.1\n0.1→0.6→0.1\n```"
_STORAGE = f"```sto\nknee\nversion={{}}\nnRows=2\nnColumns=3\nendheader\n{{{{}}}}\n{_ROWS}"
_MARKERS = """```trc
PathFileType→4→(X/Y/Z)→walk.trc
DataRate→CameraRate→NumFrames→NumMarkers→Units→OrigDataRate→OrigDataStartFrame→OrigNumFrames
100→100→2→2→m→100→1→2
{}
→→X1→Y1→Z1→X2→Y2→Z2

1→0.01→0.1→0.9→0.1→0.1→0.5→0.1
2→0.02→0.1→0.9→0.1→0.1→0.5→0.1
```"""
_FRAMES = {
    "old": _STORAGE.format(1),
    "newer": _STORAGE.format(3),
    "start": "```sto\nknee\nversion=1\nnRows=2\n{}\n```",
    "header": "```sto\nknee\nversion=3\n{}\n```",
    "markers": _MARKERS,
}


_FAULTS = """\
01 frame-and-time-label, error, fix safe, in markers: The columns of frame and time have wrong labels. OpenSim
rejects the file.
- Frame#→Times→asis→→→knee
+ Frame#→Time→asis→→→knee
02 marker-label, error, in markers: A marker has no label, or a label with a blank. Without a label OpenSim rejects the file,
with a blank it matches no marker of a model.
- Frame#→Time→l asis→→→knee
+ Frame#→Time→asis→→→knee
03 no-labels, error, in header: A table ends before its labels. OpenSim rejects the file.
  endheader
+ time→hip→knee
+ 0.0→0.5→0.1
+ 0.1→0.6→0.1
04 commas-between-labels, error, in start: Commas separate the columns of a storage file. OpenSim knows tabs and blanks
only, and rejects it.
- nColumns=1
+ nColumns=3
  endheader
- time,hip,knee
- 0.0,0.5,0.1
- 0.1,0.6,0.1
+ time→hip→knee
+ 0.0→0.5→0.1
+ 0.1→0.6→0.1
05 no-time-column, error, fix safe, in old: The first column of a storage file is not labelled time. OpenSim rejects the
table.
- Time→hip→knee
+ time→hip→knee
06 time-not-first, error, in old: The time is not in the first column. OpenSim reads the first column as the time.
- hip→time→knee
+ time→hip→knee
07 blanks-between-labels, warning, in newer: Blanks separate the labels of a table of version 2 or 3. Newer tools of
OpenSim reject such a table.
- time hip knee
+ time→hip→knee
08 label-twice, warning, in old: Two columns have one label. OpenSim finds only the first by its label; for markers it
rejects the file.
- time→knee→knee
+ time→hip→knee
"""


@rule("OSIM804", "column-label", severity=ERROR, about="table", faults=_FAULTS, frames=_FRAMES)
def report_column_label(table: Table, report: FindingCollector) -> None:
    """A label of a table is missing, repeated or invalid.

    The first column of a storage file must be `time`, in lower case. Every column needs a unique
    label. Labels of markers must not contain blanks, every marker needs one, and the columns of
    frame and time must be labelled `Frame#` and `Time`. In a storage file of version 2 or 3 tabs
    must separate the labels; other separators are a warning, in tables of vectors an error.

    Without a column `time` OpenSim rejects the table. Of two columns with one label it finds the
    first, and reads no loads from them; the finding is a warning. It rejects a file with two markers
    of one name.
    A blank splits a label in two, so all following labels name the wrong columns.
    """
    labels, header = table.labels, table.header
    if isinstance(header, MarkerHeader):
        for word, expected_label in zip(header.words(4), ("Frame#", "Time"), strict=False):
            if word.text != expected_label:
                report(
                    f"expected the label '{expected_label}', found '{word.text}': OpenSim rejects the file",
                    at=word.at,
                    suggestion=find_nearest(word.text, [expected_label], cutoff=60),
                    certain=True,
                    fault="frame-and-time-label",
                )
        # Each marker has a label and two empty cells; an empty label is a cell where a label should
        # be.
        cells = header.lines[3].split("\t") if header.lines[3:] else []
        empty_cells = [index for index in range(2, len(cells) - 2, 3) if not cells[index].strip()]
        if empty_cells and len(labels) < len(cells[2:]) // 3:
            report(
                "a marker has no label: OpenSim rejects the file",
                at=Position(4, len("\t".join(cells[: empty_cells[0]])) + 2),
                fault="marker-label",
            )
        for label in labels:
            if " " in label.text:
                report(
                    f"the marker '{label.text}' has a blank in its name: no marker of a model can "
                    "have this name",
                    at=label.at,
                    fault="marker-label",
                )
    elif not labels:
        if header.end.text:
            report("the table ends before its labels", at=header.end.at, fault="no-labels")
        return
    elif labels[0].text != "time":
        first_label, position = labels[0]
        # These labels mean the time beyond doubt; of another the author must decide.
        suggestion = "time" if first_label.lower() in ("time", "t", "times", "time(s)") else None
        if "," in first_label:
            report(
                "tabs or blanks separate the columns of a storage file, not commas: OpenSim "
                "rejects it",
                at=position,
                fault="commas-between-labels",
            )
        # The older reader also accepts a column "range".
        elif all(label.text not in ("time", "range") for label in labels):
            report(
                f"the first column is '{first_label}', expected 'time'",
                at=position,
                suggestion=suggestion,
                certain=True,
                fault="no-time-column",
            )
        else:
            report(
                f"the first column is '{first_label}': OpenSim reads it as the time",
                at=position,
                fault="time-not-first",
            )
    elif header.is_strict and labels[1:] and not header.has_tabs:
        if header.parts > 1:
            report(
                f"blanks separate the columns of a table of {header.kind}: OpenSim rejects it",
                at=labels[1].at,
                severity=ERROR,
                fault="blanks-between-labels",
            )
        else:
            report(
                f"blanks separate the columns of a table of version {header.form}: OpenSim's newer "
                "tools reject it",
                at=labels[1].at,
                fault="blanks-between-labels",
            )
    positions_by_label: dict[str, list[Position]] = {}
    for label in labels:
        positions_by_label.setdefault(label.text, []).append(label.at)
    for name, (_, *repeated) in positions_by_label.items():
        if repeated:
            consequence = (
                "rejects the file" if table.is_markers else "does not find this one by its name"
            )
            repeated_note = (
                f"; there are {format_count(len(repeated) - 1, 'more column')} of this name"
                if repeated[1:]
                else ""
            )
            severity = ERROR if table.is_markers else None
            report(
                f"another column has the label '{name}': OpenSim {consequence}{repeated_note}",
                at=repeated[0],
                severity=severity,
                fault="label-twice",
            )
