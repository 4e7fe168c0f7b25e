"""The text of an open file, and places in it as editors count them."""

from __future__ import annotations

import re
from bisect import bisect_right
from functools import cached_property

from lsprotocol import types

_LINE_END = re.compile(r"\r\n?|\n")


class Text:
    """An unchanging text. A change makes another.

    Editors count lines and characters from 0, a character beyond U+FFFF twice unless they agreed on
    something else; offsets are ours, in characters of Python.

    Args:
        content: the characters.
        unit: how the editor counts.
    """

    def __init__(self, content: str, unit: str = types.PositionEncodingKind.Utf16) -> None:
        self.content = content
        self.unit = unit

    @cached_property
    def _starts(self) -> list[int]:
        return [0, *(match.end() for match in _LINE_END.finditer(self.content))]

    @cached_property
    def _is_plain(self) -> bool:
        return self.content.isascii() or self.unit == types.PositionEncodingKind.Utf32

    def offset(self, position: types.Position) -> int:
        """The offset of a place; one behind the end of a line or of the text is at that end."""
        if position.line >= len(self._starts):
            return len(self.content)
        start = self._starts[position.line]
        line = self._line(position.line)
        if self._is_plain or line.isascii():
            return start + min(position.character, len(line))
        units = 0
        for index, character in enumerate(line):
            if units >= position.character:
                return start + index
            units += self._width(character)
        return start + len(line)

    def position(self, offset: int) -> types.Position:
        """The place of an offset."""
        line = bisect_right(self._starts, offset) - 1
        before = self.content[self._starts[line] : offset]
        if self._is_plain or before.isascii():
            return types.Position(line, len(before))
        return types.Position(line, sum(map(self._width, before)))

    def range(self, start: int, end: int) -> types.Range:
        """The range between two offsets."""
        return types.Range(self.position(start), self.position(end))

    def apply_change(self, change: types.TextDocumentContentChangeEvent) -> Text:
        """The text after a change of a part of it, or of the whole."""
        if not isinstance(change, types.TextDocumentContentChangePartial):
            return Text(change.text, self.unit)
        start, end = self.offset(change.range.start), self.offset(change.range.end)
        return Text(self.content[:start] + change.text + self.content[end:], self.unit)

    def _line(self, number: int) -> str:
        """A line without its end."""
        end = self._starts[number + 1] if number + 1 < len(self._starts) else len(self.content)
        return self.content[self._starts[number] : end].rstrip("\r\n")

    def _width(self, character: str) -> int:
        if self.unit == types.PositionEncodingKind.Utf8:
            return len(character.encode("utf-8", "replace"))
        return 2 if ord(character) > 0xFFFF else 1
