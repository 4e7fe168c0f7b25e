"""Run OpenSim tools as requested on standard input, one JSON line with folder, class and setup each.

Each tool runs in a child process. A crash is therefore a result too, and no run affects the next
one. The answer says how the run ended (``done``, ``false``, ``raises``, ``crashes``, ``hangs``),
and has the message of the exception and the warnings of the log.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
from pathlib import Path

import opensim

# Limit of processor time (s) for one tool.
SECONDS = 12
# File in the folder of the tool with everything that the tool prints.
LOG = ".log"


def run(kind: str, setup: str) -> str:
    """Run a tool in the current folder; return how it ended, followed by the message of an exception."""
    try:
        # The constructors ignore the root tag of the setup; opensim-cmd selects the class by it.
        result = opensim.OpenSimObject.makeObjectFromFile(setup)
        if result is None or result.getConcreteClassName() != kind:
            return f"raises no {kind}"
        tool = getattr(opensim, kind)(setup)
        if kind == "MocoStudy":
            solution = tool.solve()
            solution.unseal()
            solution.write("solution.sto")
            return "done" if solution.success() else "false"
        return "done" if tool.run() else "false"
    except RuntimeError as error:
        return f"raises {error}"


def answer(folder: str, kind: str, setup: str) -> dict[str, object]:
    """Run a tool in a child process and return the result.

    Returns:
        How the run ended (``end``), the exception (``message``), and the warnings (``log``).
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.chdir(folder)
        log = os.open(LOG, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(log, 1)
        os.dup2(log, 2)
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000_000, 50_000_000))
        signal.alarm(5 * SECONDS)
        os.write(writer, run(kind, setup).encode("utf-8", "replace")[:4000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        end = pipe.read().decode("utf-8", "replace")
    _, status = os.waitpid(child, 0)
    lines = (Path(folder) / LOG).read_text(errors="replace").splitlines()
    told = [
        line
        for line in lines
        if line.startswith(("[warning]", "[error]")) and "Couldn't find file" not in line
    ]
    if status:
        end = (
            "hangs"
            if status & 127 in (signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL)
            else "crashes"
        )
    how, _, message = end.partition(" ")
    return {"end": how, "message": " ".join(message.split()), "log": told}


if __name__ == "__main__":
    opensim.Logger.setLevelString("Warn")
    opensim.Logger.removeFileSink()
    for line in sys.stdin:
        print(json.dumps(answer(**json.loads(line))), flush=True)
