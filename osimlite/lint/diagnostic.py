"""Findings of rules, their fixes, and reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from enum import StrEnum
from typing import Any

from osimlite.base.lazy import make_notebook_repr
from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, field
from osimlite.base.text import escape_unprintable, format_count


class Severity(StrEnum):
    """Severity of a finding.

    ERROR: OpenSim rejects the model, crashes, computes NaN, or does something other than the
        text says.
    WARNING: physically or numerically doubtful. INFO: tidiness, or something worth knowing.
    """

    ERROR = "error"
    WARNING = "warning"
    INFO = "info"

    @property
    def rank(self) -> int:
        """Rank of the severity: 0 for errors, larger for less severe findings."""
        return _RANKS[self]


class Consequence(StrEnum):
    """Consequence of a fault in OpenSim.

    REFUSES: it rejects the file or the model, crashes, or hangs, before it computes a motion.
    FAILS: it loads the model, and fails as soon as it needs the faulty part.
    NAN: it runs the model, and computes NaN.
    RUNS: it runs the model, but may compute something different from what is written.
    """

    REFUSES = "refuses"
    FAILS = "fails"
    NAN = "nan"
    RUNS = "runs"


_RANKS = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.INFO: 2}


@dataclass(frozen=True, slots=True)
class Edit:
    """Replacement of the characters from `start` to `end` by `text`; in a table offsets count bytes."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True)
class Fix:
    """Fix as text edits; `safe` if OpenSim then reads the same model, or certainly the intended one."""

    edits: tuple[Edit, ...]
    safe: bool = True


@dataclass(frozen=True, slots=True)
class Finding:
    """Finding of a rule at one position.

    Attributes:
        code: code of the rule.
        name: name of the rule.
        severity: severity of the finding.
        message: message for the user.
        file: path of the file; None for a model made in Python.
        line: line from 1; None for a model made in Python.
        column: column from 1; None for a model made in Python.
        length: number of characters that are marked.
        component: absolute path of the component; empty without one.
        suggestion: text that would be correct at this position.
        fix: change that removes the finding.
        consequence: consequence of the fault in OpenSim; None if the rule does not say.
    """

    code: str
    name: str
    severity: Severity
    message: str
    file: str | None = None
    line: int | None = None
    column: int | None = None
    length: int = 1
    component: str = ""
    suggestion: str | None = None
    fix: Fix | None = field(default=None, compare=False)
    consequence: Consequence | None = None

    @property
    def fixable(self) -> bool:
        """True if the finding has a safe fix."""
        return self.fix is not None and self.fix.safe

    @property
    def place(self) -> str:
        """``file:line:column``, as much of it as is known, else the path of the component."""
        parts = [str(part) for part in (self.file, self.line, self.column) if part is not None]
        return ":".join(parts) or self.component

    def as_dict(self) -> dict[str, Any]:
        """Return the finding as a dictionary for JSON.

        Returns:
            The fields of the finding by name, and `fixable`.
        """
        return {
            "code": self.code,
            "name": self.name,
            "severity": self.severity.value,
            "message": self.message,
            "file": self.file,
            "line": self.line,
            "column": self.column,
            "length": self.length,
            "component": self.component,
            "suggestion": self.suggestion,
            "fixable": self.fixable,
            "consequence": self.consequence and self.consequence.value,
        }

    def __str__(self) -> str:
        hint = f" (did you mean '{self.suggestion}'?)" if self.suggestion is not None else ""
        return escape_unprintable(f"{self.place}: {self.severity} {self.code} {self.message}{hint}")


NOT_RUN = " did not run: "
"""Separator between the file with its rules and the reason in `Report.unmeasured`."""


class MissingPackageNote(NamedTuple):
    """Note on a file for which some rules did not run, because numeric packages are missing."""

    file: str
    code: str  # beginning of the codes of the first of these rules
    message: str


MAX_LISTED = 5
"""Number of findings that the text of a report lists."""
MAX_LINE_LENGTH = 160
"""Largest number of letters of a finding in the text of a report."""


def _shorten_line(line: str) -> str:
    """Return a line, cut after `MAX_LINE_LENGTH` letters."""
    return line if len(line) <= MAX_LINE_LENGTH else f"{line[: MAX_LINE_LENGTH - 3]}..."


@dataclass(slots=True)
class Report:
    """All findings of one or several files, sorted by file and position.

    Attributes:
        findings: findings, sorted by file and position.
        texts: text of each file with findings, for the snippets of a reporter.
        checked: number of files.
        known: number of findings that a baseline left out.
        unmeasured: sentences about files whose models could not be measured, each with the file,
            the rules that did not run, and the reason.
        passed: paths of files that were skipped because they are not OpenSim's.
    """

    findings: list[Finding] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    checked: int = 1
    known: int = 0
    unmeasured: list[str] = field(default_factory=list)
    passed: list[str] = field(default_factory=list)

    _repr_html_ = make_notebook_repr("findings")

    def __repr__(self) -> str:
        parts = ("error", self.errors), ("warning", self.warnings), ("remark", self.infos)
        counts = ", ".join(format_count(len(part), kind) for kind, part in parts)
        lines = [f"Report: {counts} in {format_count(self.count_files(), 'file')}"]
        # The sort is stable: equal severities keep the order of the files.
        ranked = sorted(self.findings, key=lambda finding: finding.severity.rank)
        lines += [_shorten_line(str(finding)) for finding in ranked[:MAX_LISTED]]
        if (hidden_count := len(ranked) - MAX_LISTED) > 0:
            lines.append(f"... and {format_count(hidden_count, 'more finding')}")
        return "\n".join(lines)

    def count_files(self) -> int:
        """Return the number of files with findings; without findings, that of all checked files."""
        # A setup names other files, such as tables, in which there are findings, too.
        return len({finding.file for finding in self.findings}) or self.checked

    @property
    def errors(self) -> list[Finding]:
        """The findings that are errors."""
        return self._select_severity(Severity.ERROR)

    @property
    def warnings(self) -> list[Finding]:
        """The findings that are warnings."""
        return self._select_severity(Severity.WARNING)

    @property
    def infos(self) -> list[Finding]:
        """The findings that are for information."""
        return self._select_severity(Severity.INFO)

    @property
    def ok(self) -> bool:
        """True if there is no error."""
        return not self.errors

    @property
    def codes(self) -> Counter[str]:
        """Number of findings by code."""
        return Counter(finding.code for finding in self.findings)

    def missing_package_notes(self) -> list[MissingPackageNote]:
        """Return a note for each file that was not measured because numeric packages are missing.

        Reports for programs contain these notes; other reasons follow from findings, which they
        contain anyway.
        """
        notes = []
        for text in self.unmeasured:
            before, _, reason = text.partition(NOT_RUN)
            # From the right, since the name of a file can contain anything.
            file, _, families = before.rpartition(": rules ")
            if reason.startswith("they need osimlite["):
                notes.append(
                    MissingPackageNote(file, families[:6], f"rules {families}{NOT_RUN}{reason}")
                )
        return notes

    def at_least(self, severity: Severity) -> list[Finding]:
        """Return the findings of a severity or a worse one."""
        return [finding for finding in self.findings if finding.severity.rank <= severity.rank]

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __len__(self) -> int:
        return len(self.findings)

    def __str__(self) -> str:
        return "\n".join(map(str, self.findings)) or "nothing found"

    def _select_severity(self, severity: Severity) -> list[Finding]:
        return [finding for finding in self.findings if finding.severity is severity]


def merge_reports(reports: Iterable[Report]) -> Report:
    """Return one report of several, with findings in the given order."""
    merged = Report(checked=0)
    for report in reports:
        merged.findings.extend(report.findings)
        merged.texts.update(report.texts)
        merged.checked += report.checked
        merged.unmeasured += report.unmeasured
    return merged
