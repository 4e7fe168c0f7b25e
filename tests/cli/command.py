"""The command ``osimlite`` as a user calls it, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import osimlite

ROOT = Path(osimlite.__file__).parents[1]


class Done(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


def run(*words: object, folder: Path | None = None, text: str = "") -> Done:
    """Call ``osimlite`` with some words in a folder, with a text on its standard input."""
    done = subprocess.run(
        [sys.executable, "-m", "osimlite", *map(str, words)],
        input=text,
        capture_output=True,
        text=True,
        encoding="utf-8",
        cwd=folder,
        timeout=120,
        check=False,
        env={**os.environ, "COLUMNS": "80", "PYTHONPATH": str(ROOT)},
    )
    assert "Traceback" not in done.stderr
    return Done(done.returncode, done.stdout, done.stderr)
