"""Progress line at the terminal: current work, finished amount, and time left."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

from osimlite.base.text import escape_unprintable
from osimlite.cli._console import complain, count_columns, get_raw_stream, set_output_hook

SILENT_S = 0.5
"""Time without any output after which the line appears, s."""
FIRST_SILENT_S = 0.15
"""Time without output before the first line of a command, s: starting Python took the rest."""
REDRAW_S = 0.1
"""Time between two states of the line, s."""
ESTIMATE_S = 1.0
"""Duration of work from which on the time left is estimated, s."""
LONG_S = 10.0
"""Duration of work from which on logs and pipes show its progress once, and its end, s."""

INTERACTIVE = ("lsp",)
"""Commands that only wait for editors."""

ACTIVITIES = {
    "build": "building",
    "check-trial": "checking",
    "convert": "converting",
    "demo": "building and simulating the examples",
    "diff": "comparing",
    "doctor": "looking at packages",
    "find-gait": "searching",
    "fit": "fitting",
    "format": "formatting",
    "gait": "analysing the gait",
    "ik": "fitting the motion",
    "info": "reading",
    "inverse-dynamics": "computing moments",
    "kinematics": "computing positions",
    "modify": "modifying",
    "muscles": "computing muscles",
    "optimize": "searching",
    "run": "running",
    "scale": "scaling",
    "scone": "walking",
    "simulate": "simulating",
    "static-optimization": "computing muscle forces",
    "sweep": "sweeping",
    "translate": "translating",
    "upgrade": "upgrading",
    "validate": "checking",
    "view": "preparing the picture",
}
"""Descriptions of the work of commands until they report more."""


class _Task:
    """Work of known or unknown length.

    Attributes:
        title: name of the work.
        total: total amount, in `unit`; None if it is unknown.
        unit: unit of the amounts, with a blank before it.
        done: finished amount, in `unit`.
        details: further words about the state of the work.
        part: part of the work on which the library reports now; None without any.
        stage: latest part of unknown length that the library has reported; None without any.
    """

    def __init__(self, title: str, total: float | None, unit: str = "") -> None:
        self.title, self.total, self.unit = title, total, unit
        self.started = time.monotonic()
        self.done = 0.0
        self.details = ""
        self.is_announced = False
        self.part: _Task | None = None
        self.stage: _Task | None = None

    def receive(self, title: str, done: float, total: float, unit: str) -> None:
        """Record the progress of a part of the task that the library reports."""
        if self.part is None or title != self.part.title or done < self.part.done:
            self.part = _Task(title, total, unit)
        self.part.done, self.part.total, self.part.unit = float(done), total, unit
        if total == 0.0:
            self.stage = self.part
        # After a finished part, the stage that it belongs to continues.
        if 0.0 < total <= done:
            self.part = self.stage

    def describe(self, now: float) -> str:
        """Return the name of the task, its progress, and the time left."""
        if self.part is not None:
            description = self.part.describe(now)
            is_one_of_many = self.total is not None and self.total > 1.0
            return escape_unprintable(
                f"{self.title}, {_format(self.done)} of {_format(self.total or 0.0)} done; {description}"
                if is_one_of_many
                else description
            )
        elapsed = now - self.started
        details = []
        # With a total of 1, `done` is a fraction of the work. It has no unit, and a fraction of 0
        # would not show how much work there is.
        counts_items = self.total != 1.0
        if self.total and (self.done or counts_items):
            fraction = min(1.0, self.done / self.total)
            amount = f" ({_format(self.done)} of {_format(self.total)}{self.unit})"
            details += [f"{100.0 * fraction:.0f} %{amount if counts_items else ''}"]
            if self.details:
                details.append(self.details)
            if elapsed > ESTIMATE_S and fraction < 1.0:
                details.append(
                    f"{_format_duration(elapsed * (1.0 - fraction) / fraction)} left"
                    if fraction
                    else _format_duration(elapsed)
                )
        else:
            details += [description for description in (self.details,) if description]
            if elapsed > ESTIMATE_S:
                details.append(_format_duration(elapsed))
        return escape_unprintable(f"{self.title}: {', '.join(details)}" if details else self.title)


def _format(amount: float) -> str:
    """Return an amount with at most four digits, integers with all."""
    return f"{amount:.0f}" if float(amount).is_integer() else f"{amount:.4g}"


def _format_duration(seconds: float) -> str:
    """Return a duration in words."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"


class ProgressLine:
    """The line on standard error; it is erased before anything else is printed."""

    def __init__(self) -> None:
        # Innermost task last; the line shows that one.
        self.tasks: list[_Task] = []
        # Number of characters on the line now.
        self._drawn_width = 0
        self._last_output = time.monotonic()
        self._last_drawn = 0.0
        # Re-entrant: what is printed while the line is erased erases it again.
        self._lock = threading.RLock()
        self._thread: threading.Thread | None = None

    def receive(self, title: str, done: float, total: float, unit: str) -> None:
        """Record the progress of the current task that the library reports."""
        if self.tasks:
            self.tasks[-1].receive(title, done, total, unit)
            self.update(self.tasks[-1])

    def update(self, task: _Task) -> None:
        """Show a task that has changed; in a log or a pipe, once and only if it takes long."""
        if self.is_terminal():
            self.draw()
            return
        now = time.monotonic()
        if not task.is_announced and now - task.started > LONG_S:
            task.is_announced = True
            complain(task.describe(now))

    def is_terminal(self) -> bool:
        """Return whether standard error is a terminal that can erase a line."""
        # A "dumb" terminal has no carriage return that overwrites.
        return bool(sys.stderr and sys.stderr.isatty()) and os.environ.get("TERM") != "dumb"

    def start(self) -> None:
        """Redraw the line in the background, while the program computes."""
        if self._thread is None and self.is_terminal():
            set_output_hook(self.make_way)
            if hasattr(os, "register_at_fork"):
                # A child has the line of its parent, but not the thread.
                os.register_at_fork(after_in_child=self.abandon)
            # A daemon thread does not keep the program alive.
            self._thread = threading.Thread(target=self._redraw, daemon=True)
            self._thread.start()

    def abandon(self) -> None:
        """Never draw again, in a process that another has started."""
        self.tasks, self._drawn_width = [], 0
        # The lock of the parent may be held by a thread that the child does not have.
        self._lock = threading.RLock()
        set_output_hook(None)

    def _redraw(self) -> None:
        while True:
            time.sleep(REDRAW_S)
            self.draw()

    def draw(self) -> None:
        """Show the current task if nothing was printed for a while."""
        # Skip the update rather than wait: text that another thread prints is more important.
        if not self._lock.acquire(blocking=False):
            return
        try:
            now = time.monotonic()
            is_overdue = now - self._last_output >= SILENT_S and now - self._last_drawn >= REDRAW_S
            if self.tasks and is_overdue and self.is_terminal():
                self._last_drawn = now
                # One column less than the terminal has, which would break the line.
                text = self.tasks[-1].describe(now)[: max(1, count_columns() - 1)]
                # Padding with blanks overwrites the rest of a longer line.
                self._write(f"\r{text:{self._drawn_width}}")
                # The cursor, and ^C with it, stands behind the blanks of a longer line.
                self._drawn_width = max(self._drawn_width, len(text))
        finally:
            self._lock.release()

    def hasten(self) -> None:
        """Show the line of a command that has just started earlier than other lines."""
        self._last_output = time.monotonic() - (SILENT_S - FIRST_SILENT_S)

    def make_way(self) -> None:
        """Remove the line, since something else is printed."""
        self._last_output = time.monotonic()
        self.erase()

    def erase(self) -> None:
        """Overwrite the line with blanks, and what the terminal wrote behind it."""
        with self._lock:
            if self._drawn_width:
                # Terminals write ^C for Ctrl-C behind the line.
                width = min(self._drawn_width + len("^C"), count_columns())
                self._write(f"\r{'':{width}}\r")
                self._drawn_width = 0

    def _write(self, text: str) -> None:
        # The terminal may be closed; progress is no reason to fail.
        with contextlib.suppress(OSError, ValueError):
            stream = get_raw_stream(sys.stderr)
            stream.write(text)
            stream.flush()


progress_line = ProgressLine()
listeners = ExitStack()
"""Listeners of the command."""
_is_listening = False
"""Whether reports of the library are passed on."""


def watch_command(name: str) -> None:
    """Show the progress of a command while it prints nothing, at a terminal only."""
    if name not in INTERACTIVE:
        progress_line.tasks.append(_Task(ACTIVITIES.get(name, "working"), None))
        progress_line.hasten()
        listeners.enter_context(_listen())
        progress_line.start()


@contextmanager
def _listen() -> Iterator[None]:
    """Pass reports of the library to the current task, once even if contexts are nested."""
    global _is_listening
    if _is_listening:
        yield
        return
    from osimlite.base.progress import listen_to_progress

    _is_listening = True
    try:
        with listen_to_progress(progress_line.receive):
            yield
    finally:
        _is_listening = False


def finish_command() -> None:
    """Remove the line at the end of the program, or when it only waits for people."""
    listeners.close()
    progress_line.tasks.clear()
    progress_line.erase()


@contextmanager
def progress_bar(title: str, total: float | None, unit: str = "") -> Iterator[Callable[..., None]]:
    """Show current work, progress and the time left in a line on standard error.

    At a terminal the line appears after half a second. In a log or a pipe, long work prints its
    progress once, and a line when it is finished.

    Args:
        title: name of the work.
        total: total amount, in `unit`; None if it is unknown.
        unit: unit of the amounts, with a blank before it.

    Yields:
        Function of the finished amount, the total amount (if it has become known), and details: a
        text, or a function that returns it for the amount finished per second.
    """
    task = _Task(title, total, unit)
    progress_line.tasks.append(task)

    def advance(done: float, of: float | None = None, more: Any = None) -> None:
        task.done = float(done)
        if of is not None:
            task.total = of
        now = time.monotonic()
        if more is not None:
            elapsed = max(now - task.started, 1e-9)
            # A function of the rate is called here, where the rate is known.
            task.details = more(task.done / elapsed) if callable(more) else str(more)
        # Reports of the library on the finished item do not belong to the next one.
        task.part = task.stage = None
        progress_line.update(task)

    try:
        with _listen():
            yield advance
    finally:
        # `watch_command` may have removed all tasks at the end of the program.
        if task in progress_line.tasks:
            progress_line.tasks.remove(task)
        progress_line.erase()
    if task.is_announced:
        complain(f"{title}: finished in {_format_duration(time.monotonic() - task.started)}")


@contextmanager
def motion_bar(title: str, end_time: float) -> Iterator[Callable[[float, float], None]]:
    """Show the progress of a motion up to a time (s).

    Yields:
        Function of the time reached and the length of the steps, s.
    """
    with progress_bar(title, end_time, " s") as advance:
        yield lambda t, step: advance(t, None, f"steps of {step:.2g} s")


@contextmanager
def progress_bars() -> Iterator[Callable[[str, float, float], None]]:
    """Show the progress of work in stages, one after the other.

    Yields:
        Function of the name of the work, the finished amount and the total amount.
    """
    current: str | None = None
    advance: Callable[..., None] = _ignore_progress
    with ExitStack() as bars:

        def report_stage(title: str, done: float, of: float) -> None:
            nonlocal current, advance
            if title != current:
                bars.close()
                current = title
                advance = bars.enter_context(progress_bar(title, of))
            advance(done, of)

        yield report_stage


def show_engine_warnings() -> None:
    """Show warnings of the engine, and a message while it compiles."""
    import logging

    class ProgressHandler(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            if record.levelno >= logging.WARNING:
                complain(record.getMessage())
            # Compiling takes seconds on the first run, which people should not take for the
            # simulation.
            elif progress_line.tasks:
                message = record.getMessage()
                is_finished = not message.startswith("compiling")
                progress_line.tasks[-1].details = (
                    "" if is_finished else f"{message} (once per machine)"
                )

    log = logging.getLogger("osimlite.simulation.engines")
    log.addHandler(ProgressHandler())
    log.setLevel(logging.INFO)


def _ignore_progress(*_: float) -> None:
    """Report nothing before the first stage."""
