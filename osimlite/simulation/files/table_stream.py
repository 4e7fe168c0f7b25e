"""Storage files (.sto, .mot) row by row: the header at once, the rows as they are asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path

from osimlite.errors import DocumentError, UnsupportedError
from osimlite.files import open_file

_SUFFIXES = {
    "double": ("",),
    "Vec3": ("_x", "_y", "_z"),
    "UnitVec3": ("_x", "_y", "_z"),
    "Quaternion": ("_1", "_2", "_3", "_4"),
    "SpatialVec": ("_rx", "_ry", "_rz", "_tx", "_ty", "_tz"),
    **{f"Vec{size}": tuple(f"_{k + 1}" for k in range(size)) for size in (2, *range(4, 13))},
}
"""What a table may hold, and how OpenSim calls the numbers of one of these when it takes them apart."""

_COUNTS = ("nColumns", "nc", "datacolumns", "nRows", "nr", "datarows", "range", "version")
"""What a line of a header may say without a sign of equality."""

_NO_NUMBER = re.compile(r"[-+]?1\.#(IND|QNAN|SNAN|INF)\d*", re.IGNORECASE)
"""How programs on Windows wrote what is no number."""


def suffixes(kind: str, file: str | None = None) -> tuple[str, ...]:
    """The endings of the labels of one value of a kind (``DataType``).

    Raises:
        UnsupportedError: OpenSim has no such kind.
    """
    if kind.lower() == "double":
        return _SUFFIXES["double"]
    if kind not in _SUFFIXES:
        raise UnsupportedError(f"the table holds {kind}; tables hold {', '.join(_SUFFIXES)}", file=file)
    return _SUFFIXES[kind]


class TableStream:
    """A storage file of which one row at a time is read; close it after use, or use it in a ``with`` statement.

    Iterating gives ``(time, row)`` with the time in s and the numbers of the columns in their order; blank lines are
    passed over.

    Attributes:
        file: its path.
        name: first line of the file.
        kind: what it holds, ``double`` as a rule.
        labels: of the columns as they are in the file, without the time.
        columns: labels of the numbers; of a Vec3 ``p`` these are ``p_x``, ``p_y`` and ``p_z``.
        in_degrees: whether rotational values are in degrees.
        line: number of the line of the file that was read last.
        text: of the row that was read last.
        header: every ``key=value`` line of the header.

    Raises:
        MissingFileError: there is no such file, or it may not be read.
        DocumentError: it is not a storage file, or a row is damaged; with line and column.
        UnsupportedError: it holds a kind that OpenSim does not know.
    """

    def __init__(self, path: str | Path) -> None:
        self.file, self.line, self.text = str(path), 0, ""
        self._stream = TextIOWrapper(open_file(path), encoding="utf-8", errors="replace")
        try:
            self._read_header()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close the file."""
        self._stream.close()

    def __enter__(self) -> TableStream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[tuple[float, list[float]]]:
        place, size = self._time, len(self.columns) + 1
        vectors = self.kind != "double"
        for number, line in enumerate(self._stream, start=self.line + 1):
            self.line, self.text = number, line
            text = line.replace(",", " ") if vectors else line
            words = text.split()
            if not words:
                continue
            try:
                row = [float(word) for word in words]
            except ValueError:
                row = self._odd(text, number)
            if len(row) != size:
                raise DocumentError(
                    f"the row has {len(row)} numbers and needs {size}",
                    file=self.file,
                    line=number,
                    column=len(line.rstrip()) + 1 if len(row) < size else start_of_word(text, size),
                )
            time = row.pop(place)
            yield time, row

    def _odd(self, text: str, number: int) -> list[float]:
        """A row that has something else than plain numbers."""
        row = []
        for match in re.finditer(r"\S+", text):
            word = match.group()
            odd = _NO_NUMBER.fullmatch(word)
            if odd:
                word = word[0].replace("1", "") + "inf" if odd.group(1).upper() == "INF" else "nan"
            try:
                row.append(float(word))
            except ValueError:
                raise DocumentError(
                    f"'{word}' is no number", file=self.file, line=number, column=match.start() + 1
                ) from None
        return row

    def _read_header(self) -> None:
        self.header: dict[str, str] = {}
        self.name = ""
        words = ""
        for number, line in enumerate(self._stream, start=1):
            text = line.strip()
            if text.lower() == "endheader":
                self.line = number
                break
            key, equals, value = (part.strip() for part in text.partition("="))
            word, _, rest = text.partition(" ")
            if equals:
                self.header[key] = value
            elif word in _COUNTS and rest:
                self.header[word] = rest.strip()
            elif text.startswith("Angles are in"):
                words = text
            elif text and not self.name:
                self.name = text.removeprefix("name ").strip()
        else:
            raise DocumentError(_no_storage(self.name), file=self.file)
        self.name = self.header.get("name", self.name)
        kind = self.header.get("DataType", "double")
        ends = suffixes(kind, self.file)
        self.kind = "double" if ends == ("",) else kind
        self.in_degrees = self._degrees(words)
        self.labels = self._read_labels()
        self.columns = tuple(label + end for label in self.labels for end in ends)

    def _degrees(self, words: str) -> bool:
        """What the header says about angles; files from before there were versions are those of SIMM."""
        version = re.match(r"\d+", self.header.get("version", "0"))
        if version is None or int(version.group()) < 1:
            if self.file.lower().endswith(".mot"):
                return True
            if words:
                return "degrees" in words
        return self.header.get("inDegrees", "no").lower() in ("yes", "y", "true")

    def _read_labels(self) -> tuple[str, ...]:
        line = ""
        for line in self._stream:
            self.line += 1
            if line.strip():
                break
        text = line.strip()
        if not text:
            raise DocumentError("the table ends before its column labels", file=self.file, line=self.line)
        labels = [label.strip() for label in text.split("\t")] if "\t" in text else text.split()
        said = next((self.header[key] for key in ("nColumns", "nc", "datacolumns") if key in self.header), "")
        if said.isdecimal() and len(labels) != int(said) == len(text.split()):
            # Some programs mix spaces and tabs.
            labels = text.split()
        at = next((place for place, label in enumerate(labels) if label.lower() == "time"), None)
        if at is None or (at > 0 and self.kind != "double"):
            raise DocumentError(
                f"the first column is '{labels[0]}'; it must be 'time'", file=self.file, line=self.line, column=1
            )
        self._time = at
        return (*labels[:at], *labels[at + 1 :])


def _no_storage(beginning: str) -> str:
    """Why a file without a line 'endheader' cannot be taken, by the first line in it."""
    if beginning.startswith("PathFileType"):
        return (
            "these are markers over time (.trc); a storage file is needed here (.sto, .mot): inverse kinematics makes "
            "coordinates of markers"
        )
    if beginning.startswith("<"):
        return "this is XML, and no storage file (.sto, .mot); are the arguments in the right order?"
    return "this is no storage file (.sto, .mot): it has no line 'endheader'"


def start_of_word(text: str, word: int) -> int:
    """Column (from 1) at which a word (from 0) of a line starts."""
    return [match.start() for match in re.finditer(r"\S+", text)][word] + 1


def stream_table(path: str | Path) -> TableStream:
    """Open a storage file to read it row by row, however large it is; errors as those of :class:`TableStream`.

    Example::

        with stream_table("grf.mot") as table:
            for time, row in table:
                ...
    """
    return TableStream(path)
