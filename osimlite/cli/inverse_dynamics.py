"""``osimlite inverse-dynamics``: the generalized forces that a recorded motion takes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def inverse_dynamics(
    file: Annotated[Path, typer.Argument(help="A model file.", show_default=False)],
    motion: Annotated[Path, typer.Argument(help="Coordinates over time, .mot or .sto.", show_default=False)],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write into.", show_default="this folder"),
    ] = Path("."),
) -> None:
    """Find the forces of a recorded motion: writes inverse_dynamics.sto.

    One generalized force (N or N·m) for each coordinate: what it takes beyond gravity to make the bodies move so. The
    coordinates are differentiated by splines of fifth degree, as in OpenSim's tool. Forces of the model and measured
    loads are not taken into account.

    Example: osimlite inverse-dynamics gait2392.osim walk.mot -o results
    """
    from osimlite.cli._recorded import opened, written

    recorded = opened(file, motion)
    written(recorded, {"inverse_dynamics.sto": recorded.inverse_dynamics()}, output)
