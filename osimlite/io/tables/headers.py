"""The headers of tables over time: storage files (.sto, .mot) and marker files (.trc).

Whatever is wrong with a header, all that can be read of it is there; who reads the rows says what
is missing.
"""

from __future__ import annotations

import re
from itertools import islice
from typing import NamedTuple

from osimlite.errors import UnsupportedError
from osimlite.io.document.source import Position

MARKER_KEYS = (
    "DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames",
)  # fmt: skip
"""Keys in the second line of a marker file, all of which OpenSim requires in this order."""
METRES = {"m": 1.0, "mm": 0.001, "cm": 0.01, "km": 1000.0}
"""Units of markers that OpenSim knows, in metres."""
COUNTS = {"nRows": "nRows", "nr": "nRows", "datarows": "nRows"} | dict.fromkeys(
    ("nColumns", "nc", "datacolumns"), "nColumns"
)
"""Keys of counts in the header of a storage file, by what they mean."""
LONGEST_HEADER, LONGEST_LINE = 1_000_000, 4_000_000
"""Bytes in which the header of a storage file ends, and those of a line that are looked at."""

SUFFIXES = {
    "double": ("",),
    "Vec3": ("_x", "_y", "_z"),
    "UnitVec3": ("_x", "_y", "_z"),
    "Quaternion": ("_1", "_2", "_3", "_4"),
    "SpatialVec": ("_rx", "_ry", "_rz", "_tx", "_ty", "_tz"),
    **{f"Vec{size}": tuple(f"_{k + 1}" for k in range(size)) for size in (2, *range(4, 13))},
}
"""What a table may hold, and how OpenSim calls the numbers of one of these when it takes them apart."""
_SOLID = re.compile(rb"\S")
MARK = b"\xef\xbb\xbf"
_LINE = re.compile(rb"[^\n]*(?:\n|\Z)")
_END = re.compile(rb"^[ \t]*endheader[ \t]*\r?(?:\n|\Z)", re.MULTILINE)
_ANY_END = re.compile(_END.pattern, re.MULTILINE | re.IGNORECASE)
_LABELS = re.compile(rb"^[ \t]*time\b", re.MULTILINE | re.IGNORECASE)
_KEY = re.compile(r"\s*([^\s=]+)[\s=]*(.*)", re.ASCII)
_KEYS = {*COUNTS, "range", "version", "Angles", "Units"}
_WORD = re.compile(r"\S+", re.ASCII)
_BETWEEN_TABS = re.compile(r"[^\t\s][^\t]*(?<![\t\s])", re.ASCII)


def list_suffixes(kind: str, file: str | None = None) -> tuple[str, ...]:
    """The endings of the labels of one value of a kind (``DataType``).

    Raises:
        UnsupportedError: OpenSim has no such kind.
    """
    if kind.lower() == "double":
        return SUFFIXES["double"]
    if kind not in SUFFIXES:
        raise UnsupportedError(
            f"the table holds {kind}; tables hold {', '.join(SUFFIXES)}", file=file
        )
    return SUFFIXES[kind]


class Word(NamedTuple):
    """Word of a header with its position."""

    text: str
    at: Position


class Entry(NamedTuple):
    """Key of a header with its value."""

    key: Word
    value: Word


class MarkerHeader:
    """The first five lines of a marker file.

    Attributes:
        lines: their text without ends; fewer if there are no more.
        entries: what it says, by its keys.
        labels: of the markers.
        label_line: its number.
        rows: the offset behind it.
        row_line: the number of the line there.
    """

    label_line = 4

    def __init__(self, data: bytes) -> None:
        result = [match for match in islice(_LINE.finditer(data), 5) if match.end() > match.start()]
        self.lines = [
            _text(data[match.start() : min(match.end(), match.start() + LONGEST_LINE)])
            for match in result
        ]
        # Where the line of X1 Y1 Z1 is missing the rows begin with the fifth.
        self.row_line = 5 if self.lines[4:] and self.lines[4][:1].isdigit() else len(result) + 1
        self.rows = (
            result[4].start()
            if self.row_line == 5 and result[4:]
            else result[-1].end()
            if result
            else 0
        )
        keys, values = self.words(2), self.words(3)
        # Of a value that is missing nobody knows to which key it belongs.
        pairs = zip(keys, values, strict=True) if len(keys) == len(values) else ()
        self.entries = {key.text: Entry(key, value) for key, value in reversed([*pairs])}
        self.labels = self.words(4)[2:]

    def words(self, number: int) -> list[Word]:
        """Return the words of a line that have a letter; none if the line does not exist."""
        return (
            split_header(self.lines[number - 1], number, _BETWEEN_TABS)
            if len(self.lines) >= number
            else []
        )


class StorageHeader:
    """The header of a storage file, and the labels behind it.

    Attributes:
        lines: its text without ends, up to the line that ends it. end: what ends it, ``endheader``
            in whatever letters, and where; before the labels it may be nothing. entries: the first
            word of each line and the rest, by that word. labels: of all columns, with that of the
            time. label_line: the number of their line. has_tabs: whether there are tabs in it.
            rows: the offset behind it. row_line: the number of the line there.
    """

    def __init__(self, data: bytes, file: str = "") -> None:
        self._is_motion = file.lower().endswith(".mot")
        mark = len(MARK) if data.startswith(MARK) else 0
        head = data[mark:LONGEST_HEADER]
        end = _END.search(head) or _ANY_END.search(head)
        labels = None if end else _LABELS.search(head)
        stop = end or labels
        self.lines = [_text(line) for line in head[: stop.start() if stop else 0].split(b"\n")]
        number = len(self.lines)
        self.end = split_header(_text(end[0]), number)[0] if end else Word("", Position(number, 1))
        self.entries: dict[str, Entry] = {}
        for count, line in enumerate(self.lines, 1):
            match = _KEY.match(line.rstrip())
            if match:
                key, value = (_word(match, group, count) for group in (1, 2))
                self.entries[COUNTS.get(key.text, key.text)] = Entry(key, value)
        start = mark + end.end() if end else mark + labels.start() if labels else len(data)
        result = _SOLID.search(data, start)
        self.label_line = (
            number + bool(end) + (data.count(b"\n", start, result.start()) if result else 0)
        )
        start = data.rfind(b"\n", 0, result.start()) + 1 if result else len(data)
        self.rows = data.find(b"\n", start) + 1 or len(data)
        self.row_line = self.label_line + 1
        # The newer of OpenSim's readers takes a label up to a tab, the older up to a blank.
        line = _text(data[max(start, mark) : min(self.rows, start + LONGEST_LINE)])
        self.has_tabs = "\t" in line
        self.labels = split_header(
            line, self.label_line, _BETWEEN_TABS if self.is_strict and self.has_tabs else _WORD
        )

    def value(self, key: str) -> str:
        """Return the value of a key, or an empty text."""
        return self.entries[key].value.text if key in self.entries else ""

    @property
    def name(self) -> str:
        """Name of the table: the first line, or the value of the key `name`."""
        plain = (line.strip() for line in self.lines if line.strip() and "=" not in line)
        return self.value("name") or next(
            (line for line in plain if line.split()[0] not in _KEYS), ""
        )

    @property
    def form(self) -> int:
        """Version of the format; up to 1, the older of OpenSim's readers reads the file."""
        match = re.match(r"[0-9]{1,9}", self.value("version"))
        return int(match[0]) if match else 0

    @property
    def is_strict(self) -> bool:
        """True if OpenSim's newer reader reads the file: every row is a line, and NaN is a value."""
        return self.form > 1

    @property
    def kind(self) -> str:
        """Type of a cell (``DataType``); default ``double``."""
        return self.value("DataType") or "double"

    @property
    def parts(self) -> int:
        """Number of values of a cell; 1 for a type that OpenSim does not know."""
        return len(SUFFIXES.get(self.kind, ("",)))

    @property
    def in_degrees(self) -> bool:
        """True if angles are in degrees, as OpenSim reads the header."""
        said = self.value("inDegrees").lower() in ("yes", "y")
        if self.form or said:
            return said
        # Files from before there were versions are those of SIMM.
        return self._is_motion or "degrees" in self.value("Angles")


def split_header(line: str, number: int, pattern: re.Pattern[str] = _WORD) -> list[Word]:
    """Return the words of a line with its number."""
    return [_word(match, 0, number) for match in pattern.finditer(line)]


def _word(match: re.Match[str], group: int, number: int) -> Word:
    return Word(match[group], Position(number, match.start(group) + 1, max(1, len(match[group]))))


def _text(line: bytes) -> str:
    return line.decode("utf-8", "replace").rstrip("\r\n")
