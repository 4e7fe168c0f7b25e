"""Run the rules on a subject: read it, select the rules, apply suppressions, sort the findings."""

from __future__ import annotations

from collections.abc import Callable

from osimlite.base.text import join_words
from osimlite.errors import SpecialFileError
from osimlite.io.document.reader import pause_collector
from osimlite.io.document.source import Source
from osimlite.io.document.survey import Survey, survey_source
from osimlite.lint.checked import CheckTarget
from osimlite.lint.config import Config
from osimlite.lint.construction import CONSTRUCTION
from osimlite.lint.diagnostic import NOT_RUN, Finding, Report
from osimlite.lint.measures import MEASURES
from osimlite.lint.project_files import is_document, is_table
from osimlite.lint.registry import Check, FindingCollector, Rule, all_rules, get_rule
from osimlite.lint.subject import Subject
from osimlite.lint.suppressions import Suppression
from osimlite.schema.base import Object
from osimlite.schema.model import Model
from osimlite.schema.registry import register_plugin_classes


def check_source(source: Source, config: Config | None = None) -> Report:
    """Check a text: a table if its file name says so, otherwise a document.

    Args:
        source: text of the file.
        config: configuration of the check.

    Returns:
        The report; it has the text too if there are findings.
    """
    subject = make_subject(source, config)
    report = run_rules(subject)
    if report.findings and source.file is not None:
        report.texts[source.file] = subject.text
    return report


@pause_collector()
def make_subject(source: Source, config: Config | None = None) -> CheckTarget:
    """Return the check target of a text, chosen by the name of its file.

    Args:
        source: text of the file.
        config: configuration of the check.
    """
    activate_plugin_classes(config)
    if source.file is not None and is_table(source.file):
        from osimlite.lint.table import Table

        return Table(source.data, source.file, config)
    return _make_document_subject(
        survey_source(source, expected_class=Object if is_document(source.file) else Model), config
    )


def load_subject(file: str, config: Config | None = None) -> CheckTarget:
    """Return the check target of a file, chosen by its name; MissingFileError if the file is missing.

    Args:
        file: path of the file.
        config: configuration of the check.
    """
    try:
        # Pipes and devices are not read: they may never end.
        return make_subject(Source.from_file(file), config)
    except SpecialFileError as fault:
        return _make_document_subject(Survey(Source(b"", file), None, [fault]), config)


def activate_plugin_classes(config: Config | None) -> None:
    """Make the classes of plug-ins that a configuration names known to the reader, and no others.

    Args:
        config: configuration whose `classes` names the files of plug-in classes; None for none.
    """
    if config is None or not config.classes:
        # Classes of an earlier check in the same process must not stay.
        register_plugin_classes({})
        return
    # Imported here only, because few projects have plug-ins.
    from osimlite.io.document.plugins import use_classes

    use_classes(config.classes)


def _make_document_subject(survey: Survey, config: Config | None) -> Subject:
    if not is_document(survey.source.file) or (
        survey.document and isinstance(survey.document.top, Model)
    ):
        return Subject(survey, config)
    from osimlite.lint.setup import Setup

    return Setup(survey, config)


@pause_collector()
def run_rules(subject: CheckTarget, *, measure: bool = True, recall: bool = False) -> Report:
    """Run every selected rule, and return all findings sorted by position.

    Args:
        subject: check target, for example a model or a table.
        measure: whether to run rules that need measurements of paths and muscles, or a construction
            of the model, which takes longer.
        recall: whether to run these rules where cached results exist, even without `measure`.

    Returns:
        Report with the findings that no comment ignores.
    """
    findings: list[Finding] = []
    selected = [
        rule
        for rule in all_rules(subject.about)
        if subject.config.includes(rule) and subject.is_for(rule)
    ]
    measuring = [rule for rule in selected if rule.about == MEASURES]
    building = [rule for rule in selected if rule.about == CONSTRUCTION]
    why_not = unbuilt = ""
    if building:
        unbuilt = subject.find_obstacles(compute=measure) if measure or recall else "not requested"
    if measuring:
        why_not = subject.measure(compute=measure) if measure or recall else "not requested"
    left_out = [*(measuring if why_not else []), *(building if unbuilt else [])]
    # Failures of a computation are not reported where another rule has reported their cause.
    selected.sort(key=lambda rule: rule.about == CONSTRUCTION)
    checks: dict[Check, dict[str, Rule]] = {}
    for rule in selected:
        if rule not in left_out:
            checks.setdefault(rule.check, {})[rule.name if rule.group else ""] = rule
    for check, rules_by_fault in checks.items():
        check(subject, FindingCollector(rules_by_fault, subject, findings))
    # Text after a syntax error was guessed by the reader; findings there may be wrong.
    if subject.sure_until is not None:
        limit = subject.sure_until
        findings = [
            candidate
            for candidate in findings
            if candidate.code[4] == "0" or (candidate.line is not None and candidate.line < limit)
        ]
    comments = subject.suppressions()
    if comments:
        findings = _apply_suppressions(subject, comments, findings, left_out)
    # Two rules may find the same fault, for example by a class and by its base.
    unique = list(dict.fromkeys(findings))
    unique.sort(key=lambda finding: (finding.line or 0, finding.column or 0, finding.code))
    why_not = why_not or unbuilt
    unmeasured = []
    if why_not and measure:
        # OSIM63x stands for OSIM631 to OSIM639.
        families = join_words(dict.fromkeys(sorted(f"{rule.code[:6]}x" for rule in left_out)))
        unmeasured.append(f"{subject.file or 'the model'}: rules {families}{NOT_RUN}{why_not}")
    return Report(unique, unmeasured=unmeasured)


MAX_SHORT_LINES = 3
"""Largest number of lines of an ignoring comment that is indexed by line; longer ones are tested for each finding."""


def _make_ignore_test(comments: list[Suppression]) -> Callable[[Finding], bool]:
    """Return a test of whether a comment ignores a finding; it records which comments were used."""
    by_line: dict[int, list[Suppression]] = {}
    long_comments: list[Suppression] = []
    # Short comments are found by the line of a finding, so that thousands of findings and comments
    # do not multiply.
    for comment in comments:
        if comment.last - comment.first < MAX_SHORT_LINES:
            for line in range(comment.first, comment.last + 1):
                by_line.setdefault(line, []).append(comment)
        else:
            long_comments.append(comment)

    def is_ignored(finding: Finding) -> bool:
        on_line = by_line.get(finding.line or 0, [])
        # A list, not a generator: every comment that covers the finding counts as used.
        return any(
            [
                comment.covers(finding, get_rule(finding.code).has_name)
                for comment in (*long_comments, *on_line)
            ]
        )

    return is_ignored


def _apply_suppressions(
    subject: CheckTarget, comments: list[Suppression], findings: list[Finding], left_out: list[Rule]
) -> list[Finding]:
    """Return the findings that no comment ignores, with a finding for each unused comment."""
    is_ignored = _make_ignore_test(comments)
    remaining = [finding for finding in findings if not is_ignored(finding)]
    unused_rule = next(rule for rule in all_rules() if rule.name == "unused-ignore")
    if subject.config.includes(unused_rule):
        result = FindingCollector({"": unused_rule}, subject, remaining)
        for comment in comments:
            for code in comment.codes:
                matching_rules = [rule for rule in all_rules() if rule.matches(code)]
                # A comment for a rule that did not run may be useful.
                is_silent = any(rule in left_out for rule in matching_rules)
                ran = not matching_rules or (
                    any(map(subject.config.includes, matching_rules)) and not is_silent
                )
                if code not in comment.used and ran:
                    result(
                        f"the code '{code}' ignores nothing here; delete it", at=comment.position
                    )
            if not comment.codes:
                result("this comment names no code to ignore", at=comment.position)
    return remaining
