"""Several laws compiled side by side: further Python processes take their shares, since threads share Python's lock."""

from __future__ import annotations

import base64
import json
import multiprocessing
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

from osimlite._cores import cores
from osimlite.codegen.sources import collect_functions
from osimlite.errors import OsimliteError
from osimlite.simulation.elements.laws import law_of
from osimlite.simulation.engines.machine_code import digest_of

SHARE = 14_000
"""So much Python code (bytes) is worth a process of its own: less is compiled before that has loaded the compiler."""

PROGRAM = f"from {__name__} import serve; serve()"


class Made(NamedTuple):
    """A law that was compiled: its name, the digest of its sources, its code, and what the code is called there."""

    name: str
    digest: str
    code: bytes
    symbol: str


def shares(names: Sequence[str], cores: int) -> list[list[str]]:
    """Laws in groups that take about equally long to compile, for at most so many processes."""
    sizes = {name: size_of(name) for name in names}
    groups: list[list[str]] = [[] for _ in range(max(1, min(cores, sum(sizes.values()) // SHARE)))]
    for name in sorted(names, key=lambda name: -sizes[name]):
        min(groups, key=lambda group: sum(sizes[item] for item in group)).append(name)
    return groups


def size_of(name: str) -> int:
    """Python code (bytes) of a law: about as long it takes to compile."""
    return sum(len(part.__code__.co_code) for part in collect_functions(law_of(name)[0]))


def compilers() -> int:
    """How many processes may compile: as many as there are cores, but one if this is itself one of several."""
    if multiprocessing.parent_process() is not None or not Path(sys.executable or "").name.startswith("python"):
        return 1
    return cores()


def made(name: str) -> Made:
    """Compile a law here.

    Raises:
        OsimliteError: numba is of a version whose internals are others.
    """
    from osimlite.simulation.engines.object_code import TESTED, numba_version, translated

    function, directions = law_of(name)
    try:
        from osimlite.simulation.engines.compiler import compiled

        text, symbol = compiled(function, directions)
    except (AttributeError, ImportError, NotImplementedError, TypeError) as error:
        message = f"numba {numba_version()} cannot compile osimlite's kernels ({error}); pip install 'numba{TESTED}'"
        raise OsimliteError(message) from error
    return Made(name, digest_of(function), translated(text), symbol)


def serve() -> None:
    """Compile the laws that the command names, and write them to the standard output, one a line."""
    for wanted in sys.argv[1:]:
        name, digest, code, symbol = made(wanted)
        line = json.dumps([name, digest, base64.b64encode(code).decode(), symbol])
        sys.stdout.buffer.write(line.encode() + b"\n")


class Helper:
    """A process that compiles some laws. What it fails to compile is not there: its parent does that then."""

    def __init__(self, names: Sequence[str]) -> None:
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 - it ends with the helper
        command = [sys.executable, "-P", "-c", PROGRAM, *names]
        silent = subprocess.DEVNULL
        self._process = subprocess.Popen(command, stdin=silent, stdout=self._output, stderr=silent)

    def found(self) -> Iterator[Made]:
        """Wait for the process, and yield what it compiled of the sources of today."""
        self._process.wait()
        self._output.seek(0)
        for line in self._output.read().splitlines():
            name, digest, code, symbol = json.loads(line)
            if digest == digest_of(law_of(name)[0]):
                yield Made(name, digest, base64.b64decode(code), symbol)

    def __enter__(self) -> Helper:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        self._output.close()
