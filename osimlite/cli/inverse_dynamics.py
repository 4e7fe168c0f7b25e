"""``osimlite inverse-dynamics``: compute the generalized forces of a recorded motion."""

from __future__ import annotations

from typing import Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with


@command_with(options.list_simulation_options("wrapping", "external_loads", "opensim_derivatives"))
def inverse_dynamics(
    file: options.File,
    motion: options.Motion,
    applied: options.AppliedTo = None,
    exclude: Annotated[
        list[str] | None,
        Option(
            metavar="NAME",
            help="Forces to leave out: the name of a force or of a group, or All, Actuators or Muscles (default: Muscles).",
            show_default=False,
        ),
    ] = None,
    lowpass: options.Lowpass = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    plot: options.Plot = False,
    band: options.Band = None,
    output: options.Folder = None,
    **option_values: Any,
) -> None:
    """Compute the generalized forces of a recorded motion: writes inverse_dynamics.sto.

    Each coordinate has one generalized force (N or N·m): the force that produces the motion in
    addition to gravity, measured loads and the forces of the model (springs and contacts, but not
    muscles). Coordinates are differentiated by splines of fifth degree, as in OpenSim's tool. Filter
    motions from motion capture first: --lowpass 6.

    Example: osimlite inverse-dynamics gait2392.osim walk.mot --lowpass 6 --external-loads grf.xml
    """
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import (
        draw_tables,
        require_plots,
        warn_of_extrapolated_loads,
        write_results,
    )
    from osimlite.io.document.reader import read
    from osimlite.simulation.inverse_dynamics import inverse_dynamics as forces_of

    # Before the computation, which can take minutes: a missing package or file ends the command
    # here.
    require_plots(plot=plot, band=band)
    model = read(file)
    with progress_bar("computing moments", None):
        table = forces_of(
            model,
            motion,
            applied_to=options.parse_applied_loads(applied),
            exclude=exclude or ["Muscles"],
            lowpass=lowpass,
            start=first,
            end=last,
            folder=file.parent,
            **option_values,
        )
    assert table.motion is not None
    folder = options.choose_output_folder(file, output)
    tables = {"inverse_dynamics.sto": table}
    write_results(table.motion, tables, folder)
    loads = option_values.get("external_loads")
    warn_of_extrapolated_loads(loads, table.motion)
    if plot:
        draw_tables(tables, folder, model, table.motion.mechanism, loads, band=band)
