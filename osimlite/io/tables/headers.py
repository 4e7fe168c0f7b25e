"""Headers of tables over time: storage files (.sto, .mot) and marker files (.trc).

A damaged header is read as far as possible. The functions that read the rows report what is missing.
"""

from __future__ import annotations

import re
from itertools import islice

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.errors import UnsupportedError
from osimlite.io.document.source import Position

MARKER_KEYS = (
    "DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames",
)  # fmt: skip
"""Keys in the second line of a marker file; OpenSim requires all of them in this order."""
METRES_PER_UNIT = {"m": 1.0, "mm": 0.001, "cm": 0.01, "km": 1000.0}
"""Factors from the units of markers that OpenSim knows to metres."""
COUNTS = {"nRows": "nRows", "nr": "nRows", "datarows": "nRows"} | dict.fromkeys(
    ("nColumns", "nc", "datacolumns"), "nColumns"
)
"""Keys of counts in the header of a storage file, each with the key that it is an alias of."""
MAX_HEADER_BYTES = 1_000_000
"""Number of bytes that are searched for the end of a storage file's header."""
MAX_LINE_BYTES = 4_000_000
"""Number of bytes of a line that are read."""
MAX_TIME_S = 1e25
"""Time beyond which no motion lasts: the fifth power of a step, which splines need, is still finite."""

SUFFIXES = {
    "double": ("",),
    "Vec3": ("_x", "_y", "_z"),
    "UnitVec3": ("_x", "_y", "_z"),
    "Quaternion": ("_1", "_2", "_3", "_4"),
    "SpatialVec": ("_rx", "_ry", "_rz", "_tx", "_ty", "_tz"),
    **{f"Vec{size}": tuple(f"_{k + 1}" for k in range(size)) for size in (2, *range(4, 13))},
}
"""Suffixes by type of a cell (``DataType``), which OpenSim appends to labels when it splits cells."""
_SOLID = compile_later(rb"\S")
MARK = b"\xef\xbb\xbf"
"""Byte order mark of UTF-8."""
_LINE = compile_later(rb"[^\n]*(?:\n|\Z)")
_END_LINE = rb"^[ \t]*endheader[ \t]*\r?(?:\n|\Z)"
_END = compile_later(_END_LINE, re.MULTILINE)
_ANY_END = compile_later(_END_LINE, re.MULTILINE | re.IGNORECASE)
_LABELS = compile_later(rb"^[ \t]*time\b", re.MULTILINE | re.IGNORECASE)
_KEY = compile_later(r"\s*([^\s=]+)[\s=]*(.*)", re.ASCII)
_KEYS = {*COUNTS, "range", "version", "Angles", "Units"}
_WORD = compile_later(r"\S+", re.ASCII)
_BETWEEN_TABS = compile_later(r"[^\t\s][^\t]*(?<![\t\s])", re.ASCII)


def list_suffixes(kind: str, file: str | None = None) -> tuple[str, ...]:
    """Return the suffixes of the labels for one cell of a type (``DataType``).

    Args:
        kind: type of the cells.
        file: path of the file, for messages.

    Returns:
        One suffix for each number of a cell.

    Raises:
        UnsupportedError: OpenSim has no such type.
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
    """First five lines of a marker file.

    Attributes:
        lines: texts of the lines without line ends; fewer than five if the file has fewer.
        entries: entries of lines two and three, by key.
        labels: labels of the markers.
        label_line: number of the line with the labels.
        rows: byte offset of the first row.
        row_line: number of the line of the first row.
    """

    label_line = 4

    def __init__(self, data: bytes) -> None:
        result = [match for match in islice(_LINE.finditer(data), 5) if match.end() > match.start()]
        self.lines = [
            _decode_line(data[match.start() : min(match.end(), match.start() + MAX_LINE_BYTES)])
            for match in result
        ]
        # If the line of X1 Y1 Z1 is missing, the fifth line is the first row.
        self.row_line = 5 if self.lines[4:] and self.lines[4][:1].isdigit() else len(result) + 1
        self.rows = (
            result[4].start()
            if self.row_line == 5 and result[4:]
            else result[-1].end()
            if result
            else 0
        )
        keys, values = self.words(2), self.words(3)
        # If a value is missing, the others cannot be assigned to keys.
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
    """Header of a storage file, with the labels after it.

    Attributes:
        lines: texts without line ends, up to the line that ends the header.
        end: word that ends the header, ``endheader`` in any letter case, with its position; empty if
            the labels follow without it.
        entries: rest of each line by its first word.
        labels: labels of all columns, including time.
        label_line: number of the line with the labels.
        has_tabs: whether that line contains tabs.
        rows: byte offset of the first row.
        row_line: number of the line of the first row.
    """

    def __init__(self, data: bytes, file: str = "") -> None:
        self._is_motion = file.lower().endswith(".mot")
        mark = len(MARK) if data.startswith(MARK) else 0
        header = data[mark:MAX_HEADER_BYTES]
        end = _END.search(header) or _ANY_END.search(header)
        labels = None if end else _LABELS.search(header)
        stop = end or labels
        self.lines = [
            _decode_line(line) for line in header[: stop.start() if stop else 0].split(b"\n")
        ]
        number = len(self.lines)
        self.end = (
            split_header(_decode_line(end[0]), number)[0] if end else Word("", Position(number, 1))
        )
        self.entries: dict[str, Entry] = {}
        for count, line in enumerate(self.lines, 1):
            match = _KEY.match(line.rstrip())
            if match:
                key, value = (_make_word(match, group, count) for group in (1, 2))
                self.entries[COUNTS.get(key.text, key.text)] = Entry(key, value)
        start = mark + end.end() if end else mark + labels.start() if labels else len(data)
        result = _SOLID.search(data, start)
        self.label_line = (
            number + bool(end) + (data.count(b"\n", start, result.start()) if result else 0)
        )
        start = data.rfind(b"\n", 0, result.start()) + 1 if result else len(data)
        self.rows = data.find(b"\n", start) + 1 or len(data)
        self.row_line = self.label_line + 1
        # OpenSim's newer reader (version 2 and later) separates labels by tabs, the older one by
        # any blank.
        line = _decode_line(data[max(start, mark) : min(self.rows, start + MAX_LINE_BYTES)])
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
        # Vectors are read by the newer reader alone, whatever the version.
        return self.form > 1 or self.parts > 1

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
        says_degrees = self.value("inDegrees").lower() in ("yes", "y")
        if self.form or says_degrees:
            return says_degrees
        # Files without a version are in the format of SIMM, whose motions are in degrees.
        return self._is_motion or "degrees" in self.value("Angles")


def split_header(line: str, number: int, pattern: re.Pattern[str] = _WORD) -> list[Word]:
    """Return the words of a line of the header.

    Args:
        line: text of the line.
        number: number of the line.
        pattern: pattern of one word.
    """
    return [_make_word(match, 0, number) for match in pattern.finditer(line)]


def _make_word(match: re.Match[str], group: int, number: int) -> Word:
    return Word(match[group], Position(number, match.start(group) + 1, max(1, len(match[group]))))


def _decode_line(line: bytes) -> str:
    return line.decode("utf-8", "replace").rstrip("\r\n")
