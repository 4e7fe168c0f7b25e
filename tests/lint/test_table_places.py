"""Check that faults of tables are reported at their line and column, and harmless changes are not."""

from __future__ import annotations

import pytest

from osimlite.lint.engine import run_rules
from osimlite.lint.table import Table

STORAGE = (
    "walk\nversion=1\nnRows=6\nnColumns=3\ninDegrees=yes\nendheader\ntime\thip\tknee\n"
    + "".join(f"{row / 10:.1f}\t{10 + 1.5 * row:.2f}\t{-20 - row:.2f}\n" for row in range(6))
)
MARKERS = (
    "PathFileType\t4\t(X/Y/Z)\tw.trc\n"
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
    "100\t100\t6\t2\tmm\t100\t1\t6\nFrame#\tTime\tRASI\t\t\tLASI\t\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n\n"
) + "".join(
    f"{row + 1}\t{row / 100:.2f}\t{100 + row}\t1000\t50\t{120 + row}\t900\t-150\n"
    for row in range(6)
)

# Changes of the storage file: old text, new text, and the expected findings with line and column.
OF_STORAGE = {
    "NaN": ("13.00", "NaN", ["OSIM807 10:5"]),
    "word": ("-22.00", "abc", ["OSIM807 10:11"]),
    "short row": ("\t-22.00", "", ["OSIM806 10:10"]),
    "long row": ("-22.00", "-22.00\t7", ["OSIM806 10:18"]),
    "remark": ("0.3\t", "# remark\n0.3\t", ["OSIM806 11:1"]),
    "words at the end": ("-25.00\n", "-25.00\nend of data\n", ["OSIM806 14:1"]),
    "blank line": ("0.3\t", "\n0.3\t", ["OSIM806 11:1"]),
    "time twice": ("0.3\t", "0.2\t", ["OSIM808 11:1"]),
    "time back": ("0.3\t", "   0.1\t", ["OSIM808 11:4"]),
    "time with a comma": ("0.3\t", "0,3\t", ["OSIM807 11:1"]),
    "rows missing": ("0.5\t", " 0.9\t", ["OSIM809 13:2"]),
    "time beyond belief": ("0.5\t", "1e308\t", ["OSIM808 13:1", "OSIM809 13:1"]),
    "time beyond the largest number": ("0.5\t", "1e999\t", ["OSIM807 13:1"]),
    "inDegrees true": ("=yes", "=true", ["OSIM803 5:11"]),
    "small letters": ("inDegrees", "indegrees", ["OSIM803 5:1"]),
    "no version": ("version=1", "version=x", ["OSIM803 2:9"]),
    "too many rows said": ("nRows=6", "nRows=9", ["OSIM802 3:7"]),
    "too few rows said": ("nRows=6", "nRows=4", ["OSIM802 3:7"]),
    "rows not said": ("nRows=6\n", "", ["OSIM801 5:1"]),
    "columns": ("nColumns=3", "nColumns = 5", ["OSIM802 4:12"]),
    "columns not said": ("nColumns=3\n", "", ["OSIM801 5:1"]),
    "label missing": ("\tknee", "", ["OSIM802 4:10"]),
    "label twice": ("knee", "hip", ["OSIM80408 7:10"]),
    "Time": ("time", "Time", ["OSIM80405 7:1"]),
    "no end": ("endheader\n", "", ["OSIM801 6:1"]),
    "EndHeader": ("endheader", "  EndHeader", ["OSIM801 6:3"]),
    "blanks in version 3": ("version=1", "version=3", ["OSIM80407 7:6"]),
    "blanks": ("inDegrees=yes", "inDegrees = yes", []),
    "version 3": ("version=1", "version=3", []),
    "no version said": ("version=1\n", "", []),
    "mark": ("walk", "\ufeffwalk", []),
}

# Changes of the marker file: old text, new text, and the expected findings with line and column.
OF_MARKERS = {
    "blank line": ("3\t0.02", "\n3\t0.02", ["OSIM806 9:1"]),
    "empty cell": ("102\t1000", "102\t", ["OSIM812 9:8"]),
    "NaN": ("122\t900", "122\tNaN", ["OSIM812 9:20"]),
    "word": ("102\t1000", "102\tabc", ["OSIM807 9:12"]),
    "0 0 0": ("102\t1000\t50", "0\t0\t0", ["OSIM812 9:8"]),
    "0 0 0 behind NaN": (
        "102\t1000\t50\t122\t900\t-150",
        "NaN\tNaN\tNaN\t0\t0\t0",
        ["OSIM812 9:20"],
    ),
    "short row": ("122\t900\t-150", "122\t900", ["OSIM806 9:27"]),
    "tabs at the end": ("122\t900\t-150", "122\t900\t-150\t\t", ["OSIM806 9:33"]),
    "blanks for tabs": (
        "3\t0.02\t102\t1000\t50\t122\t900\t-150",
        "3 0.02 102 1000 50 122 900 -150",
        ["OSIM806 9:32"],
    ),
    "frames": ("\t6\t2", "\t9\t2", ["OSIM802 3:9"]),
    "rate": ("\n100\t100\t6", "\n50\t100\t6", ["OSIM803 3:1"]),
    "rate in words": ("\n100\t100\t6", "\nx\t100\t6", ["OSIM803 3:1"]),
    "number of a frame": ("\n3\t0.02", "\n7\t0.02", ["OSIM813 9:1"]),
    "markers": ("\t6\t2", "\t6\t3", ["OSIM802 3:11"]),
    "key": ("NumFrames", "NumFrame", ["OSIM801 2:21"]),
    "no label": ("RASI", "", ["OSIM802 3:11", "OSIM80402 4:13"]),
    "no fifth line": ("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n", "", ["OSIM801 5:1"]),
    "fifth line": ("X2", "X3", ["OSIM801 5:12"]),
    "first word": ("PathFileType", "PathType", ["OSIM801 1:1"]),
    "metres": ("mm", "m", ["OSIM811 3:13"]),
    "inches": ("mm", "inch", ["OSIM803 3:13"]),
    "no units": ("\tmm\t", "\t\t", ["OSIM801 3:1"]),
    "time twice": ("3\t0.02", "3\t0.01", ["OSIM808 9:3"]),
    "time back": ("4\t0.03", "4\t 0.01", ["OSIM808 10:4"]),
    "time NaN": ("3\t0.02", "3\tNaN", ["OSIM807 9:3"]),
    "no time": ("3\t0.02", "3\t", ["OSIM807 9:3"]),
    "frames missing": ("6\t0.05", "6\t0.09", ["OSIM809 12:3"]),
    "label twice": ("LASI", "RASI", ["OSIM80408 4:20"]),
    "blank in a label": ("LASI", "L ASI", ["OSIM80402 4:20"]),
    "no blank line": ("\n\n1\t", "\n1\t", []),
    "a tab at the end": ("-150\n", "-150\t\n", []),
}


@pytest.mark.parametrize(
    ("name", "good", "change"),
    [(f"{what} in storage", STORAGE, change) for what, change in OF_STORAGE.items()]
    + [(f"{what} in markers", MARKERS, change) for what, change in OF_MARKERS.items()],
    ids=lambda value: value if isinstance(value, str) and value.count("\n") == 0 else "",
)
def test_a_fault_is_found_in_its_line_and_column(name, good, change):
    old, new, wanted = change
    assert old in good
    text = good.replace(old, new, 1)
    if name == "blanks in version 3 in storage":
        text = text.replace("\t", " ")
    file = "w.sto" if good is STORAGE else "w.trc"
    result = run_rules(Table(text.encode(), file)).findings
    assert [f"{finding.code} {finding.line}:{finding.column}" for finding in result] == wanted
    windows = run_rules(Table(text.replace("\n", "\r\n").encode(), file)).findings
    assert [(finding.line, finding.column) for finding in windows] == [
        (one.line, one.column) for one in result
    ]
