"""``osimlite build``: make a model in Python and write its file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def build(
    source: Annotated[
        str | None,
        typer.Argument(
            help="A built-in model (see --list), a Python file or module:function that returns a Model, "
            "or a YAML or JSON file.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="File to write, - for standard output; default is <model name>.osim here.",
            show_default=False,
        ),
    ] = None,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "-p", "--parameter", metavar="NAME=VALUE", help="Set a parameter of the model function.", show_default=False
        ),
    ] = None,
    numbers: Annotated[
        str, typer.Option(help="'shortest' digits that read back equal, or 'opensim' for 17 digits.")
    ] = "shortest",
    list_models: Annotated[bool, typer.Option("--list", help="Name the built-in models and stop.")] = False,
) -> None:
    """Make a model in Python and write its .osim file.

    The model is validated first: nothing is written if it has an error.

    Example: osimlite build dynamic-walker -p thigh_length=0.42 -o walker.osim
    """
    from osimlite.document.printer import Numbers, to_text, write
    from osimlite.errors import OsimliteError
    from osimlite.lint import validate
    from osimlite.models import BUILT_IN
    from osimlite.models.source import describe, make_model

    if list_models:
        import textwrap

        for name in BUILT_IN:
            typer.echo(textwrap.fill(f"{name}  {describe(name)}", width=79, subsequent_indent=" " * (len(name) + 2)))
        return
    if source is None:
        raise OsimliteError("name a model to build, or use --list")
    if numbers not in ("shortest", "opensim"):
        raise OsimliteError(f"--numbers is 'shortest' or 'opensim', not '{numbers}'")
    parameters = {}
    for word in parameter or []:
        name, equals, value = word.partition("=")
        if not equals:
            raise OsimliteError(f"-p takes NAME=VALUE, got '{word}'")
        parameters[name.strip()] = value.strip()
    model = make_model(source, parameters)
    report = validate(model)
    if not report.ok:
        from osimlite.lint.reporters import render

        typer.echo(render(report, "full"), err=True)
        typer.echo(f"osimlite: '{source}' has errors; nothing was written", err=True)
        raise typer.Exit(1)
    style: Numbers = "opensim" if numbers == "opensim" else "shortest"
    if str(output) == "-":
        typer.echo(to_text(model, numbers=style), nl=False)
        return
    target = output or Path(f"{model.name or 'model'}.osim")
    write(model, target, numbers=style)
    count = sum(1 for _ in model.components())
    warnings = len(report.warnings)
    advice = f"; {warnings} warning{'s' * (warnings != 1)}: see osimlite validate {target}" if warnings else ""
    typer.echo(f"{target}: {count} components{advice}")
