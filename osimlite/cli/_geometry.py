"""Where commands look for mesh files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

Geometry = Annotated[
    list[Path] | None,
    typer.Option(
        "--geometry",
        metavar="FOLDER",
        help="Look for mesh files here too, after the model's folder and its folder Geometry; may be repeated. "
        "Folders in the environment variable OSIMLITE_GEOMETRY, separated by colons, come last.",
    ),
]
"""The option ``--geometry``."""


def named_folders(geometry: Sequence[Path] | None) -> Sequence[Path]:
    """The folders of the option; MissingFileError if one is not there."""
    from osimlite.errors import MissingFileError

    for place in geometry or ():
        if not place.is_dir():
            raise MissingFileError("--geometry names a folder that is not there", file=str(place))
    return geometry or ()
