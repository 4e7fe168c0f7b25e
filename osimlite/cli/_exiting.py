"""Messages and exit codes for errors of other libraries; a command that succeeds does not import it."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Sequence
from typing import NoReturn

from osimlite.cli import COMMANDS
from osimlite.cli._console import complain

SYNONYMS = {"--to": "--until", "--until": "--to"}
"""Options of other commands with the same meaning: the last time of a simulation, or of recorded data."""
COMMAND_SYNONYMS = {
    "check": "validate",
    "explain": "rule",
    "export": "translate",
    "id": "inverse-dynamics",
    "import": "convert",
    "inspect": "info",
    "lint": "validate",
    "plot": "run --plot",
    "show": "view",
    "so": "static-optimization",
}
"""Words that users of other programs try, and the command that does it here."""


EXPECTED_NUMBERS = {"valid number": "a number", "valid integer": "a whole number"}
"""Kinds of numbers by the words that distinguish them in messages of typer, which come from pydantic."""


def _describe_wrong_number(error: BaseException, words: Sequence[str]) -> str:
    """Return a message about an option whose value is not a number, or "" for other errors.

    Args:
        error: error of typer.
        words: words of the command line.
    """
    expected = [name for text, name in EXPECTED_NUMBERS.items() if text in str(error)]
    options = getattr(getattr(error, "param", None), "opts", ())
    # The last of several values counts.
    for index, word in reversed([*enumerate(words)]):
        option, has_value, value = word.partition("=")
        if expected and option in options:
            option_value = value if has_value else next(iter(words[index + 1 :]), "")
            return f"{option}: expected {expected[0]}, found '{option_value}'"
    return ""


def exit_with_message(error: BaseException, words: list[str]) -> NoReturn:
    """Exit with a one-line message for known errors of other libraries; raise the others again.

    Raises:
        SystemExit: the output is closed (exit code 1), or a package is missing or the command line
            is wrong (exit code 2).
    """
    if isinstance(error, OSError):
        # The reader of the output has closed its end; Windows reports that as an invalid argument.
        if not isinstance(error, BrokenPipeError) and (
            error.errno != errno.EINVAL or error.filename is not None
        ):
            raise error
        # Python flushes standard output at exit and would report the closed pipe again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None
    if isinstance(error, ModuleNotFoundError):
        from osimlite.cli.doctor import find_extra

        extra = find_extra(error.name, words[0])
        if extra is None:
            raise error
        complain(
            f"'{words[0]}' needs {error.name}, which is not installed; run: pip install 'osimlite[{extra}]'"
        )
        raise SystemExit(2) from None
    # typer's copy of click does not export the class of these errors, so recognise them by a method.
    if not hasattr(error, "format_message"):
        raise error
    context = getattr(error, "ctx", None)
    # Errors about an option without a value come without a context.
    command = " ".join(["osimlite", *(word for word in words[:1] if word in COMMANDS)])
    path = context.command_path if context is not None else command
    synonym = SYNONYMS.get(getattr(error, "option_name", ""))
    if synonym and context is not None:
        options = {word for parameter in context.command.params for word in parameter.opts}
        if synonym in options:
            error.possibilities = [synonym]  # type: ignore[attr-defined]
    message = _describe_wrong_number(error, words) or error.format_message().rstrip(".")
    if words[0] not in COMMANDS and words[0] in COMMAND_SYNONYMS:
        message += f", use '{COMMAND_SYNONYMS[words[0]]}'"
    # A suggestion of typer ends with a question mark.
    separator = "" if message.endswith("?") else ";"
    complain(f"{message}{separator} '{path} --help' shows the usage")
    raise SystemExit(2) from None
