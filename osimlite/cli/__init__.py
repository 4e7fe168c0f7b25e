"""The command line. One module per command, thin: parse, call the library, report."""

from __future__ import annotations

import atexit
import errno
import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from typer import Typer

    from osimlite.cli._command import Command
    from osimlite.errors import OsimliteError

COMMANDS = (
    "build", "validate", "rule", "format", "upgrade", "diff", "info", "translate", "convert", "view", "simulate", "sweep",
    "optimize", "gait", "find-gait", "muscles", "modify", "scale", "fit", "ik", "kinematics", "inverse-dynamics",
    "static-optimization", "run", "check-trial", "scone", "lsp", "doctor", "demo",
)  # fmt: skip
"""Every command in the order of the help; ``osimlite.cli.<name>.<name>``, with _ for -, is its function."""

ALIASES = {"run-tool": "run"}
"""Other spellings of commands: `opensim-cmd` says it so."""

COMPLETING = "_OSIMLITE_COMPLETE"
"""Set by a shell that asks how a word can go on."""

VERSION = {"--version", "--verbose", "-v"}
"""Words that ask for the version."""


def app(names: Sequence[str] = COMMANDS) -> Typer:
    """Assemble the command line of these commands."""
    import typer

    application = typer.Typer(
        name="osimlite",
        help="Build, check, translate and simulate OpenSim models (.osim) without OpenSim.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        rich_markup_mode="rich",
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    for name in names:
        command = load_command(name)
        application.command(name, help=_flowing(command.__doc__ or ""))(command)

    @application.callback(invoke_without_command=True)
    def osimlite(
        version: bool = typer.Option(False, "--version", help="Print the version and stop."),
        verbose: bool = typer.Option(
            False, "--verbose", "-v", help="With --version: say what runs the kernels."
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


def _print_version(*, verbose: bool) -> None:
    """Print the version, and if asked what runs the kernels and why."""
    from osimlite import __version__
    from osimlite.cli._console import say

    say(f"osimlite {__version__}")
    if verbose:
        from osimlite.cli._kernels import explain_kernels

        for sentence in explain_kernels():
            say(sentence)


def _flowing(text: str) -> str:
    """The text with each paragraph in one line: terminals are not as wide as the source."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _suggest_built_in(error: OsimliteError, command: str) -> str:
    """Return what to do if a file that is missing has the name of a built-in model, or nearly so."""
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
    # Names of files are often near by chance, such as arm26 and arm.
    similar = find_nearest(name, BUILT_IN, cutoff=80.0)
    if similar is None:
        return ""
    return f"; did you mean the built-in model '{similar}'? 'osimlite build {similar} -o {similar}.osim' writes it"


def main(arguments: list[str] | None = None) -> None:
    """Run the command line.

    Exits with 0 (done), 1 (the answer is no), 2 (could not be carried out) or 130 (interrupted).
    """
    from osimlite.base.require import protect_processes
    from osimlite.cli._console import guarded_output

    protect_processes()
    with guarded_output():
        _run(sys.argv[1:] if arguments is None else arguments)


def _run(words: list[str]) -> None:
    import warnings

    from osimlite.cli._console import complain
    from osimlite.errors import DoubtfulWarning, OsimliteError, UnitWarning

    # What is imported makes many objects and drops none: the collector would look through them
    # again and again.
    gc.set_threshold(300_000)
    # At the end Python would look through all that was made once more, a quarter of the time of a
    # short command.
    atexit.register(gc.freeze)
    # What draws tables takes any width at its word.
    width = os.environ.get("COLUMNS", "")
    if not (width.isdecimal() and len(width) < 5 and int(width)):
        os.environ.pop("COLUMNS", None)
    # Plug-ins of pydantic, for which it searches every installed package, have nothing to do here.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    # Matrices of mechanisms are small: the threads of OpenBLAS would only wait, and keep a core
    # busy with that.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    words = [ALIASES.get(words[0], words[0]), *words[1:]] if words else ["--help"]
    # Only the command that is asked for is loaded; without one, all are, for the help.
    names = words[:1] if words[:1] and words[0] in COMMANDS else COMMANDS
    try:
        if "--version" in words and {*words} <= VERSION:
            _print_version(verbose=len({*words}) > 1)
            return
        if sys.stderr.isatty():
            from osimlite.cli._progress import show_warnings_of_engine

            show_warnings_of_engine()
        with warnings.catch_warnings():
            shown = warnings.showwarning
            warnings.showwarning = lambda message, category, *place: (
                complain(str(message))
                if issubclass(category, DoubtfulWarning)
                else shown(message, category, *place)
            )
            warnings.simplefilter("once", DoubtfulWarning)
            # Options refuse such a number, or were given its unit.
            warnings.simplefilter("ignore", UnitWarning)
            if names != COMMANDS and COMPLETING not in os.environ:
                command = load_command(words[0])
                words = [words[0], *command.complete(words[1:])]
                given = command.read(words[1:])
                if given is not None:
                    command(**given)
                    raise SystemExit(0)
            raise SystemExit(app(names)(args=words, prog_name="osimlite", standalone_mode=False))
    except OsimliteError as error:
        complain(error, _suggest_built_in(error, words[0]))
        raise SystemExit(error.exit_code) from None
    except (Exception, KeyboardInterrupt) as error:
        if _was_interrupted(error):
            complain("interrupted")
            raise SystemExit(130) from None
        _tell(error, words)


def _was_interrupted(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: classes that were being made, and what reads options, raise their own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _tell(error: BaseException, words: list[str]) -> NoReturn:
    """Say in a sentence what went wrong besides our own errors, if that is known, and exit."""
    from osimlite.cli._console import complain

    if isinstance(error, OSError):
        # The reader of the output has closed its end; Windows reports that as an invalid argument.
        if not isinstance(error, BrokenPipeError) and (
            error.errno != errno.EINVAL or error.filename is not None
        ):
            raise error
        # Python would complain once more when it closes standard output.
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
    # The library that reads options does not tell under what name it can be caught.
    if not hasattr(error, "format_message"):
        raise error
    context = getattr(error, "ctx", None)
    # Errors about an option without a value come without a context.
    command = " ".join(["osimlite", *(word for word in words[:1] if word in COMMANDS)])
    path = context.command_path if context is not None else command
    complain(f"{error.format_message().rstrip('.')}; '{path} --help' lists what there is")
    raise SystemExit(2) from None
