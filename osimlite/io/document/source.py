"""Text of a document with its encoding, and positions of its elements."""

from __future__ import annotations

import codecs
import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import TypeVar

from osimlite.base.files import read_file
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.errors import OsimliteError
from osimlite.io.document.names import ATTRIBUTE
from osimlite.io.document.spans import PlainSpans, Span, find_spans

Fault = TypeVar("Fault", bound=OsimliteError)

_BLOCK_SIZE = 4096
"""Characters between positions whose line number is precomputed."""


class Attribute(NamedTuple):
    """Attribute in the text.

    Attributes:
        before: offset of the blanks before it.
        start: offset of its name.
        end: offset after its value.
        value: value of the attribute as written.
    """

    before: int
    start: int
    end: int
    value: str


class Position(NamedTuple):
    """Line and column in a text, both from 1 and in characters, and the number of characters covered."""

    line: int
    column: int
    length: int = 1


class Source:
    """Text of one document; its elements have indices in document order, 0 is the root.

    Args:
        data: bytes of the text.
        file: path of the file, for messages.
    """

    def __init__(self, data: bytes, file: str | None = None) -> None:
        self.file = file
        self.data = data
        self.elements: int | None = None
        """Number of elements; None until the parser has found the text well-formed."""
        self.remarks = True
        """Whether there may be comments other than OpenSim's own."""
        self.mixed: Sequence[int] | None = None
        """Elements with both text and elements in them; None if a well-formed text was not searched for them."""
        self.attributes: bool | None = None
        """Whether there are attributes without a meaning; None if a well-formed text was not searched for them."""
        self._attributes: dict[int, dict[str, Attribute]] = {}
        self.old_indices: dict[tuple[int, str], int] = {}
        """Elements that an upgrade has moved, by the index of their owner and their new tag."""

    @cached_property
    def encoding(self) -> str:
        """Return the encoding of the bytes."""
        return _detect_encoding(self.data)

    @cached_property
    def text(self) -> str:
        """Return the text decoded by its encoding."""
        return _decode_text(self.data, self.encoding)

    @classmethod
    def from_file(cls, path: str | Path) -> Source:
        """Return the source with the content of a file.

        Raises:
            MissingFileError: the file does not exist or cannot be read.
            SpecialFileError: it is a pipe or a device, or larger than the settings allow.
        """
        return cls(read_file(path), str(path))

    @classmethod
    def from_text(cls, text: str, file: str | None = None) -> Source:
        """Return the source of a decoded text; an encoding that the text declares is ignored.

        Args:
            text: decoded text of a document.
            file: path of the file, if any.
        """
        source = cls(text.encode("utf-8", "replace"), file)
        # A text in memory is decoded; its declaration may name another encoding.
        source.encoding, source.text = "utf-8", text
        return source

    def get_attributes(self, number: int) -> dict[str, Attribute]:
        """Return the attributes of an element.

        Returns:
            Attributes by name.
        """
        if number not in self._attributes:
            span = self.spans[number]
            result = self._attributes[number] = {}
            for match in ATTRIBUTE.finditer(self.text, span.start, span.tag_end):
                # The blanks before an attribute go with it when a fix removes it.
                before = span.start + len(self.text[span.start : match.start()].rstrip())
                value = match["quoted"][1:-1]
                result.setdefault(
                    match["name"], Attribute(before, match.start(), match.end(), value)
                )
        return self._attributes[number]

    @cached_property
    def spans(self) -> Sequence[Span]:
        """Return the spans of all elements in document order; of malformed text, as far as tags can be paired."""
        # Well-formed text without comments and sections takes a faster search for tags.
        if self.elements is not None:
            plain = PlainSpans(self.text, self.elements)
            if len(plain) == self.elements:
                return plain
        return find_spans(self.text, as_opensim=True)

    @property
    def well_formed(self) -> bool:
        """True if the parser has found the text well-formed."""
        return self.elements is not None

    @cached_property
    def _starts(self) -> list[int]:
        spans = self.spans
        return spans.starts if isinstance(spans, PlainSpans) else [span.start for span in spans]

    def _get_tag(self, number: int) -> str:
        spans = self.spans
        return spans.tag(number) if isinstance(spans, PlainSpans) else spans[number].tag

    def children(self, number: int) -> list[int]:
        """Return the indices of the child elements of element `number`."""
        return list(self._iterate_children(number))

    def _iterate_children(self, number: int) -> Iterator[int]:
        """Yield the indices of the child elements of element `number`, in document order."""
        if isinstance(self.spans, PlainSpans):
            yield from self.spans.inside(number)
            return
        if number >= len(self.spans):
            # The text ends within the tag of the element.
            return
        inner = number + 1
        end = self.spans[number].end
        while inner < len(self._starts) and self._starts[inner] < end:
            yield inner
            # Indices follow the order of start tags, so the next sibling is the first element that
            # starts after the end of this one.
            inner = bisect_left(self._starts, self.spans[inner].end, inner + 1)

    def child(self, number: int, tag: str) -> int | None:
        """Return the index of an element's first child with a tag, or of the element that it was upgraded from.

        Args:
            number: index of the element.
            tag: tag of the child.
        """
        result = next(
            (child for child in self._iterate_children(number) if self._get_tag(child) == tag), None
        )
        return self.old_indices.get((number, tag)) if result is None else result

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer(r"\n|\r\n?", self.text))]

    @cached_property
    def _line_counts(self) -> list[int] | None:
        """Return the number of lines that end before each block; None if some lines end with a carriage return alone.

        Only a few positions are needed, and counting line ends is much faster than listing them.
        """
        text = self.text
        # Only "\r" alone makes lines that a count of "\n" misses.
        if "\r" in text and text.count("\r") != text.count("\r\n"):
            return None
        counts = (
            text.count("\n", start, start + _BLOCK_SIZE)
            for start in range(0, len(text), _BLOCK_SIZE)
        )
        return [*accumulate(counts, initial=0)]

    def line_start(self, line: int) -> int:
        """Return the character offset of the start of a line."""
        before = self._line_counts
        if before is None:
            return self._line_starts[line - 1]
        # Start from the block in which the preceding line ends.
        block = max(0, bisect_left(before, line - 1) - 1)
        start = block * _BLOCK_SIZE
        for _ in range(line - 1 - before[block]):
            start = self.text.index("\n", start) + 1
        return start

    @property
    def lines(self) -> list[str]:
        """The lines of the text without their ends."""
        return re.split(r"\n|\r\n?", self.text)

    def position(self, offset: int, length: int = 1) -> Position:
        """Return line and column of a character offset.

        Args:
            offset: character offset in the text.
            length: number of characters that the position covers.
        """
        before = self._line_counts
        if before is None:
            line = bisect_right(self._line_starts, offset) - 1
            return Position(line + 1, offset - self._line_starts[line] + 1, length)
        block = min(offset // _BLOCK_SIZE, len(before) - 1)
        line = before[block] + self.text.count("\n", block * _BLOCK_SIZE, offset)
        return Position(line + 1, offset - self.text.rfind("\n", 0, offset), length)

    def fault(self, kind: type[Fault], message: str, position: Position) -> Fault:
        """Return an error with a position in the text.

        Args:
            kind: class of the error.
            message: message of the error.
            position: line and column of the error.
        """
        return kind(message, file=self.file, line=position.line, column=position.column)

    def locate_tag(self, number: int) -> Position:
        """Return the position of an element's start tag: its ``<`` and name.

        If the text ends within a tag, later indices have the position of the last tag.
        """
        if not self.spans:
            return self.position(0)
        # Text that ends within a tag has indices beyond the last span.
        number = min(number, len(self.spans) - 1)
        return self.position(self._starts[number], len(self._get_tag(number)) + 1)

    def locate_text(self, number: int, word: str | None = None, nth: int = 0) -> Position:
        """Return the position of an element's text or of a word in it; without text, that of the tag.

        Args:
            number: index of the element.
            word: word in the text of the element; by default the complete text.
            nth: index of the occurrence of the word, from 0.
        """
        span = self.spans[number]
        inner_text = self.text[span.tag_end : span.inner_end]
        if word:
            # The word must be delimited by white space, so that "1" does not match in "10".
            offsets = [
                match.start()
                for match in re.finditer(rf"(?<!\S){re.escape(word)}(?!\S)", inner_text)
            ]
            # The word may be a part of a longer one, such as a number before a comma.
            offsets = offsets or [
                match.start() for match in re.finditer(re.escape(word), inner_text)
            ]
            if offsets:
                return self.position(span.tag_end + offsets[min(nth, len(offsets) - 1)], len(word))
        stripped = inner_text.strip()
        if not stripped or "<" in stripped:
            return self.locate_tag(number)
        return self.position(
            span.tag_end + inner_text.index(stripped), len(stripped.splitlines()[0])
        )

    def locate_attribute(self, number: int, name: str) -> Position:
        """Return the position of the value of an attribute; without the attribute, that of the tag.

        Args:
            number: index of the element.
            name: name of the attribute.
        """
        result = self.get_attributes(number).get(name)
        if result is None:
            return self.locate_tag(number)
        # The quote before the end is not a part of the value.
        return self.position(result.end - 1 - len(result.value), max(1, len(result.value)))


_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_DECLARED = compile_later(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)")

_BYTEWISE = compile_later(
    r"utf-?8|us-ascii|ascii|iso-?8859|latin|windows-|cp\d|mac|koi8|gb|big5|shift|euc"
)


def _detect_encoding(data: bytes) -> str:
    """Return the encoding by the byte order mark, then the declaration, then UTF-8; cp1252 if that fails."""
    name = next((name for mark, name in _MARKS.items() if data.startswith(mark)), None)
    if name is not None and name != "utf-8-sig":
        return name
    declared = _DECLARED.match(data)
    if name is None and declared is not None:
        # A declaration that was found byte by byte cannot be in an encoding of two bytes.
        # Python has no codec "cp1252" by the name "windows1252" of some programs.
        word = declared[1].decode().lower().replace("cp125", "windows-125")
        name = word if _BYTEWISE.match(word) else None
    try:
        data.decode(name or "utf-8")
    except (UnicodeError, LookupError, ValueError):
        # Bytes that are no UTF-8 were nearly always written by Windows programs.
        return "cp1252"
    return name or "utf-8"


def _decode_text(data: bytes, encoding: str) -> str:
    """Return decoded bytes; with cp1252, bytes that are not valid UTF-8 are decoded one by one."""
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
    # A few bytes have no character in cp1252; each byte has one in latin-1.
    except UnicodeDecodeError:
        return byte.decode("latin-1"), error.start + 1
