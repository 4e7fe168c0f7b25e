"""The command ``osimlite`` as a user calls it, in a process of its own."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import osimlite
from tests.suite import is_full

ROOT = Path(osimlite.__file__).parents[1]


class Done(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


def run(*words: object, folder: Path | None = None, text: str = "") -> Done:
    """Call ``osimlite`` with some words in a folder, with a text on its standard input."""
    environment = {**os.environ, "COLUMNS": "80", "PYTHONPATH": str(ROOT)}
    where, given = str(folder or Path.cwd()), [*map(str, words)]
    done = (_served if hasattr(os, "fork") else _started)(given, where, text, environment)
    assert "Traceback" not in done.err, done.err
    return done


def _started(words: list[str], folder: str, text: str, environment: dict[str, str]) -> Done:
    done = subprocess.run(
        [sys.executable, "-m", "osimlite", *words],
        input=text,
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=folder,
        timeout=120,
        check=False,
        env=environment,
    )
    return Done(done.returncode, done.stdout, done.stderr)


def _served(words: list[str], folder: str, text: str, environment: dict[str, str]) -> Done:
    server, files = _server()
    for file in files:
        file.seek(0)
        file.truncate()
    files[0].write(text.encode())
    files[0].seek(0)
    # The full suite sees what Python and libraries say as they end.
    order = {"words": words, "folder": folder, "environment": environment, "ends": is_full()}
    server.stdin.write(json.dumps(order) + "\n")
    code = int(server.stdout.readline())
    out, err = (
        os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode() for file in files[1:]
    )
    return Done(code, out, err)


@cache
def _server() -> tuple[Any, list[Any]]:
    """Return the process that starts commands, and the files that they read and write."""
    files = [tempfile.TemporaryFile(buffering=0) for _ in range(3)]  # noqa: SIM115
    numbers = [file.fileno() for file in files]
    server = subprocess.Popen(
        [sys.executable, str(Path(__file__).with_name("served.py")), *map(str, numbers)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1, pass_fds=numbers,
        env={**os.environ, "PYTHONPATH": str(ROOT), "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    atexit.register(_stop, server, files)
    return server, files


def _stop(server: Any, files: list[Any]) -> None:
    """End the process, and close what this one has open for it."""
    with server:
        server.stdin.close()
    for file in files:
        file.close()
