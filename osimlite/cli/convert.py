"""``osimlite convert``: convert files between programs, with a record of what is lost."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command_with
from osimlite.translate.exporters import EXPORTERS
from osimlite.translate.importers import IMPORTERS

if TYPE_CHECKING:
    from osimlite.base.options import OptionSpec


def _list_choices() -> Iterator[OptionSpec]:
    """Yield the options of all formats."""
    names = set()
    for options_of_format in [
        *(importer.choices for importer in IMPORTERS),
        *(exporter.choices for exporter in EXPORTERS),
    ]:
        for option in options_of_format:
            # A format that is read and written has some options for both.
            if option.name not in names:
                names.add(option.name)
                yield option


@command_with(_list_choices)
def convert(
    file: Annotated[
        Path | None,
        Argument(metavar="IN", help="The file to convert.", show_default=False),
    ] = None,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="OUT",
            help="File to write, whose suffix decides the format, or a folder.",
            show_default="a folder named after the file",
        ),
    ] = None,
    source: Annotated[
        str | None,
        Option(
            "--from",
            metavar="FORMAT",
            help="Format of the file.",
            show_default="by its suffix and content",
        ),
    ] = None,
    target: Annotated[
        str | None,
        Option(
            "--to",
            metavar="FORMAT",
            help="Format to write.",
            show_default="by the suffix of OUT; without one, files of other programs become OpenSim's",
        ),
    ] = None,
    motion: Annotated[
        Path | None,
        Option(
            "--motion",
            metavar="FILE",
            help="Coordinates over time (.sto, .mot), for formats with motions.",
            show_default=False,
        ),
    ] = None,
    geometry: options.Geometry = None,
    formats: Annotated[
        bool, Option("--formats", help="List all formats and what each carries.")
    ] = False,
    overwrite: options.Overwrite = False,
    **option_values: Any,
) -> None:
    """Convert between OpenSim's files and AddBiomechanics, MuJoCo, URDF, glTF and other formats.

    Writes the converted files, fidelity.json, which lists what was translated, approximated or left
    out, and summary.json. --formats lists what can be read and written, and what each format carries.

    Example: osimlite convert gait.osim -o robot/gait.urdf
    """
    from osimlite.cli import _converting as converting
    from osimlite.cli._progress import progress_bar
    from osimlite.errors import SettingError

    if formats:
        converting.print_formats()
        return
    if file is None:
        raise SettingError("name a file to convert; --formats lists the formats")
    set_options = {name: value for name, value in option_values.items() if value is not None}
    request = converting.Request.create(file, output, source, target)
    with progress_bar("converting", None):
        result = request.carry_out(motion, geometry, set_options, overwrite=overwrite)
    converting.report(request, result)
