"""One line for each finding."""

from __future__ import annotations

from osimlite.lint.diagnostic import Finding, Report
from osimlite.lint.reporters.style import painted, summary
from osimlite.text import visible


def render(report: Report, *, colour: bool = False) -> str:
    """``file:line:column: severity code message`` for each finding, and a closing line."""
    return "\n".join([*(_line(finding, colour) for finding in report.findings), summary(report, colour)]) + "\n"


def _line(finding: Finding, colour: bool) -> str:
    hint = f" (did you mean '{finding.suggestion}'?)" if finding.suggestion is not None else ""
    words = visible(f"{finding.message}{hint}")
    severity = painted(finding.severity.value, finding.severity, colour)
    place = painted(visible(finding.place), "strong", colour)
    return f"{place}: {severity} {finding.code} {words}"
