"""``osimlite translate``: convert a model to the format of another program."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.base.text import format_count, join_words
from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import print_table, say
from osimlite.translate.exporters import list_exporters
from osimlite.translate.importers import OSIM, find_format, list_importers

if TYPE_CHECKING:
    from osimlite.base.options import OptionSpec
    from osimlite.translate.importers import Importer


WRITTEN = "the file that is written"
"""Value of --check without a file."""


def _list_format_options() -> Iterator[OptionSpec]:
    for exporter in list_exporters("translate").values():
        yield from exporter.choices
    for importer in _list_model_importers():
        yield from importer.choices


def _list_model_importers() -> list[Importer]:
    """Return the importers of formats that become a model."""
    return [importer for importer in list_importers().values() if importer.target == OSIM]


def _describe_formats() -> str:
    sentences = [
        f"'{name}' writes {exporter.help}" for name, exporter in list_exporters("translate").items()
    ]
    titles = join_words([importer.title for importer in _list_model_importers()])
    return "The format: " + "; ".join(
        [*sentences, f"'{OSIM}' converts a file of {titles} to OpenSim"]
    )


@command_with(_list_format_options)
def translate(
    file: options.File,
    to: Annotated[str, Option("--to", metavar="FORMAT", help=f"{_describe_formats()}.")] = "urdf",
    output: options.Folder = None,
    geometry: options.Geometry = None,
    check: Annotated[
        Path | None,
        Option(
            metavar="[MJCF]",
            help="Only compare this MJCF file with the model, and translate nothing; without a file, translate "
            "to MJCF and compare the result (needs MuJoCo).",
            show_default=False,
            bare_value=WRITTEN,
        ),
    ] = None,
    overwrite: options.Overwrite = False,
    **option_values: Any,
) -> None:
    """Translate a model to another format: writes the model, its meshes and fidelity.json.

    FILE is an OpenSim model; with --to osim it is an MJCF file (.xml).
    VTK meshes (.vtp) become .obj, text .stl becomes binary. fidelity.json describes how each
    component was translated, and the table on the screen what was lost or approximated. --check MJCF
    prints the errors of lengths, moment arms and forces of its muscles; with -o it writes them to
    check.json.

    Example: osimlite translate gait.osim --geometry ~/OpenSim/Geometry -o robot
    """
    from osimlite.cli._converting import OutputGuard
    from osimlite.cli._progress import progress_bar
    from osimlite.errors import OsimliteError, SettingError
    from osimlite.io.document.reader import read

    # With a file, `--check` compares and translates nothing.
    if check is not None and str(check) != WRITTEN:
        from osimlite.cli._checking_mjcf import print_mjcf_check as check_mjcf

        check_mjcf(file, check, output)
        return
    if check is not None:
        from osimlite.base.require import require

        require("mujoco", extra="mujoco", purpose="--check")
        # A check needs a translation to MJCF, also with another value of `--to`.
        to = "mjcf"
    formats = list_exporters("translate")
    if to not in (*formats, OSIM):
        raise OsimliteError(f"--to is {' or '.join(map(repr, (*formats, OSIM)))}, not '{to}'")
    importer = _find_importer(file) if to == OSIM else None
    owners: list[tuple[Any, str, bool]] = [
        (converter, f"--to {name}", name == to) for name, converter in formats.items()
    ]
    owners += [
        (converter, f"--to {OSIM} from {converter.title}", converter is importer)
        for converter in _list_model_importers()
    ]
    # An option of another format would be ignored without a message.
    for converter, option_name, is_used in owners:
        foreign_options = [
            option.name
            for option in converter.choices
            if option_values[option.name] is not None and not is_used
        ]
        if foreign_options:
            raise SettingError(
                f"--{foreign_options[0].replace('_', '-')} is an option of {option_name}"
            )
    # Formats have defaults of their own, which None must not replace.
    set_values = {name: value for name, value in option_values.items() if value is not None}
    translated: Any
    with progress_bar("translating", None):
        if importer is not None:
            translated = importer.read(file, name=file.stem, **set_values)
        else:
            translated = formats[to].write(
                read(file),
                folder=file.parent,
                name=file.stem,
                geometry=options.list_mesh_folders(file, geometry),
                **set_values,
            )
    folder = options.choose_output_folder(file, output)
    suffix = OSIM if importer is not None else {"mjcf": "xml"}.get(to, to)
    guard = OutputGuard(folder, f"{file.stem}.{suffix}", file.name, overwrite=overwrite)
    guard.protect_records()
    guard.protect_files(translated)
    paths = translated.write(folder)

    if len(translated.fidelity):
        from osimlite.cli._fidelity_table import tabulate

        print_table(tabulate(translated.fidelity, to))
    exact_count, changed_count, lost_count = translated.fidelity.counts()
    say(
        f"components: {exact_count} exact, {changed_count} approximated or converted, {lost_count} left out"
    )
    # URDF has a robot, whose links and joints are the summary.
    robot = getattr(translated, "robot", None)
    summary = (
        ", ".join(f"{count} {part_type}" for part_type, count in translated.summary.items())
        if robot is None
        else f"{format_count(len(robot.links), 'link')}, {format_count(len(robot.joints), 'joint')} "
        f"({len(robot.moving)} moving)"
    )
    say(f"{summary}; wrote " + join_words([str(path) for path in paths], max_count=4))
    # Some formats cannot express the initial state, and say so.
    if getattr(translated, "start_note", ""):
        say(translated.start_note)
    if check is not None:
        from osimlite.cli._checking_mjcf import print_mjcf_check as check_mjcf

        check_mjcf(file, paths[0], folder)


def _find_importer(file: Path) -> Importer:
    """Return the importer of a file.

    Raises:
        OsimliteError: the file has no format that becomes a model.
    """
    from osimlite.errors import OsimliteError

    importer_by_name = {importer.name: importer for importer in _list_model_importers()}
    name = find_format(file)
    if name not in importer_by_name:
        titles = join_words([importer.title for importer in importer_by_name.values()])
        raise OsimliteError(
            f"this is not a file of {titles}, which --to {OSIM} converts", file=str(file)
        )
    return importer_by_name[name]
