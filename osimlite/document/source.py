"""The text of a document: its bytes, its encoding, and the line and column of every element."""

from __future__ import annotations

import codecs
import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

from osimlite.errors import MissingFileError


class Position(NamedTuple):
    """A place in a text: 1-based line and column (in characters), and how many characters it covers."""

    line: int
    column: int
    length: int = 1


@dataclass(frozen=True, slots=True)
class Span:
    """Where one element stands, as character offsets into the text.

    `start` is at ``<``, `tag_end` behind the ``>`` of the start tag, `inner_end` at ``</``, `end` behind the element;
    for an empty element all of the last three are equal. `parent` is the number of the element around it, -1 for none.
    """

    tag: str
    start: int
    tag_end: int
    inner_end: int
    end: int
    parent: int


class Markup(NamedTuple):
    """One piece of markup in a text: characters `start` to `end`.

    `kind` is ``open``, ``empty`` or ``close`` for tags, else ``comment``, ``cdata``, ``instruction`` or ``doctype``.
    """

    kind: str
    start: int
    end: int
    tag: str = ""


# No part of a tag may be given back once matched, and none goes past the next "<": the time is linear in the length
# of any text, also of one that is no XML.
_MARKUP = re.compile(
    r"<(?:(?P<special>!--|!\[CDATA\[|\?|!DOCTYPE)|/(?P<close>[^\s<>]++)\s*+>|"
    r"(?P<open>[^\s/<>!?\"']++)(?:[^<>\"'/]++|/(?!>)|\"[^\"<]*+\"|'[^'<]*+')*+(?P<empty>/?)>)"
)
_SPECIAL = {
    "!--": ("comment", "-->"),
    "![CDATA[": ("cdata", "]]>"),
    "?": ("instruction", "?>"),
    "!DOCTYPE": ("doctype", ">"),
}


def markup(text: str) -> Iterator[Markup]:
    """Yield the markup of a text in order; it ends where a comment or its like has no end."""
    place = 0
    while (match := _MARKUP.search(text, place)) is not None:
        special = match["special"]
        place = match.end()
        if special is not None:
            kind, ending = _SPECIAL[special]
            found = text.find(ending, place)
            if found < 0:
                return
            place = found + len(ending)
            yield Markup(kind, match.start(), place)
        elif match["close"] is not None:
            yield Markup("close", match.start(), place, match["close"])
        else:
            yield Markup("empty" if match["empty"] else "open", match.start(), place, match["open"])


class Source:
    """The text of one document. Elements are numbered in document order from 0, the root."""

    def __init__(self, data: bytes, file: str | None = None) -> None:
        self.file = file
        self.data = data
        self.encoding = _encoding(data)
        self.text = _decoded(data, self.encoding)
        self.moved: dict[tuple[int, str], int] = {}
        """Elements that an upgrade to the current format has moved, by the number of their owner and their new tag."""

    @classmethod
    def of_file(cls, path: str | Path) -> Source:
        """Read a file.

        Raises:
            MissingFileError: it is missing or cannot be read.
        """
        try:
            return cls(Path(path).read_bytes(), str(path))
        except OSError as error:
            reason = "no such file" if isinstance(error, FileNotFoundError) else error.strerror
            raise MissingFileError(f"cannot read the file: {reason}", file=str(path)) from None

    @cached_property
    def spans(self) -> list[Span]:
        """Every element in document order; of a text that is not well-formed, as far as its tags go."""
        spans: list[Span] = []
        open_numbers: list[int] = []
        for kind, start, end, tag in markup(self.text):
            if kind in ("open", "empty"):
                parent = open_numbers[-1] if open_numbers else -1
                spans.append(Span(tag, start, end, end, end, parent))
                if kind == "open":
                    open_numbers.append(len(spans) - 1)
            elif kind == "close" and open_numbers:
                number = open_numbers.pop()
                old = spans[number]
                spans[number] = Span(old.tag, old.start, old.tag_end, start, end, old.parent)
        return spans

    @cached_property
    def _children(self) -> dict[int, list[int]]:
        children: dict[int, list[int]] = {}
        for number, span in enumerate(self.spans):
            children.setdefault(span.parent, []).append(number)
        return children

    def children(self, number: int) -> list[int]:
        """The numbers of the elements directly inside element `number`."""
        return self._children.get(number, [])

    def child(self, number: int, tag: str) -> int | None:
        """The number of the first element `tag` directly inside element `number`, or of what it was made from."""
        found = next((child for child in self.children(number) if self.spans[child].tag == tag), None)
        return self.moved.get((number, tag)) if found is None else found

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer(r"\n|\r\n?", self.text))]

    def line_start(self, line: int) -> int:
        """The character offset at which a line begins."""
        return self._line_starts[line - 1]

    @property
    def lines(self) -> list[str]:
        """The lines of the text without their ends."""
        return re.split(r"\n|\r\n?", self.text)

    def position(self, offset: int, length: int = 1) -> Position:
        """Line and column of a character offset."""
        line = bisect_right(self._line_starts, offset) - 1
        return Position(line + 1, offset - self._line_starts[line] + 1, length)

    def of_tag(self, number: int) -> Position:
        """Where the start tag of element `number` is: the ``<`` and the name.

        Of a text that breaks off in a tag, the last tag before stands for what comes after it.
        """
        if not self.spans:
            return self.position(0)
        span = self.spans[min(number, len(self.spans) - 1)]
        return self.position(span.start, len(span.tag) + 1)

    def of_text(self, number: int, word: str | None = None, nth: int = 0) -> Position:
        """Where the text of element `number` is, or the `nth` word equal to `word` in it; the tag if it has none."""
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
        """Where the value of an attribute is; the tag if the element has no such attribute."""
        span = self.spans[number]
        head = self.text[span.start : span.tag_end]
        match = re.search(rf"\s{re.escape(name)}\s*=\s*([\"'])(.*?)\1", head, re.DOTALL)
        if match is None:
            return self.of_tag(number)
        return self.position(span.start + match.start(2), max(1, len(match[2])))


_MARKS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF32_LE: "utf-32",
    codecs.BOM_UTF32_BE: "utf-32",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}
_DECLARED = re.compile(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)")

_BYTEWISE = re.compile(r"utf-?8|us-ascii|ascii|iso-?8859|latin|windows-|cp\d|mac|koi8|gb|big5|shift|euc")


def _encoding(data: bytes) -> str:
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


def _decoded(data: bytes, encoding: str) -> str:
    """The text: cp1252 byte by byte where the rest is UTF-8, and a replacement character for half a character."""
    if encoding != "cp1252":
        return data.decode(encoding, "replace")
    codecs.register_error("osimlite.cp1252", _as_windows)
    return data.decode("utf-8-sig" if data.startswith(codecs.BOM_UTF8) else "utf-8", "osimlite.cp1252")


def _as_windows(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    byte = error.object[error.start : error.start + 1]
    try:
        return byte.decode("cp1252"), error.start + 1
    except UnicodeDecodeError:
        return byte.decode("latin-1"), error.start + 1
