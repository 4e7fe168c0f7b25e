"""``osimlite kinematics``: where bodies and markers are during a recorded motion."""

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
            "--assemble", help="Change each pose as little as the model's constraints demand first."
        ),
    ] = False,
    trc: Annotated[bool, Option("--trc", help="Write the markers as markers.trc too.")] = False,
    lowpass: options.Lowpass = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    output: options.Folder = None,
) -> None:
    """Follow a recorded motion: writes bodies.sto and markers.sto.

    bodies.sto holds the mass centre (m) and the body-fixed X-Y-Z angles (degrees) of every body in
    ground, as OpenSim's BodyKinematics does, and the whole mass centre; markers.sto the markers
    (m).

    Example: osimlite kinematics gait2392.osim walk.mot -o results
    """
    from osimlite.cli._recorded import written
    from osimlite.io.document.reader import read
    from osimlite.simulation.inverse_dynamics import kinematics as followed

    recorded = followed(
        read(file), motion, assemble=assemble, lowpass=lowpass, start=first, end=last
    )
    tables = {"bodies.sto": recorded.bodies(), "markers.sto": recorded.markers()}
    written(recorded, tables, options.results_folder(file, output), trc=trc)
