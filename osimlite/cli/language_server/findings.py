"""Diagnostics and code actions of an editor for the linter's findings."""

from __future__ import annotations

from collections.abc import Iterable

from lsprotocol import types

from osimlite.base.patterns import compile_later
from osimlite.base.text import escape_unprintable
from osimlite.cli.language_server.analysis import DocumentAnalysis
from osimlite.io.document.source import Position
from osimlite.lint.diagnostic import Edit, Finding, Severity
from osimlite.lint.fixes import select_edits

_ENDS_HEADER = compile_later(r"(\r?\n)([ \t]*endheader)")

SOURCE = "osimlite"
"""Origin that an editor shows for a diagnostic."""

_SEVERITIES = {
    Severity.ERROR: types.DiagnosticSeverity.Error,
    Severity.WARNING: types.DiagnosticSeverity.Warning,
    Severity.INFO: types.DiagnosticSeverity.Information,
}


def list_diagnostics(analysis: DocumentAnalysis) -> list[types.Diagnostic]:
    """Return all findings of a file as diagnostics."""
    return [_make_diagnostic(analysis, finding) for finding in analysis.report]


def _make_diagnostic(analysis: DocumentAnalysis, finding: Finding) -> types.Diagnostic:
    hint = f"; did you mean '{finding.suggestion}'?" if finding.suggestion is not None else ""
    return types.Diagnostic(
        analysis.text.range(*_find_offsets(analysis, finding)),
        escape_unprintable(f"{finding.message}{hint}"),
        severity=_SEVERITIES[finding.severity],
        code=finding.code,
        source=SOURCE,
    )


def _find_offsets(analysis: DocumentAnalysis, finding: Finding) -> tuple[int, int]:
    if finding.line is None or finding.column is None:
        return 0, 0
    start = analysis.compute_offset(Position(finding.line, finding.column))
    return start, min(start + finding.length, len(analysis.text.content))


def list_code_actions(
    analysis: DocumentAnalysis, uri: str, requested_range: types.Range
) -> list[types.CodeAction]:
    """Return the actions for the findings in a range: fix them, ignore them, or fix everything in the file.

    Args:
        analysis: analysis of the open file.
        uri: URI of the file.
        requested_range: range that the editor asks about; all of its lines count.
    """
    result: list[types.CodeAction] = []
    if not analysis.is_checked:
        # Do not run the rules here: the editor requests actions again after diagnostics arrive.
        return result
    # People ask anywhere in a line, and a finding may be about one word of it.
    lines = (
        types.Position(requested_range.start.line, 0),
        types.Position(requested_range.end.line + 1, 0),
    )
    first, last = (analysis.text.offset(position) for position in lines)
    last = max(first, last - 1)
    for finding in analysis.report:
        start, end = _find_offsets(analysis, finding)
        if start > last or end < first:
            continue
        diagnostics = [_make_diagnostic(analysis, finding)]
        if finding.fix is not None:
            edits = _convert_edits(analysis, finding.fix.edits)
            result.append(
                types.CodeAction(
                    _describe_fix(finding),
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=diagnostics,
                    is_preferred=finding.fix.safe,
                    edit=types.WorkspaceEdit({uri: edits}),
                )
            )
        ignoring = _make_ignore_edit(analysis, finding) if finding.code[4] != "0" else None
        if ignoring is not None:
            scope = "in this table" if analysis.is_table else "on this line"
            result.append(
                types.CodeAction(
                    f"Ignore {finding.code} ({finding.name}) {scope}",
                    kind=types.CodeActionKind.QuickFix,
                    diagnostics=diagnostics,
                    edit=types.WorkspaceEdit({uri: [ignoring]}),
                )
            )
    safe = _convert_edits(analysis, select_edits(analysis.report)[0])
    if safe:
        result.append(
            types.CodeAction(
                "Apply all safe fixes",
                kind=types.CodeActionKind.SourceFixAll,
                edit=types.WorkspaceEdit({uri: safe}),
            )
        )
    return result


def _describe_fix(finding: Finding) -> str:
    assert finding.fix is not None
    warning_text = "" if finding.fix.safe else " (look at the result)"
    if finding.suggestion is not None:
        return escape_unprintable(f"Change to '{finding.suggestion}'{warning_text}")
    return f"Fix {finding.code} ({finding.name}){warning_text}"


def _convert_edits(analysis: DocumentAnalysis, edits: Iterable[Edit]) -> list[types.TextEdit]:
    result = []
    data = analysis.source.data
    is_table = analysis.is_table and not analysis.text.content.isascii()
    byte_offset = characters = 0
    for edit in sorted(edits, key=lambda edit: edit.start):
        start, end = edit.start, edit.end
        if is_table:
            # Fixes of tables count bytes, editors count characters.
            characters += len(data[byte_offset:start].decode())
            byte_offset, start, end = start, characters, characters + len(data[start:end].decode())
        result.append(types.TextEdit(analysis.text.range(start, end), edit.text))
    return result


def _make_ignore_edit(analysis: DocumentAnalysis, finding: Finding) -> types.TextEdit | None:
    """Return the edit that makes the linter ignore a finding; None if there is no place for it.

    In XML it is a comment at the end of the line, in a table a line of the header.
    """
    if finding.line is None:
        return None
    if analysis.is_table:
        header = _ENDS_HEADER.search(analysis.text.content)
        if header is None:
            return None
        edit_range = analysis.text.range(header.start(2), header.start(2))
        return types.TextEdit(edit_range, f"osimlite: ignore {finding.code}{header[1]}")
    line = analysis.source.lines[finding.line - 1]
    end = analysis.source.line_start(finding.line) + len(line)
    return types.TextEdit(
        analysis.text.range(end, end), f" <!-- osimlite: ignore {finding.code} -->"
    )
