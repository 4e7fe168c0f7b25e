"""Progress of long work of the library, for programs that show it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import Protocol, TypeVar

Listener = Callable[[str, float, float, str], object]
"""Function that receives the name of the work, the finished and the total amount, and the unit."""

FIRST_ROWS = 8
"""Number of rows in the first call of a kernel, whose speed is unknown."""
CALL_S = 0.1
"""Approximate duration of a call of a kernel, s; progress and Ctrl-C wait for its end."""
MAX_GROWTH = 8
"""Largest ratio of the rows in a call to those in the call before."""

_T = TypeVar("_T", covariant=True)
_listeners: list[Listener] = []
"""Functions that receive all progress."""


class SizedIterable(Sized, Iterable[_T], Protocol[_T]):
    """Items that can be counted before they are iterated over."""


def report_progress(title: str, done: float, total: float, unit: str = "") -> None:
    """Report the finished amount of some work to the listeners; without any this costs nothing.

    Args:
        title: name of the work, such as "tracking the motion".
        done: finished amount, in `unit`.
        total: total amount, in `unit`; 0 if it is unknown.
        unit: unit of the amounts, with a blank before it.
    """
    for listener in _listeners:
        listener(title, done, total, unit)


def report_stage(title: str) -> None:
    """Report to the listeners that work of unknown duration begins.

    Args:
        title: name of the work, such as "building the model".
    """
    report_progress(title, 0.0, 0.0)


@contextmanager
def listen_to_progress(listener: Listener) -> Iterator[None]:
    """Call a function with all progress reports within the context."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def mute_progress() -> Iterator[None]:
    """Suppress reports within the context, for steps of work that reports its progress itself."""
    listeners = _listeners[:]
    _listeners.clear()
    try:
        yield
    finally:
        _listeners[:] = listeners


def divide_rows(title: str, count: int, unit: str = " frames") -> Iterator[slice]:
    """Yield consecutive slices of rows for calls of a kernel, and report the number of finished rows.

    Kernels cannot be interrupted and report nothing. The number of rows in a slice follows from the
    duration of the call before, so that each call takes about `CALL_S`.

    Args:
        title: name of the work.
        count: number of rows.
        unit: name of the rows in the plural, with a blank before it.

    Yields:
        Slices that cover all rows; one empty slice if there is no row.
    """
    start, size = 0, FIRST_ROWS
    while True:
        end = min(count, start + size)
        before = time.perf_counter()
        yield slice(start, end)
        # Single rows are parts of other work, which reports itself.
        if count > FIRST_ROWS:
            report_progress(title, end, count, unit)
        if end == count:
            return
        duration = max(time.perf_counter() - before, 1e-6)
        size = max(1, min(MAX_GROWTH * size, int(size * CALL_S / duration)))
        start = end


def watch_items(title: str, items: SizedIterable[_T], unit: str = " frames") -> Iterator[_T]:
    """Yield items, and report the number of finished ones after each.

    Args:
        title: name of the work.
        items: items with a known count.
        unit: name of the items in the plural, with a blank before it.
    """
    count = len(items)
    for number, item in enumerate(items, start=1):
        yield item
        report_progress(title, number, count, unit)
