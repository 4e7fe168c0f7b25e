"""One line for each finding."""

from __future__ import annotations

from osimlite.base.text import visible
from osimlite.lint.diagnostic import Report
from osimlite.lint.reporters.fold import Fold, folded, told
from osimlite.lint.reporters.style import painted, passed, summary, unmeasured


def render(report: Report, *, colour: bool = False, everything: bool = False) -> str:
    """``file:line:column: severity code message`` for each finding, and a closing line."""
    folds = folded(report.findings, everything=everything)
    closing = " ".join(
        filter(
            None,
            (summary(report, colour), told(folds), passed(report, everything), unmeasured(report)),
        )
    )
    return "\n".join([*(_line(fold, colour) for fold in folds), closing]) + "\n"


def _line(fold: Fold, colour: bool) -> str:
    finding = fold.first
    counts = (("like this", fold.more), ("in other files", fold.elsewhere))
    more = "".join(f"; {len(result)} more {what}" for what, result in counts if result)
    hint = f" (did you mean '{finding.suggestion}'?)" if finding.suggestion is not None else ""
    words = visible(f"{finding.message}{hint}{more}")
    severity = painted(finding.severity.value, finding.severity, colour)
    place = painted(visible(finding.place), "strong", colour)
    return f"{place}: {severity} {finding.code} {words}"
