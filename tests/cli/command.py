"""Run the command ``osimlite`` as a user does, in a separate process."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from tests.scripts import ROOT, run_script

PROGRAM = "import osimlite.cli; osimlite.cli.main()"


class Done(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


def run(*words: object, folder: Path | None = None, text: str = "") -> Done:
    """Run ``osimlite`` and return its exit code and output.

    Args:
        words: arguments of the command.
        folder: working folder; by default the current one.
        text: standard input.
    """
    result = run_script(
        PROGRAM,
        *words,
        program="osimlite",
        text=text,
        folder=folder,
        settings={"COLUMNS": "80", "PYTHONPATH": str(ROOT)},
        timeout=120.0,
        check=False,
        modules=("tests.cli.preload",),
        options=(),
    )
    assert "Traceback" not in result.stderr, result.stderr
    return Done(result.returncode, result.stdout, result.stderr)
