"""SARIF 2.1.0, the exchange format of static analysis tools (OASIS standard)."""

from __future__ import annotations

import os
from pathlib import PurePath
from typing import Any
from urllib.parse import quote

from osimlite import __version__
from osimlite.base.text import json_lines
from osimlite.lint.diagnostic import Finding, Report, Severity
from osimlite.lint.engine import Rule, all_rules

_SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
)
_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}


def render(report: Report) -> str:
    """One run with the rules that were broken and a result for each finding."""
    broken = [rule for rule in all_rules() if rule.code in report.codes]
    places = {rule.code: index for index, rule in enumerate(broken)}
    driver = {"name": "osimlite", "version": __version__, "rules": [_rule(rule) for rule in broken]}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, places[finding.code]) for finding in report.findings],
    }
    notes = [note.message for note in report.missing_package_notes()]
    if notes:
        notifications = [
            {"level": "note", "message": {"text": text}} for text in dict.fromkeys(notes)
        ]
        run["invocations"] = [
            {"executionSuccessful": True, "toolExecutionNotifications": notifications}
        ]
    return json_lines({"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]})


def _rule(rule: Rule) -> dict[str, Any]:
    return {
        "id": rule.code,
        "name": _joined(rule.name),
        "shortDescription": {"text": rule.summary},
        "help": {"text": rule.page, "markdown": rule.page},
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
        "properties": {"category": rule.family},
        # What alerts of before were filed under.
        **(
            {"deprecatedIds": [rule.code[:-2]], "deprecatedNames": [_joined(rule.group)]}
            if rule.group
            else {}
        ),
    }


def _joined(name: str) -> str:
    return "".join(word.capitalize() for word in name.split("-"))


def _result(finding: Finding, index: int) -> dict[str, Any]:
    result: dict[str, Any] = {
        "ruleId": finding.code,
        "ruleIndex": index,
        "level": _LEVELS[finding.severity],
        "message": {"text": finding.message},
    }
    location: dict[str, Any] = {}
    if finding.file is not None:
        path = PurePath(finding.file)
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
