"""Fixes as text edits, which keep comments and layout."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterable

from osimlite.errors import OsimliteError
from osimlite.io.document.source import Position, Source
from osimlite.io.document.xml_text import escape_text
from osimlite.lint.diagnostic import Edit, Finding, Fix, Report
from osimlite.lint.project_files import is_table


def replace_text(
    source: Source | None, position: Position | None, text: str | None, *, safe: bool = True
) -> Fix | None:
    """Return the fix that replaces the text at a position; None without a source, position or text.

    Args:
        source: text of the file; None for a model made in Python.
        position: position of the old text.
        text: new text; None without a suggestion.
        safe: whether the fix is certain.
    """
    if source is None or position is None or text is None:
        return None
    # Columns count from 1, offsets from 0.
    start = source.line_start(position.line) + position.column - 1
    return Fix((Edit(start, start + position.length, text),), safe)


def replace_name(
    source: Source | None, position: Position, expected: object, text: str, *, certain: bool
) -> Fix | None:
    """Return the fix that replaces a name; None if another text is at the position.

    Args:
        source: text of the file; None for a model made in Python.
        position: position of the name.
        expected: present name.
        text: new name.
        certain: whether the fix is safe also if more than the letter case differs.
    """
    # A name with quotes could end the attribute that it is in.
    if source is None or not isinstance(expected, str) or "'" in text or '"' in text:
        return None
    start = source.line_start(position.line) + position.column - 1
    # The value may be an entity, or come from an included file, where this fix would damage the
    # text.
    if source.text[start : start + position.length] != escape_text(expected.strip()):
        return None
    # OpenSim's names depend on the case; a different case is almost certainly a slip.
    return replace_text(
        source, position, escape_text(text), safe=certain or text.lower() == expected.lower()
    )


def rename_tag(
    source: Source | None, number: int, tag: str | None, *, safe: bool = True
) -> Fix | None:
    """Return the fix that gives an element another tag.

    Args:
        source: text of the file; None for a model made in Python.
        number: index of the element.
        tag: new tag; None without a suggestion.
        safe: whether the fix is certain.
    """
    if source is None or tag is None:
        return None
    span = source.spans[number]
    # The first edit is the start tag after "<", the second the end tag after "</"; an empty element
    # has no end tag.
    edits = [Edit(span.start + 1, span.start + 1 + len(span.tag), tag)]
    if span.inner_end < span.end:
        edits.append(Edit(span.inner_end + 2, span.inner_end + 2 + len(span.tag), tag))
    return Fix(tuple(edits), safe)


def remove_element(source: Source | None, number: int) -> Fix | None:
    """Return the fix that deletes an element, with its line if nothing else is on it.

    Args:
        source: text of the file; None for a model made in Python.
        number: index of the element.
    """
    if source is None:
        return None
    span = source.spans[number]
    return Fix((_delete_range(source.text, span.start, span.end),), True)


def comment_out(source: Source | None, number: int) -> Fix | None:
    """Return the fix that makes an element of text an XML comment, or deletes it if it is empty.

    A text that a comment cannot hold is left as it is: there is no fix then.

    Args:
        source: text of the file; None for a model made in Python.
        number: index of the element.
    """
    if source is None:
        return None
    span = source.spans[number]
    # Commenting out an element with children would also remove them.
    if source.children(number):
        return None
    text = source.text[span.tag_end : span.inner_end].strip() if span.inner_end < span.end else ""
    if not text:
        return remove_element(source, number)
    # XML forbids two hyphens inside a comment, and a hyphen before its end.
    if "--" in text or text.endswith("-") or "<" in text:
        return None
    return Fix((Edit(span.start, span.end, f"<!-- {text} -->"),), True)


def remove_attribute(source: Source | None, number: int, name: str) -> Fix | None:
    """Return the fix that deletes an attribute.

    Args:
        source: text of the file; None for a model made in Python.
        number: index of the element.
        name: name of the attribute.
    """
    if source is None:
        return None
    result = source.get_attributes(number).get(name)
    return Fix((Edit(result.before, result.end, ""),), True) if result else None


def remove_text(source: Source, start: int, end: int) -> Fix:
    """Return the fix that deletes a text without meaning.

    Args:
        source: text of the file.
        start: offset of the first character.
        end: offset after the last character.
    """
    return Fix((_delete_range(source.text, start, end),), True)


def select_edits(findings: Iterable[Finding], *, unsafe: bool = False) -> tuple[list[Edit], int]:
    """Select the edits of all fixes that do not overlap an earlier fix.

    Args:
        findings: findings with fixes.
        unsafe: whether to select fixes that are not safe, too.

    Returns:
        The edits sorted by position, and the number of fixes.
    """
    selected: list[Edit] = []
    count = 0
    for finding in findings:
        fix = finding.fix
        if fix is None or not (fix.safe or unsafe):
            continue
        # Of overlapping fixes the first wins; a second run of the fixes applies the others.
        if any(_overlaps_any(edit, selected) for edit in fix.edits):
            continue
        for edit in fix.edits:
            insort(selected, edit, key=_get_start)
        count += 1
    return selected, count


def _get_start(edit: Edit) -> int:
    return edit.start


def _overlaps_any(edit: Edit, selected: list[Edit]) -> bool:
    """Return whether an edit overlaps one of some sorted, disjoint edits."""
    # The edits are disjoint and sorted, so only the last one that starts before this edit's end can
    # overlap it.
    before = bisect_left(selected, edit.end, key=_get_start)
    return before > 0 and selected[before - 1].end > edit.start


def apply_fixes(source: Source, report: Report, *, unsafe: bool = False) -> tuple[bytes, int]:
    """Return the bytes of a file after its fixes; raises as `apply_fixes_in_pieces` does.

    Args:
        source: text of the file.
        report: findings with fixes.
        unsafe: whether to apply fixes that are not safe, too.

    Returns:
        The bytes, and the number of fixes.
    """
    pieces, count = apply_fixes_in_pieces(source, report, unsafe=unsafe)
    return b"".join(pieces), count


def apply_fixes_in_pieces(
    source: Source, report: Report, *, unsafe: bool = False
) -> tuple[list[bytes | memoryview], int]:
    """Return the bytes of a file after its fixes in pieces, which are views for a table; a document keeps its encoding.

    Args:
        source: text of the file.
        report: findings with fixes.
        unsafe: whether to apply fixes that are not safe, too.

    Returns:
        The pieces, and the number of fixes.

    Raises:
        OsimliteError: the file mixes encodings, so it cannot be written back unchanged.
    """
    edits, count = select_edits(report.findings, unsafe=unsafe)
    ends = [0, *(edit.end for edit in edits)]
    # Offsets of tables are bytes, which are copied without decoding.
    if not count or is_table(source.file):
        data = memoryview(source.data)
        pieces: list[bytes | memoryview] = []
        for end, edit in zip(ends, edits, strict=False):
            pieces += data[end : edit.start], edit.text.encode()
        return [*pieces, data[ends[-1] :]], count
    # Decoding replaced what it could not read, and writing the replacement would change the file
    # beyond the fix.
    if source.text.encode(source.encoding, "replace") != source.data:
        raise OsimliteError(
            "the file mixes encodings and cannot be fixed; save it as UTF-8 first",
            file=source.file,
        )
    parts = (
        source.text[end : edit.start] + edit.text for end, edit in zip(ends, edits, strict=False)
    )
    try:
        return ["".join([*parts, source.text[ends[-1] :]]).encode(source.encoding)], count
    except UnicodeEncodeError:
        raise OsimliteError(
            f"a fix cannot be written in {source.encoding}; save the file as UTF-8 first",
            file=source.file,
        ) from None


def _delete_range(text: str, start: int, end: int) -> Edit:
    before = text.rfind("\n", 0, start) + 1
    after = text.find("\n", end)
    # If nothing else is on these lines, they go too, with their indentation.
    if after >= 0 and not text[before:start].strip() and not text[end:after].strip():
        return Edit(before, after + 1, "")
    return Edit(start, end, "")
