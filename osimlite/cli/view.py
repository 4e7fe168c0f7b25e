"""``osimlite view``: a model in the browser, as a page, or as a picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.base.options import OptionSpec
from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command_with
from osimlite.translate.exporters import list_exporters

if TYPE_CHECKING:
    from osimlite.view.model_view import ModelView


def _choices() -> Iterator[OptionSpec]:
    yield from options.list_simulation_options("wrapping")()
    for name, exporter in list_exporters("view").items():
        yield OptionSpec(name, Path | None, exporter.help, unit="FILE")
        yield from exporter.choices


@command_with(_choices)
def view(
    file: options.File,
    motion: Annotated[
        Path | None, Argument(help="Coordinates over time, .sto or .mot.", show_default=False)
    ] = None,
    values: Annotated[
        list[str] | None,
        Option("--set", metavar="NAME=VALUE", help="Value of a coordinate (rad, m, or 30deg)."),
    ] = None,
    forces: Annotated[
        Path | None,
        Option(
            metavar="FILE",
            help="Contact forces over time, a table of OpenSim's ForceReporter.",
            show_default="computed, if the motion has speeds",
        ),
    ] = None,
    geometry: options.Geometry = None,
    port: Annotated[int, Option(help="Port of the page.", show_default="any free port")] = 0,
    browser: options.Browser = True,
    *,
    wrapping: str,
    **option_values: Any,
) -> None:
    """Look at a model and its motion: bodies, contacts, muscles, component tree, a slider for every coordinate.

    Muscles wrap around surfaces in every pose. If the motion has activations, as a file of states
    does, muscles are blue at rest and red when active. Click on a muscle to see its length and moment
    arms over each coordinate that it crosses.

    Opens a page in the browser and serves it until you press Ctrl-C. With --html, --glb, --rerun or
    --screenshot it writes files instead.

    Example: osimlite view gait.osim walk.sto --geometry ~/OpenSim/Geometry --html walk.html
    """
    from osimlite.cli._console import say
    from osimlite.errors import SettingError
    from osimlite.io.document.reader import read
    from osimlite.view.incomplete import build_showable, describe_errors
    from osimlite.view.model_view import ModelView

    model, mechanism, left_out = build_showable(read(file))
    coordinate_values: Mapping[str, float] = options.parse_quantities(values, mechanism, "--set")
    folders = options.list_mesh_folders(file, geometry)
    model_view = ModelView.from_model(
        model,
        mechanism,
        folders,
        file=file,
        motion=motion,
        forces=forces,
        values=coordinate_values,
        wrapping=wrapping,
        left_out=left_out,
    )
    for remark in (
        *model_view.remarks,
        *describe_errors(model_view.findings, model_view.scene.remarks),
    ):
        say(remark)
    requested_exporters = {
        name: exporter
        for name, exporter in list_exporters("view").items()
        if option_values[name] is not None
    }
    # A file of another format would be opened with the wrong program.
    suffixes = {exporter.suffix: exporter for exporter in list_exporters("view").values()}
    for name, exporter in requested_exporters.items():
        suffix = Path(option_values[name]).suffix
        if suffixes.get(suffix, exporter) is not exporter:
            raise SettingError(
                f"--{name} writes a file whose name ends with {exporter.suffix}, found "
                f"'{option_values[name]}'"
            )
    for name, exporter in requested_exporters.items():
        format_options = {option.name: option_values[option.name] for option in exporter.choices}
        say(f"wrote {exporter.write(model_view, option_values[name], **format_options)}")
    if not requested_exporters:
        _serve(model_view, port, browser=browser)


def _serve(model_view: ModelView, port: int, *, browser: bool) -> None:
    import webbrowser

    from osimlite.cli._console import say
    from osimlite.cli._progress import finish_command

    with model_view.create_server(port) as server:
        finish_command()
        say(f"serving {server.url} until you press Ctrl-C")
        if browser:
            webbrowser.open(server.url)
        server.wait()
