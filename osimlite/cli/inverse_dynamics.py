"""``osimlite inverse-dynamics``: the generalized forces that a recorded motion takes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from osimlite.cli import _options as options

if TYPE_CHECKING:
    from osimlite.simulation.elements.kind import DeclaredForce


def inverse_dynamics(
    file: options.File,
    motion: options.Motion,
    output: options.Folder = None,
    external_loads: options.ExternalLoads = None,
    lowpass: options.Lowpass = None,
) -> None:
    """Find the forces of a recorded motion: writes inverse_dynamics.sto.

    One generalized force (N or N·m) for each coordinate: what it takes beyond gravity to make the bodies move so. The
    coordinates are differentiated by splines of fifth degree, as in OpenSim's tool. Forces of the model are not taken
    into account. What a camera records takes a filter first: --lowpass 6.

    Example: osimlite inverse-dynamics gait2392.osim walk.mot --lowpass 6 --external-loads grf.xml -o results
    """
    from osimlite.cli._recorded import opened, written

    recorded = opened(file, motion, lowpass)
    loads: tuple[DeclaredForce, ...] = ()
    if external_loads is not None:
        from osimlite.simulation.elements.external_loads import read_external_loads

        loads = read_external_loads(recorded.mechanism, external_loads)
    written(recorded, {"inverse_dynamics.sto": recorded.inverse_dynamics(loads)}, options.results_folder(file, output))
