"""Compare the time of everyday actions with OpenSim and with targets, in one table.

    python benchmarks/all.py [--quick] [FOLDER]

FOLDER holds Rajagopal2016.osim, gait2392.osim and gait10dof18musc.osim. Models that it lacks are
taken from the shared corpus; without that, the Dynamic Walker alone is measured. The script takes
up to ten minutes, with --quick (three rounds of each action) two.

Each row is an action, and both programs run in turn. The target is a ratio, time of osimlite
divided by time of OpenSim, and the last column says whether the median ratio reaches it. Where
OpenSim has no counterpart, the action of osimlite is timed alone, and the target is in
milliseconds. Rows that begin with ``osimlite`` are processes from start to exit, as a user starts
them: byte code and machine code exist before. What is counted instead of timed is in cost.py.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import NamedTuple

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, WALKER, unpack_file, unpack_models
from _pair import Pair, time_command_pair, time_pair
from osimlite.simulation import Simulation
from simulate import (
    ACCURACIES,
    OPENSIM_SCRIPT,
    TO,
    prepare_opensim_runs,
    prepare_osimlite_runs,
)
from validate import OPENSIM_SCRIPT as INITIALIZATION_SCRIPT
from validate import build_command, initialize_in_opensim

CORPUS_NAMES = {"Rajagopal2016": "m0954", "gait2392": "m0013", "gait10dof18musc": "m0005"}
"""Names of the models in the corpus, by the names of the models."""

SMALL_FILE_BYTES = 60_000
"""Size below which a model is one of the small files."""

ACCURACY = ACCURACIES[0]
"""Accuracy of both integrators."""

ROUNDS = 15
"""Rounds of each action."""

QUICK_ROUNDS = 3
"""Rounds of each action with --quick, and least number of rounds of slow actions."""

EMPTY_PROGRAM = "pass"
"""Python program that does nothing."""


class Comparison(NamedTuple):
    """Measured times of an action, and the target.

    Attributes:
        pair: times of both programs.
        target: largest allowed ratio, or time of osimlite in `unit`.
        unit: "ms" if osimlite runs alone; empty for a ratio.
    """

    pair: Pair
    target: float
    unit: str = ""

    @property
    def value(self) -> float:
        """Number that the target is compared with."""
        return 1e3 * median(self.pair.ours) if self.unit else median(self.pair.ratios)

    @property
    def is_reached(self) -> bool:
        """True if the target is reached."""
        return self.value <= self.target


def compare_all(rounds: int, folder: Path, work_folder: Path) -> Iterator[Comparison]:
    """Measure all actions, quick ones first.

    Args:
        rounds: rounds of each action.
        folder: folder in which models are looked for.
        work_folder: folder for unpacked models and results.
    """
    files = {"walker": WALKER, **find_models(folder, work_folder)}
    yield from compare_motions(rounds)
    yield from compare_validation(files, rounds)
    yield compare_reading(work_folder, rounds)
    yield from compare_commands(files, rounds, work_folder)
    yield from time_commands(rounds)


def find_models(folder: Path, work_folder: Path) -> dict[str, Path]:
    """Find the models of `CORPUS_NAMES` in a folder or in the corpus.

    Returns:
        The files by name, without models that are in neither.
    """
    files = {}
    for name, number in CORPUS_NAMES.items():
        # The user's file takes precedence over that of the corpus.
        file = folder / f"{name}.osim"
        packed = CORPUS / f"{number}.osim.gz"
        if file.exists():
            files[name] = file
        elif packed.exists():
            files[name] = unpack_file(packed, work_folder / f"{name}.osim")
    return files


def compare_motions(rounds: int) -> Iterator[Comparison]:
    """Compare simulations of the walker for two seconds, in processor time.

    `osimlite.simulate` prepares the model and simulates it. The last row is the simulation alone of
    a model that is prepared, as OpenSim's is.
    """
    opensim_model = opensim.Model(str(WALKER))
    opensim_model.initSystem()
    model = osimlite.read(WALKER)
    with Simulation(model, "compiled") as simulation:
        actions: list[tuple[str, Callable[[], object], float]] = [
            (
                "simulate(walker), PyBullet",
                partial(osimlite.simulate, model, to=TO, engine="bullet"),
                0.5,
            ),
            (
                "simulate(walker), compiled",
                partial(osimlite.simulate, model, to=TO, engine="compiled"),
                1 / 12,
            ),
            ("motion of the walker, compiled", prepare_osimlite_runs(simulation, ACCURACY), 1 / 30),
        ]
        for name, ours, target in actions:
            # One run more than rounds, for the warm-up: a manager of OpenSim runs once.
            theirs = prepare_opensim_runs(opensim_model, ACCURACY, rounds + 1)
            pair = time_pair(name, ours=ours, theirs=theirs, rounds=rounds, clock=time.process_time)
            yield Comparison(pair, target)


def compare_validation(files: dict[str, Path], rounds: int) -> Iterator[Comparison]:
    """Compare validation in this process with reading and initialization by OpenSim."""
    for name, file in files.items():
        pair = time_pair(
            f"validate({name})",
            ours=partial(osimlite.validate, file),
            theirs=partial(initialize_in_opensim, file),
            rounds=rounds,
        )
        yield Comparison(pair, target=1.0 if name == "walker" else 0.6)


def compare_reading(work_folder: Path, rounds: int) -> Comparison:
    """Compare the total time of reading all small files, in this process."""
    files = unpack_models(CORPUS, work_folder) if CORPUS.is_dir() else [WALKER]
    small_files = [file for file in files if file.stat().st_size < SMALL_FILE_BYTES]
    pairs = [
        time_pair(
            file.stem,
            ours=partial(osimlite.read, file),
            theirs=partial(opensim.Model, str(file)),
            rounds=rounds,
        )
        for file in small_files
    ]
    # Round by round, the sum over all files.
    ours = tuple(map(sum, zip(*(pair.ours for pair in pairs), strict=True)))
    theirs = tuple(map(sum, zip(*(pair.theirs for pair in pairs), strict=True)))
    return Comparison(Pair(f"read {len(small_files)} small files", ours, theirs), target=1.2)


def compare_commands(
    files: dict[str, Path], rounds: int, work_folder: Path
) -> Iterator[Comparison]:
    """Compare commands with Python programs that do the same with OpenSim, as processes."""
    for name, file in files.items():
        pair = time_command_pair(
            f"osimlite validate {name}, first",
            # With a cache the second round would find the result of the first.
            ours=build_command("validate", "--no-cache", str(file)),
            theirs=[sys.executable, "-c", INITIALIZATION_SCRIPT.format(model=str(file))],
            # OpenSim alone takes seconds for the large models.
            rounds=max(QUICK_ROUNDS, rounds // 3),
        )
        yield Comparison(pair, target=0.8)
    results = str(work_folder / "results")
    program = OPENSIM_SCRIPT.format(model=str(WALKER), to=TO, accuracy=ACCURACY)
    pair = time_command_pair(
        "osimlite simulate walker",
        ours=build_command("simulate", str(WALKER), "--to", f"{TO:g}", "-o", results),
        theirs=[sys.executable, "-c", program],
        rounds=rounds,
    )
    yield Comparison(pair, target=1.0)


def time_commands(rounds: int) -> Iterator[Comparison]:
    """Time commands for which OpenSim has no counterpart."""
    for name, words, target in (
        ("info walker", ("info", str(WALKER)), 100),
        ("validate walker, first", ("validate", "--no-cache", str(WALKER)), 90),
        # The warm-up writes the cache that the timed rounds find.
        ("validate walker, unchanged", ("validate", str(WALKER)), 40),
    ):
        # They run in turn with a Python that does nothing, which shows how fast the machine is.
        pair = time_command_pair(
            f"osimlite {name}",
            ours=build_command(*words),
            theirs=[sys.executable, "-c", EMPTY_PROGRAM],
            rounds=rounds,
        )
        yield Comparison(pair, target, "ms")


def make_table(comparisons: list[Comparison]) -> Table:
    """Return the table of all comparisons."""
    table = Table(
        title="Everyday actions",
        caption="medians; ratio = osimlite / OpenSim, median of the pairs",
    )
    table.add_column("action")
    headings = ("osimlite, ms", "OpenSim, ms", "ratio", "least", "greatest", "target", "")
    for heading in headings:
        table.add_column(heading, justify="right")
    for comparison in comparisons:
        ours = f"{1e3 * median(comparison.pair.ours):.4g}"
        opensim_cells = ["", "", "", ""]
        if not comparison.unit:
            ratios = comparison.pair.ratios
            opensim_cells = [
                f"{1e3 * median(comparison.pair.theirs):.4g}",
                *(f"{value:.2g}" for value in (median(ratios), min(ratios), max(ratios))),
            ]
        target = f"{comparison.target:.3g} {comparison.unit}".strip()
        verdict = "reached" if comparison.is_reached else "missed"
        table.add_row(comparison.pair.name, ours, *opensim_cells, target, verdict)
    return table


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder",
        nargs="?",
        type=Path,
        default=Path(),
        metavar="FOLDER",
        help="folder with models, by default the working folder",
    )
    parser.add_argument("--quick", action="store_true", help="run three rounds of each action")
    options = parser.parse_args()
    # Messages of OpenSim would take time, and hide the table.
    opensim.Logger.setLevelString("off")
    start = time.perf_counter()
    rounds = QUICK_ROUNDS if options.quick else ROUNDS
    with tempfile.TemporaryDirectory() as name:
        comparisons = list(compare_all(rounds, options.folder, Path(name)))
    console = Console(width=120)
    console.print(make_table(comparisons))
    console.print(f"{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
