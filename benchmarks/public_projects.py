"""What the linter finds in checkouts of projects, as tables: python benchmarks/public_projects.py FOLDER..."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable
from pathlib import Path

from osimlite.lint import Finding, validate
from osimlite.lint.project_files import TABLE_SUFFIXES, find_project_files

KINDS = ("models", "setups", "tables")


def commit_of(folder: Path) -> str:
    """The commit that a folder is a checkout of, in short; nothing if it is none."""
    command = ["git", "-C", str(folder), "rev-parse", "--short=10", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def kinds_of(files: Iterable[str]) -> Counter[str]:
    """How many of some files are models, setups, tables."""
    return Counter(
        "tables"
        if file.lower().endswith(TABLE_SUFFIXES)
        else "models"
        if file.lower().endswith(".osim")
        else "setups"
        for file in files
    )


def row(*cells: object) -> str:
    """A line of a table."""
    return "| " + " | ".join(map(str, cells)) + " |"


def by_project(found: dict[str, tuple[str, Counter[str], list[Finding]]]) -> list[str]:
    """The projects with their commits, their files by kind and their findings by severity."""
    lines = [row("project", "commit", *KINDS, "errors", "warnings", "infos"), row(*["---"] * 8)]
    for name, (commit, kinds, findings) in found.items():
        severities = Counter(str(finding.severity) for finding in findings)
        counts = [kinds[kind] for kind in KINDS] + [
            severities[key] for key in ("error", "warning", "info")
        ]
        lines.append(row(name, commit, *counts))
    return lines


def by_rule(found: dict[str, tuple[str, Counter[str], list[Finding]]]) -> list[str]:
    """The rules with their findings, and in how many files and projects they are."""
    counts: Counter[tuple[str, str]] = Counter()
    files, projects = defaultdict(set), defaultdict(set)
    for name, (_, _, findings) in found.items():
        for finding in findings:
            rule = (finding.code, finding.name)
            counts[rule] += 1
            files[rule].add(finding.file)
            projects[rule].add(name)
    lines = [row("rule", "", "findings", "files", "projects"), row(*["---"] * 5)]
    return lines + [
        row(*rule, counts[rule], len(files[rule]), len(projects[rule])) for rule in sorted(counts)
    ]


def main(folders: list[str]) -> None:
    found = {}
    for folder in map(Path, folders):
        report = validate(folder)
        found[folder.resolve().name] = (
            commit_of(folder),
            kinds_of(find_project_files([folder])),
            list(report.findings),
        )
    print("\n".join([*by_project(found), "", *by_rule(found)]))


if __name__ == "__main__":
    main(sys.argv[1:])
