"""``osimlite muscles``: lengths, moment arms and forces of muscles over coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with

if TYPE_CHECKING:
    from osimlite.mechanics.multibody.mechanism import Mechanism
    from osimlite.simulation.muscle_curves import MuscleCurves


@command_with(options.list_simulation_options("wrapping"))
def muscles(
    file: options.File,
    coordinate: Annotated[
        list[str] | None,
        Option(
            "--coordinate",
            metavar="NAME[=LOW:HIGH]",
            help="Vary a coordinate (rad, m, or -120deg:0; default: its range). Repeat it to vary two.",
            show_default="the default pose only",
        ),
    ] = None,
    muscle: Annotated[
        list[str] | None,
        Option(
            "--muscle",
            metavar="NAME",
            help="Only this muscle; may be repeated.",
            show_default="all that the coordinate moves",
        ),
    ] = None,
    points: Annotated[
        int | None,
        Option(
            min=2,
            help="Number of values of each coordinate.",
            show_default="50; 15 for two coordinates",
        ),
    ] = None,
    activation: Annotated[float, Option(help="Activation of all muscles, 0 to 1.")] = 1.0,
    compare: Annotated[
        Path | None,
        Option(
            metavar="FILE",
            help="Compare with this model, for example a scaled one.",
            show_default=False,
        ),
    ] = None,
    plot: Annotated[bool, Option("--plot", help="Draw a picture (PNG) of each quantity.")] = False,
    output: Annotated[
        Path | None,
        Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write all numbers: .csv or .parquet, SI units.",
            show_default=False,
        ),
    ] = None,
    *,
    wrapping: str,
) -> None:
    """Compute lengths, moment arms, fiber lengths and forces of muscles over a coordinate, like OpenSim's plotter.

    Fibers are in equilibrium with their tendons at the activation that --activation gives, and the
    model is at rest. Prints the minimum and maximum for each muscle; -o writes every number.

    Example: osimlite muscles gait2392.osim --coordinate knee_angle_r=-120deg:0 --plot
    """
    from osimlite.base.files import expect_folder_of, make_folder_of
    from osimlite.base.text import join_words
    from osimlite.cli._console import say
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import require_plots
    from osimlite.errors import ModelError, SettingError
    from osimlite.io.document.reader import read
    from osimlite.mechanics.multibody import build_mechanism
    from osimlite.simulation.muscle_curves import muscle_curves

    # All options are checked before the model is read, which may take seconds.
    if output is not None and output.suffix not in (".csv", ".parquet"):
        raise SettingError(f"-o must name a .csv or .parquet file, not '{output.name}'")
    if output is not None:
        expect_folder_of(output)
    if len(coordinate or ()) > 2:
        raise SettingError("--coordinate can be given once or twice")
    if plot and not coordinate:
        raise SettingError("--plot needs a --coordinate for the horizontal axis; add one")
    require_plots(plot=plot)
    model = read(file)
    mechanism = build_mechanism(model)
    # Two coordinates make a grid, whose size is the square of the number of values.
    values = _sample_coordinates(
        mechanism, coordinate or (), points or (15 if len(coordinate or ()) > 1 else 50)
    )
    result: dict[str, MuscleCurves] = {}
    for path in (file, *((compare,) if compare is not None else ())):
        with progress_bar("computing muscles", None) as advance:
            curves = muscle_curves(
                model if path is file else read(path),
                values,
                muscle or (),
                activation=activation,
                wrapping=wrapping,
                folder=path.parent,
                progress=advance,
            )
        # Muscles that do not move with the coordinates would fill the table with constants.
        result[str(path)] = curves if muscle else curves.select_muscles(curves.crossing)
    first, *other_curves = result.values()
    if not first.muscles:
        raise ModelError(
            f"'{file.name}' has no muscle"
            + (f" that moves with {join_words(list(values))}" if values else "s")
        )
    if other_curves:
        # Only muscles of both models can be compared.
        first, second = _select_common_muscles(first, other_curves[0])
        result = dict(zip(result, (first, second), strict=True))
    _print_ranges(list(result.values()), file, compare)
    if output is not None:
        make_folder_of(output)
        _write_curves(result, output)
        say(f"wrote {output}")
    if plot:
        from osimlite.view.muscle_plots import plot_muscles
        from osimlite.view.table_plots import ColumnNames

        # Pictures go beside the table, if there is one.
        folder = output.parent / output.stem if output is not None else Path(f"{file.stem}-muscles")
        with progress_bar("drawing", None):
            regions = ColumnNames.from_model(model, mechanism).regions
            compared = second if other_curves else None
            paths = plot_muscles(first, mechanism, folder, compared, regions=regions)
        say(f"wrote {len(paths)} pictures into {folder}")


def _sample_coordinates(
    mechanism: Mechanism, assignments: Sequence[str], points: int
) -> dict[str, list[float]]:
    """Return the values of each coordinate that is varied.

    Args:
        mechanism: mechanism with the coordinates.
        assignments: coordinates with an optional range, NAME or NAME=LOW:HIGH.
        points: number of values.

    Raises:
        SettingError: a coordinate is unknown or named twice, or its range is missing, invalid
            or probably in degrees.
    """
    from math import isfinite

    from osimlite.errors import ModelError, SettingError
    from osimlite.simulation.initial_state import convert_value, describe_suspect_value

    result = {}
    for assignment in assignments:
        name, equals, range_text = (bound_text.strip() for bound_text in assignment.partition("="))
        if name in result:
            raise SettingError(f"--coordinate names '{name}' twice; leave one out")
        try:
            mechanism_coordinate = mechanism.coordinates[mechanism.coordinate_index(name)]
        except ModelError as error:
            raise SettingError(f"--coordinate: {error.message}") from None
        lower, upper = mechanism_coordinate.range
        if equals:
            bound_texts = range_text.split(":")
            if len(bound_texts) != 2:
                raise SettingError(
                    f"--coordinate takes NAME=LOW:HIGH, such as {name}=-120deg:0, got '{assignment}'"
                )
            for bound_text in bound_texts:
                if suspicion := describe_suspect_value(mechanism_coordinate, name, bound_text):
                    raise SettingError(
                        f"--coordinate: {suspicion} (if not, write {bound_text.strip()}rad)"
                    )
            lower, upper = (
                convert_value(mechanism, name, bound_text) for bound_text in bound_texts
            )
        if equals and lower > upper:
            raise SettingError(
                f"--coordinate takes the lower end of the range first, got '{assignment}'"
            )
        if not (isfinite(lower) and isfinite(upper) and lower < upper):
            raise SettingError(
                f"coordinate '{name}' has no range to sweep; give one, such as {name}=-1:1"
            )
        result[name] = [lower + (upper - lower) * k / (points - 1) for k in range(points)]
    return result


def _select_common_muscles(
    first: MuscleCurves, second: MuscleCurves
) -> tuple[MuscleCurves, MuscleCurves]:
    """Return the curves of both models for the muscles whose names occur in both.

    Returns:
        Curves of the first and of the second model, both in the order of the first.

    Raises:
        ModelError: the models have no muscle of the same name.
    """
    from osimlite.base.text import join_words
    from osimlite.cli._console import say
    from osimlite.errors import ModelError

    # Models may keep their muscles in different sets, so names are compared, not paths.
    names = [[path.rpartition("/")[2] for path in curves.muscles] for curves in (first, second)]
    common_names = [name for name in names[0] if name in names[1]]
    single_names = [name for name in dict.fromkeys(names[0] + names[1]) if name not in common_names]
    if not common_names:
        raise ModelError("the two models have no muscle of the same name")
    if single_names:
        say(f"in one model only: {join_words(single_names)}")
    first_common, second_common = (
        curves.select_muscles([model_names.index(name) for name in common_names])
        # Both selections have the order of the first model.
        for curves, model_names in zip((first, second), names, strict=True)
    )
    return first_common, second_common


def _print_ranges(curves: Sequence[MuscleCurves], file: Path, compare: Path | None) -> None:
    """Print a table of least and greatest values, or of the largest differences between two models."""
    import numpy as np

    from osimlite.base.text import format_range
    from osimlite.cli._console import add_row, create_table, print_table, say

    first, *compared = curves
    arms = {f"moment_arm_{name}": f"arm {name} (mm)" for name in first.coordinates}
    # The length belongs to one coordinate; over two, arms say more.
    lengths = {"length": "length (mm)"} if len(arms) < 2 else {}
    label_by_quantity = {
        **lengths,
        **arms,
        "normalized_fiber_length": "fiber / optimal",
        "tendon_force": "tendon (N)",
    }
    table = create_table(
        f"Largest differences of {compare.name} from {file.name}" if compare is not None else ""
    )
    table.add_column("Muscle")
    columns = [[path.rpartition("/")[2] for path in first.muscles]]
    for name, label in label_by_quantity.items():
        table.add_column(label, justify="right")
        factor, form = (
            (1000.0, ".1f")
            if label.endswith("(mm)")
            else (1.0, ".0f" if label.endswith("(N)") else ".3f")
        )
        lower, upper = first.get_bounds(name)
        if compared:
            # `fmax` ignores NaN, where a muscle has no equilibrium.
            lower = upper = np.fmax.reduce(np.abs(compared[0].columns[name] - first.columns[name]))
        columns.append(
            [
                format_range(factor * smallest, factor * largest, form)
                for smallest, largest in zip(lower, upper, strict=True)
            ]
        )
    for row in zip(*columns, strict=True):
        add_row(table, *row)
    print_table(table)
    # NaN marks poses without an equilibrium.
    unsolved_count = sum(bool(np.isnan(rows.columns["tendon_force"]).any()) for rows in curves)
    if unsolved_count:
        say("'-' and gaps in the table: the muscle has no equilibrium there")


def _write_curves(result: Mapping[str, MuscleCurves], output: Path) -> None:
    """Write a table with one row for each model, pose and muscle."""
    import io

    import numpy as np

    from osimlite.base.files import write_atomically

    columns: dict[str, list[Any]] = {}
    for file, curves in result.items():
        # Models are written below each other, told apart by the first column.
        rows, numbers = curves.table
        for name, column in {
            "model": np.full(len(rows["muscle"]), file),
            **rows,
            **numbers,
        }.items():
            columns.setdefault(name, []).extend(column.tolist())
    if output.suffix == ".parquet":
        from osimlite.base.require import require

        arrow = require("pyarrow", extra="sweep", purpose="a .parquet table")
        parquet = require("pyarrow.parquet", extra="sweep", purpose="a .parquet table")
        buffer = io.BytesIO()
        parquet.write_table(arrow.table(columns), buffer)
        write_atomically(output, buffer.getvalue())
        return
    import csv

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    write_atomically(output, text.getvalue().encode())
