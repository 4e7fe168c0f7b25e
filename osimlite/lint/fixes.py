"""Mends as text edits: everything around them, comments and layout, stays as it is."""

from __future__ import annotations

from collections.abc import Iterable

from osimlite.document.source import Position, Source
from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Edit, Finding, Fix, Report


def replaced(source: Source | None, place: Position | None, text: str | None, *, safe: bool = True) -> Fix | None:
    """Put another text in a place."""
    if source is None or place is None or text is None:
        return None
    start = source.line_start(place.line) + place.column - 1
    return Fix((Edit(start, start + place.length, text),), safe)


def renamed(source: Source | None, number: int, tag: str | None, *, safe: bool = True) -> Fix | None:
    """Give an element another tag."""
    if source is None or tag is None:
        return None
    span = source.spans[number]
    edits = [Edit(span.start + 1, span.start + 1 + len(span.tag), tag)]
    if span.inner_end < span.end:
        edits.append(Edit(span.inner_end + 2, span.inner_end + 2 + len(span.tag), tag))
    return Fix(tuple(edits), safe)


def without_element(source: Source | None, number: int, *, safe: bool = True) -> Fix | None:
    """Take an element out, and its line with it if nothing else stands there."""
    if source is None:
        return None
    span = source.spans[number]
    return Fix((_whole_line(source.text, span.start, span.end),), safe)


def without_attribute(source: Source | None, number: int, name: str, *, safe: bool = True) -> Fix | None:
    """Take an attribute out."""
    if source is None:
        return None
    found = source.attributes_of(number).get(name)
    return Fix((Edit(found.before, found.end, ""),), safe) if found else None


def without_text(source: Source, start: int, end: int) -> Fix:
    """Take a text out that means nothing."""
    return Fix((_whole_line(source.text, start, end),), True)


def apply(text: str, findings: Iterable[Finding], *, unsafe: bool = False) -> tuple[str, int]:
    """The text with every mend in it that does not touch another, and how many these are."""
    chosen, count = edits_of(findings, unsafe=unsafe)
    for edit in sorted(chosen, key=lambda edit: edit.start, reverse=True):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text, count


def edits_of(findings: Iterable[Finding], *, unsafe: bool = False) -> tuple[list[Edit], int]:
    """The edits of every mend that does not touch another before it, and how many mends these are."""
    chosen: list[Edit] = []
    count = 0
    for finding in findings:
        fix = finding.fix
        if fix is None or not (fix.safe or unsafe):
            continue
        if any(edit.start < other.end and other.start < edit.end for edit in fix.edits for other in chosen):
            continue
        chosen.extend(fix.edits)
        count += 1
    return chosen, count


def mended(source: Source, report: Report, *, unsafe: bool = False) -> tuple[bytes, int]:
    """The bytes of a document with its mends, in its own encoding, and how many there are.

    Raises:
        OsimliteError: the bytes are in no single encoding, so that they cannot be written back as they were.
    """
    text, count = apply(source.text, report.findings, unsafe=unsafe)
    if not count:
        return source.data, 0
    if source.text.encode(source.encoding, "replace") != source.data:
        raise OsimliteError("the file mixes encodings and cannot be mended; save it as UTF-8 first", file=source.file)
    try:
        return text.encode(source.encoding), count
    except UnicodeEncodeError:
        raise OsimliteError(
            f"a mend cannot be written in {source.encoding}; save the file as UTF-8 first", file=source.file
        ) from None


def _whole_line(text: str, start: int, end: int) -> Edit:
    before = text.rfind("\n", 0, start) + 1
    after = text.find("\n", end)
    if after >= 0 and not text[before:start].strip() and not text[end:after].strip():
        return Edit(before, after + 1, "")
    return Edit(start, end, "")
