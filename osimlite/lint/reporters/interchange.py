"""Reports for programs: GitHub workflow commands, JSON, JUnit XML and SARIF."""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

from osimlite import __version__
from osimlite.base.text import escape_control_sequences, escape_unprintable, format_json
from osimlite.lint.diagnostic import Finding, Report, Severity

if TYPE_CHECKING:
    from osimlite.lint.registry import Rule

_GITHUB_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "notice"}


def render_github(report: Report) -> str:
    """Return one workflow command for each finding, and one if the numeric packages are not installed."""
    notes = dict.fromkeys(note.message for note in report.missing_package_notes())
    commands = [
        *map(_format_command, report.findings),
        *(f"::notice title=not-measured::{_escape_data(text)}" for text in notes),
    ]
    return "".join(f"{command}\n" for command in commands)


def _format_command(finding: Finding) -> str:
    """Return the workflow command that shows a finding beside its line."""
    properties = [("title", f"{finding.code} {finding.name}"), ("file", finding.file)]
    if finding.line is not None and finding.column is not None:
        end = finding.column + finding.length
        properties += [
            ("line", str(finding.line)),
            ("col", str(finding.column)),
            ("endColumn", str(end)),
        ]
    words = ",".join(
        f"{key}={_escape_property(value)}" for key, value in properties if value is not None
    )
    hint = f"; did you mean '{finding.suggestion}'?" if finding.suggestion is not None else ""
    return f"::{_GITHUB_LEVELS[finding.severity]} {words}::{_escape_data(finding.message + hint)}"


def _escape_data(text: str) -> str:
    """Escape a message as GitHub's runner unescapes it.

    Returns:
        The text with escapes for per cent signs, line ends and unprintable characters.
    """
    # The per cent sign first, since the other escapes contain it.
    return escape_unprintable(text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A"))


def _escape_property(text: str) -> str:
    """Escape the value of a property, which commas and colons would end.

    Returns:
        The text with escapes for commas and colons too.
    """
    return _escape_data(text).replace(":", "%3A").replace(",", "%2C")


def render_json(report: Report) -> str:
    """Return a JSON array with one object for each finding; `Finding.as_dict` has its keys.

    Where the numeric packages are not installed, the array ends with a note for each model that has
    paths or muscles to measure. The name of a note is "not-measured", its code that of a family of
    rules that did not run, such as OSIM63.
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
    return format_json([finding.as_dict() for finding in report.findings] + notes)


def render_junit(report: Report) -> str:
    """Return JUnit XML with one test suite: a test case for each model, failed by its errors and warnings.

    A model without findings has a numbered test case without its name.
    """
    from lxml import etree

    by_file: dict[str, list[Finding]] = {}
    for finding in report.findings:
        by_file.setdefault(finding.file or "model", []).append(finding)
    failed = sum(1 for findings in by_file.values() if any(map(_is_failure, findings)))
    counts = {
        "tests": str(max(report.checked, len(by_file))),
        "failures": str(failed),
        "errors": "0",
    }
    suites = etree.Element("testsuites", {"name": "osimlite", **counts})
    suite = etree.SubElement(suites, "testsuite", {"name": "osimlite", **counts})
    for file, findings in by_file.items():
        case = etree.SubElement(
            suite, "testcase", name=escape_unprintable(file), classname="osimlite"
        )
        failures = [finding for finding in findings if _is_failure(finding)]
        if failures:
            message = f"{len(failures)} finding{'s' if len(failures) != 1 else ''}"
            etree.SubElement(case, "failure", message=message).text = "\n".join(map(str, failures))
        remarks = [finding for finding in findings if not _is_failure(finding)]
        if remarks:
            # Remarks do not fail a test; they are printed with it.
            etree.SubElement(case, "system-out").text = "\n".join(map(str, remarks))
    # Reports know the number of files without findings, not their names.
    for number in range(report.checked - len(by_file)):
        etree.SubElement(
            suite, "testcase", name=f"without findings {number + 1}", classname="osimlite"
        )
    body = escape_control_sequences(etree.tostring(suites, encoding="unicode", pretty_print=True))
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + body


def _is_failure(finding: Finding) -> bool:
    """Return whether a finding fails its test case: an error or a warning."""
    return finding.severity is not Severity.INFO


_SARIF_SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
_SARIF_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}


def render_sarif(report: Report) -> str:
    """Return a SARIF 2.1.0 log (OASIS standard) of one run: its rules that reported, and a result for each finding."""
    # The rules are imported here: reports without findings need none of them.
    from osimlite.lint.registry import all_rules

    reported_rules = [rule for rule in all_rules() if rule.code in report.codes]
    rule_indices = {rule.code: index for index, rule in enumerate(reported_rules)}
    driver = {
        "name": "osimlite",
        "version": __version__,
        "rules": [_describe_rule(rule) for rule in reported_rules],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        # Columns of osimlite count characters of Unicode, and SARIF's default is UTF-16.
        "results": [
            _describe_result(finding, rule_indices[finding.code]) for finding in report.findings
        ],
    }
    notes = [note.message for note in report.missing_package_notes()]
    if notes:
        notifications = [
            {"level": "note", "message": {"text": text}} for text in dict.fromkeys(notes)
        ]
        run["invocations"] = [
            {"executionSuccessful": True, "toolExecutionNotifications": notifications}
        ]
    return format_json({"$schema": _SARIF_SCHEMA, "version": "2.1.0", "runs": [run]})


def _describe_rule(rule: Rule) -> dict[str, Any]:
    """Return a rule as a SARIF reportingDescriptor."""
    return {
        "id": rule.code,
        "name": _to_camel_case(rule.name),
        "shortDescription": {"text": rule.summary},
        "help": {"text": rule.page, "markdown": rule.page},
        "defaultConfiguration": {"level": _SARIF_LEVELS[rule.severity]},
        "properties": {"category": rule.family},
        # Older versions filed alerts under the code of the group.
        **(
            {"deprecatedIds": [rule.code[:-2]], "deprecatedNames": [_to_camel_case(rule.group)]}
            if rule.group
            else {}
        ),
    }


def _to_camel_case(name: str) -> str:
    """Return the name of a rule in camel case, as SARIF recommends."""
    return "".join(word.capitalize() for word in name.split("-"))


def _describe_result(finding: Finding, index: int) -> dict[str, Any]:
    """Return a finding as a SARIF result.

    Args:
        finding: finding to convert.
        index: index of its rule in the list of rules.

    Returns:
        The result object.
    """
    from urllib.parse import quote

    result: dict[str, Any] = {
        "ruleId": finding.code,
        "ruleIndex": index,
        "level": _SARIF_LEVELS[finding.severity],
        "message": {"text": finding.message},
    }
    location: dict[str, Any] = {}
    if finding.file is not None:
        path = PurePath(finding.file)
        # SARIF asks for URIs; a relative path stays relative to the working folder.
        uri = path.as_uri() if path.is_absolute() else quote(os.fsencode(path.as_posix()))
        location["physicalLocation"] = {"artifactLocation": {"uri": uri}}
        if finding.line is not None and finding.column is not None:
            location["physicalLocation"]["region"] = {
                "startLine": finding.line,
                "startColumn": finding.column,
                "endColumn": finding.column + finding.length,
            }
    if finding.component:
        location["logicalLocations"] = [{"fullyQualifiedName": finding.component}]
    if location:
        result["locations"] = [location]
    if finding.suggestion is not None:
        result["properties"] = {"suggestion": finding.suggestion}
    return result
