"""Checking tables: `osimlite validate` over a folder of motions, loads and markers, unknown and then unchanged.

    python benchmarks/tables.py [--megabytes N] [--rounds N]

Many files of usual sizes and a few huge ones, as OpenSim and motion capture programs write them.
OpenSim has no check to compare with. Seconds are those of the processor, so that other work on the
machine counts little.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from itertools import count, cycle
from pathlib import Path
from random import Random
from shutil import rmtree
from statistics import median

from rich.console import Console
from rich.table import Table

KINDS = {
    "results.sto": ("%.8f", "\t", 60),
    "states.sto": ("%.17g", "\t", 60),
    "coordinates.mot": ("%16.8f", "\t", 40),
    "loads.mot": ("%.6f", " ", 19),
    "markers.trc": ("%.5f", "\t", 120),
}
"""What is written, by the end of its name: the form of its numbers, what stands between them, how many there are."""


def text_of(kind: str, size: int, draw: Random) -> str:
    """A table of about so many bytes."""
    form, separator, columns = KINDS[kind]
    bodies = [
        separator.join(form % draw.gauss(0.0, 300.0) for _ in range(columns)) for _ in range(200)
    ]
    rows = max(1, size // len(bodies[0]))
    if kind.endswith(".trc"):
        markers = range(1, columns // 3 + 1)
        keys = "DataRate CameraRate NumFrames NumMarkers Units OrigDataRate OrigDataStartFrame OrigNumFrames"
        header = [
            f"PathFileType\t4\t(X/Y/Z)\t{kind}",
            keys.replace(" ", "\t"),
            f"100\t100\t{rows}\t{len(markers)}\tmm\t100\t1\t{rows}",
            "Frame#\tTime\t" + "".join(f"marker{marker}\t\t\t" for marker in markers),
            "\t\t" + "".join(f"X{marker}\tY{marker}\tZ{marker}\t" for marker in markers),
            "",
        ]
        starts = (f"{row + 1}\t{row / 100:.3f}\t" for row in range(rows))
    else:
        header = [
            kind,
            "version=1",
            f"nRows={rows}",
            f"nColumns={columns + 1}",
            "inDegrees=no",
            "endheader",
        ]
        header.append("\t".join(["time", *(f"column{column}" for column in range(columns))]))
        starts = (form % (row / 1000) + separator for row in range(rows))
    return "\n".join(
        [*header, *(start + body for start, body in zip(starts, cycle(bodies), strict=False)), ""]
    )


def fill(folder: Path, size: int) -> tuple[int, int]:
    """Write tables until they have so many bytes; how many bytes and files there are."""
    draw = Random(1)
    written = 0
    for number in count():
        if written >= size:
            return written, number
        kind = list(KINDS)[number % len(KINDS)]
        # One table of each kind has a tenth of all bytes.
        text = text_of(
            kind,
            size // 10 if number < len(KINDS) else draw.choice([50_000, 500_000, 3_000_000]),
            draw,
        )
        (folder / f"{number:04d}_{kind}").write_text(text)
        written += len(text)
    raise AssertionError


def validated(folder: Path) -> tuple[float, float, float]:
    """Seconds of the processor and of the clock, and the greatest memory (MB) of the process and those it started."""
    code = (
        "import resource, subprocess, sys; done = subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL);"
        "used = resource.getrusage(resource.RUSAGE_CHILDREN);"
        "print(used.ru_utime + used.ru_stime, used.ru_maxrss, done.returncode)"
    )
    command = [sys.executable, "-m", "osimlite", "validate", str(folder), "--format", "concise"]
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    environment["XDG_CACHE_HOME"] = str(folder / ".cache")
    start = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", code, *command],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    used, memory, _ = map(float, done.stdout.split())
    return used, time.perf_counter() - start, memory / (1e6 if sys.platform == "darwin" else 1e3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--megabytes", type=int, default=200)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "osimlite.toml").write_text("")
        size, files = fill(folder, options.megabytes * 1_000_000)
        table = Table(
            title=f"{files} tables, {size / 1e6:.0f} MB of text",
            caption="medians; memory of one process",
        )
        for column in (
            "",
            "processor (s)",
            "MB/s of one processor",
            "clock (s)",
            "peak memory (MB)",
        ):
            table.add_column(column, justify="right" if column else "left")
        for name in ("first run", "unchanged"):
            runs = []
            for _ in range(options.rounds):
                if name == "first run":
                    rmtree(folder / ".cache", ignore_errors=True)
                runs.append(validated(folder))
            used, clock, memory = map(median, zip(*runs, strict=True))
            table.add_row(
                name, f"{used:.2f}", f"{size / 1e6 / used:.0f}", f"{clock:.2f}", f"{memory:.0f}"
            )
        Console().print(table)


if __name__ == "__main__":
    main()
