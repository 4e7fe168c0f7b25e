"""Fair timing of osimlite against OpenSim: the two run in turn (A B A B ...) and meet the same machine.

A ratio is taken inside each pair and summarised after; a slow second of the machine spoils one
pair, not the result. A benchmark script is then one screen::

    from _pair import pair, report

    report("Simulation, 2 s", [pair("accuracy 1e-3", ours=run_ours, theirs=run_opensim, rounds=9)])
"""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Pair:
    """Times of one comparison, both lists in seconds and in the order of the rounds."""

    name: str
    ours: tuple[float, ...]
    theirs: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """Our time over OpenSim's, one per round; below 1 we are faster."""
        return tuple(a / b for a, b in zip(self.ours, self.theirs, strict=True))


def pair(
    name: str,
    *,
    ours: Callable[[], object],
    theirs: Callable[[], object],
    rounds: int = 9,
    warmup: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> Pair:
    """Time two callables in turn within this process.

    Args:
        name: the row's name in the table.
        ours: does the work with osimlite; what it returns is dropped.
        theirs: does the same work with OpenSim.
        rounds: number of timed pairs, at least 1.
        warmup: pairs run before the timed ones, their times dropped.
        clock: seconds that only grow.
    """
    if rounds < 1 or warmup < 0:
        raise ValueError(
            f"a pair needs at least 1 round and no negative warm-up, not {rounds} and {warmup}"
        )

    def timed(work: Callable[[], object]) -> float:
        start = clock()
        work()
        return clock() - start

    times = [(timed(ours), timed(theirs)) for _ in range(warmup + rounds)][warmup:]
    return Pair(name, tuple(a for a, _ in times), tuple(b for _, b in times))


def pair_commands(
    name: str,
    *,
    ours: str | Sequence[str],
    theirs: str | Sequence[str],
    rounds: int = 5,
    warmup: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> Pair:
    """Time two commands in turn, each a whole process from start to exit.

    A command is a list of arguments, or one line split as a shell would split it (no shell runs).

    Raises:
        RuntimeError: a command failed; the message ends with what it wrote to standard error.
    """
    return pair(
        name,
        ours=lambda: _run(ours),
        theirs=lambda: _run(theirs),
        rounds=rounds,
        warmup=warmup,
        clock=clock,
    )


def _run(command: str | Sequence[str]) -> None:
    arguments = shlex.split(command) if isinstance(command, str) else list(command)
    # With this variable Python compiles every module again in every process, which users do not
    # have.
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    done = subprocess.run(
        arguments,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env=environment,
        check=False,
    )
    if done.returncode != 0:
        said = done.stderr.decode(errors="replace").strip()
        raise RuntimeError(
            f"{shlex.join(arguments)} ended with exit code {done.returncode}: {said}"
        )


def report(title: str, pairs: Iterable[Pair], *, console: Console | None = None) -> None:
    """Print the table: least and median time of each side; median, least and greatest ratio per pair."""
    table = Table(
        title=title, caption="time in ms, least / median; ratio = ours / OpenSim, per pair"
    )
    table.add_column("")
    for column in ("osimlite", "OpenSim", "ratio", "least", "greatest", "pairs"):
        table.add_column(column, justify="right")
    for row in pairs:
        ratios = row.ratios
        table.add_row(
            row.name,
            _milliseconds(row.ours),
            _milliseconds(row.theirs),
            *(_ratio(value) for value in (median(ratios), min(ratios), max(ratios))),
            str(len(ratios)),
        )
    (console or Console()).print(table)


def _ratio(value: float) -> str:
    return f"{value:.2f}" if value >= 0.1 else f"{value:.2g}"


def _milliseconds(times: Sequence[float]) -> str:
    return f"{min(times) * 1e3:.4g} / {median(times) * 1e3:.4g}"
