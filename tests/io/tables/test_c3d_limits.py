"""Check that the process which reads .c3d files has limits, and reports a reason instead of a traceback."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys

import numpy as np
import pytest

from osimlite.io.tables.c3d_process import describe_failure

resource = pytest.importorskip("resource", reason="limits of processes are those of POSIX")

PROGRAM = """
import resource, sys
import numpy as np
from osimlite.io.tables import c3d_process

def read(path):
    names = (resource.RLIMIT_CPU, resource.RLIMIT_AS, resource.RLIMIT_CORE)
    limits = [resource.getrlimit(name)[0] for name in names]
    return {"times": np.array([float(path)]), "limits": np.array(limits)}

lowest = sys.argv.pop()
if lowest:
    resource.setrlimit(resource.RLIMIT_CPU, (int(lowest), int(lowest)))
c3d_process.READERS["markers"] = read
c3d_process.run_process()
"""


def run(time: str, lowest: str = "") -> subprocess.CompletedProcess[bytes]:
    """Run the process with a reader that returns its limits.

    Args:
        time: limit of processor time (s) that is requested.
        lowest: limit of processor time (s) of the system, empty for none.
    """
    command = [sys.executable, "-c", PROGRAM, "markers", time, "120", lowest]
    return subprocess.run(command, capture_output=True, check=False, timeout=200)


@pytest.mark.parametrize(("lowest", "seconds"), [("", 120), ("90", 90), ("500", 120)])
def test_limits_are_set_as_far_as_the_system_lets(lowest: str, seconds: int) -> None:
    done = run("0.5", lowest)
    assert done.returncode == 0, done.stderr.decode()
    limits = np.load(io.BytesIO(done.stdout))["limits"].tolist()
    assert limits == [seconds, 4_000_000_000, 0]


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (IndexError("list index out of range"), "it is damaged: a part that its header"),
        (KeyError("POINT"), "it is damaged: a part that its header"),
        (MemoryError(), "reading it takes too much memory"),
        (OSError("Parameter type unrecognized: iostream error"), "Parameter type unrecognized"),
        (
            OSError("... set ignoreBadFormatting to true: iostream error"),
            "it is damaged: its sections",
        ),
        (ValueError("it names 0 of 2 markers"), "it names 0 of 2 markers"),
    ],
)
def test_a_reason_has_no_words_of_python(error: Exception, reason: str) -> None:
    message = describe_failure(error)
    assert message.startswith(reason)
    assert not re.search("index|KeyError|POINT|iostream|ignoreBad", message)


@pytest.mark.parametrize(("time", "said"), [("nan", "its frames have no times"), ("x", "'x'")])
def test_the_reason_is_told(time: str, said: str) -> None:
    done = run(time)
    assert done.returncode == 1 and said in json.loads(done.stdout)["error"]
    assert not done.stderr
