"""A progress bar that long work shows on a terminal."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console


@contextmanager
def progress_bar(console: Console, title: str, total: float | None) -> Iterator[Callable[..., None]]:
    """A progress bar that shows up on a terminal once the work has taken a second."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    started = time.perf_counter()
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"), TimeRemainingColumn(),
        console=console, transient=True,
    )  # fmt: skip
    task = bar.add_task(title, total=total)
    is_shown = False

    def advance(done: float, of: float | None = None) -> None:
        nonlocal is_shown
        if not console.is_terminal:
            return
        if not is_shown and time.perf_counter() - started > 1.0:
            bar.start()
            is_shown = True
        if is_shown:
            bar.update(task, completed=done, total=total if of is None else of)

    try:
        yield advance
    finally:
        if is_shown:
            bar.stop()
