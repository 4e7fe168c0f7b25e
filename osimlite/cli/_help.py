"""Help of the program and of each command: names beside descriptions, which have most of the width."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from osimlite.cli._command import Command

NAME_WIDTH = 22
"""Width of the column of options, in letters; a longer option has its own line."""
MAX_WIDTH = 120
"""Largest width of a line, in letters; longer lines are hard to read."""
DESCRIPTION = "Build, check, translate and simulate OpenSim models (.osim) without OpenSim."
"""Description of the program in one sentence."""
PROGRAM_OPTIONS = {
    "--version": "Print the version and stop.",
    "-v, --verbose": "With --version: also show how the numerical code (the kernels) is compiled.",
    "--install-completion": "Install completion for the current shell.",
    "--show-completion": "Print the completion for the current shell, to copy or adapt it.",
    "-h, --help": "Show this text.",
}
"""Options of the program without a command."""
COMMAND_HINT = "'osimlite COMMAND --help' explains a command and its options."
"""Last sentence of the help of the program."""
PLACEHOLDERS = {int: "N", float: "NUMBER", str: "TEXT", Path: "FILE"}
"""Placeholders of values by their type, where an option has none."""


def format_overview(commands: Mapping[str, Command], width: int, *, bold: bool = False) -> str:
    """Return the help of the program.

    Args:
        commands: commands by name, in the order of the help.
        width: width of a line, in letters.
        bold: whether headings and names are bold.
    """
    width = min(width, MAX_WIDTH)
    start, end = ("\033[1m", "\033[0m") if bold else ("", "")
    lines = [f"{start}Usage:{end} osimlite [OPTIONS] COMMAND [ARGUMENTS]", ""]
    lines += [*_wrap(DESCRIPTION, width, 0), "", f"{start}Commands:{end}"]
    for name, command in commands.items():
        # The first paragraph of the docstring; 'osimlite COMMAND --help' shows all.
        text = " ".join((command.__doc__ or "").strip().split("\n\n")[0].split())
        lines += _format_entry(name, text, width, start, end)
    lines += ["", f"{start}Options:{end}"]
    for name, text in PROGRAM_OPTIONS.items():
        lines += _format_entry(name, text, width, start, end)
    return "\n".join([*lines, "", *_wrap(COMMAND_HINT, width, 0), ""])


def format_help(name: str, command: Command, width: int, *, bold: bool = False) -> str:
    """Return the help of a command.

    Args:
        name: name of the command.
        command: command to describe.
        width: width of a line, in letters.
        bold: whether headings and names of options are bold.
    """
    width = min(width, MAX_WIDTH)
    start, end = ("\033[1m", "\033[0m") if bold else ("", "")
    parameters = command.parameters()
    arguments = [parameter for parameter in parameters if parameter.declared.maker == "Argument"]
    usage = " ".join([f"osimlite {name} [OPTIONS]", *map(_name_argument, arguments)])
    lines = [f"{start}Usage:{end} {usage}", ""]
    for paragraph in (command.__doc__ or "").strip().split("\n\n"):
        lines += [*_wrap(" ".join(paragraph.split()), width, 0), ""]
    groups: dict[str, list[Any]] = {"Arguments": arguments} if arguments else {}
    groups["Options"] = []
    heading_of = {member: heading for heading, group in command.groups.items() for member in group}
    for parameter in parameters:
        if parameter.declared.maker == "Option":
            declared_heading = parameter.declared.settings.get("rich_help_panel") or "Options"
            heading = heading_of.get(parameter.name, declared_heading)
            groups.setdefault(heading, []).append(parameter)
    for heading, group in groups.items():
        lines.append(f"{start}{heading}:{end}")
        for parameter in group:
            is_argument = parameter.declared.maker == "Argument"
            name_text = _name_argument(parameter) if is_argument else _name_option(parameter)
            lines += _format_entry(name_text, _explain(parameter), width, start, end)
        if heading == "Options":
            lines += _format_entry("-h, --help", "Show this text.", width, start, end)
        lines.append("")
    return "\n".join(lines)


def _name_argument(parameter: Any) -> str:
    """Return an argument in capitals, with dots for any number of values and brackets if it may be left out."""
    _, is_list = parameter.scalar()
    argument_name = (parameter.declared.settings.get("metavar") or parameter.name).upper()
    # Several words name each value of a list of that length, such as OLD NEW.
    argument_name = f"{argument_name}..." if is_list and " " not in argument_name else argument_name
    return argument_name if parameter.default is ... else f"[{argument_name}]"


def _name_option(parameter: Any) -> str:
    """Return the spellings of an option, short ones first, and the placeholder of its value."""
    # The sort is stable: short spellings come first, others keep their order.
    spellings = sorted(parameter.spellings, key=lambda spelling: (spelling[:2] == "--", 0))
    value_type, _ = parameter.scalar()
    if value_type is bool:
        return ", ".join(spellings)
    placeholder = parameter.declared.settings.get("metavar") or PLACEHOLDERS.get(
        value_type, "VALUE"
    )
    return f"{', '.join(spellings)} {placeholder}"


def _explain(parameter: Any) -> str:
    """Return the help of a parameter with its default."""
    settings = parameter.declared.settings
    text = " ".join((settings.get("help") or "").split())
    show_default = settings.get("show_default", True)
    default = parameter.default
    if default is ...:
        default_note = "" if parameter.declared.maker == "Argument" else "required"
    elif isinstance(show_default, str):
        default_note = f"default: {show_default}"
    elif show_default and default is not None and not isinstance(default, bool) and default != "":
        default_note = f"default: {default}"
    else:
        default_note = ""
    return f"{text} [{default_note}]" if default_note else text


def _format_entry(name_text: str, text: str, width: int, start: str, end: str) -> list[str]:
    """Return the lines of the help about one option or argument, the text in a second column.

    Args:
        name_text: option with its metavariable.
        text: help text of the option.
        width: width of the terminal.
        start: escape sequence before the name, to colour it.
        end: escape sequence after the name.
    """
    beginning = f"  {start}{name_text}{end}"
    indent = NAME_WIDTH + 4
    lines = _wrap(text, width, indent)
    if len(name_text) > NAME_WIDTH or not lines:
        return [beginning, *lines]
    padding = " " * (NAME_WIDTH - len(name_text) + 2)
    return [f"{beginning}{padding}{lines[0].lstrip()}", *lines[1:]]


def _wrap(text: str, width: int, indent: int) -> list[str]:
    """Return a text in lines that are broken between words."""
    blank = " " * indent
    return wrap(
        text,
        width,
        initial_indent=blank,
        subsequent_indent=blank,
        # Names of options and files stay whole, so that they can be copied and searched for.
        break_on_hyphens=False,
        break_long_words=False,
    )
