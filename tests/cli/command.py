"""The command ``osimlite`` as a user calls it, in a process of its own."""

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
    """Call ``osimlite`` with some words in a folder, with a text on its standard input."""
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
