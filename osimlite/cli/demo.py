"""``osimlite demo``: the whole tour on the dynamic walker."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from osimlite.cli._console import add_row, plain_console, plain_table, say, show
from osimlite.cli._progress import motion_bar, progress_bar

if TYPE_CHECKING:
    from osimlite.schema.model import Model
    from osimlite.simulation.trajectory import Trajectory

MISSPELT = ("<geometry>RFootContact ", "<geometry>RFootContct ")


def demo(
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FOLDER", help="Folder for everything the tour makes.")
    ] = Path("osimlite-demo"),
    pictures: Annotated[bool, typer.Option(help="Draw the plots and the animation.")] = True,
) -> None:
    """Build, check, translate and simulate the dynamic walker, and leave the results in a folder.

    The walker is the model of the OpenSim exercise "Building a Dynamic Walker". The tour takes about ten seconds,
    most of it for the pictures.
    """
    from osimlite._require import require
    from osimlite.files import make_folder
    from osimlite.simulation.engines import AUTO, engine_factory

    engine_factory(AUTO)
    if pictures:
        require("matplotlib", extra="plot", purpose="drawing")
    make_folder(output)
    tour = _Tour(output)
    model, trajectory = _work(tour)
    if pictures:
        _pictures(tour, model, trajectory)
    tour.table()


@dataclass
class _Tour:
    """What has been done so far, for the closing table."""

    folder: Path
    rows: list[tuple[str, str, str, float]] = field(default_factory=list)

    @contextmanager
    def step(self, title: str) -> Iterator[Callable[[str, str], None]]:
        """Announce a step; the caller says what came out and which file holds it."""
        say(f"{len(self.rows) + 1}. {title}")
        start = time.perf_counter()
        said = ["", ""]

        def tell(result: str, file: str = "") -> None:
            said[:] = [result, file]

        yield tell
        self.rows.append((title, said[0], said[1], time.perf_counter() - start))
        say(f"   {said[0]}")
        say()

    def table(self) -> None:
        """Print everything that was done."""
        table = plain_table(f"Everything is in {self.folder}/")
        table.add_column("step", overflow="fold")
        table.add_column("result", overflow="fold")
        table.add_column("file", no_wrap=True)
        table.add_column("s", justify="right", no_wrap=True)
        for title, result, file, seconds in self.rows:
            add_row(table, title, result, file, f"{seconds:.2f}")
        plain_console().print(table)


def _work(tour: _Tour) -> tuple[Model, Trajectory]:
    from osimlite.document.printer import write
    from osimlite.lint import validate
    from osimlite.lint.reporters import render
    from osimlite.models.dynamic_walker import dynamic_walker
    from osimlite.simulation import simulate
    from osimlite.translate import to_urdf

    folder = tour.folder
    with tour.step("Build in Python") as tell:
        model = dynamic_walker()
        file = folder / f"{model.name}.osim"
        write(model, file)
        tell(f"{sum(1 for _ in model.components())} components written", file.name)

    with tour.step("Validate the file") as tell:
        report = validate(file)
        tell(f"{len(report.errors)} errors, {len(report.warnings)} warnings", file.name)

    with tour.step("Validate a misspelt copy") as tell:
        text = file.read_text(encoding="utf-8")
        assert text.count(MISSPELT[0]) == 1
        broken = folder / "misspelt.osim"
        broken.write_text(text.replace(*MISSPELT), encoding="utf-8")
        found = validate(broken)
        errors = replace(found, findings=found.errors)
        show(render(errors, "full"))
        tell(f"{len(found.errors)} error on line {found.errors[0].line}: {found.errors[0].name}", broken.name)

    with tour.step("Translate to URDF") as tell:
        urdf = to_urdf(model)
        urdf.write(folder / "urdf")
        tell(f"{len(urdf.fidelity)} things URDF cannot say are listed", "urdf/")

    with tour.step("Simulate two seconds") as tell, motion_bar("   simulating", 2.0) as progress:
        trajectory = simulate(model, to=2.0, report_interval=0.01, progress=progress)
        trajectory.write(folder)
        difference = distance_to_opensim(trajectory)
        tell(
            f"{trajectory.summary['engine']}: {trajectory.summary['steps']} steps; at most {difference:.1e} from "
            "OpenSim's converged motion",
            "states.sto",
        )
    return model, trajectory


def _pictures(tour: _Tour, model: Model, trajectory: Trajectory) -> None:
    from osimlite.view.animation import animate
    from osimlite.view.plots import plot_simulation

    with tour.step("Plot motion, forces, energy") as tell:
        files = plot_simulation(trajectory, tour.folder)
        tell(", ".join(file.stem for file in files), "*.png")
    with tour.step("Animate the walker") as tell, progress_bar("   drawing", None) as progress:
        target = tour.folder / "animation.gif"
        animate(model, trajectory, target, progress=progress)
        tell(f"{target.stat().st_size / 1e6:.1f} MB", target.name)


def distance_to_opensim(trajectory: Trajectory) -> float:
    """Largest difference of any coordinate (rad or m) to OpenSim 4.6's converged motion, every 50 ms of 0-2 s."""
    import csv
    from importlib.resources import files

    text = files("osimlite.models").joinpath("dynamic_walker_opensim.csv").read_text(encoding="utf-8")
    largest = 0.0
    times = [round(float(t), 6) for t in trajectory.times]
    for row in csv.DictReader(text.splitlines()):
        place = times.index(round(float(row["time"]), 6))
        for number, name in enumerate(trajectory.coordinates):
            largest = max(largest, abs(float(trajectory.values[place][number]) - float(row[name])))
    return largest
