"""Writing and drawing of tables for the commands on recorded motions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from osimlite.base.files import make_folder
from osimlite.base.quantity import LARGEST_JOINT_ANGLE
from osimlite.base.text import format_count, join_words
from osimlite.cli._console import say
from osimlite.io.tables.storage import StoTable, write_sto
from osimlite.simulation.recorded_motion import RecordedMotion

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism
    from osimlite.schema.model import Model


def write_results(
    recorded: RecordedMotion, tables: Mapping[str, StoTable], folder: Path, *, trc: bool = False
) -> None:
    """Write tables into a folder and print a summary.

    Args:
        recorded: motion from which the tables were computed.
        tables: tables by file name.
        folder: output folder.
        trc: whether to write the table of markers as markers.trc, too.
    """
    make_folder(folder)
    for name, table in tables.items():
        write_sto(
            folder / name,
            table.name,
            table.times,
            table.columns,
            table.rows.tolist(),
            in_degrees=table.in_degrees,
        )
    names = list(tables)
    if trc:
        from osimlite.io.tables.writers import write_trc

        markers = tables["markers.sto"]
        # Each marker has three columns, and the first one ends with _X.
        labels = [label.removesuffix("_X") for label in markers.columns[::3]]
        write_trc(folder / "markers.trc", markers.times.tolist(), labels, markers.rows.tolist())
        names.append("markers.trc")
    print_motion_summary(recorded, [folder / name for name in names])


def print_motion_summary(recorded: RecordedMotion, files: Iterable[Path]) -> None:
    """Print the coordinates and times of a motion that were used, and the written files.

    Args:
        recorded: motion that was read.
        files: paths of the written files.
    """
    for sentence in recorded.describe_columns():
        say(sentence)
    is_rotational = [info.motion_type == "rotational" for info in recorded.mechanism.coordinates]
    largest = abs(recorded.values[:, is_rotational]).max(initial=0.0)
    if largest > LARGEST_JOINT_ANGLE:
        say(
            f"the largest angle is {largest:.4g} rad; if the motion is in degrees, write "
            "inDegrees=yes in the header of its file"
        )
    times = recorded.times
    paths = join_words([str(file) for file in files])
    say(f"{format_count(len(times), 'row')} from {times[0]:g} s to {times[-1]:g} s; wrote {paths}")


def warn_of_extrapolated_loads(loads: str | Path | None, recorded: RecordedMotion) -> None:
    """Print a warning if a motion has times at which its loads were not measured.

    Args:
        loads: file of the loads; None without.
        recorded: motion along which the loads act.
    """
    if loads is None:
        return
    from osimlite.simulation.elements.external_loads import read_measured_times

    times = read_measured_times(loads)
    if len(times) < 2:
        # A single row is a constant load.
        return
    # One row more or less, and rounded times, are no fault, as in OSIM845.
    slack = 1.01 * (times[-1] - times[0]) / (len(times) - 1)
    first, last = recorded.times[0], recorded.times[-1]
    if first < times[0] - slack or last > times[-1] + slack:
        say(
            f"warning: the loads are measured from {times[0]:g} to {times[-1]:g} s, but the motion "
            f"lasts from {first:g} to {last:g} s: as in OpenSim, the loads are extrapolated, which "
            "can make them very large; limit the times with --from and --until"
        )


def require_plots(*, plot: bool, band: Path | None = None) -> None:
    """Raise an error if requested pictures cannot be drawn.

    Args:
        plot: whether pictures are requested.
        band: file of reference bands, which is read to find errors early; None without.

    Raises:
        MissingDependency: matplotlib is not installed.
        SettingError: there are bands, but no pictures.
        DocumentError: the file has no bands.
    """
    # The file is read here for its errors only, before the computation begins.
    if band is not None:
        from osimlite.errors import SettingError
        from osimlite.view.bands import read_bands

        if not plot:
            raise SettingError("--band has no effect without --plot; add --plot")
        read_bands(band)
    if plot:
        from osimlite.base.require import require

        require("matplotlib", extra="plot", purpose="drawing")


def draw_tables(
    tables: Mapping[str, StoTable],
    folder: Path,
    model: Model | None,
    mechanism: Mechanism | None,
    loads: Any = None,
    *,
    err: bool = False,
    band: Path | None = None,
) -> list[Path]:
    """Draw tables into a folder, and say how many pictures there are.

    Args:
        tables: tables by the names of their files.
        folder: folder to write into.
        model: model of the tables, for units of actuators and regions of muscles.
        mechanism: mechanism of the model, for units of coordinates.
        loads: file of measured loads, in which steps are searched; None without.
        err: whether to report on standard error.
        band: file of reference bands; None without.

    Returns:
        The PNG files.
    """
    from osimlite.cli._progress import progress_bar
    from osimlite.view.bands import read_bands
    from osimlite.view.table_plots import ColumnNames, plot_tables

    with progress_bar("drawing", len(tables)) as progress:
        names = ColumnNames.from_model(model, mechanism)
        steps = _find_steps(loads, mechanism)
        bands = None if band is None else read_bands(band)
        paths = plot_tables(tables, folder, names, steps=steps, report=progress, bands=bands)
    say(describe_pictures(paths), err=err)
    return paths


def describe_pictures(files: list[Path]) -> str:
    """Return a sentence about the pictures that were drawn."""
    if not files:
        return "no picture: nothing changes over time"
    if len(files) == 1:
        return f"drew {files[0]}"
    return f"drew {len(files)} pictures into {files[0].parent}"


def _find_steps(loads: Any, mechanism: Mechanism | None) -> dict[str, Any]:
    """Return the steps of the feet by side; none if the loads do not show them."""
    if mechanism is None or loads is None or Path(str(loads)).suffix.lower() != ".xml":
        return {}
    from osimlite.errors import OsimliteError
    from osimlite.tools.evidence import find_steps

    try:
        # The vertical axis is that of gravity, since models of other programs have z up.
        return dict(find_steps(Path(loads), int(abs(mechanism.gravity).argmax())))
    # Steps only decorate the pictures, and the computation has read the same loads.
    except OsimliteError:
        return {}
