"""The findings as a JSON array, for programs."""

from __future__ import annotations

from osimlite.lint.diagnostic import Report
from osimlite.text import json_lines


def render(report: Report) -> str:
    """An array of objects with code, name, severity, message, file, line, column, component, suggestion, fixable."""
    return json_lines([finding.as_dict() for finding in report.findings])
