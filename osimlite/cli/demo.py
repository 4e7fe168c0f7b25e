"""``osimlite demo``: a tour from a model file to four motions in the browser."""

from __future__ import annotations

import os
import sys
import textwrap
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from osimlite.base.named_tuples import NamedTuple
from osimlite.base.records import dataclass, replace
from osimlite.base.text import join_words
from osimlite.cli import _options as options
from osimlite.cli._command import Option, command
from osimlite.cli._console import say, show
from osimlite.cli._progress import motion_bar, progress_bar

if TYPE_CHECKING:
    from osimlite.simulation.trajectory import Trajectory
    from osimlite.studies.reflexes.scenario import Scenario

ACCURACY = 1e-5
"""Accuracy of the integrator in all motions of the tour."""

REPORT_INTERVAL_S = 0.01
"""Time between the rows of the motions of the tour, s."""

MISSPELT = ("<geometry>RFootContact ", "<geometry>RFootContct ")
"""Text of the walker's file, and the misspelt text that replaces it to show a finding."""


class TourMotion(NamedTuple):
    """Motion of the tour.

    Attributes:
        model: built-in model that moves.
        to: duration, s.
        title: heading of its step and page.
        describe: function that returns sentences about the result.
        description: sentence about what the page shows besides the motion.
        command: command to try next; {} is the folder of the tour.
    """

    model: str
    to: float
    title: str
    describe: Callable[[Trajectory], str]
    description: str
    command: str


@command
def demo(
    output: Annotated[
        Path,
        Option("-o", "--output", metavar="FOLDER", help="Folder for all files of the demo."),
    ] = Path("osimlite-demo"),
    pictures: Annotated[
        bool, Option(help="Draw the plots, and write the pages for the browser.")
    ] = True,
    browser: options.Browser = True,
) -> None:
    """Build, check, translate and simulate: a walker falls, one walks, and human models jump and walk with muscles.

    The first model is that of the OpenSim exercise "Building a Dynamic Walker". The four motions
    play in the browser, with ground reaction forces and with muscles coloured by activation. The
    demo takes about ten seconds and needs no display.

    Example: osimlite demo -o tour --no-browser
    """
    from osimlite.base.require import require
    from osimlite.simulation.engines import engine_factory

    # Optional packages are looked for first: a missing one should not end the tour in the middle.
    engine_factory("compiled")
    if pictures:
        require("matplotlib", extra="plot", purpose="drawing")
    tour = Tour(output)
    _build_and_check(tour)
    pages = _simulate_motions(tour, pictures)
    say(f"Everything is in {output}{os.sep}")
    if pages:
        say(f"Look at {pages[-1]}: it links to the other three motions")
        if browser and _has_display():
            import webbrowser

            webbrowser.open(pages[-1].resolve().as_uri())
    say("Next, check your own models: osimlite validate FOLDER")


@dataclass
class Tour:
    """Output folder of the tour, and the number of steps so far."""

    folder: Path
    steps: int = 0

    @contextmanager
    def step(self, title: str) -> Iterator[Callable[..., None]]:
        """Announce a step of the tour.

        Yields:
            Function that prints the result of the step and the files written.
        """
        self.steps += 1
        say(f"{self.steps}. {title}")
        start = time.perf_counter()

        def print_result(result: str, *files: Path) -> None:
            duration = f"({time.perf_counter() - start:.1f} s)"
            for line in textwrap.wrap(f"{result} {duration}", 76):
                say(f"   {line}")
            if files:
                say(
                    f"   -> {', '.join(file.relative_to(self.folder).as_posix() for file in files)}"
                )
            say()

        # The heading above the line of progress says what the step does.
        with progress_bar(f"   step {self.steps}", None):
            yield print_result


def _build_and_check(tour: Tour) -> None:
    """Build the walker of the exercise, validate it and a misspelt copy, and translate it."""
    from osimlite.base.files import make_folder, write_atomically
    from osimlite.io.document.printer import write
    from osimlite.lint import validate
    from osimlite.lint.reporters import render
    from osimlite.models.dynamic_walker import dynamic_walker
    from osimlite.translate import to_urdf

    with tour.step("Build the Dynamic Walker in Python") as report_result:
        model = dynamic_walker()
        file = make_folder(tour.folder / MOTIONS[0].model) / f"{model.name}.osim"
        write(model, file)
        report_result(f"{sum(1 for _ in model.components())} components", file)

    with tour.step("Validate the file") as report_result:
        report = validate(file)
        report_result(f"{len(report.errors)} errors, {len(report.warnings)} warnings")

    with tour.step("Validate a copy in which the name of a contact is misspelt") as report_result:
        text = file.read_text(encoding="utf-8")
        # A walker without this text would be copied without the mistake.
        assert text.count(MISSPELT[0]) == 1
        broken = file.with_name("misspelt.osim")
        write_atomically(broken, text.replace(*MISSPELT))
        result = validate(broken)
        # Remarks on the copy would hide the one finding that the step is about.
        show(render(replace(result, findings=result.errors), "full"))
        report_result("OpenSim reads such a file, and refuses to simulate it", broken)

    with tour.step("Translate it to URDF, for robotics") as report_result:
        urdf = to_urdf(model)
        urdf.write(file.with_name("urdf"))
        report_result(
            f"{len(urdf.fidelity)} parts that URDF cannot express are listed in fidelity.json",
            file.with_name("urdf"),
        )


def _simulate_motions(tour: Tour, pictures: bool) -> Sequence[Path]:
    """Simulate the three models, and write plots and pages.

    Returns:
        Paths of the pages; none without pictures.
    """
    from osimlite.io.document.printer import write
    from osimlite.models.source import make_model
    from osimlite.simulation.run import Simulation

    result, sentences = [], []
    # The stack closes all simulations, also if the tour fails half-way.
    with ExitStack() as stack:
        with tour.step("Prepare three models for simulation") as report_result:
            ready = [
                stack.enter_context(Simulation(make_model(motion.model), "compiled"))
                for motion in MOTIONS
            ]
            report_result(
                f"{join_words(motion.model for motion in MOTIONS)}; engine: {ready[0].engine.version}"
            )
        for motion, simulation in zip(MOTIONS, ready, strict=True):
            with (
                tour.step(f"{motion.title}: {motion.model}") as report_result,
                motion_bar("   simulating", motion.to) as bar,
            ):
                trajectory = simulation.run(
                    motion.to, accuracy=ACCURACY, report_interval=REPORT_INTERVAL_S, progress=bar
                )
                folder = tour.folder / motion.model
                trajectory.write(folder)
                write(simulation.model, folder / f"{simulation.model.name}.osim")
                sentences.append(motion.describe(trajectory))
                report_result(sentences[-1], folder)
            result.append(trajectory)
    # The first motion is the one that PyBullet can compute, without muscles.
    _compare_engines(tour, result[0])
    human, states, walking_text = _simulate_walking(tour)
    if not pictures:
        return []
    # Drawing imports large packages, which a tour without pictures does not need.
    from osimlite.mechanics.multibody import build_mechanism
    from osimlite.view import ModelView, Story, plot_simulation

    human_title, human_page = "It walks by reflexes", "human-walks.html"
    human_command = (
        f"osimlite scone {tour.folder}/human-walks/human-walks.scone --optimize --generations 50"
    )

    with tour.step("Plot the jump: coordinates, activations, forces, energy") as report_result:
        plots = plot_simulation(result[-1], tour.folder / MOTIONS[-1].model)
        report_result(f"{len(plots)} pictures", plots[0].with_name("*.png"))
    with tour.step("Write a page of each motion for the browser") as report_result:
        pages = []
        titles = [
            *((motion.title, f"{motion.model}.html") for motion in MOTIONS),
            (human_title, human_page),
        ]
        # `Simulation` keeps the model of its trajectories.
        for motion, trajectory, sentence in zip(MOTIONS, result, sentences, strict=True):
            assert trajectory.model is not None
            model_view = ModelView.from_model(
                trajectory.model, trajectory.mechanism, motion=trajectory
            )
            caption = f"{sentence} {motion.description}"
            story = Story(
                caption, motion.command.format(tour.folder), f"{motion.model}.html", titles
            )
            pages.append(model_view.write_page(tour.folder / story.page, story))
        model_view = ModelView.from_model(human.model, build_mechanism(human.model), motion=states)
        pages.append(
            model_view.write_page(
                tour.folder / human_page, Story(walking_text, human_command, human_page, titles)
            )
        )
        size = sum(page.stat().st_size for page in pages) / 1e6
        report_result(f"{size:.1f} MB; the pages need no network", *pages)
    return pages


def _compare_engines(tour: Tour, compiled: Trajectory) -> None:
    """Simulate the walker with PyBullet as well, if installed, and print the difference of the motions."""
    from importlib.util import find_spec

    from osimlite.models.source import make_model
    from osimlite.simulation.run import Simulation

    motion = MOTIONS[0]
    with tour.step(
        "Simulate the walker with PyBullet, too: URDF, custom contact forces"
    ) as report_result:
        if find_spec("pybullet") is None:
            report_result(
                "PyBullet is not installed; to compare both engines, run: pip install 'osimlite[bullet]'"
            )
            return
        with (
            Simulation(make_model(motion.model), "bullet") as simulation,
            motion_bar("   simulating", motion.to) as bar,
        ):
            bullet = simulation.run(
                motion.to, accuracy=ACCURACY, report_interval=REPORT_INTERVAL_S, progress=bar
            )
        folder = tour.folder / f"{motion.model}-bullet"
        bullet.write(folder)
        report_result(
            f"{simulation.engine.version}: over {motion.to:g} s, no coordinate differs by more than "
            f"{compute_largest_difference(compiled, bullet):.1e} rad or m from the motion of osimlite's own engine; the "
            f"integrator took {_count_steps(bullet)} steps with PyBullet and {_count_steps(compiled)} without it",
            folder,
        )


def compute_largest_difference(first: Trajectory, second: Trajectory) -> float:
    """Return the largest difference of a coordinate (rad or m) between two motions with equal times.

    Args:
        first: first motion.
        second: second motion; its coordinates may have another order.
    """
    import numpy as np

    columns = [second.coordinates.index(name) for name in first.coordinates]
    return float(np.abs(first.values - second.values[:, columns]).max())


def _count_steps(motion: Trajectory) -> int:
    return int(motion.summary["steps"])


def _simulate_walking(tour: Tour) -> tuple[Scenario, Path, str]:
    """Simulate the human model walking by reflexes.

    Returns:
        The scenario, the file of the states, and sentences on the result.
    """
    from osimlite.io.tables.storage import write_sto
    from osimlite.models.walking import write_scenario
    from osimlite.studies.reflexes.scenario import Scenario

    with tour.step(
        "Let a human model walk for ten seconds by the reflexes of 16 muscles"
    ) as report_result:
        scenario = Scenario(write_scenario(tour.folder / "human-walks"))
        walked = scenario.walk(scenario.best())
        file = tour.folder / "human-walks" / "states.sto"
        table = walked.states
        write_sto(file, "states", table.times, table.columns, table.rows)
        speed = walked.report["speed"][0]
        steps = int(walked.report["steps"][0])
        # The second half of the walk is steady; the first steps start from a guess.
        peak = float(walked.loads.rows[len(table.times) // 2 :].max())
        mass = scenario.get_walkers(1).mass
        t = walked.times[0]
        text = (
            f"A human model of {mass:.0f} kg walks for {t:.0f} s at {speed:.2f} m/s, in {steps} steps, by reflexes alone: "
            "muscles react to their lengths and forces, and those of the hips to the lean of the torso. The gains come "
            f"from an optimization. The peak ground reaction force is {peak:.1f} times the body weight."
        )
        report_result(text, file)
        scenario.close()
    return scenario, file, text


def _describe_fall(motion: Trajectory) -> str:
    events = motion.summary["contact_events"]
    knee = next(event["time_s"] for event in events if "Knee" in event["contact"])
    largest_difference = compute_distance_to_opensim(motion)
    return (
        f"Released at rest on a slope of 10 degrees, it falls: after {knee:.2f} s a knee touches the ground. It falls in "
        "the same way in OpenSim: every coordinate stays within "
        f"{largest_difference:.1e} rad or m of the motion that OpenSim computes at a tight accuracy."
    )


def _describe_walk(motion: Trajectory) -> str:
    import numpy as np

    events = motion.summary["contact_events"]
    steps = [
        event["time_s"] for event in events if event["event"] == "begin" and event["time_s"] > 0.0
    ]
    # Distance and duration are taken between the first and the last touch-down, so that the start
    # does not count.
    positions = np.interp(
        steps, motion.times, motion.values[:, motion.coordinates.index("Pelvis_tx")]
    )
    speed = np.ptp(positions) / np.ptp(steps)
    return (
        "The same walker with two changes (the moment of inertia of its shanks is 0.0921 instead of 1 kg·m², and its feet are "
        f"7.4 cm further ahead) makes {len(steps)} steps in {motion.times[-1]:g} s, at {speed:.2f} m/s, "
        "and continues to walk. No motor drives it, only gravity."
    )


def _describe_jump(motion: Trajectory) -> str:
    import numpy as np

    heights = [motion.mechanism.center_of_mass(q)[1] for q in motion.values]
    # The time at which the mass centre is highest separates take-off and landing.
    highest_time = motion.times[int(np.argmax(heights))]
    events = motion.summary["contact_events"]
    take_off = max(
        event["time_s"]
        for event in events
        if event["event"] == "end" and event["time_s"] < highest_time
    )
    landing = min(
        event["time_s"]
        for event in events
        if event["event"] == "begin" and event["time_s"] > highest_time
    )
    vertical_forces = [
        column
        for label, column in motion.forces.items()
        if ".foot_" in label and label.endswith(".force.Y")
    ]
    # The mass is in kg, so the quotient is in body weights.
    peak_force = np.sum(vertical_forces, axis=0)[motion.times < take_off].max()
    mass = motion.mechanism.total_mass
    return (
        f"A human model of {mass:.0f} kg jumps with 16 muscles, whose excitations come from an optimization. The feet push with "
        f"{peak_force / (9.80665 * mass):.1f} times the body weight, the mass centre rises from {heights[0]:.2f} to "
        f"{max(heights):.2f} m, and nothing touches the ground for {landing - take_off:.2f} s."
    )


MOTIONS = (
    TourMotion(
        "dynamic-walker",
        2.0,
        "It falls",
        _describe_fall,
        "The arrows are the forces of the ground.",
        "osimlite optimize dynamic-walker --objective distance --vary RHip_rz=0:60deg --vary LHip_rz=-60deg:0",
    ),
    TourMotion(
        "steady-walker",
        5.0,
        "It walks",
        _describe_walk,
        "The lines on the slope are half a meter apart.",
        "osimlite gait steady-walker --perturb 0.05 --starts 10",
    ),
    TourMotion(
        "jumper",
        1.6,
        "It jumps",
        _describe_jump,
        "Muscles are blue at rest and red when active; click on one for its length and its moment arms.",
        'osimlite muscles "{}/jumper/Jumper.osim" --coordinate knee_angle_r',
    ),
)


def _has_display() -> bool:
    """Return whether a browser can open a window here; text browsers in the terminal do not count."""
    # Output in a pipe or a log belongs to a program, which has no use for a window.
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    return sys.platform != "linux" or any(map(os.environ.get, ("DISPLAY", "WAYLAND_DISPLAY")))


def compute_distance_to_opensim(trajectory: Trajectory) -> float:
    """Return the largest difference of a coordinate (rad or m) from OpenSim 4.6's converged motion.

    They are compared every 50 ms from 0 to 2 s.
    """
    import csv
    from importlib.resources import files

    text = (
        files("osimlite.models").joinpath("dynamic_walker_opensim.csv").read_text(encoding="utf-8")
    )
    largest_difference = 0.0
    # Times are rounded, since both motions have them as sums of steps.
    times = [round(float(t), 6) for t in trajectory.times]
    for row in csv.DictReader(text.splitlines()):
        index = times.index(round(float(row["time"]), 6))
        for number, name in enumerate(trajectory.coordinates):
            largest_difference = max(
                largest_difference, abs(float(trajectory.values[index][number]) - float(row[name]))
            )
    return largest_difference
