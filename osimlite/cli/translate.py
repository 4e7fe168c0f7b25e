"""``osimlite translate``: a model as a file of another program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command
from osimlite.cli._console import add_row, plain_console, plain_table, say
from osimlite.text import listed

if TYPE_CHECKING:
    from collections.abc import Callable

    from osimlite.translate.export import Urdf
    from osimlite.translate.fidelity import Fidelity
    from osimlite.translate.mjcf.export import Mjcf


@command
def translate(
    file: options.File,
    to: Annotated[str, Option("--to", help="The format: 'urdf', or 'mjcf' for MuJoCo.")] = "urdf",
    output: options.Folder = None,
    geometry: options.Geometry = None,
    limits: Annotated[
        str | None,
        Option(
            help="'range' writes coordinate ranges as hard limits, which they are not in OpenSim.",
            show_default="none",
            rich_help_panel="URDF",
        ),
    ] = None,
    merge: Annotated[
        bool | None,
        Option("--merge", help="Make bodies that do not move relative to each other one link.", rich_help_panel="URDF"),
    ] = None,
    collision: Annotated[
        bool | None,
        Option(
            "--collision",
            help="Write contact geometry as collision shapes (a half space as a large box).",
            rich_help_panel="URDF",
        ),
    ] = None,
    effort: Annotated[
        float | None,
        Option(
            help="Greatest force (N, N m) of joints whose coordinate has no actuators that limit it.",
            show_default="no limit",
            rich_help_panel="URDF",
        ),
    ] = None,
    velocity: Annotated[
        float | None,
        Option(help="Greatest rate (m/s, rad/s) of all joints.", show_default="no limit", rich_help_panel="URDF"),
    ] = None,
    mujoco: Annotated[
        int | None, Option(help="The version to write for, 3 or 4.", show_default="4", rich_help_panel="MJCF")
    ] = None,
    contact: Annotated[
        str | None,
        Option(
            help="'native' writes contact forces as contacts of MuJoCo's own law, 'none' leaves them out.",
            show_default="native",
            rich_help_panel="MJCF",
        ),
    ] = None,
    fit: Annotated[
        str | None,
        Option(
            help="'wraps' fits what tendons go around to the paths, 'force' muscles too (up to a minute).",
            show_default="none",
            rich_help_panel="MJCF",
        ),
    ] = None,
    check: Annotated[
        Path | None,
        Option(
            metavar="MJCF",
            help="Translate nothing, but measure this file, by whatever program, against the model (needs MuJoCo).",
            show_default=False,
            rich_help_panel="MJCF",
        ),
    ] = None,
    spline: Annotated[
        str | None,
        Option(
            help="What joints follow that move by splines: a 'quartic', or 'series': a quartic of a quartic.",
            show_default="series",
            rich_help_panel="MJCF",
        ),
    ] = None,
    driver: Annotated[
        bool | None,
        Option(
            "--driver",
            help="Write what osimlite.mjcf.Driver moves by OpenSim's own laws: the file itself has no forces.",
            rich_help_panel="MJCF",
        ),
    ] = None,
) -> None:
    """Translate a model: writes its text, its meshes and fidelity.json.

    --to urdf writes <file>.urdf and <file>.coordinates.json, which says how
    coordinates drive joints where URDF cannot; --to mjcf writes <file>.xml.
    Meshes in VTK's format (.vtp) become .obj, text .stl becomes binary.
    fidelity.json says what became of every component, and the table what is lost.
    --check MJCF prints lengths, moment arms and forces of its muscles beside the
    model's; with -o it writes them to check.json.

    Example: osimlite translate gait.osim --geometry ~/OpenSim/Geometry -o robot
    """
    from osimlite.document.reader import read
    from osimlite.errors import OsimliteError, SettingError
    from osimlite.translate import to_mjcf, to_urdf

    if check is not None:
        from osimlite.cli._checking_mjcf import check as check_mjcf

        check_mjcf(file, check, output)
        return
    formats: dict[str, tuple[Callable[..., Urdf | Mjcf], dict[str, Any]]] = {
        "urdf": (
            to_urdf,
            {"limits": limits, "merge": merge, "collision": collision, "effort": effort, "velocity": velocity},
        ),
        "mjcf": (to_mjcf, {"mujoco": mujoco, "contact": contact, "fit": fit, "spline": spline, "driver": driver}),
    }
    if to not in formats:
        raise OsimliteError(f"--to is 'urdf' or 'mjcf', not '{to}'")
    for name, (_, choices) in formats.items():
        strange = [choice for choice, value in choices.items() if value is not None and name != to]
        if strange:
            raise SettingError(f"--{strange[0]} is an option of --to {name}")
    export, choices = formats[to]
    given = {name: value for name, value in choices.items() if value is not None}
    made = export(
        read(file), folder=file.parent, name=file.stem, geometry=options.mesh_folders(file, geometry), **given
    )
    written = made.write(options.results_folder(file, output))

    if len(made.fidelity):
        plain_console().print(_table(made.fidelity, to.upper()))
    robot, (same, otherwise, lost) = made.robot, made.fidelity.counts()
    say(f"{same} components as they are, {otherwise} in another way, {lost} left out")
    say(
        f"{len(robot.links)} links, {len(robot.joints)} joints of which {len(robot.moving)} move; wrote "
        + listed([str(path) for path in written], most=4)
    )


def _table(fidelity: Fidelity, target: str) -> Any:
    """What is lost, one row for all components of which the same is said."""
    table = plain_table(f"What {target} cannot say of {fidelity.model}", padding=(0, 2, 1, 0))
    table.add_column("what", overflow="fold", ratio=4)
    table.add_column("done about it", overflow="fold", ratio=3)
    table.add_column("where", overflow="fold", ratio=3)
    measured = any(record.errors for record in fidelity)
    if measured:
        table.add_column("worst error", overflow="fold", ratio=2)
    for group in fidelity.groups():
        # Nobody knows a path but by the name of its muscle.
        owners = (component.removesuffix("/path") for component in group.components)
        names = dict.fromkeys(owner.rsplit("/", 1)[1] or "the model" for owner in owners)
        worst = [f"{name} {error.max:.2g} {error.unit}" for name, error in group.worst()]
        add_row(
            table, group.cannot_say, group.done, listed(list(names), most=3), *([", ".join(worst)] if measured else [])
        )
    return table
