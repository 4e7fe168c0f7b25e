"""Text of an open file, with conversion between offsets and the positions of editors."""

from __future__ import annotations

from bisect import bisect_right
from functools import cached_property

from lsprotocol import types

from osimlite.base.patterns import compile_later

_LINE_END = compile_later(r"\r\n?|\n")


class Text:
    """Immutable text of an open file.

    Editors count lines and characters from 0. By default a character beyond U+FFFF counts twice
    (UTF-16). Offsets count characters of Python.

    Args:
        content: characters of the text.
        unit: encoding in which the editor counts characters.
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
        """Return the offset of a position; beyond a line or the text, the offset of its end."""
        if position.line >= len(self._starts):
            return len(self.content)
        start = self._starts[position.line]
        line = self._line(position.line)
        if self._is_plain or line.isascii():
            return start + min(position.character, len(line))
        units = 0
        for index, character in enumerate(line):
            # A position inside of a surrogate pair moves to the end of the character.
            if units >= position.character:
                return start + index
            units += self._width(character)
        return start + len(line)

    def position(self, offset: int) -> types.Position:
        """Return the position (line and character from 0) of an offset."""
        line = bisect_right(self._starts, offset) - 1
        line_start = self.content[self._starts[line] : offset]
        if self._is_plain or line_start.isascii():
            return types.Position(line, len(line_start))
        return types.Position(line, sum(map(self._width, line_start)))

    def range(self, start: int, end: int) -> types.Range:
        """Return the range between two offsets.

        Args:
            start: offset of the first character.
            end: offset after the last character.
        """
        return types.Range(self.position(start), self.position(end))

    def apply_change(self, change: types.TextDocumentContentChangeEvent) -> Text:
        """Return the text after one change event, of a range or of everything."""
        if not isinstance(change, types.TextDocumentContentChangePartial):
            return Text(change.text, self.unit)
        start, end = self.offset(change.range.start), self.offset(change.range.end)
        return Text(self.content[:start] + change.text + self.content[end:], self.unit)

    def _line(self, number: int) -> str:
        """Return a line without its line ending."""
        end = self._starts[number + 1] if number + 1 < len(self._starts) else len(self.content)
        return self.content[self._starts[number] : end].rstrip("\r\n")

    def _width(self, character: str) -> int:
        if self.unit == types.PositionEncodingKind.Utf8:
            return len(character.encode("utf-8", "replace"))
        return 2 if ord(character) > 0xFFFF else 1
