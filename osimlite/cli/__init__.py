"""The command line. One module per command, thin: parse, call the library, report."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typer import Typer

COMMANDS = (
    "build",
    "validate",
    "rule",
    "format",
    "upgrade",
    "diff",
    "info",
    "translate",
    "simulate",
    "kinematics",
    "inverse-dynamics",
    "demo",
)
"""Every command in the order of the help; ``osimlite.cli.<name>.<name>``, with _ for -, is its function."""


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
        function = name.replace("-", "_")
        application.command(name)(getattr(import_module(f"osimlite.cli.{function}"), function))

    @application.callback(invoke_without_command=True)
    def osimlite(version: bool = typer.Option(False, "--version", help="Print the version and stop.")) -> None:
        if version:
            from osimlite import __version__

            typer.echo(f"osimlite {__version__}")
            raise typer.Exit

    return application


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exits with 0 (done), 1 (the answer is no) or 2 (could not be carried out)."""
    from osimlite.errors import OsimliteError

    words = sys.argv[1:] if arguments is None else arguments
    # Only the command that is asked for is loaded; without one, all are, for the help.
    names = words[:1] if words[:1] and words[0] in COMMANDS else COMMANDS
    try:
        app(names)(args=words, prog_name="osimlite")
    except OsimliteError as error:
        print(f"osimlite: {error}", file=sys.stderr)
        raise SystemExit(error.exit_code) from None
    except KeyboardInterrupt:
        print("osimlite: interrupted", file=sys.stderr)
        raise SystemExit(130) from None
    except BrokenPipeError:
        # Whoever read our output has gone; Python would complain once more when it closes standard output.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise SystemExit(1) from None
