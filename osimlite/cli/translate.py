"""``osimlite translate``: a model as a file of another program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from osimlite.cli import _options as options
from osimlite.cli._console import add_row, plain_console, say
from osimlite.text import listed, visible

if TYPE_CHECKING:
    from osimlite.translate.fidelity import Fidelity


def translate(
    file: options.File,
    to: Annotated[str, typer.Option("--to", help="The format: 'urdf'.")] = "urdf",
    output: options.Folder = None,
    limits: Annotated[
        str, typer.Option(help="'range' writes coordinate ranges as hard limits, which they are not in OpenSim.")
    ] = "none",
    merge: Annotated[
        bool, typer.Option("--merge", help="Make bodies that do not move relative to each other one link.")
    ] = False,
    collision: Annotated[
        bool,
        typer.Option("--collision", help="Write contact geometry as collision shapes (a half space as a large box)."),
    ] = False,
    effort: Annotated[
        float | None,
        typer.Option(
            help="Greatest force (N, N m) of joints whose coordinate has no actuators that limit it.",
            show_default="no limit",
        ),
    ] = None,
    velocity: Annotated[
        float | None, typer.Option(help="Greatest rate (m/s, rad/s) of all joints.", show_default="no limit")
    ] = None,
    geometry: options.Geometry = None,
) -> None:
    """Translate a model: writes <file>.urdf, its meshes, <file>.coordinates.json and fidelity.json.

    Meshes in VTK's format (.vtp) become .obj, text .stl becomes binary.
    coordinates.json says how coordinates drive joints, where URDF cannot.
    fidelity.json says what became of every component, and the table what is lost.

    Example: osimlite translate gait.osim --geometry ~/OpenSim/Geometry --collision -o robot
    """
    from typing import cast

    from osimlite.document.reader import read
    from osimlite.errors import OsimliteError
    from osimlite.translate.export import Limits, to_urdf

    if to != "urdf":
        raise OsimliteError(f"--to is 'urdf', not '{to}'")
    if limits not in ("none", "range"):
        raise OsimliteError(f"--limits is 'none' or 'range', not '{limits}'")
    urdf = to_urdf(
        read(file),
        limits=cast("Limits", limits),
        merge=merge,
        collision=collision,
        effort=effort,
        velocity=velocity,
        folder=file.parent,
        name=file.stem,
        geometry=options.mesh_folders(file, geometry),
    )
    written = urdf.write(options.results_folder(file, output))

    if len(urdf.fidelity):
        plain_console().print(_table(urdf.fidelity))
    robot = urdf.robot
    say(
        f"{len(robot.links)} links, {len(robot.joints)} joints of which {len(robot.moving)} move; wrote "
        + listed([str(path) for path in written], most=4)
    )


def _table(fidelity: Fidelity) -> Any:
    """What is lost, one row for all components of which the same is said."""
    from rich.table import Table

    table = Table(title=visible(f"What URDF cannot say of {fidelity.model}"), title_justify="left", show_lines=True)
    table.add_column("what", overflow="fold", ratio=4)
    table.add_column("done about it", overflow="fold", ratio=3)
    table.add_column("where", overflow="fold", ratio=3)
    for group in fidelity.groups():
        names = dict.fromkeys(path.rsplit("/", 1)[1] or "the model" for path in group.components)
        add_row(table, group.cannot_say, group.done, listed(list(names), most=3))
    return table
