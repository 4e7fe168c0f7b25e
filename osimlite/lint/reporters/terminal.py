"""Reports for people: one line per finding (concise), or the source line with a caret (full).

Similar findings are folded: one stands for all, and the others are only counted.
"""

from __future__ import annotations

import os
import re
import textwrap
from collections.abc import Callable, Hashable, Iterable
from itertools import groupby
from typing import TypeVar

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.patterns import compile_later
from osimlite.base.text import append_clause, escape_unprintable, join_words
from osimlite.lint.diagnostic import Finding, Report, Severity

_CODES = {
    Severity.ERROR: "1;31",
    Severity.WARNING: "1;33",
    Severity.INFO: "1;34",
    "strong": "1",
    "dim": "2",
    "good": "32",
    "hint": "36",
}


def paint(text: str, style: Severity | str, colour: bool) -> str:
    """Return a text in the colour of a style; unchanged without `colour`."""
    return f"\033[{_CODES[style]}m{text}\033[0m" if colour and text else text


def format_summary(report: Report, colour: bool = False) -> str:
    """Return the closing line, such as ``Found 3 errors, 1 warning in 2 files``.

    Args:
        report: findings of a check.
        colour: whether to colour the counts.
    """
    counts = (
        (Severity.ERROR, len(report.errors)),
        (Severity.WARNING, len(report.warnings)),
        (Severity.INFO, len(report.infos)),
    )
    parts = [
        paint(f"{count} {_pluralize(severity.value, count)}", severity, colour)
        for severity, count in counts
        if count
    ]
    file_count = report.count_files()
    files = f"{file_count} {_pluralize('file', file_count)}"
    baseline_note = f" ({report.known} more in the baseline)" if report.known else ""
    if not parts:
        return paint(f"No findings in {files}{baseline_note}.", "good", colour)
    return f"Found {', '.join(parts)} in {files}{baseline_note}."


def describe_unmeasured(report: Report) -> str:
    """Return the sentence about rules that did not run and why; empty if all ran."""
    if not report.unmeasured:
        return ""
    count = len(report.unmeasured) - 1
    other_files = f" (and {count} more {_pluralize('file', count)})" if count else ""
    # A reason may end with a suggestion.
    end = "" if not other_files and report.unmeasured[0].endswith("?") else "."
    return escape_unprintable(f"{report.unmeasured[0]}{other_files}{end}")


def describe_skipped(report: Report, everything: bool) -> str:
    """Return the sentence about skipped files that are not OpenSim's; empty without any.

    Args:
        report: findings of a check.
        everything: whether to name the files rather than to count them.

    Returns:
        Sentence, or "" if no file was skipped.
    """
    if not report.passed:
        return ""
    if everything:
        return escape_unprintable(f"Skipped, not OpenSim files: {', '.join(report.passed)}.")
    count = len(report.passed)
    return (
        f"{count} {_pluralize('file', count)} skipped "
        f"({'not an OpenSim file' if count == 1 else 'not OpenSim files'})."
    )


def _pluralize(noun: str, count: int) -> str:
    return noun if count == 1 else f"{noun}s"


T = TypeVar("T")

MIN_FOLD_SIZE = 4
"""Number of similar findings, or of files with the same finding, from which they are folded."""

_ONE_CAUSE_RULES = {"OSIM701"}
"""Rules whose findings are fixed together: two of them are folded already."""

# Names are in quotes or are tags. A number includes its unit; paths count as numbers.
_NAME_PATTERN = compile_later(r"'[^']*'|<\w+>")
_NUMBER_PATTERN = compile_later(r"(?<!\S)[^\s']*/[^\s']*|(?<!\w)[-+]?[\d.][\w.+-]*")


class Fold(NamedTuple):
    """A finding with similar findings of the same file (`more`) and of other files (`in_other_files`)."""

    first: Finding
    more: list[Finding]
    in_other_files: list[Finding]

    @property
    def remarks(self) -> list[str]:
        """Notes on the folded findings, such as ``91 more like this, on lines 12, 40 and 88 more``."""
        result = []
        if self.more:
            lines = list(
                dict.fromkeys(
                    str(finding.line) for finding in self.more if finding.line is not None
                )
            )
            line_list = (
                f", on line{'s' * (len(lines) > 1)} {join_words(lines, max_count=4)}"
                if lines
                else ""
            )
            result.append(f"{len(self.more)} more like this{line_list}")
        if self.in_other_files:
            paths = [finding.file or "" for finding in self.in_other_files]
            folder = os.path.dirname(self.first.file or "")
            # Files of other folders may have the same name.
            files = dict.fromkeys(
                os.path.basename(path) if os.path.dirname(path) == folder else path
                for path in paths
            )
            result.append(
                f"{len(self.in_other_files)} more in other files: {join_words(files, max_count=3)}"
            )
        return result


def fold_findings(findings: Iterable[Finding], *, everything: bool = False) -> list[Fold]:
    """Fold similar findings under the first of them, and keep the order.

    Args:
        findings: findings of a check.
        everything: whether to leave all findings unfolded.

    Returns:
        A fold for each finding that is shown.
    """
    all_findings = list(findings)
    if everything:
        return [Fold(finding, [], []) for finding in all_findings]
    # 1. Fold similar findings of each file.
    groups = [
        part
        for group in _group_by(
            all_findings, lambda finding: (finding.file, *_fold_key(finding, names=False))
        )
        for part in (
            [group] if len(group) >= _min_fold_size(group[0]) else [[finding] for finding in group]
        )
    ]
    result: list[Fold] = []
    # Findings of other files are the same only if names agree, unless they have one cause.
    for similar_groups in _group_by(
        groups, lambda part: _fold_key(part[0], names=part[0].code not in _ONE_CAUSE_RULES)
    ):
        first, *remaining = [finding for part in similar_groups for finding in part]
        if len({part[0].file for part in similar_groups}) < _min_fold_size(first):
            result += [Fold(part[0], part[1:], []) for part in similar_groups]
        else:
            same_file = [finding for finding in remaining if finding.file == first.file]
            result.append(
                Fold(
                    first,
                    same_file,
                    [finding for finding in remaining if finding.file != first.file],
                )
            )
    # 3. Back into the order of the findings.
    order = {id(finding): number for number, finding in enumerate(all_findings)}
    return sorted(result, key=lambda fold: order[id(fold.first)])


def _min_fold_size(finding: Finding) -> int:
    return 2 if finding.code in _ONE_CAUSE_RULES else MIN_FOLD_SIZE


def _fold_key(finding: Finding, *, names: bool) -> tuple[object, ...]:
    """Return the key of similar findings: the message without numbers and, unless `names`, names."""
    words = finding.message if names else _NAME_PATTERN.sub("", finding.message)
    return finding.code, finding.severity, _NUMBER_PATTERN.sub("", words)


def _group_by(items: Iterable[T], key: Callable[[T], Hashable]) -> list[list[T]]:
    groups: dict[Hashable, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return list(groups.values())


def hint_at_folds(folds: Iterable[Fold]) -> str:
    """Return the hint how to print every finding; empty without any."""
    return "--all prints every finding." if any(fold.remarks for fold in folds) else ""


def render_concise(report: Report, *, colour: bool = False, everything: bool = False) -> str:
    """Return ``file:line:column: severity code message`` for each finding, and a closing line."""
    folds = fold_findings(report.findings, everything=everything)
    closing = " ".join(
        filter(
            None,
            (
                format_summary(report, colour),
                hint_at_folds(folds),
                describe_skipped(report, everything),
                describe_unmeasured(report),
            ),
        )
    )
    return "\n".join([*(_format_line(fold, colour) for fold in folds), closing]) + "\n"


def _format_line(fold: Fold, colour: bool) -> str:
    finding = fold.first
    counts = (("like this", fold.more), ("in other files", fold.in_other_files))
    hint = f" (did you mean '{finding.suggestion}'?)" if finding.suggestion is not None else ""
    text = f"{finding.message}{hint}"
    for relation, result in counts:
        if result:
            text = append_clause(text, f"{len(result)} more {relation}")
    text = escape_unprintable(text)
    severity = paint(finding.severity.value, finding.severity, colour)
    position = paint(escape_unprintable(finding.place), "strong", colour)
    return f"{position}: {severity} {finding.code} {text}"


_ELLIPSIS = "..."


def render_full(
    report: Report, *, colour: bool = False, width: int = 80, everything: bool = False
) -> str:
    """Return the report as text of at most `width` columns; file positions are never broken.

    Args:
        report: findings of a check.
        colour: whether to write terminal colours.
        width: number of columns.
        everything: whether to show every finding instead of folding similar ones.

    Returns:
        Text of the report with a closing line.
    """
    blocks: list[str] = []
    all_folds = fold_findings(report.findings, everything=everything)
    for file, result in groupby(all_folds, key=lambda fold: fold.first.file):
        folds = list(result)
        lines = _split_lines(report, file, max(fold.first.line or 0 for fold in folds))
        blocks += [_format_block(fold, lines, colour, width) for fold in folds]
    closing = format_summary(report, colour)
    length = len(format_summary(report))
    for sentence in filter(
        None,
        (
            _describe_fixes(report),
            hint_at_folds(all_folds),
            describe_skipped(report, everything),
            describe_unmeasured(report),
        ),
    ):
        # A sentence that does not fit beside the summary gets its own line.
        fits = length + 1 + len(sentence) <= width
        closing = f"{closing}{' ' if fits else chr(10)}{sentence}"
        length = (length + 1 if fits else 0) + len(sentence)
    return "\n\n".join([*blocks, closing]) + "\n"


def _describe_fixes(report: Report) -> str:
    """Return a sentence with the numbers of findings that ``--fix`` and ``--unsafe-fixes`` fix."""
    safe = sum(finding.fixable for finding in report.findings)
    unsafe_count = sum(finding.fix is not None for finding in report.findings) - safe
    sentences = [f"{safe} can be fixed with --fix."] if safe else []
    if unsafe_count:
        verb = "has a probable fix" if unsafe_count == 1 else "have a probable fix"
        count_text = f"{unsafe_count} more" if safe else f"{unsafe_count}"
        sentences.append(f"{count_text} {verb} (--unsafe-fixes).")
    return " ".join(sentences)


def _split_lines(report: Report, file: str | None, last: int) -> list[str] | None:
    """Return the lines of a file up to line `last`: a table may have a million more."""
    try:
        return None if file is None else re.split(r"\n|\r\n?", report.texts[file], maxsplit=last)
    except KeyError:
        return None


def _format_block(fold: Fold, lines: list[str] | None, colour: bool, width: int) -> str:
    """Return the text of one finding: position, message, source line and notes."""
    finding = fold.first
    heading = (
        f"{paint(finding.severity.value, finding.severity, colour)} {finding.code} {finding.name}"
    )
    position = paint(escape_unprintable(finding.place), "strong", colour)
    rows = [f"{position}: {heading}" if finding.place else heading]
    if (
        len(
            f"{escape_unprintable(finding.place)}: {finding.severity.value} {finding.code} {finding.name}"
        )
        > width
    ):
        # Break after the position, before the terminal breaks the line anywhere.
        rows = [f"{position}:", f"  {heading}"]
    # A per cent sign stays in the line of its number.
    message = escape_unprintable(finding.message).replace(" %", "\u00a0%")
    rows += [
        f"  {row}".replace("\u00a0%", " %")
        for row in textwrap.wrap(message, width - 4, break_on_hyphens=False)
    ]
    if finding.line is not None and lines is not None and finding.line <= len(lines):
        rows += _format_snippet(finding, lines[finding.line - 1], colour, width)
    notes: list[tuple[str, str]] = []
    if finding.suggestion is not None:
        question = f"did you mean '{finding.suggestion}'?"
        notes.append((question if "\n" not in finding.suggestion else finding.suggestion, "hint"))
    # The path "/" of the model itself would not help.
    if finding.component not in ("", "/") and finding.line is not None:
        notes.append((f"in {finding.component}", "dim"))
    margin = " " * len(str(finding.line or ""))
    notes += [
        (textwrap.shorten(remark, width - len(margin) - 3, placeholder=" ..."), "strong")
        for remark in fold.remarks
    ]
    for note, style in notes:
        rows.append(
            f"{margin} {paint('=', 'dim', colour)} {paint(escape_unprintable(note), style, colour)}"
        )
    return "\n".join(rows)


def _format_snippet(finding: Finding, line: str, colour: bool, width: int) -> list[str]:
    """Return the source line and the caret under it; a long line is cut around the caret."""
    assert finding.line is not None and finding.column is not None
    start = min(finding.column - 1, len(line))
    indent = len(line) - len(line.lstrip())
    # The indentation of a deep file would push the text out of sight.
    skipped = min(indent, start)
    display_line = line[skipped:].replace("\t", " ").rstrip()
    start -= skipped
    length = max(1, min(finding.length, len(display_line) - start))
    margin = len(str(finding.line))
    available_width = max(20, width - margin - 3)
    before, marked, after = map(
        escape_unprintable,
        (
            display_line[:start],
            display_line[start : start + length],
            display_line[start + length :],
        ),
    )
    display_line = before + marked + after
    start = len(before)
    length = max(1, len(marked))
    if len(display_line) > available_width:
        display_line, start, length = _cut_line(display_line, start, length, available_width)
    bar = paint("|", "dim", colour)
    caret = paint("^" * length, finding.severity, colour)
    return [
        f"{' ' * margin} {bar}",
        f"{paint(str(finding.line), 'dim', colour)} {bar} {display_line}",
        f"{' ' * margin} {bar} {' ' * start}{caret}",
    ]


def _cut_line(
    display_line: str, start: int, length: int, available_width: int
) -> tuple[str, int, int]:
    """Return the part of a long line around the caret, with dots where it is cut, and the caret's start and length."""
    cut_start = 0
    # Keep the caret visible, about in the middle of the line.
    if start + length > available_width - len(_ELLIPSIS):
        cut_start = min(
            start, max(0, start + min(length, available_width // 2) - available_width // 2)
        )
    visible = display_line[cut_start:]
    if cut_start:
        visible = (
            _ELLIPSIS + visible[len(_ELLIPSIS) :]
            if start - cut_start >= len(_ELLIPSIS)
            else _ELLIPSIS + visible
        )
        start = (
            start - cut_start
            if start - cut_start >= len(_ELLIPSIS)
            else start - cut_start + len(_ELLIPSIS)
        )
    if len(visible) > available_width:
        visible = visible[: available_width - len(_ELLIPSIS)] + _ELLIPSIS
    return visible, start, max(1, min(length, available_width - start))
