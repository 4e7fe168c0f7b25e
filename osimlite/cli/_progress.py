"""Progress bars for slow work on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from osimlite.base.text import escape_unprintable
from osimlite.cli._console import complain, create_console, get_raw_stream

if TYPE_CHECKING:
    from rich.progress import Progress


@contextmanager
def progress_bar(title: str, total: float | None) -> Iterator[Callable[..., None]]:
    """Show a progress bar on standard error, in a terminal only, after the first second of work.

    What is yielded takes how much is done, of how much if that has become known, and what tells
    more of it, which takes how much is done in a second. The library that draws the bar is loaded
    when it first shows. It has no thread of its
    own: processes may be started beside it.
    """
    is_terminal = sys.stderr.isatty()
    due = time.monotonic() + 1.0
    bar: Progress | None = None

    def advance(
        done: float, of: float | None = None, more: Callable[[float], str] | None = None
    ) -> None:
        nonlocal bar, due
        if not is_terminal or (now := time.monotonic()) < due:
            return
        due = now + 0.1
        if bar is None:
            bar = _start_bar(title)
        bar.update(bar.task_ids[0], completed=done, total=total if of is None else of)
        if more is not None:
            bar.update(bar.task_ids[0], more=more(bar.tasks[0].speed or 0.0))
        bar.refresh()

    try:
        yield advance
    finally:
        if bar is not None:
            bar.stop()


@contextmanager
def motion_bar(title: str, to: float) -> Iterator[Callable[[float, float], None]]:
    """A progress bar for a motion up to a time (s).

    What is yielded takes the time reached and the length of the steps, s.
    """
    with progress_bar(title, to) as advance:
        yield lambda t, step: advance(
            t, None, lambda rate: f"{t:.6g} s, steps of {step:.2g} s, {rate:.2g} s in a second"
        )


@contextmanager
def progress_bars() -> Iterator[Callable[[str, float, float], None]]:
    """Progress bars for work in stages, one after the other.

    What is yielded takes what is being done, how much of it is, and of how much.
    """
    current: str | None = None
    advance: Callable[..., None] = _ignore_progress
    with ExitStack() as bars:

        def tell(title: str, done: float, of: float) -> None:
            nonlocal current, advance
            if title != current:
                bars.close()
                current, advance = title, bars.enter_context(progress_bar(title, of))
            advance(done, of)

        yield tell


def show_engine_warnings() -> None:
    """Print the warnings of the engine: kernels run as Python, or compiled code cannot be cached."""
    import logging

    class WarningPrinter(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            complain(record.getMessage())

    logging.getLogger("osimlite.simulation.engines").addHandler(WarningPrinter())


def _ignore_progress(*_: float) -> None:
    """Ignore progress that is reported before the first bar exists."""


def _start_bar(title: str) -> Progress:
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[more]}", markup=False),
    )
    bar = Progress(
        *columns,
        console=create_console(file=get_raw_stream(sys.stderr)),
        transient=True,
        auto_refresh=False,
    )
    bar.add_task(escape_unprintable(title), total=None, more="")
    bar.start()
    return bar
