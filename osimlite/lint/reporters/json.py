"""The findings as a JSON array, for programs."""

from __future__ import annotations

from osimlite.lint.diagnostic import Report
from osimlite.text import json_lines


def render(report: Report) -> str:
    """Return an array of objects: code, name, severity, message, file, line, column, component, suggestion, fixable.

    Without the numeric packages the array ends with a note for each model that has something to measure. Its code is
    that of all rules which measure, OSIM63, and its name is "not-measured".
    """
    notes = [
        {
            "code": "OSIM63",
            "name": "not-measured",
            "severity": "info",
            "message": message,
            "file": file,
            "line": 1,
            "column": 1,
            "length": 1,
            "component": "",
            "suggestion": None,
            "fixable": False,
        }
        for file, message in report.missing_package_notes()
    ]
    return json_lines([finding.as_dict() for finding in report.findings] + notes)
