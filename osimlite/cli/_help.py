"""Help of one command: options beside their descriptions, which have most of the width."""

from __future__ import annotations

from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.cli._command import Command

NAME_WIDTH = 24
"""Width of the column of options; a longer option stands in a line of its own."""
MAX_WIDTH = 120
"""Longer lines are hard to read."""
PLACEHOLDERS = {int: "N", float: "NUMBER", str: "TEXT", Path: "FILE"}
"""Placeholders of values by their type, where an option has none."""


def format_help(name: str, command: Command, width: int, *, bold: bool = False) -> str:
    """Return the help of a command.

    Args:
        name: name of the command.
        command: the command.
        width: letters of a line.
        bold: whether headings and names of options are bold.
    """
    width = min(width, MAX_WIDTH)
    start, end = ("\033[1m", "\033[0m") if bold else ("", "")
    parameters = command.parameters()
    places = [each for each in parameters if each.declared.maker == "Argument"]
    usage = " ".join([f"osimlite {name} [OPTIONS]", *map(_name_argument, places)])
    lines = [f"{start}Usage:{end} {usage}", ""]
    for paragraph in (command.__doc__ or "").strip().split("\n\n"):
        lines += [*_wrap(" ".join(paragraph.split()), width, 0), ""]
    groups: dict[str, list[Any]] = {"Arguments": places} if places else {}
    for each in parameters:
        if each.declared.maker == "Option":
            heading = each.declared.settings.get("rich_help_panel") or "Options"
            groups.setdefault(heading, []).append(each)
    for heading, group in groups.items():
        lines.append(f"{start}{heading}:{end}")
        for each in group:
            is_argument = each.declared.maker == "Argument"
            words = _name_argument(each) if is_argument else _name_option(each)
            lines += _describe(words, _explain(each), width, start, end)
        lines.append("")
    lines[-1:] = [*_describe("-h, --help", "Show this text.", width, start, end), ""]
    return "\n".join(lines)


def _name_argument(parameter: Any) -> str:
    """Return an argument in capitals, with dots for several and brackets if it may be left out."""
    _, is_list = parameter.scalar()
    word = (parameter.declared.settings.get("metavar") or parameter.name).upper()
    word = f"{word}..." if is_list else word
    return word if parameter.default is ... else f"[{word}]"


def _name_option(parameter: Any) -> str:
    """Return the spellings of an option, short ones first, and the placeholder of its value."""
    spellings = sorted(parameter.spellings, key=lambda word: (word[:2] == "--", 0))
    kind, _ = parameter.scalar()
    if kind is bool:
        return ", ".join(spellings)
    placeholder = parameter.declared.settings.get("metavar") or PLACEHOLDERS.get(kind, "VALUE")
    return f"{', '.join(spellings)} {placeholder}"


def _explain(parameter: Any) -> str:
    """Return the help of a parameter with its default."""
    settings = parameter.declared.settings
    text = " ".join((settings.get("help") or "").split())
    shown = settings.get("show_default", True)
    default = parameter.default
    if default is ...:
        words = "" if parameter.declared.maker == "Argument" else "required"
    elif isinstance(shown, str):
        words = f"default: {shown}"
    elif shown and default is not None and not isinstance(default, bool) and default != "":
        words = f"default: {default}"
    else:
        words = ""
    return f"{text} [{words}]" if words else text


def _describe(words: str, text: str, width: int, start: str, end: str) -> list[str]:
    """Return the lines of an option or argument with its help."""
    left = f"  {start}{words}{end}"
    indent = NAME_WIDTH + 4
    lines = _wrap(text, width, indent)
    if len(words) > NAME_WIDTH or not lines:
        return [left, *lines]
    padding = " " * (NAME_WIDTH - len(words) + 2)
    return [f"{left}{padding}{lines[0].lstrip()}", *lines[1:]]


def _wrap(text: str, width: int, indent: int) -> list[str]:
    """Return a text in lines that are broken between words."""
    blank = " " * indent
    return wrap(
        text,
        width,
        initial_indent=blank,
        subsequent_indent=blank,
        break_on_hyphens=False,
        break_long_words=False,
    )
