"""Where the elements of a text stand."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from typing import NamedTuple, overload


class Span(NamedTuple):
    """Where one element stands, as character offsets into the text.

    `start` is at ``<``, `tag_end` behind the ``>`` of the start tag, `inner_end` at ``</``, `end`
    behind the element; for an empty element all of the last three are equal.
    """

    tag: str
    start: int
    tag_end: int
    inner_end: int
    end: int


class Markup(NamedTuple):
    """One piece of markup in a text: characters `start` to `end`.

    `kind` is ``open``, ``empty`` or ``close`` for tags, else ``comment``, ``cdata``,
    ``instruction`` or ``doctype``.
    """

    kind: str
    start: int
    end: int
    tag: str = ""


# No part of a tag may be given back once matched, and none goes past the next "<": the time is
# linear in the length of any text, also of one that is no XML.
_MARKUP = re.compile(
    r"<(?:(?P<special>!--|!\[CDATA\[|\?|!DOCTYPE)|/(?P<close>[^\s<>]++)\s*+>|"
    r"(?P<open>[^\s/<>!?\"']++)(?:[^<>\"'/]++|/(?!>)|\"[^\"<]*+\"|'[^'<]*+')*+(?P<empty>/?)>)"
)
_NAME = re.compile(r"[^\s/<>!?\"'&]++")
_SPECIAL = {
    "!--": ("comment", "-->"),
    "![CDATA[": ("cdata", "]]>"),
    "?": ("instruction", "?>"),
    "!DOCTYPE": ("doctype", ">"),
}


_INSTRUCTION_END = {False: "?>", True: ">"}
"""What ends an instruction, by whether the text is read as OpenSim reads it."""


def find_markup(text: str, *, as_opensim: bool = False) -> Iterator[Markup]:
    """Yield the markup of a text in order; it ends where a comment or its like has no end.

    Args:
        text: the text.
        as_opensim: whether an instruction ends at its first ``>``, as it does for OpenSim, and not
            at ``?>``, as it does for XML.
    """
    place = 0
    while (match := _MARKUP.search(text, place)) is not None:
        special = match["special"]
        place = match.end()
        if special is not None:
            kind, ending = _SPECIAL[special]
            if special == "?":
                ending = _INSTRUCTION_END[as_opensim]
            result = text.find(ending, place)
            if result < 0:
                return
            place = result + len(ending)
            yield Markup(kind, match.start(), place)
        elif match["close"] is not None:
            yield Markup("close", match.start(), place, match["close"])
        else:
            yield Markup("empty" if match["empty"] else "open", match.start(), place, match["open"])


_REMARK = re.compile(r"<(?P<special>!--|!\[CDATA\[|\?|!DOCTYPE)")


def blank_comments(text: str, character: str = " ") -> str:
    """Return a text in which each comment, CDATA section, instruction and DOCTYPE is one character as often.

    One that has no end stays as it is. An ending that was not found once is not looked for again,
    so that the time is linear in the length of any text: a pattern such as `<!--.*?-->` looks for
    the end of each of many open comments through all that follows.
    """
    pieces: list[str] = []
    missing: set[str] = set()
    place = 0
    for match in _REMARK.finditer(text):
        start = match.start()
        ending = _SPECIAL[match["special"]][1]
        if start < place or ending in missing:
            continue
        found = text.find(ending, match.end())
        if found < 0:
            missing.add(ending)
            continue
        end = found + len(ending)
        pieces += [text[place:start], character * (end - start)]
        place = end
    pieces.append(text[place:])
    return "".join(pieces)


def find_spans(text: str, *, as_opensim: bool = False) -> list[Span]:
    """Every element of a text in document order, found by the rules of :func:`find_markup`.

    An element that nothing ends is taken to be empty; an end that nothing began is passed over.

    Args:
        text: the text.
        as_opensim: whether an instruction ends at its first ``>``.
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
            # Inside a comment or its like; the match holds no second "<", and so hides nothing
            # behind its end.
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


_BEGIN = re.compile(r"<[^/!?]")

# The same where comments and their like may hold what looks like a tag.
_BEGIN_OR_HIDDEN = re.compile(r"<[^/!?]|<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>", re.DOTALL)


class PlainSpans(Sequence[Span]):
    """The spans of a well-formed text; made as they are asked for.

    Whoever wants to know of one place in a long text need not wait for all the others.
    """

    def __init__(self, text: str, elements: int) -> None:
        self.text = text
        self.starts = [match.start() for match in _BEGIN.finditer(text)]
        if len(self.starts) != elements:
            result = ((match.start(), match.end()) for match in _BEGIN_OR_HIDDEN.finditer(text))
            self.starts = [start for start, end in result if end == start + 2]
        self._known: dict[int, Span] = {}

    def __len__(self) -> int:
        return len(self.starts)

    @overload
    def __getitem__(self, number: int) -> Span: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Span]: ...
    def __getitem__(self, number: int | slice) -> Span | Sequence[Span]:
        if isinstance(number, slice):
            return [self[index] for index in range(*number.indices(len(self)))]
        known = self._known.get(number)
        if known is None:
            known = self._known[number] = self._span(number)
        return known

    def tag(self, number: int) -> str:
        """The tag of an element; its end, which may be far away, is not looked for."""
        name = _NAME.match(self.text, self.starts[number] + 1)
        assert name is not None
        return name[0]

    def inside(self, number: int) -> Iterator[int]:
        """Yield the numbers of the elements directly inside an element; its own end is not looked for."""
        inner = number + 1
        opening = self._opening(number)
        place = opening.end()
        while not opening["empty"]:
            place = self._next_tag(place)
            if self.text[place + 1] == "/":
                return
            yield inner
            place, inner = self._behind(inner)

    def _behind(self, number: int) -> tuple[int, int]:
        """The place behind an element, and the number of the first element that begins there or later."""
        opening = self._opening(number)
        end = opening.end()
        if opening["empty"]:
            return end, number + 1
        tag = self._next_tag(end)
        if self.text[tag + 1] == "/":
            return self.text.index(">", tag) + 1, number + 1
        end = self[number].end
        return end, bisect_left(self.starts, end, number + 1)

    def _opening(self, number: int) -> re.Match[str]:
        match = _MARKUP.match(self.text, self.starts[number])
        assert match is not None
        return match

    def _next_tag(self, place: int) -> int:
        """Return the offset of the next tag, behind comments, CDATA sections and instructions."""
        text = self.text
        place = text.index("<", place)
        while text[place + 1] in "!?":
            ending = (
                "-->"
                if text.startswith("<!--", place)
                else "]]>"
                if text[place + 1] == "!"
                else "?>"
            )
            place = text.index("<", text.index(ending, place + 2))
        return place

    def _span(self, number: int) -> Span:
        match = self._opening(number)
        start, tag, tag_end = match.start(), match["open"], match.end()
        if match["empty"]:
            return Span(tag, start, tag_end, tag_end, tag_end)
        close = self.text.rfind(f"</{tag}") if number == 0 else -1
        # Behind the root there is rarely anything, which could be a comment with what looks like
        # its end.
        if close < 0 or "".join(self.text[close:].split()) != f"</{tag}>":
            close = self._close(tag, tag_end)
        return Span(tag, start, tag_end, close, self.text.index(">", close) + 1)

    def _is_in_sight(self, place: int, start: int) -> bool:
        """Return whether an offset is certainly in no comment or CDATA section that begins at `start` or later."""
        text = self.text
        # What begins with a rare character is found many times faster than what begins with "<".
        if text.find("![", start, place) >= 0 or text.find("?", start, place) >= 0:
            return False
        if text.find("!", start, place) < 0:
            return True
        comment = text.rfind("<!--", start, place)
        return comment < 0 or text.find("-->", comment, place) >= 0

    def _close(self, tag: str, place: int) -> int:
        """Return the position of the closing tag of an element whose content begins at `place`."""
        close = self.text.find("<", place)
        if self.text[close + 1] == "/":
            return close
        first = self.text.index(f"</{tag}", close)
        is_its = self.text[first + len(tag) + 2] in "> \t\r\n"
        if (
            is_its
            and self.text.find(f"<{tag}", close, first) < 0
            and self._is_in_sight(first, close)
        ):
            # As good as always: what stands before it neither nests nor hides one.
            return first
        depth = 1
        name = re.escape(tag)
        same = re.compile(
            rf"<(?:/{name}\s*>|{name}(?![^\s/>])(?:[^<>\"']|\"[^\"]*\"|'[^']*')*>|"
            r"!--.*?-->|!\[CDATA\[.*?\]\]>|\?.*?\?>)",
            re.DOTALL,
        )
        for match in same.finditer(self.text, close):
            if match[0][1] == "/":
                depth -= 1
                if not depth:
                    return match.start()
            elif match[0][1] not in "!?" and match[0][-2] != "/":
                depth += 1
        raise AssertionError(f"the text is not well-formed: <{tag}> has no end")
