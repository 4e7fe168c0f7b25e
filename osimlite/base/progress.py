"""Progress of long work of the library, for programs that show it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from typing import Protocol, TypeVar

Listener = Callable[[str, float, float, str], object]
"""Function that receives what is done, how much of it is done, of how much, and the unit."""

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
    """Tell the listeners how far a piece of work is; without any this costs nothing.

    Args:
        title: what is done, such as "tracking the motion".
        done: how much is done.
        total: how much there is to do; 0 if that is unknown.
        unit: unit of the amounts, with a blank before it.
    """
    for listener in _listeners:
        listener(title, done, total, unit)


def report_stage(title: str) -> None:
    """Tell the listeners which work of unknown duration begins now.

    Args:
        title: what is done.
    """
    report_progress(title, 0.0, 0.0)


@contextmanager
def listen_to_progress(listener: Listener) -> Iterator[None]:
    """Call a function with all progress that is reported within the context."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


@contextmanager
def mute_progress() -> Iterator[None]:
    """Report nothing within the context: for the steps of work that reports its progress itself."""
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
        title: what is done.
        count: number of rows.
        unit: what the rows are, with a blank before it.

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
    """Yield items, and report how many are done.

    Args:
        title: what is done.
        items: the items.
        unit: what the items are, with a blank before it.
    """
    count = len(items)
    for number, item in enumerate(items, start=1):
        yield item
        report_progress(title, number, count, unit)
