"""The findings as a JSON array, for programs."""

from __future__ import annotations

from json import dumps

from osimlite.lint.diagnostic import Report


def render(report: Report) -> str:
    """An array of objects with code, name, severity, message, file, line, column, component, suggestion, fixable."""
    return dumps([finding.as_dict() for finding in report.findings], indent=2, ensure_ascii=False) + "\n"
