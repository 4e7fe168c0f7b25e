"""The end of a process without the end of its interpreter, which takes as long as many a command."""

from __future__ import annotations

import atexit
import ctypes
import os
import sys
import threading


def leave(code: object) -> None:
    """End this process as `sys.exit` does, but leave the objects of the interpreter to the operating system.

    What is registered for the end is called, threads are waited for, and what Python and C have to
    write is written. Destructors of what is left are not called: the full suite, and the processes
    that tests start otherwise, end as Python does.

    Args:
        code: that of `SystemExit`.
    """
    threading._shutdown()  # type: ignore[attr-defined]
    atexit._run_exitfuncs()
    if not (code is None or isinstance(code, int)):
        print(code, file=sys.stderr)
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)
    os._exit(int(code is not None) if not isinstance(code, int) else code & 0xFF)
