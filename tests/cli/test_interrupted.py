"""Tests of Ctrl-C: every command ends with a message and exit code 130, wherever the interruption occurs."""

from __future__ import annotations

import subprocess
import sys

import pytest

WRAPPED = """
import sys
from osimlite.cli import info, main
def stopped(*words, **choices):
    try:
        raise KeyboardInterrupt
    except KeyboardInterrupt as error:
        {how}
import osimlite.io.document.reader
osimlite.io.document.reader.read_document = stopped
main(["info", sys.argv[1]])
"""


@pytest.mark.parametrize(
    "how",
    [
        "raise",
        "raise RuntimeError('Error calling __set_name__') from error",
        "raise ImportError('half loaded')",
    ],
)
def test_also_where_it_comes_as_another_error(how: str, repo) -> None:
    model = repo / "fixtures" / "walker" / "DynamicWalkerModel.osim"
    command = [sys.executable, "-c", WRAPPED.format(how=how), str(model)]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, timeout=100, cwd=repo
    )
    assert (done.returncode, done.stderr) == (130, "osimlite: interrupted\n")
