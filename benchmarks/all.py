"""All that everyday use is asked to cost, beside OpenSim in turn: one table, with what is aimed at.

    python benchmarks/all.py [--quick] [FOLDER]

FOLDER holds Rajagopal2016.osim, gait2392.osim and gait10dof18musc.osim; without one the shared
corpus is used, and where that is absent the walker alone. It takes up to ten minutes, with --quick
(three rounds of each) two. What OpenSim has no counterpart of is timed alone, and has an aim in
milliseconds. The whole processes are those of users: byte code and machine code are there already.
What is counted instead of timed is in cost.py.
"""

from __future__ import annotations

import argparse
import gzip
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import opensim
from rich.console import Console
from rich.table import Table

import osimlite
from _corpus import CORPUS, unpacked
from _pair import Pair, pair, pair_commands
from osimlite.simulation import Simulation
from simulate import (
    ACCURACIES,
    MODEL,
    OPENSIM_SCRIPT,
    TO,
    prepare_opensim_runs,
    prepare_osimlite_runs,
)
from validate import OPENSIM_SCRIPT as INITIALIZED
from validate import build_command, initialize_in_opensim

REAL = {"Rajagopal2016": "m0954", "gait2392": "m0013", "gait10dof18musc": "m0005"}
"""The models by name, and what stands for them in the corpus."""
SMALL = 60_000
"""Bytes of a file that is small."""
ACCURACY = ACCURACIES[0]
NOTHING = "pass"


class Aimed(NamedTuple):
    """What was measured, and what was aimed at: a ratio of our time to OpenSim's, or our milliseconds."""

    pair: Pair
    aim: float
    unit: str = ""

    @property
    def found(self) -> float:
        """What the aim is compared with."""
        return 1e3 * median(self.pair.ours) if self.unit else median(self.pair.ratios)


def measured(rounds: int, folder: Path, place: Path) -> Iterator[Aimed]:
    """Every row, the quick ones first."""
    few = max(3, rounds // 3)
    files = {"walker": MODEL, **models(folder, place)}
    yield from motions(rounds)
    for name, file in files.items():
        aim = 1.0 if name == "walker" else 0.6
        ours, theirs = partial(osimlite.validate, file), partial(initialize_in_opensim, file)
        yield Aimed(pair(f"validate({name})", ours=ours, theirs=theirs, rounds=rounds), aim)
    small = [
        file
        for file in (unpacked(CORPUS, place) if CORPUS.is_dir() else [MODEL])
        if file.stat().st_size < SMALL
    ]
    reading = [
        pair(
            file.stem,
            ours=partial(osimlite.read, file),
            theirs=partial(opensim.Model, str(file)),
            rounds=rounds,
        )
        for file in small
    ]
    whole = (
        tuple(map(sum, zip(*(getattr(row, side) for row in reading), strict=True)))
        for side in ("ours", "theirs")
    )
    yield Aimed(Pair(f"read {len(small)} small files", *whole), 1.2)
    for name, file in files.items():
        opened = [sys.executable, "-c", INITIALIZED.format(model=str(file))]
        checked = build_command("validate", "--no-cache", str(file))
        yield Aimed(
            pair_commands(
                f"osimlite validate {name}, first", ours=checked, theirs=opened, rounds=few
            ),
            0.8,
        )
    walked = [
        sys.executable,
        "-c",
        OPENSIM_SCRIPT.format(model=str(MODEL), to=TO, accuracy=ACCURACY),
    ]
    simulated = build_command(
        "simulate", str(MODEL), "--to", f"{TO:g}", "-o", str(place / "results")
    )
    yield Aimed(
        pair_commands("osimlite simulate walker", ours=simulated, theirs=walked, rounds=rounds), 1.0
    )
    for name, words, aim in (
        ("info walker", ("info", str(MODEL)), 100),
        ("validate walker, first", ("validate", "--no-cache", str(MODEL)), 90),
        ("validate walker, unchanged", ("validate", str(MODEL)), 40),
    ):
        # Beside a Python that does nothing, which tells how quick the machine is.
        alone = pair_commands(
            f"osimlite {name}",
            ours=build_command(*words),
            theirs=[sys.executable, "-c", NOTHING],
            rounds=rounds,
        )
        yield Aimed(alone, aim, "ms")


def motions(rounds: int) -> Iterator[Aimed]:
    """Two seconds of the walker: a call that makes ready and runs, and the motion alone; in processor time."""
    theirs = opensim.Model(str(MODEL))
    theirs.initSystem()
    model = osimlite.read(MODEL)
    with Simulation(model, "compiled") as ready:
        works: list[tuple[str, Callable[[], object], float]] = [
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
            ("motion of the walker, compiled", prepare_osimlite_runs(ready, ACCURACY), 1 / 30),
        ]
        for name, ours, aim in works:
            run = prepare_opensim_runs(theirs, ACCURACY, rounds + 1)
            yield Aimed(
                pair(name, ours=ours, theirs=run, rounds=rounds, clock=time.process_time), aim
            )


def models(folder: Path, place: Path) -> dict[str, Path]:
    """Those of the real models that are there."""
    found = {}
    for name, key in REAL.items():
        own, kept = folder / f"{name}.osim", CORPUS / f"{key}.osim.gz"
        if own.exists():
            found[name] = own
        elif kept.exists():
            found[name] = place / f"{name}.osim"
            found[name].write_bytes(gzip.decompress(kept.read_bytes()))
    return found


def table(rows: list[Aimed]) -> Table:
    made = Table(
        title="Everyday use", caption="medians; ratio = osimlite / OpenSim, median of the pairs"
    )
    made.add_column("")
    for column in ("osimlite (ms)", "OpenSim (ms)", "ratio", "least", "greatest", "aim", ""):
        made.add_column(column, justify="right")
    for row in rows:
        ours, theirs, ratios = row.pair.ours, row.pair.theirs, row.pair.ratios
        beside: list[Any] = ["", "", "", ""]
        if not row.unit:
            beside = [
                f"{1e3 * median(theirs):.4g}",
                *(f"{v:.2g}" for v in (median(ratios), min(ratios), max(ratios))),
            ]
        aim, kept = (
            f"{row.aim:.3g} {row.unit}".strip(),
            "kept" if row.found <= row.aim else "missed",
        )
        made.add_row(row.pair.name, f"{1e3 * median(ours):.4g}", *beside, aim, kept)
    return made


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", nargs="?", type=Path, default=Path())
    parser.add_argument("--quick", action="store_true", help="three rounds of each")
    options = parser.parse_args()
    opensim.Logger.setLevelString("off")
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as place:
        rows = list(measured(3 if options.quick else 15, options.folder, Path(place)))
    console = Console(width=120)
    console.print(table(rows))
    console.print(f"{time.perf_counter() - started:.0f} s")


if __name__ == "__main__":
    main()
