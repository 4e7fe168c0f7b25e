"""Findings of the linter in public projects, as two tables in Markdown.

    python benchmarks/public_projects.py FOLDER...

Each FOLDER is a checkout of a project. The first table has a row for each project: its commit, the
number of files of each kind, and the number of findings of each severity. The second has a row for
each rule: the number of its findings, and of the files and projects that have them.
"""

from __future__ import annotations

import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from osimlite.lint import Finding, validate
from osimlite.lint.project_files import TABLE_SUFFIXES, find_project_files

FILE_KINDS = ("models", "setups", "tables")
SEVERITIES = ("error", "warning", "info")


class Project(NamedTuple):
    """Files and findings of a project."""

    name: str
    commit: str
    """Abbreviated commit; empty outside a repository."""
    files: Counter[str]
    """Number of files of each kind."""
    findings: list[Finding]


def find_commit(folder: Path) -> str:
    """Return the abbreviated commit of a checkout; empty if the folder is no repository."""
    # Ten digits stay unambiguous in large repositories.
    command = ["git", "-C", str(folder), "rev-parse", "--short=10", "HEAD"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def get_file_kind(file: str) -> str:
    """Return whether a project file is one of "models", "setups" and "tables"."""
    # Some projects have suffixes in upper case.
    name = file.lower()
    if name.endswith(TABLE_SUFFIXES):
        return "tables"
    return "models" if name.endswith(".osim") else "setups"


def count_file_kinds(files: Iterable[str]) -> Counter[str]:
    """Return the number of files of each kind."""
    return Counter(get_file_kind(file) for file in files)


def format_row(*cells: object) -> str:
    """Return a line of a table in Markdown."""
    return "| " + " | ".join(map(str, cells)) + " |"


def format_projects(projects: list[Project]) -> list[str]:
    """Return the lines of the table of projects."""
    lines = [
        format_row("project", "commit", *FILE_KINDS, "errors", "warnings", "infos"),
        format_row(*["---"] * 8),
    ]
    for project in projects:
        severities = Counter(str(finding.severity) for finding in project.findings)
        counts = [project.files[kind] for kind in FILE_KINDS]
        counts += [severities[severity] for severity in SEVERITIES]
        lines.append(format_row(project.name, project.commit, *counts))
    return lines


def format_rules(projects: list[Project]) -> list[str]:
    """Return the lines of the table of rules."""
    counts: Counter[tuple[str, str]] = Counter()
    files = defaultdict(set)
    names = defaultdict(set)
    for project in projects:
        for finding in project.findings:
            rule = (finding.code, finding.name)
            counts[rule] += 1
            files[rule].add(finding.file)
            names[rule].add(project.name)
    lines = [
        format_row("rule", "name", "findings", "files", "projects"),
        format_row(*["---"] * 5),
    ]
    for rule in sorted(counts):
        lines.append(format_row(*rule, counts[rule], len(files[rule]), len(names[rule])))
    return lines


def main(folders: list[str]) -> None:
    projects = []
    for folder in map(Path, folders):
        projects.append(
            Project(
                folder.resolve().name,
                find_commit(folder),
                count_file_kinds(find_project_files([folder])),
                list(validate(folder).findings),
            )
        )
    print("\n".join([*format_projects(projects), "", *format_rules(projects)]))


if __name__ == "__main__":
    main(sys.argv[1:])
