"""Findings of the linter as an editor shows them, with their fixes."""

from __future__ import annotations

import re
from collections.abc import Iterable

from lsprotocol import types

from osimlite.base.text import escape_unprintable
from osimlite.cli.language_server.analysis import Analysis
from osimlite.io.document.source import Position
from osimlite.lint.diagnostic import Edit, Finding, Severity
from osimlite.lint.fixes import select_edits

_ENDS_HEADER = re.compile(r"(\r?\n)([ \t]*endheader)")

SOURCE = "osimlite"
"""What an editor names as the origin of a diagnostic."""

_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.INFO: types.DiagnosticSeverity.Information,
}


def diagnostics(analysis: Analysis) -> list[types.Diagnostic]:
    """Every finding."""
    return [_diagnostic(analysis, finding) for finding in analysis.report]


def _diagnostic(analysis: Analysis, finding: Finding) -> types.Diagnostic:
    hint = f"; did you mean '{finding.suggestion}'?" if finding.suggestion is not None else ""
    return types.Diagnostic(
        analysis.text.range(*_offsets(analysis, finding)),
        escape_unprintable(f"{finding.message}{hint}"),
        severity=_SEVERITIES[finding.severity],
        code=finding.code,
        source=SOURCE,
    )


def _offsets(analysis: Analysis, finding: Finding) -> tuple[int, int]:
    if finding.line is None or finding.column is None:
        return 0, 0
    start = analysis.offset_of(Position(finding.line, finding.column))
    return start, min(start + finding.length, len(analysis.text.content))


def actions(analysis: Analysis, uri: str, wanted: types.Range) -> list[types.CodeAction]:
    """Return the actions for the findings in a range: fix them, ignore them, or fix everything in the file."""
    result: list[types.CodeAction] = []
    if not analysis.is_checked:
        # The editor asks again when it is told of the findings.
        return result
    first, last = analysis.text.offset(wanted.start), analysis.text.offset(wanted.end)
    for finding in analysis.report:
        start, end = _offsets(analysis, finding)
        if start > last or end < first:
            continue
        concerned = [_diagnostic(analysis, finding)]
        if finding.fix is not None:
            edits = _edits(analysis, finding.fix.edits)
            result.append(
                types.CodeAction(
                    _title(finding),
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=concerned,
                    is_preferred=finding.fix.safe,
                    edit=types.WorkspaceEdit({uri: edits}),
                )
            )
        ignoring = _ignoring(analysis, finding) if finding.code[4] != "0" else None
        if ignoring is not None:
            where = "in this table" if analysis.is_table else "on this line"
            result.append(
                types.CodeAction(
                    f"Ignore {finding.code} ({finding.name}) {where}",
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=concerned,
                    edit=types.WorkspaceEdit({uri: [ignoring]}),
                )
            )
    safe = _edits(analysis, select_edits(analysis.report)[0])
    if safe:
        result.append(
            types.CodeAction(
                "Mend everything that is certain",
                kind=types.CodeActionKind.SourceFixAll,
                edit=types.WorkspaceEdit({uri: safe}),
            )
        )
    return result


def _title(finding: Finding) -> str:
    assert finding.fix is not None
    doubt = "" if finding.fix.safe else " (look at the result)"
    if finding.suggestion is not None:
        return escape_unprintable(f"Change to '{finding.suggestion}'{doubt}")
    return f"Mend {finding.code} ({finding.name}){doubt}"


def _edits(analysis: Analysis, edits: Iterable[Edit]) -> list[types.TextEdit]:
    result = []
    data, is_table = analysis.source.data, analysis.is_table and not analysis.text.content.isascii()
    seen = characters = 0
    for edit in sorted(edits, key=lambda edit: edit.start):
        start, end = edit.start, edit.end
        if is_table:
            # Mends of tables count bytes.
            characters += len(data[seen:start].decode())
            seen, start, end = start, characters, characters + len(data[start:end].decode())
        result.append(types.TextEdit(analysis.text.range(start, end), edit.text))
    return result


def _ignoring(analysis: Analysis, finding: Finding) -> types.TextEdit | None:
    """What makes the linter pass over a finding: a comment at the end of its line, a line in the header of a table."""
    if finding.line is None:
        return None
    if analysis.is_table:
        header = _ENDS_HEADER.search(analysis.text.content)
        if header is None:
            return None
        place = analysis.text.range(header.start(2), header.start(2))
        return types.TextEdit(place, f"osimlite: ignore {finding.code}{header[1]}")
    line = analysis.source.lines[finding.line - 1]
    end = analysis.source.line_start(finding.line) + len(line)
    return types.TextEdit(
        analysis.text.range(end, end), f" <!-- osimlite: ignore {finding.code} -->"
    )
