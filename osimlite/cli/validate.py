"""``osimlite validate``: say what is wrong with model files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from osimlite.document.source import Source
    from osimlite.lint import Config, Severity
    from osimlite.lint.diagnostic import Report


def validate(
    paths: Annotated[
        list[str],
        typer.Argument(
            metavar="PATH...", help="Files, folders (every .osim below), or - for standard input.", show_default=False
        ),
    ],
    format: Annotated[
        str, typer.Option("--format", help="full, concise, json, github, sarif or junit.", metavar="FORMAT")
    ] = "full",
    select: Annotated[
        list[str] | None,
        typer.Option(help="Run only these rules: codes, beginnings of codes (OSIM3), names.", show_default=False),
    ] = None,
    ignore: Annotated[
        list[str] | None, typer.Option(help="Leave these rules out; as for --select.", show_default=False)
    ] = None,
    fail_on: Annotated[
        str | None,
        typer.Option(help="What makes the exit code 1: error, warning or info.", show_default=False),
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="Mend what can be mended with certainty.")] = False,
    unsafe_fixes: Annotated[
        bool, typer.Option("--unsafe-fixes", help="Mend also what was probably meant; look at it with --diff first.")
    ] = False,
    diff: Annotated[bool, typer.Option("--diff", help="Show the mends and write nothing.")] = False,
    baseline: Annotated[
        str | None, typer.Option(help="Say nothing of the findings in this file.", metavar="FILE", show_default=False)
    ] = None,
    write_baseline: Annotated[
        str | None, typer.Option(help="Write all findings to this file and stop.", metavar="FILE", show_default=False)
    ] = None,
    mesh_path: Annotated[
        list[str] | None, typer.Option(help="Folder to look for meshes in; may be repeated.", show_default=False)
    ] = None,
    statistics: Annotated[bool, typer.Option("--statistics", help="Count findings by rule instead.")] = False,
) -> None:
    """Say what is wrong with model files: everything in one run, with line, column and the nearest right spelling.

    Exits with 0 if all is well, 1 if there are findings as bad as --fail-on, 2 if a file cannot be read.

    Example: osimlite validate walker.osim --format concise
    """
    import sys

    from osimlite.errors import OsimliteError
    from osimlite.lint import Config, Severity, checked_words
    from osimlite.lint.diagnostic import merged
    from osimlite.lint.reporters import FORMATS, render
    from osimlite.text import listed

    if fail_on is not None and fail_on not in tuple(Severity):
        raise OsimliteError(f"--fail-on is one of {listed(Severity)}, not '{fail_on}'")
    if format not in FORMATS:
        raise OsimliteError(f"--format is one of {listed(FORMATS)}, not '{format}'")
    given = Config(checked_words(select), checked_words(ignore), mesh_paths=_absolute(mesh_path or []))
    files = list(_files(paths))
    if diff:
        changed = [_show_diff(path, given, unsafe=unsafe_fixes) for path in files]
        raise typer.Exit(int(any(changed)))
    if fix or unsafe_fixes:
        count = sum(_mend(path, given, unsafe=unsafe_fixes) for path in files)
        print(f"Mended {count} {'place' if count == 1 else 'places'}.", file=sys.stderr)
    report = merged(_check(_source(path), given) for path in _with_progress(files))
    if write_baseline is not None:
        from osimlite.lint.baseline import write_baseline as write

        count = write(write_baseline, report)
        typer.echo(f"{write_baseline}: {count} {'finding' if count == 1 else 'findings'}")
        return
    if baseline is not None:
        from osimlite.lint.baseline import without_baseline

        report = without_baseline(baseline, report)
    if statistics:
        sys.stdout.write(_statistics(report))
    else:
        import shutil

        width = shutil.get_terminal_size((80, 24)).columns if sys.stdout.isatty() else 80
        colour = _wants_colour() and format in ("full", "concise")
        sys.stdout.write(render(report, format, colour=colour, width=min(max(width, 40), 120)))
    worst = Severity(fail_on) if fail_on is not None else _fail_on_of(files)
    if report.at_least(worst):
        raise typer.Exit(1)


def _files(paths: list[str]) -> Iterator[str]:
    """Every file to check, folders opened up."""
    from pathlib import Path

    from osimlite.errors import OsimliteError

    for text in paths:
        path = Path(text)
        if text != "-" and path.is_dir():
            below = sorted(path.rglob("*.osim"))
            if not below:
                raise OsimliteError("there is no .osim file in this folder", file=text)
            yield from map(str, below)
        else:
            yield text


def _source(path: str) -> Source:
    import sys

    from osimlite.document.source import Source

    if path == "-":
        return Source(sys.stdin.buffer.read(), "<stdin>")
    return Source.of_file(path)


def _check(source: Source, given: Config) -> Report:
    """Check one document by the settings of its folder and of the command line."""
    from osimlite.lint.engine import check_source
    from osimlite.lint.settings import settings_for

    assert source.file is not None
    return check_source(source, settings_for(_folder(source.file)).config_for(source.file, given))


def _folder(file: str) -> Path:
    from pathlib import Path

    return Path.cwd() if file in ("-", "<stdin>") else Path(file).resolve().parent


def _fail_on_of(files: list[str]) -> Severity:
    """The threshold that the settings of the first file ask for."""
    from osimlite.lint import Severity
    from osimlite.lint.settings import settings_for

    return settings_for(_folder(files[0])).fail_on or Severity.ERROR if files else Severity.ERROR


def _mended(path: str, given: Config, unsafe: bool) -> tuple[Source, bytes, int]:
    """A document, its bytes once everything is mended, and how many mends that took."""
    from osimlite.document.source import Source
    from osimlite.lint.fixes import mended

    source = _source(path)
    data, total = source.data, 0
    # A mend may bring another to light, as a misspelt set does with all that is in it.
    for _ in range(10):
        current = Source(data, source.file)
        data, count = mended(current, _check(current, given), unsafe=unsafe)
        total += count
        if not count:
            break
    return source, data, total


def _mend(path: str, given: Config, unsafe: bool) -> int:
    from osimlite.errors import OsimliteError
    from osimlite.files import write_atomically

    if path == "-":
        raise OsimliteError("standard input cannot be mended in place; use --diff")
    _, data, count = _mended(path, given, unsafe)
    if count:
        write_atomically(path, data)
    return count


def _show_diff(path: str, given: Config, unsafe: bool) -> bool:
    """Print what mending would change; whether it would change anything."""
    import difflib
    import sys

    from osimlite.document.source import Source

    source, data, count = _mended(path, given, unsafe)
    new = Source(data).text.splitlines(keepends=True)
    sys.stdout.writelines(difflib.unified_diff(source.text.splitlines(keepends=True), new, path, path))
    return bool(count)


def _absolute(paths: list[str]) -> tuple[str, ...]:
    from pathlib import Path

    return tuple(str(Path(path).resolve()) for path in paths)


def _with_progress(files: list[str]) -> Iterator[str]:
    """The files, with a bar on a terminal once they take longer than a second."""
    import sys
    import time

    begin = time.monotonic()
    shown = False
    for count, file in enumerate(files):
        if len(files) > 1 and sys.stderr.isatty() and time.monotonic() - begin > 1:
            shown = True
            done = 30 * count // len(files)
            sys.stderr.write(f"\r[{'#' * done}{'.' * (30 - done)}] {count}/{len(files)} models")
            sys.stderr.flush()
        yield file
    if shown:
        sys.stderr.write("\r\033[K")


def _wants_colour() -> bool:
    import os
    import sys

    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (sys.stdout.isatty() and os.environ.get("TERM") != "dumb")


def _statistics(report: Report) -> str:
    from osimlite.lint.engine import all_rules
    from osimlite.lint.reporters.style import summary

    known = {rule.code: rule for rule in all_rules()}
    rows = [f"{count:6d}  {code}  {known[code].name}" for code, count in report.codes.most_common()]
    return "\n".join([*rows, summary(report)]) + "\n"
