"""Speed of checking tables: `osimlite validate` on a folder of motions, loads and markers.

    python benchmarks/tables.py [--megabytes N] [--rounds N]

The folder has many files of usual sizes and a few very large ones, in the formats of OpenSim and of
motion capture programs. OpenSim has no such check to compare with. The table has the processor time
(s), the text that one processor checks per second, the wall-clock time, and the peak memory of one
process: with no cache, and with all files unchanged.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from itertools import count, cycle
from pathlib import Path
from random import Random
from shutil import rmtree
from statistics import median
from typing import NamedTuple

from rich.console import Console
from rich.table import Table

from _pair import copy_user_environment


class Format(NamedTuple):
    """Format of one kind of table."""

    number: str
    """Format of its numbers."""
    separator: str
    """Text between two numbers."""
    columns: int
    """Number of columns without the time."""


FORMATS = {
    "results.sto": Format("%.8f", "\t", 60),
    "states.sto": Format("%.17g", "\t", 60),
    "coordinates.mot": Format("%16.8f", "\t", 40),
    "loads.mot": Format("%.6f", " ", 19),
    "markers.trc": Format("%.5f", "\t", 120),
}
"""Formats by the last part of the names of files."""

# Drawing random numbers takes much longer than repeating lines.
DISTINCT_ROWS = 200
"""Number of random rows, which are repeated until a table is long enough."""

USUAL_SIZES = (50_000, 500_000, 3_000_000)
"""Sizes of most files (bytes)."""

TRC_KEYS = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)

MEASURE_SCRIPT = (
    "import resource, subprocess, sys; done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL);"
    "used = resource.getrusage(resource.RUSAGE_CHILDREN);"
    "print(used.ru_utime + used.ru_stime, used.ru_maxrss, done.returncode)"
)
"""Script that runs a command and prints the processor time and the peak memory of its processes."""


class Usage(NamedTuple):
    """Time and memory of one run."""

    processor_seconds: float
    seconds: float
    """Wall-clock time (s)."""
    memory: float
    """Peak memory of the largest process (MB)."""


def format_table(kind: str, size: int, draw: Random) -> str:
    """Return the text of a table with random numbers.

    Args:
        kind: key of `FORMATS`.
        size: approximate size (bytes).
        draw: source of random numbers.
    """
    number_format, separator, columns = FORMATS[kind]
    bodies = [
        separator.join(number_format % draw.gauss(0.0, 300.0) for _ in range(columns))
        for _ in range(DISTINCT_ROWS)
    ]
    row_count = max(1, size // len(bodies[0]))
    starts: Iterator[str]
    if kind.endswith(".trc"):
        header = format_trc_header(kind, row_count, columns // 3)
        starts = (f"{row + 1}\t{row / 100:.3f}\t" for row in range(row_count))
    else:
        header = format_sto_header(kind, row_count, columns)
        starts = (number_format % (row / 1000) + separator for row in range(row_count))
    rows = (start + body for start, body in zip(starts, cycle(bodies), strict=False))
    return "\n".join([*header, *rows, ""])


def format_trc_header(name: str, rows: int, markers: int) -> list[str]:
    """Return the header lines of a TRC file.

    Args:
        name: name of the file.
        rows: number of frames.
        markers: number of markers.
    """
    numbers = range(1, markers + 1)
    return [
        f"PathFileType\t4\t(X/Y/Z)\t{name}",
        "\t".join(TRC_KEYS),
        f"100\t100\t{rows}\t{markers}\tmm\t100\t1\t{rows}",
        "Frame#\tTime\t" + "".join(f"marker{number}\t\t\t" for number in numbers),
        "\t\t" + "".join(f"X{number}\tY{number}\tZ{number}\t" for number in numbers),
        "",
    ]


def format_sto_header(name: str, rows: int, columns: int) -> list[str]:
    """Return the header lines of a STO or MOT file.

    Args:
        name: name of the table.
        rows: number of rows.
        columns: number of columns without the time.
    """
    return [
        name,
        "version=1",
        f"nRows={rows}",
        f"nColumns={columns + 1}",
        "inDegrees=no",
        "endheader",
        "\t".join(["time", *(f"column{column}" for column in range(columns))]),
    ]


def write_tables(folder: Path, size: int) -> tuple[int, int]:
    """Write tables into a folder.

    Args:
        folder: target folder.
        size: size of all tables together (bytes), which is reached or exceeded.

    Returns:
        Size (bytes) and number of the written files.
    """
    # The seed makes the files of all runs of this script equal.
    draw = Random(1)
    written = 0
    for number in count():
        if written >= size:
            return written, number
        kind = list(FORMATS)[number % len(FORMATS)]
        # The first table of each format is very large, with a tenth of all bytes.
        table_size = size // 10 if number < len(FORMATS) else draw.choice(USUAL_SIZES)
        text = format_table(kind, table_size, draw)
        (folder / f"{number:04d}_{kind}").write_text(text)
        written += len(text)
    raise AssertionError


def measure_validation(folder: Path) -> Usage:
    """Run `osimlite validate` on a folder, with a cache in that folder."""
    command = [sys.executable, "-m", "osimlite", "validate", str(folder), "--format", "concise"]
    environment = copy_user_environment() | {"XDG_CACHE_HOME": str(folder / ".cache")}
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", MEASURE_SCRIPT, *command],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    seconds = time.perf_counter() - start
    processor_seconds, memory, _ = map(float, done.stdout.split())
    # macOS reports bytes, Linux kilobytes.
    unit = 1e6 if sys.platform == "darwin" else 1e3
    return Usage(processor_seconds, seconds, memory / unit)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--megabytes", type=int, default=200, help="size of all tables, MB")
    parser.add_argument("--rounds", type=int, default=3, help="number of runs of each kind")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        # The configuration file makes the folder a project of its own.
        (folder / "osimlite.toml").write_text("")
        size, files = write_tables(folder, options.megabytes * 1_000_000)
        table = Table(
            title=f"{files} tables, {size / 1e6:.0f} MB of text",
            caption="medians; memory of one process",
        )
        for column in (
            "",
            "processor time (s)",
            "MB/s of one processor",
            "wall-clock time (s)",
            "peak memory (MB)",
        ):
            table.add_column(column, justify="right" if column else "left")
        # The order matters: the last first run writes the cache that the others use.
        for name in ("first run", "unchanged"):
            runs = []
            for _ in range(options.rounds):
                if name == "first run":
                    rmtree(folder / ".cache", ignore_errors=True)
                runs.append(measure_validation(folder))
            usage = Usage(*map(median, zip(*runs, strict=True)))
            table.add_row(
                name,
                f"{usage.processor_seconds:.2f}",
                f"{size / 1e6 / usage.processor_seconds:.0f}",
                f"{usage.seconds:.2f}",
                f"{usage.memory:.0f}",
            )
        Console().print(table)


if __name__ == "__main__":
    main()
