"""``osimlite simulate``: a model in motion."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from osimlite.cli._progress import progress_bar

if TYPE_CHECKING:
    from rich.console import Console

    from osimlite.multibody.mechanism import Mechanism
    from osimlite.schema.model import Model
    from osimlite.simulation.trajectory import Trajectory

LIVE_STEP = 1e-3
"""Step of what the window shows if none is given, s."""


def simulate(
    file: Annotated[Path, typer.Argument(help="A model file.", show_default=False)],
    to: Annotated[float, typer.Option("--to", metavar="SECONDS", help="How long to simulate.")] = 2.0,
    engine: Annotated[str, typer.Option(help="What computes the accelerations: 'bullet' or 'compiled'.")] = "bullet",
    accuracy: Annotated[
        float | None, typer.Option(help="Of the integrator, as in OpenSim.", show_default="0.001")
    ] = None,
    fixed_step: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Take PyBullet's own steps instead of controlling the error."),
    ] = None,
    start: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="COORDINATE=VALUE", help="Where a coordinate starts (rad, m, or 30deg)."),
    ] = None,
    start_speed: Annotated[
        list[str] | None,
        typer.Option("--set-speed", metavar="COORDINATE=VALUE", help="At what speed it starts (per second)."),
    ] = None,
    report_interval: Annotated[
        float, typer.Option(metavar="SECONDS", help="Time between the rows of the result files.")
    ] = 0.01,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="FOLDER", help="Folder to write into.", show_default="this folder"),
    ] = Path("."),
    plot: Annotated[bool, typer.Option("--plot", help="Draw coordinates, forces and energy as PNG.")] = False,
    animate: Annotated[bool, typer.Option("--animate", help="Draw the motion as animation.gif.")] = False,
    gui: Annotated[bool, typer.Option("--gui", help="Show it live in PyBullet's window; takes fixed steps.")] = False,
    skip_unsupported: Annotated[
        bool, typer.Option("--skip-unsupported", help="Leave out forces that cannot be computed.")
    ] = False,
    opensim_derivatives: Annotated[
        bool,
        typer.Option("--opensim-derivatives", help="Repeat OpenSim's mistakes in joints with several turns."),
    ] = False,
    rolling: Annotated[
        bool, typer.Option("--rolling", help="Let rolling constraints act, which OpenSim leaves off.")
    ] = False,
    external_loads: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Measured forces that act too: a file of ExternalLoads.", show_default=False),
    ] = None,
) -> None:
    """Simulate a model forward in time, from its default pose: writes states.sto, forces.sto and summary.json.

    Nothing is written unless the whole simulation succeeds.

    Example: osimlite simulate walker.osim --to 2 --set RHip_rz=40deg -o results --plot
    """
    from rich.console import Console

    from osimlite._require import require
    from osimlite.document.reader import read
    from osimlite.errors import OsimliteError

    if accuracy is not None and (fixed_step is not None or gui):
        raise OsimliteError("--accuracy does not go with fixed steps (--fixed-step, --gui); take one of them")
    if plot:
        require("matplotlib", extra="plot", purpose="drawing")
    if animate:
        require("PIL", extra="view", purpose="an animation")
    model = read(file)
    from osimlite.simulation.engines import engine_factory
    from osimlite.simulation.integrators import DEFAULT_ACCURACY
    from osimlite.simulation.run import Simulation

    engine_factory(engine)
    console = Console()
    with Simulation(
        model,
        engine,
        skip_unsupported=skip_unsupported,
        opensim_derivatives=opensim_derivatives,
        rolling=rolling,
        external_loads=external_loads,
        folder=file.parent,
        show=gui,
    ) as simulation:
        initial = quantities(start or [], simulation.mechanism, "--set")
        speeds = quantities(start_speed or [], simulation.mechanism, "--set-speed")
        with progress_bar(console, "simulating", to) as progress:
            trajectory = simulation.run(
                to,
                accuracy=DEFAULT_ACCURACY if accuracy is None else accuracy,
                fixed_step=LIVE_STEP if gui and fixed_step is None else fixed_step,
                report_interval=report_interval,
                initial=initial,
                initial_speeds=speeds,
                progress=progress,
            )
    files = _write(console, file, model, trajectory, output, plot=plot, animate=animate)
    console.print(_table(trajectory, files))


def quantities(words: Sequence[str], mechanism: Mechanism, option: str) -> dict[str, float]:
    """Numbers (rad, m, per second) by coordinate from ``NAME=VALUE`` words; a value may carry a unit.

    Raises:
        OsimliteError: a word is not of that form, there is no such coordinate, or the unit does not fit it.
    """
    from osimlite.errors import ModelError, OsimliteError
    from osimlite.quantity import quantity
    from osimlite.simulation.start import in_units_of

    found = {}
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        if not equals or quantity(text) is None:
            raise OsimliteError(f"{option} takes COORDINATE=VALUE with a number such as 0.5 or 30deg, got '{word}'")
        try:
            found[name] = in_units_of(mechanism, name, text)
        except ModelError as error:
            # The model is as it should be; it is the command that asks for what is not there.
            raise OsimliteError(f"{option}: {error.message}") from None
    return found


PICTURES = {"coordinates.png", "contact_forces.png", "other_forces.png", "energy.png", "animation.gif"}
"""What --plot and --animate draw."""


def _write(
    console: Console, file: Path, model: Model, trajectory: Trajectory, folder: Path, *, plot: bool, animate: bool
) -> list[Path]:
    """Write everything beside its place first, so that a failure leaves nothing behind."""
    import shutil
    import tempfile

    from osimlite.errors import OsimliteError
    from osimlite.files import make_folder

    is_new = not folder.exists()
    make_folder(folder)
    try:
        beside = Path(tempfile.mkdtemp(prefix=".osimlite-", dir=folder))
    except OSError as error:
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(folder)) from None
    try:
        written = trajectory.write(beside)
        if plot:
            from osimlite.view.plots import plot_simulation

            written += plot_simulation(trajectory, beside)
        if animate:
            from osimlite.view.animation import animate as draw

            with progress_bar(console, "drawing", None) as progress:
                written.append(draw(model, trajectory, beside / "animation.gif", progress=progress))
        for path in written:
            path.replace(folder / path.name)
        # Pictures of an earlier simulation would be taken for those of this one.
        for name in PICTURES - {path.name for path in written}:
            (folder / name).unlink(missing_ok=True)
    except BaseException:
        shutil.rmtree(folder if is_new else beside, ignore_errors=True)
        raise
    beside.rmdir()
    return [folder / path.name for path in written]


def _table(trajectory: Trajectory, files: Sequence[Path]) -> Any:
    from rich.table import Table

    summary = trajectory.summary
    table = Table(title=f"{summary['model']}, {trajectory.times[-1]:g} s", title_justify="left", show_header=False)
    table.add_column(style="bold")
    table.add_column(overflow="fold")
    table.add_row("engine", f"{summary['engine']}, {summary['route']}, {summary['integrator']}")
    tried = summary["attempted_steps"]
    table.add_row("steps", f"{summary['steps']} of {tried} tried, {summary['evaluations']} evaluations of the forces")
    table.add_row("time taken", f"{summary['wall_time_s']:.3g} s")
    first, last = (summary["energy_J"][when]["total"] for when in ("start", "end"))
    table.add_row("energy", f"{first:.6g} J at the start, {last:.6g} J at the end")
    for name, largest in summary["largest_contact_forces"].items():
        times = [
            f"{'on' if event['event'] == 'begin' else 'off'} {event['time_s']:.4g}"
            for event in summary["contact_events"]
            if event["contact"] == name
        ]
        shown = times if len(times) <= 6 else [*times[:6], f"{len(times) - 6} more"]
        size, when = largest["force_N"], largest["time_s"]
        table.add_row(name, f"at most {size:.4g} N ({when:.4g} s); {', '.join(shown)} s")
    for skipped in summary["skipped_forces"]:
        table.add_row("left out", skipped)
    table.add_row("files", ", ".join(str(path) for path in files))
    return table
