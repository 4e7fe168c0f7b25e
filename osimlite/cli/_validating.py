"""Implementation of ``osimlite validate``, separate from its options so that it starts without typer."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.files import read_standard_input, unsaved
from osimlite.base.text import format_count, join_words
from osimlite.cli._console import complain, print_diff, print_for_programs, say, show, wants_colour
from osimlite.cli._options import resolve_folders
from osimlite.cli._progress import progress_bar
from osimlite.errors import MissingFileError, OsimliteError
from osimlite.lint.config import Config, parse_codes
from osimlite.lint.diagnostic import Report, Severity
from osimlite.lint.many import check_files, find_settings
from osimlite.lint.project_files import find_project_files
from osimlite.lint.reporters import FOR_PEOPLE, FORMATS, render

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from osimlite.io.document.source import Source


def validate_paths(
    paths: list[str],
    *,
    format: str = "full",
    select: list[str] | None = None,
    ignore: list[str] | None = None,
    fail_on: str | None = None,
    fix: bool = False,
    unsafe_fixes: bool = False,
    diff: bool = False,
    baseline: str | None = None,
    write_baseline: str | None = None,
    geometry: Sequence[Path] | None = None,
    classes: Sequence[str] | None = None,
    target_version: str = "",
    statistics: bool = False,
    no_cache: bool = False,
    everything: bool = False,
    stdin_filename: str | None = None,
    only_ours: bool = False,
) -> int:
    """Check files and folders, print the report, and return the exit code.

    Args:
        paths: files and folders; "-" is standard input.
        format: format of the report.
        select: rules to run.
        ignore: rules to skip.
        fail_on: lowest severity for which the exit code is 1.
        fix: whether to apply safe fixes.
        unsafe_fixes: whether to apply all fixes.
        diff: whether to print the changes of the fixes instead of writing them.
        baseline: file with findings to leave out.
        write_baseline: file to write the present findings to.
        geometry: further folders with meshes.
        classes: files with classes of plug-ins.
        target_version: version of OpenSim that will read the files.
        statistics: whether to print counts by rule instead of findings.
        no_cache: whether to check files again although the cache has their findings.
        everything: whether to print every finding instead of folding similar ones.
        stdin_filename: path of the file whose content standard input provides.
        only_ours: whether to skip XML files that are not OpenSim's.

    Returns:
        0 without findings of `fail_on` or worse, 1 with some, 2 if a file could not be processed.
        With `diff`, 1 if a fix would change a file. With `write_baseline`, always 0.

    Raises:
        OsimliteError: an option is invalid, a path does not exist, or standard input is to be fixed
            in place.
    """
    folders = resolve_folders(geometry)
    check_option_values(format, fail_on)
    config = Config(
        parse_codes(select),
        parse_codes(ignore),
        mesh_paths=tuple(str(path.resolve()) for path in folders),
        classes=tuple(map(os.path.abspath, classes or ())),
        target_version=target_version,
    )
    if "-" in paths and (fix or unsafe_fixes) and not diff:
        raise OsimliteError("standard input cannot be fixed in place; use --diff")
    if "-" in paths and stdin_filename is not None:
        # The other files of the project see this content in place of the file on disk.
        unsaved[os.path.realpath(stdin_filename)] = read_standard_input()
        paths = [stdin_filename if path == "-" else path for path in paths]
    skipped: list[str] = []
    files = find_project_files(paths, only_ours=only_ours, passed=skipped)
    failed = False
    if diff:
        diff_counts = [_show_diff(path, config, unsafe=unsafe_fixes) for path in files]
        count, unsafe_count, unread = (
            sum(counts[index] for counts in diff_counts) for index in range(3)
        )
        say(f"Would apply {_count_fixes(count)}{_describe_unsafe_fixes(unsafe_count)}.", err=True)
        return 2 if unread else int(count > 0)
    if fix or unsafe_fixes:
        count, unsafe_count, failed = _fix_files(files, config, unsafe=unsafe_fixes)
        say(f"Applied {_count_fixes(count)}{_describe_unsafe_fixes(unsafe_count)}.", err=True)
    with progress_bar("checking", len(files)) as progress:
        report = check_files(files, config, cached=not no_cache, progress=progress)
    report.passed = skipped
    if write_baseline is not None:
        from osimlite.lint.baseline import write_baseline as write

        count = write(write_baseline, report)
        say(f"{write_baseline}: {format_count(count, 'finding')}")
        return 0
    if baseline is not None:
        from osimlite.lint.baseline import subtract_baseline

        report = subtract_baseline(baseline, report)
    if statistics:
        show(_format_statistics(report, everything))
    else:
        # Narrower lines break every message, and longer ones are hard to read.
        width = min(max(get_terminal_width(), 40), 120)
        text = render(report, format, colour=wants_colour(), width=width, everything=everything)
        (show if format in FOR_PEOPLE else print_for_programs)(text)
    threshold = Severity(fail_on) if fail_on is not None else _find_threshold(files)
    return 2 if failed else int(bool(report.at_least(threshold)))


def check_option_values(format: str, fail_on: str | None) -> None:
    """Check the values of --format and --fail-on.

    Args:
        format: value of --format.
        fail_on: value of --fail-on.

    Raises:
        OsimliteError: a value is unknown.
    """
    for option, value, known_values in (
        ("--fail-on", fail_on, tuple(Severity)),
        ("--format", format, FORMATS),
    ):
        if value is not None and value not in known_values:
            raise OsimliteError(
                f"{option} must be one of {join_words(known_values)}, not '{value}'"
            )


def _read_source(path: str) -> Source:
    from osimlite.io.document.source import Source

    if path == "-":
        return Source(read_standard_input(), "<stdin>")
    return Source.from_file(path)


def _check_source(source: Source, config: Config) -> Report:
    """Return the report on one file, with the settings of its folder and of the command line."""
    from osimlite.lint.engine import make_subject, run_rules

    assert source.file is not None
    # Rules that measure paths and muscles have no fixes, so measuring is not needed here.
    return run_rules(
        make_subject(source, find_settings(source.file).config_for(source.file, config)),
        measure=False,
    )


def _find_threshold(files: list[str]) -> Severity:
    """Return the severity in the settings of the first file for which the exit code is 1."""
    return find_settings(files[0]).fail_on or Severity.ERROR if files else Severity.ERROR


def _apply_fixes(
    source: Source,
    config: Config,
    unsafe: bool,
    make_source: Callable[[list[bytes | memoryview]], Source],
) -> tuple[Source, int, int]:
    """Apply fixes until none is left.

    Args:
        source: text of the file.
        config: settings of the command line.
        unsafe: whether to apply fixes that may change the meaning, too.
        make_source: function that makes the source of the next round from the pieces of the fixed
            text.

    Returns:
        The fixed file, the number of fixes, and the number of remaining unsafe fixes.
    """
    from osimlite.lint.fixes import apply_fixes_in_pieces

    total = unsafe_count = 0
    # A fix can reveal further findings: a misspelt set hides the errors of its members. Ten rounds
    # end fixes that undo each other.
    for _ in range(10):
        report = _check_source(source, config)
        pieces, count = apply_fixes_in_pieces(source, report, unsafe=unsafe)
        if not count:
            unsafe_count = sum(finding.fix is not None for finding in report.findings)
            break
        total += count
        source = make_source(pieces)
    return source, total, unsafe_count


def _fix_files(files: list[str], config: Config, unsafe: bool) -> tuple[int, int, bool]:
    """Fix files in place.

    Returns:
        Number of fixes, number of remaining unsafe fixes, and whether a file could not be fixed.
    """
    total = guesses = 0
    failed = False
    for path in files:
        try:
            count, unsafe_count = _fix_file(path, config, unsafe)
        except MissingFileError:
            # The check that follows reports the missing file.
            continue
        except OsimliteError as error:
            complain(error)
            failed = True
            continue
        total += count
        guesses += unsafe_count
    return total, guesses, failed


def _fix_file(path: str, config: Config, unsafe: bool) -> tuple[int, int]:
    """Fix a file in place.

    Returns:
        Number of fixes, and number of remaining unsafe fixes.
    """
    from osimlite.base.files import open_atomically

    def replace_file(pieces: list[bytes | memoryview]) -> Source:
        """Replace the file by a fixed text in pieces, and read it again.

        Returns:
            Source of the new text.
        """
        with open_atomically(path) as stream:
            stream.writelines(pieces)
        pieces.clear()
        return _read_source(path)

    _, count, unsafe_count = _apply_fixes(_read_source(path), config, unsafe, replace_file)
    return count, unsafe_count


UNREADABLE = ("OSIM001", "OSIM801")
"""Rules for files that are not XML or not a table; such files are not checked further, nor fixed."""


def _count_fixes(count: int) -> str:
    return f"{count} fix" if count == 1 else f"{count} fixes"


def _describe_unsafe_fixes(count: int) -> str:
    if not count:
        return ""
    return f"; {count} probable {'fix needs' if count == 1 else 'fixes need'} --unsafe-fixes"


def _show_diff(path: str, config: Config, unsafe: bool) -> tuple[int, int, bool]:
    """Print what the fixes of a file would change.

    Returns:
        Number of fixes, number of remaining unsafe fixes, and whether the file cannot be read after
        them.
    """
    from osimlite.io.document.source import Source

    source = _read_source(path)
    fixed, count, unsafe_count = _apply_fixes(
        source, config, unsafe, lambda pieces: Source(b"".join(pieces), source.file)
    )
    print_diff(source.text, fixed.text, path, path)
    unread = next(
        (
            finding
            for finding in _check_source(fixed, config).findings
            if finding.code in UNREADABLE
        ),
        None,
    )
    if unread is not None:
        complain(f"{path}:{unread.line}:{unread.column}: {unread.message}")
    return count, unsafe_count, unread is not None


def get_terminal_width() -> int:
    """Return the number of columns of the terminal, by default 80."""
    if not sys.stdout.isatty():
        return 80
    import shutil

    return shutil.get_terminal_size((80, 24)).columns


def _format_statistics(report: Report, show_all: bool) -> str:
    from osimlite.lint.registry import all_rules
    from osimlite.lint.reporters.terminal import (
        describe_skipped,
        describe_unmeasured,
        format_summary,
    )

    rule_by_code = {rule.code: rule for rule in all_rules()}
    rows = [
        f"{count:6d}  {code}  {rule_by_code[code].name}"
        for code, count in report.codes.most_common()
    ]
    return (
        "\n".join(
            [
                *rows,
                format_summary(report),
                *filter(None, [describe_skipped(report, show_all), describe_unmeasured(report)]),
            ]
        )
        + "\n"
    )
