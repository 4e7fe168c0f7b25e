"""``osimlite static-optimization``: the muscle forces that a recorded motion takes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with


@command_with(options.simulating("wrapping", "external_loads", "opensim_derivatives"))
def static_optimization(
    file: options.File,
    motion: options.Motion,
    applied: options.AppliedTo = None,
    forces: Annotated[
        list[Path] | None,
        Option(
            "--forces",
            metavar="FILE",
            help="A ForceSet that pushes besides, of reserve actuators for instance; may be given several times.",
            show_default=False,
        ),
    ] = None,
    replace: Annotated[
        bool, Option("--replace-forces", help="They take the place of the model's own forces.")
    ] = False,
    exponent: Annotated[
        float, Option(metavar="NUMBER", help="Power of the activations whose sum is least.")
    ] = 2.0,
    muscles: Annotated[
        str,
        Option(
            metavar="FORCE",
            help="What an activation of 1 pulls with: 'active', as in OpenSim: the fibers, along a tendon taken for "
            "rigid, without passive forces; 'isometric': max_isometric_force.",
        ),
    ] = "active",
    lowpass: options.Lowpass = None,
    first: options.FirstFrame = float("-inf"),
    last: options.LastFrame = float("inf"),
    output: options.Folder = None,
    **chosen: Any,
) -> None:
    """Share the forces of a recorded motion among the muscles: of all activations that move it so, the least.

    Writes StaticOptimization_activation.sto, StaticOptimization_force.sto (N, N·m) and
    StaticOptimization_controls.xml, as OpenSim's analysis does, each time solved exactly. Muscles
    alone rarely move a pelvis: give reserve actuators with --forces. What min_control and
    max_control leave without a solution is told with the coordinates that lack strength, has no
    numbers in the files, and makes the exit code 1. What a camera records takes a filter first:
    --lowpass 6.

    Example: osimlite static-optimization gait.osim walk.mot --lowpass 6 --external-loads grf.xml
        --forces reserves.xml
    """
    from osimlite.cli._console import complain
    from osimlite.cli._recorded import say_motion
    from osimlite.io.document.reader import read
    from osimlite.simulation.muscle_forces import static_optimization as shared_forces

    found = shared_forces(
        read(file),
        motion,
        applied_to=options.applied_loads(applied),
        forces=forces or (),
        replace_forces=replace,
        exponent=exponent,
        muscles=muscles,
        lowpass=lowpass,
        start=first,
        end=last,
        folder=file.parent,
        **chosen,
    )
    assert found.motion is not None
    say_motion(found.motion, found.write(options.results_folder(file, output)))
    if said := found.unsolved():
        complain(said)
        raise SystemExit(1)
