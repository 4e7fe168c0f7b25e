"""JUnit XML: every model a test case, failed by its errors and warnings."""

from __future__ import annotations

from lxml import etree

from osimlite.base.text import harmless, visible
from osimlite.lint.diagnostic import Finding, Report, Severity


def render(report: Report) -> str:
    """One test suite; a model without findings is not named, only counted."""
    by_file: dict[str, list[Finding]] = {}
    for finding in report.findings:
        by_file.setdefault(finding.file or "model", []).append(finding)
    failed = sum(1 for findings in by_file.values() if any(map(_fails, findings)))
    counts = {
        "tests": str(max(report.checked, len(by_file))),
        "failures": str(failed),
        "errors": "0",
    }
    suites = etree.Element("testsuites", {"name": "osimlite", **counts})
    suite = etree.SubElement(suites, "testsuite", {"name": "osimlite", **counts})
    for file, findings in by_file.items():
        case = etree.SubElement(suite, "testcase", name=visible(file), classname="osimlite")
        bad = [finding for finding in findings if _fails(finding)]
        if bad:
            message = f"{len(bad)} finding{'s' if len(bad) != 1 else ''}"
            etree.SubElement(case, "failure", message=message).text = "\n".join(map(str, bad))
        rest = [finding for finding in findings if not _fails(finding)]
        if rest:
            etree.SubElement(case, "system-out").text = "\n".join(map(str, rest))
    for number in range(report.checked - len(by_file)):
        etree.SubElement(
            suite, "testcase", name=f"without findings {number + 1}", classname="osimlite"
        )
    body = harmless(etree.tostring(suites, encoding="unicode", pretty_print=True))
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + body


def _fails(finding: Finding) -> bool:
    return finding.severity is not Severity.INFO
