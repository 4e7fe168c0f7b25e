"""Says of each model file named on standard input whether OpenSim takes it; run by tests, in a process of its own.

Each file is loaded and initialised in a child of this process, so that a crash in OpenSim is a
verdict too and nothing that one file does to OpenSim's defaults reaches the next. One line of JSON
answers each line: None, or the message.
"""

from __future__ import annotations

import json
import os
import signal
import sys

import opensim

SECONDS = 60


def verdict(path: str) -> str | None:
    """What OpenSim says against a file, None if it takes it."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(SECONDS)
        # What OpenSim prints must not mix with the answers.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        try:
            opensim.Model(path).initSystem()
            message = ""
        except RuntimeError as error:
            message = str(error) or "an exception without a message"
        os.write(writer, message.encode("utf-8", "replace")[:4000])
        os._exit(0)
    os.close(writer)
    with os.fdopen(reader, "rb") as pipe:
        message = pipe.read().decode("utf-8", "replace")
    _, status = os.waitpid(child, 0)
    return message or (f"killed by signal {status & 127}" if status else None)


if __name__ == "__main__":
    opensim.Logger.setLevelString("Off")
    opensim.Logger.removeFileSink()
    for line in sys.stdin:
        print(json.dumps(verdict(line.rstrip("\n"))), flush=True)
