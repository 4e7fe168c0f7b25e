"""``osimlite build``: make a model in Python and write its file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def build(
    source: Annotated[
        str | None,
        Argument(
            help="A built-in model (see --list), a Python file or module:function that returns a Model, "
            "or a YAML or JSON file.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write, - for standard output.",
            show_default="<model name>.osim here",
        ),
    ] = None,
    parameter: options.Parameters = None,
    numbers: options.Numbers = "shortest",
    list_models: Annotated[
        bool, Option("--list", help="List the built-in models and exit.")
    ] = False,
) -> None:
    """Build a built-in model, or a model from Python, YAML or JSON, and write its .osim file.

    The model is validated first; nothing is written if it has an error. With human-walks, its Moco
    study (.omoco) and a guess are written too; 'osimlite run' solves the study.

    Example: osimlite build dynamic-walker -p thigh_length=0.42 -o walker.osim
    """
    from osimlite.base.files import make_folder_of
    from osimlite.base.text import format_count
    from osimlite.cli._console import complain, print_for_programs, say, show
    from osimlite.errors import OsimliteError
    from osimlite.io.document.printer import to_text, write
    from osimlite.lint import validate
    from osimlite.models.source import make_model, write_companion_files

    if list_models:
        _list_models()
        return
    if source is None:
        raise OsimliteError("name a model to build, or use --list")
    style = options.check_number_format(numbers)
    model = make_model(source, options.parse_named_words(parameter, "-p"))
    report = validate(model)
    if not report.ok:
        from osimlite.lint.reporters import render

        show(render(report, "full"), err=True)
        complain(f"'{source}' has errors; nothing was written")
        raise SystemExit(1)
    if str(output) == "-":
        print_for_programs(to_text(model, numbers=style))
        return
    target = output or Path(f"{model.name or 'model'}.osim")
    if target.suffix == ".omoco":
        raise OsimliteError(
            f"{target}: this name is reserved for the Moco study of the model; name the model's file, {target.stem}.osim"
        )
    make_folder_of(target)
    write(model, target, numbers=style)
    # As `osimlite info` counts: without the components that OpenSim adds itself.
    tree = model.tree()
    count = sum(not tree.is_internal(component) for component in tree.components)
    warning_count = len(report.warnings)
    advice = (
        f"; {format_count(warning_count, 'warning')}: see osimlite validate {target}"
        if warning_count
        else ""
    )
    say(f"{target}: {format_count(count, 'component')}{advice}")
    for path in write_companion_files(source, model, target):
        say(f"wrote {path}")


def _list_models() -> None:
    import textwrap

    from osimlite.cli._console import show
    from osimlite.models import BUILT_IN
    from osimlite.models.source import describe_model

    width = max(map(len, BUILT_IN))
    for name in BUILT_IN:
        text = f"{name:{width}}  {describe_model(name)}"
        show(
            textwrap.fill(
                text, width=79, subsequent_indent=" " * (width + 2), break_on_hyphens=False
            )
            + "\n"
        )
