"""Report for each model file named on standard input whether OpenSim accepts it.

Tests run this script as a process of its own. It loads and initialises each file in a child
process. A crash in OpenSim is therefore a verdict too, and the `<defaults>` of one file do not
affect the next. It answers each line by one line of JSON: null, or the message.
"""

from __future__ import annotations

import json
import os
import signal
import sys

import opensim

# Time (s) after which a model counts as hanging.
SECONDS = 60


def verdict(path: str) -> str | None:
    """Return why OpenSim rejects a model file, or None if it accepts it."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        signal.alarm(SECONDS)
        # OpenSim's log on standard output must not mix with the answers.
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
