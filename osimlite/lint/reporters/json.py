"""The findings as a JSON array, for programs."""

from __future__ import annotations

from osimlite.base.text import json_lines
from osimlite.lint.diagnostic import Report


def render(report: Report) -> str:
    """Return an array of objects: code, name, severity, message, file, line, column, component, suggestion, fixable.

    Without the numeric packages the array ends with a note for each model that has something to
    measure. Its name is "not-measured", and its code that of a family of rules that were left out,
    such as OSIM63.
    """
    notes = [
        {
            "code": note.code,
            "name": "not-measured",
            "severity": "info",
            "message": note.message,
            "file": note.file,
            "line": 1,
            "column": 1,
            "length": 1,
            "component": "",
            "suggestion": None,
            "fixable": False,
        }
        for note in report.missing_package_notes()
    ]
    return json_lines([finding.as_dict() for finding in report.findings] + notes)
