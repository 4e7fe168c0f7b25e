"""Interruptions by the keyboard that have to wait."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def defer_sigint() -> Iterator[None]:
    """Put off an interruption by the keyboard until what is within is done."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interruptions: list[object] = []
    before = signal.signal(signal.SIGINT, lambda *told: interruptions.append(told))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
    if interruptions:
        raise KeyboardInterrupt
