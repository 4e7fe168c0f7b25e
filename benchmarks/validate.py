"""Validating: `osimlite validate` against OpenSim's `Model(file)` and `initSystem()`, side by side in one run.

    python benchmarks/validate.py [FOLDER] [--rounds N] [--files N] [--each]

Two tables: read-and-validate within one process for every real model that OpenSim initializes
(FOLDER holds `.osim` or `.osim.gz` files; without one the shared corpus is used); and a folder of
many models, first unknown and then unchanged. Whole processes are in all.py. OpenSim says nothing
about most faults; it is timed as the only check there is without osimlite. Findings kept from
earlier runs are used in the last table alone.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

from _corpus import CORPUS, unpacked
from _pair import Pair, pair, report

ROOT = Path(__file__).resolve().parents[1]
WALKER = ROOT / "fixtures" / "walker" / "DynamicWalkerModel.osim"
THEIRS = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model({model!r})
model.initSystem()
"""


def whole_process(*words: str) -> list[str]:
    """The command, as a user calls it."""
    script = Path(sys.executable).with_name("osimlite")
    return [*([str(script)] if script.exists() else [sys.executable, "-m", "osimlite"]), *words]


def initialized(path: Path) -> None:
    """What OpenSim does with a model before anything moves."""
    import opensim

    opensim.Model(str(path)).initSystem()


def in_process(rounds: int, files: list[Path], each: bool) -> None:
    import opensim

    import osimlite

    opensim.Logger.setLevelString("off")

    rows: list[tuple[Pair, int]] = []
    for path in files:
        try:
            initialized(path)
        except RuntimeError:
            continue
        name = f"{path.stem} {path.stat().st_size / 1e3:.0f} kB"
        ours, theirs = (
            (lambda path=path: osimlite.validate(path)),
            (lambda path=path: initialized(path)),
        )
        rows.append((pair(name, ours=ours, theirs=theirs, rounds=rounds), path.stat().st_size))
    ratios = sorted(median(row.ratios) for row, _ in rows)
    shown = (
        [row for row, _ in rows]
        if each
        else [row for row, _ in sorted(rows, key=lambda row: -row[1])[:8]]
    )
    report("Read and validate in one process" + ("" if each else ", the 8 largest"), shown)
    print(
        f"ratio over {len(rows)} models: median {median(ratios):.2f}, nine in ten below "
        f"{ratios[int(0.9 * (len(ratios) - 1))]:.2f}, greatest {ratios[-1]:.2f}"
    )


def folder_of_models(count: int, sources: list[Path]) -> None:
    """Time and memory of `osimlite validate FOLDER`: nothing known, everything unchanged, one file changed."""
    table = Table(title=f"A folder of {count} models")
    for column in ("", "time (s)", "per model (ms)", "peak memory (MB)"):
        table.add_column(column, justify="right" if column else "left")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "osimlite.toml").write_text("")
        size = 0
        for number in range(count):
            data = sources[number % len(sources)].read_bytes()
            (folder / f"model{number:04d}.osim").write_bytes(data)
            size += len(data)
        table.caption = f"{size / 1e6:.0f} MB of text; peak memory of the largest process"
        for name in ("first run", "unchanged", "one changed"):
            if name == "one changed":
                first = folder / "model0000.osim"
                first.write_bytes(first.read_bytes() + b"\n")
            seconds, memory = _measured(folder)
            table.add_row(name, f"{seconds:.2f}", f"{1e3 * seconds / count:.2f}", f"{memory:.0f}")
    Console().print(table)


def _measured(folder: Path) -> tuple[float, float]:
    """Seconds, and the greatest memory (MB) of the process and those it started."""
    code = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL);"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    command = [sys.executable, "-m", "osimlite", "validate", str(folder), "--format", "concise"]
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code, *command],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return time.perf_counter() - start, int(done.stdout) / (
        1e6 if sys.platform == "darwin" else 1e3
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", nargs="?", type=Path, default=CORPUS)
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument(
        "--files", type=int, default=1000, help="models in the folder of the last table"
    )
    parser.add_argument(
        "--each", action="store_true", help="show every model, not the largest alone"
    )
    options = parser.parse_args()
    try:
        import opensim  # noqa: F401
    except ImportError:
        sys.exit(
            "this benchmark compares with OpenSim; install it with: pip install -e '.[oracle]'"
        )
    with tempfile.TemporaryDirectory() as place:
        files = unpacked(options.folder, Path(place)) if options.folder.is_dir() else []
        if files:
            in_process(max(3, options.rounds // 2), files, options.each)
        else:
            print(f"no models in {options.folder}: the walker stands for them")
            in_process(options.rounds, [WALKER], True)
        folder_of_models(options.files, files or [WALKER])


if __name__ == "__main__":
    main()
