"""Colours of a terminal and the closing line, shared by the formats that people read."""

from __future__ import annotations

from osimlite.base.text import visible
from osimlite.lint.diagnostic import Report, Severity

_CODES = {
    Severity.ERROR: "1;31",
    Severity.WARNING: "1;33",
    Severity.INFO: "1;34",
    "strong": "1",
    "dim": "2",
    "good": "32",
    "hint": "36",
}


def painted(text: str, style: Severity | str, colour: bool) -> str:
    """The text in a colour, or as it is."""
    return f"\033[{_CODES[style]}m{text}\033[0m" if colour and text else text


def summary(report: Report, colour: bool = False) -> str:
    """``3 errors, 1 warning in 2 files``."""
    counts = (
        (Severity.ERROR, len(report.errors)),
        (Severity.WARNING, len(report.warnings)),
        (Severity.INFO, len(report.infos)),
    )
    parts = [
        painted(f"{count} {_plural(severity.value, count)}", severity, colour)
        for severity, count in counts
        if count
    ]
    files = f"{report.checked} {_plural('file', report.checked)}"
    known = f", besides {report.known} of the baseline" if report.known else ""
    if not parts:
        return painted(f"Nothing found in {files}{known}.", "good", colour)
    return f"Found {', '.join(parts)} in {files}{known}."


def unmeasured(report: Report) -> str:
    """Return the line about rules that were not measured, and why; nothing if all were."""
    if not report.unmeasured:
        return ""
    count = len(report.unmeasured) - 1
    more = f" (and {count} more {_plural('file', count)})" if count else ""
    return visible(f"{report.unmeasured[0]}{more}.")


def passed(report: Report, everything: bool) -> str:
    """How many files of folders are none of OpenSim's, or which those are; nothing if all are."""
    if not report.passed:
        return ""
    if everything:
        return visible(f"Not OpenSim's: {', '.join(report.passed)}.")
    count = len(report.passed)
    return f"{count} {_plural('file', count)} {'is' if count == 1 else 'are'} none of OpenSim's."


def _plural(noun: str, count: int) -> str:
    return noun if count == 1 or noun == "info" else f"{noun}s"
