"""The registry of rules, and running them.

A rule is a function of the subject and of `found`, which it calls once per finding. Its docstring
is its page.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from inspect import cleandoc
from pkgutil import iter_modules
from typing import Any, Literal, Unpack

from osimlite.base.records import dataclass, replace
from osimlite.base.text import brief, listed
from osimlite.errors import SpecialFileError
from osimlite.io.document.reader import collector_paused
from osimlite.io.document.source import Position, Source
from osimlite.io.document.survey import Survey, survey
from osimlite.lint import rules
from osimlite.lint.checked import Checked, Where
from osimlite.lint.config import Config, Threshold
from osimlite.lint.construction import CONSTRUCTION
from osimlite.lint.diagnostic import NOT_MEASURED, Finding, Fix, Report, Severity
from osimlite.lint.faults import Fault, faults_in
from osimlite.lint.measures import MEASURES
from osimlite.lint.subject import Subject
from osimlite.lint.suffixes import is_document, is_table
from osimlite.lint.suppressions import Suppression
from osimlite.schema.base import Object
from osimlite.schema.model import Model
from osimlite.schema.registry import let_count

ERROR, WARNING, INFO = Severity.ERROR, Severity.WARNING, Severity.INFO

FAMILIES = {
    "0": "text",
    "1": "structure",
    "2": "values",
    "3": "references",
    "4": "topology",
    "5": "physics",
    "6": "paths",
    "7": "files",
    "8": "data",
    "9": "trials",
}
"""The families of rules by the first digit of their codes."""


@dataclass(frozen=True, slots=True)
class FindingSink:
    """What a rule calls for each finding of a subject."""

    rules: dict[str, Rule]
    subject: Checked
    findings: list[Finding]

    def __call__(
        self,
        message: str,
        item: Object | None = None,
        *,
        fault: str = "",
        at: Position | None = None,
        severity: Severity | None = None,
        suggestion: str | None = None,
        certain: bool = False,
        fix: Fix | None = None,
        **where: Unpack[Where],
    ) -> None:
        """Note one finding; where it is, is said as in :meth:`Subject.position`, or by `at`.

        A rule that tells faults apart says which it is, by its name; what nobody wants to hear of
        is passed over.

        Of a rule about tables or documents that mends, a suggestion is a mend: safe if it is
        `certain` or differs in letter case alone.
        """
        rule, subject = self.rules.get(fault), self.subject
        if rule is None:
            return
        if at is None and (item is not None or where.get("number") is not None):
            at = subject.position(item, **where)
        line, column, length = at if at is not None else (None, None, 1)
        if rule.mends and rule.about != "model" and suggestion is not None and at is not None:
            named = where.get("word") or (
                item and getattr(item, where.get("attribute") or where.get("tag") or "name")
            )
            fix = fix or subject.replacing(at, named, suggestion, certain=certain)
        elif subject.upgraded:
            # What is said of an upgraded document need not be said of its text.
            fix = None
        self.findings.append(
            Finding(
                rule.code,
                rule.name,
                subject.config.severity_of(rule, severity or rule.severity_in(subject.version)),
                brief(message),
                subject.file,
                line,
                column,
                max(1, length),
                subject.path(item),
                suggestion,
                # Nor need what is said of one that was guessed at.
                None if subject.sure_until is not None else fix,
            )
        )


Check = Callable[[Any, FindingSink], None]
Mends = Literal["", "safe", "unsafe", "both"]


@dataclass(frozen=True, slots=True)
class Rule:
    """One registered rule.

    `severity` is that of its findings unless it says otherwise of one; `before` has another for
    documents older than a version, where OpenSim does something else with them. `mends` says of
    what kind its mends are, `about` what it looks
    at: ``model``, ``table``, ``document`` (a setup, or a part of one), ``measures`` (of the model's
    paths and muscles), ``construction`` (what stops the computation of a model), ``trial`` (what
    was measured of a finished one). A rule that tells faults apart is a `group`: there is a rule
    for each `fault`, all with the same `check`.
    """

    code: str
    name: str
    severity: Severity
    check: Check
    before: tuple[int, Severity] | None = None
    thresholds: tuple[Threshold, ...] = ()
    mends: Mends = ""
    about: str = "model"
    fault: Fault | None = None
    group: str = ""

    @property
    def family(self) -> str:
        """The family the code belongs to."""
        return FAMILIES[self.code[4]]

    @property
    def page(self) -> str:
        """What it does, why that is bad, an example and the same mended: the paragraphs of the docstring.

        The example stands there once, its lines marked as in a diff: `-` what fails, `+` what mends
        it.
        """
        if self.fault is not None:
            return self.fault.page(f"{self.code[:-2]} {self.group}")
        summary, what, why, example = cleandoc(self.check.__doc__ or "").split("\n\n", 3)
        fence, *lines, end = example.splitlines()
        fails, mended = (
            "\n".join(line[2:] for line in lines if line[:1] != left_out) for left_out in "+-"
        )
        return (
            f"{summary}\n\n## What it does\n{what}\n\n## Why is this bad\n{why}\n\n"
            f"## Example\n{fence}\n{fails}\n{end}\n\n## Use instead\n{fence}\n{mended}\n{end}"
        )

    @property
    def summary(self) -> str:
        """The first line of the page."""
        told = (
            self.fault.summary
            if self.fault is not None
            else (self.check.__doc__ or "").partition("\n")[0]
        )
        return told.rstrip(".")

    def severity_in(self, version: int | None) -> Severity:
        """The severity of its findings in a document of a version; None stands for the current one."""
        if self.before is not None and version is not None and version < self.before[0]:
            return self.before[1]
        return self.severity

    def is_called(self, word: str) -> bool:
        """Whether `word` is this rule's code, the beginning of it, its name or that of its group."""
        return bool(word) and (
            self.code.startswith(word.upper()) or word in (self.name, self.group)
        )

    def matches(self, word: str) -> bool:
        """Whether the rule is called so, or `word` is its family."""
        return self.is_called(word) or word in (self.family, "ALL")


_RULES: dict[str, Rule] = {}
_GROUPS: dict[str, Rule] = {}
_NAMES: set[str] = set()


def rule(
    code: str,
    name: str,
    *,
    severity: Severity,
    before: tuple[int, Severity] | None = None,
    thresholds: tuple[Threshold, ...] = (),
    mends: Mends = "",
    about: str = "model",
    faults: str = "",
    frames: Mapping[str, str] | None = None,
) -> Callable[[Check], Check]:
    """Register a function as the rule `code`; the other arguments are those of :class:`Rule`.

    With `faults` it is a group: these are listed as :mod:`osimlite.lint.faults` says, with examples
    that stand in `frames`.
    """

    def register(check: Check) -> Check:
        whole = Rule(code, name, severity, check, before, thresholds, mends, about)
        if not faults:
            _add(_RULES, whole)
            return check
        _add(_GROUPS, whole)
        for fault in faults_in(faults, frames or {}):
            own: Any = {
                "code": code + fault.number,
                "name": fault.name,
                "mends": fault.mends,
                "group": name,
            }
            _add(_RULES, replace(whole, severity=Severity(fault.severity), fault=fault, **own))
        return check

    return register


def _add(table: dict[str, Rule], rule: Rule) -> None:
    if not _NAMES.isdisjoint((rule.code, rule.name)):
        raise ValueError(f"rule {rule.code} {rule.name} is registered twice")
    _NAMES.update((rule.code, rule.name))
    table[rule.code] = rule


APART = {"document": ("setup_", "moco"), "table": ("table", "marker_table"), "trial": ("trial_",)}
"""How the names of modules begin whose rules are about these alone: nobody else loads them."""


@cache
def all_rules(about: str = "") -> tuple[Rule, ...]:
    """Every rule, by code; if it is said what the rules are about, perhaps none that are about something else."""
    others = tuple(
        name for kind, names in APART.items() if about not in ("", kind) for name in names
    )
    for module in iter_modules(rules.__path__):
        if not module.name.startswith(others):
            import_module(f"{rules.__name__}.{module.name}")
    return tuple(_RULES[code] for code in sorted(_RULES))


def groups() -> tuple[Rule, ...]:
    """What rules with one beginning of their codes have in common, by code."""
    all_rules()
    return tuple(_GROUPS[code] for code in sorted(_GROUPS))


def check_source(source: Source, config: Config | None = None) -> Report:
    """Check a text: a table if its file is called so, else a document."""
    subject = subject_in(source, config)
    report = run(subject)
    if report.findings and source.file is not None:
        report.texts[source.file] = subject.text
    return report


@collector_paused()
def subject_in(source: Source, config: Config | None = None) -> Checked:
    """A text to check; what it is, the name of its file tells."""
    use_classes(config)
    if source.file is not None and is_table(source.file):
        from osimlite.lint.table import Table

        return Table(source.data, source.file, config)
    return _subject_of(survey(source, of=Object if is_document(source.file) else Model), config)


def subject_of(file: str, config: Config | None = None) -> Checked:
    """A file to check; MissingFileError if there is none. What it is, its name tells."""
    try:
        return subject_in(Source.of_file(file), config)
    except SpecialFileError as fault:
        return _subject_of(Survey(Source(b"", file), None, [fault]), config)


def use_classes(config: Config | None) -> None:
    """Let the classes of plug-ins count that a configuration names, and no others."""
    if config is None or not config.classes:
        let_count({})
        return
    from osimlite.io.document.plugins import use

    use(config.classes)


def _subject_of(found: Survey, config: Config | None) -> Subject:
    if not is_document(found.source.file) or (
        found.document and isinstance(found.document.top, Model)
    ):
        return Subject(found, config)
    from osimlite.lint.setup import Setup

    return Setup(found, config)


@collector_paused()
def run(subject: Checked, *, measure: bool = True, recall: bool = False) -> Report:
    """Run every rule that is wanted, and return all findings sorted by place.

    Args: subject: what is checked. measure: whether rules run that are about what is measured of
        paths and muscles, which takes longer. recall: whether they run too where it was measured
        before.
    """
    findings: list[Finding] = []
    wanted = [
        known
        for known in all_rules(subject.about)
        if subject.config.wants(known) and subject.is_for(known)
    ]
    measuring = [known for known in wanted if known.about == MEASURES]
    building = [known for known in wanted if known.about == CONSTRUCTION]
    why_not = unbuilt = ""
    if building:
        unbuilt = subject.find_obstacles(anew=measure) if measure or recall else "nobody asked"
    if measuring:
        why_not = subject.unmeasured(anew=measure) if measure or recall else "nobody asked"
    left_out = [*(measuring if why_not else []), *(building if unbuilt else [])]
    # What stops a computation is not reported where another rule has reported its cause.
    wanted.sort(key=lambda known: known.about == CONSTRUCTION)
    checks: dict[Check, dict[str, Rule]] = {}
    for known in wanted:
        if known not in left_out:
            checks.setdefault(known.check, {})[known.name if known.group else ""] = known
    for check, told_apart in checks.items():
        check(subject, FindingSink(told_apart, subject, findings))
    if subject.sure_until is not None:
        limit = subject.sure_until
        findings = [
            f for f in findings if f.code[4] == "0" or (f.line is not None and f.line < limit)
        ]
    comments = subject.suppressions()
    if comments:
        findings = _not_ignored(subject, comments, findings, left_out)
    unique = list(dict.fromkeys(findings))
    unique.sort(key=lambda finding: (finding.line or 0, finding.column or 0, finding.code))
    why_not = why_not or unbuilt
    unmeasured = []
    if why_not and measure:
        families = listed(dict.fromkeys(sorted(known.code[:6] for known in left_out)))
        unmeasured.append(f"{subject.file or 'the model'}: rules {families}{NOT_MEASURED}{why_not}")
    return Report(unique, unmeasured=unmeasured)


MAX_SHORT_LINES = 3
"""Lines of an ignoring comment that is found by its lines; others are asked for each finding."""


def _make_ignore_test(comments: list[Suppression]) -> Callable[[Finding], bool]:
    """Return a test of whether a comment ignores a finding; it records which comments were used."""
    by_line: dict[int, list[Suppression]] = {}
    long: list[Suppression] = []
    for comment in comments:
        if comment.last - comment.first < MAX_SHORT_LINES:
            for line in range(comment.first, comment.last + 1):
                by_line.setdefault(line, []).append(comment)
        else:
            long.append(comment)

    def is_ignored(finding: Finding) -> bool:
        near = by_line.get(finding.line or 0, [])
        return any(
            [comment.covers(finding, _RULES[finding.code].is_called) for comment in (*long, *near)]
        )

    return is_ignored


def _not_ignored(
    subject: Checked, comments: list[Suppression], findings: list[Finding], left_out: list[Rule]
) -> list[Finding]:
    """The findings without those that a comment of the file ignores, and with one for each comment without use."""
    is_ignored = _make_ignore_test(comments)
    kept = [finding for finding in findings if not is_ignored(finding)]
    unused = next(known for known in all_rules() if known.name == "unused-ignore")
    if subject.config.wants(unused):
        result = FindingSink({"": unused}, subject, kept)
        for comment in comments:
            for code in comment.codes:
                named = [known for known in all_rules() if known.matches(code)]
                # Of a rule that did not run nobody can say that nothing was found.
                is_silent = any(known in left_out for known in named)
                ran = not named or (any(map(subject.config.wants, named)) and not is_silent)
                if code not in comment.used and ran:
                    result(f"nothing is found here that '{code}' would ignore", at=comment.place)
            if not comment.codes:
                result("this comment names no code to ignore", at=comment.place)
    return kept
