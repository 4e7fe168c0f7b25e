"""What ``osimlite validate`` does, apart from its options: it starts without the library that reads options."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from osimlite.base.files import read_standard_input, unsaved
from osimlite.base.text import format_count, join_words
from osimlite.cli._console import complain, hand_over, print_diff, say, show, wants_colour
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


def run(
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
    """Check files and folders, write the report to standard output, and return the exit code."""
    folders = resolve_folders(geometry)
    expect_known(format, fail_on)
    given = Config(
        parse_codes(select),
        parse_codes(ignore),
        mesh_paths=tuple(str(path.resolve()) for path in folders),
        classes=tuple(map(os.path.abspath, classes or ())),
        target_version=target_version,
    )
    if "-" in paths and (fix or unsafe_fixes) and not diff:
        raise OsimliteError("standard input cannot be fixed in place; use --diff")
    if "-" in paths and stdin_filename is not None:
        # It is what this file would be, were it written now.
        unsaved[os.path.realpath(stdin_filename)] = read_standard_input()
        paths = [stdin_filename if path == "-" else path for path in paths]
    passed: list[str] = []
    files = find_project_files(paths, only_ours=only_ours, passed=passed)
    failed = False
    if diff:
        shown = [_show_diff(path, given, unsafe=unsafe_fixes) for path in files]
        count, left, unread = (sum(counts[index] for counts in shown) for index in range(3))
        say(f"Would apply {_count_fixes(count)}{_more(left)}.", err=True)
        return 2 if unread else int(count > 0)
    if fix or unsafe_fixes:
        count, left, failed = _fix_files(files, given, unsafe=unsafe_fixes)
        say(f"Applied {_count_fixes(count)}{_more(left)}.", err=True)
    with progress_bar("checking", len(files)) as progress:
        report = check_files(files, given, cached=not no_cache, progress=progress)
    report.passed = passed
    if write_baseline is not None:
        from osimlite.lint.baseline import write_baseline as write

        count = write(write_baseline, report)
        say(f"{write_baseline}: {format_count(count, 'finding')}")
        return 0
    if baseline is not None:
        from osimlite.lint.baseline import subtract_baseline

        report = subtract_baseline(baseline, report)
    if statistics:
        show(_statistics(report, everything))
    else:
        width = min(max(terminal_width(), 40), 120)
        text = render(report, format, colour=wants_colour(), width=width, everything=everything)
        (show if format in FOR_PEOPLE else hand_over)(text)
    worst = Severity(fail_on) if fail_on is not None else _fail_on_of(files)
    return 2 if failed else int(bool(report.at_least(worst)))


def expect_known(format: str, fail_on: str | None) -> None:
    """Raise an error for an unknown value of --format or --fail-on.

    Raises:
        OsimliteError: one is not.
    """
    for option, word, known in (
        ("--fail-on", fail_on, tuple(Severity)),
        ("--format", format, FORMATS),
    ):
        if word is not None and word not in known:
            raise OsimliteError(f"{option} must be one of {join_words(known)}, not '{word}'")


def _source(path: str) -> Source:
    from osimlite.io.document.source import Source

    if path == "-":
        return Source(read_standard_input(), "<stdin>")
    return Source.of_file(path)


def _check(source: Source, given: Config) -> Report:
    """Check one file by the settings of its folder and of the command line."""
    from osimlite.lint.engine import make_subject, run_rules

    assert source.file is not None
    # No rule about measures has a fix.
    return run_rules(
        make_subject(source, find_settings(source.file).config_for(source.file, given)),
        measure=False,
    )


def _fail_on_of(files: list[str]) -> Severity:
    """The threshold that the settings of the first file ask for."""
    return find_settings(files[0]).fail_on or Severity.ERROR if files else Severity.ERROR


def _apply_fixes(
    source: Source, given: Config, unsafe: bool, put: Callable[[list[bytes | memoryview]], Source]
) -> tuple[Source, int, int]:
    """Return the fixed file, the number of fixes, and the number of remaining unsafe fixes.

    `put` makes the source of the next round from the pieces of each round.
    """
    from osimlite.lint.fixes import apply_fixes_in_pieces

    total = left = 0
    # A fix can reveal further findings: a misspelt set hides the errors of its members.
    for _ in range(10):
        report = _check(source, given)
        pieces, count = apply_fixes_in_pieces(source, report, unsafe=unsafe)
        if not count:
            left = sum(finding.fix is not None for finding in report.findings)
            break
        total += count
        source = put(pieces)
    return source, total, left


def _fix_files(files: list[str], given: Config, unsafe: bool) -> tuple[int, int, bool]:
    """Fix files and return the number of fixes, the number of remaining unsafe fixes, and whether a file failed."""
    total = guesses = 0
    failed = False
    for path in files:
        try:
            count, left = _fix_file(path, given, unsafe)
        except MissingFileError:
            continue  # The check that follows tells of it.
        except OsimliteError as error:
            complain(error)
            failed = True
            continue
        total += count
        guesses += left
    return total, guesses, failed


def _fix_file(path: str, given: Config, unsafe: bool) -> tuple[int, int]:
    """Fix a file and return the number of fixes and of remaining unsafe fixes."""
    from osimlite.base.files import open_atomically

    def put(pieces: list[bytes | memoryview]) -> Source:
        with open_atomically(path) as stream:
            stream.writelines(pieces)
        pieces.clear()
        return _source(path)

    _, count, left = _apply_fixes(_source(path), given, unsafe, put)
    return count, left


UNREADABLE = ("OSIM001", "OSIM801")
"""Rules for files that are not XML or not a table; nothing else of such a file is checked or fixed."""


def _count_fixes(count: int) -> str:
    return f"{count} fix" if count == 1 else f"{count} fixes"


def _more(left: int) -> str:
    return f"; --unsafe-fixes would apply {left} more" if left else ""


def _show_diff(path: str, given: Config, unsafe: bool) -> tuple[int, int, bool]:
    """Print the changes of the fixes and return their number, that of unsafe ones, and whether the file is unreadable."""
    from osimlite.io.document.source import Source

    source = _source(path)
    after, count, left = _apply_fixes(
        source, given, unsafe, lambda pieces: Source(b"".join(pieces), source.file)
    )
    print_diff(source.text, after.text, path, path)
    unread = next((item for item in _check(after, given).findings if item.code in UNREADABLE), None)
    if unread is not None:
        complain(f"{path}:{unread.line}:{unread.column}: {unread.message}")
    return count, left, unread is not None


def terminal_width() -> int:
    """Return the number of columns of the terminal, by default 80."""
    if not sys.stdout.isatty():
        return 80
    import shutil

    return shutil.get_terminal_size((80, 24)).columns


def _statistics(report: Report, everything: bool) -> str:
    from osimlite.lint.registry import all_rules
    from osimlite.lint.reporters.terminal import (
        describe_skipped,
        describe_unmeasured,
        format_summary,
    )

    known = {rule.code: rule for rule in all_rules()}
    rows = [f"{count:6d}  {code}  {known[code].name}" for code, count in report.codes.most_common()]
    return (
        "\n".join(
            [
                *rows,
                format_summary(report),
                *filter(None, [describe_skipped(report, everything), describe_unmeasured(report)]),
            ]
        )
        + "\n"
    )
