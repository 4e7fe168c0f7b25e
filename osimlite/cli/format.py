"""``osimlite format``: rewrite files in a canonical layout that keeps comments."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def format(
    paths: Annotated[
        list[str],
        Argument(help="Files (.osim, .xml, .omoco), or folders to search.", show_default=False),
    ],
    check: Annotated[
        bool, Option("--check", help="Change nothing; exit with 1 if a file would change.")
    ] = False,
    show_diff: Annotated[bool, Option("--diff", help="Change nothing; print the changes.")] = False,
    only_ours: options.OnlyOurs = False,
) -> None:
    """Rewrite files in OpenSim's layout: one property per line, shortest numbers, your comments preserved.

    Comments that OpenSim prints itself are removed. Formatting a formatted file does not change it. A file of an
    older format keeps its format and its numbers; use 'osimlite upgrade' to convert it.

    Example: osimlite format models --check
    """
    from osimlite.base.files import write_atomically
    from osimlite.cli._console import complain, print_diff, say
    from osimlite.errors import OsimliteError
    from osimlite.io.document.printer import format_document
    from osimlite.io.document.source import Source
    from osimlite.lint.project_files import DOCUMENTS, find_project_files

    changed_count, same_count, exit_code = 0, 0, 0
    for path in find_project_files(paths, (".osim", *DOCUMENTS), only_ours=only_ours):
        try:
            source = Source.from_file(path)
            formatted = format_document(source)
        except OsimliteError as error:
            complain(error)
            exit_code = max(exit_code, error.exit_code)
            continue
        original = source.text
        if original == formatted:
            same_count += 1
            continue
        changed_count += 1
        if show_diff:
            print_diff(original, formatted, path, f"{path} (formatted)")
        elif check:
            say(f"would reformat {path}")
        else:
            try:
                write_atomically(path, formatted)
            except OsimliteError as error:
                complain(error)
                exit_code = max(exit_code, error.exit_code)
                continue
            say(f"reformatted {path}")
    if same_count and not (changed_count and show_diff):
        files = "1 file is" if same_count == 1 else f"{same_count} files are"
        say(f"{files} formatted already", err=True)
    if exit_code:
        raise SystemExit(exit_code)
    if changed_count and (check or show_diff):
        raise SystemExit(1)
