"""Positions of markup and elements in a text, found without a parser."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import overload

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later


class Span(NamedTuple):
    """Character offsets of one element.

    Attributes:
        tag: tag of the element.
        start: offset of ``<``.
        tag_end: offset after the start tag.
        inner_end: offset of ``</``.
        end: offset after the element; for an empty element all three ends are equal.
    """

    tag: str
    start: int
    tag_end: int
    inner_end: int
    end: int


class Markup(NamedTuple):
    """Piece of markup in a text.

    Attributes:
        kind: ``open``, ``empty`` or ``close`` for tags, else ``comment``, ``cdata``, ``instruction`` or
            ``doctype``.
        start: offset of its first character.
        end: offset after it.
        tag: tag, for tags.
    """

    kind: str
    start: int
    end: int
    tag: str = ""


# Possessive quantifiers, and no match beyond the next "<": the time is linear in the length of any
# text, also of one that is not XML. The group has none, because Python before 3.11.5 matches
# possessive groups wrongly (CPython issue 106052); its alternatives begin with different characters.
_MARKUP = compile_later(
    r"<(?:(?P<special>!--|!\[CDATA\[|\?|!DOCTYPE)|/(?P<close>[^\s<>]++)\s*+>|"
    r"(?P<open>[^\s/<>!?\"']++)(?:[^<>\"'/]++|/(?!>)|\"[^\"<]*+\"|'[^'<]*+')*(?P<empty>/?)>)"
)
_NAME = compile_later(r"[^\s/<>!?\"'&]++")
_SPECIAL = {
    "!--": ("comment", "-->"),
    "![CDATA[": ("cdata", "]]>"),
    "?": ("instruction", "?>"),
    "!DOCTYPE": ("doctype", ">"),
}


_INSTRUCTION_END = {False: "?>", True: ">"}
"""End of a processing instruction, by whether the text is read as OpenSim does."""


def find_markup(text: str, *, as_opensim: bool = False) -> Iterator[Markup]:
    """Yield the markup of a text in order; stop at a comment, section or instruction without an end.

    Args:
        text: text of a document.
        as_opensim: whether instructions end at the first ``>`` as in OpenSim, and not at ``?>`` as
            in XML.
    """
    offset = 0
    while (match := _MARKUP.search(text, offset)) is not None:
        special = match["special"]
        offset = match.end()
        if special is not None:
            kind, ending = _SPECIAL[special]
            if special == "?":
                ending = _INSTRUCTION_END[as_opensim]
            result = text.find(ending, offset)
            if result < 0:
                return
            offset = result + len(ending)
            yield Markup(kind, match.start(), offset)
        elif match["close"] is not None:
            yield Markup("close", match.start(), offset, match["close"])
        else:
            yield Markup(
                "empty" if match["empty"] else "open", match.start(), offset, match["open"]
            )


_REMARK = compile_later(r"<(?P<special>!--|!\[CDATA\[|\?|!DOCTYPE)")


def blank_comments(text: str, character: str = " ") -> str:
    """Replace every character of comments, CDATA sections, instructions and DOCTYPEs by another.

    Those without an end stay. An ending that was not found once is not searched again, so the time
    is linear; a pattern such as ``<!--.*?-->`` would search the rest of the text for each open
    comment.

    Args:
        text: text of a document.
        character: character that replaces each of them.

    Returns:
        Text in which all other characters have their old offsets.
    """
    pieces: list[str] = []
    missing_endings: set[str] = set()
    offset = 0
    for match in _REMARK.finditer(text):
        start = match.start()
        ending = _SPECIAL[match["special"]][1]
        if start < offset or ending in missing_endings:
            continue
        closing = text.find(ending, match.end())
        if closing < 0:
            missing_endings.add(ending)
            continue
        end = closing + len(ending)
        pieces += [text[offset:start], character * (end - start)]
        offset = end
    pieces.append(text[offset:])
    return "".join(pieces)


def find_spans(text: str, *, as_opensim: bool = False) -> list[Span]:
    """Return the spans of all elements of a text in document order, by the rules of :func:`find_markup`.

    An element without a closing tag is treated as empty; a closing tag without an element is ignored.

    Args:
        text: text of a document.
        as_opensim: whether instructions end at the first ``>``.
    """
    tags: list[str] = []
    starts: list[int] = []
    tag_ends: list[int] = []
    inner_ends: list[int] = []
    ends: list[int] = []
    open_numbers: list[int] = []
    behind = 0
    for match in _MARKUP.finditer(text):
        start, end = match.span()
        if start < behind:
            # Inside a comment, section or instruction. The match has no second "<", so it hides
            # nothing after its end.
            continue
        if match["close"] is not None:
            if open_numbers:
                number = open_numbers.pop()
                inner_ends[number], ends[number] = start, end
        elif match["special"] is None:
            if not match["empty"]:
                open_numbers.append(len(tags))
            tags.append(match["open"])
            starts.append(start)
            tag_ends.append(end)
            inner_ends.append(end)
            ends.append(end)
        else:
            ending = (
                _INSTRUCTION_END[as_opensim]
                if match["special"] == "?"
                else _SPECIAL[match["special"]][1]
            )
            result = text.find(ending, end)
            if result < 0:
                break
            behind = result + len(ending)
    return [*map(Span._make, zip(tags, starts, tag_ends, inner_ends, ends, strict=True))]


_BEGIN = compile_later(r"<[^/!?]")

# Slower pattern for texts whose comments or sections contain what looks like a tag.
_BEGIN_OR_HIDDEN = compile_later(r"<[^/!?]|<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>", re.DOTALL)


class PlainSpans(Sequence[Span]):
    """Spans of a well-formed text, each computed on first access.

    A single position in a long text then does not need the spans of all elements.

    Args:
        text: text of a document.
        elements: number of elements in the text, from the parser.
    """

    def __init__(self, text: str, elements: int) -> None:
        self.text = text
        self.starts = [match.start() for match in _BEGIN.finditer(text)]
        if len(self.starts) != elements:
            result = ((match.start(), match.end()) for match in _BEGIN_OR_HIDDEN.finditer(text))
            self.starts = [start for start, end in result if end == start + 2]
        self._cached_spans: dict[int, Span] = {}

    def __len__(self) -> int:
        return len(self.starts)

    @overload
    def __getitem__(self, number: int) -> Span: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Span]: ...
    def __getitem__(self, number: int | slice) -> Span | Sequence[Span]:
        if isinstance(number, slice):
            return [self[index] for index in range(*number.indices(len(self)))]
        span = self._cached_spans.get(number)
        if span is None:
            span = self._cached_spans[number] = self._find_span(number)
        return span

    def tag(self, number: int) -> str:
        """Return the tag of an element without searching its end, which may be far away."""
        name = _NAME.match(self.text, self.starts[number] + 1)
        assert name is not None
        return name[0]

    def inside(self, number: int) -> Iterator[int]:
        """Yield the indices of the child elements without searching the element's own end."""
        child = number + 1
        opening = self._match_start_tag(number)
        offset = opening.end()
        while not opening["empty"]:
            offset = self._find_next_tag(offset)
            if self.text[offset + 1] == "/":
                return
            yield child
            offset, child = self._find_end(child)

    def _find_end(self, number: int) -> tuple[int, int]:
        """Return the offset after an element, and the index of the first element that starts there or later."""
        opening = self._match_start_tag(number)
        end = opening.end()
        if opening["empty"]:
            return end, number + 1
        tag = self._find_next_tag(end)
        if self.text[tag + 1] == "/":
            return self.text.index(">", tag) + 1, number + 1
        end = self[number].end
        return end, bisect_left(self.starts, end, number + 1)

    def _match_start_tag(self, number: int) -> re.Match[str]:
        match = _MARKUP.match(self.text, self.starts[number])
        assert match is not None
        return match

    def _find_next_tag(self, offset: int) -> int:
        """Return the offset of the next tag after comments, CDATA sections and instructions."""
        text = self.text
        offset = text.index("<", offset)
        while text[offset + 1] in "!?":
            ending = (
                "-->"
                if text.startswith("<!--", offset)
                else "]]>"
                if text[offset + 1] == "!"
                else "?>"
            )
            offset = text.index("<", text.index(ending, offset + 2))
        return offset

    def _find_span(self, number: int) -> Span:
        match = self._match_start_tag(number)
        start = match.start()
        tag = match["open"]
        tag_end = match.end()
        if match["empty"]:
            return Span(tag, start, tag_end, tag_end, tag_end)
        close = self.text.rfind(f"</{tag}") if number == 0 else -1
        # Usually the closing tag of the root is the last in the text. A comment after it could
        # contain what looks like one.
        if close < 0 or "".join(self.text[close:].split()) != f"</{tag}>":
            close = self._find_closing_tag(tag, tag_end)
        return Span(tag, start, tag_end, close, self.text.index(">", close) + 1)

    def _is_outside_comments(self, offset: int, start: int) -> bool:
        """Return whether an offset is certainly not in a comment or section that starts at `start` or later."""
        text = self.text
        # Searching a rare character is many times faster than searching "<".
        if text.find("![", start, offset) >= 0 or text.find("?", start, offset) >= 0:
            return False
        if text.find("!", start, offset) < 0:
            return True
        comment = text.rfind("<!--", start, offset)
        return comment < 0 or text.find("-->", comment, offset) >= 0

    def _find_closing_tag(self, tag: str, offset: int) -> int:
        """Return the offset of the closing tag of an element whose content starts at `offset`.

        Raises:
            AssertionError: the text is not well-formed, because the element has no closing tag.
        """
        close = self.text.find("<", offset)
        if self.text[close + 1] == "/":
            return close
        first_close = self.text.index(f"</{tag}", close)
        is_its = self.text[first_close + len(tag) + 2] in "> \t\r\n"
        if (
            is_its
            and self.text.find(f"<{tag}", close, first_close) < 0
            and self._is_outside_comments(first_close, close)
        ):
            # The usual case: nothing before the first closing tag nests or hides one.
            return first_close
        depth = 1
        name = re.escape(tag)
        tag_pattern = re.compile(
            rf"<(?:/{name}\s*>|{name}(?![^\s/>])(?:[^<>\"']|\"[^\"]*\"|'[^']*')*>|"
            r"!--.*?-->|!\[CDATA\[.*?\]\]>|\?.*?\?>)",
            re.DOTALL,
        )
        for match in tag_pattern.finditer(self.text, close):
            if match[0][1] == "/":
                depth -= 1
                if not depth:
                    return match.start()
            elif match[0][1] not in "!?" and match[0][-2] != "/":
                depth += 1
        raise AssertionError(f"the text is not well-formed: <{tag}> has no end")
