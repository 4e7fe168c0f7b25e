"""``osimlite kinematics``: compute positions of bodies and markers during a recorded motion."""

from __future__ import annotations

from typing import Annotated

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command


@command
def kinematics(
    file: options.File,
    motion: options.Motion,
    assemble: Annotated[
        bool,
        Option(
            "--assemble", help="First change each pose so that it fulfils the model's constraints."
        ),
    ] = False,
    trc: Annotated[bool, Option("--trc", help="Also write the markers as markers.trc.")] = False,
    lowpass: options.Lowpass = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    plot: options.Plot = False,
    output: options.Folder = None,
) -> None:
    """Compute positions of bodies and markers along a recorded motion: writes bodies.sto and markers.sto.

    bodies.sto has the mass centre (m) and the body-fixed X-Y-Z angles (degrees) of every body in
    ground, like OpenSim's BodyKinematics, and the mass centre of the model. markers.sto has the
    markers (m).

    Example: osimlite kinematics gait2392.osim walk.mot -o results
    """
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import draw_tables, require_plots, write_results
    from osimlite.io.document.reader import read
    from osimlite.simulation.inverse_dynamics import kinematics as followed

    require_plots(plot=plot)
    model = read(file)
    with progress_bar("computing positions", None):
        recorded = followed(
            model, motion, assemble=assemble, lowpass=lowpass, start=first, end=last
        )
        tables = {"bodies.sto": recorded.bodies(), "markers.sto": recorded.markers()}
    folder = options.choose_output_folder(file, output)
    write_results(recorded, tables, folder, trc=trc)
    if plot:
        draw_tables(tables, folder, model, recorded.mechanism)
