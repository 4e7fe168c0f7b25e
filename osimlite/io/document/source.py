"""The text of a document: its bytes, its encoding, and the line and column of every element."""

from __future__ import annotations

import codecs
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple, TypeVar

from osimlite.base.files import read_file
from osimlite.errors import OsimliteError
from osimlite.io.document.names import ATTRIBUTE
from osimlite.io.document.spans import PlainSpans, Span, find_spans

Fault = TypeVar("Fault", bound=OsimliteError)

_BLOCK = 4096
"""Characters between the places whose line is known at once."""


class Attribute(NamedTuple):
    """An attribute in the text: where the blanks before it begin, where it does, its end, and its value as written."""

    before: int
    start: int
    end: int
    value: str


class Position(NamedTuple):
    """A place in a text: 1-based line and column (in characters), and how many characters it covers."""

    line: int
    column: int
    length: int = 1


class Source:
    """The text of one document. Elements are numbered in document order from 0, the root."""

    def __init__(self, data: bytes, file: str | None = None) -> None:
        self.file = file
        self.data = data
        self.elements: int | None = None
        """The number of elements, once the parser has found the text well-formed."""
        self.remarks = True
        """Whether there may be comments other than OpenSim's own."""
        self.mixed: Sequence[int] | None = None
        """Elements in which there is text beside elements, where they have been looked for in a well-formed text."""
        self.attributes: bool | None = None
        """Whether there are attributes without a meaning, where they have been looked for in a well-formed text."""
        self._attributes: dict[int, dict[str, Attribute]] = {}
        self.moved: dict[tuple[int, str], int] = {}
        """Elements that an upgrade to the current format has moved, by the number of their owner and their new tag."""

    @cached_property
    def encoding(self) -> str:
        """The encoding of the bytes."""
        return _detect_encoding(self.data)

    @cached_property
    def text(self) -> str:
        """The characters."""
        return _decode_text(self.data, self.encoding)

    @classmethod
    def of_file(cls, path: str | Path) -> Source:
        """Read a file.

        Raises:
            MissingFileError: it is missing or cannot be read.
            SpecialFileError: it is a pipe, a device or the like, or larger than the settings allow.
        """
        return cls(read_file(path), str(path))

    @classmethod
    def of_characters(cls, text: str, file: str | None = None) -> Source:
        """The source of characters that somebody has decoded already, whatever encoding they declare.

        Args:
            text: the characters.
            file: where they are kept, if anywhere.
        """
        source = cls(text.encode("utf-8", "replace"), file)
        source.encoding, source.text = "utf-8", text
        return source

    def attributes_of(self, number: int) -> dict[str, Attribute]:
        """The attributes of an element by name."""
        if number not in self._attributes:
            span = self.spans[number]
            result = self._attributes[number] = {}
            for match in ATTRIBUTE.finditer(self.text, span.start, span.tag_end):
                before = span.start + len(self.text[span.start : match.start()].rstrip())
                value = match["quoted"][1:-1]
                result.setdefault(
                    match["name"], Attribute(before, match.start(), match.end(), value)
                )
        return self._attributes[number]

    @cached_property
    def spans(self) -> Sequence[Span]:
        """Every element in document order; of a text that is not well-formed, as far as its tags go."""
        if self.elements is not None:
            plain = PlainSpans(self.text, self.elements)
            if len(plain) == self.elements:
                return plain
        return find_spans(self.text, as_opensim=True)

    @property
    def well_formed(self) -> bool:
        """True if the text is known to be well-formed."""
        return self.elements is not None

    @cached_property
    def _starts(self) -> list[int]:
        spans = self.spans
        return spans.starts if isinstance(spans, PlainSpans) else [span.start for span in spans]

    def _tag(self, number: int) -> str:
        spans = self.spans
        return spans.tag(number) if isinstance(spans, PlainSpans) else spans[number].tag

    def children(self, number: int) -> list[int]:
        """Return the indices of the child elements of element `number`."""
        return list(self._inside(number))

    def _inside(self, number: int) -> Iterator[int]:
        if isinstance(self.spans, PlainSpans):
            yield from self.spans.inside(number)
            return
        if number >= len(self.spans):
            return  # The text ends within its tag.
        inner, end = number + 1, self.spans[number].end
        while inner < len(self._starts) and self._starts[inner] < end:
            yield inner
            # Elements are numbered as they begin: the next beside this one is the first that begins
            # behind its end.
            inner = bisect_left(self._starts, self.spans[inner].end, inner + 1)

    def child(self, number: int, tag: str) -> int | None:
        """The number of the first element `tag` directly inside element `number`, or of what it was made from."""
        result = next((child for child in self._inside(number) if self._tag(child) == tag), None)
        return self.moved.get((number, tag)) if result is None else result

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer(r"\n|\r\n?", self.text))]

    @cached_property
    def _lines_before(self) -> list[int] | None:
        """How many lines end before each block of the text; None if a carriage return alone ends some of them.

        Few places are asked for, and characters are counted much faster than all lines are listed.
        """
        text = self.text
        if "\r" in text and text.count("\r") != text.count("\r\n"):
            return None
        counts = (text.count("\n", start, start + _BLOCK) for start in range(0, len(text), _BLOCK))
        return [*accumulate(counts, initial=0)]

    def line_start(self, line: int) -> int:
        """The character offset at which a line begins."""
        before = self._lines_before
        if before is None:
            return self._line_starts[line - 1]
        # The block in which the line before ends; the first line begins at the beginning.
        block = max(0, bisect_left(before, line - 1) - 1)
        start = block * _BLOCK
        for _ in range(line - 1 - before[block]):
            start = self.text.index("\n", start) + 1
        return start

    @property
    def lines(self) -> list[str]:
        """The lines of the text without their ends."""
        return re.split(r"\n|\r\n?", self.text)

    def position(self, offset: int, length: int = 1) -> Position:
        """Return line and column of a character offset."""
        before = self._lines_before
        if before is None:
            line = bisect_right(self._line_starts, offset) - 1
            return Position(line + 1, offset - self._line_starts[line] + 1, length)
        block = min(offset // _BLOCK, len(before) - 1)
        line = before[block] + self.text.count("\n", block * _BLOCK, offset)
        return Position(line + 1, offset - self.text.rfind("\n", 0, offset), length)

    def fault(self, kind: type[Fault], message: str, place: Position) -> Fault:
        """Return an error with a position in the text."""
        return kind(message, file=self.file, line=place.line, column=place.column)

    def of_tag(self, number: int) -> Position:
        """Where the start tag of element `number` is: the ``<`` and the name.

        Of a text that breaks off in a tag, the last tag before stands for what comes after it.
        """
        if not self.spans:
            return self.position(0)
        number = min(number, len(self.spans) - 1)
        return self.position(self._starts[number], len(self._tag(number)) + 1)

    def of_text(self, number: int, word: str | None = None, nth: int = 0) -> Position:
        """Return the position of the text of element `number`, or of a word in it; without text that of the tag."""
        span = self.spans[number]
        inner = self.text[span.tag_end : span.inner_end]
        if word:
            places = [m.start() for m in re.finditer(rf"(?<!\S){re.escape(word)}(?!\S)", inner)]
            places = places or [m.start() for m in re.finditer(re.escape(word), inner)]
            if places:
                return self.position(span.tag_end + places[min(nth, len(places) - 1)], len(word))
        stripped = inner.strip()
        if not stripped or "<" in stripped:
            return self.of_tag(number)
        return self.position(span.tag_end + inner.index(stripped), len(stripped.splitlines()[0]))

    def of_attribute(self, number: int, name: str) -> Position:
        """Return the position of the value of an attribute; without the attribute that of the tag."""
        result = self.attributes_of(number).get(name)
        if result is None:
            return self.of_tag(number)
        return self.position(result.end - 1 - len(result.value), max(1, len(result.value)))


_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_DECLARED = re.compile(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)")

_BYTEWISE = re.compile(
    r"utf-?8|us-ascii|ascii|iso-?8859|latin|windows-|cp\d|mac|koi8|gb|big5|shift|euc"
)


def _detect_encoding(data: bytes) -> str:
    """The encoding of the bytes: what the mark or the declaration says, UTF-8, or cp1252 where that fails."""
    name = next((name for mark, name in _MARKS.items() if data.startswith(mark)), None)
    if name is not None and name != "utf-8-sig":
        return name
    declared = _DECLARED.match(data)
    if name is None and declared is not None:
        # A declaration that can be read byte by byte is in no encoding of two bytes a character.
        word = declared[1].decode().lower().replace("cp125", "windows-125")
        name = word if _BYTEWISE.match(word) else None
    try:
        data.decode(name or "utf-8")
    except (UnicodeError, LookupError, ValueError):
        return "cp1252"
    return name or "utf-8"


def _decode_text(data: bytes, encoding: str) -> str:
    """The text: cp1252 byte by byte where the rest is UTF-8, and a replacement character for half a character."""
    if encoding != "cp1252":
        return data.decode(encoding, "replace")
    codecs.register_error("osimlite.cp1252", _decode_windows)
    return data.decode(
        "utf-8-sig" if data.startswith(codecs.BOM_UTF8) else "utf-8", "osimlite.cp1252"
    )


def _decode_windows(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    byte = error.object[error.start : error.start + 1]
    try:
        return byte.decode("cp1252"), error.start + 1
    except UnicodeDecodeError:
        return byte.decode("latin-1"), error.start + 1
