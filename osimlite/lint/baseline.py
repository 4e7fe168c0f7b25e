"""Baselines: known findings of a project that are not reported again."""

from __future__ import annotations

import json
import os
from collections import Counter
from pathlib import Path

from osimlite.base.files import read_file, write_atomically
from osimlite.base.records import replace
from osimlite.errors import OsimliteError
from osimlite.lint.diagnostic import Finding, Report

_FORMAT = 1


def write_baseline(path: str | Path, report: Report) -> int:
    """Write the findings of a report as the baseline, and return how many there are.

    Args:
        path: file of the baseline.
        report: findings of a check.

    Returns:
        Number of findings.
    """
    counts = Counter(map(_make_key, report.findings))
    findings = [[*key, count] for key, count in sorted(counts.items())]
    text = json.dumps({"format": _FORMAT, "findings": findings}, indent=1) + "\n"
    write_atomically(path, text)
    return len(report.findings)


def subtract_baseline(path: str | Path, report: Report) -> Report:
    """Return the report without the findings of the baseline; line numbers may differ.

    Args:
        path: file of the baseline.
        report: findings of a check.

    Raises:
        OsimliteError: the file is missing or is no baseline.
    """
    try:
        data = json.loads(read_file(path))
        counts = Counter({tuple(key): int(count) for *key, count in data["findings"]})
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
        raise OsimliteError(
            "this is not a baseline; write one with --write-baseline", file=str(path)
        ) from None
    new_findings = []
    for finding in report.findings:
        key = _make_key(finding)
        # Older baselines contain the code of the group.
        baseline_code = next(
            (code for code in (key[0], key[0][:7]) if counts[(code, *key[1:])] > 0), None
        )
        if baseline_code is not None:
            counts[(baseline_code, *key[1:])] -= 1
        else:
            new_findings.append(finding)
    return replace(report, findings=new_findings, known=len(report.findings) - len(new_findings))


def _make_key(finding: Finding) -> tuple[str, str, str, str]:
    file = Path(finding.file).as_posix() if finding.file is not None else ""
    # A baseline must not depend on where the project is on a machine.
    return (
        finding.code,
        file,
        finding.component,
        finding.message.replace(os.path.join(os.getcwd(), ""), ""),
    )
