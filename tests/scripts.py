"""Scripts in processes of their own that start in a moment: copies of a process that has imported the large libraries.

OpenSim and CasADi take most of a second to import, and cannot be in one process. A test that needs
one of them in a process of its own calls `run_script`. As a program, this module is the process
that is copied:

    python -m tests.scripts OUTPUT ERRORS MODULE...    the numbers of the files that scripts write

A line of JSON asks for a script: its text, its arguments, its folder, its environment. The answers
are the number of its process, and its exit code.
"""

from __future__ import annotations

import atexit
import gc
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from tests.leaving import leave
from tests.suite import is_full

ROOT = Path(__file__).resolve().parent.parent
OPENSIM = ("opensim",)
CASADI = ("casadi", "osimlite.moco", "osimlite.optimal.program")


def run_script(
    script: str,
    *words: object,
    folder: Path | None = None,
    timeout: float = 300.0,
    check: bool = True,
    modules: tuple[str, ...] = OPENSIM,
) -> subprocess.CompletedProcess[str]:
    """Run Python code in a process of its own.

    Args:
        script: the code.
        words: its arguments.
        folder: its working folder; by default the present one.
        timeout: time by the clock after which it is killed, s.
        check: whether a script that fails is an error.
        modules: what is imported already when it starts.

    Returns:
        Its exit code, output and errors.

    Raises:
        TimeoutExpired: it takes longer than `timeout`.
        CalledProcessError: it fails, and `check` is true.
    """
    arguments, where = [str(word) for word in words], str(folder or Path.cwd())
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(_paths())}
    if not hasattr(os, "fork"):
        return subprocess.run(
            [sys.executable, "-W", "ignore", "-c", script, *arguments],
            cwd=where, env=environment, capture_output=True, text=True, timeout=timeout, check=check,
        )  # fmt: skip
    server, files = _server(modules)
    for file in files:
        file.seek(0)
        file.truncate()
    order: dict[str, object] = {
        "script": script, "words": arguments, "folder": where, "environment": environment,
        # The full suite sees what Python and libraries say as they end.
        "ends": is_full(),
    }  # fmt: skip
    server.stdin.write(json.dumps(order) + "\n")
    timer = threading.Timer(timeout, _kill, [int(server.stdout.readline())])
    timer.start()
    code = int(server.stdout.readline())
    timed_out = not timer.is_alive()
    timer.cancel()
    out, err = (
        os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode(errors="replace")
        for file in files
    )
    if timed_out:
        raise subprocess.TimeoutExpired(script, timeout, out, err)
    if check and code:
        error = subprocess.CalledProcessError(code, script, out, err)
        error.add_note(err[-4000:])
        raise error
    return subprocess.CompletedProcess(script, code, out, err)


def _kill(process: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGKILL)


def _paths() -> list[str]:
    return [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]


@cache
def _server(modules: tuple[str, ...]) -> tuple[Any, list[Any]]:
    """Return the process that is copied, and the files that its copies write."""
    files = [tempfile.TemporaryFile(buffering=0) for _ in range(2)]  # noqa: SIM115
    numbers = [file.fileno() for file in files]
    command = [sys.executable, "-W", "ignore", "-m", "tests.scripts", *map(str, numbers), *modules]
    server = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1, pass_fds=numbers,
        cwd=ROOT, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    atexit.register(_stop, server, files)
    return server, files


def _stop(server: Any, files: list[Any]) -> None:
    """End the process, and close what this one has open for it."""
    with server:
        server.stdin.close()
    for file in files:
        file.close()


def become_one() -> tuple[str, bool]:
    """Wait for orders, and return the script in a process that is to run it, and whether its interpreter shall end.

    Raises:
        SystemExit: no more orders come.
    """
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # Collections of garbage would copy the pages of all that is imported.
    gc.freeze()
    for line in sys.stdin:
        order: dict[str, Any] = json.loads(line)
        child = os.fork()
        if not child:
            for number, own in enumerate(map(int, sys.argv[1:3]), 1):
                os.dup2(own, number)
            os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
            os.environ.clear()
            os.environ.update(order["environment"])
            os.chdir(order["folder"])
            sys.path[0] = ""
            sys.argv = ["-c", *order["words"]]
            return order["script"], order["ends"]
        print(child, file=answers, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), file=answers, flush=True)
    raise SystemExit


if __name__ == "__main__":
    # The imports put folders into the paths of programs and libraries, which is of no use here.
    for name in sys.argv[3:]:
        import_module(name)
    text, ends = become_one()
    code: object = None
    try:
        exec(compile(text, "<script>", "exec"), {"__name__": "__main__"})
    except SystemExit as ended:
        if ends:
            raise
        code = ended.code
    if not ends:
        leave(code)
