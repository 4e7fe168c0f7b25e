"""Linter: rules on texts, typed models and their component trees, without any simulation."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from osimlite.base.files import list_mesh_folders
from osimlite.lint.config import Config, parse_codes
from osimlite.lint.diagnostic import Finding, Report, Severity
from osimlite.lint.project_files import find_project_files

if TYPE_CHECKING:
    from pathlib import Path

    from osimlite.io.document.plugins import Paths
    from osimlite.io.document.source import Source
    from osimlite.lint.registry import all_rules
    from osimlite.schema.model import Model

__all__ = [
    "Config",
    "Finding",
    "Report",
    "Severity",
    "all_rules",
    "assert_valid",
    "parse_codes",
    "validate",
]


def validate(
    model: Model | str | Path | Source,
    *,
    select: tuple[str, ...] | list[str] | str | None = None,
    ignore: tuple[str, ...] | list[str] | str | None = None,
    classes: Paths = (),
    config: Config | None = None,
) -> Report:
    """Check a model, a setup, a table, or all files of a folder against every rule.

    Args:
        model: Model, path of a file or a folder, or Source. Findings have a line and a column
            only if there is a text.
        select: codes, prefixes of codes, or names of the rules to run; all by default.
        ignore: codes, prefixes of codes, or names of the rules to leave out.
        classes: files that declare the classes of plug-ins.
        config: complete configuration, instead of `select`, `ignore` and `classes`.

    Returns:
        Report with the findings.

    Raises:
        MissingFileError: the file is missing or cannot be read. Errors inside a file are findings.
        OsimliteError: no rule has a code in `select` or `ignore`, or a class is declared wrongly.
    """
    from osimlite.io.document.plugins import classes_in_use
    from osimlite.io.document.reader import pause_collector
    from osimlite.io.document.source import Source
    from osimlite.lint.engine import check_source, run_rules
    from osimlite.lint.subject import Subject
    from osimlite.schema.model import Model

    if config is None:
        meshes = tuple(map(str, list_mesh_folders()))
        class_paths = [classes] if isinstance(classes, str | os.PathLike) else classes
        files = tuple(map(os.path.abspath, class_paths))
        config = Config(parse_codes(select), parse_codes(ignore), mesh_paths=meshes, classes=files)
    # Plug-in classes are registered for this check only.
    with classes_in_use(config.classes):
        if isinstance(model, Model):
            return run_rules(Subject(model, config))
        if not isinstance(model, Source) and os.path.isdir(model):
            from osimlite.lint.many import check_files

            # Spawned processes would run the caller's script again.
            skipped_files: list[str] = []
            report = check_files(
                find_project_files([model], passed=skipped_files), config, cached=False, processes=1
            )
            report.passed = skipped_files
            return report
        with pause_collector():
            return check_source(
                model if isinstance(model, Source) else Source.from_file(model), config
            )


def assert_valid(
    model: Model | str | Path, *, ignore: tuple[str, ...] | list[str] | str | None = None
) -> None:
    """Fail a test with all findings unless a model has neither errors nor warnings.

    Args:
        model: model, or path of its file.
        ignore: codes or names of rules to ignore.
    """
    report = validate(model, ignore=ignore)
    failures = report.at_least(Severity.WARNING)
    assert not failures, "\n".join(map(str, failures))


def __getattr__(name: str) -> Any:
    # The rules are imported on demand: cached reports do not need them.
    if name == "all_rules":
        from osimlite.lint.registry import all_rules

        return all_rules
    raise AttributeError(f"module 'osimlite.lint' has no attribute '{name}'")
