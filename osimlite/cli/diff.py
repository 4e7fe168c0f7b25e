"""``osimlite diff``: differences in meaning between two models, setups or tables."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli._command import Argument, Option, command

if TYPE_CHECKING:
    from osimlite.schema.difference import Difference


@command
def diff(
    files: Annotated[
        list[Path], Argument(metavar="OLD NEW", help="The two files.", show_default=False)
    ],
    git: Annotated[
        bool,
        Option("--git", help="Accept the seven arguments of git's external diff programs."),
    ] = False,
) -> None:
    """Show the differences between two models or setups: component, property, old and new value.

    Ignores layout, order, comments, number formats, and defaults that only one file contains. For two
    tables (.sto, .mot) it lists added and removed columns, and the largest difference in each of the
    others. Exits with 1 if the files differ.

    To use it as git's diff for model files: git config diff.osim.command 'osimlite diff --git', and
    add to .gitattributes the line: *.osim diff=osim

    Example: osimlite diff gait2392.osim gait2392_scaled.osim
    """
    from osimlite.cli._console import say
    from osimlite.errors import OsimliteError
    from osimlite.io.document.reader import read_any
    from osimlite.lint.project_files import is_table
    from osimlite.schema.difference import find_differences
    from osimlite.schema.model import Model

    if git:
        # git passes: path old-file old-hex old-mode new-file new-hex new-mode. A missing file is
        # /dev/null.
        if len(files) != 7:
            raise OsimliteError(
                "--git takes the seven arguments of git's external diff; see 'git help diff'"
            )
        title = str(files[0])
        old_file = files[1]
        new_file = files[4]
    elif len(files) == 2:
        title, (old_file, new_file) = "", files
    else:
        raise OsimliteError("diff takes two files")
    existing_files = [file for file in (old_file, new_file) if str(file) != "/dev/null"]
    are_tables = [is_table(str(file)) for file in existing_files]
    if all(are_tables):
        from osimlite.cli._table_diff import describe_table_differences

        lines = describe_table_differences(old_file, new_file)
    elif any(are_tables):
        table, other = existing_files if are_tables[0] else reversed(existing_files)
        raise OsimliteError(
            f"'{table}' is a table and '{other}' is not; name two tables, or two models or setups"
        )
    else:
        documents = [
            None if str(file) == "/dev/null" else read_any(file) for file in (old_file, new_file)
        ]
        document_class = next((type(top) for top in documents if top is not None), Model)
        lines = describe_differences(
            find_differences(*(document_class() if top is None else top for top in documents))
        )
    if git:
        say(f"--- {title}")
        say(f"+++ {title}")
    for line in lines:
        say(line)
    if lines and not git:
        raise SystemExit(1)


def describe_differences(differences: list[Difference]) -> list[str]:
    """Return one or two lines for each difference, grouped by component."""
    lines: list[str] = []
    last = None
    for path, property_name, old_value, new_value in differences:
        if not property_name:
            lines.append(
                f"+ {path} ({new_value})" if old_value is None else f"- {path} ({old_value})"
            )
            last = None
            continue
        if path != last:
            lines.append(f"  {path}")
            last = path
        if old_value is None or new_value is None:
            sign, value = ("+", new_value) if old_value is None else ("-", old_value)
            lines.append(f"    {sign} {property_name}: {_format_property_value(value)}")
        else:
            lines.append(
                f"    {property_name}: {_format_property_value(old_value)} -> {_format_property_value(new_value)}"
            )
    return lines


def _format_property_value(value: Any) -> str:
    """Return the value of a property as a file has it, or "(empty)"."""
    if isinstance(value, float):
        from osimlite.io.document.lexical import format_shortest

        return format_shortest(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return " ".join(map(_format_property_value, value)) or "(empty)"
    return str(value) or "(empty)"
