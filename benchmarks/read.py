"""Speed of reading models: `osimlite.read` compared with OpenSim's `Model(file)`.

    python benchmarks/read.py [FOLDER] [--rounds N] [--processes]

FOLDER holds `.osim` or `.osim.gz` files; the default is the shared corpus. The two programs run in
turn; the table has one row for each model. The last lines have the median and the greatest ratio of
all models, the growth of osimlite's time with the size of the file, and the peak memory for the
largest file. With `--processes`, complete processes that read the largest file are timed too.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import tracemalloc
from pathlib import Path
from statistics import median

from _corpus import CORPUS, unpack_models
from _pair import Pair, print_pairs, time_command_pair, time_pair

# Fixed costs dominate the time of small files, so that they say nothing about growth.
MIN_GROWTH_SIZE = 50_000
"""Size of the smallest file (bytes) from which the growth is computed."""


def compute_growth(sizes: list[int], times: list[float]) -> float:
    """Return the power of the size with which the time grows, by least squares of the logarithms.

    Args:
        sizes: sizes of files (bytes).
        times: times of reading them (s).
    """
    xs = [math.log(size) for size in sizes]
    ys = [math.log(time) for time in times]
    mean_x = sum(xs) / len(xs)
    mean_y = sum(ys) / len(ys)
    covariance = sum((x - mean_x) * (y - mean_y) for x, y in zip(xs, ys, strict=True))
    return covariance / sum((x - mean_x) ** 2 for x in xs)


def measure_peak_memory(path: Path) -> float:
    """Return the peak memory (MB) that Python allocates while reading, by `tracemalloc`."""
    import osimlite

    # Tracing slows reading down, so that memory is measured in a run of its own.
    tracemalloc.start()
    osimlite.read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / 1e6


def time_models(files: list[Path], rounds: int) -> list[Pair]:
    """Time reading of each file in turn with both programs.

    Args:
        files: model files.
        rounds: number of timed pairs of each file.
    """
    import opensim

    import osimlite

    # Each function has its own path: a loop variable would change before the call.
    return [
        time_pair(
            f"{path.stem} {path.stat().st_size / 1e3:.0f} kB",
            ours=lambda path=path: osimlite.read(path),
            theirs=lambda path=path: opensim.Model(str(path)),
            rounds=rounds,
        )
        for path in files
    ]


def time_processes(path: Path, rounds: int) -> Pair:
    """Time complete processes that read a file.

    Args:
        path: model file.
        rounds: number of timed pairs.
    """
    read = f"import osimlite; osimlite.read({str(path)!r})"
    load = f"import opensim; opensim.Logger.setLevelString('off'); opensim.Model({str(path)!r})"
    return time_command_pair(
        f"complete process, {path.stem}",
        ours=[sys.executable, "-c", read],
        theirs=[sys.executable, "-c", load],
        rounds=rounds,
    )


def print_summary(files: list[Path], rows: list[Pair]) -> None:
    """Print the ratios of all models, and the growth of osimlite's time with the size.

    Args:
        files: model files.
        rows: their times.
    """
    ratios = [median(row.ratios) for row in rows]
    print(f"ratio over {len(rows)} files: median {median(ratios):.2f}, greatest {max(ratios):.2f}")
    large = [
        (path.stat().st_size, median(row.ours))
        for path, row in zip(files, rows, strict=True)
        if path.stat().st_size > MIN_GROWTH_SIZE
    ]
    # Two files or fewer determine no slope.
    if len(large) > 2:
        power = compute_growth([size for size, _ in large], [time for _, time in large])
        print(f"osimlite's time grows with the size to the power {power:.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "folder", nargs="?", type=Path, default=CORPUS, help="folder of model files"
    )
    parser.add_argument("--rounds", type=int, default=5, help="number of timed pairs of each model")
    parser.add_argument(
        "--processes",
        action="store_true",
        help="also time complete processes that read the largest file",
    )
    options = parser.parse_args()
    try:
        import opensim
    except ImportError:
        sys.exit(
            "this benchmark compares with OpenSim; install it with: pip install -e '.[oracle]'"
        )
    opensim.Logger.setLevelString("off")
    with tempfile.TemporaryDirectory() as temporary:
        files = unpack_models(options.folder, Path(temporary))
        if not files:
            sys.exit(f"no .osim files in {options.folder}")
        rows = time_models(files, options.rounds)
        print_pairs("Reading a model", rows)
        print_summary(files, rows)
        largest = max(files, key=lambda path: path.stat().st_size)
        size = largest.stat().st_size / 1e6
        memory = measure_peak_memory(largest)
        print(f"{largest.stem}: peak memory {memory:.1f} MB for {size:.2f} MB of text")
        if options.processes:
            print_pairs("Complete processes", [time_processes(largest, options.rounds)])


if __name__ == "__main__":
    main()
