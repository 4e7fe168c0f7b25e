"""Scripts in separate processes that start quickly, as forks of a process that has imported what they need.

OpenSim, CasADi and the commands of osimlite each take most of a second to import, and OpenSim and
CasADi cannot be in one process. A test that needs one of them in a separate process calls
`run_script`. As a program, this module is the server process that forks:

    python -m tests.scripts INPUT OUTPUT ERRORS MODULE...

The first three arguments are descriptors of the files that scripts use as standard streams. Each
order is a line of JSON with the text, the arguments, the folder and the environment of a script.
The server answers with the process id of the script and, at its end, with the exit code.
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
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from tests.leaving import leave
from tests.suite import is_full

ROOT = Path(__file__).resolve().parent.parent
# Modules that scripts need, for `modules` of `run_script`.
OPENSIM = ("opensim",)
CASADI = ("casadi", "osimlite.moco", "osimlite.optimal.program")
QUIET = ("-W", "ignore")
"""Options of Python for scripts that import OpenSim or CasADi, whose bindings issue warnings."""


def run_script(
    script: str,
    *words: object,
    program: str = "-c",
    text: str = "",
    folder: Path | None = None,
    settings: Mapping[str, str] | None = None,
    timeout: float = 300.0,
    check: bool = True,
    modules: tuple[str, ...] = OPENSIM,
    options: tuple[str, ...] = QUIET,
) -> subprocess.CompletedProcess[str]:
    """Run Python code in a separate process.

    Args:
        script: the code.
        words: arguments of the script.
        program: name of the script, `sys.argv[0]`.
        text: standard input.
        folder: working folder; by default the current one.
        settings: environment variables that are added to those of this process.
        timeout: wall-clock time after which the script is killed (s).
        check: whether a script that fails is an error.
        modules: modules that are already imported when the script starts.
        options: options of Python.

    Returns:
        Exit code, output and errors of the script.

    Raises:
        TimeoutExpired: the script takes longer than `timeout`.
        CalledProcessError: the script fails, and `check` is true.
    """
    arguments = [str(word) for word in words]
    where = str(folder or Path.cwd())
    search_path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
    environment = {**os.environ, "PYTHONPATH": search_path, **(settings or {})}
    if not hasattr(os, "fork"):
        return subprocess.run(
            [sys.executable, *options, "-c", script, *arguments],
            input=text,
            capture_output=True,
            encoding="utf-8",
            cwd=where,
            env=environment,
            timeout=timeout,
            check=check,
        )
    server, files = _start_server(modules, options)
    for file in files:
        file.seek(0)
        file.truncate()
    files[0].write(text.encode())
    files[0].seek(0)
    order: dict[str, object] = {
        "script": script,
        "arguments": [program, *arguments],
        "folder": where,
        "environment": environment,
        # In the full suite, scripts run the finalization of Python, so that messages of libraries
        # at the end are seen.
        "ends": is_full(),
    }
    server.stdin.write(json.dumps(order) + "\n")
    timer = threading.Timer(timeout, _kill, [int(server.stdout.readline())])
    timer.start()
    code = int(server.stdout.readline())
    timed_out = not timer.is_alive()
    timer.cancel()
    out, err = (
        os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode() for file in files[1:]
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


@cache
def _start_server(modules: tuple[str, ...], options: tuple[str, ...]) -> tuple[Any, list[Any]]:
    """Start the server process, and return it with the files that its forks use as standard streams."""
    # These files stay open until this process ends.
    files = [tempfile.TemporaryFile(buffering=0) for _ in range(3)]  # noqa: SIM115
    numbers = [file.fileno() for file in files]
    server = subprocess.Popen(
        [sys.executable, *options, "-m", "tests.scripts", *map(str, numbers), *modules],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        bufsize=1,
        pass_fds=numbers,
        cwd=ROOT,
        env={**_get_blas_kernels(), **os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    atexit.register(_stop, server, files)
    return server, files


def _get_blas_kernels() -> dict[str, str]:
    """Return the variable that makes OpenBLAS use the same kernels on each processor that has AVX2.

    By default OpenBLAS picks kernels by the processor, and the last digits of results differ. The
    optimizer of OpenSim's CMCTool converged with those for Haswell (also used for AMD's Zen), and
    failed with those for newer Intel processors on the same input.
    """
    try:
        has_avx2 = " avx2 " in Path("/proc/cpuinfo").read_text()
    except OSError:
        has_avx2 = False
    return {"OPENBLAS_CORETYPE": "Haswell"} if has_avx2 else {}


def _stop(server: Any, files: list[Any]) -> None:
    """End the server process and close its files."""
    with server:
        server.stdin.close()
    for file in files:
        file.close()


def copy_for_orders() -> dict[str, Any]:
    """Fork this process for each order, and return the order in the child that is to run it.

    Returns:
        Order with the script, its arguments, folder and environment, and whether Python ends as
        usual.

    Raises:
        SystemExit: there are no more orders.
    """
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # Garbage collection in the children would copy the memory pages of all imported modules.
    gc.freeze()
    for line in sys.stdin:
        order: dict[str, Any] = json.loads(line)
        child = os.fork()
        if not child:
            for number, own in enumerate(map(int, sys.argv[1:4])):
                os.dup2(own, number)
            sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
            os.environ.clear()
            os.environ.update(order["environment"])
            os.chdir(order["folder"])
            sys.path[0] = order["folder"]
            sys.argv = order["arguments"]
            return order
        print(child, file=answers, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), file=answers, flush=True)
    raise SystemExit


def main() -> None:
    """Import the modules, and run one script in each fork of this process."""
    # Imports may change environment variables and search paths; `copy_for_orders` sets those of the
    # order.
    for name in sys.argv[4:]:
        import_module(name)
    order = copy_for_orders()
    code: object = None
    try:
        exec(compile(order["script"], "<script>", "exec"), {"__name__": "__main__"})
    except SystemExit as ended:
        if order["ends"]:
            raise
        code = ended.code
    if not order["ends"]:
        leave(code)


if __name__ == "__main__":
    main()
