"""A table under check (.sto, .mot, .trc): its header, its labels, and its rows."""

from __future__ import annotations

import re
from functools import cached_property
from itertools import pairwise
from statistics import median
from typing import ClassVar, NamedTuple

from osimlite.document.source import Position
from osimlite.lint.checked import Checked
from osimlite.lint.config import Config
from osimlite.lint.diagnostic import Edit, Fix
from osimlite.lint.rows import Rows, Scan
from osimlite.lint.suppressions import Suppression, suppressions_in_header

MARKER_KEYS = (
    "DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames",
)  # fmt: skip
"""The keys in the second line of a marker file, all of which OpenSim asks for, in this order."""
METRES = {"m": 1.0, "mm": 0.001, "cm": 0.01, "km": 1000.0}
"""The units of markers that OpenSim knows, in metres."""
COUNTS = {"nRows": "nRows", "nr": "nRows", "datarows": "nRows"} | dict.fromkeys(
    ("nColumns", "nc", "datacolumns"), "nColumns"
)
"""Keys of counts in the header of a storage file, by what they mean."""

_PARTS = {"double": 1, "UnitVec3": 3, "Quaternion": 4, "SpatialVec": 6} | {f"Vec{n}": n for n in range(2, 13)}
_END = re.compile(rb"^[ \t]*endheader[ \t]*\r?(\n|\Z)", re.MULTILINE)
_ANY_END = re.compile(rb"^[ \t]*endheader[ \t]*\r?(\n|\Z)", re.MULTILINE | re.IGNORECASE)
_LABELS = re.compile(rb"^[ \t]*time\b.*$", re.MULTILINE | re.IGNORECASE)
_MARK = b"\xef\xbb\xbf"


class Word(NamedTuple):
    """A word of a header, and where it is."""

    text: str
    at: Position


class Entry(NamedTuple):
    """A key of a header with its value."""

    key: Word
    value: Word


class Table(Checked):
    """A table. Whatever is wrong with its text, all that can be read of it is there.

    Args:
        data: the bytes.
        file: its path.
        config: which rules run.
    """

    about: ClassVar[str] = "table"

    def __init__(self, data: bytes, file: str, config: Config | None = None) -> None:
        super().__init__(config)
        self._data = data
        self._file = file
        self.is_markers = file.lower().endswith(".trc")

    @property
    def data(self) -> bytes:
        """Its bytes."""
        return self._data

    @property
    def file(self) -> str:
        """The file that is checked."""
        return self._file

    @property
    def text(self) -> str:
        """Its text, for those who show lines of it."""
        return self.data.decode("utf-8", "replace")

    @cached_property
    def head(self) -> list[bytes]:
        """The lines of the header without their ends, the mark of UTF-8 taken off."""
        data = self.data.removeprefix(_MARK)
        if self.is_markers:
            return [line.removesuffix(b"\r") for line in data.split(b"\n", 5)[:5]]
        end = self._end
        return [line.removesuffix(b"\r") for line in data[: end.start() if end else 0].split(b"\n")]

    @cached_property
    def _end(self) -> re.Match[bytes] | None:
        """Where the header ends; as written otherwise, or before the labels, if it does not end as it must."""
        data = self.data.removeprefix(_MARK)
        return _END.search(data) or _ANY_END.search(data) or _LABELS.search(data, 0, 100_000)

    @property
    def ends_header(self) -> bool:
        """Whether there is a line that ends the header, as OpenSim looks for it."""
        return self._end is not None and b"endheader" in self._end[0]

    @property
    def ends_header_otherwise(self) -> bool:
        """Whether there is one in other letters."""
        return not self.ends_header and self._end is not None and self._end[0].strip().lower() == b"endheader"

    @property
    def end_line(self) -> Position:
        """Where the header ends, or the beginning of the file."""
        end = self._end
        return Position(1, 1) if end is None else self.place(len(self.head), end[0].rstrip(), 0, len(end[0].strip()))

    @cached_property
    def entries(self) -> dict[str, Entry]:
        """What the header says, by its keys."""
        found: dict[str, Entry] = {}
        if self.is_markers:
            keys, values = (self.words(number) if len(self.head) >= number else [] for number in (2, 3))
            # Of a value that is missing nobody knows to which key it belongs.
            for key, value in zip(keys, values, strict=False) if len(keys) == len(values) else ():
                found.setdefault(key.text, Entry(key, value))
            return found
        for number, line in enumerate(self.head, 1):
            match = re.match(rb"\s*([^\s=]+)[\s=]*(.*?)\s*$", line)
            if match:
                key, value = (
                    Word(match[group].decode("utf-8", "replace"), self.place(number, line, *match.span(group)))
                    for group in (1, 2)
                )
                found[COUNTS.get(key.text, key.text)] = Entry(key, value)
        return found

    def words(self, number: int) -> list[Word]:
        """The words of a line of a marker file, those without a letter left out."""
        line = self.head[number - 1]
        return [
            Word(match[0].strip().decode("utf-8", "replace"), self.place(number, line, *_stripped(match)))
            for match in re.finditer(rb"[^\t]+", line)
            if match[0].strip()
        ]

    @cached_property
    def form(self) -> int:
        """The version of a storage file: up to 1 it is read by the older of OpenSim's readers."""
        match = re.match(r"\d+", self.entries["version"].value.text) if "version" in self.entries else None
        return int(match[0]) if match else 0

    @property
    def is_strict(self) -> bool:
        """Whether OpenSim's newer reader of storage files takes it: every row is a line, and NaN is a value."""
        return self.form > 1

    @cached_property
    def parts(self) -> int:
        """How many numbers a cell of a storage file has."""
        entry = self.entries.get("DataType")
        return 1 if entry is None else _PARTS.get(entry.value.text, 1)

    @cached_property
    def _labels_at(self) -> tuple[int, int, int]:
        """Where the line of labels starts, where it ends, and its number."""
        data = self.data
        mark = len(_MARK) if data.startswith(_MARK) else 0
        end = self._end
        if end is None:
            return len(data), len(data), 1
        start, number = (end.end() if b"endheader" in end[0].lower() else end.start()) + mark, len(self.head)
        number += b"endheader" in end[0].lower()
        match = re.compile(rb"[^\n]*\S[^\n]*").search(data, start)
        if match is None:
            return len(data), len(data), number
        return match.start(), match.end(), number + data.count(b"\n", start, match.start())

    @property
    def label_line(self) -> int:
        """The line of the labels."""
        return 4 if self.is_markers else self._labels_at[2]

    @cached_property
    def labels(self) -> list[Word]:
        """The labels of the columns with that of the time; of a marker file of the markers alone."""
        if self.is_markers:
            return self.words(4)[2:] if len(self.head) >= 4 else []
        start, end, number = self._labels_at
        line = self.data[start:end].removesuffix(b"\r")
        # The newer reader takes a label up to a tab, the older up to a blank.
        pattern = rb"[^\t]+" if self.is_strict and b"\t" in line else rb"\S+"
        return [
            Word(match[0].strip().decode("utf-8", "replace"), self.place(number, line, *_stripped(match)))
            for match in re.finditer(pattern, line)
            if match[0].strip()
        ]

    @property
    def columns(self) -> list[str]:
        """The labels without that of the time."""
        return [label.text for label in (self.labels if self.is_markers else self.labels[1:])]

    @cached_property
    def rows(self) -> Rows:
        """The rows."""
        if self.is_markers:
            data = self.data
            start = 0
            for _ in range(5):
                start = data.find(b"\n", start) + 1 or len(data)
            if len(self.head) >= 5 and self.head[4][:1].isdigit():
                # The line of X1 Y1 Z1 is missing.
                start -= len(self.head[4]) + 1
            return Scan(len(self.labels) * 3 + 2, markers=True).run(data, start, data.count(b"\n", 0, start) + 1)
        _, end, number = self._labels_at
        if not self.labels or "," in self.labels[0].text:
            return Rows()
        # Where labels are missing or too many, the first row says how many cells a row has.
        following = re.compile(rb"\n\s*([^\n]+)").match(self.data, end)
        cells = len(following[1].split()) if following else len(self.labels)
        said = self.entries["nColumns"].value.text if "nColumns" in self.entries else ""
        cells = cells if str(cells) == said else len(self.labels)
        return Scan(cells, self.parts).run(self.data, min(end + 1, len(self.data)), number + 1)

    @property
    def span(self) -> tuple[float, float] | None:
        """The first and the last time, None without rows."""
        times = self.rows.times
        return (times[0], times[-1]) if times else None

    @cached_property
    def step(self) -> float:
        """The usual step from one time to the next, s; 0 of fewer than two rows."""
        times = self.rows.times
        return median(after - before for before, after in pairwise(times)) if len(times) > 1 else 0

    def suppressions(self) -> list[Suppression]:
        """The lines of the header that ignore findings; a marker file cannot have any."""
        return [] if self.is_markers else suppressions_in_header(self.head)

    def replacing(self, at: Position, named: object, text: str, *, certain: bool) -> Fix | None:
        """The mend that puts a text in a place of the header, or among the labels; None where nobody knows the bytes.

        `named` is what stands there, or None for whatever does.
        """
        start = self.line_start(at.line)
        line = self.data[start : self.line_start(2, start)].rstrip(b"\r\n")
        if start == 0 and line.startswith(_MARK):
            start, line = len(_MARK), line.removeprefix(_MARK)
        try:
            letters = line.decode()
        except UnicodeDecodeError:
            return None
        before, old = letters[: at.column - 1], letters[at.column - 1 :][: at.length]
        start += len(before.encode())
        safe = certain or text.lower() == old.lower()
        return Fix((Edit(start, start + len(old.encode()), text),), safe)

    def inserting(self, number: int, line: str) -> Fix:
        """The mend that puts a line before another."""
        start = self.line_start(number)
        return Fix((Edit(start, start, line + ("\r\n" if b"\r\n" in self.data[:1000] else "\n")),))

    def line_start(self, number: int, start: int = 0) -> int:
        """Where a line begins, in bytes, as they are counted from the one that begins at `start`."""
        for _ in range(number - 1):
            start = self.data.find(b"\n", start) + 1 or len(self.data)
        return start

    def place(self, number: int, line: bytes, start: int, end: int) -> Position:
        """The place of some bytes of a line."""
        before = len(line[:start].decode("utf-8", "replace"))
        return Position(number, before + 1, max(1, len(line[start:end].decode("utf-8", "replace"))))


def _stripped(match: re.Match[bytes]) -> tuple[int, int]:
    """Where the text of a match starts and ends without blanks around it."""
    start = match.start() + len(match[0]) - len(match[0].lstrip())
    return start, start + len(match[0].strip())
