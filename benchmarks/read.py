"""Reading: `osimlite.read` against OpenSim's `Model(file)`, one row per real model, and whole processes.

    python benchmarks/read.py [FOLDER] [--rounds N] [--processes]

FOLDER holds `.osim` or `.osim.gz` files; without one the shared corpus is used. Ratios are taken
inside each pair (see `_pair`); the last lines give the median and the worst over all files, and how
time grows with size.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import tracemalloc
from pathlib import Path
from statistics import median

from _corpus import CORPUS, unpacked
from _pair import Pair, pair, pair_commands, report


def exponent(sizes: list[int], times: list[float]) -> float:
    """Slope of log time over log size by least squares; 1 is linear."""
    from math import log

    xs, ys = [log(size) for size in sizes], [log(time) for time in times]
    mean_x, mean_y = sum(xs) / len(xs), sum(ys) / len(ys)
    above = sum((x - mean_x) * (y - mean_y) for x, y in zip(xs, ys, strict=True))
    return above / sum((x - mean_x) ** 2 for x in xs)


def peak_memory(path: Path) -> float:
    """Most memory (MB) that Python held while reading, as `tracemalloc` counts it."""
    import osimlite

    tracemalloc.start()
    osimlite.read(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / 1e6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("folder", nargs="?", type=Path, default=CORPUS)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument(
        "--processes", action="store_true", help="also time whole processes on the largest file"
    )
    options = parser.parse_args()
    try:
        import opensim
    except ImportError:
        sys.exit(
            "this benchmark compares with OpenSim; install it with: pip install -e '.[oracle]'"
        )
    import osimlite

    opensim.Logger.setLevelString("off")
    with tempfile.TemporaryDirectory() as place:
        files = unpacked(options.folder, Path(place))
        if not files:
            sys.exit(f"no .osim files in {options.folder}")
        rows: list[Pair] = []
        for path in files:
            name = f"{path.stem} {path.stat().st_size / 1e3:.0f} kB"
            rows.append(
                pair(
                    name,
                    ours=lambda path=path: osimlite.read(path),
                    theirs=lambda path=path: opensim.Model(str(path)),
                    rounds=options.rounds,
                )
            )
        report("Reading a model", rows)
        ratios = [median(row.ratios) for row in rows]
        print(f"ratio over {len(rows)} files: median {median(ratios):.2f}, worst {max(ratios):.2f}")
        big = [
            (path.stat().st_size, median(row.ours)) for path, row in zip(files, rows, strict=True)
        ]
        big = [(size, time) for size, time in big if size > 50_000]
        if len(big) > 2:
            print(
                f"our time grows as size to the power {exponent([s for s, _ in big], [t for _, t in big]):.2f}"
            )
        largest = max(files, key=lambda path: path.stat().st_size)
        size = largest.stat().st_size / 1e6
        print(
            f"{largest.stem}: peak memory {peak_memory(largest):.1f} MB for {size:.2f} MB of text"
        )
        if options.processes:
            read = f"import osimlite; osimlite.read({str(largest)!r})"
            load = f"import opensim; opensim.Logger.setLevelString('off'); opensim.Model({str(largest)!r})"
            commands = pair_commands(
                f"whole process, {largest.stem}",
                ours=[sys.executable, "-c", read],
                theirs=[sys.executable, "-c", load],
                rounds=options.rounds,
            )
            report("Whole processes", [commands])


if __name__ == "__main__":
    main()
