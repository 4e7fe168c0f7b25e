"""Workflow commands by which GitHub Actions shows findings beside the changed lines."""

from __future__ import annotations

from osimlite.base.text import visible
from osimlite.lint.diagnostic import Finding, Report, Severity

_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}


def render(report: Report) -> str:
    """Return one workflow command for each finding, and one if the numeric packages are not installed."""
    notes = dict.fromkeys(note.message for note in report.missing_package_notes())
    commands = [
        *map(_command, report.findings),
        *(f"::notice title=not-measured::{_data(text)}" for text in notes),
    ]
    return "".join(f"{command}\n" for command in commands)


def _command(finding: Finding) -> str:
    properties = [("title", f"{finding.code} {finding.name}"), ("file", finding.file)]
    if finding.line is not None and finding.column is not None:
        end = finding.column + finding.length
        properties += [
            ("line", str(finding.line)),
            ("col", str(finding.column)),
            ("endColumn", str(end)),
        ]
    words = ",".join(f"{key}={_property(value)}" for key, value in properties if value is not None)
    hint = f"; did you mean '{finding.suggestion}'?" if finding.suggestion is not None else ""
    return f"::{_LEVELS[finding.severity]} {words}::{_data(finding.message + hint)}"


def _data(text: str) -> str:
    return visible(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")
