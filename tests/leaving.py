"""Fast end of a process that skips the finalization of the interpreter, which takes as long as many a command."""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
import threading


def leave(code: object) -> None:
    """End this process as `sys.exit` does, but do not destroy the objects of the interpreter.

    Registered exit functions run, threads are joined, and the buffers of Python and C are flushed.
    Destructors of remaining objects do not run. The full suite does not use this function, so that
    there processes end as usual.

    Args:
        code: argument of `SystemExit`.
    """
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    if not (code is None or isinstance(code, int)):
        print(code, file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)
    os._exit(int(code is not None) if not isinstance(code, int) else code & 0xFF)
