"""``osimlite static-optimization``: compute the muscle forces of a recorded motion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with


@command_with(options.list_simulation_options("wrapping", "external_loads", "opensim_derivatives"))
def static_optimization(
    file: options.File,
    motion: options.Motion,
    applied: options.AppliedTo = None,
    forces: Annotated[
        list[Path] | None,
        Option(
            "--forces",
            metavar="FILE",
            help="Add the forces of a ForceSet, for example reserve actuators; may be repeated.",
            show_default=False,
        ),
    ] = None,
    replace: Annotated[
        bool, Option("--replace-forces", help="Replace the model's forces by those of --forces.")
    ] = False,
    exponent: Annotated[
        float,
        Option(metavar="NUMBER", help="Exponent of the activations in the sum that is minimized."),
    ] = 2.0,
    muscles: Annotated[
        str,
        Option(
            metavar="FORCE",
            help="Force at an activation of 1. 'active': the active fiber force with a rigid tendon, as in OpenSim, "
            "without passive forces; 'isometric': max_isometric_force.",
        ),
    ] = "active",
    lowpass: options.Lowpass = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    plot: options.Plot = False,
    band: options.Band = None,
    output: options.Folder = None,
    **option_values: Any,
) -> None:
    """Compute muscle forces of a recorded motion: the smallest activations that produce the motion.

    Writes StaticOptimization_activation.sto, StaticOptimization_force.sto (N, N·m) and
    StaticOptimization_controls.xml, like OpenSim's analysis, with an exact solution at each time.
    Muscles alone can rarely move a pelvis: add reserve actuators with --forces. If there is no
    solution within min_control and max_control, the coordinates that lack strength are reported,
    the tables have NaN at these times, and the exit code is 1. Filter motions from motion capture
    first: --lowpass 6.

    Example: osimlite static-optimization gait.osim walk.mot --lowpass 6 --external-loads grf.xml
        --forces reserves.xml
    """
    from osimlite.cli._console import complain
    from osimlite.cli._progress import progress_bar
    from osimlite.cli._recorded import (
        draw_tables,
        print_motion_summary,
        require_plots,
        warn_of_extrapolated_loads,
    )
    from osimlite.io.document.reader import read
    from osimlite.simulation.muscle_forces import static_optimization as shared_forces

    # Before the computation, which can take minutes: a missing package or file ends the command
    # here.
    require_plots(plot=plot, band=band)
    model = read(file)
    with progress_bar("computing muscle forces", None):
        result = shared_forces(
            model,
            motion,
            applied_to=options.parse_applied_loads(applied),
            forces=forces or (),
            replace_forces=replace,
            exponent=exponent,
            muscles=muscles,
            lowpass=lowpass,
            start=first,
            end=last,
            folder=file.parent,
            **option_values,
        )
    assert result.motion is not None
    folder = options.choose_output_folder(file, output)
    files = result.write(folder)
    print_motion_summary(result.motion, files)
    warn_of_extrapolated_loads(option_values.get("external_loads"), result.motion)
    if plot:
        # The units of the columns follow from the model, which needs the added forces for that.
        from osimlite.simulation.inverse_dynamics import add_forces

        add_forces(model, forces or (), replace=replace)
        tables = {files[0].name: result, files[1].name: result.forces or result}
        draw_tables(
            tables,
            folder,
            model,
            result.motion.mechanism,
            option_values.get("external_loads"),
            band=band,
        )
    if message := result.describe_unsolved():
        complain(message)
        # The files are complete, but have no numbers where there is no solution; scripts must
        # notice that.
        raise SystemExit(1)
