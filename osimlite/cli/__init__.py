"""Command line. Each command is a short module that parses options, calls the library and prints."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typer import Typer

    from osimlite.cli._command import Command
    from osimlite.errors import OsimliteError

COMMANDS = (
    "build", "validate", "rule", "format", "upgrade", "diff", "info", "translate", "convert", "view", "simulate", "sweep",
    "optimize", "gait", "find-gait", "muscles", "modify", "scale", "fit", "ik", "kinematics", "inverse-dynamics",
    "static-optimization", "run", "check-trial", "scone", "lsp", "doctor", "demo",
)  # fmt: skip
"""Commands in the order of the help. ``osimlite.cli.<name>.<name>``, with _ for -, is the function."""

ALIASES = {"run-tool": "run"}
"""Other names of commands; `run-tool` is the name in OpenSim's `opensim-cmd`."""

COMPLETION_VARIABLE = "_OSIMLITE_COMPLETE"
"""Environment variable that a shell sets to request completions."""

VERSION_OPTIONS = {"--version", "--verbose", "-v"}
"""Options that print the version."""


def create_app(names: Sequence[str] = COMMANDS) -> Typer:
    """Return the typer application of the given commands."""
    import typer

    from osimlite.cli._help import DESCRIPTION, PROGRAM_OPTIONS

    application = typer.Typer(
        name="osimlite",
        help=DESCRIPTION,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    for name in names:
        command = load_command(name)
        application.command(name, help=_unwrap_paragraphs(command.__doc__ or ""))(command)

    @application.callback(invoke_without_command=True)
    def osimlite(
        version: bool = typer.Option(False, "--version", help=PROGRAM_OPTIONS["--version"]),
        verbose: bool = typer.Option(
            False,
            "--verbose",
            "-v",
            help=PROGRAM_OPTIONS["-v, --verbose"],
        ),
    ) -> None:
        if version:
            _print_version(verbose=verbose)
            raise typer.Exit

    return application


def load_command(name: str) -> Command:
    """Return the command of a name, importing its module."""
    function = name.replace("-", "_")
    return getattr(import_module(f"osimlite.cli.{function}"), function)


def _print_help(name: str, command: Command) -> None:
    """Print the help of a command."""
    from osimlite.cli._console import count_columns, show, wants_colour
    from osimlite.cli._help import format_help

    show(format_help(name, command, count_columns(), bold=wants_colour()))


def _print_overview() -> None:
    """Print the help of the program: all commands and what each does."""
    from osimlite.cli._console import count_columns, show, wants_colour
    from osimlite.cli._help import format_overview

    commands = {name: load_command(name) for name in COMMANDS}
    show(format_overview(commands, count_columns(), bold=wants_colour()))


def _print_version(*, verbose: bool) -> None:
    """Print the version; with `verbose` also what runs the kernels and why."""
    from osimlite import __version__
    from osimlite.cli._console import say

    say(f"osimlite {__version__}")
    if verbose:
        from osimlite.cli._kernels import explain_kernels

        for sentence in explain_kernels():
            say(sentence)


def _unwrap_paragraphs(text: str) -> str:
    """Return a text with each paragraph in one line, for the terminal to wrap at its own width."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _suggest_built_in(error: OsimliteError, command: str) -> str:
    """Return advice if a missing file is named like a built-in model; otherwise an empty text."""
    from osimlite.errors import MissingFileError

    if not isinstance(error, MissingFileError) or error.file is None or os.path.exists(error.file):
        return ""
    from osimlite.base.text import find_nearest
    from osimlite.models import BUILT_IN

    name = error.file.removesuffix(".osim")
    if name in BUILT_IN:
        return f"; 'osimlite build {name} -o {name}.osim' writes the built-in model of this name"
    if command == "scone":
        from osimlite.models.walking import SCENARIO

        return (
            f"; did you mean '{SCENARIO}', the built-in scenario?"
            if find_nearest(name, [SCENARIO])
            else ""
        )
    # The cutoff (percent of similarity) is high because file names are often similar by chance, such
    # as arm26 and arm.
    similar = find_nearest(name, BUILT_IN, cutoff=80.0)
    if similar is None:
        return ""
    return f"; did you mean the built-in model '{similar}'? 'osimlite build {similar} -o {similar}.osim' writes it"


def main(arguments: list[str] | None = None) -> None:
    """Run the command line.

    Exits with 0 (success), 1 (negative result, such as findings), 2 (the command could not run) or
    130 (interrupted).
    """
    from osimlite.base.require import protect_processes
    from osimlite.cli._console import escape_output

    protect_processes()
    with escape_output():
        try:
            _run(sys.argv[1:] if arguments is None else arguments)
        finally:
            # Only a terminal has loaded it.
            if (progress := sys.modules.get("osimlite.cli._progress")) is not None:
                progress.finish_command()


def _run(words: list[str]) -> None:
    import warnings

    from osimlite.cli._console import complain, get_raw_stream
    from osimlite.errors import DoubtfulWarning, OsimliteError, UnitWarning

    # Imports create many objects and free none. With the default threshold the garbage collector
    # would scan them again and again.
    gc.set_threshold(300_000)
    # At exit Python collects once more, which takes a quarter of the time of a short command; frozen
    # objects are not scanned.
    atexit.register(gc.freeze)
    # rich accepts every value of COLUMNS, also 0 and a million.
    width = os.environ.get("COLUMNS", "")
    if not (width.isdecimal() and len(width) < 5 and int(width)):
        os.environ.pop("COLUMNS", None)
    # pydantic searches all installed packages for plug-ins; osimlite uses none.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # The matrices of mechanisms are too small for several threads: those of OpenBLAS would busy-wait
    # and occupy a core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    words = [ALIASES.get(words[0], words[0]), *words[1:]] if words else ["--help"]
    # Import the module of the requested command only. The help needs all of them.
    names = words[:1] if words[:1] and words[0] in COMMANDS else COMMANDS
    try:
        if "--version" in words and {*words} <= VERSION_OPTIONS:
            _print_version(verbose=len({*words}) > 1)
            return
        if sys.stderr.isatty():
            from osimlite.cli._progress import show_engine_warnings, watch_command

            show_engine_warnings()
            if names != COMMANDS and not {"--help", "-h"} & {*words}:
                watch_command(words[0])
        with warnings.catch_warnings():
            default = warnings.showwarning
            warnings.showwarning = lambda message, category, *location: (
                complain(str(message))
                if issubclass(category, DoubtfulWarning)
                else default(message, category, *location)
            )
            warnings.simplefilter("once", DoubtfulWarning)
            # Options report suspicious numbers themselves, as errors.
            warnings.simplefilter("ignore", UnitWarning)
            if names != COMMANDS and COMPLETION_VARIABLE not in os.environ:
                command = load_command(words[0])
                if {"--help", "-h"} & {*words}:
                    _print_help(words[0], command)
                    raise SystemExit(0)
                words = [words[0], *command.complete(words[1:])]
                values = command.read(words[1:])
                if values is not None:
                    command(**values)
                    raise SystemExit(0)
            if words in (["--help"], ["-h"]) and COMPLETION_VARIABLE not in os.environ:
                _print_overview()
                raise SystemExit(0)
            raise SystemExit(
                create_app(names)(args=words, prog_name="osimlite", standalone_mode=False)
            )
    except OsimliteError as error:
        complain(error, _suggest_built_in(error, words[0]))
        raise SystemExit(error.exit_code) from None
    except (Exception, KeyboardInterrupt) as error:
        if _was_interrupted(error):
            if sys.stderr.isatty():
                # The terminal has written ^C, mostly at the start of a line.
                get_raw_stream(sys.stderr).write("\r")
            complain("interrupted")
            raise SystemExit(130) from None
        from osimlite.cli._exiting import exit_with_message

        exit_with_message(error, words)


def _was_interrupted(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error, directly or as its cause or context.

    Code that runs during an interrupt, such as class construction and option parsing, raises errors
    of its own.
    """
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
