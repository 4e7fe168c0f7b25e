"""Machine code that another process makes while nobody waits for it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from osimlite.simulation.engines.linking import COMPILED, PYTHON, AtHand, Code, has_compiler

PROGRAM = f"from {__name__} import serve; serve()"

_begun: list[subprocess.Popen[bytes]] = []
"""Nobody waits for these, but somebody has to ask whether they have ended."""


class Later(AtHand):
    """Machine code if all of it is in files, else Python, which nobody should wait for.

    Attributes:
        missing: what is in no file.
    """

    def __init__(self) -> None:
        super().__init__("machine code that is in files, or later")
        self.missing: list[str] = []

    def chosen_for(self, functions: Sequence[str]) -> Code:
        """What is there."""
        from osimlite.simulation.engines.machine_code import is_at_hand

        missing = [name for name in functions if not is_at_hand(name)]
        self.missing += missing
        return PYTHON if missing else COMPILED


def is_possible() -> bool:
    """Whether another process can compile."""
    return has_compiler() and Path(sys.executable or "").name.startswith("python")


def begin(names: Sequence[str]) -> None:
    """Have another process compile laws; it goes on when this one ends."""
    command = [sys.executable, "-P", "-c", PROGRAM, *dict.fromkeys(names)]
    silent = subprocess.DEVNULL
    _begun[:] = [process for process in _begun if process.poll() is None]
    _begun.append(subprocess.Popen(command, stdin=silent, stdout=silent, stderr=silent, start_new_session=True))


def serve() -> None:
    """Compile the laws that the command names, unless another process does; everything else comes first."""
    from osimlite.simulation.engines.machine_code import make_ready
    from osimlite.simulation.engines.object_code import alone

    if hasattr(os, "nice"):
        os.nice(10)
    with alone() as is_first:
        if is_first:
            make_ready(sys.argv[1:])
