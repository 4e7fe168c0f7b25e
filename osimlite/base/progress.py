"""Progress of long work of the library, for programs that show it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Listener = Callable[[str, float, float, str], object]
"""Function that receives what is done, how much of it is done, of how much, and the unit."""

_listeners: list[Listener] = []


def report_progress(title: str, done: float, total: float, unit: str = "") -> None:
    """Tell the listeners how far a piece of work is; without any this costs nothing.

    Args:
        title: what is done, such as "tracking the motion".
        done: how much is done.
        total: how much there is to do.
        unit: unit of the amounts, with a blank before it.
    """
    for listener in _listeners:
        listener(title, done, total, unit)


@contextmanager
def listen_to_progress(listener: Listener) -> Iterator[None]:
    """Call a function with all progress that is reported within the context."""
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)
