"""``osimlite ik``: compute the motion that fits measured markers or orientations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Argument, Option, command


@command
def ik(
    file: options.File,
    trial: Annotated[
        Path,
        Argument(
            help="Measured markers (.trc, .c3d, .sto) or orientations (.sto).", show_default=False
        ),
    ],
    weight: options.Weights = None,
    keep: Annotated[
        list[str] | None,
        Option(
            "--keep",
            metavar="COORDINATE=NUMBER",
            help="Weight that keeps a coordinate near its default (1/rad²); 1 is already a strong weight.",
        ),
    ] = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    free: Annotated[
        bool, Option("--without-constraints", help="Ignore the constraints of the model.")
    ] = False,
    plot: options.Plot = False,
    output: options.Folder = None,
) -> None:
    """Compute the motion that fits measured markers: writes ik.mot and marker_errors.sto.

    The pose of each frame minimizes the weighted mean of the squared distances between measured and model markers.
    Locked coordinates keep their defaults, clamped ones stay in their ranges. ik.mot is in degrees,
    like OpenSim's; marker_errors.sto has the distance of each marker from its measured position (m).
    If TRIAL has orientations of sensors (quaternions), the angles between measured and model
    orientations are minimized, and written to orientation_errors.sto (rad).

    Example: osimlite ik gait2392.osim walk.trc --weight RASI=10 -o results
    """
    from osimlite.base.files import make_folder, write_atomically
    from osimlite.base.text import join_words, suggest_or_list
    from osimlite.cli._console import say
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import draw_tables, require_plots
    from osimlite.errors import SettingError
    from osimlite.fitting.fit_messages import NO_EFFECT, describe_fit, describe_unknown
    from osimlite.fitting.ik_tool import create_motion_table
    from osimlite.fitting.inverse_kinematics import inverse_kinematics
    from osimlite.fitting.marker_data import MarkerData
    from osimlite.fitting.orientation_data import holds_orientations
    from osimlite.io.document.reader import read
    from osimlite.io.tables.old_storage import UNITS, format_old_table
    from osimlite.io.tables.storage import StoTable, write_sto
    from osimlite.schema.coordinates import Coordinate
    from osimlite.schema.markers import Marker

    require_plots(plot=plot)
    weights = options.parse_named_numbers(weight, "--weight")
    coordinate_weights = options.parse_named_numbers(keep, "--keep")
    of_sensors = holds_orientations(trial)
    model = read(file)
    coordinate_names = {coordinate.name for coordinate in model.components(Coordinate)}
    for name in coordinate_weights:
        # A path leads to one coordinate, too.
        if name.rpartition("/")[2] not in coordinate_names:
            raise SettingError(
                f"--keep: '{model.name}' has no coordinate '{name}'{suggest_or_list(name, sorted(coordinate_names))}"
            )
    data = None if of_sensors else MarkerData.from_source(trial)
    with progress_bar("fitting the motion", None):
        motion = inverse_kinematics(
            model,
            data,
            orientations=trial if of_sensors else None,
            weights=weights,
            coordinates=coordinate_weights,
            constraints=not free,
            start=first,
            end=last,
        )
    folder = options.choose_output_folder(file, output)
    make_folder(folder)
    table = create_motion_table(motion)
    write_atomically(folder / "ik.mot", "".join(format_old_table(table, f"\n{UNITS}")))
    measurement, names, errors = "marker", motion.markers, motion.marker_errors
    if of_sensors:
        measurement, names, errors = "orientation", motion.sensors, motion.orientation_errors
    write_sto(
        folder / f"{measurement}_errors.sto",
        f"{measurement} errors",
        motion.times.tolist(),
        names,
        errors.tolist(),
        # Markers that are not seen in a frame have no error there.
        has_missing=True,
    )
    for _, line in describe_fit(motion):
        say(line)
    if unknown_text := describe_unknown(model, NO_EFFECT):
        say(unknown_text, err=True)
    if data is not None:
        marker_names = {marker.name: None for marker in model.components(Marker)}
        if missing_names := [name for name in marker_names if name not in data.names]:
            say(f"in the model, but not in the data: {join_words(missing_names)}")
        if unknown := [name for name in data.names if name not in marker_names]:
            say(f"in the data, but not in the model: {join_words(unknown)}")
    say(f"wrote {folder / 'ik.mot'} and {folder / f'{measurement}_errors.sto'}")
    if plot:
        errors_table = StoTable(f"{measurement} errors", motion.times, tuple(names), errors)
        tables = {"ik.mot": table, f"{measurement}_errors.sto": errors_table}
        draw_tables(tables, folder, model, motion.mechanism)
