"""The text of a document: its bytes, its encoding, and the line and column of every element."""

from __future__ import annotations

import re
from bisect import bisect_right
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


_TOKEN = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>|<!DOCTYPE[^>\[]*(?:\[.*?\])?[^>]*>|"
    r"</(?P<close>[^\s>]+)\s*>|<(?P<open>[^\s/>!?]+)(?:[^>\"']|\"[^\"]*\"|'[^']*')*?(?P<empty>/?)>",
    re.DOTALL,
)


class Source:
    """The text of one document. Elements are numbered in document order from 0, the root."""

    def __init__(self, data: bytes, file: str | None = None) -> None:
        self.file = file
        self.data = data
        self.encoding = _encoding(data)
        self.text = data.decode(self.encoding)

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
        for match in _TOKEN.finditer(self.text):
            tag = match["open"]
            if tag is not None:
                parent = open_numbers[-1] if open_numbers else -1
                spans.append(Span(tag, match.start(), match.end(), match.end(), match.end(), parent))
                if not match["empty"]:
                    open_numbers.append(len(spans) - 1)
            elif match["close"] is not None and open_numbers:
                number = open_numbers.pop()
                old = spans[number]
                spans[number] = Span(old.tag, old.start, old.tag_end, match.start(), match.end(), old.parent)
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
        """The number of the first element `tag` directly inside element `number`."""
        return next((child for child in self.children(number) if self.spans[child].tag == tag), None)

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in re.finditer(r"\n|\r\n?", self.text))]

    @property
    def lines(self) -> list[str]:
        """The lines of the text without their ends."""
        return re.split(r"\n|\r\n?", self.text)

    def position(self, offset: int, length: int = 1) -> Position:
        """Line and column of a character offset."""
        line = bisect_right(self._line_starts, offset) - 1
        return Position(line + 1, offset - self._line_starts[line] + 1, length)

    def of_tag(self, number: int) -> Position:
        """Where the start tag of element `number` is: the ``<`` and the name."""
        span = self.spans[number]
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


def _encoding(data: bytes) -> str:
    """The encoding of the bytes: what the mark or the declaration says, UTF-8, or cp1252 where that fails."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    declared = re.match(rb"\s*<\?xml[^>]*?encoding\s*=\s*[\"']([A-Za-z0-9._-]+)", data)
    name = "utf-8-sig" if data.startswith(b"\xef\xbb\xbf") else declared[1].decode() if declared else "utf-8"
    for candidate in (name, "cp1252", "latin-1"):
        try:
            data.decode(candidate)
        except (UnicodeDecodeError, LookupError):
            continue
        return candidate
    return "latin-1"
