"""Postponement of interruptions by the keyboard."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def defer_sigint() -> Iterator[None]:
    """Postpone an interruption by the keyboard until the block ends.

    Code that must not stop half-way, such as a call of machine code that writes into shared arrays,
    runs in ``with defer_sigint():``. In other threads than the main one it does nothing, since
    Python delivers signals to the main thread only.

    Raises:
        KeyboardInterrupt: Ctrl-C was pressed within the block; raised at its end.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    # Several presses of Ctrl-C raise one exception.
    interruptions: list[object] = []
    previous_handler = signal.signal(
        signal.SIGINT, lambda *signal_arguments: interruptions.append(signal_arguments)
    )
    try:
        yield
    finally:
        # A handler that was not installed by Python is reported as None and cannot be restored.
        signal.signal(
            signal.SIGINT, signal.SIG_DFL if previous_handler is None else previous_handler
        )
    if interruptions:
        raise KeyboardInterrupt
