"""``osimlite simulate``: simulate a model forward in time."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from osimlite.cli import _options as options
from osimlite.cli._command import Option, command_with
from osimlite.cli._console import FactTable, complain
from osimlite.cli._progress import motion_bar, progress_bar

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.simulation.run import Simulation
    from osimlite.simulation.trajectory import Trajectory

LIVE_STEP_S = 1e-3
"""Default fixed step of a simulation in PyBullet's window, s."""


@command_with(options.list_simulation_options())
def simulate(
    file: options.File,
    to: options.To = 2.0,
    engine: options.Engine = None,
    start: options.Start = None,
    start_speed: options.StartSpeed = None,
    controls: options.Controls = None,
    states: Annotated[
        Path | None,
        Option(
            metavar="FILE",
            help="Start from the last row of a file of states; values of --set replace those in the row.",
            show_default=False,
        ),
    ] = None,
    controller: options.Controller = None,
    par: options.Par = None,
    output: options.Folder = None,
    plot: Annotated[
        bool,
        Option(
            "--plot", help="Draw coordinates, muscles, forces, probes and energy over time as PNG."
        ),
    ] = False,
    animate: Annotated[
        bool, Option("--animate", help="Write the motion as animation.gif.")
    ] = False,
    gui: Annotated[
        bool,
        Option(
            "--gui",
            help="Show the motion live in PyBullet's window, with fixed steps; Escape ends it, space pauses it.",
        ),
    ] = False,
    **option_values: Any,
) -> None:
    """Simulate a model forward in time from its default pose: writes states.sto, forces.sto and summary.json.

    --set accepts names of coordinates, or paths of states such as /forceset/BRA/activation. If the
    model has probes, probes.sto is written. If the motion cannot be continued, or you press Ctrl-C,
    the motion up to that time is saved, without pictures.

    Example: osimlite simulate walker.osim --to 2 --set RHip_rz=40deg -o results --plot
    """
    from osimlite.base.require import require
    from osimlite.errors import SettingError, SimulationError
    from osimlite.io.document.reader import read
    from osimlite.simulation.options import INTEGRATION_OPTIONS

    # Missing packages are reported before the simulation.
    if plot:
        require("matplotlib", extra="plot", purpose="drawing")
    if animate:
        require("PIL", extra="view", purpose="an animation")
    results = options.choose_output_folder(file, output)
    earlier = option_values["resume"]
    # The earlier simulation is read at the start and would be replaced at the end.
    if earlier is not None and results.resolve() == Path(earlier).resolve():
        raise SettingError(f"'{results}' has the earlier simulation; name another folder with -o")
    has_fixed_step = option_values["fixed_step"] is not None
    if gui or has_fixed_step:
        step_option = "--fixed-step" if has_fixed_step else "--gui"
        for name in INTEGRATION_OPTIONS:
            if option_values.get(name) is not None:
                raise SettingError(
                    f"--{name} cannot be combined with {step_option}, because fixed steps have no error control; "
                    "leave one of them out"
                )
    model = read(file)
    feedback = options.read_feedback(controller, par)
    if controls:
        from osimlite.simulation.run_controls import parse_controls
    from osimlite.simulation.run import Simulation
    from osimlite.simulation.trajectory import Interrupted

    with Simulation(
        model,
        engine,
        folder=file.parent,
        show=gui,
        **option_values,
    ) as simulation:
        initial = {} if states is None else simulation.read_state(states)
        initial |= options.parse_quantities(
            start, simulation.mechanism, "--set", simulation.state.paths
        )
        speeds = options.parse_quantities(start_speed, simulation.mechanism, "--set-speed")
        try:
            with motion_bar("simulating", to) as progress:
                # PyBullet's window shows motion in real time, for which steps must be equal.
                trajectory = simulation.run(
                    to,
                    fixed_step=LIVE_STEP_S
                    if gui and option_values["fixed_step"] is None
                    else option_values["fixed_step"],
                    initial=initial,
                    initial_speeds=speeds,
                    controls=parse_controls(controls) if controls else None,
                    controller=feedback,
                    progress=progress,
                )
        # Both exceptions carry the motion up to where it stopped.
        except (Interrupted, SimulationError) as stopped:
            trajectory = stopped.trajectory
            if trajectory is None:
                raise
            is_failure = isinstance(stopped, SimulationError)
            ending = "stopped" if is_failure else "interrupted"
            # Print this first: preparing the files takes a while after many steps.
            complain(
                f"{ending} at {trajectory.times[-1]:.6g} s of {to:g} s; the motion up to there is saved in '{results}'"
            )
            if earlier is None:
                _warn_of_sunk_contacts(simulation, trajectory, file)
            _describe_run(trajectory, write_results(trajectory, results), model).show()
            if is_failure:
                raise
            # 128 + SIGINT, as shells report an interruption.
            raise SystemExit(130) from None

        def film(path: Path) -> Path:
            from osimlite.view.animation import animate as draw

            folders = options.list_mesh_folders(file, None)
            with progress_bar("drawing", None) as bar:
                wrapping = option_values["wrapping"]
                return draw(
                    model,
                    trajectory,
                    path,
                    folders=folders,
                    file=file,
                    wrapping=wrapping,
                    progress=bar,
                )

        if earlier is None:
            _warn_of_sunk_contacts(simulation, trajectory, file)
        files = write_results(trajectory, results, plot=plot, film=film if animate else None)
        _describe_run(trajectory, files, model).show()
        # The window stays open until the user closes it.
        simulation.hold()


ENGINE_NAMES = {"bullet": "PyBullet"}
"""Display names of engines, where they differ from the option's value."""

MAX_PAGES = 1000
"""Largest number of pages of a plot that is looked for."""

INTEGRATOR_NAMES = {
    "RungeKuttaMerson": "Runge-Kutta-Merson",
    "SemiImplicitEuler": "semi-implicit Euler",
    "SemiExplicitEuler2": "semi-explicit Euler 2",
}
"""Display names of integrators, where they differ from those in ``summary.json``."""

OPTIONAL_FILES = {
    *("probes.sto", "controller.sto", "animation.gif"),
    *(
        "coordinates.png",
        "states.png",
        "contact_forces.png",
        "other_forces.png",
        "probes.png",
        "energy.png",
    ),
}
"""Files that only some simulations write."""


def _list_earlier(folder: Path) -> set[str]:
    """Return the names of files that an earlier simulation may have left, with further pages."""
    names = set(OPTIONAL_FILES)
    for picture in (Path(name) for name in OPTIONAL_FILES if name.endswith(".png")):
        for page in range(2, MAX_PAGES):
            name = f"{picture.stem}-{page}.png"
            if not (folder / name).is_file():
                # Pages are numbered without gaps.
                break
            names.add(name)
    return names


def write_results(
    trajectory: Trajectory,
    folder: Path,
    *,
    plot: bool = False,
    film: Callable[[Path], Path] | None = None,
) -> list[Path]:
    """Write all results of a simulation, and return their paths.

    They are written into a temporary folder first, so that a failure leaves no partial results.

    Args:
        trajectory: simulated motion.
        folder: output folder.
        plot: whether to draw plots.
        film: function that draws an animation into a file, and returns its path; None for no
            animation.

    Returns:
        Paths of the files in `folder`.

    Raises:
        OsimliteError: the folder cannot be written.
    """
    import shutil
    import tempfile

    from osimlite.base.files import make_folder, replace_with
    from osimlite.errors import OsimliteError

    is_new = not folder.exists()
    make_folder(folder)
    try:
        # In the output folder, so that moving the files is a rename within one file system.
        temporary = Path(tempfile.mkdtemp(prefix=".osimlite-", dir=folder))
    except OSError as error:
        raise OsimliteError(f"cannot write here: {error.strerror}", file=str(folder)) from None
    try:
        paths = trajectory.write(temporary)
        if plot:
            from osimlite.view.plots import plot_simulation

            with progress_bar("drawing", None):
                paths += plot_simulation(trajectory, temporary)
        if film is not None:
            paths.append(film(temporary / "animation.gif"))
        for path in paths:
            replace_with(path, folder / path.name)
        # Files of an earlier simulation would be mistaken for results of this one.
        for name in _list_earlier(folder) - {path.name for path in paths}:
            (folder / name).unlink(missing_ok=True)
    # `BaseException` includes Ctrl-C, after which no temporary folder may stay.
    except BaseException as error:
        shutil.rmtree(folder if is_new else temporary, ignore_errors=True)
        if isinstance(error, OSError):
            raise OsimliteError(f"cannot write here: {error.strerror}", file=str(folder)) from None
        raise
    temporary.rmdir()
    return [folder / path.name for path in paths]


CONTACT_CLASSES = {"HuntCrossleyForce", "ElasticFoundationForce"}
"""Forces with a stiffness in `contact_parameters`; by name, so that no model imports both classes."""


def _find_soft_contacts(model: Model) -> list[str]:
    """Return the names of the contact forces that act with a stiffness of 0."""
    return [
        f"'{force.name}'"
        for force in model.components()
        if type(force).__name__ in CONTACT_CLASSES
        and force.appliesForce
        and any(item.stiffness == 0.0 for item in force.contact_parameters.objects)
    ]


def _warn_of_sunk_contacts(simulation: Simulation, trajectory: Trajectory, file: Path) -> None:
    """Warn on standard error of contacts whose centres start inside the floor, as OSIM521 does.

    Walkers often start a little inside the floor, which is no reason for a warning.

    Args:
        simulation: simulation with the forces of the model.
        trajectory: motion, from the start of the simulation.
        file: file of the model, for the message.
    """
    from osimlite.simulation.initial_contacts import find_deep_contacts

    # The rule is about the default pose, and --set or --states may have moved the model.
    deep_contacts = find_deep_contacts(
        simulation.forces, trajectory.mechanism, trajectory.values[0], float(trajectory.times[0])
    )
    contacts = [contact for contact in deep_contacts if contact.is_sunk]
    if contacts:
        deepest = contacts[0]
        others = f", and {len(contacts) - 1} more like this" if len(contacts) > 1 else ""
        complain(
            f"warning: sphere '{deepest.sphere}' starts {1000.0 * deepest.depth:.3g} mm inside "
            f"'{deepest.surface}'{others}, which may throw the model up (OSIM521); "
            f"'osimlite validate {file}' checks the default pose"
        )


def _describe_run(trajectory: Trajectory, files: Sequence[Path], model: Model) -> FactTable:
    from osimlite.base.text import join_words
    from osimlite.simulation.elements import summarize_skipped

    summary = trajectory.summary
    facts = FactTable(f"{summary['model']}, {trajectory.times[-1]:g} s")
    facts.add("engine", ENGINE_NAMES.get(summary["engine"], summary["engine"]))
    facts.add("integrator", INTEGRATOR_NAMES.get(summary["integrator"], summary["integrator"]))
    rejected = summary["attempted_steps"] - summary["steps"]
    facts.add(
        "steps",
        f"{summary['steps']} accepted, {rejected} rejected; {summary['evaluations']} evaluations of the forces",
    )
    facts.add("time taken", f"{summary['wall_time_s']:.3g} s")
    lengths = {path for path in trajectory.auxiliary if path.endswith("/fiber_length")}
    # Fiber lengths of a file may be in equilibrium, as those of the built-in jumper, or not: then
    # forces jump at the start.
    if lengths - set(summary["settings"]["initial"]) and "equilibrate" not in summary["settings"]:
        facts.add(
            "note",
            "muscles start with the fiber lengths in the file; if these are not in equilibrium, add --equilibrate",
        )
    # A misspelt <stiffness> leaves the default, 0. OpenSim then computes NaN.
    if soft := _find_soft_contacts(model):
        facts.add(
            "warning",
            "contacts with a stiffness of 0 exert no force here, while OpenSim computes NaN: "
            f"{join_words(soft, max_count=3)}; 'osimlite validate' shows the lines",
        )
    first, last = (summary["energy_J"][moment]["total"] for moment in ("start", "end"))
    facts.add("energy", f"{first:.6g} J at the start, {last:.6g} J at the end")
    for name, peak in summary["largest_contact_forces"].items():
        times = [
            f"{'from' if event['event'] == 'begin' else 'to'} {event['time_s']:.4g}"
            for event in summary["contact_events"]
            if event["contact"] == name
        ]
        # A contact that touches at the start has an end without a beginning.
        intervals = re.sub(r" (?=from)", ", ", " ".join(times[:6]))
        # The unit is printed once, after the last time.
        contact_text = f"{intervals} s" + (f" and {len(times) - 6} more" if len(times) > 6 else "")
        size, moment = peak["force_N"], peak["time_s"]
        facts.add(
            name,
            f"peak {size:.4g} N at {moment:.4g} s" + (f"; contact {contact_text}" if times else ""),
        )
    for skipped in summarize_skipped(summary["skipped_forces"]):
        facts.add("left out", skipped)
    facts.add_files(files)
    return facts
