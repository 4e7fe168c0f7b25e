"""``osimlite upgrade``: convert an old file to the current format."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.base.text import format_count
from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command
from osimlite.cli._console import add_row, create_table, print_table, say

if TYPE_CHECKING:
    from osimlite.io.document.reader import Document
    from osimlite.io.document.upgrade import Change


@command
def upgrade(
    file: Annotated[
        Path, Argument(help="A model, setup or other document of any version.", show_default=False)
    ],
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write; may be the input file.",
            show_default="<name>_<version> in its folder",
        ),
    ] = None,
    numbers: options.Numbers = "shortest",
) -> None:
    """Convert a file of an older version to the current format, and list what changed and what was lost.

    Components get the names and paths that OpenSim gives them. Comments and numbers do not change.
    Other files that are named in the old file are not converted.

    Example: osimlite upgrade gait2354.osim -o gait2354_v4.osim
    """
    from osimlite.base.files import make_folder_of
    from osimlite.errors import OsimliteError
    from osimlite.io.document.printer import write
    from osimlite.io.document.reader import read_document, require_stated_version
    from osimlite.io.document.source import Source
    from osimlite.schema.base import Object
    from osimlite.schema.model import CURRENT_VERSION

    style = options.check_number_format(numbers)
    require_stated_version(Source.from_file(file))
    document = read_document(Source.from_file(file), expected_class=Object)
    is_repaired = document.fault is not None
    if document.version >= CURRENT_VERSION and output is None and not is_repaired:
        say(f"{file}: already version {document.version}, nothing to do")
        return
    target = output or file.with_name(f"{file.stem}_{CURRENT_VERSION}{file.suffix or '.osim'}")
    # Only a file that the user names is overwritten: the default name may be that of other work.
    if output is None and target.exists():
        raise OsimliteError(
            f"'{target}' exists already; name the file to write with -o", file=str(file)
        )
    make_folder_of(target)
    write(document.top, target, numbers=style)
    _print_changes(document)
    say(
        f"{target}: version {document.version} to {CURRENT_VERSION}, {format_count(len(document.changes), 'change')}"
    )


def _print_changes(document: Document) -> None:
    """Print a table of changes, then notes of the reader, then what was lost."""
    steps: dict[str, list[Change]] = {}
    changes_made = document.changes
    for change in changes_made:
        steps.setdefault(change.what, []).append(change)
    if steps:
        table = create_table()
        table.add_column("What changed")
        table.add_column("Places", justify="right")
        table.add_column("First line", justify="right")
        for description, changes in sorted(
            steps.items(), key=lambda changes_of_type: changes_of_type[1][0].below
        ):
            line = document.source.locate_tag(changes[0].number).line
            add_row(table, description, str(len(changes)), str(line))
        print_table(table)
    for note in document.notes:
        if note.line is not None:
            reading = (
                "as nothing"
                if not note.value
                else "as it stands"
                if note.value == note.word
                else f"as '{note.value}'"
            )
            consequence = (
                f"; {note.value}" if note.kind == "overlooked" else f" and was read {reading}"
            )
            say(f"line {note.line}: '{note.word}' is not XML{consequence}")
    losses: dict[str, list[Change]] = {}
    for change in changes_made:
        if change.lost is not None:
            losses.setdefault(change.lost, []).append(change)
    for description, changes in losses.items():
        first = document.source.locate_tag(changes[0].number).line
        # One line for each loss with its first place; a model may have hundreds of the same kind.
        other_positions = (
            f" and {format_count(len(changes) - 1, 'more place')}" if len(changes) > 1 else ""
        )
        say(f"lost: {description} (line {first}, {changes[0].where}{other_positions})")
