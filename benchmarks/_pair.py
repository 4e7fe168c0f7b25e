"""Fair timing of osimlite against OpenSim: both programs run in turn (A B A B ...).

The ratio of times is computed within each pair of runs and summarised afterwards. A slow second of
the machine then spoils one pair, not the result. A benchmark script needs one screen of code::

    from _pair import print_pairs, time_pair

    pair = time_pair("accuracy 1e-3", ours=run_ours, theirs=run_opensim, rounds=9)
    print_pairs("Simulation, 2 s", [pair])
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Pair:
    """Times of one comparison.

    Attributes:
        name: label of the comparison, the first cell of its row in a table.
        ours: times of osimlite (s), one for each round.
        theirs: times of OpenSim (s), in the same order.
    """

    name: str
    ours: tuple[float, ...]
    theirs: tuple[float, ...]

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratios of times, osimlite / OpenSim.

        Returns:
            One ratio for each round; below 1 osimlite is faster.
        """
        return tuple(a / b for a, b in zip(self.ours, self.theirs, strict=True))


def time_pair(
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
        name: label of the row in the table.
        ours: does the work with osimlite; its result is ignored.
        theirs: does the same work with OpenSim.
        rounds: number of timed pairs, at least 1.
        warmup: number of pairs that run before the timed ones; their times are ignored.
        clock: returns seconds that never decrease.

    Raises:
        ValueError: there is no round, or a negative warm-up.
    """
    if rounds < 1 or warmup < 0:
        raise ValueError(
            f"a pair needs at least 1 round and no negative warm-up, not {rounds} and {warmup}"
        )

    # The first runs fill caches of files, code and memory, which later runs find filled.
    times = [
        (measure_time(ours, clock), measure_time(theirs, clock)) for _ in range(warmup + rounds)
    ]
    counted = times[warmup:]
    return Pair(name, tuple(a for a, _ in counted), tuple(b for _, b in counted))


def measure_time(
    work: Callable[[], object], clock: Callable[[], float] = time.perf_counter
) -> float:
    """Return the time that a function takes by a clock (s)."""
    start = clock()
    work()
    return clock() - start


def time_command_pair(
    name: str,
    *,
    ours: str | Sequence[str],
    theirs: str | Sequence[str],
    rounds: int = 5,
    warmup: int = 1,
    clock: Callable[[], float] = time.perf_counter,
) -> Pair:
    """Time two commands in turn, each as a process from its start to its exit.

    A command is a list of arguments, or one line, which is split as a shell does. No shell runs.

    Args:
        name: label of the row in the table.
        ours: command that uses osimlite.
        theirs: command that does the same work with OpenSim.
        rounds: number of timed pairs, at least 1.
        warmup: number of pairs that run before the timed ones.
        clock: returns seconds that never decrease.

    Raises:
        RuntimeError: a command failed; the message ends with its standard error.
    """
    return time_pair(
        name,
        ours=lambda: run_command(ours),
        theirs=lambda: run_command(theirs),
        rounds=rounds,
        warmup=warmup,
        clock=clock,
    )


def run_command(command: str | Sequence[str]) -> None:
    """Run a command in a process of its own, without input, and ignore its output.

    Raises:
        RuntimeError: the command failed; the message ends with its standard error.
    """
    arguments = shlex.split(command) if isinstance(command, str) else list(command)
    process = subprocess.run(
        arguments,
        # A command that asks a question must not wait for an answer.
        stdin=subprocess.DEVNULL,
        # Printing to a terminal would take time.
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        env=copy_user_environment(),
        check=False,
    )
    if process.returncode != 0:
        message = process.stderr.decode(errors="replace").strip()
        raise RuntimeError(
            f"{shlex.join(arguments)} ended with exit code {process.returncode}: {message}"
        )


def copy_user_environment() -> dict[str, str]:
    """Return the environment variables of this process, without one that users do not set.

    With `PYTHONDONTWRITEBYTECODE`, Python compiles every module again in every process.
    """
    return {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}


def use_one_blas_thread() -> None:
    """Start the running script again with one thread of OpenBLAS, as the command `osimlite` does.

    Scripts that measure processor time call this first. On a busy machine, threads of OpenBLAS that
    wait for each other use up to twenty times the processor time of the work.
    """
    if "OPENBLAS_NUM_THREADS" not in os.environ:
        # OpenBLAS reads the variable when it is loaded, which numpy has done already.
        os.environ["OPENBLAS_NUM_THREADS"] = "1"
        os.execv(sys.executable, sys.orig_argv)


def run_script(script: str, *arguments: str) -> str:
    """Run a Python script in a process of its own, and return the last line that it prints.

    Args:
        script: text of the script.
        *arguments: its arguments.

    Raises:
        subprocess.CalledProcessError: the script fails.
    """
    process = subprocess.run(
        [sys.executable, "-c", script, *arguments], capture_output=True, text=True, check=True
    )
    # Libraries may print messages before.
    return process.stdout.splitlines()[-1]


def print_pairs(title: str, pairs: Iterable[Pair], *, console: Console | None = None) -> None:
    """Print a table of comparisons.

    Each program has its least and its median time. The median, least and greatest ratio are those
    of the pairs of runs.

    Args:
        title: title of the table.
        pairs: rows of the table.
        console: where to print; the terminal by default.
    """
    table = Table(
        title=title,
        caption="times in ms, least / median; ratio = osimlite / OpenSim of each pair of runs",
    )
    table.add_column("")
    for heading in ("osimlite", "OpenSim", "ratio", "least", "greatest", "pairs"):
        table.add_column(heading, justify="right")
    for pair in pairs:
        ratios = pair.ratios
        # The median of the ratios is not the ratio of the medians: see the head of the module.
        summary = (median(ratios), min(ratios), max(ratios))
        table.add_row(
            pair.name,
            _format_milliseconds(pair.ours),
            _format_milliseconds(pair.theirs),
            *(_format_ratio(value) for value in summary),
            str(len(ratios)),
        )
    (console or Console()).print(table)


def _format_ratio(value: float) -> str:
    return f"{value:.2f}" if value >= 0.1 else f"{value:.2g}"


def _format_milliseconds(times: Sequence[float]) -> str:
    return f"{min(times) * 1e3:.4g} / {median(times) * 1e3:.4g}"
