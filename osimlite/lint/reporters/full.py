"""Each finding with the line it is about and a caret under the exact text."""

from __future__ import annotations

import re
import textwrap
from itertools import groupby

from osimlite.base.text import visible
from osimlite.lint.diagnostic import Finding, Report
from osimlite.lint.reporters.fold import Fold, folded, told
from osimlite.lint.reporters.style import painted, passed, summary, unmeasured

_ELLIPSIS = "..."


def render(
    report: Report, *, colour: bool = False, width: int = 80, everything: bool = False
) -> str:
    """The report as text of at most `width` columns (but for places, which are never broken)."""
    blocks: list[str] = []
    every = folded(report.findings, everything=everything)
    for file, result in groupby(every, key=lambda fold: fold.first.file):
        folds = list(result)
        lines = _lines(report, file, max(fold.first.line or 0 for fold in folds))
        blocks += [_block(fold, lines, colour, width) for fold in folds]
    closing, length = summary(report, colour), len(summary(report))
    for more in filter(
        None, (_fixes(report), told(every), passed(report, everything), unmeasured(report))
    ):
        fits = length + 1 + len(more) <= width
        closing, length = (
            f"{closing}{' ' if fits else chr(10)}{more}",
            (length + 1 if fits else 0) + len(more),
        )
    return "\n\n".join([*blocks, closing]) + "\n"


def _fixes(report: Report) -> str:
    """How many findings ``--fix`` mends, and how many more are mended by a guess."""
    safe = sum(finding.fixable for finding in report.findings)
    rest = sum(finding.fix is not None for finding in report.findings) - safe
    parts = [f"{'1 is' if safe == 1 else f'{safe} are'} mended by --fix"] if safe else []
    if rest:
        some = f"{rest} more" if safe else "1 is mended" if rest == 1 else f"{rest} are mended"
        parts.append(f"{some} by --unsafe-fixes")
    return f"{', '.join(parts)}." if parts else ""


def _lines(report: Report, file: str | None, last: int) -> list[str] | None:
    """The lines of a file up to one; a table may have a million more."""
    try:
        return None if file is None else re.split(r"\n|\r\n?", report.texts[file], maxsplit=last)
    except KeyError:
        return None


def _block(fold: Fold, lines: list[str] | None, colour: bool, width: int) -> str:
    finding = fold.first
    head = (
        f"{painted(finding.severity.value, finding.severity, colour)} {finding.code} {finding.name}"
    )
    place = painted(visible(finding.place), "strong", colour)
    rows = [f"{place}: {head}" if finding.place else head]
    if (
        len(f"{visible(finding.place)}: {finding.severity.value} {finding.code} {finding.name}")
        > width
    ):
        # Broken where it means something, not where the terminal ends.
        rows = [f"{place}:", f"  {head}"]
    rows += [
        f"  {row}"
        for row in textwrap.wrap(visible(finding.message), width - 4, break_on_hyphens=False)
    ]
    if finding.line is not None and lines is not None and finding.line <= len(lines):
        rows += _snippet(finding, lines[finding.line - 1], colour, width)
    notes: list[tuple[str, str]] = []
    if finding.suggestion is not None:
        question = f"did you mean '{finding.suggestion}'?"
        notes.append((question if "\n" not in finding.suggestion else finding.suggestion, "hint"))
    # Of the model itself the path says nothing.
    if finding.component not in ("", "/") and finding.line is not None:
        notes.append((f"in {finding.component}", "dim"))
    margin = " " * len(str(finding.line or ""))
    notes += [
        (textwrap.shorten(it, width - len(margin) - 3, placeholder=" ..."), "strong")
        for it in fold.remarks
    ]
    for note, style in notes:
        rows.append(
            f"{margin} {painted('=', 'dim', colour)} {painted(visible(note), style, colour)}"
        )
    return "\n".join(rows)


def _snippet(finding: Finding, line: str, colour: bool, width: int) -> list[str]:
    """The line and the caret under it; a long line is cut around the caret."""
    assert finding.line is not None and finding.column is not None
    start = min(finding.column - 1, len(line))
    indent = len(line) - len(line.lstrip())
    # The indentation of a deep file would push everything out of sight.
    skipped = min(indent, start)
    shown = line[skipped:].replace("\t", " ").rstrip()
    start -= skipped
    length = max(1, min(finding.length, len(shown) - start))
    margin = len(str(finding.line))
    room = max(20, width - margin - 3)
    before, marked, after = map(
        visible, (shown[:start], shown[start : start + length], shown[start + length :])
    )
    shown, start, length = before + marked + after, len(before), max(1, len(marked))
    if len(shown) > room:
        shown, start, length = _cut(shown, start, length, room)
    bar = painted("|", "dim", colour)
    caret = painted("^" * length, finding.severity, colour)
    return [
        f"{' ' * margin} {bar}",
        f"{painted(str(finding.line), 'dim', colour)} {bar} {shown}",
        f"{' ' * margin} {bar} {' ' * start}{caret}",
    ]


def _cut(shown: str, start: int, length: int, room: int) -> tuple[str, int, int]:
    """The part of a long line around the caret, with dots where it was cut."""
    first = 0
    if start + length > room - len(_ELLIPSIS):
        first = min(start, max(0, start + min(length, room // 2) - room // 2))
    part = shown[first:]
    if first:
        part = (
            _ELLIPSIS + part[len(_ELLIPSIS) :]
            if start - first >= len(_ELLIPSIS)
            else _ELLIPSIS + part
        )
        start = start - first if start - first >= len(_ELLIPSIS) else start - first + len(_ELLIPSIS)
    if len(part) > room:
        part = part[: room - len(_ELLIPSIS)] + _ELLIPSIS
    return part, start, max(1, min(length, room - start))
