"""``osimlite validate``: say what is wrong with model files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from osimlite.document.source import Source
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
    fail_on: Annotated[str, typer.Option(help="What makes the exit code 1: error, warning or info.")] = "error",
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
    from osimlite.lint import Config, Severity, checked_words, validate
    from osimlite.lint.diagnostic import merged
    from osimlite.lint.reporters import FORMATS, render
    from osimlite.text import listed

    if fail_on not in tuple(Severity):
        raise OsimliteError(f"--fail-on is one of {listed(Severity)}, not '{fail_on}'")
    if format not in FORMATS:
        raise OsimliteError(f"--format is one of {listed(FORMATS)}, not '{format}'")
    config = Config(checked_words(select), checked_words(ignore), mesh_paths=tuple(mesh_path or ()))
    files = list(_files(paths))
    report = merged(validate(_source(path), config=config) for path in _with_progress(files))
    colour = _wants_colour() and format in ("full", "concise")
    if statistics:
        text = _statistics(report)
    else:
        import shutil

        width = shutil.get_terminal_size((80, 24)).columns if sys.stdout.isatty() else 80
        text = render(report, format, colour=colour, width=min(max(width, 40), 120))
    sys.stdout.write(text)
    if report.at_least(Severity(fail_on)):
        raise typer.Exit(1)


def _files(paths: list[str]) -> Iterator[str | Path]:
    """Every file to check, folders opened up."""
    from pathlib import Path

    from osimlite.errors import OsimliteError

    for text in paths:
        path = Path(text)
        if text != "-" and path.is_dir():
            below = sorted(path.rglob("*.osim"))
            if not below:
                raise OsimliteError("there is no .osim file in this folder", file=text)
            yield from below
        else:
            yield text


def _source(path: str | Path) -> Source:
    import sys

    from osimlite.document.source import Source

    if path == "-":
        return Source(sys.stdin.buffer.read(), "<stdin>")
    return Source.of_file(path)


def _with_progress(files: list[str | Path]) -> Iterator[str | Path]:
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
