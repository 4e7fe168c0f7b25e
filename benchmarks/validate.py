"""Speed of `osimlite validate`, compared with OpenSim's `Model(file)` and `initSystem()`.

    python benchmarks/validate.py [FOLDER] [--rounds N] [--files N] [--each]

FOLDER holds `.osim` or `.osim.gz` files; the default is the shared corpus. OpenSim reports few of
the errors that a model may have, but loading a model is the only check without osimlite.

The first table times reading and validating within one process, for every model that OpenSim
initialises; the two programs run in turn. The second table times the command on a folder of many
models: without a cache, with all files unchanged, and with one file changed. Only the second table
uses cached findings. Complete processes of single models are timed by all.py.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

from _corpus import CORPUS, WALKER, unpack_models
from _pair import Pair, copy_user_environment, print_pairs, time_pair

LARGEST_SHOWN = 8
"""Number of models in the first table, unless `--each` is set."""

OPENSIM_SCRIPT = """
import opensim
opensim.Logger.setLevelString("off")
model = opensim.Model({model!r})
model.initSystem()
"""
"""Script of a complete OpenSim process that loads and initialises a model; used by all.py."""

# ru_maxrss of the children is that of the largest process, so a process between starts the command.
MEMORY_SCRIPT = (
    "import resource, subprocess, sys; subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL);"
    "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
)
"""Script that runs a command and prints the peak memory of its largest process."""


def build_command(*words: str) -> list[str]:
    """Return the command line `osimlite WORDS...`, as a user calls it."""
    script = Path(sys.executable).with_name("osimlite")
    program = [str(script)] if script.exists() else [sys.executable, "-m", "osimlite"]
    return [*program, *words]


def initialize_in_opensim(path: Path) -> None:
    """Load and initialise a model in OpenSim, as is done before anything moves."""
    import opensim

    opensim.Model(str(path)).initSystem()


def time_single_models(rounds: int, files: list[Path], each: bool) -> None:
    """Time reading and validating of single models, and print a table and the ratios.

    Args:
        rounds: number of timed pairs of each model.
        files: model files; those that OpenSim does not initialise are skipped.
        each: whether to print all models instead of the largest ones.
    """
    import opensim

    import osimlite

    opensim.Logger.setLevelString("off")
    rows: list[tuple[Pair, int]] = []
    for path in files:
        try:
            initialize_in_opensim(path)
        # OpenSim cannot initialise some models of the corpus.
        except RuntimeError:
            continue
        size = path.stat().st_size
        row = time_pair(
            f"{path.stem} {size / 1e3:.0f} kB",
            ours=lambda path=path: osimlite.validate(path),
            theirs=lambda path=path: initialize_in_opensim(path),
            rounds=rounds,
        )
        rows.append((row, size))
    ratios = sorted(median(row.ratios) for row, _ in rows)
    if each:
        shown = [row for row, _ in rows]
    else:
        shown = [row for row, _ in sorted(rows, key=lambda row: -row[1])[:LARGEST_SHOWN]]
    title = "Read and validate in one process"
    print_pairs(title if each else f"{title}, the {LARGEST_SHOWN} largest models", shown)
    print(
        f"ratio over {len(rows)} models: median {median(ratios):.2f}, nine in ten below "
        f"{ratios[int(0.9 * (len(ratios) - 1))]:.2f}, greatest {ratios[-1]:.2f}"
    )


def time_folder(count: int, sources: list[Path]) -> None:
    """Print time and memory of `osimlite validate FOLDER` with several states of its cache.

    Args:
        count: number of models in the folder.
        sources: model files, which are copied in turn until there are `count` of them.
    """
    table = Table(title=f"A folder of {count} models")
    for column in ("", "time (s)", "per model (ms)", "peak memory (MB)"):
        table.add_column(column, justify="right" if column else "left")
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        # The configuration file makes the folder a project of its own.
        (folder / "osimlite.toml").write_text("")
        size = fill_folder(folder, count, sources)
        table.caption = f"{size / 1e6:.0f} MB of text; peak memory of the largest process"
        # The order matters: the first run writes the cache that the others use.
        for name in ("first run", "unchanged", "one changed"):
            if name == "one changed":
                first = folder / "model0000.osim"
                first.write_bytes(first.read_bytes() + b"\n")
            seconds, memory = measure_validation(folder)
            table.add_row(name, f"{seconds:.2f}", f"{1e3 * seconds / count:.2f}", f"{memory:.0f}")
    Console().print(table)


def fill_folder(folder: Path, count: int, sources: list[Path]) -> int:
    """Copy models into a folder.

    Args:
        folder: target folder.
        count: number of copies.
        sources: model files, which are copied in turn.

    Returns:
        Size of all copies (bytes).
    """
    size = 0
    for number in range(count):
        data = sources[number % len(sources)].read_bytes()
        (folder / f"model{number:04d}.osim").write_bytes(data)
        size += len(data)
    return size


def measure_validation(folder: Path) -> tuple[float, float]:
    """Run `osimlite validate` on a folder.

    Returns:
        Time (s), and peak memory of the largest process (MB).
    """
    command = [sys.executable, "-m", "osimlite", "validate", str(folder), "--format", "concise"]
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", MEMORY_SCRIPT, *command],
        env=copy_user_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    seconds = time.perf_counter() - start
    # macOS reports bytes, Linux kilobytes.
    memory = int(done.stdout) / (1e6 if sys.platform == "darwin" else 1e3)
    return seconds, memory


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "folder", nargs="?", type=Path, default=CORPUS, help="folder of model files"
    )
    parser.add_argument("--rounds", type=int, default=9, help="number of timed pairs of each model")
    parser.add_argument(
        "--files", type=int, default=1000, help="number of models in the folder of the last table"
    )
    parser.add_argument(
        "--each", action="store_true", help="show every model, not only the largest ones"
    )
    options = parser.parse_args()
    try:
        import opensim  # noqa: F401
    except ImportError:
        sys.exit(
            "this benchmark compares with OpenSim; install it with: pip install -e '.[oracle]'"
        )
    with tempfile.TemporaryDirectory() as temporary:
        files = unpack_models(options.folder, Path(temporary)) if options.folder.is_dir() else []
        if files:
            # The corpus has many models, so that fewer rounds of each are enough.
            time_single_models(max(3, options.rounds // 2), files, options.each)
        else:
            print(f"{options.folder} has no models; the walker is used instead")
            time_single_models(options.rounds, [WALKER], True)
        time_folder(options.files, files or [WALKER])


if __name__ == "__main__":
    main()
