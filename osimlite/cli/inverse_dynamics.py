"""``osimlite inverse-dynamics``: the generalized forces that a recorded motion takes."""

from __future__ import annotations

from typing import Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with


@command_with(options.simulating("wrapping", "external_loads"))
def inverse_dynamics(
    file: options.File,
    motion: options.Motion,
    output: options.Folder = None,
    lowpass: options.Lowpass = None,
    exclude: Annotated[
        list[str] | None,
        Option(
            metavar="NAME",
            help="What does not push: a force, a group, All, Actuators or Muscles; Muscles if left out.",
            show_default=False,
        ),
    ] = None,
    **chosen: Any,
) -> None:
    """Find the forces of a recorded motion: writes inverse_dynamics.sto.

    One generalized force (N or N·m) for each coordinate: what it takes beyond gravity, measured loads and the forces of
    the model (springs, contacts, but no muscles) to make the bodies move so. The coordinates are differentiated by
    splines of fifth degree, as in OpenSim's tool. What a camera records takes a filter first: --lowpass 6.

    Example: osimlite inverse-dynamics gait2392.osim walk.mot --lowpass 6 --external-loads grf.xml -o results
    """
    from osimlite.cli._recorded import opened, written
    from osimlite.document.reader import read
    from osimlite.simulation.elements import force_elements
    from osimlite.simulation.files.recorded import exclude_forces

    model = read(file)
    recorded = opened(model, motion, lowpass)
    exclude_forces(model, exclude or ["Muscles"])
    forces = force_elements(model, recorded.mechanism, folder=file.parent, **chosen)
    tables = {"inverse_dynamics.sto": recorded.inverse_dynamics(forces)}
    written(recorded, tables, options.results_folder(file, output))
