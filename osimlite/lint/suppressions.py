"""Comments that ignore findings: ``<!-- osimlite: ignore OSIM203 -->``."""

from __future__ import annotations

import re
import sys
from bisect import bisect_left
from collections.abc import Callable
from operator import attrgetter

from osimlite.base.patterns import compile_later
from osimlite.base.records import dataclass, field
from osimlite.io.document.source import Position, Source
from osimlite.lint.diagnostic import Finding

_COMMENT = compile_later(r"<!--\s*osimlite:\s*ignore\b([^<>]*?)-->")
_LINE = compile_later(r"^\W*osimlite:\s*ignore\b(.*)$")
LAST_LINE = sys.maxsize


@dataclass(slots=True)
class Suppression:
    """Ignoring comment: its codes, the lines it applies to, and the codes that were used."""

    position: Position
    codes: tuple[str, ...]
    first: int
    last: int
    used: set[str] = field(default_factory=set)

    def covers(self, finding: Finding, has_name: Callable[[str], bool]) -> bool:
        """Return whether the comment covers a finding, and mark it as used if so.

        `has_name` tells whether the rule of the finding has a code or name.
        """
        if finding.line is None or not self.first <= finding.line <= self.last:
            return False
        code = next(filter(has_name, self.codes), None)
        if code is None:
            return False
        self.used.add(code)
        return True


def read_suppressions(source: Source) -> list[Suppression]:
    """Return every ignoring comment of a text.

    A comment before the root element applies to the complete file, a comment alone on its line to
    the next element, and a comment at the end of a line to that line.
    """
    if "osimlite:" not in source.text:
        return []
    result = []
    root = source.spans[0].start if source.spans else len(source.text)
    for match in _COMMENT.finditer(source.text):
        position = source.position(match.start(), match.end() - match.start())
        line_before = source.text[source.text.rfind("\n", 0, match.start()) + 1 : match.start()]
        first_line = last_line = position.line
        if match.start() < root:
            first_line, last_line = 1, LAST_LINE
        elif not line_before.strip():
            number = bisect_left(source.spans, match.end(), key=attrgetter("start"))
            if number < len(source.spans):
                following = source.spans[number]
                last_line = source.position(following.end - 1).line
        result.append(Suppression(position, _split_codes(match[1]), first_line, last_line))
    return result


def read_header_suppressions(lines: list[str]) -> list[Suppression]:
    """Return every ignoring line in the header of a storage file; each applies to the whole file."""
    result = []
    for number, line in enumerate(lines, 1):
        match = _LINE.match(line)
        if match:
            result.append(
                Suppression(Position(number, 1, match.end()), _split_codes(match[1]), 1, LAST_LINE)
            )
    return result


def _split_codes(text: str) -> tuple[str, ...]:
    words = (word for word in re.split(r"[\s,]+", text) if word)
    return tuple(word.upper() if word.upper().startswith("OSIM") else word for word in words)
